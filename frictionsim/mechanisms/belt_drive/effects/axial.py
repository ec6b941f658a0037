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
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

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
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ANGLE,
    COS,
    DAMPER,
    DAMPER_X,
    DAMPER_Y,
    FORCE_X,
    FORCE_Y,
    RIGHT_VX,
    RIGHT_VY,
    RIGHT_X,
    RIGHT_Y,
    SIN,
    SPIN,
    VX,
    VY,
    X,
    Y,
)
from frictionsim.scenario.schema import Params, unit_field

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.kernels.system import System
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

TINY = 1e-300  # a joint of no length has no force

FULL_TURN = 2.0 * pi

MAX_OBLIQUITY = 2.0  # the sum of two sin^2: there is no more

# sin(z)/z and (1 - cos(z))/z^2 in powers of z^2; the next term is below 1e-16 for |z| <= pi/4.
S3, S5, S7, S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
S11, S13, S15 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000
C2, C4, C6, C8 = 1 / 2, -1 / 24, 1 / 720, -1 / 40320
C10, C12, C14, C16 = 1 / 3628800, -1 / 479001600, 1 / 87178291200, -1 / 20922789888000


class AxialDampingTable(Params):
    """`[effects.axial_damping]`: of each joint, N s/m, or of the section, N s (b/l a joint)."""

    coefficient: float = unit_field(
        "N s/m or N s", "Damping along the belt: of a joint, N s/m, or of the section, N s.", gt=0
    )
    basis: Literal["joint", "section"] = Field(
        "joint",
        description="What the coefficient belongs to; of the section a joint has coefficient/l.",
    )


class AxialParameters(NamedTuple):
    """Spring and damper of a joint: c in N/m, b in N s/m or None."""

    stiffness: float
    damping: float | None


@inline_kernel
def cos_sin(n: int, angle: Array, cos: Array, sin: Array) -> None:
    """Write the cosine and sine of n angles, to a rounding of the angle itself.

    A quarter of the angle, less the full turns, goes into two short series; doubling it twice
    gives the angle back. In contrast to a library's functions this needs no branch.
    """
    for i in range(n):
        z = 0.25 * (angle[i] - FULL_TURN * np.floor(angle[i] / FULL_TURN + 0.5))
        u = z * z
        series = S3 + u * (S5 + u * (S7 + u * (S9 + u * (S11 + u * (S13 + u * S15)))))
        s = z + z * u * series
        c = 1.0 - u * (
            C2 + u * (C4 + u * (C6 + u * (C8 + u * (C10 + u * (C12 + u * (C14 + u * C16))))))
        )
        s2 = 2.0 * s * c
        sin[i] = 2.0 * s2 * (1.0 - 2.0 * s * s)
        cos[i] = 1.0 - 2.0 * s2 * s2


@inline_kernel
def joint_forces(chain: Chain, stiffness: float, kinematics: Array, workspace: Array) -> None:
    """Write directions, right ends and the force of every joint's spring on the body before it.

    Reads X, Y, ANGLE; writes COS, SIN, RIGHT_X, RIGHT_Y, FORCE_X, FORCE_Y.
    """
    n, half = chain.bodies, 0.5 * chain.length
    cos, sin, x, y = workspace[COS], workspace[SIN], kinematics[X], kinematics[Y]
    right_x, right_y = workspace[RIGHT_X], workspace[RIGHT_Y]
    force_x, force_y = workspace[FORCE_X], workspace[FORCE_Y]
    cos_sin(n, kinematics[ANGLE], cos, sin)
    for k in range(n):
        right_x[k + 1] = x[k] + half * cos[k]
    for k in range(n):
        right_y[k + 1] = y[k] + half * sin[k]
    right_x[0], right_y[0] = right_x[n], right_y[n]
    c = stiffness
    for k in range(n):
        force_x[k] = c * (x[k] - half * cos[k] - right_x[k])
    for k in range(n):
        force_y[k] = c * (y[k] - half * sin[k] - right_y[k])


