"""Runs a scenario with one setting after another: what each is off by, and what it takes."""

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

# A setting that takes this long in all is not repeated: its time is told well enough.
SECONDS_OF_REPEATS = 1.0
# References are few and worth waiting for.
REFERENCE_TIME_FACTOR = 10.0

OnStep = Callable[[float], Any]


class Row(NamedTuple):
    """What became of a setting.

    Attributes
    ----------
    setting : Setting
    status : str
        `done` or `failed`; `interrupted` is not kept.
    reason : str
        Why it failed, or what its audit found.
    wall_seconds : float, s
        Median over the repeats; of the run that failed otherwise.
    repeats : int
    steps, rejected, rhs_evaluations, states : int
        Without those of samples. `rejected` is None where the backend does not tell.
    events : int
    errors : dict of Error
        By measure; empty if it failed.
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
        """The worst relative error; None if it failed."""
        return max_relative_error(self.errors) if self.status == "done" else None


class Reference(NamedTuple):
    """What the settings are judged by.

    Attributes
    ----------
    outcome : Outcome
    names : tuple of str
        How it was found.
    floor : dict of Error
        By measure, how far two of them are apart; empty if there is but one.
    """

    outcome: Comparable
    names: tuple[str, ...]
    floor: dict[str, Error]


class Study(NamedTuple):
    """A scenario in all its settings, as far as they were run."""

    scenario: "Scenario"
    metrics: "tuple[Metric, ...]"
    reference: Reference | None
    rows: list[Row]
    status: str
    reason: str
    exit_code: int

    @property
    def floor(self) -> float:
        """The worst relative difference of the references; below it no error can be told."""
        return max_relative_error(self.reference.floor) if self.reference else 0.0


class Stopped(Exception):
    """A signal ended a run of the study."""

    def __init__(self, run: RunResult) -> None:
        super().__init__(run.reason)
        self.run = run


class Benchmark:
    """Runs settings of one scenario within their budgets."""

    def __init__(
        self, variants: ScenarioVariants, metrics: "Iterable[Metric]", max_wall: float, repeats: int
    ) -> None:
        self._variants, self._metrics = variants, tuple(metrics)
        self._checks = {m.source for m in self._metrics if m.what == "check"}
        self._max_wall, self._repeats = max_wall, repeats
        self._warm: set[str] = set()

    def reference(self, settings: tuple[Setting, ...], on_step: OnStep) -> Reference:
        """Solve with each of the settings; the first that comes to its end is the reference.

        Raises
        ------
        SolverError
            If none does.
        Stopped
        """
        runs, names, reasons = [], [], []
        for setting in settings:
            self._warm_up(setting, on_step)
            patience = self._max_wall * REFERENCE_TIME_FACTOR
            found = _run(self._variants.judged(setting), on_step, patience)
            name = f"{setting.line}, {setting.label}"
            if found.status == "done":
                runs.append(found)
                names.append(name)
            else:
                reasons.append(f"{name}: {found.reason}")
        if not runs:
            raise SolverError(f"there is no reference to judge by: {'; '.join(reasons)}")
        duration = runs[0].scenario.solver.duration
        floor = metric_errors(self._metrics, runs[1], runs[0], duration) if len(runs) > 1 else {}
        return Reference(runs[0], tuple(names), floor)

    def row(self, setting: Setting, reference: Comparable, on_step: OnStep) -> Row:
        """Solve once to judge, and some times more to take the time.

        Raises
        ------
        Stopped
        """
        self._warm_up(setting, on_step)
        judged = _run(self._variants.judged(setting), on_step, self._max_wall)
        last, seconds = judged, [judged.statistics.wall_seconds]
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
        """Have loaded and compiled what a line of the diagram needs."""
        if setting.line not in self._warm:
            _run(self._variants.warm_up(setting), on_step, inf)
            self._warm.add(setting.line)

    def _timed(self, setting: Setting, on_step: OnStep) -> tuple[RunResult, list[float]]:
        scenario = self._variants.timed(setting)
        gc.collect()  # it is switched off while the program runs
        seconds: list[float] = []
        while True:
            found = _run(scenario, on_step, self._max_wall)
            seconds.append(found.statistics.wall_seconds)
            enough = len(seconds) >= self._repeats or sum(seconds) > SECONDS_OF_REPEATS
            if enough or found.status != "done":
                return found, seconds


def _run(scenario: "Scenario", on_step: OnStep, max_wall: float) -> RunResult:
    limit = WallTimeLimit(max_wall, scenario.solver.duration)

    def step(t: float) -> None:
        on_step(t)
        limit(t)

    if hasattr(on_step, "compiling"):
        step.compiling = on_step.compiling  # type: ignore[attr-defined]
    found = run(scenario, step)
    if found.status == "interrupted":
        raise Stopped(found)
    return found


def _audit_text(found: RunResult, judged: set[str]) -> str:
    """Return what the audit found wrong, beside what is a measure and has a column of its own."""
    failed = failures({name: c for name, c in found.checks.items() if name not in judged})
    return f"self-audit failed: {failed}" if failed and found.status == "done" else ""


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
    measures : tuple of Measure
    max_wall : float, s
        Of each run.
    repeats : int
        At most so many runs of each setting are timed.
    on_step : callable
        Called with the time after each step; it may raise Interrupted.
    show : callable
        Called with what is done next.

    Returns
    -------
    Study
        Also of one that a signal stopped, with the rows up to there.

    Raises
    ------
    SolverError
        If no reference comes to its end.
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
