"""The forces in the belt itself: springs, dampers, bending and weight of a closed chain of bodies.

Body k has its left end at P_k - (l/2) e_k and its right end at P_k + (l/2) e_k, with e_k =
(cos phi_k, sin phi_k). Joint k is between the right end of body k - 1 and the left end of body k:

    d_k = P_k - (l/2) e_k - P_(k-1) - (l/2) e_(k-1)                       [1]_ eq 22
    F_k = c |d_k| + b d|d_k|/dt       along d_k                           [1]_ eq 20
    M_k = c_tor (phi_k - phi_(k-1)) + b_tor (phi_k' - phi_(k-1)')         [1]_ eq 21
    m P_k'' = F_(k+1) - F_k,    (m l^2/12) phi_k'' = (l/2) e_k x (F_k + F_(k+1)) + M_(k+1) - M_k

Each effect is a kernel of its own that takes its parameters, or None where the scenario does not
name it: a kernel that is called with None is compiled to nothing at all. All loops are free of
branches, so that the compiler makes vector instructions of them; an array over the joints has a
cell more than there are joints, a copy of its first, in the place of an index that wraps around.
For the same reason a loop writes one array and reads few: that they do not overlap is checked at
its start, and a compiler that would have to check many pairs makes no vectors at all.

References
----------
.. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission with
   dry friction", Archive of Mechanical Engineering 61(4), 2014.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel

TINY = 1e-300  # a joint of no length pulls nowhere

FULL_TURN = 2.0 * pi

# sin(z)/z and (1 - cos(z))/z^2 in powers of z^2; the next term is below 1e-16 for |z| <= pi/4.
S3, S5, S7, S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
S11, S13, S15 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000
C2, C4, C6, C8 = 1 / 2, -1 / 24, 1 / 720, -1 / 40320
C10, C12, C14, C16 = 1 / 3628800, -1 / 479001600, 1 / 87178291200, -1 / 20922789888000


class Chain(NamedTuple):
    """What the bodies and joints have in common.

    Attributes
    ----------
    bodies : int
    length, mass, inertia : float, m, kg, kg m^2
        Of a body.
    stiffness : float, N/m
        Of a joint: c = EA/l.
    turn : float, rad
        By which the belt turns in one round, 2 pi or -2 pi.
    """

    bodies: int
    length: float
    mass: float
    inertia: float
    stiffness: float
    turn: float


class AxialDamping(NamedTuple):
    """Viscous damping along the joints: b, N s/m."""

    coefficient: float


class Bending(NamedTuple):
    """Torsion springs and dampers of the joints: N m/rad and N m s/rad."""

    stiffness: float
    damping: float


class Weight(NamedTuple):
    """Acceleration of gravity, m/s^2."""

    x: float
    y: float


# Rows of a motion, (6, n and more): positions and velocities of all bodies, m, rad, m/s, rad/s.
X, Y, ANGLE, VX, VY, SPIN = range(6)

# Rows of the room to work in, (12, n + 1 and more), over bodies or joints; the last three are the
# pull of a damper over that of its spring, and its components, N.
COS, SIN, RIGHT_X, RIGHT_Y, RIGHT_VX, RIGHT_VY, FORCE_X, FORCE_Y, MOMENT = range(9)
DAMPER, DAMPER_X, DAMPER_Y = range(9, 12)
WORKSPACE_ROWS = 12


@inline_kernel
def cos_sin(n, angle, cos, sin):
    """Write the cosine and sine of angles, to a rounding of the angle itself.

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
def joint_forces(chain, kinematics, workspace):
    """Write the pull of every joint's spring on the body before it, N."""
    n, half = chain.bodies, 0.5 * chain.length
    cos, sin, x, y = workspace[COS], workspace[SIN], kinematics[X], kinematics[Y]
    right_x, right_y, force_x, force_y = (
        workspace[RIGHT_X],
        workspace[RIGHT_Y],
        workspace[FORCE_X],
        workspace[FORCE_Y],
    )
    cos_sin(n, kinematics[ANGLE], cos, sin)
    for k in range(n):
        right_x[k + 1] = x[k] + half * cos[k]
    for k in range(n):
        right_y[k + 1] = y[k] + half * sin[k]
    right_x[0], right_y[0] = right_x[n], right_y[n]
    c = chain.stiffness
    for k in range(n):
        force_x[k] = c * (x[k] - half * cos[k] - right_x[k])
    for k in range(n):
        force_y[k] = c * (y[k] - half * sin[k] - right_y[k])


