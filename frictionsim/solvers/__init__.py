"""Solvers for mechanisms of one coordinate, and of several coordinates and contacts.

Each module of a pair of friction law and method names its class as SOLVER. Its
`run` integrates to settings.duration, fills the buffer with samples and transitions, and calls
on_step between steps.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from frictionsim.scenario.methods import SINGLE_DOF, pair_of

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.base import Solver
    from frictionsim.solvers.common import SampleBuffer
    from frictionsim.solvers.mechanism import Mechanism


def new_solver(
    mechanism: "Mechanism", settings: "SolverSettings", buffer: "SampleBuffer"
) -> "Solver":
    """Return the solver for the friction law of a mechanism and the method of its settings.

    Returns
    -------
    Solver
        Without dry friction, or if the drive prescribes the velocity, the same for all methods.
    """
    if mechanism.prescribed:
        from frictionsim.solvers.prescribed_motion import PrescribedMotionSolver

        return PrescribedMotionSolver(mechanism, settings, buffer)
    if mechanism.contact is None:
        from frictionsim.solvers.frictionless import FrictionlessSolver

        return FrictionlessSolver(mechanism, settings, buffer)
    module = pair_of(SINGLE_DOF, mechanism.contact.law, settings.backend).module
    solver: Solver = import_module(module).SOLVER(mechanism, settings, buffer)
    return solver
