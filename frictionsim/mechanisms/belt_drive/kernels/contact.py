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
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

SIMD_WIDTH = 8  # numbers of double precision in the widest vector
MAX_SWEEPS = 100  # each halves the bracket at least; two or three are the rule
PULLEY_TOLERANCE = 1e-13  # two values of alpha, over the largest that counts


class Contact(NamedTuple):
    """Penalty contact of a body: c1 in N/m^2, c2 in N/m."""

    c1: float
    c2: float


class ContactDamping(NamedTuple):
    """Damping of a body's contact, N s/m, in full from the depth p_max, m, on."""

    coefficient: float
    full_depth: float


class SetValuedFriction(NamedTuple):
    """Set-valued friction; a body that sticks loses its slip within the time tau, s."""

    relaxation_time: float


class RegularisedFriction(NamedTuple):
    """Friction as a function of the slip: eq 12 and Fig. 6, with the transition speed, m/s."""

    speed: float


class CreepFriction(NamedTuple):
    """The blend of eq 13: the creep, m, at which a contact without slip has its full friction."""

    max_creep: float


class FrictionCoefficients(NamedTuple):
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
PULLEY_X, PULLEY_Y, PULLEY_RADIUS, INERTIA, SPEED, ALPHA, TORQUE, SPEED_OLD = range(8)


class Contacts(NamedTuple):
    """The bodies near pulleys; the slots of pulley j are first[j] to first[j + 1] - 1.

    `first` is (np + 1,), `body` (slots,), `table` (20, slots) with rows as named below; `kept`,
    (2, n), has mode and stick of the bodies while the slots are dealt anew.
    """

    offsets: "Indices"
    body: "Indices"
    table: "Array"
    saved_modes: "Array"


# Rows: of the slot's pulley, m, with a radius of zero where the slot is empty,
CENTRE_X, CENTRE_Y, RADIUS = range(3)
# coefficients of friction at rest and sliding, and those in force for T > 0 and for T < 0,
STATIC, KINETIC, FORWARD, BACKWARD = range(3, 7)
# the unit vector n and 1/r, and the velocity of the body, m/s,
NX, NY, INV_DISTANCE, BODY_VX, BODY_VY = range(7, 12)
# N, and the limits of T > 0 and of T < 0, in N or N s; the slip, m/s; g above; T; 1 where T is
# within its limits, else 0; and the mode, 0 where the static coefficient holds, else the direction
# of the slip.
NORMAL, FORWARD_LIMIT, BACKWARD_LIMIT, SLIP, STICK_BIAS, FRICTION, STICKING, MODE = range(12, 20)
ROWS = 20

NEW_CONTACT = 2.0  # in the place of a mode: the body had no slot


@inline_kernel
def find_contact_candidates(kinematics, bodies, pulleys, skin, contacts, friction):
    """Give a slot to each body within a margin of a pulley's rim."""
    x, y, table, count = kinematics[X], kinematics[Y], pulleys.table, pulleys.table.shape[1]
    body, radius, mode, sticking = (
        contacts.body,
        contacts.table[RADIUS],
        contacts.table[MODE],
        contacts.table[STICKING],
    )
    saved_mode, saved_sticking = contacts.saved_modes[0], contacts.saved_modes[1]
    saved_mode[:] = NEW_CONTACT
    for s in range(contacts.offsets[count]):
        if radius[s] > 0.0:
            saved_mode[body[s]], saved_sticking[body[s]] = mode[s], sticking[s]
    s = 0
    for j in range(count):
        contacts.offsets[j] = s
        reach = (table[PULLEY_RADIUS, j] + skin) ** 2
        for i in range(bodies):
            if (x[i] - table[PULLEY_X, j]) ** 2 + (y[i] - table[PULLEY_Y, j]) ** 2 < reach:
                body[s], radius[s] = i, table[PULLEY_RADIUS, j]
                mode[s], sticking[s] = saved_mode[i], saved_sticking[i]
                s += 1
        filled = s
        s += -(s - contacts.offsets[j]) % SIMD_WIDTH
        for k in range(filled, s):
            body[k], radius[k], mode[k], sticking[k] = 0, 0.0, 0.0, 0.0
        for k in range(contacts.offsets[j], s):
            contacts.table[CENTRE_X, k] = table[PULLEY_X, j]
            contacts.table[CENTRE_Y, k] = table[PULLEY_Y, j]
            contacts.table[FRICTION, k] = 0.0
    contacts.offsets[count] = s
    initial_contact_modes(kinematics, contacts, pulleys)
    assign_friction_coefficients(contacts, count, friction)


