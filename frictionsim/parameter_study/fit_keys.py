"""The free keys of a fit: their bounds, starts, and scaling to the interval from 0 to 1."""

from collections.abc import Callable, Mapping, Sequence
from math import exp, isfinite, log
from types import NoneType
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import numpy as np

from frictionsim.errors import ArgumentError, ScenarioError
from frictionsim.parameter_study.keys import expanded, names_in
from frictionsim.scenario.model_fields import fields_of_key, unit_of_key

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.parameter_study.fit_data import Measured
    from frictionsim.scenario.settings import Scenario

    Array = npt.NDArray[np.float64]

LOG_RATIO = 100.0  # of bounds, from which on a key is scaled by its logarithm
NOT_PHYSICAL = ("solver", "output", "kind", "title")
ADVICE = "a free key needs bounds, as effects.shaft_friction.mu_s=0.05:0.4"
MAX_RUNS = 10_000  # that data may have rows for
TRIES = 64  # points in the bounds at which a valid start is searched for
LIMITS: dict[
    str, tuple[Callable[[float, float], bool], str]
] = {  # of fields, and what is wrong with a bound beyond them
    "gt": (lambda value, limit: value <= limit, "above"),
    "ge": (lambda value, limit: value < limit, "of at least"),
    "lt": (lambda value, limit: value >= limit, "below"),
    "le": (lambda value, limit: value > limit, "of at most"),
}


class FreeKey(NamedTuple):
    """A key whose value is fitted.

    Attributes
    ----------
    key : str
        With commas between the names of several keys that have one value.
    low, high : float
        Its bounds.
    start : float
    unit : str
        Empty if it is not known.
    """

    key: str
    low: float
    high: float
    start: float
    unit: str

    @property
    def is_log(self) -> bool:
        """Whether its logarithm is scaled: the bounds span two decades or more."""
        return self.low > 0.0 and self.high >= LOG_RATIO * self.low

    def scaled(self, value: float) -> float:
        """Return where a value is between the bounds, from 0 to 1."""
        if self.is_log:
            return log(value / self.low) / log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value(self, x: float) -> float:
        """Return the value at a place between the bounds."""
        if self.is_log:
            found = self.low * exp(x * log(self.high / self.low))
        else:
            found = self.low + x * (self.high - self.low)
        return min(max(found, self.low), self.high)

    def derivative(self, x: float) -> float:
        """Return the derivative of the value at a place between the bounds."""
        if self.is_log:
            return self.value(x) * log(self.high / self.low)
        return self.high - self.low


def free_keys(given: Mapping[str, Any], scenario: "Scenario") -> tuple[FreeKey, ...]:
    """Return the free keys of a scenario, with valid starts.

    Parameters
    ----------
    given : mapping
        (low, high) or (low, high, start) by key; several keys with commas between them have one
        value.
    scenario : Scenario
    """
    if not given:
        raise ArgumentError("free", f"expected at least one key; {ADVICE}")
    keys, chosen = [], []
    for key, bounds in given.items():
        low, high, start = _bounds(key, bounds)
        names = names_in(key)
        for name in names:
            _check_key(name, low, high, scenario)
        if start is None:
            own = value_of(scenario, names[0])
            start = own if own is not None and low <= own <= high else _middle(low, high)
        else:
            chosen.append(key)
        keys.append(FreeKey(key, low, high, start, unit_of_key(type(scenario), names[0])))
    return _with_valid_starts(tuple(keys), chosen, scenario)


def _bounds(key: str, given: Any) -> tuple[float, float, float | None]:
    try:
        numbers = [float(number) for number in given]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(isfinite, numbers)):
        raise ArgumentError(
            "free", f"{key}: expected bounds (low, high) or (low, high, start); {ADVICE}"
        )
    low, high = numbers[:2]
    if not low < high:
        raise ArgumentError(
            "free", f"{key}: the lower bound {low:g} is not below the upper bound {high:g}"
        )
    start = numbers[2] if len(numbers) == 3 else None
    if start is not None and not low <= start <= high:
        raise ArgumentError(
            "free", f"{key}: the start {start:g} is not between {low:g} and {high:g}"
        )
    return low, high, start


