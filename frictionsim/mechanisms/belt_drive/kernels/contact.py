"""Contact and dry friction between the bodies of a belt and its pulleys.

With n the unit vector from the centre of a pulley of radius R to the centre of a body, at the
distance r from it, and t = z x n along the rim:

    p = R - r,   N = c1 p^2 + c2 p + delta(p) b p',   N >= 0               [1]_ eqs 6, 7, 9-11
    s = R omega - v . t                                                    [1]_ eqs 14-18
    m (v . t)' = F . t - m v_n v_t/r + T,    I omega' = M - R sum T        [1]_ eqs 23, 24

Only bodies near a pulley are looked at. Each has a slot; the slots of a pulley are neighbours, and
empty ones fill them up to a multiple of what a vector instruction takes. An empty slot belongs to
body 0 and to a pulley of no radius, which it never touches: so loops over slots have no branch.

Exact stick. A body that sticks has s' = -s/tau, which takes the force T = m (R alpha + g) with
g = s/tau - a, where a is its acceleration along t without friction. Sliding, the force is at its
limit. What each pulley does is then one scalar equation for its angular acceleration alpha,

    I alpha = M - R sum clip(m (R alpha + g_i), -mu_i- N_i, mu_i+ N_i),

with a limit for each direction of the force. A body that has no slip is held by the static
coefficient, in either direction, and a tie sticks. One that slides is braked by the kinetic
coefficient and never driven; where its slip comes to zero, the static coefficient decides whether
it sticks. Where both coefficients are equal no memory of who slides is needed.

whose left side rises with alpha and whose right side falls. Both are piecewise linear: Newton's
method from the last alpha ends in two or three sweeps. With velocities in the place of
accelerations and impulses in the place of forces the same equation serves a fixed-step scheme.

References
----------
.. [1] K. Kubas, Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.chain import VX, VY, X, Y
from frictionsim.mechanisms.belt_drive.kernels.jit import kernel

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

VECTOR = 8  # numbers of double precision in the widest vector
MOST_SWEEPS = 100  # each halves the bracket at least; two or three are the rule
CLOSE = 1e-13  # two values of alpha, over the largest that counts


class Contact(NamedTuple):
    """Penalty contact of a body: c1 in N/m^2, c2 in N/m."""

    c1: float
    c2: float


class ContactDamping(NamedTuple):
    """Damping of a body's contact, N s/m, in full from the depth p_max, m, on."""

    coefficient: float
    full_depth: float


class ExactStick(NamedTuple):
    """Set-valued friction; a body that sticks loses its slip within the time tau, s."""

    tau: float


class Regularised(NamedTuple):
    """Friction as a function of the slip: eq 12 and Fig. 6, with the transition speed, m/s."""

    speed: float


class Creep(NamedTuple):
    """The blend of eq 13: the creep, m, at which a contact without slip has its full friction."""

    most: float


class Friction(NamedTuple):
    """Coefficients of friction of every body at every pulley, (np, n): static and kinetic."""

    static: "Array"
    kinetic: "Array"


class Pulleys(NamedTuple):
    """The pulleys: `free` are the indices of those whose speed is not prescribed.

    `table` is (8, np), with rows as named below.
    """

    free: "Indices"
    table: "Array"


# Rows: where a pulley is, m, and its inertia, kg m^2; what it does now: angular velocity and
# acceleration, rad/s and rad/s^2, the torque on it from outside, N m, and what its angular velocity
# was at the start of a fixed step.
PULLEY_X, PULLEY_Y, PULLEY_RADIUS, INERTIA, SPEED, ALPHA, TORQUE, BEFORE = range(8)


class Slots(NamedTuple):
    """The bodies near pulleys; the slots of pulley j are first[j] to first[j + 1] - 1.

    `first` is (np + 1,), `body` (slots,), `table` (20, slots) with rows as named below; `kept`,
    (2, n), has mode and stick of the bodies while the slots are dealt anew.
    """

    first: "Indices"
    body: "Indices"
    table: "Array"
    kept: "Array"


# Rows: of the slot's pulley, m, with a radius of zero where the slot is empty,
CENTRE_X, CENTRE_Y, RADIUS = range(3)
# coefficients of friction at rest and sliding, and those in force for T > 0 and for T < 0,
STATIC, KINETIC, FORWARD, BACKWARD = range(3, 7)
# the unit vector n and 1/r, and the velocity of the body, m/s,
NX, NY, PER_R, BODY_VX, BODY_VY = range(7, 12)
# N, and the limits of T > 0 and of T < 0, in N or N s; the slip, m/s; g above; T; 1 where T is
# within its limits, else 0; and the mode, 0 where the static coefficient holds, else the direction
# of the slip.
NORMAL, FORWARD_LIMIT, BACKWARD_LIMIT, SLIP, WISH, FRICTION, STUCK, MODE = range(12, 20)
ROWS = 20

