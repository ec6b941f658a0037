"""An effect of belts that the package does not have: each body on a spring and a damper to ground.

All of it is here; `EFFECTS.append(FoundationEffect())` is the line that adds it.
"""

from typing import Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import (
    Array,
    BeltEffect,
    BeltProperties,
    Chain,
    Decay,
    Shape,
    Stiffness,
    Waves,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import VX, VY, X, Y
from frictionsim.scenario.schema import Params, unit_field


class FoundationTable(Params):
    """`[effects.foundation]`: of each body, to the origin."""

    stiffness: float = unit_field("N/m", "Stiffness of the foundation under each body.", gt=0)
    damping: float = unit_field("N s/m", "Damping of the foundation under each body.", 0.0, ge=0)


class Foundation(NamedTuple):
    """Spring and damper of a body, N/m and N s/m."""

    stiffness: float
    damping: float


@inline_kernel
def add_foundation(
    foundation: Foundation | None, system: Any, kinematics: Array, ax: Array, ay: Array, aphi: Array
) -> float:
    """Add -(k P + b v)/m; return the power damped."""
    power = 0.0
    if foundation is not None:
        inv_mass, k, b = 1.0 / system.chain.mass, foundation.stiffness, foundation.damping
        for i in range(system.chain.bodies):
            vx, vy = kinematics[VX, i], kinematics[VY, i]
            ax[i] -= inv_mass * (k * kinematics[X, i] + b * vx)
            ay[i] -= inv_mass * (k * kinematics[Y, i] + b * vy)
            power += b * (vx * vx + vy * vy)
    return power


class FoundationEffect(BeltEffect):
    """`[effects.foundation]`."""

    key = "foundation"
    table = FoundationTable
    add_forces = add_foundation

    def parameters(self, table: FoundationTable | None, belt: BeltProperties) -> Foundation | None:
        return None if table is None else Foundation(table.stiffness, table.damping)

    def dissipates(self, parameters: Foundation) -> bool:
        return parameters.damping > 0.0

    def energies(self, parameters: Foundation, shape: Shape) -> Array:
        energies: Array = 0.5 * parameters.stiffness * np.sum(shape.position**2, axis=1)
        return energies

    def add_gradient(self, parameters: Foundation, shape: Shape, gradient: Array) -> None:
        gradient[:, :2] += parameters.stiffness * shape.position

    def add_stiffness(self, parameters: Foundation, shape: Shape, stiffness: Stiffness) -> None:
        stiffness.body[:, :2, :2] += parameters.stiffness * np.eye(2)

    def add_wave_stiffness(self, parameters: Foundation, waves: Waves) -> None:
        waves.along += parameters.stiffness
        waves.across += parameters.stiffness

    def decay(self, parameters: Foundation, chain: Chain) -> Decay:
        return Decay(moving=parameters.damping / chain.mass)
