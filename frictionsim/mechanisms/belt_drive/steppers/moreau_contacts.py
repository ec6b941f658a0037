"""What the contacts do in a midpoint step of fixed length: their dampers, and impulses of friction.

Each contact meets one body. So its damper is solved for, and so is the velocity that friction
leaves: sums over contacts are done first, and the bodies are touched once, at the end.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

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
from frictionsim.mechanisms.belt_drive.kernels.candidate_list import run_end
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
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
    SPEED,
    SPEED_OLD,
    STICK_BIAS,
    TORQUE,
    VX,
    VY,
    Accelerations,
    ContactRows,
    contact_rows,
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
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.base import Chain
    from frictionsim.mechanisms.belt_drive.kernels.system import (
        Contacts,
        Pulleys,
        System,
    )

    Array = npt.NDArray[np.float64]
    Bodies = npt.NDArray[np.uint64]


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

    velocities: "Array"
    ax: "Array"
    ay: "Array"
    bend: "Array"
    bend_rate: "Array"


@loop_kernel
def midpoint_rows(
    h: float,
    j: int,
    chain: "Chain",
    bodies: MovingBodies,
    contacts: "Contacts",
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
    kinematics: "Array",
    velocities: "Array",
    a: "Accelerations",
    stiff: StiffDamping | None,
    system: "System",
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
def free_pulley_speeds(h: float, pulleys: "Pulleys") -> None:
    """Write into ALPHA the speeds after the step, without friction where they are free."""
    pulley = pulleys.table
    for j in range(pulley.shape[1]):
        pulley[ALPHA, j] = pulley[SPEED, j]
    for j in pulleys.free:
        pulley[ALPHA, j] = pulley[SPEED_OLD, j] + h * pulley[TORQUE, j] / pulley[INERTIA, j]


@inline_kernel
def solve_impulses(h: float, a: "Accelerations", system: "System") -> float:
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
def apply_friction_law(contacts: "Contacts", pulleys: "Pulleys", mass: float) -> float:
    """Write FRICTION, STICKING and SLIP at the speeds in ALPHA; return the heat."""
    pulley, rows, rubbed = pulleys.table, contact_rows(contacts.table), 0.0
    for j in range(pulley.shape[1]):
        radius = pulley[PULLEY_RADIUS, j]
        before, after = radius * pulley[SPEED_OLD, j], radius * pulley[ALPHA, j]
        rubbed += friction_rows(j, before, after, mass, contacts, rows)
    return rubbed


@loop_kernel
def friction_rows(
    j: int,
    before: float,
    after: float,
    mass: float,
    contacts: "Contacts",
    rows: ContactRows,
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
    contacts: "Contacts",
    rows: ContactRows,
    ax: "Array",
    ay: "Array",
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
    h: float, old: "Array", new: "Array", stiff: StiffDamping, system: "System"
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
def tangential_velocities(vx: "Array", vy: "Array", contacts: "Contacts", along: "Array") -> None:
    """Write the velocities along t of the candidates, with their wrap factors."""
    nx, ny, body = contacts.table[NX], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        i = body[s]
        along[s] = times_factor(contacts.wrap, s, vy[i] * nx[s] - vx[i] * ny[s])
