"""The problem of a fit: its free keys, and the values of the scenario where data were measured.

Channels are sampled by the integrator at the times of the data themselves, between its steps as the
samples of any result are: there is no interpolation between samples. At an event, where a channel
may jump, the value is that immediately after it.
"""

import operator
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from math import exp, inf, isfinite, log, nan
from time import perf_counter
from types import NoneType
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import numpy as np

from frictionsim.errors import ArgumentError, InputError, ScenarioError, unknown
from frictionsim.fits.data import Measured, Target
from frictionsim.scenario.model_fields import (
    description_of,
    expanded,
    fields_of_key,
    names_in,
)
from frictionsim.scenario.units import factor, fits
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from frictionsim.results import Array, Record
    from frictionsim.scenario.settings import Scenario

LOG_RATIO = 100.0  # of bounds, from which on a key is scaled by its logarithm
NOT_PHYSICAL = ("solver", "output", "kind", "title")
ADVICE = "a free key needs bounds, e.g. effects.shaft_friction.mu_s=0.05:0.4"
STARTS_ADVICE = "; these are starts of the fit: give other ones, as KEY=LOW:HIGH:START"
MAX_RUNS = 10_000  # rows of the data
# By constraint of a field: whether a bound violates its limit, and the relation required.
LIMITS: dict[str, tuple[Callable[[float, float], bool], str]] = {
    "gt": (operator.le, "above"),
    "ge": (operator.lt, "of at least"),
    "lt": (operator.ge, "below"),
    "le": (operator.gt, "of at most"),
}
SAME_TIME = 1e-12  # relative to the time: a sample at an event
NEAR_ZERO = 1e-3  # of the values that the runs gave
EDGE = 1e-9  # of the bounds: resolution of the edge of failing runs
EXACT, FIXED_ERROR = 1e-6, 1e-3  # of the data; the latter is the error of runs with fixed steps


class FreeKey(NamedTuple):
    """A key whose value is fitted."""

    key: str  # several keys with one value are separated by commas
    low: float
    high: float
    start: float
    unit: str  # empty if it is not known

    @property
    def is_log(self) -> bool:
        """Whether the logarithm is scaled: the bounds span two decades or more."""
        return self.low > 0.0 and self.high >= LOG_RATIO * self.low

    def scaled(self, value: float) -> float:
        """Return the position of a value between the bounds, from 0 to 1."""
        if self.is_log:
            return log(value / self.low) / log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value(self, x: float) -> float:
        """Return the value at a place, which is within the bounds even if the place is not."""
        if self.is_log:
            value = self.low * exp(x * log(self.high / self.low))
        else:
            value = self.low + x * (self.high - self.low)
        return min(max(value, self.low), self.high)

    def derivative(self, x: float) -> float:
        """Return the derivative of the value at a place between the bounds."""
        if self.is_log:
            return self.value(x) * log(self.high / self.low)
        return self.high - self.low


def free_keys(bounds_by_key: Mapping[str, Any], scenario: "Scenario") -> tuple[FreeKey, ...]:
    """Return the free keys of a scenario, whose starts are valid together."""
    if not bounds_by_key:
        raise ArgumentError("free", f"expected at least one key; {ADVICE}")
    keys = tuple(_free_key(key, bounds, scenario) for key, bounds in bounds_by_key.items())
    if fault := fault_of(scenario, {key.key: key.start for key in keys}):
        names = (name for key in keys for name in names_in(key.key))
        are_known = all(fields_of_key(type(scenario), name) for name in names)
        raise ArgumentError("free", fault + STARTS_ADVICE * are_known)
    return keys


def _free_key(key: str, bounds: Any, scenario: "Scenario") -> FreeKey:
    try:
        numbers = [float(number) for number in bounds]
    except (TypeError, ValueError):
        numbers = []
    fault = ""
    if len(numbers) not in (2, 3) or not all(map(isfinite, numbers)):
        numbers, fault = [0.0, 0.0], f"expected bounds (low, high) or (low, high, start); {ADVICE}"
    low, high, *starts = numbers
    names = [name.strip() for name in names_in(key)]
    start = starts[0] if starts else _usual_start(names[0], low, high, scenario)
    if not fault and not low < high:
        fault = f"the lower bound {low:g} is not below the upper bound {high:g}"
    elif not fault and not low <= start <= high:
        fault = f"the start {start:g} is not between {low:g} and {high:g}"
    if fault:
        raise ArgumentError("free", f"{key}: {fault}")
    for name in names:
        if fault := _fault_of_bounds(name, low, high, scenario):
            raise ArgumentError("free", f"{name}: {fault}")
    return FreeKey(",".join(names), low, high, start, description_of(type(scenario), names[0])[0])


