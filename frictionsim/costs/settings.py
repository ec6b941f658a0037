"""The options of a study and its plan: settings and references for mechanisms without a mesh."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from frictionsim.errors import ArgumentError, InputError, ScenarioError, unknown
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.methods import METHODS, REGULARISED, SET_VALUED, laws_of, methods_of
from frictionsim.scenario.options import Names, Options, as_list, function_of
from frictionsim.scenario.overrides import apply_overrides
from frictionsim.scenario.schema import unit_field
from frictionsim.scenario.variants import (
    TOLERANCES,
    Limit,
    Mesh,
    Setting,
    short,
    tolerance_overrides,
    with_tolerance,
)

if TYPE_CHECKING:
    from frictionsim.results import Metric
    from frictionsim.scenario.settings import Scenario

# Tolerance of the references, relative to the tightest tolerance of the study.
REFERENCE_REFINEMENT = 0.1
# Offset one reference by a factor of two so that both do not share an error.
REFERENCE_OFFSET = 0.5
REFERENCE_STEP = 1e-3  # longest of the second reference of a single method, over the duration
TIGHTEST, LOOSEST = 1e-12, 0.1
STEPS = (1e-2, 1e-3, 1e-4)  # fixed steps, relative to the duration
# Transition speeds, rad/s; the next one would take an explicit method up to ten times the steps.
SPEEDS = (1e-1, 1e-2, 1e-3)
SPEEDS_IF_IMPLICIT = (*SPEEDS, 1e-4, 1e-5)
# The error of regularising with these speeds exceeds that of this tolerance.
RTOL_OF_REGULARISED = 1e-6

NO_MESHES = "none"  # for numbers of bodies: time steps only


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


def variant(
    scenario: "Scenario",
    setting: Setting,
    interval: float,
    duration: float,
    channels: list[str] | None = None,
) -> "Scenario":
    """Return a scenario with a setting; it replaces method, step and the laws of friction.

    Interval, of its samples, and duration are in s. There are no samples at events, whose times
    differ between the settings. Only the given channels are recorded, by default all.

    Raises
    ------
    ScenarioError
        If it is not valid, as a setting of a mesh may be.
    """
    data = scenario.to_dict()
    data["solver"].pop("step", None)
    data["solver"] |= {"duration": duration, "backend": setting.backend}
    for name, effect in scenario.friction_effects.items():
        for key in effect.LAW_KEYS:
            data["effects"][name].pop(key, None)
    data["output"] = {"interval": interval, "at_events": False}
    if channels is not None:
        data["output"]["channels"] = channels
    apply_overrides(data, setting.all_overrides)
    try:
        return validate(data, Path())
    except ValidationFailure as failure:
        raise ScenarioError(failure.lines()) from None


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
    counts = as_list(given)
    if isinstance(given, str):
        counts = [int(text) if text.isdecimal() else given for text in counts]
    for count in counts:
        if not isinstance(count, int) or isinstance(count, bool) or count < 2:
            raise ValueError(
                f"expected whole numbers of at least 2, e.g. 60,150, or none, got {count!r}"
            )
    return tuple(sorted(set(counts)))


MAX_WALL, REPEATS = 5.0, 3  # s, and timed runs of each setting


class CostOptions(Options):
    """The settings that a study compares; None for all that apply."""

    laws: Names | None = None
    backends: Names | None = None
    tolerances: Annotated[tuple[float, ...], BeforeValidator(_tolerances)] = TOLERANCES
    bodies: Annotated[tuple[int, ...] | None, BeforeValidator(_bodies)] = None
    models: Names | None = None
    max_wall: float = unit_field("s", "Limit of the wall time of each run.", MAX_WALL, gt=0)
    repeats: int = Field(REPEATS, ge=1)
    progress: Annotated[Any, function_of("the name of a setting")] = None

    def plan(self, scenario: "Scenario") -> Plan:
        """Return the settings, references and metrics of a study of a scenario.

        Raises
        ------
        InputError
            If the kind has no metrics, or an option does not apply to the scenario.
        """
        methods = _known("backends", "backend", self.backends, methods_of(scenario.pairs))
        laws = _known("laws", "friction law", self.laws, laws_of(scenario.pairs))
        kind: Any = mechanism_module(scenario.kind)
        if not hasattr(kind, "METRICS"):
            raise InputError(f"cost: the kind '{scenario.kind}' defines no error metrics")

        # A kind may have functions of its own in the place of those below.
        over_time = getattr(kind, "ladders", ladders)(scenario, self.tolerances)
        over_time = [s for s in over_time if s.backend in methods and (not s.law or s.law in laws)]
        rtol = min(self.tolerances) * REFERENCE_REFINEMENT
        best = getattr(kind, "references", references)(scenario, rtol)
        meshes = self._meshes(kind, scenario)
        if not meshes:
            return Plan(over_time, best, kind.METRICS)
        study, settings = kind.mesh_study, []
        own = study.own_mesh(scenario)
        for mesh in meshes:
            if mesh == own:
                settings += [setting._replace(mesh=own) for setting in over_time]
            else:
                settings += study.mesh_settings(scenario, mesh, methods, laws)
        own_references = tuple(s._replace(mesh=own) for s in best) if own in meshes else ()
        most = max(mesh.bodies for mesh in meshes)
        return Plan(settings, own_references, study.MESH_METRICS, study.limits(scenario, most))

    def _meshes(self, kind: Any, scenario: "Scenario") -> list[Mesh]:
        """Return the meshes to compare, one model after the other; none for time steps only."""
        if not hasattr(kind, "mesh_study"):
            for name in ("bodies", "models"):
                if getattr(self, name) is not None:
                    fault = f"the kind '{scenario.kind}' has no mesh; leave this out"
                    raise ArgumentError(name, fault)
            return []
        study = kind.mesh_study
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
