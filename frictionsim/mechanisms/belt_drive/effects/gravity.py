"""The weight of the bodies, m g."""

from typing import NamedTuple

from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect, BeltProperties, Stage
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import Array, System
from frictionsim.mechanisms.effects import Gravity


class GravityParameters(NamedTuple):
    """The acceleration of gravity, m/s^2."""

    x: float
    y: float


@inline_kernel
def add_gravity(
    gravity: "GravityParameters | None",
    system: System,
    kinematics: Array,
    ax: Array,
    ay: Array,
    aphi: Array,
) -> float:
    """Add the acceleration of gravity to ax and ay."""
    if gravity is not None:
        for k in range(system.chain.bodies):
            ax[k] += gravity.x
        for k in range(system.chain.bodies):
            ay[k] += gravity.y
    return 0.0


class GravityEffect(BeltEffect):
    """`[effects.gravity]`."""

    key = "gravity"
    stage = Stage.BODY
    add_forces = add_gravity

    def parameters(self, table: Gravity | None, belt: BeltProperties) -> GravityParameters | None:
        return None if table is None else GravityParameters(0.0, -table.g)
