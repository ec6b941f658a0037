"""Springs and dampers along the joints: what makes a chain of the bodies.

Body k has its left end at P_k - (l/2) e_k and its right end at P_k + (l/2) e_k, with e_k =
(cos phi_k, sin phi_k). Joint k is between the right end of body k - 1 and the left end of body k:

    d_k = P_k - (l/2) e_k - P_(k-1) - (l/2) e_(k-1)                       [1]_ eq 22
    F_k = c |d_k| + b d|d_k|/dt       along d_k,     c = EA/l             [1]_ eq 20
    m P_k'' = F_(k+1) - F_k,    (m l^2/12) phi_k'' = (l/2) e_k x (F_k + F_(k+1))

All loops are free of branches, so that the compiler makes vector instructions of them. For the same
reason a loop writes one array and reads few: that they do not overlap is checked at its start, and
a compiler that would have to check many pairs makes no vectors at all.

References
----------
.. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission with
   dry friction", Archive of Mechanical Engineering 61(4), 2014.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import (
    BeltEffect,
    BeltProperties,
    Stage,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ANGLE,
    BEND,
    COS,
    DAMPER_X,
    DAMPER_Y,
    FORCE_X,
    FORCE_Y,
    SIN,
    SPIN,
    VX,
    VY,
    Array,
    Chain,
    System,
    X,
    Y,
    full_vectors,
)
from frictionsim.mechanisms.belt_drive.schema import AxialDampingTable

TINY = 1e-300  # a joint of no length has no force

FULL_TURN = 2.0 * pi

MAX_OBLIQUITY = 2.0  # the sum of two sin^2: there is no more

# sin(z)/z and (1 - cos(z))/z^2 in powers of z^2; the next term is below 1e-16 for |z| <= pi/4.
S3, S5, S7, S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
S11, S13, S15 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000
C2, C4, C6, C8 = 1 / 2, -1 / 24, 1 / 720, -1 / 40320
C10, C12, C14, C16 = 1 / 3628800, -1 / 479001600, 1 / 87178291200, -1 / 20922789888000


class AxialParameters(NamedTuple):
    """Spring and damper of a joint: c in N/m, b in N s/m or None."""

    stiffness: float
    damping: float | None


@inline_kernel
def cos_sin(angle: float) -> tuple[float, float]:
    """Return the cosine and sine of an angle, to a rounding of the angle itself.

    A quarter of the angle, less the full turns, goes into two short series; doubling it twice
    gives the angle back. In contrast to a library's functions this needs no branch.
    """
    z = 0.25 * (angle - FULL_TURN * np.floor(angle / FULL_TURN + 0.5))
    u = z * z
    series = S3 + u * (S5 + u * (S7 + u * (S9 + u * (S11 + u * (S13 + u * S15)))))
    s = z + z * u * series
    c = 1.0 - u * (
        C2 + u * (C4 + u * (C6 + u * (C8 + u * (C10 + u * (C12 + u * (C14 + u * C16))))))
    )
    s2 = 2.0 * s * c
    return 1.0 - 2.0 * s2 * s2, 2.0 * s2 * (1.0 - 2.0 * s * s)


class Directions(NamedTuple):
    """The directions of the bodies, (width,) each: cosine and sine of their angles."""

    cos: Array
    sin: Array


class JointForces(NamedTuple):
    """The forces of joints and the parts of their dampers, N, (width,) each.

    Joint k pulls body k - 1 by it, and body k by its opposite.
    """

    x: Array
    y: Array
    damper_x: Array
    damper_y: Array


class JointForce(NamedTuple):
    """The force of one joint and the part of its damper, N, and the power that this takes, W."""

    x: float
    y: float
    damper_x: float
    damper_y: float
    power: float


@inline_kernel
def directions_of(workspace: Array) -> Directions:
    """Return the directions of the bodies."""
    return Directions(workspace[COS], workspace[SIN])


@inline_kernel
def joint_forces_of(workspace: Array) -> JointForces:
    """Return the forces of the joints."""
    return JointForces(
        workspace[FORCE_X], workspace[FORCE_Y], workspace[DAMPER_X], workspace[DAMPER_Y]
    )


@loop_kernel
def turn_bodies(chain: Chain, angle: Array, cos: Array, sin: Array, bend: Array) -> None:
    """Write the directions of the bodies, and how much the joint behind each is bent."""
    for k in range(full_vectors(chain.bodies)):
        cos[k], sin[k] = cos_sin(angle[k])
        bend[k] = angle[k + 1] - angle[k]


@inline_kernel
def joint_force(
    chain: Chain, axial: AxialParameters, kinematics: Array, directions: Directions, a: int, b: int
) -> JointForce:
    """Return the force of the joint between bodies a and b.

    With the spring's force F = c d the damper's is b (d' . F) F / F^2: no root, and no direction
    to be kept for a joint without length.
    """
    cos, sin = directions.cos, directions.sin
    half, c = 0.5 * chain.length, axial.stiffness
    x = c * (kinematics[X, b] - kinematics[X, a] - half * (cos[a] + cos[b]))
    y = c * (kinematics[Y, b] - kinematics[Y, a] - half * (sin[a] + sin[b]))
    return damped_force(half, axial.damping, kinematics, directions, a, b, x, y)


@inline_kernel
def damped_force(
    half: float,
    damping: float | None,
    kinematics: Array,
    directions: Directions,
    a: int,
    b: int,
    x: float,
    y: float,
) -> JointForce:
    """Return the force of a joint whose spring has the force x, y, with the damper that it has."""
    cos, sin = directions.cos, directions.sin
    if damping is not None:
        turning_a, turning_b = half * kinematics[SPIN, a], half * kinematics[SPIN, b]
        vx = kinematics[VX, b] - kinematics[VX, a] + (sin[a] * turning_a + sin[b] * turning_b)
        vy = kinematics[VY, b] - kinematics[VY, a] - (cos[a] * turning_a + cos[b] * turning_b)
        rate = x * vx + y * vy
        damper = damping * rate / (x * x + y * y + TINY)
        part_x, part_y = damper * x, damper * y
        return JointForce(x + part_x, y + part_y, part_x, part_y, damper * rate)
    return JointForce(x, y, 0.0, 0.0, 0.0)


@loop_kernel
def force_rows(
    chain: Chain,
    axial: AxialParameters,
    kinematics: Array,
    directions: Directions,
    behind: JointForces,
) -> float:
    """Write the forces of the joints behind each body; return the power of their dampers, W."""
    power = 0.0
    for k in range(full_vectors(chain.bodies)):
        force = joint_force(chain, axial, kinematics, directions, k, k + 1)
        behind.x[k], behind.y[k] = force.x, force.y
        if axial.damping is not None:
            behind.damper_x[k], behind.damper_y[k] = force.damper_x, force.damper_y
            taken = force.power
            power += taken if k < chain.bodies - 1 else 0.0
    return power


@inline_kernel
def joint_forces(
    chain: Chain, axial: AxialParameters, kinematics: Array, workspace: Array
) -> float:
    """Write what the joints do, springs and dampers; return the power of the dampers, W.

    Reads all kinematics; writes COS, SIN, BEND, the forces and the dampers.
    """
    n, angle, bend = chain.bodies, kinematics[ANGLE], workspace[BEND]
    directions, forces = directions_of(workspace), joint_forces_of(workspace)
    turn_bodies(chain, angle, directions.cos, directions.sin, bend[1:])
    behind = JointForces(forces.x[1:], forces.y[1:], forces.damper_x[1:], forces.damper_y[1:])
    power = force_rows(chain, axial, kinematics, directions, behind)
    first = joint_force(chain, axial, kinematics, directions, n - 1, 0)
    for k in (0, n):
        forces.x[k], forces.y[k] = first.x, first.y
        forces.damper_x[k], forces.damper_y[k] = first.damper_x, first.damper_y
    bend[0] = bend[n] = angle[0] - angle[n - 1] + chain.total_turning
    return power + first.power


@loop_kernel
def body_accelerations(
    chain: Chain, directions: Directions, forces: JointForces, ax: Array, ay: Array, aphi: Array
) -> None:
    """Write the accelerations of the bodies under the forces of their joints."""
    cos, sin, force_x, force_y = directions.cos, directions.sin, forces.x, forces.y
    inv_mass = 1.0 / chain.mass
    lever = 0.5 * chain.length / chain.inertia
    for k in range(full_vectors(chain.bodies)):
        x0, x1, y0, y1 = force_x[k], force_x[k + 1], force_y[k], force_y[k + 1]
        ax[k] = inv_mass * (x1 - x0)
        ay[k] = inv_mass * (y1 - y0)
        aphi[k] = lever * (cos[k] * (y0 + y1) - sin[k] * (x0 + x1))


@inline_kernel
def add_axial_forces(
    axial: AxialParameters, system: System, kinematics: Array, ax: Array, ay: Array, aphi: Array
) -> float:
    """Write the accelerations under the joints' springs and dampers: the first of all forces."""
    chain, workspace = system.chain, system.workspace
    power = joint_forces(chain, axial, kinematics, workspace)
    directions, forces = directions_of(workspace), joint_forces_of(workspace)
    body_accelerations(chain, directions, forces, ax, ay, aphi)
    return power


@inline_kernel
def damper_power(
    half: float,
    directions: Directions,
    forces: JointForces,
    k: int,
    vx: float,
    vy: float,
    spin: float,
) -> float:
    """Return the power that the dampers of its two joints take from body k at velocities, W.

    D_k is the force of a damper; its power is summed up by bodies:
    (D_k - D_(k+1)) . v_k - (l/2) (e_k x (D_k + D_(k+1))) phi_k'.
    """
    cos, sin, x, y = directions.cos, directions.sin, forces.damper_x, forces.damper_y
    lever = sin[k] * (x[k] + x[k + 1]) - cos[k] * (y[k] + y[k + 1])
    return (x[k] - x[k + 1]) * vx + (y[k] - y[k + 1]) * vy + half * lever * spin


@inline_kernel
def has_oblique_joints(workspace: Array, chain: Chain, max_obliquity: float) -> int:
    """Return whether the dampers of a body's joints turn it too fast for extrapolation.

    A joint without much tension may point anywhere; its damper then meets the small inertia of
    the bodies that it turns. sin^2 of the angle between joint and body measures that.
    """
    if max_obliquity >= MAX_OBLIQUITY:
        return 0
    cos, sin, force_x, force_y = (
        workspace[COS],
        workspace[SIN],
        workspace[FORCE_X],
        workspace[FORCE_Y],
    )
    count = 0.0
    for k in range(chain.bodies):
        x0, y0, x1, y1 = force_x[k], force_y[k], force_x[k + 1], force_y[k + 1]
        before, after = y0 * cos[k] - x0 * sin[k], y1 * cos[k] - x1 * sin[k]
        size0, size1 = x0 * x0 + y0 * y0, x1 * x1 + y1 * y1
        # before^2/size0 + after^2/size1 > max_obliquity, without the divisions
        weighted = before * before * size1 + after * after * size0
        count += 1.0 if weighted > max_obliquity * size0 * size1 else 0.0
    return 1 if count > 0.0 else 0


class AxialEffect(BeltEffect):
    """The springs that every belt has, and the dampers of `[effects.axial_damping]`."""

    key = "axial_damping"
    stage = Stage.JOINT
    add_forces = add_axial_forces

    def parameters(self, table: AxialDampingTable | None, belt: BeltProperties) -> AxialParameters:
        length, damping = belt.chain.length, None
        if table is not None:
            damping = table.coefficient / (length if table.basis == "section" else 1.0)
        return AxialParameters(belt.axial_rigidity / length, damping)
