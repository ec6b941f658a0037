"""Compilation of kernels ahead of their use, as for containers and continuous integration."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import InputError, unknown
from frictionsim.scenario import methods
from frictionsim.scenario.kinds import KINDS, kind_names, mechanism_module
from frictionsim.scenario.loading import load
from frictionsim.scenario.shipped import shipped_scenarios

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

COMPILED_KINDS = ("belt_drive",)  # mechanisms of one coordinate are plain Python


class WarmedUp(NamedTuple):
    """A combination of effects and method whose kernels are on the disk now.

    Attributes
    ----------
    scenario : str
        The name of a shipped scenario with this combination.
    backend : str
        The method.
    seconds : float, s
        What the compilation took; 0 where the kernels were there already.
    """

    scenario: str
    backend: str
    seconds: float


def warm_up(kind: str | None = None) -> tuple[WarmedUp, ...]:
    """Compile the kernels of the shipped scenarios, with each compiled method.

    Another scenario compiles again if it has another set of effects.

    Parameters
    ----------
    kind : str or None
        A kind of mechanism; by default all that have kernels.

    Returns
    -------
    tuple of WarmedUp
        Empty for a kind without kernels.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    return tuple(warming(kind, lambda t: None))


def warming(kind: str | None, on_step: Callable[[float], Any]) -> Iterator[WarmedUp]:
    """Do what `warm_up` does, one combination at a time.

    Parameters
    ----------
    kind : str or None
    on_step : callable
        As of `Simulation.prepare`.
    """
    if kind is not None and kind not in KINDS and kind not in kind_names():
        raise InputError(unknown("kind", kind, list(kind_names())))
    for name, path in shipped_scenarios().items():
        if "/" in name:  # no example
            continue
        scenario = load(path)
        if scenario.kind not in COMPILED_KINDS or kind not in (None, scenario.kind):
            continue
        for backend in _compiled_methods(scenario):
            chosen = load(path, backend=backend)
            simulation = mechanism_module(chosen.kind).simulation(chosen)
            yield WarmedUp(name, backend, simulation.prepare(on_step))


def _compiled_methods(scenario: "Scenario") -> tuple[str, ...]:
    """Return our methods for the scenario's friction law: SciPy's are there for comparison."""
    found = methods.methods_of(scenario.pairs, scenario.law)
    return tuple(name for name in found if not methods.METHODS[name].scipy_class)
