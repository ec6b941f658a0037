"""The runs and measurements of a study: settings, errors by metric, rows and references."""

from collections.abc import Iterable, Mapping, Sequence
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from frictionsim.scenario.variants import Limit, Setting

if TYPE_CHECKING:
    from frictionsim.results import Array, Check, Metric, Quantity, Transition
    from frictionsim.scenario.settings import Scenario

# Missing or incomparable data count as 100 % error.
TOTAL_ERROR = 1.0
MAX_DRAWN = 1e100


class Comparable(Protocol):
    """A run or an exact solution."""

    @property
    def channels(self) -> "Mapping[str, Array]": ...

    @property
    def transitions(self) -> "Sequence[Transition]": ...

    @property
    def quantities(self) -> "Mapping[str, Quantity]": ...

    @property
    def checks(self) -> "Mapping[str, Check]": ...


class ReferenceOutcome(NamedTuple):
    """A reference for runs that is not a run itself; see `Comparable`."""

    channels: "Mapping[str, Array]" = MappingProxyType({})
    transitions: "Sequence[Transition]" = ()
    quantities: "Mapping[str, Quantity]" = MappingProxyType({})
    checks: "Mapping[str, Check]" = MappingProxyType({})


class Error(NamedTuple):
    """An absolute error, None if undefined, and a relative error."""

    absolute: float | None
    relative: float


def metric_errors(
    metrics: "Iterable[Metric]", outcome: Comparable, reference: Comparable, duration: float
) -> dict[str, Error]:
    """Return the error for each metric, by name.

    Parameters
    ----------
    metrics : iterable of Metric
    outcome, reference : Comparable
        Sampled at the same times.
    duration : float, s
        Scale of the errors of event times.
    """
    return {metric.name: _error(metric, outcome, reference, duration) for metric in metrics}


def max_relative_error(errors: "Mapping[str, Error]") -> float:
    """Return the largest relative error."""
    return max((error.relative for error in errors.values()), default=0.0)


def _error(metric: "Metric", outcome: Comparable, reference: Comparable, duration: float) -> Error:
    if metric.what == "events":
        return _event_error(outcome.transitions, reference.transitions, duration)
    if metric.what == "check":
        value = outcome.checks[metric.source].value
        return Error(value, value)
    if metric.what == "channel":
        return _channel_error(
            outcome.channels.get(metric.source), reference.channels[metric.source]
        )
    return _quantity_error(metric, outcome, reference)


def _event_error(
    events: "Sequence[Transition]", expected: "Sequence[Transition]", duration: float
) -> Error:
    same = [(e.contact, e.mode_from, e.mode_to) for e in events] == [
        (e.contact, e.mode_from, e.mode_to) for e in expected
    ]
    if not same:
        return Error(None, TOTAL_ERROR)
    worst = max((abs(a.time - b.time) for a, b in zip(events, expected, strict=True)), default=0.0)
    return Error(worst, worst / duration)


def _channel_error(values: "Array | None", expected: "Array") -> Error:
    if values is None or values.shape != expected.shape:
        return Error(None, TOTAL_ERROR)
    return _scaled(float(np.mean(np.abs(values - expected))), float(np.mean(np.abs(expected))))


def _quantity_error(metric: "Metric", outcome: Comparable, reference: Comparable) -> Error:
    values = [
        side.quantities[metric.source].value if metric.source in side.quantities else None
        for side in (outcome, reference)
    ]
    if values[0] is None or values[1] is None:
        return Error(None, TOTAL_ERROR) if values[0] is not values[1] else Error(0.0, 0.0)
    scale = abs(values[1])
    if metric.scale:
        channel = reference.channels[metric.scale]
        scale = float(np.max(np.abs(channel - channel[0])))
    return _scaled(abs(values[0] - values[1]), scale)


def _scaled(error: float, scale: float) -> Error:
    if error == 0.0:
        return Error(0.0, 0.0)
    return Error(error, error / scale if scale > 0.0 else inf)


class Plan(NamedTuple):
    """The settings and references of a study, and the metrics of their errors.

    Attributes
    ----------
    settings : list of Setting
    references : tuple of Setting
        Different methods, tighter than any of the settings, on the scenario's own mesh if it has
        one. Empty if no setting is of that mesh.
    metrics : tuple of Metric
    limits : tuple of Limit
        Errors are those of the first; the second is compared with it. Empty for a study over time
        alone, whose errors are those against the references.
    """

    settings: list[Setting]
    references: tuple[Setting, ...]
    metrics: "tuple[Metric, ...]"
    limits: tuple[Limit, ...] = ()