NEW = 2.0  # in the place of a mode: the body had no slot


@kernel
def deal_slots(motion, bodies, pulleys, margin, slots, friction):
    """Give a slot to each body within a margin of a pulley's rim."""
    x, y, table, count = motion[X], motion[Y], pulleys.table, pulleys.table.shape[1]
    body, radius, mode, stuck = (
        slots.body,
        slots.table[RADIUS],
        slots.table[MODE],
        slots.table[STUCK],
    )
    kept_mode, kept_stuck = slots.kept[0], slots.kept[1]
    kept_mode[:] = NEW
    for s in range(slots.first[count]):
        if radius[s] > 0.0:
            kept_mode[body[s]], kept_stuck[body[s]] = mode[s], stuck[s]
    s = 0
    for j in range(count):
        slots.first[j] = s
        reach = (table[PULLEY_RADIUS, j] + margin) ** 2
        for i in range(bodies):
            if (x[i] - table[PULLEY_X, j]) ** 2 + (y[i] - table[PULLEY_Y, j]) ** 2 < reach:
                body[s], radius[s] = i, table[PULLEY_RADIUS, j]
                mode[s], stuck[s] = kept_mode[i], kept_stuck[i]
                s += 1
        filled = s
        s += -(s - slots.first[j]) % VECTOR
        for k in range(filled, s):
            body[k], radius[k], mode[k], stuck[k] = 0, 0.0, 0.0, 0.0
        for k in range(slots.first[j], s):
            slots.table[CENTRE_X, k] = table[PULLEY_X, j]
            slots.table[CENTRE_Y, k] = table[PULLEY_Y, j]
            slots.table[FRICTION, k] = 0.0
    slots.first[count] = s
    begin_contacts(motion, slots, pulleys)
    lay_coefficients(slots, count, friction)


@kernel
def begin_contacts(motion, slots, pulleys):
    """Have bodies that are new at a pulley stick if they have no slip, else slide."""
    slot, pulley = slots.table, pulleys.table
    for j in range(pulley.shape[1]):
        for s in range(slots.first[j], slots.first[j + 1]):
            if slot[MODE, s] == NEW:
                i = slots.body[s]
                dx, dy = motion[X, i] - slot[CENTRE_X, s], motion[Y, i] - slot[CENTRE_Y, s]
                along = (motion[VY, i] * dx - motion[VX, i] * dy) / np.sqrt(dx * dx + dy * dy)
                slip = pulley[PULLEY_RADIUS, j] * pulley[SPEED, j] - along
                slot[SLIP, s], slot[MODE, s] = slip, np.sign(slip)
                slot[STUCK, s] = 1.0 if slip == 0.0 else 0.0


@kernel
def lay_coefficients(slots, pulleys, friction):
    """Write the coefficients of the bodies that have a slot."""
    if friction is not None:
        for j in range(pulleys):
            for s in range(slots.first[j], slots.first[j + 1]):
                slots.table[STATIC, s] = friction.static[j, slots.body[s]]
                slots.table[KINETIC, s] = friction.kinetic[j, slots.body[s]]
        choose_coefficients(slots)


@kernel
def choose_coefficients(slots):
    """Write the coefficients that are in force; return whether that changes a limit."""
    table = slots.table
    changed = 0.0
    for s in range(slots.first[-1]):
        static, kinetic, mode = table[STATIC, s], table[KINETIC, s], table[MODE, s]
        against = 0.0 if static > kinetic else static
        forward = static if mode == 0.0 else kinetic if mode > 0.0 else against
        backward = static if mode == 0.0 else kinetic if mode < 0.0 else against
        change = abs(forward - table[FORWARD, s]) + abs(backward - table[BACKWARD, s])
        changed += change * table[NORMAL, s]
        table[FORWARD, s], table[BACKWARD, s] = forward, backward
    return changed > 0.0


@kernel
def remember(slots):
    """Take over from the last step who sticks and who slides where to.

    A body that sticks lets go in the direction of its friction. One that slides goes on until its
    slip has come to zero. Return whether that changes a limit.
    """
    table = slots.table
    for s in range(slots.first[-1]):
        mode, slip, friction = table[MODE, s], table[SLIP, s], table[FRICTION, s]
        if table[STUCK, s] > 0.0 or mode * slip < 0.0:
            mode = 0.0
        elif mode == 0.0:
            mode = np.sign(friction) if friction != 0.0 else np.sign(slip)
        table[MODE, s] = mode
    return choose_coefficients(slots)


