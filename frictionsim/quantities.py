"""Named figures with units: what a summary shows and a script reads."""

from typing import NamedTuple


class Quantity(NamedTuple):
    """A figure of merit; `value` is None where the run or the scene has none."""

    value: float | None
    unit: str


Quantities = dict[str, Quantity]