@inline_kernel
def add_joint_damping(
    chain: Chain, damping: float | None, kinematics: Array, workspace: Array
) -> float:
    """Add the dampers along the joints to their forces; return the power they take, W.

    With the spring's force F = c d the damper's is b (d' . F) F / F^2: no root, and no direction
    to be kept for a joint without length. Reads all kinematics, COS, SIN; writes the rows of RIGHT
    velocities and dampers; adds to FORCE_X, FORCE_Y.
    """
    power = 0.0
    if damping is not None:
        n, half = chain.bodies, 0.5 * chain.length
        cos, sin = workspace[COS], workspace[SIN]
        vx, vy, spin = kinematics[VX], kinematics[VY], kinematics[SPIN]
        right_vx, right_vy = workspace[RIGHT_VX], workspace[RIGHT_VY]
        force_x, force_y = workspace[FORCE_X], workspace[FORCE_Y]
        for k in range(n):
            right_vx[k + 1] = vx[k] - half * sin[k] * spin[k]
        for k in range(n):
            right_vy[k + 1] = vy[k] + half * cos[k] * spin[k]
        right_vx[0], right_vy[0] = right_vx[n], right_vy[n]
        b, damper = damping, workspace[DAMPER]
        damper_x, damper_y = workspace[DAMPER_X], workspace[DAMPER_Y]
        for k in range(n):
            rate = force_x[k] * (vx[k] + half * sin[k] * spin[k] - right_vx[k]) + force_y[k] * (
                vy[k] - half * cos[k] * spin[k] - right_vy[k]
            )
            damper[k] = b * rate / (force_x[k] * force_x[k] + force_y[k] * force_y[k] + TINY)
            power += damper[k] * rate
        for k in range(n):
            damper_x[k] = damper[k] * force_x[k]
        for k in range(n):
            damper_y[k] = damper[k] * force_y[k]
        for k in range(n):
            force_x[k] += damper_x[k]
        for k in range(n):
            force_y[k] += damper_y[k]
    return power


@inline_kernel
def body_accelerations(chain: Chain, workspace: Array, ax: Array, ay: Array, aphi: Array) -> None:
    """Write the accelerations of the bodies under the forces of their joints."""
    n = chain.bodies
    cos, sin, force_x, force_y = (
        workspace[COS],
        workspace[SIN],
        workspace[FORCE_X],
        workspace[FORCE_Y],
    )
    force_x[n], force_y[n] = force_x[0], force_y[0]
    inv_mass = 1.0 / chain.mass
    lever = 0.5 * chain.length / chain.inertia
    for k in range(n):
        ax[k] = inv_mass * (force_x[k + 1] - force_x[k])
    for k in range(n):
        ay[k] = inv_mass * (force_y[k + 1] - force_y[k])
    for k in range(n):
        aphi[k] = lever * cos[k] * (force_y[k] + force_y[k + 1])
    for k in range(n):
        aphi[k] -= lever * sin[k] * (force_x[k] + force_x[k + 1])


@inline_kernel
def add_axial_forces(
    axial: AxialParameters,
    system: "System",
    kinematics: Array,
    ax: Array,
    ay: Array,
    aphi: Array,
) -> float:
    """Write the accelerations under the joints' springs and dampers: the first of all forces."""
    chain, workspace = system.chain, system.workspace
    joint_forces(chain, axial.stiffness, kinematics, workspace)
    power = add_joint_damping(chain, axial.damping, kinematics, workspace)
    body_accelerations(chain, workspace, ax, ay, aphi)
    return power