def _usual_start(key: str, low: float, high: float, scenario: "Scenario") -> float:
    """Return the value of the scenario if it is within the bounds, else a short one between."""
    value: Any = scenario.to_dict()
    try:
        for part in key.split("."):
            value = value[int(part)] if isinstance(value, list | tuple) else value[part]
    except (KeyError, TypeError, ValueError, IndexError):  # the scenario leaves it out
        value = None
    if isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high:
        return float(value)
    return min(max(float(f"{0.5 * (low + high):.4g}"), low), high)


def _fault_of_bounds(key: str, low: float, high: float, scenario: "Scenario") -> str:
    """Return how the bounds of a key are beyond the limits of its field; empty if they are not."""
    if key.split(".")[0] in NOT_PHYSICAL:
        return "expected a key of mechanism, drive or effects"
    fields = fields_of_key(type(scenario), key)
    if len(fields) != 1:
        return ""
    (field,) = fields
    if {*(get_args(field.annotation) or (field.annotation,))} - {NoneType} == {int}:
        return "takes whole numbers, which cannot be fitted"
    for name, (is_beyond, relation) in LIMITS.items():
        for limit in (getattr(part, name, None) for part in field.metadata):
            wrong = [v for v in (low, high) if limit is not None and is_beyond(v, limit)]
            if wrong:
                return f"expected bounds {relation} {limit:g}, got {wrong[0]:g}"
    return ""


def check_runs(data: Measured, keys: tuple[FreeKey, ...], scenario: "Scenario") -> None:
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


class Model(NamedTuple):
    """The results of a scenario for some values of its keys."""

    values: "Array | None"  # in the order of the data; None if a run failed
    fault: str = ""  # why it failed
    doubt: str = ""  # the failed checks of the audit
    warnings: Sequence[str] = ()  # of each run