@kernel
def press(motion, slots, contact):
    """Write where the bodies are on their pulleys, how they move, and the spring's share of N."""
    x, y, vx, vy = motion[X], motion[Y], motion[VX], motion[VY]
    body, table, count = slots.body, slots.table, slots.first[-1]
    nx, ny, normal, per_r = table[NX], table[NY], table[NORMAL], table[PER_R]
    centre_x, centre_y, radius = table[CENTRE_X], table[CENTRE_Y], table[RADIUS]
    body_vx, body_vy = table[BODY_VX], table[BODY_VY]
    for s in range(count):
        i = body[s]
        nx[s], ny[s] = x[i] - centre_x[s], y[i] - centre_y[s]
        body_vx[s], body_vy[s] = vx[i], vy[i]
    c1, c2 = contact.c1, contact.c2
    for s in range(count):
        per_r[s] = 1.0 / np.sqrt(nx[s] * nx[s] + ny[s] * ny[s])
    for s in range(count):
        p = max(radius[s] - 1.0 / per_r[s], 0.0)
        normal[s] = p * (c1 * p + c2)
    for s in range(count):
        nx[s] *= per_r[s]
    for s in range(count):
        ny[s] *= per_r[s]


@kernel
def damp_contact(slots, damping):
    """Add the damping's share of N, which never pulls; return the power it takes, W."""
    heat = 0.0
    if damping is not None:
        table = slots.table
        normal, nx, ny, vx, vy = table[NORMAL], table[NX], table[NY], table[BODY_VX], table[BODY_VY]
        radius, per_r = table[RADIUS], table[PER_R]
        per_depth = 1.0 / damping.full_depth
        for s in range(slots.first[-1]):
            depth = min(max((radius[s] - 1.0 / per_r[s]) * per_depth, 0.0), 1.0)
            coefficient = damping.coefficient * depth * depth * (3.0 - 2.0 * depth)
            rate = -(vx[s] * nx[s] + vy[s] * ny[s])
            damped = max(normal[s] + coefficient * rate, 0.0)
            heat += (damped - normal[s]) * rate
            normal[s] = damped
    return heat


@kernel
def push(slots, per_mass, ax, ay):
    """Add what the normal forces accelerate."""
    normal, nx, ny = slots.table[NORMAL], slots.table[NX], slots.table[NY]
    for s in range(slots.first[-1]):
        i = slots.body[s]
        ax[i] += per_mass * normal[s] * nx[s]
        ay[i] += per_mass * normal[s] * ny[s]


@kernel
def slide(slots, pulleys):
    """Write the slip."""
    table = slots.table
    nx, ny, vx, vy, slip = table[NX], table[NY], table[BODY_VX], table[BODY_VY], table[SLIP]
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * pulleys.table[SPEED, j]
        for s in range(slots.first[j], slots.first[j + 1]):
            slip[s] = rim - (vy[s] * nx[s] - vx[s] * ny[s])


@kernel
def stick(slots, pulleys, mass, ax, ay, exact):
    """Solve for the friction of exact stick, and for what free pulleys do."""
    if exact is not None:
        table, body, count = slots.table, slots.body, slots.first[-1]
        nx, ny, vx, vy = table[NX], table[NY], table[BODY_VX], table[BODY_VY]
        wish, slip, per_r = table[WISH], table[SLIP], table[PER_R]
        per_tau = 1.0 / exact.tau
        for s in range(count):
            i = body[s]
            along = vy[s] * nx[s] - vx[s] * ny[s]
            turning = along * (vx[s] * nx[s] + vy[s] * ny[s]) * per_r[s]
            wish[s] = slip[s] * per_tau - (ay[i] * nx[s] - ax[i] * ny[s]) + turning
        limit_friction(slots, 1.0)
        alpha, torque = pulleys.table[ALPHA], pulleys.table[TORQUE]
        for j in pulleys.free:
            alpha[j] = meet(j, alpha[j], torque[j], slots, pulleys, mass)
        share_friction(slots, pulleys, mass, alpha)


@kernel
def limit_friction(slots, duration):
    """Write the limits of the friction, N; or of its impulse in a duration, s, N s."""
    table, count = slots.table, slots.first[-1]
    normal, forward, backward = table[NORMAL], table[FORWARD], table[BACKWARD]
    forward_limit, backward_limit = table[FORWARD_LIMIT], table[BACKWARD_LIMIT]
    for s in range(count):
        forward_limit[s] = duration * forward[s] * normal[s]
    for s in range(count):
        backward_limit[s] = duration * backward[s] * normal[s]