@inline_kernel
def initial_contact_modes(kinematics, contacts, pulleys):
    """Have bodies that are new at a pulley stick if they have no slip, else slide."""
    contact_table, pulley = contacts.table, pulleys.table
    for j in range(pulley.shape[1]):
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            if contact_table[MODE, s] == NEW_CONTACT:
                i = contacts.body[s]
                dx, dy = (
                    kinematics[X, i] - contact_table[CENTRE_X, s],
                    kinematics[Y, i] - contact_table[CENTRE_Y, s],
                )
                along = (kinematics[VY, i] * dx - kinematics[VX, i] * dy) / np.sqrt(
                    dx * dx + dy * dy
                )
                slip = pulley[PULLEY_RADIUS, j] * pulley[SPEED, j] - along
                contact_table[SLIP, s], contact_table[MODE, s] = slip, np.sign(slip)
                contact_table[STICKING, s] = 1.0 if slip == 0.0 else 0.0


@inline_kernel
def assign_friction_coefficients(contacts, pulleys, friction):
    """Write the coefficients of the bodies that have a slot."""
    if friction is not None:
        for j in range(pulleys):
            for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
                contacts.table[STATIC, s] = friction.static[j, contacts.body[s]]
                contacts.table[KINETIC, s] = friction.kinetic[j, contacts.body[s]]
        select_friction_coefficients(contacts)


@inline_kernel
def select_friction_coefficients(contacts):
    """Write the coefficients that are in force; return whether that changes a limit."""
    table = contacts.table
    changed = 0.0
    for s in range(contacts.offsets[-1]):
        static, kinetic, mode = table[STATIC, s], table[KINETIC, s], table[MODE, s]
        against = 0.0 if static > kinetic else static
        forward = static if mode == 0.0 else kinetic if mode > 0.0 else against
        backward = static if mode == 0.0 else kinetic if mode < 0.0 else against
        change = abs(forward - table[FORWARD, s]) + abs(backward - table[BACKWARD, s])
        changed += change * table[NORMAL, s]
        table[FORWARD, s], table[BACKWARD, s] = forward, backward
    return changed > 0.0


@inline_kernel
def update_friction_coefficients(contacts):
    """Take over from the last step who sticks and who slides where to.

    A body that sticks lets go in the direction of its friction. One that slides goes on until its
    slip has come to zero. Return whether that changes a limit.
    """
    table = contacts.table
    for s in range(contacts.offsets[-1]):
        mode, slip, friction = table[MODE, s], table[SLIP, s], table[FRICTION, s]
        if table[STICKING, s] > 0.0 or mode * slip < 0.0:
            mode = 0.0
        elif mode == 0.0:
            mode = np.sign(friction) if friction != 0.0 else np.sign(slip)
        table[MODE, s] = mode
    return select_friction_coefficients(contacts)


@inline_kernel
def contact_forces(kinematics, contacts, contact):
    """Write where the bodies are on their pulleys, how they move, and the spring's share of N."""
    x, y, vx, vy = kinematics[X], kinematics[Y], kinematics[VX], kinematics[VY]
    body, table, count = contacts.body, contacts.table, contacts.offsets[-1]
    nx, ny, normal, inv_distance = table[NX], table[NY], table[NORMAL], table[INV_DISTANCE]
    centre_x, centre_y, radius = table[CENTRE_X], table[CENTRE_Y], table[RADIUS]
    body_vx, body_vy = table[BODY_VX], table[BODY_VY]
    for s in range(count):
        i = body[s]
        nx[s], ny[s] = x[i] - centre_x[s], y[i] - centre_y[s]
        body_vx[s], body_vy[s] = vx[i], vy[i]
    c1, c2 = contact.c1, contact.c2
    for s in range(count):
        inv_distance[s] = 1.0 / np.sqrt(nx[s] * nx[s] + ny[s] * ny[s])
    for s in range(count):
        p = max(radius[s] - 1.0 / inv_distance[s], 0.0)
        normal[s] = p * (c1 * p + c2)
    for s in range(count):
        nx[s] *= inv_distance[s]
    for s in range(count):
        ny[s] *= inv_distance[s]


