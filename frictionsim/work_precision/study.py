"""A work-precision study: errors and run times of a scenario for several settings."""

import gc
from collections.abc import Callable, Iterable
from math import inf
from statistics import median
from typing import TYPE_CHECKING, Any

from frictionsim.errors import EXIT_DONE, InputError, SolverError
from frictionsim.results import Quantity, Record, SolverStatistics, failures
from frictionsim.scenario.methods import METHODS
from frictionsim.scenario.variants import Limit, Setting
from frictionsim.simulation.monitor import Monitors, RunMonitor, WallTimeLimit
from frictionsim.simulation.simulate import run
from frictionsim.work_precision.outcome import (
    Comparable,
    Error,
    Plan,
    Reference,
    ReferenceOutcome,
    Row,
    WorkPrecision,
    metric_errors,
)
from frictionsim.work_precision.settings import ScenarioVariants

if TYPE_CHECKING:
    from frictionsim.results import Metric
    from frictionsim.scenario.settings import Scenario

# A belt of fine bodies converges with the square of their length.
ORDER = 2


def extrapolated(fine: "Record", coarse: "Record", metrics: "Iterable[Metric]") -> ReferenceOutcome:
    """Return the limit of two runs on meshes of ratio 2, by Richardson.

    Parameters
    ----------
    fine, coarse : Record
        Sampled at the same times.
    metrics : iterable of Metric
        Only their channels are extrapolated, and all quantities that both runs have.

    Returns
    -------
    ReferenceOutcome
        Its events and checks are those of the fine run.
    """
    share = 1.0 / (2**ORDER - 1)
    channels = {
        name: fine.channels[name] + share * (fine.channels[name] - coarse.channels[name])
        for name in (metric.source for metric in metrics if metric.what == "channel")
    }
    quantities = {}
    for name, quantity in fine.quantities.items():
        other = coarse.quantities.get(name)
        if quantity.value is not None and other is not None and other.value is not None:
            value = quantity.value + share * (quantity.value - other.value)
            quantities[name] = Quantity(value, quantity.unit)
    return ReferenceOutcome(channels, fine.transitions, quantities, fine.checks)


# A setting is not repeated after this total time, s: the timing is accurate enough.
SECONDS_OF_REPEATS = 1.0
# The wall-time limit of a reference, relative to that of the other runs.
REFERENCE_TIME_FACTOR = 10.0
# The same for a run of a limit of meshes: half the length of a body takes four times as long.
LIMIT_TIME_FACTOR = 40.0


class Stopped(Exception):
    """A signal stopped a run of the study."""

    def __init__(self, run: Record) -> None:
        super().__init__(run.reason)
        self.run = run


class Benchmark:
    """Runs the settings of a study within the wall-time limit.

    Parameters
    ----------
    variants : ScenarioVariants
    metrics : iterable of Metric
    max_wall : float, s
        Limit of each run.
    repeats : int
        Maximum number of timed runs of each setting.
    """

    def __init__(
        self, variants: ScenarioVariants, metrics: "Iterable[Metric]", max_wall: float, repeats: int
    ) -> None:
        self._variants, self._metrics = variants, tuple(metrics)
        self._checks = {m.source for m in self._metrics if m.what == "check"}
        self._max_wall, self._repeats = max_wall, repeats
        self._warm: set[str] = set()
        self._limit_records: dict[Setting, Record] = {}

    def reference(self, settings: tuple[Setting, ...], monitor: RunMonitor) -> Reference:
        """Solve with the settings of the references; the first that is done is the reference.

        Raises
        ------
        SolverError
            If all of them fail.
        Stopped
            If a signal stopped a run.
        """
        runs, names, reasons = [], [], []
        for setting in settings:
            self._warm_up(setting, monitor)
            max_wall = self._max_wall * REFERENCE_TIME_FACTOR
            result = _run(self._variants.judged(setting), monitor, max_wall)
            name = setting.name
            if result.status == "done":
                runs.append(result)
                names.append(name)
            else:
                reasons.append(f"{name}: {result.reason}")
        if not runs:
            raise SolverError(f"all reference runs failed: {'; '.join(reasons)}")
        duration = self._variants.duration
        floor = metric_errors(self._metrics, runs[1], runs[0], duration) if len(runs) > 1 else {}
        return Reference(runs[0], tuple(names), floor)

    def limit(self, limits: tuple[Limit, ...], monitor: RunMonitor) -> Reference:
        """Solve on the meshes of the limits; the first limit that is known is the reference.

        Raises
        ------
        SolverError
            If none of them is known.
        Stopped
            If a signal stopped a run.
        """
        references, names, reasons = [], [], []
        for limit in limits:
            try:
                runs = [self._limit_record(setting, monitor) for setting in limit]
                failed = [r.reason for r in runs if r.status != "done"]
            except InputError as refused:
                failed = [one_line(refused)]
            if failed:
                reasons.append(f"{limit.name}: {failed[0]}")
            else:
                references.append(extrapolated(runs[0], runs[1], self._metrics))
                names.append(limit.name)
        if not references:
            raise SolverError(
                f"no mesh is fine enough to judge by: {'; '.join(reasons)}; compare fewer bodies"
                " or allow each run more wall time"
            )
        duration = self._variants.duration
        several = len(references) > 1
        floor = (
            metric_errors(self._metrics, references[1], references[0], duration) if several else {}
        )
        return Reference(references[0], tuple(names), floor)

    def _limit_record(self, setting: Setting, monitor: RunMonitor) -> Record:
        if setting not in self._limit_records:
            self._warm_up(setting, monitor)
            limit = self._max_wall * LIMIT_TIME_FACTOR
            self._limit_records[setting] = _run(self._variants.judged(setting), monitor, limit)
        return self._limit_records[setting]

    def row(
        self,
        setting: Setting,
        reference: Comparable,
        monitor: RunMonitor,
        in_time: Comparable | None = None,
    ) -> Row:
        """Solve once for the errors, and several times for the wall time.

        Parameters
        ----------
        setting : Setting
        reference : Comparable
        monitor : RunMonitor
        in_time : Comparable, optional
            The same mesh, converged in time.

        Raises
        ------
        Stopped
            If a signal stopped a run.
        """
        try:
            scenario = self._variants.judged(setting)
        except InputError as refused:  # an effect that the model does not have, too few bodies
            return _refused(setting, one_line(refused))
        self._warm_up(setting, monitor)
        judged = self._limit_records.get(setting) or _run(scenario, monitor, self._max_wall)
        last, seconds = judged, [_seconds(judged)]
        errors: dict[str, Error] = {}
        time_errors: dict[str, Error] = {}
        if judged.status == "done":
            duration = scenario.solver.duration
            last, seconds = self._timed(setting, monitor)
            if last.status == "done":
                errors = metric_errors(self._metrics, judged, reference, duration)
            if last.status == "done" and in_time is not None:
                time_errors = metric_errors(self._metrics, judged, in_time, duration)
        statistics = _statistics(last)
        counts_rejected = METHODS[setting.backend].counts_rejected
        return Row(
            setting=setting,
            status=last.status,
            reason=_audit_text(judged, self._checks) if last.status == "done" else last.reason,
            wall_seconds=median(seconds),
            repeats=len(seconds),
            steps=statistics.steps,
            rejected=statistics.rejected if counts_rejected else None,
            rhs_evaluations=statistics.rhs_evaluations,
            states=statistics.states,
            events=len(judged.transitions),
            errors=errors,
            time_errors=time_errors,
            wall_spread=max(seconds) - min(seconds) if len(seconds) > 1 else None,
        )

    def _warm_up(self, setting: Setting, monitor: RunMonitor) -> None:
        """Load and compile everything that a backend needs, once."""
        if setting.line not in self._warm:
            _run(self._variants.warm_up(setting), monitor, inf)
            self._warm.add(setting.line)

    def _timed(self, setting: Setting, monitor: RunMonitor) -> tuple[Record, list[float]]:
        scenario = self._variants.timed(setting)
        gc.collect()  # automatic garbage collection is off
        seconds: list[float] = []
        while True:
            result = _run(scenario, monitor, self._max_wall)
            seconds.append(_seconds(result))
            enough = len(seconds) >= self._repeats or sum(seconds) > SECONDS_OF_REPEATS
            if enough or result.status != "done":
                return result, seconds