def _middle(low: float, high: float) -> float:
    """Return a short number between two others."""
    middle = 0.5 * (low + high)
    short = float(f"{middle:.4g}")
    return short if low <= short <= high else middle


def _check_key(key: str, low: float, high: float, scenario: "Scenario") -> None:
    """Check that a key takes any number between its bounds, as far as it alone decides that."""
    if key.split(".")[0] in NOT_PHYSICAL:
        raise ArgumentError("free", f"{key}: expected a key of mechanism, drive or effects")
    fields = fields_of_key(type(scenario), key)
    if len(fields) != 1:
        return
    (field,) = fields
    kinds = set(get_args(field.annotation) or (field.annotation,)) - {NoneType}
    if kinds == {int}:
        raise ArgumentError("free", f"{key}: takes whole numbers, which cannot be fitted")
    for limit in field.metadata:
        for name, (is_beyond, relation) in LIMITS.items():
            bound = getattr(limit, name, None)
            if not isinstance(bound, int | float):
                continue
            wrong = next((value for value in (low, high) if is_beyond(value, bound)), None)
            if wrong is not None:
                raise ArgumentError(
                    "free", f"{key}: expected bounds {relation} {bound:g}, got {wrong:g}"
                )


def value_of(scenario: "Scenario", key: str) -> float | None:
    """Return the number that a scenario has for a key; None if it has none."""
    value: Any = scenario.to_dict()
    for part in key.split("."):
        try:
            value = value[int(part)] if isinstance(value, list | tuple) else value[part]
        except (KeyError, TypeError, ValueError, IndexError):
            return None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _with_valid_starts(
    keys: tuple[FreeKey, ...], chosen: Sequence[str], scenario: "Scenario"
) -> tuple[FreeKey, ...]:
    """Return the keys with starts that make a valid scenario together.

    Those that were not chosen are moved if need be, as one coefficient must not exceed another.
    """
    fault = fault_of(scenario, {key.key: key.start for key in keys})
    if not fault:
        return keys
    for point in latin_hypercube(TRIES, len(keys), np.random.default_rng(0)):
        moved = tuple(
            key if key.key in chosen else key._replace(start=key.value(x))
            for key, x in zip(keys, point, strict=True)
        )
        if not fault_of(scenario, {key.key: key.start for key in moved}):
            return moved
    raise ArgumentError("free", fault)


def check_runs(data: "Measured", keys: tuple[FreeKey, ...], scenario: "Scenario") -> None:
    """Check that each row of the data makes a valid scenario with the starts of the keys."""
    if len(data.runs) > MAX_RUNS:
        raise ArgumentError(
            "data", f"{len(data.runs)} rows, each a run of each step; the limit is {MAX_RUNS}"
        )
    starts = {key.key: key.start for key in keys}
    for number, row in enumerate(data.runs, start=1):
        fault = fault_of(scenario, {**starts, **row}) if row else ""
        if fault:
            raise ArgumentError("over", f"row {number} of the data: {fault}")


def fault_of(scenario: "Scenario", values: Mapping[str, Any]) -> str:
    """Return the fault of a scenario with these values; empty without one."""
    try:
        scenario.replace(expanded(values))
    except ScenarioError as error:
        return "; ".join(fault.removeprefix("overrides: ") for fault in error.faults)
    return ""


def latin_hypercube(count: int, dimensions: int, rng: np.random.Generator) -> "Array":
    """Return points (count, dimensions) in the unit cube: each count-th of each axis has one."""
    places = [rng.permutation(count) for _ in range(dimensions)]
    return (np.array(places).T + rng.random((count, dimensions))) / count
