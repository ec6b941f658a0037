"""A work-precision study: its options, its plan, and the errors and run times of its settings."""

import gc
from collections.abc import Iterable, Sequence
from math import inf, nan
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Field

from frictionsim.costs.study_table import columns_of, greatest
from frictionsim.display import overrides_text
from frictionsim.errors import (
    EXIT_DONE,
    ArgumentError,
    InputError,
    ScenarioError,
    SolverError,
    unknown,
)
from frictionsim.io.cost_table import RELATIVE, CostTable, Error, Row
from frictionsim.results import Quantity, Record, SolverStatistics, failures
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import validate
from frictionsim.scenario.methods import METHODS, REGULARISED, SET_VALUED, laws_of, methods_of
from frictionsim.scenario.options import Names, Options, as_list, function_of
from frictionsim.scenario.overrides import apply_overrides
from frictionsim.scenario.schema import unit_field
from frictionsim.scenario.validation import ValidationFailure
from frictionsim.scenario.variants import (
    TOLERANCES,
    Limit,
    Mesh,
    Setting,
    short,
    tolerance_overrides,
    with_tolerance,
)
from frictionsim.simulation.monitor import Monitors, RunMonitor, WallTimeLimit
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from frictionsim.results import Metric
    from frictionsim.scenario.settings import Scenario

TIGHTEST, LOOSEST = 1e-12, 0.1  # tolerances
MAX_WALL, REPEATS = 5.0, 3  # s, and timed runs of each setting
NO_MESHES = "none"  # for numbers of bodies: time steps only
STEPS = (1e-2, 1e-3, 1e-4)  # fixed steps, relative to the duration
# Transition speeds, rad/s; the next one would take an explicit method up to ten times the steps.
SPEEDS = (1e-1, 1e-2, 1e-3)
SPEEDS_IF_IMPLICIT = (*SPEEDS, 1e-4, 1e-5)
RTOL_OF_REGULARISED = 1e-6  # whose error is below that of regularising with these speeds
REFERENCE_REFINEMENT = 0.1  # of the tightest tolerance of the study
REFERENCE_OFFSET = 0.5  # of one reference, so that both do not share an error
REFERENCE_STEP = 1e-3  # longest of the second reference of a single method, over the duration
SAMPLES = 500  # of the runs for the errors
WARM_UP_FRACTION = 1e-6  # of the duration
SECONDS_OF_REPEATS = 1.0  # in all, after which a timing is accurate enough
# Limits of the wall time of a reference, and of a limit of meshes, relative to that of other runs:
# half the length of a body takes four times as long.
REFERENCE_TIME_FACTOR, LIMIT_TIME_FACTOR = 10.0, 40.0
NO_REFERENCE = "all reference runs failed: {}"
NO_LIMIT = (
    "no mesh is fine enough to judge by: {}; compare fewer bodies or allow each run more wall time"
)
ORDER = 2  # a belt of fine bodies converges with the square of their length
# Columns of the work of a run; 0 of a setting that is refused.
WORK = ("events", "wall_seconds", "repeats", "steps", "rhs_evaluations", "states")
TOTAL_ERROR = Error(None, 1.0)  # of missing or incomparable data

# --- options and plan ------------------------------------------------------------------------


class Plan(NamedTuple):
    """The settings and references of a study, and the metrics of their errors."""

    settings: list[Setting]
    # Different methods, tighter than any of the settings, on the scenario's own mesh if it has one.
    # Empty if no setting is of that mesh.
    references: tuple[Setting, ...]
    metrics: "tuple[Metric, ...]"
    # Of meshes: errors are those against the first; the second is compared with it. Empty for a
    # study over time alone, whose errors are those against the references.
    limits: tuple[Limit, ...] = ()


def _tolerances(given: Any) -> tuple[float, ...]:
    try:
        values = tuple(map(float, as_list(given)))
    except (TypeError, ValueError):
        values = ()
    if not values or not all(TIGHTEST <= rtol <= LOOSEST for rtol in values):
        shown = given if isinstance(given, str) else ",".join(map(str, as_list(given)))
        raise ValueError(
            f"expected numbers from {TIGHTEST:g} to {LOOSEST:g}, e.g. 1e-3,1e-6, got '{shown}'"
        )
    return tuple(sorted(set(values), reverse=True))