@inline_kernel
def add_joint_damping(chain, kinematics, workspace, damping):
    """Add the dampers along the joints to their pull; return the power they take, W.

    With the spring's pull F = c d the damper's is b (d' . F) F / F^2: no root, and no direction
    to be kept for a joint without length.
    """
    heat = 0.0
    if damping is not None:
        n, half = chain.bodies, 0.5 * chain.length
        cos, sin, vx, vy, spin = (
            workspace[COS],
            workspace[SIN],
            kinematics[VX],
            kinematics[VY],
            kinematics[SPIN],
        )
        right_vx, right_vy = workspace[RIGHT_VX], workspace[RIGHT_VY]
        force_x, force_y = workspace[FORCE_X], workspace[FORCE_Y]
        for k in range(n):
            right_vx[k + 1] = vx[k] - half * sin[k] * spin[k]
        for k in range(n):
            right_vy[k + 1] = vy[k] + half * cos[k] * spin[k]
        right_vx[0], right_vy[0] = right_vx[n], right_vy[n]
        b, damper = damping.coefficient, workspace[DAMPER]
        damper_x, damper_y = workspace[DAMPER_X], workspace[DAMPER_Y]
        for k in range(n):
            rate = force_x[k] * (vx[k] + half * sin[k] * spin[k] - right_vx[k]) + force_y[k] * (
                vy[k] - half * cos[k] * spin[k] - right_vy[k]
            )
            damper[k] = b * rate / (force_x[k] * force_x[k] + force_y[k] * force_y[k] + TINY)
            heat += damper[k] * rate
        for k in range(n):
            damper_x[k] = damper[k] * force_x[k]
        for k in range(n):
            damper_y[k] = damper[k] * force_y[k]
        for k in range(n):
            force_x[k] += damper_x[k]
        for k in range(n):
            force_y[k] += damper_y[k]
    return heat


@inline_kernel
def joint_damping_correction(chain, before, middle, after, workspace, spare, damping):
    """Return what dampers along the belt take beyond their heat at the velocities `middle`, W.

    Their force is that of `middle`, which is extrapolated; what it takes goes by the mean of the
    velocities before and after. `room` has what the dampers were called with; `spare`, (6, width),
    is written over.
    """
    heat = 0.0
    if damping is not None:
        n, half = chain.bodies, 0.5 * chain.length
        for row in range(VX, SPIN + 1):
            off, v0, v1, expected = spare[row], before[row], after[row], middle[row]
            for k in range(n):
                off[k] = 0.5 * (v0[k] + v1[k]) - expected[k]
        cos, sin, damper_x, damper_y = (
            workspace[COS],
            workspace[SIN],
            workspace[DAMPER_X],
            workspace[DAMPER_Y],
        )
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
def body_accelerations(chain, workspace, ax, ay, aphi):
    """Write the accelerations of the bodies under the pull of their joints."""
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
def add_bending(chain, kinematics, workspace, aphi, bending):
    """Add the torsion springs and dampers of the joints; return the power these take, W."""
    heat = 0.0
    if bending is not None:
        n = chain.bodies
        angle, spin, moment = kinematics[ANGLE], kinematics[SPIN], workspace[MOMENT]
        stiffness, damping = bending.stiffness, bending.damping
        turned = angle[0] - angle[n - 1] + chain.turn
        turning = spin[0] - spin[n - 1]
        moment[0] = stiffness * turned + damping * turning
        heat += damping * turning * turning
        for k in range(1, n):
            moment[k] = stiffness * (angle[k] - angle[k - 1]) + damping * (spin[k] - spin[k - 1])
        for k in range(1, n):
            turning = spin[k] - spin[k - 1]
            heat += damping * turning * turning
        moment[n] = moment[0]
        inv_inertia = 1.0 / chain.inertia
        for k in range(n):
            aphi[k] += inv_inertia * (moment[k + 1] - moment[k])
    return heat


@inline_kernel
def add_gravity(chain, ax, ay, weight):
    """Add the acceleration of gravity."""
    if weight is not None:
        for k in range(chain.bodies):
            ax[k] += weight.x
        for k in range(chain.bodies):
            ay[k] += weight.y