@kernel
def meet(j, guess, offer, slots, pulleys, mass):
    """Return the x with I x = offer - R sum clip(m (R x + g_i)), for pulley j.

    x is its angular acceleration and `offer` the torque on it; or its angular velocity, and
    `offer` the angular momentum that it would have.
    """
    radius, inertia = pulleys.table[PULLEY_RADIUS, j], pulleys.table[INERTIA, j]
    wish = slots.table[WISH]
    forward, backward = slots.table[FORWARD_LIMIT], slots.table[BACKWARD_LIMIT]
    low, high = -np.inf, np.inf
    x = guess
    for _ in range(MOST_SWEEPS):
        force = following = 0.0
        for block in range(slots.first[j], slots.first[j + 1], VECTOR):
            for s in range(block, block + VECTOR):
                needed = mass * (radius * x + wish[s])
                limited = min(max(needed, -backward[s]), forward[s])
                force += limited
                following += 1.0 if limited == needed else 0.0
        excess = inertia * x - offer + radius * force
        if excess > 0.0:
            high = x
        else:
            low = x
        change = excess / (inertia + radius * radius * mass * following)
        if abs(change) <= CLOSE * (abs(x) + abs(offer) / inertia):
            return x - change
        x -= change
        if not low < x < high:
            x = 0.5 * (low + high)
    return x


@kernel
def share_friction(slots, pulleys, mass, x):
    """Write the friction, with the x of each pulley, and who sticks."""
    table = slots.table
    wish, friction, stuck = table[WISH], table[FRICTION], table[STUCK]
    forward, backward = table[FORWARD_LIMIT], table[BACKWARD_LIMIT]
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * x[j]
        for s in range(slots.first[j], slots.first[j + 1]):
            friction[s] = min(max(mass * (rim + wish[s]), -backward[s]), forward[s])
        for s in range(slots.first[j], slots.first[j + 1]):
            stuck[s] = 1.0 if friction[s] == mass * (rim + wish[s]) else 0.0


@kernel
def drag(slots, per_mass, ax, ay):
    """Add what the friction accelerates."""
    friction, nx, ny = slots.table[FRICTION], slots.table[NX], slots.table[NY]
    for s in range(slots.first[-1]):
        i = slots.body[s]
        ax[i] -= per_mass * friction[s] * ny[s]
        ay[i] += per_mass * friction[s] * nx[s]


@kernel
def smooth_half(z):
    """Return the upper half of the smooth step of eq 10, from 0 at z = 0 to 1 at z = 1."""
    z = min(z, 1.0)
    return 0.5 * z * (3.0 - z * z)


@kernel
def rub(slots, pulleys, regularised, creep, elementary_time):
    """Write the friction that a regularised law has for the slip, and turn the free pulleys.

    With a creep the contact that hardly slips has the friction mu_1 of the way s dt that it
    slips in the elementary time dt of the integration: a law that depends on the step.
    """
    if regularised is not None:
        table = slots.table
        slip, friction, normal = table[SLIP], table[FRICTION], table[NORMAL]
        static, kinetic, stuck = table[STATIC], table[KINETIC], table[STUCK]
        for s in range(slots.first[-1]):
            size = abs(slip[s])
            share = smooth_half(size / regularised.speed)
            resting = creep_share(size, elementary_time, creep)
            d = min(max(2.0 * (size / regularised.speed - 1.0), 0.0), 1.0)
            mu = static[s] * (share + (1.0 - share) * resting)
            mu += (kinetic[s] - static[s]) * d * d * (3.0 - 2.0 * d)
            friction[s] = np.copysign(mu * normal[s], slip[s])
            stuck[s] = 1.0 if size < regularised.speed else 0.0
        turn_freely(slots, pulleys)


@kernel
def creep_share(slip, elementary_time, creep):
    """Return mu_1/mu_s of eq 13, Fig. 6b; without creep a contact at rest has no friction."""
    if creep is not None:
        return smooth_half(slip * elementary_time / creep.most)
    return 0.0


@kernel
def turn_freely(slots, pulleys):
    """Write the angular accelerations of free pulleys under a friction that is known."""
    table = pulleys.table
    for j in pulleys.free:
        moment = table[TORQUE, j] - table[PULLEY_RADIUS, j] * grip(j, slots)
        table[ALPHA, j] = moment / table[INERTIA, j]


@kernel
def grip(j, slots):
    """Return the sum of the friction on the bodies at pulley j, N."""
    force = 0.0
    for s in range(slots.first[j], slots.first[j + 1]):
        force += slots.table[FRICTION, s]
    return force


@kernel
def friction_heat(slots):
    """Return the power that the friction takes, W."""
    friction, slip = slots.table[FRICTION], slots.table[SLIP]
    heat = 0.0
    for s in range(slots.first[-1]):
        heat += friction[s] * slip[s]
    return heat
