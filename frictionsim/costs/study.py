"""A work-precision study: errors and run times of a scenario for several settings."""

import gc
from collections.abc import Iterable, Sequence
from math import inf, nan
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.costs.settings import CostOptions, Plan, variant
from frictionsim.costs.study_table import SECONDS_OF_REPEATS, columns_of, greatest
from frictionsim.display import set_line
from frictionsim.errors import EXIT_DONE, InputError, SolverError
from frictionsim.io.cost_table import RELATIVE, CostTable, Error, Row
from frictionsim.results import Quantity, Record, SolverStatistics, failures
from frictionsim.scenario.methods import METHODS
from frictionsim.scenario.variants import Setting
from frictionsim.simulation.monitor import Monitors, RunMonitor, WallTimeLimit
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from frictionsim.results import Metric
    from frictionsim.scenario.settings import Scenario

SAMPLES = 500  # of the runs for the errors
# Columns of the work of a run; 0 of a setting that is refused.
WORK = ("events", "wall_seconds", "repeats", "steps", "rhs_evaluations", "states")
WARM_UP_FRACTION = 1e-6  # of the duration
# The wall-time limit of a reference, relative to that of the other runs.
REFERENCE_TIME_FACTOR = 10.0
# The same for a run of a limit of meshes: half the length of a body takes four times as long.
LIMIT_TIME_FACTOR = 40.0
NO_REFERENCE = "all reference runs failed: {}"
NO_LIMIT = (
    "no mesh is fine enough to judge by: {}; compare fewer bodies or allow each run more wall time"
)
# A belt of fine bodies converges with the square of their length.
ORDER = 2

# Missing or incomparable data count as 100 % error.
TOTAL_ERROR = Error(None, 1.0)


def _error(metric: "Metric", outcome: Record, reference: Record, duration: float) -> Error:
    """Return the error of a run by a metric, of samples at the same times.

    The duration, s, is the scale of the errors of event times.
    """
    source = metric.source
    if metric.what == "check":
        violation = outcome.checks[source].value
        return Error(violation, violation)
    if metric.what == "events":
        pairs = [(e.contact, e.mode_from, e.mode_to) for e in outcome.transitions]
        if pairs != [(e.contact, e.mode_from, e.mode_to) for e in reference.transitions]:
            return TOTAL_ERROR
        both = zip(outcome.transitions, reference.transitions, strict=True)
        return _scaled(max((abs(a.time - b.time) for a, b in both), default=0.0), duration)
    if metric.what == "channel":
        values, expected = outcome.channels.get(source), reference.channels[source]
        if values is None or values.shape != expected.shape:
            return TOTAL_ERROR
        return _scaled(float(np.mean(np.abs(values - expected))), float(np.mean(np.abs(expected))))
    value, wanted = (
        side.quantities[source].value if source in side.quantities else None
        for side in (outcome, reference)
    )
    if value is None or wanted is None:
        return Error(0.0, 0.0) if value is wanted else TOTAL_ERROR
    channel = reference.channels[metric.scale] if metric.scale else None
    scale = abs(wanted) if channel is None else float(np.max(np.abs(channel - channel[0])))
    return _scaled(abs(value - wanted), scale)


def _scaled(error: float, scale: float) -> Error:
    if error == 0.0:
        return Error(0.0, 0.0)
    return Error(error, error / scale if scale > 0.0 else inf)


