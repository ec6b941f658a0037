"""A work-precision study: errors and run times of a scenario for several settings."""

import gc
from collections.abc import Callable, Iterable
from math import inf
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import SolverError
from frictionsim.results import failures
from frictionsim.scenario.methods import METHODS
from frictionsim.scenario.variants import Setting
from frictionsim.simulation.simulate import RunResult, run
from frictionsim.simulation.wall_time import WallTimeLimit
from frictionsim.work_precision.errors import Comparable, Error, max_relative_error, metric_errors
from frictionsim.work_precision.settings import ScenarioVariants

if TYPE_CHECKING:
    from frictionsim.results import Metric
    from frictionsim.scenario.settings import Scenario

# A setting is not repeated after this total time, s: the timing is accurate enough.
SECONDS_OF_REPEATS = 1.0
# The wall-time limit of a reference, relative to that of the other runs.
REFERENCE_TIME_FACTOR = 10.0

OnStep = Callable[[float], Any]


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
    steps, rejected, rhs_evaluations, states : int
        Without evaluations for samples. `rejected` is None if the backend does not report it.
    events : int
    errors : dict of Error
        By metric; empty if failed.
    """

    setting: Setting
    status: str
    reason: str
    wall_seconds: float
    repeats: int
    steps: int
    rejected: int | None
    rhs_evaluations: int
    states: int
    events: int
    errors: dict[str, Error]

    @property
    def error(self) -> float | None:
        """The largest relative error; None if failed."""
        return max_relative_error(self.errors) if self.status == "done" else None


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


class Study(NamedTuple):
    """The results of a study; if interrupted, of the settings run before."""

    scenario: "Scenario"
    metrics: "tuple[Metric, ...]"
    reference: Reference | None
    rows: list[Row]
    status: str
    reason: str
    exit_code: int

    @property
    def floor(self) -> float:
        """The reference uncertainty: the largest relative difference of the reference runs."""
        return max_relative_error(self.reference.floor) if self.reference else 0.0


class Stopped(Exception):
    """A signal stopped a run of the study."""

    def __init__(self, run: RunResult) -> None:
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

    def reference(self, settings: tuple[Setting, ...], on_step: OnStep) -> Reference:
        """Solve with the settings of the references; the first that is done is the reference.

        Parameters
        ----------
        settings : tuple of Setting
        on_step : callable

        Returns
        -------
        Reference

        Raises
        ------
        SolverError
            If all of them fail.
        Stopped
            If a signal stopped a run.
        """
        runs, names, reasons = [], [], []
        for setting in settings:
            self._warm_up(setting, on_step)
            max_wall = self._max_wall * REFERENCE_TIME_FACTOR
            result = _run(self._variants.judged(setting), on_step, max_wall)
            name = f"{setting.line}, {setting.label}"
            if result.status == "done":
                runs.append(result)
                names.append(name)
            else:
                reasons.append(f"{name}: {result.reason}")
        if not runs:
            raise SolverError(f"all reference runs failed: {'; '.join(reasons)}")
        duration = runs[0].scenario.solver.duration
        floor = metric_errors(self._metrics, runs[1], runs[0], duration) if len(runs) > 1 else {}
        return Reference(runs[0], tuple(names), floor)

    def row(self, setting: Setting, reference: Comparable, on_step: OnStep) -> Row:
        """Solve once for the errors, and several times for the wall time.

        Parameters
        ----------
        setting : Setting
        reference : Comparable
        on_step : callable

        Returns
        -------
        Row

        Raises
        ------
        Stopped
            If a signal stopped a run.
        """
        self._warm_up(setting, on_step)
        judged = _run(self._variants.judged(setting), on_step, self._max_wall)
        last, seconds = judged, [_seconds(judged)]
        errors: dict[str, Error] = {}
        if judged.status == "done":
            duration = judged.scenario.solver.duration
            last, seconds = self._timed(setting, on_step)
            if last.status == "done":
                errors = metric_errors(self._metrics, judged, reference, duration)
        statistics = last.statistics
        tells = METHODS[setting.backend].tells_rejected
        return Row(
            setting=setting,
            status=last.status,
            reason=_audit_text(judged, self._checks) if last.status == "done" else last.reason,
            wall_seconds=median(seconds),
            repeats=len(seconds),
            steps=statistics.steps,
            rejected=statistics.rejected if tells else None,
            rhs_evaluations=statistics.rhs_evaluations,
            states=statistics.states,
            events=len(judged.transitions),
            errors=errors,
        )

    def _warm_up(self, setting: Setting, on_step: OnStep) -> None:
        """Load and compile everything that a backend needs, once."""
        if setting.line not in self._warm:
            _run(self._variants.warm_up(setting), on_step, inf)
            self._warm.add(setting.line)

    def _timed(self, setting: Setting, on_step: OnStep) -> tuple[RunResult, list[float]]:
        scenario = self._variants.timed(setting)
        gc.collect()  # automatic garbage collection is off
        seconds: list[float] = []
        while True:
            result = _run(scenario, on_step, self._max_wall)
            seconds.append(_seconds(result))
            enough = len(seconds) >= self._repeats or sum(seconds) > SECONDS_OF_REPEATS
            if enough or result.status != "done":
                return result, seconds


def _run(scenario: "Scenario", on_step: OnStep, max_wall: float) -> RunResult:
    limit = WallTimeLimit(max_wall, scenario.solver.duration)

    def step(t: float) -> None:
        on_step(t)
        limit(t)

    if hasattr(on_step, "compiling"):
        step.compiling = on_step.compiling  # type: ignore[attr-defined]
    result = run(scenario, step)
    if result.status == "interrupted":
        raise Stopped(result)
    return result


def _audit_text(result: RunResult, metrics: set[str]) -> str:
    """Return the failed checks of the audit, except those that are metrics."""
    failed = failures({name: c for name, c in result.checks.items() if name not in metrics})
    return f"self-audit failed: {failed}" if failed and result.status == "done" else ""


def study(
    scenario: "Scenario",
    settings: list[Setting],
    references: tuple[Setting, ...],
    metrics: "tuple[Metric, ...]",
    max_wall: float,
    repeats: int,
    on_step: OnStep,
    show: Callable[[str], Any],
) -> Study:
    """Run all settings.

    Parameters
    ----------
    scenario : Scenario
    settings : list of Setting
    references : tuple of Setting
        Different methods, tighter than any of the settings.
    metrics : tuple of Metric
    max_wall : float, s
        Limit of each run.
    repeats : int
        Maximum number of timed runs of each setting.
    on_step : callable
        Called with the time after each step; it may raise Interrupted.
    show : callable
        Called with a description of the next run.

    Returns
    -------
    Study
        If a signal stopped it, with the rows of the settings before.

    Raises
    ------
    SolverError
        If all reference runs fail.
    """
    benchmark = Benchmark(ScenarioVariants(scenario), metrics, max_wall, repeats)
    rows: list[Row] = []
    reference = None
    try:
        show("references")
        reference = benchmark.reference(references, on_step)
        for number, setting in enumerate(settings, start=1):
            show(f"{number} of {len(settings)}: {setting.line}, {setting.label}")
            rows.append(benchmark.row(setting, reference.outcome, on_step))
    except Stopped as stop:
        reason, code = stop.run.reason, stop.run.exit_code
        return Study(scenario, metrics, reference, rows, "interrupted", reason, code)
    return Study(scenario, metrics, reference, rows, "done", "", 0)


def _seconds(run: RunResult) -> float:
    return run.statistics.wall_seconds or 0.0  # None is of files only
