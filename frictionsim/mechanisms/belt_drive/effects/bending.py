"""Bending of the belt: torsion springs and dampers of the joints.

    M_k = c_tor (phi_k - phi_(k-1)) + b_tor (phi_k' - phi_(k-1)'),    c_tor = EI/l    [1]_ eq 21
    (m l^2/12) phi_k'' = M_(k+1) - M_k

References
----------
.. [1] K. Kubas, Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import (
    Array,
    BeltEffect,
    Chain,
    Decay,
    Shape,
    Stage,
    Stiffness,
    Waves,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import ANGLE, MOMENT, SPIN
from frictionsim.scenario.schema import Params, unit_field

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.kernels.system import System
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario


class BendingTable(Params):
    """`[effects.bending]`: of the section; a joint has rigidity/l and damping/l."""

    rigidity: float = unit_field(
        "N m^2", "Bending rigidity EI of the section; a joint has EI/l.", gt=0
    )
    damping: float = unit_field(
        "N m^2 s", "Bending damping of the section; a joint has it over l.", 0.0, ge=0
    )


class BendingParameters(NamedTuple):
    """Torsion spring and damper of a joint, N m/rad and N m s/rad."""

    stiffness: float
    damping: float


@inline_kernel
def add_bending(
    bending: "BendingParameters | None",
    system: "System",
    kinematics: Array,
    ax: Array,
    ay: Array,
    aphi: Array,
) -> float:
    """Add the moments of the joints; return the power that their dampers take, W.

    Reads ANGLE and SPIN; writes MOMENT; adds to aphi.
    """
    power = 0.0
    if bending is not None:
        chain = system.chain
        n = chain.bodies
        angle, spin, moment = kinematics[ANGLE], kinematics[SPIN], system.workspace[MOMENT]
        stiffness, damping = bending.stiffness, bending.damping
        turned = angle[0] - angle[n - 1] + chain.total_turning
        turning = spin[0] - spin[n - 1]
        moment[0] = stiffness * turned + damping * turning
        power += damping * turning * turning
        for k in range(1, n):
            moment[k] = stiffness * (angle[k] - angle[k - 1]) + damping * (spin[k] - spin[k - 1])
        for k in range(1, n):
            turning = spin[k] - spin[k - 1]
            power += damping * turning * turning
        moment[n] = moment[0]
        inv_inertia = 1.0 / chain.inertia
        for k in range(n):
            aphi[k] += inv_inertia * (moment[k + 1] - moment[k])
    return power


class BendingEffect(BeltEffect):
    """`[effects.bending]`."""

    key = "bending"
    table = BendingTable
    stage = Stage.JOINT
    add_forces = add_bending

    def parameters(self, scenario: "BeltDriveScenario", chain: Chain) -> BendingParameters | None:
        table = scenario.effects.bending
        if table is None:
            return None
        return BendingParameters(table.rigidity / chain.length, table.damping / chain.length)

    def dissipates(self, parameters: BendingParameters) -> bool:
        return parameters.damping > 0.0

    def energies(self, parameters: BendingParameters, shape: Shape) -> Array:
        return 0.5 * parameters.stiffness * shape.bend**2

    def add_gradient(self, parameters: BendingParameters, shape: Shape, gradient: Array) -> None:
        moment = parameters.stiffness * shape.bend
        gradient[:, 2] += moment - np.roll(moment, -1)

    def add_stiffness(self, parameters: BendingParameters, shape: Shape, to: Stiffness) -> None:
        stiffness = parameters.stiffness / shape.scale**2
        to.ends[2, 2] += stiffness
        to.coupling[:, 2, 2] -= stiffness

    def add_wave_stiffness(self, parameters: BendingParameters, waves: Waves) -> None:
        waves.turning += parameters.stiffness * np.abs(waves.shift) ** 2

    def decay(self, parameters: BendingParameters, chain: Chain) -> Decay:
        return Decay(turning=4.0 * parameters.damping / chain.inertia)