class FitProblem:
    """A scenario, its free keys and the data.

    A place (keys,) has the position of each key between its bounds, from 0 to 1. `models` are those
    evaluated, by the bytes of their places. `on_runs` is called with the number of further runs.
    """

    def __init__(
        self,
        scenario: "Scenario",
        keys: tuple[FreeKey, ...],
        data: Measured,
        on_runs: Callable[[int], Any],
    ) -> None:
        self.scenario, self.keys, self.data, self.on_runs = scenario, keys, data, on_runs
        self.models: dict[bytes, Model] = {}
        self.runs, self._seconds = 0, 0.0
        # Units of quantities are added by the first run.
        self.units = {t.name: t.unit for t in data.targets}
        self._sampled = self._sample_times()
        self._base = scenario
        if all(target.kind == "channel" for target in data.targets) and data.times[-1] > 0.0:
            last = min(float(data.times[-1]), scenario.solver.duration)
            self._base = scenario.replace({"solver.duration": last})
        self._combinations = Combinations(self._base, [*(key.key for key in keys), *data.over])

    def _sample_times(self) -> list[float] | None:
        """Return the times of samples: with means over time, those of the scenario, too."""
        times, scenario = self.data.times, self.scenario
        if not times.size:
            return None
        ends = [0.0, float(times[-1])]
        if any(target.kind == "quantity" for target in self.data.targets):
            duration, interval = scenario.solver.duration, scenario.interval
            ends = [*np.arange(0.0, duration * (1.0 - SAME_TIME), interval).tolist(), duration]
        return np.unique(np.concatenate((times, ends))).tolist()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the function that counts runs, for another process."""
        return self.__dict__ | {"on_runs": _nobody}

    def apart(self) -> "FitProblem":
        """Return a copy with models of its own, so that a search makes the same runs anywhere."""
        other = copy(self)
        other.on_runs, other.runs, other.models = self.on_runs, 0, dict(self.models)
        return other

    @property
    def seconds_each(self) -> float:
        """The mean wall time of a model, s."""
        return self._seconds / max(len(self.models), 1)

    def values(self, x: "Array") -> dict[str, float]:
        """Return the values of the keys at a place."""
        return {key.key: key.value(float(p)) for key, p in zip(self.keys, x, strict=True)}

    def model(self, x: "Array") -> Model:
        """Return the model at a place."""
        key = np.asarray(x, dtype=np.float64).tobytes()
        if key not in self.models:
            began = perf_counter()
            self.models[key] = self._evaluate(self.values(x))
            self._seconds += perf_counter() - began
        return self.models[key]

    def works(self, x: "Array") -> bool:
        """Return whether the runs at a place succeed."""
        return self.model(x).values is not None

    def last_good(self, good: "Array", bad: "Array") -> "Array":
        """Return the last place at which the runs succeed, on the way to one at which they fail."""

        def is_valid(x: "Array") -> bool:  # which takes no run
            values = self.values(x)
            try:
                for row in self.data.runs:
                    self._combinations.scenario(tuple({**values, **row}.values()))
            except InputError:
                return False
            return True

        last, _ = bisected(self.works if is_valid(bad) else is_valid, good, bad, EDGE)
        return last if self.works(last) else self.last_good(good, last)

    def fitted(self, x: "Array") -> "Array":
        """Return the values of the scenario at a place at which the runs succeed."""
        model = self.model(x)
        if model.values is None:
            raise ValueError(f"a fit has no values where a run fails: {model.fault}")
        return model.values

    def residuals(self, x: "Array") -> "Array":
        """Return data minus fit at a place at which the runs succeed."""
        return self.data.values - self.fitted(x)

    def cost(self, x: "Array", weights: "Array") -> float:
        """Return half the weighted sum of squares; infinity where a run fails."""
        return 0.5 * float(np.sum((self.residuals(x) * weights) ** 2)) if self.works(x) else inf

    def single(self, x: "Array") -> float | None:
        """Return the scenario's single value at a place; None if the run fails."""
        values = self.model(x).values
        return None if values is None else float(values[0])

    def single_values(self) -> "list[tuple[Array, float]]":
        """Return the `single` values so far and their places, in the order of a single key."""
        places = sorted(map(np.frombuffer, self.models), key=lambda x: float(x[0]))
        return [(x, value) for x in places if (value := self.single(x)) is not None]

    @property
    def reachable(self) -> tuple[float, float]:
        """The least and the largest of single values of all runs."""
        values = [value for _, value in self.single_values()]
        return min(values), max(values)

    def is_exact(self, x: "Array") -> bool:
        """Return whether a place gives the data exactly."""
        if not self.works(x):
            return False
        size = self.data.scale
        if self.data.size == 1:  # no spread of data: near 0 that of the runs
            least, largest = self.reachable
            size = np.maximum(np.abs(self.data.values), NEAR_ZERO * (largest - least))
        rtol = FIXED_ERROR if self.scenario.pair.fixed_step else 10.0 * self.scenario.solver.rtol
        accuracy = size * max(EXACT, min(rtol, FIXED_ERROR))
        return bool((np.abs(self.residuals(x)) <= accuracy).all())

    def _evaluate(self, values: dict[str, float]) -> Model:
        columns = [np.empty(target.values.size) for target in self.data.targets]
        doubt, warnings = "", list[str]()
        for number, row in enumerate(self.data.runs):
            self.runs += 1
            self.on_runs(1)
            of_run = {**values, **row}
            try:
                scenario = self._combinations.scenario(tuple(of_run.values()))
                result = run(scenario, RunMonitor(), sample_times=self._sampled)
            except InputError as error:  # not valid, or numbers out of range
                return Model(None, fault_of(self._base, of_run) or str(error))
            if result.status != "done":
                return Model(None, result.reason or "the run fails")
            doubt = doubt or result.reason
            # Without those about regular samples.
            texts = dict.fromkeys(result.warnings)
            warnings += [text for text in texts if not text.startswith("output.interval")]
            for target, column in zip(self.data.targets, columns, strict=True):
                here = target.runs == number
                if here.any():
                    of_target = self._channel if target.kind == "channel" else self._quantity
                    column[here] = of_target(target, result)
                    if not np.isfinite(column[here]).all():
                        return Model(None, f"the run gives no {target.name}")
        return Model(np.concatenate(columns), doubt=doubt, warnings=warnings)

    def _channel(self, target: Target, result: "Record") -> "Array":
        name, _, member = target.name.partition(".")
        channels = [known for known in result.channels if known != "time"]
        if name not in channels:
            raise ArgumentError(
                "channels", f"this scenario has no channel '{name}'; it has {', '.join(channels)}"
            )
        channel = np.asarray(result.channels[name])
        if member:
            members = list(result.members[result.axes[name]])
            if member not in members:
                raise ArgumentError("channels", f"{name}: {unknown('member', member, members)}")
            channel = channel[:, members.index(member)]
        places = np.searchsorted(result.time, target.times)
        samples = channel[np.minimum(places, len(channel) - 1)].astype(np.float64)
        after = result.events.get(f"{name}_after")
        if after is not None:
            for transition, value in zip(result.transitions, after, strict=True):
                near = np.abs(target.times - transition.time) <= SAME_TIME * transition.time
                samples[near] = value
        return samples

    def _quantity(self, target: Target, result: "Record") -> "Array":
        """Return a quantity in the unit of its data; NaN if it is not defined."""
        if target.name not in result.quantities:
            raise ArgumentError(
                "quantities", unknown("quantity", target.name, list(result.quantities))
            )
        value, own = result.quantities[target.name]
        unit = target.unit or own
        if not target.unit_is_certain and not fits(unit, own):
            unit = own
        self.units[target.name] = unit
        try:
            size = factor(unit, own)
        except InputError as error:
            raise ArgumentError("units", f"{target.name}: {error}") from None
        return np.array(nan if value is None else value / size)


def _nobody(runs: int) -> None:
    """Count no runs."""


def bisected(
    is_good: "Callable[[Array], bool]", good: "Array", bad: "Array", resolution: float
) -> "tuple[Array, Array]":
    """Return the places on both sides of the edge between a good and a bad one."""
    while np.max(np.abs(bad - good)) > resolution:
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if is_good(middle) else (good, middle)
    return good, bad
