"""Dry friction between the bodies of a belt and its pulleys.

With n the unit vector from the centre of a pulley of radius R to the centre of a body, at the
distance r from it, and t = z x n along the rim:

    s = R omega - kappa v . t                                              [1]_ eqs 14-18
    m (v . t)' = F . t - m v_n v_t/r + kappa T,    I omega' = M - R sum T  [1]_ eqs 23, 24

where kappa, 1 as published, is the wrap factor of `kernels.wrap`. The lines below have kappa = 1;
with it a is the rate of kappa v . t, and m/kappa^2 stands in the place of m.

Set-valued friction. A body that sticks has s' = -s/tau, which takes the force T = m (R alpha + g)
with the bias g = s/tau - a, where a is its acceleration along t without friction. Sliding, the
force is at its limit. What each pulley does is then one scalar equation for its angular
acceleration alpha,

    I alpha = M - R sum clip(m (R alpha + g_i), -mu_i- N_i, mu_i+ N_i),

with a limit for each direction of the force. A body that has no slip is held by the static
coefficient, in either direction; at the limit it sticks. One that slides is braked by the kinetic
coefficient and never driven; where its slip comes to zero, the static coefficient decides whether
it sticks. With equal coefficients no mode has to be remembered.

The left side rises with alpha and the right side falls. Both are piecewise linear: Newton's method
from the last alpha ends in two or three iterations. With velocities in the place of accelerations
and impulses in the place of forces the same equation serves a fixed-step scheme.

References
----------
.. [1] K. Kubas, Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect, BeltProperties, Stage
from frictionsim.mechanisms.belt_drive.kernels.contacts import run_end
from frictionsim.mechanisms.belt_drive.kernels.jit import KernelChoice, inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    BACKWARD_LIMIT,
    BEND,
    BEND_RATE,
    FORWARD_LIMIT,
    FRICTION,
    INERTIA,
    PULLEY_RADIUS,
    SIMD_WIDTH,
    SLIP,
    SPEED,
    STICK_BIAS,
    TORQUE,
    Array,
    ContactRows,
    Contacts,
    PitchLine,
    Plane,
    Pulleys,
    System,
    contact_rows,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import mass_ratio, times_factor, wrap_rate
from frictionsim.mechanisms.belt_drive.schema import BeltFrictionTable
from frictionsim.solvers import friction_curve as curve


@loop_kernel
def sticking_rows(
    inv_relaxation_time: float,
    contacts: Contacts,
    rows: ContactRows,
    ax: Array,
    ay: Array,
    bend: Array,
    bend_rate: Array,
) -> None:
    """Write the rows of `plane_sticking`."""
    body, wrap, nx, ny, vx, vy = contacts.body, contacts.wrap, rows.nx, rows.ny, rows.vx, rows.vy
    start, count = 0, contacts.offsets[-1]
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            along = vy[s] * nx[s] - vx[s] * ny[s]
            turning = along * (vx[s] * nx[s] + vy[s] * ny[s]) * rows.inv_distance[s]
            own = times_factor(wrap, s, turning - (ay[i] * nx[s] - ax[i] * ny[s]))
            own -= wrap_rate(wrap, i, bend, bend_rate) * along
            rows.stick_bias[s] = rows.slip[s] * inv_relaxation_time + own
            rows.forward_limit[s] = rows.forward[s] * rows.normal[s]
            rows.backward_limit[s] = rows.backward[s] * rows.normal[s]
        start = end


@loop_kernel
def project_rows(j: int, rim: float, mass: float, contacts: Contacts, rows: ContactRows) -> None:
    """Write the rows of `project_friction` of pulley j, whose rim has a velocity, m/s."""
    for block in range(contacts.offsets[j], contacts.offsets[j + 1], SIMD_WIDTH):
        for s in range(block, block + SIMD_WIDTH):
            needed = mass * mass_ratio(contacts.wrap, s) * (rim + rows.stick_bias[s])
            limited = min(max(needed, -rows.backward_limit[s]), rows.forward_limit[s])
            rows.friction[s], rows.sticking[s] = limited, 1.0 if limited == needed else 0.0


@loop_kernel
def add_friction_rows(
    contacts: Contacts, rows: ContactRows, inv_mass: float, ax: Array, ay: Array
) -> None:
    """Write the rows of `add_friction_forces`."""
    body, wrap, friction, nx, ny = contacts.body, contacts.wrap, rows.friction, rows.nx, rows.ny
    start, count = 0, contacts.offsets[-1]
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            force = inv_mass * times_factor(wrap, s, friction[s])
            ax[i] -= force * ny[s]
            ay[i] += force * nx[s]
        start = end


MAX_ITERATIONS = 100  # each halves the bracket at least; two or three are the rule
PULLEY_TOLERANCE = 1e-13  # of two values of alpha, over the largest that counts

# Relaxation time of residual slip: in wave transits of a body, and at most, s. Speeds and tensions
# do not depend on it below that; the heat of friction is 3e-4 off, by its square.
RELAXATION_TRANSITS, MAX_RELAXATION_TIME = 1.5, 2e-5


# --- parameters -----------------------------------------------------------------------------------


class SetValuedFriction(NamedTuple):
    """Set-valued friction; the residual slip of a body that sticks relaxes in this time, s."""

    relaxation_time: float


class RegularisedFriction(NamedTuple):
    """Friction as a function of the slip: eq 12 and Fig. 6, with the transition speed, m/s."""

    transition_speed: float


class CreepFriction(NamedTuple):
    """The blend of eq 13.

    Attributes
    ----------
    max_creep : float, m
        At which a contact without slip has its full friction.
    elementary_time : float, s
        In which it slips the creep; 0 for the step of the integration.
    """

    max_creep: float
    elementary_time: float


class BeltFrictionLaw(NamedTuple):
    """The friction law: set-valued, or regularised, and that with creep or without."""

    set_valued: SetValuedFriction | None
    regularised: RegularisedFriction | None
    creep: CreepFriction | None


class FrictionEffect(BeltEffect):
    """`[effects.belt_friction]`: it is solved for after all other forces are known."""

    key = "belt_friction"
    stage = Stage.FRICTION

    def parameters(
        self, table: BeltFrictionTable | None, belt: BeltProperties
    ) -> BeltFrictionLaw | None:
        if table is None:
            return None
        stiffness = belt.axial_rigidity / belt.chain.length
        transit = float(np.sqrt(belt.chain.mass / stiffness))
        return BeltFrictionLaw(
            SetValuedFriction(min(RELAXATION_TRANSITS * transit, MAX_RELAXATION_TIME))
            if table.law == "set-valued"
            else None,
            RegularisedFriction(table.transition_speed) if table.transition_speed else None,
            CreepFriction(table.maximum_creep, table.elementary_time or 0.0)
            if table.maximum_creep
            else None,
        )


# --- set-valued friction --------------------------------------------------------------------------


@inline_kernel
def slip_velocities(contacts: Contacts, pulleys: Pulleys) -> None:
    """Write SLIP."""
    rows = contact_rows(contacts.table)
    nx, ny, vx, vy, slip = rows.nx, rows.ny, rows.vx, rows.vy, rows.slip
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * pulleys.table[SPEED, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            slip[s] = rim - times_factor(contacts.wrap, s, vy[s] * nx[s] - vx[s] * ny[s])


@inline_kernel
def friction_limits(contacts: Contacts, duration: float) -> None:
    """Write the limits of the friction, N; or of its impulse in a duration, s, N s."""
    rows, count = contact_rows(contacts.table), contacts.offsets[-1]
    normal, forward, backward = rows.normal, rows.forward, rows.backward
    forward_limit, backward_limit = rows.forward_limit, rows.backward_limit
    for s in range(count):
        forward_limit[s] = duration * forward[s] * normal[s]
    for s in range(count):
        backward_limit[s] = duration * backward[s] * normal[s]


@inline_kernel
def plane_sticking(plane: Plane, rate: float, system: System, ax: Array, ay: Array) -> None:
    """Write STICK_BIAS and the limits of the friction of bodies in the plane; reads BEND_RATE."""
    contacts, workspace = system.contacts, system.workspace
    bend, bend_rate = workspace[BEND], workspace[BEND_RATE]
    sticking_rows(rate, contacts, contact_rows(contacts.table), ax, ay, bend, bend_rate)


@inline_kernel
def string_sticking(
    line: PitchLine, rate: float, system: System, along: Array, across: Array
) -> None:
    """Write STICK_BIAS and the limits of the friction of points on a line."""
    contacts = system.contacts
    rows = contact_rows(contacts.table)
    ny, slip, bias = rows.ny, rows.slip, rows.stick_bias
    for s in range(contacts.offsets[-1]):
        bias[s] = slip[s] * rate + along[contacts.body[s]] * ny[s]
    friction_limits(contacts, 1.0)


# stick(kinematics, rate, system, ax, ay): slip relaxes at the rate, 1/s; limits are in N.
stick = KernelChoice({Plane: plane_sticking, PitchLine: string_sticking})


@inline_kernel
def solve_sticking(
    set_valued: SetValuedFriction | None, system: System, ax: Array, ay: Array
) -> None:
    """Solve for set-valued friction, and for what free pulleys do: write FRICTION and ALPHA."""
    if set_valued is not None:
        contacts, pulleys, mass = system.contacts, system.pulleys, system.chain.mass
        stick(system.kinematics, 1.0 / set_valued.relaxation_time, system, ax, ay)
        alpha, torque = pulleys.table[ALPHA], pulleys.table[TORQUE]
        for j in pulleys.free:
            alpha[j] = solve_pulley_motion(j, alpha[j], torque[j], contacts, pulleys, mass)
        project_friction(contacts, pulleys, mass, alpha)


@inline_kernel
def solve_pulley_motion(
    j: int, guess: float, external: float, contacts: Contacts, pulleys: Pulleys, mass: float
) -> float:
    """Return the x with I x = external - R sum clip(m (R x + g_i)), for pulley j.

    x is its angular acceleration and `external` the torque on it; or its angular velocity, and
    `external` the angular momentum that it would have.
    """
    radius, inertia = pulleys.table[PULLEY_RADIUS, j], pulleys.table[INERTIA, j]
    bias = contacts.table[STICK_BIAS]
    forward, backward = contacts.table[FORWARD_LIMIT], contacts.table[BACKWARD_LIMIT]
    low, high = -np.inf, np.inf
    x = guess
    for _ in range(MAX_ITERATIONS):
        force = n_sticking = 0.0
        for block in range(contacts.offsets[j], contacts.offsets[j + 1], SIMD_WIDTH):
            for s in range(block, block + SIMD_WIDTH):
                ratio = mass_ratio(contacts.wrap, s)
                needed = mass * ratio * (radius * x + bias[s])
                limited = min(max(needed, -backward[s]), forward[s])
                force += limited
                n_sticking += ratio if limited == needed else 0.0
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
def project_friction(contacts: Contacts, pulleys: Pulleys, mass: float, x: Array) -> None:
    """Write FRICTION and STICKING: what sticking needs at x of each pulley, within limits."""
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * x[j]
        project_rows(j, rim, mass, contacts, contact_rows(contacts.table))


@inline_kernel
def add_friction_forces(contacts: Contacts, inv_mass: float, ax: Array, ay: Array) -> None:
    """Add what the friction accelerates, or its impulses to velocities."""
    add_friction_rows(contacts, contact_rows(contacts.table), inv_mass, ax, ay)


# --- friction as a function of the slip -----------------------------------------------------------

rising_part = inline_kernel(curve.rising_part)
friction_curve = inline_kernel(curve.friction_curve)


@inline_kernel
def regularised_friction(
    law: RegularisedFriction | None,
    creep: CreepFriction | None,
    contacts: Contacts,
    pulleys: Pulleys,
    step: float,
) -> None:
    """Write FRICTION, STICKING and ALPHA as a regularised law has them for the slip.

    With a creep the contact that hardly slips has the friction mu_1 of the way s dt that it
    slips in the elementary time dt. Without a given one that is the step of the integration, s,
    and the law depends on it.
    """
    if law is not None:
        rows = contact_rows(contacts.table)
        slip, friction, normal = rows.slip, rows.friction, rows.normal
        static, kinetic, sticking = rows.static, rows.kinetic, rows.sticking
        for s in range(contacts.offsets[-1]):
            size = abs(slip[s])
            x = size / law.transition_speed
            mu = friction_curve(x, static[s], kinetic[s])
            mu += creep_coefficient(creep, x, size, step, static[s])
            friction[s] = np.copysign(mu * normal[s], slip[s])
            sticking[s] = 1.0 if size < law.transition_speed else 0.0
        pulley_accelerations(contacts, pulleys)


@inline_kernel
def creep_coefficient(
    creep: CreepFriction | None, x: float, slip: float, step: float, static: float
) -> float:
    """Return the additional friction of a contact at rest, eq 13, Fig. 6b; zero without creep."""
    if creep is not None:
        elementary_time = creep.elementary_time if creep.elementary_time > 0.0 else step
        way = slip * elementary_time
        return static * (1.0 - rising_part(x)) * rising_part(way / creep.max_creep)
    return 0.0


@inline_kernel
def solve_friction(
    law: BeltFrictionLaw | None, system: System, ax: Array, ay: Array, step: float
) -> None:
    """Write the friction on the bodies and the accelerations of free pulleys.

    Reads SLIP, NORMAL, TORQUE and the accelerations without friction; writes FRICTION, STICKING
    and ALPHA.
    """
    contacts, pulleys = system.contacts, system.pulleys
    if law is not None:
        solve_sticking(law.set_valued, system, ax, ay)
        regularised_friction(law.regularised, law.creep, contacts, pulleys, step)
    else:
        pulley_accelerations(contacts, pulleys)


# --- pulleys --------------------------------------------------------------------------------------


@inline_kernel
def pulley_accelerations(contacts: Contacts, pulleys: Pulleys) -> None:
    """Write ALPHA of free pulleys under a friction that is known."""
    table = pulleys.table
    for j in pulleys.free:
        moment = table[TORQUE, j] - table[PULLEY_RADIUS, j] * total_friction(j, contacts)
        table[ALPHA, j] = moment / table[INERTIA, j]


@inline_kernel
def total_friction(j: int, contacts: Contacts) -> float:
    """Return the sum of the friction on the bodies at pulley j, N."""
    force = 0.0
    for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
        force += contacts.table[FRICTION, s]
    return force


@inline_kernel
def friction_power(contacts: Contacts) -> float:
    """Return the power that the friction takes, W."""
    friction, slip = contacts.table[FRICTION], contacts.table[SLIP]
    power = 0.0
    for s in range(contacts.offsets[-1]):
        power += friction[s] * slip[s]
    return power
