"""The ways to integrate a mechanism of one coordinate.

Each module has make_solver(mechanism, settings, buffer), which returns a `Solver`: its run steps
the mechanism to settings.duration, fills the buffer with samples and transitions, and calls on_step
along the way.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from frictionsim.scenario.methods import SINGLE_DOF, pair_of

if TYPE_CHECKING:
    from frictionsim.solvers.base import Solver


# Takes over from each of them where the drive prescribes the velocity.
PRESCRIBED = "frictionsim.solvers.prescribed_motion"


def solver_factory(method: str, law: str, prescribed: bool = False) -> Callable[..., "Solver"]:
    """Import what integrates a law by a method; return its `make_solver`.

    `law` is empty for a mechanism without dry friction.
    """
    module = PRESCRIBED if prescribed else pair_of(SINGLE_DOF, law, method).module
    make_solver: Callable[..., Any] = import_module(module).make_solver
    return make_solver
