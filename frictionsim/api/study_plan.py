"""What a work-precision study is to compare: interprets the arguments of `cost`."""

from collections.abc import Iterable
from typing import Any, NamedTuple, TypedDict

from frictionsim.api.arguments import as_names
from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import laws_of, methods_of
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.variants import TOLERANCES, Mesh, Setting
from frictionsim.work_precision import settings as ladder
from frictionsim.work_precision.outcome import Plan


class Meshes(TypedDict, total=False):
    """The arguments of `cost` on meshes."""

    bodies: int | Iterable[int] | None
    models: str | Iterable[str] | None


class Choice(NamedTuple):
    """What is asked for; None for the default."""

    laws: str | Iterable[str] | None = None
    backends: str | Iterable[str] | None = None
    tolerances: float | Iterable[float] | None = None
    bodies: int | Iterable[int] | None = None
    models: str | Iterable[str] | None = None


def plan_of(scenario: Scenario, choice: Choice) -> Plan:
    """Return what to run.

    Raises
    ------
    InputError
        If the kind has no metrics, or something is asked for that there is not.
    """
    tolerances = _tolerances(choice.tolerances)
    methods = _named("backends", "backend", choice.backends, methods_of(scenario.pairs))
    laws = _named("laws", "friction law", choice.laws, laws_of(scenario.pairs))
    kind = mechanism_module(scenario.kind)
    if not hasattr(kind, "METRICS"):
        raise InputError(f"cost: the kind '{scenario.kind}' defines no error metrics")

    def over_time() -> list[Setting]:
        found = _ladders(kind, scenario, tolerances)
        return [s for s in found if s.backend in methods and (not s.law or s.law in laws)]

    rtol = min(tolerances) * ladder.REFERENCE_REFINEMENT
    meshes = _meshes(kind, scenario, choice)
    if not meshes:
        return Plan(over_time(), _references(kind, scenario, rtol), kind.METRICS)
    study, settings = kind.mesh_study, []
    own = study.own_mesh(scenario)
    for mesh in meshes:
        if mesh == own:
            settings += [setting._replace(mesh=own) for setting in over_time()]
        else:
            settings += study.mesh_settings(scenario, mesh, methods, laws)
    references: tuple[Setting, ...] = ()
    if own in meshes:
        references = tuple(s._replace(mesh=own) for s in _references(kind, scenario, rtol))
    most = max(mesh.bodies for mesh in meshes)
    return Plan(settings, references, study.METRICS, study.limits(scenario, most))


def _meshes(kind: Any, scenario: Scenario, choice: Choice) -> list[Mesh]:
    """Return the meshes to compare, one model after the other; none for a study over time alone."""
    given = {"bodies": choice.bodies, "models": choice.models}
    if not hasattr(kind, "mesh_study"):
        for name, value in given.items():
            if value is not None:
                raise ArgumentError(name, f"the kind '{scenario.kind}' has no mesh; leave this out")
        return []
    study = kind.mesh_study
    bodies = study.default_bodies(scenario) if choice.bodies is None else _counts(choice.bodies)
    if not bodies:
        if choice.models is not None:
            raise ArgumentError("models", "without bodies there is no mesh to compare models on")
        return []
    possible = study.models_of(scenario)
    for name in as_names("models", choice.models or ()):
        if name in study.MODELS and name not in possible:
            raise ArgumentError(
                "models",
                f"'{name}' needs [effects.contact], which the scenario leaves out;"
                f" known here: {', '.join(possible)}",
            )
    models = _named("models", "model", choice.models, possible)
    return [study.mesh_of(scenario, model, count) for model in models for count in bodies]


def _counts(given: int | Iterable[int]) -> tuple[int, ...]:
    values: tuple[Any, ...] = tuple(given) if isinstance(given, Iterable) else (given,)
    for value in values:
        if not isinstance(value, int) or isinstance(value, bool) or value < 2:
            raise ArgumentError("bodies", f"expected whole numbers of at least 2, got {value!r}")
    return tuple(sorted(set(values)))


def _ladders(kind: Any, scenario: Scenario, tolerances: tuple[float, ...]) -> list[Setting]:
    if hasattr(kind, "ladders"):
        found: list[Setting] = kind.ladders(scenario, tolerances)
        return found
    return ladder.ladders(scenario, tolerances, kind.build(scenario))


def _references(kind: Any, scenario: Scenario, rtol: float) -> tuple[Setting, ...]:
    if hasattr(kind, "references"):
        found: tuple[Setting, ...] = kind.references(scenario, rtol)
        return found
    return ladder.references(scenario, kind.build(scenario), rtol)


def _tolerances(given: float | Iterable[float] | None) -> tuple[float, ...]:
    if given is None:
        return TOLERANCES
    values: tuple[Any, ...] = tuple(given) if isinstance(given, Iterable) else (given,)
    try:
        found = tuple(map(float, values))
    except (TypeError, ValueError):
        found = ()
    if not found or not all(ladder.TIGHTEST <= rtol <= ladder.LOOSEST for rtol in found):
        raise ArgumentError(
            "tolerances",
            f"expected numbers from {ladder.TIGHTEST:g} to {ladder.LOOSEST:g},"
            f" got '{','.join(map(str, values))}'",
        )
    return tuple(sorted(set(found), reverse=True))


def _named(
    argument: str, what: str, given: str | Iterable[str] | None, known: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the names that are given; all known ones if none are."""
    if given is None:
        return known
    names = tuple(as_names(argument, given))
    for name in names:
        if name not in known:
            raise ArgumentError(argument, unknown(what, name, list(known)))
    return names