def _run(scenario: "Scenario", monitor: RunMonitor, max_wall: float) -> Record:
    solver = scenario.solver
    limit = WallTimeLimit(max_wall, solver.duration, scenario.budget_advice)
    result = run(scenario, Monitors(monitor, limit))
    if result.status == "interrupted":
        raise Stopped(result)
    return result


def _audit_text(result: Record, metrics: set[str]) -> str:
    """Return the failed checks of the audit, except those that are metrics."""
    failed = failures({name: c for name, c in result.checks.items() if name not in metrics})
    return f"self-audit failed: {failed}" if failed and result.status == "done" else ""


def study(
    scenario: "Scenario",
    plan: Plan,
    max_wall: float,
    repeats: int,
    monitor: RunMonitor,
    show: Callable[[str], Any],
) -> WorkPrecision:
    """Run all settings.

    Parameters
    ----------
    scenario : Scenario
    plan : Plan
    max_wall : float, s
        Limit of each run.
    repeats : int
        Maximum number of timed runs of each setting.
    monitor : RunMonitor
        Called with the time after each step; it may raise Interrupted.
    show : callable
        Called with a description of the next run.

    Returns
    -------
    WorkPrecision
        If a signal stopped it, with the rows of the settings before.
    """
    metrics = plan.metrics
    channels = [m.source for m in metrics if m.what == "channel"] if plan.limits else None
    benchmark = Benchmark(ScenarioVariants(scenario, channels), metrics, max_wall, repeats)
    rows: list[Row] = []
    reference = in_time = None
    status, reason, code = "done", "", EXIT_DONE
    try:
        show("references")
        if plan.references:
            reference = benchmark.reference(plan.references, monitor)
        if plan.limits:
            in_time = reference
            show("references, fine meshes")
            reference = benchmark.limit(plan.limits, monitor)
        if reference is None:
            raise SolverError("a study needs references or limits")
        own = plan.references[0].mesh if plan.references else None
        for number, setting in enumerate(plan.settings, start=1):
            show(f"{number} of {len(plan.settings)}: {setting.name}")
            same = in_time.outcome if in_time and setting.mesh == own else None
            rows.append(benchmark.row(setting, reference.outcome, monitor, same))
    except Stopped as stop:
        status, reason, code = "interrupted", stop.run.reason, stop.run.exit_code
    return WorkPrecision(
        scenario, metrics, reference, rows, status, reason, code, in_time,
        title=scenario.title, kind=scenario.kind,
    )  # fmt: skip


def _refused(setting: Setting, reason: str) -> Row:
    """Return the row of a setting whose scenario is not valid."""
    return Row(setting, "failed", reason, 0.0, 0, 0, None, 0, 0, 0, {})


def one_line(error: Exception) -> str:
    """Return the fault of a scenario in one line of a table."""
    return "; ".join(str(error).splitlines())


def _seconds(run: Record) -> float:
    return _statistics(run).wall_seconds or 0.0  # None is of files only


def _statistics(run: Record) -> SolverStatistics:
    assert run.statistics is not None, "a run that was just solved has them"
    return run.statistics