def _bodies(given: Any) -> tuple[int, ...] | None:
    """Return numbers of bodies; none for `none`."""
    if given is None or given == NO_MESHES:
        return None if given is None else ()
    from frictionsim.mechanisms.belt_drive.geometry import MIN_BODIES

    counts = as_list(given)
    if isinstance(given, str):
        counts = [int(text) if text.isdecimal() else given for text in counts]
    for count in counts:
        if not isinstance(count, int) or isinstance(count, bool) or count < MIN_BODIES:
            raise ValueError(
                f"expected whole numbers of at least {MIN_BODIES}, e.g. 60,150, or none,"
                f" got {count!r}"
            )
    return tuple(sorted(set(counts)))


class CostOptions(Options):
    """The settings that a study compares; None for all that apply."""

    laws: Names | None = None
    backends: Names | None = None
    tolerances: Annotated[tuple[float, ...], BeforeValidator(_tolerances)] = TOLERANCES
    bodies: Annotated[tuple[int, ...] | None, BeforeValidator(_bodies)] = None
    models: Names | None = None
    max_wall: float = unit_field("s", "Limit of the wall time of each run.", MAX_WALL, gt=0)
    repeats: int = Field(REPEATS, ge=1)
    progress: Annotated[Any, function_of("a text")] = None

    def plan(self, scenario: "Scenario") -> Plan:
        """Return the settings, references and metrics of a study of a scenario.

        Raises
        ------
        InputError
            If an option does not apply to the scenario.
        """
        methods = _known("backends", "backend", self.backends, methods_of(scenario.pairs))
        laws = _known("laws", "friction law", self.laws, laws_of(scenario.pairs))
        kind: Any = mechanism_module(scenario.kind)
        # A kind may have functions of its own in the place of those below.
        over_time = getattr(kind, "ladders", ladders)(scenario, self.tolerances)
        over_time = [s for s in over_time if s.backend in methods and (not s.law or s.law in laws)]
        rtol = min(self.tolerances) * REFERENCE_REFINEMENT
        best = getattr(kind, "references", references)(scenario, rtol)
        study: Any = getattr(kind, "mesh_study", None)
        settings: list[Setting] = []
        meshes = self._meshes(study, scenario)
        if not meshes:
            return Plan(over_time, best, kind.METRICS)
        own = study.own_mesh(scenario)
        for mesh in meshes:
            if mesh == own:
                settings += [setting._replace(mesh=own) for setting in over_time]
            else:
                settings += study.mesh_settings(scenario, mesh, methods, laws)
        own_references = tuple(s._replace(mesh=own) for s in best) if own in meshes else ()
        most = max(mesh.bodies for mesh in meshes)
        return Plan(settings, own_references, study.MESH_METRICS, study.limits(scenario, most))

    def _meshes(self, study: Any, scenario: "Scenario") -> list[Mesh]:
        """Return the meshes to compare, one model after the other; none for time steps only."""
        if study is None:
            for name in ("bodies", "models"):
                if getattr(self, name) is not None:
                    fault = f"the kind '{scenario.kind}' has no mesh; leave this out"
                    raise ArgumentError(name, fault)
            return []
        bodies = study.default_bodies(scenario) if self.bodies is None else self.bodies
        if not bodies:
            if self.models is not None:
                fault = "without bodies there is no mesh to compare models on"
                raise ArgumentError("models", fault)
            return []
        possible = study.models_of(scenario)
        for name in self.models or ():
            if name in study.MODELS and name not in possible:
                raise ArgumentError(
                    "models",
                    f"'{name}' needs [effects.contact], which the scenario leaves out;"
                    f" known here: {', '.join(possible)}",
                )
        models = _known("models", "model", self.models, possible)
        return [study.mesh_of(scenario, model, count) for model in models for count in bodies]


