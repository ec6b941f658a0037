"""The equations of motion of a belt drive, compiled: joints, contacts, friction, pulleys.

In the plane body k has its left end at P_k - (l/2) e_k and its right end at P_k + (l/2) e_k, with
e_k = (cos phi_k, sin phi_k). Joint k is between body k - 1 and body k:

    d_k = P_k - (l/2) e_k - P_(k-1) - (l/2) e_(k-1)                       [1]_ eq 22
    F_k = c d_k + b (d_k' . u_k) u_k,  u_k = d_k/|d_k|,  c = EA/l         [1]_ eq 20
    M_k = c_tor (phi_k - phi_(k-1)) + b_tor (phi_k' - phi_(k-1)')         [1]_ eq 21
    m P_k'' = F_(k+1) - F_k + contact, friction, weight
    (m l^2/12) phi_k'' = (l/2) e_k x (F_k + F_(k+1)) + M_(k+1) - M_k

Contact. With n the unit vector from the centre of a pulley of radius R to the centre of a body at
the distance r, and t = z x n along the rim:

    p = R - r,   N = c1 p^2 + c2 p + delta(p) b p',   N >= 0              [1]_ eqs 6, 7, 9-11
    s = R omega - kappa v . t                                             [1]_ eqs 14-18

Wrap factor. A belt of the pitch l that lies on a rim follows an arc; a chain of rigid bodies
follows its chords. Joints that turn by dphi bring the centres of their bodies closer together, by
dphi^2/8 of half a body on either side, but the arc that these halves stand for is longer than its
chord by dphi^2/24: bodies that wrap slow down by dphi^2/12 against the material line. Friction that
compares the rim with the velocity of a body sees a slip that no belt has. With

    kappa = 1 + (dphi_before^2 + dphi_after^2)/24

kappa v . t is the velocity of the material on the arc; it is the same on a straight span, and half
way round the corner where the arc begins. The friction T acts with kappa T on the body and with
-R T on the pulley: its power is -T s, for any kappa. To T a body yields with the mass m/kappa^2.
Without `Belt.wrap` kappa is 1: the slip is that of the body's centre, as published.

Set-valued friction. A body that sticks has s' = -s/tau, which takes the force
T = m/kappa^2 (R alpha + g), with the bias g = s/tau - a, where a is the rate of kappa v . t without
friction. Sliding, the force is at its limit. What each pulley does is then one scalar equation,

    I alpha = M - R sum clip(m/kappa^2 (R alpha + g_i), -mu_i- N_i, mu_i+ N_i).

The left side rises with alpha and the right side falls; both are piecewise linear. With velocities
in the place of accelerations and impulses in the place of forces it serves a fixed step as well.
A body that sticks is held by the static coefficient, in either direction; at the limit it sticks
still. One that slides is braked by the kinetic coefficient and never driven; where its slip comes
to zero, the static coefficient decides whether it sticks: that is its mode. With equal coefficients
no mode has to be remembered.

On a line (a belt without motion across itself) each of n points has a coordinate s along it. With
the middles m_k = (s_(k-1) + s_k)/2 point k stands for the belt from m_k to m_(k+1), of which the
length a_k lies on the arc of a pulley:

    T_k   = c (s_k - s_(k-1) - l) + b (s_k' - s_(k-1)')
    N_k   = ((T_k + T_(k+1))/2 - m s_k'^2/(m_(k+1) - m_k)) a_k/R,   N_k >= 0
    m s_k'' = T_(k+1) - T_k + sigma F_k,     slip = R omega - sigma s_k'

where sigma is +1 where the belt passes the pulley counter-clockwise, else -1. In full slip this is
the equation of Euler and Eytelwein, in creep that of Reynolds [2]_, both to second order in l.
Where the belt would have to leave its line its normal force is zero, and a joint under pressure
pushes.

Speed. Loops are to become vector instructions, and what prevents that cannot be read off a loop:
a sum with a condition (hence `y * (1.0 if c else 0.0)`), one array more in a loop of some 25. The
numbers stay right and a step takes three to twelve times as long. A test counts the instructions.
A part that an absent effect leaves out learns so from an ARGUMENT that is None; a field of the belt
that is None would not do, as numba would compile the part all the same.

References
----------
.. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission with
   dry friction", Archive of Mechanical Engineering 61(4), 2014.
.. [2] M. J. Leamy, T. M. Wasfy, "Analysis of belt-drive mechanics using a creep-rate-dependent
   friction law", Journal of Applied Mechanics 69(6), 2002.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive import belt as row
from frictionsim.mechanisms.belt_drive.belt import Array, Belt, Line
from frictionsim.mechanisms.belt_drive.compilation import loop, part, shared
from frictionsim.solvers import friction_curve as curve

TINY = 1e-300  # a joint of no length has no force; padding may stand in the centre of a pulley
FULL_TURN = 2.0 * pi
ONE = np.uint64(1)  # an index without a sign is not looked at for being negative

MAX_ITERATIONS = 100  # of Newton's method in a bracket; two or three are the rule
PULLEY_TOLERANCE = 1e-13  # of two values of alpha, over the largest that counts

friction_curve = part(curve.friction_curve)
rising_part = part(curve.rising_part)

# sin(z)/z and (1 - cos(z))/z^2 in powers of z^2; the next term is below 1e-16 for |z| <= pi/4.
S3, S5, S7, S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
S11, S13, S15 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000
C2, C4, C6, C8 = 1 / 2, -1 / 24, 1 / 720, -1 / 40320
C10, C12, C14, C16 = 1 / 3628800, -1 / 479001600, 1 / 87178291200, -1 / 20922789888000


# --- rows by name -------------------------------------------------------------------------------
# Loops take tuples of rows: that the arrays in it do not overlap is known, of parts of a table it
# is not.


class Bodies(NamedTuple):
    """Kinematics of bodies in the plane, (width,) each, m, rad, m/s and rad/s."""

    x: Array
    y: Array
    phi: Array
    vx: Array
    vy: Array
    spin: Array


class Accelerations(NamedTuple):
    """Accelerations of bodies in the plane, (width,) each, m/s^2 and rad/s^2."""

    x: Array
    y: Array
    phi: Array


class Joints(NamedTuple):
    """Directions of bodies; of joints their force, angle, rate, and the part of the damper."""

    cos: Array
    sin: Array
    fx: Array
    fy: Array
    bend: Array
    rate: Array
    dx: Array
    dy: Array


class Contact(NamedTuple):
    """Contacts of all bodies with one pulley: the rows of `Belt.con`, (width,) each."""

    nx: Array
    ny: Array
    normal: Array
    slip: Array
    bias: Array
    forward: Array
    backward: Array
    friction: Array
    sticking: Array
    kappa: Array
    yields: Array
    mode: Array
    mu_forward: Array
    mu_backward: Array
    mu_s: Array
    mu_k: Array
    turned: Array


class Arc(NamedTuple):
    """The arc of one pulley that points on a line pass."""

    sense: float  # +1 where they pass it counter-clockwise, else -1
    rim: float  # m/s, the speed of the rim
    inv_radius: float
    start: float  # m, in one round
    length: float
    skin: float  # m, by which a point may be before it and is on it
    line: float  # m, the length of a round


class Rim(NamedTuple):
    """One pulley: centre and radius, m, rim speed, m/s, and its contact with a body."""

    x: float
    y: float
    radius: float
    speed: float
    quadratic: float
    linear: float
    damping: float
    inv_full: float


@part
def bodies_of(kin: Array) -> Bodies:
    """Return the rows of the kinematics of bodies in the plane."""
    return Bodies(kin[row.X], kin[row.Y], kin[row.PHI], kin[row.VX], kin[row.VY], kin[row.SPIN])


@part
def joints_of(work: Array) -> Joints:
    """Return the rows of the joints."""
    return Joints(
        work[row.COS],
        work[row.SIN],
        work[row.FX],
        work[row.FY],
        work[row.BEND],
        work[row.RATE],
        work[row.DX],
        work[row.DY],
    )


@part
def contact_of(con: Array, j: int) -> Contact:
    """Return the rows of the contacts with pulley j."""
    return Contact(
        con[row.NX, j],
        con[row.NY, j],
        con[row.NORMAL, j],
        con[row.SLIP, j],
        con[row.BIAS, j],
        con[row.FORWARD, j],
        con[row.BACKWARD, j],
        con[row.FRICTION, j],
        con[row.STICKING, j],
        con[row.KAPPA, j],
        con[row.YIELD, j],
        con[row.MODE, j],
        con[row.MU_FORWARD, j],
        con[row.MU_BACKWARD, j],
        con[row.MU_S, j],
        con[row.MU_K, j],
        con[row.TURNED, j],
    )


@part
def rim_of(pul: Array, j: int) -> Rim:
    """Return the numbers of pulley j."""
    return Rim(
        pul[row.PX, j],
        pul[row.PY, j],
        pul[row.RADIUS, j],
        pul[row.RADIUS, j] * pul[row.SPEED, j],
        pul[row.QUADRATIC, j],
        pul[row.LINEAR, j],
        pul[row.DAMPING, j],
        pul[row.INV_FULL, j],
    )


@part
def arc_of(b: Belt, line: Line, j: int, speed: float) -> Arc:
    """Return the numbers of pulley j, whose rim moves at a speed."""
    inv_radius = 1.0 / b.pul[row.RADIUS, j]
    return Arc(line.senses[j], speed, inv_radius, line.starts[j], line.arcs[j], b.skin, line.length)


@loop
def copy(source: Array, target: Array) -> None:
    """Copy an array; a slice would be looked at for overlaps first, which takes longer."""
    for i in range(len(source)):
        target[i] = source[i]


# --- bodies in the plane and their joints -------------------------------------------------------


@part
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


@loop
def turn(full: int, at: Bodies, joints: Joints) -> None:
    """Write the directions of bodies, and of the joint behind each its angle and rate."""
    phi, spin, cos, sin = at.phi, at.spin, joints.cos, joints.sin
    bend, rate = joints.bend, joints.rate
    for k in range(np.uint64(full)):
        cos[k], sin[k] = cos_sin(phi[k])
    for k in range(np.uint64(full)):
        bend[k + ONE], rate[k + ONE] = phi[k + ONE] - phi[k], spin[k + ONE] - spin[k]


@loop
def pull(
    n: int,
    full: int,
    half: float,
    c: float,
    damping: float | None,
    obliquity: float | None,
    parts: bool | None,
    at: Bodies,
    joints: Joints,
) -> float:
    """Write the forces of the joints behind each body; return the power of their dampers, W.

    With the spring's force F the damper's is b (d' . F) F / F^2: no root, and no direction to be
    kept for a joint without length. With `parts`, those of the dampers are written and no power is
    summed: that of a fixed step is the one at its mean velocities.
    """
    x, y, vx, vy, spin, power = at.x, at.y, at.vx, at.vy, at.spin, 0.0
    cos, sin, fx, fy, dx, dy = joints.cos, joints.sin, joints.fx, joints.fy, joints.dx, joints.dy
    for k in range(np.uint64(full)):
        c0, c1, s0, s1 = cos[k], cos[k + ONE], sin[k], sin[k + ONE]
        px = c * (x[k + ONE] - x[k] - half * (c0 + c1))
        py = c * (y[k + ONE] - y[k] - half * (s0 + s1))
        if damping is not None:
            w0, w1 = half * spin[k], half * spin[k + ONE]
            rx = vx[k + ONE] - vx[k] + (s0 * w0 + s1 * w1)
            ry = vy[k + ONE] - vy[k] - (c0 * w0 + c1 * w1)
            dot = px * rx + py * ry
            size = px * px + py * py
            if obliquity is not None:
                across = px * (s0 + s1) - py * (c0 + c1)
                size = max(size, across * across * (0.5 / obliquity))
            d = damping * dot / (size + TINY)
            if parts is not None:
                dx[k + ONE], dy[k + ONE] = d * px, d * py
            else:
                power += d * dot * (1.0 if k < np.uint64(n) else 0.0)
            px += d * px
            py += d * py
        fx[k + ONE], fy[k + ONE] = px, py
    return power


@loop
def accelerate(
    n: int,
    full: int,
    inv_mass: float,
    lever: float,
    bending: float | None,
    bend_damping: float | None,
    gravity: float | None,
    joints: Joints,
    acc: Accelerations,
) -> float:
    """Write the accelerations without contacts; return the power of bending dampers over I, W/I."""
    cos, sin, fx, fy, bend, rate, _, _ = joints
    power = 0.0
    for k in range(full):
        x0, x1, y0, y1 = fx[k], fx[k + 1], fy[k], fy[k + 1]
        turning = lever * (cos[k] * (y0 + y1) - sin[k] * (x0 + x1))
        if bending is not None:
            turning += bending * (bend[k + 1] - bend[k])
        if bend_damping is not None:
            turning += bend_damping * (rate[k + 1] - rate[k])
            power += bend_damping * rate[k] * rate[k] * (1.0 if k < n else 0.0)
        up = inv_mass * (y1 - y0)
        if gravity is not None:
            up -= gravity
        acc.x[k], acc.y[k], acc.phi[k] = inv_mass * (x1 - x0), up, turning
    return power


@part
def body_forces(kin: Array, acc: Accelerations, parts: bool | None, b: Belt) -> float:
    """Write the accelerations without contacts; return the power of dampers, W, as of `pull`.

    Closes the ring: it writes column n of the kinematics, the copy of the first body.
    """
    n, full, at, joints = b.n, b.full, bodies_of(kin), joints_of(b.work)
    for i in range(6):
        kin[i, n] = kin[i, 0]
    at.phi[n] += b.turning
    turn(full, at, joints)
    joints.cos[n], joints.sin[n] = joints.cos[0], joints.sin[0]
    damped = pull(n, full, b.half, b.stiffness, b.damping, b.obliquity, parts, at, joints)
    # Joint 0 is joint n; the parts of dampers as well, or the heat that fixed steps take is wrong.
    for i in range(row.FX, row.WORK_ROWS):
        b.work[i, 0] = b.work[i, n]
    lever = b.half / b.inertia
    bent = accelerate(
        n, full, 1.0 / b.mass, lever, b.bending, b.bend_damping, b.gravity, joints, acc
    )
    for k in range(n, b.width):  # nothing there ever moves
        acc.x[k] = acc.y[k] = acc.phi[k] = 0.0
    return damped + b.inertia * bent


# --- contact and friction -----------------------------------------------------------------------


@loop
def press(
    n: int,
    a: int,
    e: int,
    damping: bool | None,
    wrap: bool | None,
    inv_tau: float | None,
    mass: float,
    rim: Rim,
    at: Bodies,
    bend: Array,
    rate: Array,
    acc: Accelerations,
    c: Contact,
) -> float:
    """Add the normal forces of bodies a to e on one pulley; return the power of their dampers, W.

    Write all that friction is solved from.
    """
    power, inv_mass = 0.0, 1.0 / mass
    for k in range(np.uint64(a), np.uint64(e)):
        dx, dy, ux, uy = at.x[k] - rim.x, at.y[k] - rim.y, at.vx[k], at.vy[k]
        square = dx * dx + dy * dy + TINY
        inv = 1.0 / np.sqrt(square)
        nx, ny = dx * inv, dy * inv
        p = max(rim.radius - square * inv, 0.0) if k < np.uint64(n) else 0.0
        force = p * (rim.quadratic * p + rim.linear)
        out, along = ux * nx + uy * ny, uy * nx - ux * ny
        if damping is not None:
            share = min(p * rim.inv_full, 1.0)
            full = rim.damping * share * share * (3.0 - 2.0 * share)
            damped = max(force - full * out, 0.0)
            power += (force - damped) * out
            force = damped
        kappa, kappa_rate = 1.0, 0.0
        if wrap is not None:
            b0, b1 = bend[k], bend[k + ONE]
            kappa += (b0 * b0 + b1 * b1) * (1.0 / 24.0)
            kappa_rate = (b0 * rate[k] + b1 * rate[k + ONE]) * (1.0 / 12.0)
        slip = rim.speed - kappa * along
        if inv_tau is not None:
            own = kappa * (along * out * inv - (acc.y[k] * nx - acc.x[k] * ny))
            c.bias[k] = slip * inv_tau + own - kappa_rate * along
        c.slip[k], c.normal[k], c.nx[k], c.ny[k] = slip, force, nx, ny
        c.forward[k], c.backward[k] = c.mu_forward[k] * force, c.mu_backward[k] * force
        c.kappa[k], c.yields[k] = kappa, mass / (kappa * kappa)
        acc.x[k] += inv_mass * force * nx
        acc.y[k] += inv_mass * force * ny
    return power


@loop
def reaction(a: int, e: int, rim: float, c: Contact) -> tuple[float, float]:
    """Return the friction of a run, N or N s, and the mass of what sticks in it, kg."""
    force = sticking = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        needed = c.yields[k] * (rim + c.bias[k])
        limited = min(max(needed, -c.backward[k]), c.forward[k])
        force += limited
        sticking += c.yields[k] * (1.0 if limited == needed else 0.0)
    return force, sticking


@loop
def project(a: int, e: int, rim: float, c: Contact) -> None:
    """Write the friction that sticking needs, within its limits."""
    for k in range(np.uint64(a), np.uint64(e)):
        needed = c.yields[k] * (rim + c.bias[k])
        limited = min(max(needed, -c.backward[k]), c.forward[k])
        c.friction[k], c.sticking[k] = limited, 1.0 if limited == needed else 0.0


@loop
def regularise(
    a: int,
    e: int,
    transition: float | None,
    creep: float | None,
    creep_time: float | None,
    h: float,
    c: Contact,
) -> None:
    """Write the friction that a regularised law has for the slip, [1]_ eq 12 and Fig. 6.

    With a creep, m, a contact that hardly slips has friction of the way that it slips in the creep
    time, s, too: eq 13, Fig. 6b. Without a time that is the step h, on which the law depends then.
    """
    if transition is not None:
        duration = h
        if creep_time is not None:
            duration = creep_time
        for k in range(np.uint64(a), np.uint64(e)):
            size = abs(c.slip[k])
            mu = friction_curve(size / transition, c.mu_s[k], c.mu_k[k])
            if creep is not None:
                rise = rising_part(size / transition)
                mu += c.mu_s[k] * (1.0 - rise) * rising_part(size * duration / creep)
            c.friction[k] = np.copysign(mu * c.normal[k], c.slip[k])
            c.sticking[k] = 1.0 if size < transition else 0.0


@loop
def rub(
    a: int, e: int, inv_mass: float, c: Contact, acc: Accelerations, worn: Array | None
) -> tuple[float, float]:
    """Add what the friction accelerates; return its sum, N, and its power, W; of bodies to worn."""
    force = power = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        t = c.friction[k]
        force += t
        power += t * c.slip[k]
        if worn is not None:
            worn[k] = t * c.slip[k]
        acc.x[k] -= inv_mass * c.kappa[k] * t * c.ny[k]
        acc.y[k] += inv_mass * c.kappa[k] * t * c.nx[k]
    return force, power


@part
def pulley_motion(j: int, x: float, external: float, b: Belt) -> float:
    """Return the x with I x = external - R sum clip(m/kappa^2 (R x + g)), for pulley j.

    x, the first guess, is an angular acceleration and `external` a torque; or an angular velocity
    and the angular momentum that there would be without friction. Newton's method, in a bracket.
    """
    c, radius, inertia = contact_of(b.con, j), b.pul[row.RADIUS, j], b.pul[row.INERTIA, j]
    low, high = -np.inf, np.inf
    for _ in range(MAX_ITERATIONS):
        force = sticking = 0.0
        for r in range(b.n_runs[0]):
            if b.runs[r, 0] == j:
                own, held = reaction(b.runs[r, 1], b.runs[r, 2], radius * x, c)
                force += own
                sticking += held
        excess = inertia * x - external + radius * force
        if excess > 0.0:
            high = x
        else:
            low = x
        change = excess / (inertia + radius * radius * sticking)
        if abs(change) <= PULLEY_TOLERANCE * (abs(x) + abs(external) / inertia):
            return x - change
        x -= change
        if not low < x < high:
            x = 0.5 * (low + high)
    return x


# --- points on a line ---------------------------------------------------------------------------


@loop
def stretch(
    n: int,
    full: int,
    c: float,
    rest: float,
    damping: float | None,
    s: Array,
    v: Array,
    tension: Array,
    middle: Array,
) -> float:
    """Write tension and middle of the joint behind each point; return the power of dampers, W."""
    power = 0.0
    for k in range(np.uint64(full)):
        middle[k] = 0.5 * (s[k] + s[k + ONE])
    for k in range(np.uint64(full)):
        force = c * (s[k + ONE] - s[k]) - rest
        if damping is not None:
            rate = v[k + ONE] - v[k]
            force += damping * rate
            power += damping * rate * rate * (1.0 if k < np.uint64(n) else 0.0)
        tension[k] = force
    return power


@loop
def accelerate_on_line(full: int, inv_mass: float, tension: Array, a: Array) -> None:
    """Write the accelerations without friction."""
    for k in range(np.uint64(full)):
        a[k] = inv_mass * (tension[k + ONE] - tension[k])


@loop
def press_on_line(
    n: int,
    a: int,
    e: int,
    duration: float,
    inv_tau: float | None,
    mass: float,
    arc: Arc,
    v: Array,
    gained: Array,
    tension: Array,
    middle: Array,
    bias: Array,
    c: Contact,
) -> None:
    """Write what friction is solved from, of points a to e at one pulley; the bias to any row.

    `gained` are the accelerations without friction, m/s^2, with a duration of 1 s; or, for impulses
    of a step of that duration, the velocities after it, without inv_tau. The arc of a point is the
    last one that begins before it, by a skin.
    """
    inv_line, rate = 1.0 / arc.line, 0.0
    if inv_tau is not None:
        rate = inv_tau
    for k in range(np.uint64(a), np.uint64(e)):
        before, after = middle[k], middle[k + ONE]
        begin = arc.start + arc.line * np.floor((before - arc.start + arc.skin) * inv_line)
        left, entered = min(max(after - begin, 0.0), arc.length), max(before - begin, 0.0)
        on_arc = left - min(entered, arc.length)
        force = 0.5 * (tension[k] + tension[k + ONE]) - mass * v[k] * v[k] / (after - before)
        force = max(force * on_arc * arc.inv_radius, 0.0) if k < np.uint64(n) else 0.0
        slip = arc.rim - arc.sense * v[k]
        c.normal[k], c.slip[k], c.yields[k] = force, slip, mass
        bias[k] = slip * rate - arc.sense * gained[k]
        c.forward[k] = duration * c.mu_forward[k] * force
        c.backward[k] = duration * c.mu_backward[k] * force


@loop
def rub_on_line(
    a: int, e: int, pull: float, c: Contact, acc: Array, worn: Array | None
) -> tuple[float, float]:
    """Add what the friction accelerates, `pull` each unit of it; return its sum and its power."""
    force = power = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        t = c.friction[k]
        force += t
        power += t * c.slip[k]
        if worn is not None:
            worn[k] = t * c.slip[k]
        acc[k] += pull * t
    return force, power


@part
def point_forces(kin: Array, acceleration: Array, b: Belt, line: Line) -> float:
    """Write the accelerations of points without friction; return the power of dampers, W."""
    n, full = b.n, b.full
    tension, middle = b.work[row.TENSION], b.work[row.MIDDLE]
    s, v, rest = kin[row.POSITION], kin[row.VELOCITY], 2.0 * b.stiffness * b.half
    s[n], v[n] = s[0] + line.length, v[0]
    damped = stretch(n, full, b.stiffness, rest, b.damping, s, v, tension[1:], middle[1:])
    tension[0], middle[0] = tension[n], middle[n] - line.length
    accelerate_on_line(full, 1.0 / b.mass, tension, acceleration)
    for k in range(n, b.width):
        acceleration[k] = 0.0
    return damped


# --- the search for bodies near a pulley, and their modes ---------------------------------------


@loop
def choose(a: int, e: int, c: Contact) -> float:
    """Write the coefficients in force; return by how much that changes the limits, N."""
    changed = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        mode, static, kinetic = c.mode[k], c.mu_s[k], c.mu_k[k]
        against = 0.0 if static > kinetic else static
        forward = static if mode == 0.0 else kinetic if mode > 0.0 else against
        backward = static if mode == 0.0 else kinetic if mode < 0.0 else against
        change = abs(forward - c.mu_forward[k]) + abs(backward - c.mu_backward[k])
        changed += change * c.normal[k]
        c.mu_forward[k], c.mu_backward[k] = forward, backward
    return changed


@shared
def search(b: Belt, kin: Array, plane: bool | None, line: Line | None, wrap: bool | None) -> None:
    """List the runs of blocks of bodies near each pulley; give those that are new a mode.

    The last three arguments are fields of the belt. Only these bodies are looked at until the next
    search. In the plane none passes the skin round a rim meanwhile, which is as thick as a body is
    long, unless it is faster than a sixteenth of the waves along the belt.
    """
    con, pul, count, gap, slip = b.con, b.pul, 0, 0.0, 0.0
    if plane is not None:
        phi = kin[row.PHI]
        phi[b.n] = phi[0] + b.turning
    for j in range(pul.shape[1]):
        rim, inside = pul[row.RADIUS, j] * pul[row.SPEED, j], False
        if plane is not None:
            reach = (pul[row.RADIUS, j] + b.skin) ** 2
        if line is not None:
            reach = line.arcs[j] + 2.0 * b.skin
        for first in range(0, b.full, row.BLOCK):
            nearest = np.inf
            for k in range(first, min(first + row.BLOCK, b.n)):
                if plane is not None:
                    dx, dy = kin[row.X, k] - pul[row.PX, j], kin[row.Y, k] - pul[row.PY, j]
                    gap = dx * dx + dy * dy
                if line is not None:
                    gap = kin[row.POSITION, k] - line.starts[j] + b.skin
                    gap -= line.length * np.floor(gap / line.length)
                nearest = min(nearest, gap)
            if nearest >= reach:
                inside = False
                for k in range(first, first + row.BLOCK):
                    con[row.MODE, j, k] = row.NEW
                    con[row.FRICTION, j, k] = con[row.NORMAL, j, k] = con[row.STICKING, j, k] = 0.0
                continue
            for k in range(first, first + row.BLOCK):
                if con[row.MODE, j, k] == row.NEW:
                    if plane is not None:
                        dx, dy = kin[row.X, k] - pul[row.PX, j], kin[row.Y, k] - pul[row.PY, j]
                        along = kin[row.VY, k] * dx - kin[row.VX, k] * dy
                        along /= np.sqrt(dx * dx + dy * dy + TINY)
                        if wrap is not None:
                            after = phi[k + 1] - phi[k]
                            before = phi[k] - phi[k - 1] if k > 0 else phi[b.n] - phi[b.n - 1]
                            along *= 1.0 + (before * before + after * after) / 24.0
                        slip = rim - along
                    if line is not None:
                        slip = rim - line.senses[j] * kin[row.VELOCITY, k]
                    con[row.SLIP, j, k], con[row.MODE, j, k] = slip, np.sign(slip)
                    con[row.STICKING, j, k] = 1.0 if slip == 0.0 else 0.0
            choose(first, first + row.BLOCK, contact_of(con, j))
            if not inside:
                b.runs[count, 0], b.runs[count, 1], inside = j, first, True
                count += 1
            b.runs[count - 1, 2] = first + row.BLOCK
    b.n_runs[0] = count


@loop
def new_modes(a: int, e: int, c: Contact) -> None:
    """Write the modes after a step.

    A body that sticks starts to slide in the direction of its friction; one that slides keeps its
    mode until its slip is zero.
    """
    for k in range(np.uint64(a), np.uint64(e)):
        old, slip, friction = c.mode[k], c.slip[k], c.friction[k]
        way = slip if friction == 0.0 else friction
        begun = (1.0 if way > 0.0 else 0.0) - (1.0 if way < 0.0 else 0.0)
        mode = begun if old == 0.0 else old
        mode = 0.0 if old * slip < 0.0 else mode
        c.mode[k] = 0.0 if c.sticking[k] > 0.0 else mode


@part
def update_modes(b: Belt) -> bool:
    """Write modes and coefficients in force after a step; return whether that changes a limit."""
    changed = 0.0
    for r in range(b.n_runs[0]):
        a, e, c = b.runs[r, 1], b.runs[r, 2], contact_of(b.con, b.runs[r, 0])
        new_modes(a, e, c)
        changed += choose(a, e, c)
    return changed > 0.0


# --- pulleys ------------------------------------------------------------------------------------


@part
def signal(k: int, u: float, b: Belt) -> tuple[float, float]:
    """Return value and derivative of signal k at u, a time or a speed."""
    low, high = b.sig_offset[k], b.sig_offset[k + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if b.sig_piece[middle, 0] <= u:
            low = middle
        else:
            high = middle
    p, wave = b.sig_piece[low], b.sig_wave[k]
    z = u - p[0]
    value = p[1] + z * (p[2] + z * (p[3] + z * p[4]))
    slope = p[2] + z * (2.0 * p[3] + z * 3.0 * p[4])
    if wave[0] != 0.0:
        phase = wave[1] * u + wave[2]
        value += wave[0] * np.sin(phase)
        slope += wave[0] * wave[1] * np.cos(phase)
    return value, slope


@part
def drive(t: float, b: Belt) -> None:
    """Write the torques on all pulleys from outside, and the motion of those that is given."""
    pul = b.pul
    for j in b.prescribed:
        pul[row.SPEED, j] = pul[row.ALPHA, j] = 0.0
    for j in range(pul.shape[1]):
        pul[row.TORQUE, j] = 0.0
    for k in range(len(b.sig_kind)):
        j, kind = b.sig_pulley[k], b.sig_kind[k]
        value, slope = signal(k, pul[row.SPEED, j] if kind == row.TORQUE_OVER_SPEED else t, b)
        if kind == row.SPEED_OVER_TIME:
            pul[row.SPEED, j] += value
            pul[row.ALPHA, j] += slope
        else:
            pul[row.TORQUE, j] += value


# --- the equation of motion ---------------------------------------------------------------------


@shared
def rhs(
    t: float,
    h: float,
    y: Array,
    f: Array,
    b: Belt,
    plane: bool | None,
    line: Line | None,
    inv_tau: float | None,
    wear: bool | None,
) -> None:
    """Write the rate f of a state y; the last four arguments are those of the belt.

    h is the length of the step, s, for a creep without a time. The belt's rows have the forces of
    the state afterwards. All is written out here: each further level of parts would be compiled
    once more.
    """
    w, con, pul, work, half = b.width, b.con, b.pul, b.work, b.angles // 2
    rows = half // w
    kin, rates = y[: b.angles].reshape((2 * rows, w)), f[half : b.angles].reshape((rows, w))
    copy(y[half : b.angles], f[:half])
    for i in range(len(b.free)):
        pul[row.SPEED, b.free[i]] = y[b.speeds + i]
    drive(t, b)
    damped = rubbed = put_in = 0.0
    if plane is not None:
        at, acc = bodies_of(kin), Accelerations(rates[0], rates[1], rates[2])
        damped += body_forces(kin, acc, None, b)
    if line is not None:
        damped += point_forces(kin, rates[0], b, line)
    for r in range(b.n_runs[0]):
        j, a, e = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2]
        c, rim = contact_of(con, j), rim_of(pul, j)
        if plane is not None:
            bend, rate, pressed = work[row.BEND], work[row.RATE], b.contact_damping
            damped += press(
                b.n, a, e, pressed, b.wrap, inv_tau, b.mass, rim, at, bend, rate, acc, c
            )
        if line is not None:
            arc, v, gained = arc_of(b, line, j, rim.speed), kin[row.VELOCITY], rates[0]
            tension, middle = work[row.TENSION], work[row.MIDDLE]
            press_on_line(
                b.n, a, e, 1.0, inv_tau, b.mass, arc, v, gained, tension, middle, c.bias, c
            )
    if inv_tau is not None:
        for j in b.free:
            pul[row.ALPHA, j] = pulley_motion(j, pul[row.ALPHA, j], pul[row.TORQUE, j], b)
    for j in range(pul.shape[1]):
        pul[row.PULL, j] = 0.0
    works = b.size - pul.shape[1] * w
    if wear is not None:  # of bodies that are near no pulley
        for i in range(works, b.size):
            f[i] = 0.0
    for r in range(b.n_runs[0]):
        j, a, e = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2]
        c, worn = contact_of(con, j), None
        if wear is not None:
            worn = f[works + j * w : works + (j + 1) * w]
        if inv_tau is not None:
            project(a, e, pul[row.RADIUS, j] * pul[row.ALPHA, j], c)
        if inv_tau is None:
            regularise(a, e, b.transition, b.creep, b.creep_time, h, c)
        if plane is not None:
            force, power = rub(a, e, 1.0 / b.mass, c, acc, worn)
        if line is not None:
            force, power = rub_on_line(a, e, line.senses[j] / b.mass, c, rates[0], worn)
        pul[row.PULL, j] += force
        rubbed += power
    if inv_tau is None:
        for j in b.free:
            moment = pul[row.TORQUE, j] - pul[row.RADIUS, j] * pul[row.PULL, j]
            pul[row.ALPHA, j] = moment / pul[row.INERTIA, j]
    for j in b.prescribed:  # what it takes to keep the speed
        pul[row.TORQUE, j] = (
            pul[row.INERTIA, j] * pul[row.ALPHA, j] + pul[row.RADIUS, j] * pul[row.PULL, j]
        )
    for j in range(pul.shape[1]):
        f[b.angles + j] = pul[row.SPEED, j]
        put_in += pul[row.TORQUE, j] * pul[row.SPEED, j]
    for i in range(len(b.free)):
        f[b.speeds + i] = pul[row.ALPHA, b.free[i]]
    f[b.energies], f[b.energies + 1], f[b.energies + 2] = put_in, rubbed, damped
