"""Solvers for mechanisms of one coordinate.

Each module has make_solver(mechanism, settings, buffer), which returns a `Solver`. Its `run`
integrates to settings.duration, fills the buffer with samples and transitions, and calls on_step
between steps.
"""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from frictionsim.scenario.methods import SINGLE_DOF, pair_of

if TYPE_CHECKING:
    from frictionsim.solvers.base import Solver


# Replaces any backend if the drive prescribes the velocity.
PRESCRIBED = "frictionsim.solvers.prescribed_motion"


def solver_factory(method: str, law: str, prescribed: bool = False) -> Callable[..., "Solver"]:
    """Import the solver for a friction law and a method, and return its `make_solver`.

    Parameters
    ----------
    method : str
    law : str
        Empty without dry friction.
    prescribed : bool
        The drive prescribes the velocity.

    Returns
    -------
    callable
    """
    module = PRESCRIBED if prescribed else pair_of(SINGLE_DOF, law, method).module
    make_solver: Callable[..., Any] = import_module(module).make_solver
    return make_solver
