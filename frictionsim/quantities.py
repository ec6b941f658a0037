"""Named figures with units: what a summary shows and a script reads."""

from math import isfinite
from typing import Any, NamedTuple


class Quantity(NamedTuple):
    """A figure of merit; `value` is None where the run or the scene has none."""

    value: float | None
    unit: str


Quantities = dict[str, Quantity]


def finite(value: float | None) -> float | None:
    """Return a number as JSON has it: null for what is not finite."""
    return value if value is not None and isfinite(value) else None


def quantities_json(quantities: Quantities) -> dict[str, Any]:
    """Return quantities as JSON has them; what is not finite is null there."""
    return {name: {"value": finite(q.value), "unit": q.unit} for name, q in quantities.items()}