class Row(NamedTuple):
    """The results of a setting.

    Attributes
    ----------
    setting : Setting
    status : str
        `done` or `failed`.
    reason : str
        Why it failed, or which checks of the audit failed.
    wall_seconds : float, s
        Median over the repeats, or the time of the failed run.
    repeats : int
        Number of timed runs.
    steps, rejected, rhs_evaluations, states, events : int
        Without evaluations for samples. `rejected` is None if the backend does not report it;
        of a row read from a file, what the file lacks is None.
    errors : dict of Error
        By metric; empty if failed.
    time_errors : mapping of Error
        Against the same mesh converged in time; empty if that is not known, and without meshes.
    wall_spread : float or None, s
        Largest minus least wall time of the repeats; None of a single run.
    unresolved : tuple of str or None
        Names of the errors below the reference uncertainty, of a row read from a file.
    """

    setting: Setting
    status: str
    reason: str
    wall_seconds: float
    repeats: int | None
    steps: int
    rejected: int | None
    rhs_evaluations: int
    states: int | None
    events: int | None
    errors: dict[str, Error]
    time_errors: "Mapping[str, Error]" = MappingProxyType({})
    wall_spread: float | None = None
    unresolved: tuple[str, ...] | None = None

    @property
    def error(self) -> float | None:
        """The largest relative error; None if failed."""
        return max_relative_error(self.errors) if self.status == "done" else None

    @property
    def time_error(self) -> float | None:
        """The largest relative error in time alone; None if it is not known."""
        return max_relative_error(self.time_errors) if self.time_errors else None

    @property
    def is_drawable(self) -> bool:
        """Whether its numbers have a place on logarithmic axes."""
        numbers = (self.wall_seconds, self.rhs_evaluations, self.error, self.time_error)
        return all(0.0 <= number < MAX_DRAWN for number in numbers if number is not None)


class Reference(NamedTuple):
    """The reference of a study.

    Attributes
    ----------
    outcome : Comparable
    names : tuple of str
        Backends and settings of the reference runs that are done.
    floor : dict of Error
        Difference of the two reference runs, by metric; empty if there is only one.
    """

    outcome: Comparable
    names: tuple[str, ...]
    floor: dict[str, Error]

    @property
    def uncertainty(self) -> float:
        """The largest relative difference of the two."""
        return max_relative_error(self.floor)


class WorkPrecision(NamedTuple):
    """A study that was just run, or read from its table; if interrupted, of the settings before.

    Attributes
    ----------
    scenario : Scenario or None
        None of a study read from a table.
    metrics : tuple of Metric
    reference : Reference or None
    rows : list of Row
    status, reason : str
    exit_code : int
    time_reference : Reference or None
        The scenario's own mesh converged in time, in a study of meshes.
    title, kind : str
        Of the scenario; empty where a table does not say.
    notes : tuple of str
        Lines above the table in CSV, such as the machine that it was made on.
    """

    scenario: "Scenario | None"
    metrics: "tuple[Metric, ...]"
    reference: Reference | None
    rows: list[Row]
    status: str
    reason: str
    exit_code: int
    time_reference: Reference | None = None
    title: str = ""
    kind: str = ""
    notes: tuple[str, ...] = ()

    @property
    def of_meshes(self) -> bool:
        """Whether it compares meshes, by a common limit."""
        return any(row.setting.mesh is not None for row in self.rows)

    @property
    def floor(self) -> float:
        """The reference uncertainty: the largest relative difference of the reference runs."""
        return self.reference.uncertainty if self.reference else 0.0

    @property
    def floor_in_time(self) -> float:
        """The same of the references in time; 0 where it is not known."""
        return self.time_reference.uncertainty if self.time_reference else 0.0

    @property
    def drawable(self) -> list[Row]:
        """The rows whose numbers have a place on logarithmic axes."""
        return [row for row in self.rows if row.is_drawable]

    def below_uncertainty(self, row: Row) -> Sequence[str]:
        """Return the names of the errors of a row that are below the reference uncertainty.

        They are not resolved: `error`, `time_error`, and metrics.
        """
        if row.unresolved is not None:
            return row.unresolved
        floors = self.reference.floor if self.reference else {}
        limits = [
            ("error", row.error, self.floor),
            ("time_error", row.time_error, self.floor_in_time),
        ]
        limits += [
            (n, row.errors[n].relative, e.relative) for n, e in floors.items() if n in row.errors
        ]
        return [name for name, error, floor in limits if error is not None and error < floor]
