"""The parts of belts that tests call by name: all that they know of the inside stands here.

What is compiled, what is needed to call it, the path of the ideal belt, the belt at rest, and the
steppers. Whoever moves one of these changes this file alone; scenarios, runs and results of belts
are asked by `frictionsim` itself.
"""

from importlib import import_module
from typing import Any

from frictionsim.mechanisms.belt_drive.belt_simulation import observer_of
from frictionsim.mechanisms.belt_drive.effects.axial import joint_forces, turn_bodies
from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    friction_curve as compiled_friction_curve,
)
from frictionsim.mechanisms.belt_drive.effects.contact import contact_forces
from frictionsim.mechanisms.belt_drive.equation import find_contact_candidates, rhs
from frictionsim.mechanisms.belt_drive.geometry import PulleyCircle, belt_path
from frictionsim.mechanisms.belt_drive.kernels.contacts import update_contact_modes
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    BACKWARD_LIMIT,
    FORCE_X,
    FORCE_Y,
    FORWARD_LIMIT,
    FRICTION,
    MODE,
    NORMAL,
    NX,
    NY,
    RADIUS,
    SLIP,
    SPEED,
    STICK_BIAS,
    STICKING,
    TORQUE,
    Chain,
    derivative,
    kinematics_of,
    padded_width,
    value,
)
from frictionsim.mechanisms.belt_drive.limits import decay_rates
from frictionsim.mechanisms.belt_drive.model import BeltModel, assemble
from frictionsim.mechanisms.belt_drive.steppers import moreau, rkf45
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    StiffDamping,
    solve_damping_and_friction,
    stiff_damping,
)

__all__ = [
    "ALPHA",
    "BACKWARD_LIMIT",
    "FORCE_X",
    "FORCE_Y",
    "FORWARD_LIMIT",
    "FRICTION",
    "MODE",
    "NORMAL",
    "NX",
    "NY",
    "RADIUS",
    "SLIP",
    "SPEED",
    "STICKING",
    "STICK_BIAS",
    "TORQUE",
    "BeltModel",
    "Chain",
    "PulleyCircle",
    "StiffDamping",
    "assemble",
    "belt_path",
    "compiled_friction_curve",
    "contact_forces",
    "decay_rates",
    "derivative",
    "find_contact_candidates",
    "joint_forces",
    "kinematics_of",
    "moreau",
    "observer_of",
    "padded_width",
    "rhs",
    "rkf45",
    "solve_damping_and_friction",
    "stepper_of",
    "stiff_damping",
    "turn_bodies",
    "update_contact_modes",
    "value",
]


def stepper_of(model: BeltModel, scenario: Any) -> Any:
    """Return the stepper of a scenario's method, for its model."""
    return import_module(scenario.pair.module).STEPPER(model, scenario.solver)
