"""The ways to solve a scene, by the name that a scenario gives as `solver.backend`.

Which of them can do a scene is the matter of its kind (`Scene.BACKENDS`). Those for mechanisms of
one coordinate have solution(mechanism, settings, recording), which returns a `Solution`: its run
steps the mechanism to settings.duration, fills the recording with samples and transitions, and
polls along the way.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from frictionsim.backends.solution import Solution


class Backend(NamedTuple):
    """Where a backend is, and what is particular to it.

    Attributes
    ----------
    module : str
    fixed_step : bool
        It takes steps of a given length, `solver.step`.
    regularised : bool
        It smooths dry friction over `solver.transition_speed`.
    integrator : str
        The class of SciPy that steps it; empty for our own integrator.
    implicit : bool
        Stiffness does not shorten its steps.
    """

    module: str
    fixed_step: bool = False
    regularised: bool = False
    integrator: str = ""
    implicit: bool = False

    @property
    def tells_rejected(self) -> bool:
        """Whether its rejected steps are known; SciPy's implicit methods do not tell."""
        return not self.implicit


_REGULARISED = "frictionsim.backends.regularised"

BACKENDS = {
    "events": Backend("frictionsim.backends.events"),
    "rkf45": Backend("frictionsim.backends.rkf45"),
    "published": Backend("frictionsim.backends.published", fixed_step=True),
    "moreau": Backend("frictionsim.backends.belt_moreau", fixed_step=True),
    "regularised": Backend(_REGULARISED, regularised=True),
    "rk45": Backend(_REGULARISED, regularised=True, integrator="RK45"),
    "dop853": Backend(_REGULARISED, regularised=True, integrator="DOP853"),
    "radau": Backend(_REGULARISED, regularised=True, integrator="Radau", implicit=True),
    "bdf": Backend(_REGULARISED, regularised=True, integrator="BDF", implicit=True),
    "lsoda": Backend(_REGULARISED, regularised=True, integrator="LSODA", implicit=True),
}

# Those that solve a mechanism of one coordinate.
SINGLE_DOF = (
    *("events", "rkf45", "published"),
    *("regularised", "rk45", "dop853", "radau", "bdf", "lsoda"),
)

# Those that can do a belt drive: modules with a class `Stepping`.
BELT = {
    "rkf45": "frictionsim.backends.belt_rkf45",
    "moreau": "frictionsim.backends.belt_moreau",
    **{name: "frictionsim.backends.belt_scipy" for name, b in BACKENDS.items() if b.integrator},
}

# Takes over from each of them where the drive prescribes the velocity.
PRESCRIBED = "frictionsim.backends.prescribed"


def solution_of(name: str, prescribed: bool = False) -> Callable[..., "Solution"]:
    """Import a backend and return its `solution`; the others stay unloaded."""
    module = PRESCRIBED if prescribed else BACKENDS[name].module
    solution: Callable[..., Any] = import_module(module).solution
    return solution