@inline_kernel
def add_contact_damping(contacts, damping):
    """Add the damping's share of N, which never pulls; return the power it takes, W."""
    heat = 0.0
    if damping is not None:
        table = contacts.table
        normal, nx, ny, vx, vy = table[NORMAL], table[NX], table[NY], table[BODY_VX], table[BODY_VY]
        radius, inv_distance = table[RADIUS], table[INV_DISTANCE]
        inv_full_depth = 1.0 / damping.full_depth
        for s in range(contacts.offsets[-1]):
            depth = min(max((radius[s] - 1.0 / inv_distance[s]) * inv_full_depth, 0.0), 1.0)
            coefficient = damping.coefficient * depth * depth * (3.0 - 2.0 * depth)
            rate = -(vx[s] * nx[s] + vy[s] * ny[s])
            damped = max(normal[s] + coefficient * rate, 0.0)
            heat += (damped - normal[s]) * rate
            normal[s] = damped
    return heat


@inline_kernel
def add_normal_forces(contacts, inv_mass, ax, ay):
    """Add what the normal forces accelerate."""
    normal, nx, ny = contacts.table[NORMAL], contacts.table[NX], contacts.table[NY]
    for s in range(contacts.offsets[-1]):
        i = contacts.body[s]
        ax[i] += inv_mass * normal[s] * nx[s]
        ay[i] += inv_mass * normal[s] * ny[s]