def extrapolated(fine: Record, coarse: Record, metrics: "Iterable[Metric]") -> Record:
    """Return the limit of two runs on meshes of ratio 2, sampled at the same times, by Richardson.

    Extrapolated are the channels of the metrics, and the quantities that both runs have. Events
    and checks are those of the fine run.
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
    return fine._replace(channels=channels, quantities=quantities)


class Reference(NamedTuple):
    """What errors are relative to: a run, or the limit of two."""

    outcome: Record
    names: tuple[str, ...]  # backends and settings of the references that are known
    uncertainty: dict[str, Error]  # difference of the first two, by metric; empty of only one


class Stopped(Exception):
    """A signal stopped a run of the study."""

    def __init__(self, run: Record) -> None:
        super().__init__(run.reason)
        self.run = run


class Benchmark:
    """Runs the settings of a study within the wall-time limit; a signal raises Stopped.

    The monitor is called with the time after each step, and may raise Interrupted.
    """

    def __init__(
        self, scenario: "Scenario", plan: Plan, options: CostOptions, monitor: RunMonitor
    ) -> None:
        self._scenario, self._metrics, self._monitor = scenario, plan.metrics, monitor
        self._max_wall, self._repeats = options.max_wall, options.repeats
        self._duration = scenario.solver.duration
        # The channels of all bodies would take much memory.
        of_metrics = [m.source for m in self._metrics if m.what == "channel"]
        self._channels = of_metrics if plan.limits else None
        self._warm: set[str] = set()
        self._known: dict[Setting, Record] = {}

    def reference(
        self, candidates: Iterable[tuple[str, Sequence[Setting]]], time_factor: float, failure: str
    ) -> Reference:
        """Solve with all candidates; the first that is done is the reference.

        Parameters
        ----------
        candidates : sequence of (str, sequence of Setting)
            Name, and one setting, or two on meshes of ratio 2, which are extrapolated.
        time_factor : float
            Wall-time limit relative to that of other runs.
        failure : str
            Message if all of them fail, with {} for the reasons.

        Raises
        ------
        SolverError
            If all of them fail.
        """
        done, reasons = {}, []
        for name, settings in candidates:
            try:
                runs = [self._judged(setting, time_factor) for setting in settings]
                failed = [result.reason for result in runs if result.status != "done"]
            except InputError as refused:  # too few bodies
                failed = [_one_line(refused)]
            if failed:
                reasons.append(f"{name}: {failed[0]}")
            else:
                fine, *coarse = runs
                done[name] = extrapolated(fine, coarse[0], self._metrics) if coarse else fine
        if not done:
            raise SolverError(failure.format("; ".join(reasons)))
        first, *others = done.values()
        return Reference(first, tuple(done), self._errors(others[0], first) if others else {})

    def row(self, setting: Setting, reference: Reference, in_time: Reference | None) -> Row:
        """Solve once for the errors, and several times for the wall time.

        `in_time` is the reference on the same mesh, converged in time.
        """
        row: Row = {
            "law": setting.law,
            "backend": setting.backend,
            "setting": setting.label,
            "overrides": " ".join(setting.all_overrides),
        }
        if setting.mesh:
            row |= {"model": setting.mesh.model, "bodies": float(setting.mesh.bodies)}
        try:
            judged = self._judged(setting)
        except InputError as refused:  # an effect that the model does not have, too few bodies
            nothing = dict.fromkeys(WORK, 0.0)
            return row | nothing | {"status": "failed", "reason": _one_line(refused)}
        timed = self._timed(setting) if judged.status == "done" else [judged]
        seconds = [_statistics(result).wall_seconds or 0.0 for result in timed]
        last, work = timed[-1], _statistics(timed[-1])
        done = last.status == "done"
        numbers = (
            *(len(judged.transitions), median(seconds), len(seconds)),
            *(work.steps, work.rhs_evaluations, work.states),
        )
        row |= dict(zip(WORK, map(float, numbers), strict=True))
        row |= {"status": last.status, "reason": self._fault(judged) if done else last.reason}
        if METHODS[setting.backend].counts_rejected:
            row["rejected"] = float(work.rejected)
        if len(seconds) > 1:
            row["wall_spread"] = max(seconds) - min(seconds)
        return row | self._error_columns(judged, reference, in_time) if done else row

    def _error_columns(
        self, judged: Record, reference: Reference, in_time: Reference | None
    ) -> Row:
        """Return the errors of a run, and which are below the uncertainty of a reference."""
        errors, known = self._errors(judged, reference.outcome), reference.uncertainty
        row: Row = {}
        for name, (absolute, relative) in errors.items():
            row[f"{name}_error"] = nan if absolute is None else float(absolute)
            row[name + RELATIVE] = float(relative)
        limits: dict[str, float | None] = {
            name + RELATIVE: error.relative for name, error in known.items()
        }
        row["error"], limits["error"] = greatest(errors), greatest(known)
        if in_time:
            row["time_error"] = greatest(self._errors(judged, in_time.outcome))
            limits["time_error"] = greatest(in_time.uncertainty)
        below = (
            name.removesuffix(RELATIVE)
            for name in ("error", "time_error", *(name + RELATIVE for name in errors))
            if (limit := limits.get(name)) is not None and row[name] < limit
        )
        return row | {"below_uncertainty": " ".join(below)}

    def _errors(self, outcome: Record, reference: Record) -> dict[str, Error]:
        """Return the errors by metric."""
        scale = self._duration
        return {m.name: _error(m, outcome, reference, scale) for m in self._metrics}

    def _judged(self, setting: Setting, time_factor: float = 1.0) -> Record:
        """Return the run with a setting, sampled for the comparison with the reference.

        All that its backend needs is loaded and compiled before, by a tiny part of the run. The
        finest mesh that is compared has been solved for the limit.
        """
        if setting in self._known:
            return self._known[setting]
        # Means of quantities are of samples: never fewer of them than the scenario's own.
        interval = min(self._duration / SAMPLES, self._scenario.interval)
        judged = self._variant(setting, interval, self._duration)
        if setting.line not in self._warm:
            instant = self._duration * WARM_UP_FRACTION
            self._run(self._variant(setting, instant, instant), inf)
            self._warm.add(setting.line)
        self._known[setting] = self._run(judged, time_factor)
        return self._known[setting]

    def _timed(self, setting: Setting) -> list[Record]:
        """Return the runs with samples at start and end only, up to the first that fails."""
        scenario = self._variant(setting, self._duration, self._duration)
        gc.collect()  # automatic garbage collection is off
        runs, seconds = list[Record](), 0.0
        while len(runs) < self._repeats and seconds <= SECONDS_OF_REPEATS:
            runs.append(self._run(scenario))
            seconds += _statistics(runs[-1]).wall_seconds or 0.0
            if runs[-1].status != "done":
                break
        return runs

    def _variant(self, setting: Setting, interval: float, duration: float) -> "Scenario":
        return variant(self._scenario, setting, interval, duration, self._channels)

    def _run(self, scenario: "Scenario", time_factor: float = 1.0) -> Record:
        limit = WallTimeLimit(
            self._max_wall * time_factor, scenario.solver.duration, scenario.budget_advice
        )
        result = run(scenario, Monitors(self._monitor, limit))
        if result.status == "interrupted":
            raise Stopped(result)
        return result

    def _fault(self, judged: Record) -> str:
        """Return the failed checks of the audit, except those that are metrics."""
        measured = {metric.source for metric in self._metrics if metric.what == "check"}
        failed = failures({n: c for n, c in judged.checks.items() if n not in measured})
        return f"self-audit failed: {failed}" if failed else ""


def study(
    scenario: "Scenario", options: CostOptions, monitor: RunMonitor | None = None
) -> tuple[CostTable, int]:
    """Run all settings; return their table and the exit code.

    If the monitor stops a run, the table has the rows of the settings before.

    Raises
    ------
    InputError
        If an option does not apply to the scenario.
    SolverError
        If no reference is known.
    """
    plan = options.plan(scenario)
    benchmark = Benchmark(scenario, plan, options, monitor or RunMonitor())
    show = options.progress or (lambda setting: None)
    rows: list[Row] = []
    reference: Reference | None = None
    in_time: Reference | None = None
    status, reason, exit_code = "done", "", EXIT_DONE
    try:
        show("references")
        if plan.references:
            candidates = [(setting.name, (setting,)) for setting in plan.references]
            reference = benchmark.reference(candidates, REFERENCE_TIME_FACTOR, NO_REFERENCE)
        if plan.limits:
            show("references, fine meshes")
            in_time, limits = reference, [(limit.name, limit) for limit in plan.limits]
            reference = benchmark.reference(limits, LIMIT_TIME_FACTOR, NO_LIMIT)
        own = plan.references[0].mesh if plan.references else None
        for number, setting in enumerate(plan.settings, start=1):
            show(f"{number} of {len(plan.settings)}: {setting.name}")
            assert reference is not None, "a plan has references or limits"
            same = in_time if setting.mesh == own else None
            rows.append(benchmark.row(setting, reference, same))
    except Stopped as stop:
        status, reason, exit_code = "interrupted", stop.run.reason, stop.run.exit_code
    columns = columns_of(any("model" in row for row in rows), plan.metrics)
    unknown = {name: nan if unit else "" for name, (unit, _) in columns.items()}
    return CostTable(
        columns,
        [unknown | row for row in rows],
        title=scenario.title,
        kind=scenario.kind,
        overrides=set_line({"overrides": "\n".join(scenario.origin.overrides)})[len("set: ") :],
        references=reference.names if reference else (),
        time_references=in_time.names if in_time else (),
        uncertainty=reference.uncertainty if reference else {},
        time_uncertainty=greatest(in_time.uncertainty) if in_time else None,
        status=status,
        reason=reason,
    ), exit_code


def _one_line(error: Exception) -> str:
    """Return the fault of a scenario in one line of a table."""
    return "; ".join(str(error).splitlines())


def _statistics(run: Record) -> SolverStatistics:
    assert run.statistics is not None, "a run that was just solved has them"
    return run.statistics