def _known(
    argument: str, what: str, given: tuple[str, ...] | None, known: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the given names, by default all known ones."""
    for name in given or ():
        if name not in known:
            raise ArgumentError(argument, unknown(what, name, list(known)))
    return known if given is None else given


def ladders(scenario: "Scenario", tolerances: Iterable[float]) -> list[Setting]:
    """Return the settings of every law and method for a mechanism without a mesh.

    Adaptive methods have several relative tolerances, fixed-step methods several steps, and the
    regularised law several transition speeds at one tolerance. Without dry friction, or with a
    prescribed speed, there is no law, and every method has several tolerances.
    """
    if _is_smooth(scenario):
        names = methods_of(scenario.pairs)
        return [with_tolerance(name, rtol) for name in names for rtol in tolerances]
    settings: list[Setting] = []
    steps = [fraction * scenario.solver.duration for fraction in STEPS]
    for (law, name), pair in scenario.pairs.items():
        if pair.fixed_step:
            of_pair = [Setting(name, f"step {short(h)}", (f"solver.step={h:.12g}",)) for h in steps]
        elif law == REGULARISED:
            speeds = SPEEDS_IF_IMPLICIT if METHODS[name].implicit else SPEEDS
            of_pair = [_with_speed(name, speed, scenario) for speed in speeds]
        else:
            of_pair = [with_tolerance(name, rtol) for rtol in tolerances]
        settings += [setting.with_law(law, scenario) for setting in of_pair]
    return settings


def references(scenario: "Scenario", rtol: float) -> tuple[Setting, ...]:
    """Return two references with different methods for a mechanism without a mesh.

    Where there is one method only, the second has short steps, too.
    """
    first, second = with_tolerance("events", REFERENCE_OFFSET * rtol), with_tolerance("rkf45", rtol)
    is_smooth, only_events = _is_smooth(scenario), methods_of(scenario.pairs) == ("events",)
    if only_events:
        step = REFERENCE_STEP * scenario.solver.duration
        overrides = (*tolerance_overrides(rtol), f"solver.max_step={step:.6g}")
        second = Setting("events", f"rtol {short(rtol)}, max_step {short(step)}", overrides)
    if is_smooth:  # `events` and `rkf45` are the same method
        return first, second if only_events else with_tolerance("dop853", rtol)
    return first.with_law(SET_VALUED, scenario), second.with_law(SET_VALUED, scenario)


def _is_smooth(scenario: "Scenario") -> bool:
    """Return whether no friction law is needed, so that every method is possible."""
    mechanism = mechanism_module(scenario.kind).build(scenario)
    return mechanism.prescribed or not mechanism.law


def _with_speed(backend: str, speed: float, scenario: "Scenario") -> Setting:
    speeds = (f"effects.{name}.transition_speed={speed:g}" for name in scenario.friction_effects)
    overrides = (*tolerance_overrides(RTOL_OF_REGULARISED), *speeds)
    return Setting(backend, f"speed {short(speed)}", overrides)


# --- errors ----------------------------------------------------------------------------------


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


def _extrapolated(fine: Record, coarse: Record, metrics: "Iterable[Metric]") -> Record:
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


# --- runs ------------------------------------------------------------------------------------


class _Stopped(Exception):
    """A signal stopped a run of the study."""

    def __init__(self, run: Record) -> None:
        super().__init__(run.reason)
        self.run = run


class _Benchmark:
    """Runs the settings of a study within the wall-time limit; a signal raises _Stopped."""

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
        """Solve with all candidates, each one setting or two that are extrapolated.

        The first that is done is the reference; if there is none, SolverError has the reasons.
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
                done[name] = _extrapolated(fine, coarse[0], self._metrics) if coarse else fine
        if not done:
            raise SolverError(failure.format("; ".join(reasons)))
        first, *others = done.values()
        return Reference(first, tuple(done), self._errors(others[0], first) if others else {})

    def row(self, setting: Setting, reference: Reference, in_time: Reference | None) -> Row:
        """Solve once for the errors, and several times for the wall time.

        `in_time` is the reference on the same mesh, converged in time.
        """
        overrides = " ".join(setting.all_overrides)
        row: Row = {"law": setting.law, "backend": setting.backend, "setting": setting.label}
        row |= {"overrides": overrides}
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
        times = len(judged.transitions), median(seconds), len(seconds)
        numbers = *times, work.steps, work.rhs_evaluations, work.states
        row |= dict(zip(WORK, map(float, numbers), strict=True))
        row |= {"status": last.status, "reason": last.reason}
        if METHODS[setting.backend].counts_rejected:
            row["rejected"] = float(work.rejected)
        if len(seconds) > 1:
            row["wall_spread"] = max(seconds) - min(seconds)
        if last.status != "done":
            return row
        measured = {metric.source for metric in self._metrics if metric.what == "check"}
        failed = failures({n: c for n, c in judged.checks.items() if n not in measured})
        row["reason"] = f"self-audit failed: {failed}" if failed else ""
        return row | self._error_columns(judged, reference, in_time)

    def _error_columns(
        self, judged: Record, reference: Reference, in_time: Reference | None
    ) -> Row:
        """Return the errors of a run, and which are below the uncertainty of a reference."""
        errors, known = self._errors(judged, reference.outcome), reference.uncertainty
        row: Row = {"error": greatest(errors)}
        limits = {"error": greatest(known)}
        if in_time:
            row["time_error"] = greatest(self._errors(judged, in_time.outcome))
            limits["time_error"] = greatest(in_time.uncertainty)
        for name, (absolute, relative) in errors.items():
            row[f"{name}_error"] = nan if absolute is None else float(absolute)
            row[name + RELATIVE] = float(relative)
            limits[name + RELATIVE] = known[name].relative if name in known else None
        below = [
            name.removesuffix(RELATIVE)
            for name, limit in limits.items()
            if limit is not None and row[name] < limit
        ]
        return row | {"below_uncertainty": " ".join(below)}

    def _errors(self, outcome: Record, reference: Record) -> dict[str, Error]:
        """Return the errors by metric."""
        return {m.name: _error(m, outcome, reference, self._duration) for m in self._metrics}

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
        gc.collect()  # what earlier runs have left is not timed
        runs, seconds = list[Record](), 0.0
        while len(runs) < self._repeats and seconds <= SECONDS_OF_REPEATS:
            runs.append(self._run(scenario))
            seconds += _statistics(runs[-1]).wall_seconds or 0.0
            if runs[-1].status != "done":
                break
        return runs

    def _variant(self, setting: Setting, interval: float, duration: float) -> "Scenario":
        """Return the scenario with a setting, which replaces method, step and laws of friction.

        Without samples at events, whose times differ between the settings. Raises ScenarioError
        if it is not valid, as a setting of a mesh may be.
        """
        data = self._scenario.to_dict()
        data["solver"].pop("step", None)
        data["solver"] |= {"duration": duration, "backend": setting.backend}
        for name, effect in self._scenario.friction_effects.items():
            for key in effect.LAW_KEYS:
                data["effects"][name].pop(key, None)
        data["output"] = {"interval": interval, "at_events": False}
        if self._channels is not None:
            data["output"]["channels"] = self._channels
        apply_overrides(data, setting.all_overrides)
        try:
            return validate(data, Path())
        except ValidationFailure as failure:
            raise ScenarioError(failure.lines()) from None

    def _run(self, scenario: "Scenario", time_factor: float = 1.0) -> Record:
        limit = WallTimeLimit(
            self._max_wall * time_factor, scenario.solver.duration, scenario.budget_advice
        )
        result = run(scenario, Monitors(self._monitor, limit))
        if result.status == "interrupted":
            raise _Stopped(result)
        return result


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
    benchmark = _Benchmark(scenario, plan, options, monitor or RunMonitor())
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
    except _Stopped as stop:
        status, reason, exit_code = "interrupted", stop.run.reason, stop.run.exit_code
    columns = columns_of(any("model" in row for row in rows), plan.metrics)
    unknown = {name: nan if unit else "" for name, (unit, _) in columns.items()}
    return CostTable(
        columns,
        [unknown | row for row in rows],
        title=scenario.title,
        kind=scenario.kind,
        overrides=overrides_text({"overrides": "\n".join(scenario.origin.overrides)}),
        references=reference.names if reference else (),
        time_references=in_time.names if in_time else (),
        uncertainty=reference.uncertainty if reference else {},
        time_uncertainty=greatest(in_time.uncertainty) if in_time else None,
        status=status,
        reason=reason,
    ), exit_code


def _one_line(error: Exception) -> str:
    return "; ".join(str(error).splitlines())


def _statistics(run: Record) -> SolverStatistics:
    assert run.statistics is not None, "a run that was just solved has them"
    return run.statistics