@inline_kernel
def joint_damping_correction(
    chain: Chain, old: Array, middle: Array, new: Array, workspace: Array, spare: Array
) -> float:
    """Return what dampers along the belt take beyond their heat at the velocities `middle`, W.

    Their force is that of `middle`, which is extrapolated; what it takes goes by the mean of the
    velocities before and after. `old`, `middle` and `new` are kinematics; the workspace has what
    the dampers were called with; `spare`, (6, width), is written over.
    """
    heat = 0.0
    n, half = chain.bodies, 0.5 * chain.length
    for row in range(VX, SPIN + 1):
        off, v0, v1, expected = spare[row], old[row], new[row], middle[row]
        for k in range(n):
            off[k] = 0.5 * (v0[k] + v1[k]) - expected[k]
    cos, sin = workspace[COS], workspace[SIN]
    damper_x, damper_y = workspace[DAMPER_X], workspace[DAMPER_Y]
    off_x, off_y, off_spin = spare[VX], spare[VY], spare[SPIN]
    off_right_x, off_right_y = spare[X], spare[Y]
    for k in range(n):
        off_right_x[k + 1] = off_x[k] - half * sin[k] * off_spin[k]
    for k in range(n):
        off_right_y[k + 1] = off_y[k] + half * cos[k] * off_spin[k]
    off_right_x[0], off_right_y[0] = off_right_x[n], off_right_y[n]
    for k in range(n):
        stretch_x = off_x[k] + half * sin[k] * off_spin[k] - off_right_x[k]
        stretch_y = off_y[k] - half * cos[k] * off_spin[k] - off_right_y[k]
        heat += damper_x[k] * stretch_x + damper_y[k] * stretch_y
    return heat


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
    table = AxialDampingTable
    stage = Stage.JOINT
    add_forces = add_axial_forces
    on_guided_string = True
    solved_for_in_fixed_steps = True

    def parameters(self, scenario: "BeltDriveScenario", chain: Chain) -> AxialParameters:
        table = scenario.effects.axial_damping
        return AxialParameters(
            scenario.mechanism.belt.axial_rigidity / chain.length,
            table.coefficient / (chain.length if table.basis == "section" else 1.0)
            if table
            else None,
        )

    def dissipates(self, parameters: AxialParameters) -> bool:
        return parameters.damping is not None

    def energies(self, parameters: AxialParameters, shape: Shape) -> Array:
        energies: Array = 0.5 * parameters.stiffness * np.sum(shape.gap**2, axis=1)
        return energies

    def add_gradient(self, parameters: AxialParameters, shape: Shape, gradient: Array) -> None:
        force = parameters.stiffness * shape.gap
        ahead = np.roll(force, -1, axis=0)
        gradient[:, :2] += force - ahead
        gradient[:, 2] -= 0.5 * shape.chain.length * np.sum(shape.across * (force + ahead), axis=1)

    def add_stiffness(self, parameters: AxialParameters, shape: Shape, to: Stiffness) -> None:
        c, h = parameters.stiffness, shape.scale
        arm = 0.5 * shape.chain.length / h
        force = c * shape.gap
        forces = force + np.roll(force, -1, axis=0)
        before = np.roll(shape.across, 1, axis=0)
        to.body[:, 2, 2] += arm / h * np.sum(shape.along * forces, axis=1)
        to.ends += np.diag([c, c, c * arm**2])
        to.coupling[:, :2, :2] += -c * np.eye(2)
        to.coupling[:, :2, 2] += -c * arm * before
        to.coupling[:, 2, :2] += c * arm * shape.across
        to.coupling[:, 2, 2] += c * arm**2 * np.sum(shape.across * before, axis=1)

    def add_wave_stiffness(self, parameters: AxialParameters, waves: Waves) -> None:
        c = parameters.stiffness
        waves.along += 4.0 * c
        waves.across += c * np.abs(waves.shift) ** 2
        waves.turning += c * np.abs(waves.lever) ** 2 + waves.tension * waves.chain.length
        waves.coupling += np.abs(c * waves.shift.conj() * waves.lever)

    def decay(self, parameters: AxialParameters, chain: Chain) -> Decay:
        return Decay(moving=4.0 * (parameters.damping or 0.0) / chain.mass)


def length_gradient(rigidity: float, shape: Shape) -> float:
    """Return the derivative of the springs' energy by the length of the bodies, N, at c = EA/l."""
    force = rigidity / shape.chain.length * shape.gap
    return -float(np.sum((mean_directions(shape) + 0.5 / rigidity * force) * force))


def length_stiffness(rigidity: float, shape: Shape) -> tuple[Array, float]:
    """Return its derivatives by the bodies, (n, 3), and by the length, at c = EA/l."""
    length, c = shape.chain.length, rigidity / shape.chain.length
    force = c * shape.gap
    forces = force + np.roll(force, -1, axis=0)
    change = -c * mean_directions(shape) - force / length
    ahead = np.roll(change, -1, axis=0)
    border = np.empty((len(change), 3))
    border[:, :2] = change - ahead
    turning = forces + length * (change + ahead)
    border[:, 2] = -0.5 / shape.scale * np.sum(shape.across * turning, axis=1)
    return border, float(np.sum(change**2)) / c


def mean_directions(shape: Shape) -> Array:
    """Return the mean direction of the two bodies at each joint, (n, 2)."""
    mean: Array = 0.5 * (shape.along + np.roll(shape.along, 1, axis=0))
    return mean


def joint_tensions(parameters: Any, shape: Shape) -> Array:
    """Return the forces of the joints' springs, (n,), N."""
    force = parameters.stiffness * shape.gap
    return np.hypot(force[:, 0], force[:, 1])
