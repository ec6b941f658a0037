"""Bending of the belt: torsion springs and dampers of the joints.

    M_k = c_tor (phi_k - phi_(k-1)) + b_tor (phi_k' - phi_(k-1)'),    c_tor = EI/l    [1]_ eq 21
    (m l^2/12) phi_k'' = M_(k+1) - M_k

References
----------
.. [1] K. Kubas, Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import NamedTuple

from frictionsim.mechanisms.belt_drive.effects.base import (
    BeltEffect,
    BeltProperties,
    Stage,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    BEND,
    BEND_RATE,
    Array,
    System,
    full_vectors,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import bend_rates
from frictionsim.mechanisms.belt_drive.schema import BendingTable


class BendingParameters(NamedTuple):
    """Torsion spring and damper of a joint, N m/rad and N m s/rad."""

    stiffness: float
    damping: float


@inline_kernel
def add_bending(
    bending: "BendingParameters | None",
    system: System,
    kinematics: Array,
    ax: Array,
    ay: Array,
    aphi: Array,
) -> float:
    """Add the moments of the joints; return the power that their dampers take, W.

    Reads BEND and SPIN; adds to aphi.
    """
    power = 0.0
    if bending is not None:
        chain, workspace = system.chain, system.workspace
        inv_inertia, bend = 1.0 / chain.inertia, workspace[BEND]
        add_differences(chain.bodies, inv_inertia * bending.stiffness, bend, aphi)
        if bending.damping > 0.0:
            bend_rate = workspace[BEND_RATE]
            bend_rates(chain, kinematics, workspace)
            add_differences(chain.bodies, inv_inertia * bending.damping, bend_rate, aphi)
            for k in range(chain.bodies):
                power += bending.damping * bend_rate[k] * bend_rate[k]
    return power


@loop_kernel
def add_differences(bodies: int, coefficient: float, joint_values: Array, aphi: Array) -> None:
    """Add to each body the difference of its two joints."""
    for k in range(full_vectors(bodies)):
        aphi[k] += coefficient * (joint_values[k + 1] - joint_values[k])


class BendingEffect(BeltEffect):
    """`[effects.bending]`."""

    key = "bending"
    stage = Stage.JOINT
    add_forces = add_bending

    def parameters(
        self, table: BendingTable | None, belt: BeltProperties
    ) -> BendingParameters | None:
        if table is None:
            return None
        length = belt.chain.length
        return BendingParameters(table.rigidity / length, table.damping / length)