@inline_kernel
def slip_velocities(contacts, pulleys):
    """Write the slip."""
    table = contacts.table
    nx, ny, vx, vy, slip = table[NX], table[NY], table[BODY_VX], table[BODY_VY], table[SLIP]
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * pulleys.table[SPEED, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            slip[s] = rim - (vy[s] * nx[s] - vx[s] * ny[s])


@inline_kernel
def solve_sticking(contacts, pulleys, mass, ax, ay, set_valued):
    """Solve for the friction of exact stick, and for what free pulleys do."""
    if set_valued is not None:
        table, body, count = contacts.table, contacts.body, contacts.offsets[-1]
        nx, ny, vx, vy = table[NX], table[NY], table[BODY_VX], table[BODY_VY]
        stick_bias, slip, inv_distance = table[STICK_BIAS], table[SLIP], table[INV_DISTANCE]
        inv_relaxation_time = 1.0 / set_valued.relaxation_time
        for s in range(count):
            i = body[s]
            along = vy[s] * nx[s] - vx[s] * ny[s]
            turning = along * (vx[s] * nx[s] + vy[s] * ny[s]) * inv_distance[s]
            stick_bias[s] = (
                slip[s] * inv_relaxation_time - (ay[i] * nx[s] - ax[i] * ny[s]) + turning
            )
        friction_limits(contacts, 1.0)
        alpha, torque = pulleys.table[ALPHA], pulleys.table[TORQUE]
        for j in pulleys.free:
            alpha[j] = solve_pulley_motion(j, alpha[j], torque[j], contacts, pulleys, mass)
        project_friction(contacts, pulleys, mass, alpha)


@inline_kernel
def friction_limits(contacts, duration):
    """Write the limits of the friction, N; or of its impulse in a duration, s, N s."""
    table, count = contacts.table, contacts.offsets[-1]
    normal, forward, backward = table[NORMAL], table[FORWARD], table[BACKWARD]
    forward_limit, backward_limit = table[FORWARD_LIMIT], table[BACKWARD_LIMIT]
    for s in range(count):
        forward_limit[s] = duration * forward[s] * normal[s]
    for s in range(count):
        backward_limit[s] = duration * backward[s] * normal[s]


@inline_kernel
def solve_pulley_motion(j, guess, external, contacts, pulleys, mass):
    """Return the x with I x = offer - R sum clip(m (R x + g_i)), for pulley j.

    x is its angular acceleration and `offer` the torque on it; or its angular velocity, and
    `offer` the angular momentum that it would have.
    """
    radius, inertia = pulleys.table[PULLEY_RADIUS, j], pulleys.table[INERTIA, j]
    stick_bias = contacts.table[STICK_BIAS]
    forward, backward = contacts.table[FORWARD_LIMIT], contacts.table[BACKWARD_LIMIT]
    low, high = -np.inf, np.inf
    x = guess
    for _ in range(MAX_SWEEPS):
        force = n_sticking = 0.0
        for block in range(contacts.offsets[j], contacts.offsets[j + 1], SIMD_WIDTH):
            for s in range(block, block + SIMD_WIDTH):
                needed = mass * (radius * x + stick_bias[s])
                limited = min(max(needed, -backward[s]), forward[s])
                force += limited
                n_sticking += 1.0 if limited == needed else 0.0
        excess = inertia * x - external + radius * force
        if excess > 0.0:
            high = x
        else:
            low = x
        change = excess / (inertia + radius * radius * mass * n_sticking)
        if abs(change) <= PULLEY_TOLERANCE * (abs(x) + abs(external) / inertia):
            return x - change
        x -= change
        if not low < x < high:
            x = 0.5 * (low + high)
    return x


@inline_kernel
def project_friction(contacts, pulleys, mass, x):
    """Write the friction, with the x of each pulley, and who sticks."""
    table = contacts.table
    stick_bias, friction, sticking = table[STICK_BIAS], table[FRICTION], table[STICKING]
    forward, backward = table[FORWARD_LIMIT], table[BACKWARD_LIMIT]
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * x[j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            friction[s] = min(max(mass * (rim + stick_bias[s]), -backward[s]), forward[s])
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            sticking[s] = 1.0 if friction[s] == mass * (rim + stick_bias[s]) else 0.0


@inline_kernel
def add_friction_forces(contacts, inv_mass, ax, ay):
    """Add what the friction accelerates."""
    friction, nx, ny = contacts.table[FRICTION], contacts.table[NX], contacts.table[NY]
    for s in range(contacts.offsets[-1]):
        i = contacts.body[s]
        ax[i] -= inv_mass * friction[s] * ny[s]
        ay[i] += inv_mass * friction[s] * nx[s]


@inline_kernel
def smoothstep_upper(z):
    """Return the upper half of the smooth step of eq 10, from 0 at z = 0 to 1 at z = 1."""
    z = min(z, 1.0)
    return 0.5 * z * (3.0 - z * z)


@inline_kernel
def regularised_friction(contacts, pulleys, regularised, creep, elementary_time):
    """Write the friction that a regularised law has for the slip, and turn the free pulleys.

    With a creep the contact that hardly slips has the friction mu_1 of the way s dt that it
    slips in the elementary time dt of the integration: a law that depends on the step.
    """
    if regularised is not None:
        table = contacts.table
        slip, friction, normal = table[SLIP], table[FRICTION], table[NORMAL]
        static, kinetic, sticking = table[STATIC], table[KINETIC], table[STICKING]
        for s in range(contacts.offsets[-1]):
            size = abs(slip[s])
            ratio = smoothstep_upper(size / regularised.speed)
            resting = creep_ratio(size, elementary_time, creep)
            d = min(max(2.0 * (size / regularised.speed - 1.0), 0.0), 1.0)
            mu = static[s] * (ratio + (1.0 - ratio) * resting)
            mu += (kinetic[s] - static[s]) * d * d * (3.0 - 2.0 * d)
            friction[s] = np.copysign(mu * normal[s], slip[s])
            sticking[s] = 1.0 if size < regularised.speed else 0.0
        pulley_accelerations(contacts, pulleys)


@inline_kernel
def creep_ratio(slip, elementary_time, creep):
    """Return mu_1/mu_s of eq 13, Fig. 6b; without creep a contact at rest has no friction."""
    if creep is not None:
        return smoothstep_upper(slip * elementary_time / creep.max_creep)
    return 0.0


@inline_kernel
def pulley_accelerations(contacts, pulleys):
    """Write the angular accelerations of free pulleys under a friction that is known."""
    table = pulleys.table
    for j in pulleys.free:
        moment = table[TORQUE, j] - table[PULLEY_RADIUS, j] * total_friction(j, contacts)
        table[ALPHA, j] = moment / table[INERTIA, j]


@inline_kernel
def total_friction(j, contacts):
    """Return the sum of the friction on the bodies at pulley j, N."""
    force = 0.0
    for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
        force += contacts.table[FRICTION, s]
    return force


@inline_kernel
def friction_power(contacts):
    """Return the power that the friction takes, W."""
    friction, slip = contacts.table[FRICTION], contacts.table[SLIP]
    heat = 0.0
    for s in range(contacts.offsets[-1]):
        heat += friction[s] * slip[s]
    return heat
