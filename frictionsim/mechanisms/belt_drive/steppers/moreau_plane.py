"""A midpoint step of bodies in the plane: forces, contacts, impulses of friction and of dampers.

Each contact meets one body. So its damper is solved for, and so is the velocity that friction
leaves: sums over contacts are done first, and the bodies are touched once, at the end.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.axial import (
    Directions,
    JointForces,
    damper_power,
    directions_of,
    joint_forces_of,
)
from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    add_friction_forces,
    solve_pulley_motion,
)
from frictionsim.mechanisms.belt_drive.effects.contact import (
    ContactDamping,
    add_normal_forces,
    contact_forces,
    damper_share,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import run_end
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.plane import contactless_accelerations
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    BEND,
    BEND_RATE,
    FRICTION,
    INERTIA,
    NX,
    NY,
    PULLEY_RADIUS,
    RIM_TURN,
    SIMD_WIDTH,
    SLIP,
    SPEED_OLD,
    STICK_BIAS,
    VX,
    VY,
    Accelerations,
    Array,
    BodyRows,
    Chain,
    ContactRows,
    Contacts,
    Plane,
    Pulleys,
    System,
    body_rows,
    clear_padding,
    contact_rows,
    full_vectors,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import (
    mass_ratio,
    times_factor,
    update_bend_rates,
    update_wrap_factors,
    wrap_rate,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    StiffDamping,
    expected_damping,
    solve_damping_and_friction,
)

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import MoreauState


class MovingBodies(NamedTuple):
    """How the bodies move at the start of a step.

    Attributes
    ----------
    velocities : (6, width)
        The kinematics at the start, for their velocities.
    ax, ay : (width,), m/s^2
        Accelerations without contacts.
    bend, bend_rate : (width,), rad and rad/s
        How far and how fast the joints are bent in the middle of the step.
    """

    velocities: Array
    ax: Array
    ay: Array
    bend: Array
    bend_rate: Array


@inline_kernel
def initial_forces(plane: Plane, state: "MoreauState", system: System) -> None:
    """Evaluate the forces without friction at the start."""
    a = accelerations_of(state, system)
    contactless_accelerations(system, state.new, a.x, a.y, a.angle)
    contact_forces(state.new, system.contacts, system.effects.contact)
    update_wrap_factors(system.contacts.wrap, system.contacts, system.workspace)


@loop_kernel
def predict_bodies(h: float, y: Array, middle: Array, size: int) -> None:
    """Write the middle of a step: positions half a step on, velocities by extrapolation.

    At the start `middle` has the state before.
    """
    for i in range(full_vectors(size)):
        middle[i] = y[i] + 0.5 * h * y[size + i]
        middle[size + i] = y[size + i] + 0.5 * (y[size + i] - middle[size + i])


@inline_kernel
def forces(
    plane: Plane, h: float, state: "MoreauState", stiff: StiffDamping | None, system: System
) -> float:
    """Write the middle of a step and the forces there but friction; return the power damped, W."""
    layout, y_old, y = system.layout, state.y_old, state.y
    predict_bodies(h, y, y_old, layout.velocities)
    for k in range(layout.angles, layout.end):
        y_old[k] = y[k]
    a = accelerations_of(state, system)
    damped = contactless_accelerations(system, state.middle, a.x, a.y, a.angle)
    clear_padding(system.chain.bodies, a.x, a.y, a.angle)
    damped += midpoint_contacts(h, state.middle, state.new, a, stiff, system)
    return damped


@inline_kernel
def accelerations_of(state: "MoreauState", system: System) -> Accelerations:
    """Return the accelerations of the bodies: views of the workspace of a step."""
    rate, half, width = state.rate, system.layout.velocities, system.layout.width
    ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
    return Accelerations(ax, ay, rate[half + 2 * width : half + 3 * width])


@loop_kernel
def midpoint_rows(
    h: float,
    j: int,
    chain: Chain,
    bodies: MovingBodies,
    contacts: Contacts,
    rows: ContactRows,
    damping: ContactDamping | None,
    stiff: StiffDamping | None,
) -> float:
    """Write the rows of `midpoint_contacts` of pulley j; return the power damped, W."""
    inv_mass, body, wrap = 1.0 / chain.mass, contacts.body, contacts.wrap
    velocity, ax, ay = bodies.velocities, bodies.ax, bodies.ay
    nx, ny, normal, inv_distance = rows.nx, rows.ny, rows.normal, rows.inv_distance
    power = 0.0
    start, count = contacts.offsets[j], contacts.offsets[j + 1]
    full = inv_full_depth = 0.0
    if damping is not None:
        full, inv_full_depth = damping.coefficient[j], 1.0 / damping.full_depth[j]
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            vx, vy, gain_x, gain_y = velocity[VX, i], velocity[VY, i], h * ax[i], h * ay[i]
            more_x, more_y = expected_damping(stiff, i)
            middle_x, middle_y = vx + 0.5 * (gain_x + more_x), vy + 0.5 * (gain_y + more_y)
            away = middle_x * nx[s] + middle_y * ny[s] + 0.5 * h * inv_mass * normal[s]
            along = middle_y * nx[s] - middle_x * ny[s]
            turning = wrap_rate(wrap, i, bodies.bend, bodies.bend_rate) * along
            turning -= times_factor(wrap, s, along * away * inv_distance[s])
            turn = 0.5 * h * turning
            rows.rim_turn[s] = turn
            before = times_factor(wrap, s, vy * nx[s] - vx * ny[s])
            rows.slip[s] = before
            gain = times_factor(wrap, s, gain_y * nx[s] - gain_x * ny[s])
            rows.stick_bias[s] = -before - gain - turn
            if damping is not None:
                depth = rows.radius[s] - 1.0 / inv_distance[s]
                b = full * damper_share(depth * inv_full_depth)
                rate = -away / (1.0 + 0.5 * h * b * inv_mass)
                damped = max(b * rate, -normal[s])
                power += damped * rate
                normal[s] += damped
            rows.forward_limit[s] = h * rows.forward[s] * normal[s]
            rows.backward_limit[s] = h * rows.backward[s] * normal[s]
        start = end
    return power


@inline_kernel
def midpoint_contacts(
    h: float,
    kinematics: Array,
    velocities: Array,
    a: Accelerations,
    stiff: StiffDamping | None,
    system: System,
) -> float:
    """Write what the contacts do in a step before friction is solved for; return the power, W.

    The dampers work at the mean of the old and the new velocity along n: with the acceleration A
    along n without them and the coefficient b that mean is (v + h A/2)/(1 + h b/(2 m)), stable at
    any b. `kinematics` are those in the middle, for the positions, `velocities` those at the start;
    `a` has the accelerations without contacts. Writes NORMAL, SLIP, which is kappa v . t at the
    start, RIM_TURN, STICK_BIAS, which is -kappa v . t at the end without friction, along the t of
    the end, and the limits of the impulses, N s.
    """
    contacts, chain, workspace = system.contacts, system.chain, system.workspace
    contact = system.effects.contact
    contact_forces(kinematics, contacts, contact)
    update_wrap_factors(contacts.wrap, contacts, workspace)
    update_bend_rates(contacts.wrap, chain, kinematics, workspace)
    bodies = MovingBodies(velocities, a.x, a.y, workspace[BEND], workspace[BEND_RATE])
    rows, damping, power = contact_rows(contacts.table), contact.damping, 0.0
    for j in range(system.pulleys.table.shape[1]):
        power += midpoint_rows(h, j, chain, bodies, contacts, rows, damping, stiff)
    return power


@inline_kernel
def move(
    plane: Plane, h: float, state: "MoreauState", stiff: StiffDamping | None, system: System
) -> tuple[float, float]:
    """Solve for the impulses and move on by them; return the heat of friction and of dampers.

    Of the dampers along the belt it is what they take beyond what was expected of them, or all of
    it where they are solved for.
    """
    chain, damping, a = (
        system.chain,
        system.effects.axial_damping.damping,
        accelerations_of(state, system),
    )
    if stiff is None:
        rubbed = solve_impulses(h, a, system)
        return rubbed, end_step(h, state, a, damping, system)
    add_normal_forces(system.contacts, 1.0 / chain.mass, a.x, a.y)
    end_step(h, state, a, None, system)
    heat = solve_with_stiff_damping(h, state.middle, state.new, stiff, system)
    finish_positions(h, state, system.layout.velocities)
    return heat


@inline_kernel
def solve_impulses(h: float, a: Accelerations, system: System) -> float:
    """Solve for the impulses of friction; add all forces of contacts to a; return the heat.

    Writes the new speeds into ALPHA, FRICTION, and SLIP as it is afterwards.
    """
    contacts, pulleys, chain = system.contacts, system.pulleys, system.chain
    rubbed = 0.0
    if system.friction is None:
        add_normal_forces(contacts, 1.0 / chain.mass, a.x, a.y)
    else:
        pulley = pulleys.table
        for j in pulleys.free:
            external = pulley[INERTIA, j] * pulley[ALPHA, j]
            pulley[ALPHA, j] = solve_pulley_motion(
                j, pulley[SPEED_OLD, j], external, contacts, pulleys, chain.mass
            )
        rubbed = apply_friction_law(contacts, pulleys, chain.mass)
        inv_mass, rows = 1.0 / chain.mass, contact_rows(contacts.table)
        add_contact_rows(inv_mass, inv_mass / h, contacts, rows, a.x, a.y)
    return rubbed


@inline_kernel
def apply_friction_law(contacts: Contacts, pulleys: Pulleys, mass: float) -> float:
    """Write FRICTION, STICKING and SLIP at the speeds in ALPHA; return the heat."""
    pulley, rows, rubbed = pulleys.table, contact_rows(contacts.table), 0.0
    for j in range(pulley.shape[1]):
        radius = pulley[PULLEY_RADIUS, j]
        before, after = radius * pulley[SPEED_OLD, j], radius * pulley[ALPHA, j]
        rubbed += friction_rows(j, before, after, mass, contacts, rows)
    return rubbed


@loop_kernel
def friction_rows(
    j: int, before: float, after: float, mass: float, contacts: Contacts, rows: ContactRows
) -> float:
    """Write the rows of `apply_friction_law` of pulley j, by the velocities of its rim, m/s."""
    bias, slip, rubbed = rows.stick_bias, rows.slip, 0.0
    for block in range(contacts.offsets[j], contacts.offsets[j + 1], SIMD_WIDTH):
        for s in range(block, block + SIMD_WIDTH):
            inertia = mass * mass_ratio(contacts.wrap, s)
            needed = inertia * (after + bias[s])
            impulse = min(max(needed, -rows.backward_limit[s]), rows.forward_limit[s])
            left = after + bias[s] - impulse / inertia
            rubbed += impulse * 0.5 * (before - slip[s] + left + rows.rim_turn[s])
            rows.friction[s], slip[s] = impulse, left
            rows.sticking[s] = 1.0 if impulse == needed else 0.0
    return rubbed


@loop_kernel
def add_contact_rows(
    inv_mass: float,
    acceleration_per_impulse: float,
    contacts: Contacts,
    rows: ContactRows,
    ax: Array,
    ay: Array,
) -> None:
    """Add what normal forces and impulses of friction do in a step to the accelerations.

    `acceleration_per_impulse` is one over mass and length of the step, 1/(kg s).
    """
    body, wrap, nx, ny = contacts.body, contacts.wrap, rows.nx, rows.ny
    start, count = 0, contacts.offsets[-1]
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            out = inv_mass * rows.normal[s]
            along = times_factor(wrap, s, acceleration_per_impulse * rows.friction[s])
            ax[i] += out * nx[s] - along * ny[s]
            ay[i] += out * ny[s] + along * nx[s]
        start = end


@inline_kernel
def solve_with_stiff_damping(
    h: float, old: Array, new: Array, stiff: StiffDamping, system: System
) -> tuple[float, float]:
    """Solve for the impulses of friction and of stiff dampers, and add them to new velocities.

    Return the heat of friction and of dampers. Writes what `solve_impulses` does.
    """
    contacts, pulleys, table = system.contacts, system.pulleys, system.contacts.table
    pulley, slip, bias = pulleys.table, table[SLIP], table[STICK_BIAS]
    damped = solve_damping_and_friction(h, old, new, stiff, system)
    add_friction_forces(contacts, 1.0 / system.chain.mass, new[VX], new[VY])
    tangential_velocities(new[VX], new[VY], contacts, bias)
    rubbed = 0.0
    for j in range(pulley.shape[1]):
        mean = 0.5 * pulley[PULLEY_RADIUS, j] * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        rim = pulley[PULLEY_RADIUS, j] * pulley[ALPHA, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            rubbed += table[FRICTION, s] * (mean - 0.5 * (slip[s] + bias[s]))
            slip[s] = rim - bias[s] - table[RIM_TURN, s]
    return rubbed, damped


@inline_kernel
def tangential_velocities(vx: Array, vy: Array, contacts: Contacts, along: Array) -> None:
    """Write the velocities along t of the candidates, with their wrap factors."""
    nx, ny, body = contacts.table[NX], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        i = body[s]
        along[s] = times_factor(contacts.wrap, s, vy[i] * nx[s] - vx[i] * ny[s])


@inline_kernel
def end_step(
    h: float, state: "MoreauState", a: Accelerations, damping: float | None, system: System
) -> float:
    """Move on by the accelerations a; return the heat that dampers were not expected to take.

    Velocities in `middle` become those at the start.
    """
    old, new = body_rows(state.middle), body_rows(state.new)
    directions, forces = directions_of(system.workspace), joint_forces_of(system.workspace)
    return h * move_bodies(h, system.chain, old, new, a, damping, directions, forces)


@loop_kernel
def move_bodies(
    h: float,
    chain: Chain,
    old: BodyRows,
    new: BodyRows,
    a: Accelerations,
    damping: float | None,
    directions: Directions,
    forces: JointForces,
) -> float:
    """Write the rows of `end_step`; return the power, W."""
    power, half = 0.0, 0.5 * chain.length
    for k in range(full_vectors(chain.bodies)):
        vx, vy, spin = new.vx[k], new.vy[k], new.spin[k]
        new_vx, new_vy, new_spin = vx + h * a.x[k], vy + h * a.y[k], spin + h * a.angle[k]
        if damping is not None:
            missed_x = 0.5 * (vx + new_vx) - old.vx[k]
            missed_y = 0.5 * (vy + new_vy) - old.vy[k]
            missed_spin = 0.5 * (spin + new_spin) - old.spin[k]
            taken = damper_power(half, directions, forces, k, missed_x, missed_y, missed_spin)
            power += taken if k < chain.bodies else 0.0
        old.vx[k], old.vy[k], old.spin[k] = vx, vy, spin
        new.vx[k], new.vy[k], new.spin[k] = new_vx, new_vy, new_spin
        new.x[k] = old.x[k] + 0.5 * h * new_vx
        new.y[k] = old.y[k] + 0.5 * h * new_vy
        new.angle[k] = old.angle[k] + 0.5 * h * new_spin
    return power


@inline_kernel
def finish_positions(h: float, state: "MoreauState", size: int) -> None:
    """Write the positions at the end of a step, from those in the middle."""
    for i in range(size):
        state.y[i] = state.y_old[i] + 0.5 * h * state.y[size + i]


@inline_kernel
def finish(plane: Plane, h: float, state: "MoreauState", system: System) -> None:
    """Write into y_old the positions at the start of the last step, from those in its middle."""
    size = system.layout.velocities
    for i in range(size):
        state.y_old[i] -= 0.5 * h * state.y_old[size + i]
