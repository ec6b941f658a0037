"""The model of a fit: what a scenario gives for values of its free keys, where data were measured.

Channels are sampled by the integrator at the times of the data themselves, between its steps as the
samples of any result are: there is no interpolation between samples. At an event, where a channel
may jump, the value is that immediately after it.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ArgumentError, InputError, ScenarioError, unknown
from frictionsim.parameter_study.fit_data import Measured, Target
from frictionsim.parameter_study.fit_keys import FreeKey
from frictionsim.parameter_study.keys import expanded, factor
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Record
    from frictionsim.scenario.settings import Scenario

    Array = npt.NDArray[np.float64]

SAME_TIME = 1e-12  # relative to the time: a sample at an event
NEAR_ZERO = 1e-3  # of the values that the runs gave
EXACT, FIXED_ERROR = 1e-6, 1e-3  # of the data; the latter is the error of runs with fixed steps
MAX_REMEMBERED, MAX_NUMBERS = 512, 20_000_000  # evaluations, and numbers in them


def _nothing(t: float) -> None:
    pass


class Model(NamedTuple):
    """What the scenario gives for some values of its keys.

    Attributes
    ----------
    values : (n,) or None
        In the order of the data; None if a run failed.
    reason : str
        Why it failed.
    doubt : str
        Which checks of the audit failed.
    warnings : dict of int
        How many of the runs have each warning.
    """

    values: "Array | None"
    reason: str = ""
    doubt: str = ""
    warnings: Mapping[str, int] = MappingProxyType({})


class FitProblem:
    """A scenario, its free keys and the data.

    Parameters
    ----------
    scenario : Scenario
    keys : tuple of FreeKey
    data : Measured
    on_run : callable
        Called with the number of runs so far.

    Attributes
    ----------
    runs : int
        How many runs there were.
    units : dict of str
        The units of the targets, by name; of quantities after the first run.
    least, largest : (n,)
        What the runs that succeeded gave so far, in the order of the data.
    known : list of (Array, float or None)
        Of a single value: the scaled places so far, and what the scenario gives there; None of a
        run that failed.
    """

    def __init__(
        self,
        scenario: "Scenario",
        keys: tuple[FreeKey, ...],
        data: Measured,
        on_run: Callable[[int], Any],
    ) -> None:
        self.scenario, self.keys, self.data = scenario, keys, data
        self.runs, self._on_run = 0, on_run
        self.units = {t.name: t.unit for t in data.targets}
        self._seen: dict[bytes, Model] = {}
        self.least, self.largest = np.full(data.size, np.inf), np.full(data.size, -np.inf)
        self.known: list[tuple[Array, float | None]] = []
        self._times, self._sampled = self._sample_times()
        self._base = scenario
        only_channels = all(target.of == "channel" for target in data.targets)
        if only_channels and 0.0 < self._times[-1] < scenario.solver.duration:
            self._base = scenario.replace({"solver.duration": float(self._times[-1])})

    def _sample_times(self) -> "tuple[Array, list[float] | None]":
        """Return the times of the data, and those of the samples; None for the scenario's own."""
        times, scenario = self.data.times, self.scenario
        if not times.size:
            return times, None
        ends = [0.0, float(times[-1])]
        if any(target.of == "quantity" for target in self.data.targets):
            # Means over time are taken from samples.
            duration, interval = scenario.solver.duration, scenario.interval
            ends = [*np.arange(0.0, duration * (1.0 - SAME_TIME), interval).tolist(), duration]
        return times, np.unique(np.concatenate((times, ends))).tolist()

    def values(self, x: "Array") -> dict[str, float]:
        """Return the values of the keys at a scaled place."""
        return {key.key: key.value(float(p)) for key, p in zip(self.keys, x, strict=True)}

    def at(self, x: "Array") -> Model:
        """Return the model values at a scaled place; a failed run gives the reason."""
        place = np.asarray(x, dtype=np.float64).tobytes()
        if place not in self._seen:
            if len(self._seen) >= min(MAX_REMEMBERED, 1 + MAX_NUMBERS // self.data.size):
                self._seen.clear()
            self._seen[place] = self._evaluate(self.values(x))
            self._remember(x, self._seen[place].values)
        return self._seen[place]

    def _remember(self, x: "Array", values: "Array | None") -> None:
        if values is not None:
            self.least = np.minimum(self.least, values)
            self.largest = np.maximum(self.largest, values)
        if self.data.size == 1:
            self.known.append((x.copy(), None if values is None else float(values[0])))

    @property
    def accuracy(self) -> "Array":
        """The residuals (n,) below which the runs give the data exactly."""
        targets = self.data.targets
        size = np.concatenate([t.scale for t in targets])
        if self.data.size == 1:  # without a spread of data; a value near 0 has that of the runs
            size = np.maximum(np.abs(targets[0].values), NEAR_ZERO * (self.largest - self.least))
        rtol = FIXED_ERROR if self.scenario.pair.fixed_step else 10.0 * self.scenario.solver.rtol
        return np.asarray(size * max(EXACT, min(rtol, FIXED_ERROR)))

    def gives(self, x: "Array") -> bool:
        """Return whether a scaled place at which the runs succeed gives the data exactly."""
        return bool((np.abs(residuals_of(self, x)) <= self.accuracy).all())

    def _evaluate(self, values: dict[str, float]) -> Model:
        found, doubt = [np.empty(target.values.size) for target in self.data.targets], ""
        warnings: Counter[str] = Counter()
        for number, row in enumerate(self.data.runs):
            result, reason = self._run({**values, **row})
            if result is None:
                return Model(None, reason)
            doubt = doubt or reason
            # The times of the samples are those of the data, not of output.interval.
            warnings.update(w for w in result.warnings if not w.startswith("output.interval"))
            for target, into in zip(self.data.targets, found, strict=True):
                here = target.runs == number
                if not here.any():
                    continue
                part: Any = (
                    self._channel(target, result)
                    if target.of == "channel"
                    else self._quantity(target, result)
                )
                if part is None or not np.isfinite(part).all():
                    return Model(None, f"the run gives no {target.name}")
                into[here] = part
        return Model(np.concatenate(found), doubt=doubt, warnings=warnings)

    def _run(self, values: Mapping[str, float]) -> "tuple[Record | None, str]":
        self.runs += 1
        try:
            scenario = self._base.replace(expanded(values))
            result = run(scenario, _nothing, sample_times=self._sampled)
        except ScenarioError as error:
            return None, error.faults[0].removeprefix("overrides: ")
        except InputError as error:  # numbers out of range
            return None, str(error)
        self._on_run(self.runs)
        return (result if result.status == "done" else None), result.reason

    def _channel(self, target: Target, result: "Record") -> "Array":
        name, _, member = target.name.partition(".")
        channels = [known for known in result.channels if known != "time"]
        if name not in channels:
            raise ArgumentError(
                "channels", f"this scenario has no channel '{name}'; it has {', '.join(channels)}"
            )
        channel = np.asarray(result.channels[name])
        if member:
            members = result.members[result.axes[name]]
            if member not in members:
                raise ArgumentError(
                    "channels", f"{name}: {unknown('member', member, list(members))}"
                )
            channel = channel[:, members.index(member)]
        places = np.searchsorted(result.time, target.times)
        found = channel[np.minimum(places, len(channel) - 1)].astype(np.float64)
        after = result.events.get(f"{name}_after")
        if after is not None:
            for transition, value in zip(result.transitions, after, strict=True):
                near = np.abs(target.times - transition.time) <= SAME_TIME * transition.time
                found[near] = value
        return found

    def _quantity(self, target: Target, result: "Record") -> "float | None":
        if target.name not in result.quantities:
            raise ArgumentError(
                "quantities", unknown("quantity", target.name, list(result.quantities))
            )
        quantity = result.quantities[target.name]
        if quantity.value is None:
            return None
        unit = target.unit or quantity.unit
        self.units[target.name] = unit
        try:
            return quantity.value / factor(unit, quantity.unit)
        except InputError as error:
            raise ArgumentError("units", f"{target.name}: {error}") from None


def residuals_of(problem: FitProblem, x: "Array") -> "Array":
    """Return data minus fit at a scaled place at which the runs succeed."""
    model = problem.at(x)
    if model.values is None:
        raise ValueError(f"a fit has no residuals where a run fails: {model.reason}")
    return np.concatenate([t.values for t in problem.data.targets]) - model.values
