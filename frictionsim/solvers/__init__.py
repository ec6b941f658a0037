"""The ways to integrate a mechanism of one coordinate.

Each module has make_solver(mechanism, settings, recording), which returns a `Solver`: its run steps
the mechanism to settings.duration, fills the buffer with samples and transitions, and calls on_step
along the way.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from frictionsim.scenario.methods import BACKENDS

if TYPE_CHECKING:
    from frictionsim.solvers.base import Solver


# Takes over from each of them where the drive prescribes the velocity.
PRESCRIBED = "frictionsim.solvers.prescribed_motion"


def solver_factory(name: str, prescribed: bool = False) -> Callable[..., "Solver"]:
    """Import a backend and return its `make_solver`; the others stay unloaded."""
    module = PRESCRIBED if prescribed else BACKENDS[name].module
    make_solver: Callable[..., Any] = import_module(module).make_solver
    return make_solver
