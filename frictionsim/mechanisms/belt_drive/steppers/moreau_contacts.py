"""What the contacts do in a midpoint step of fixed length: their dampers, and impulses of friction.

Each contact meets one body. So its damper is solved for, and so is the velocity that friction
leaves: sums over contacts are done first, and the bodies are touched once, at the end.
"""

from typing import TYPE_CHECKING

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
    BACKWARD,
    BACKWARD_LIMIT,
    BEND,
    BEND_RATE,
    FORWARD,
    FORWARD_LIMIT,
    FRICTION,
    INERTIA,
    INV_DISTANCE,
    NORMAL,
    NX,
    NY,
    PULLEY_RADIUS,
    RADIUS,
    RIM_TURN,
    SIMD_WIDTH,
    SLIP,
    SPEED,
    SPEED_OLD,
    STICK_BIAS,
    STICKING,
    TORQUE,
    VX,
    VY,
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
        WrapFactors,
    )

    Array = npt.NDArray[np.float64]
    Bodies = npt.NDArray[np.uint64]
    Accelerations = tuple[Array, Array]


@loop_kernel
def midpoint_rows(
    times: tuple[float, float],
    bodies: tuple["Bodies", "Array", "Array", "Array", "Array", "Array"],
    contact: tuple["Array", "Array", "Array", "Array", "Array", "Array"],
    wrap: "WrapFactors | None",
    damping: ContactDamping | None,
    stiff: StiffDamping | None,
    written: tuple["Array", "Array", "Array", "Array", "Array", "Array"],
    part: tuple[int, int, int],
) -> float:
    """Write the rows of `midpoint_contacts` of one pulley; return the power damped, W."""
    (h, inv_mass), (body, velocity, ax, ay, bend, bend_rate) = times, bodies
    nx, ny, inv_distance, radius, forward, backward = contact
    slip, bias, turn, normal, forward_limit, backward_limit = written
    power = 0.0
    j, start, count = part
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
            turning = wrap_rate(wrap, i, bend, bend_rate) * along
            turning -= times_factor(wrap, s, along * away * inv_distance[s])
            turn[s] = 0.5 * h * turning
            before = times_factor(wrap, s, vy * nx[s] - vx * ny[s])
            slip[s] = before
            bias[s] = -before - times_factor(wrap, s, gain_y * nx[s] - gain_x * ny[s]) - turn[s]
            if damping is not None:
                depth = radius[s] - 1.0 / inv_distance[s]
                b = full * damper_share(depth * inv_full_depth)
                rate = -away / (1.0 + 0.5 * h * b * inv_mass)
                damped = max(b * rate, -normal[s])
                power += damped * rate
                normal[s] += damped
            forward_limit[s] = h * forward[s] * normal[s]
            backward_limit[s] = h * backward[s] * normal[s]
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
    contacts, table, workspace = system.contacts, system.contacts.table, system.workspace
    contact = system.effects.contact
    contact_forces(kinematics, contacts, contact)
    update_wrap_factors(contacts.wrap, contacts, workspace)
    update_bend_rates(contacts.wrap, system.chain, kinematics, workspace)
    bodies = (contacts.body, velocities, a[0], a[1], workspace[BEND], workspace[BEND_RATE])
    read = (
        *(table[NX], table[NY], table[INV_DISTANCE], table[RADIUS]),
        *(table[FORWARD], table[BACKWARD]),
    )
    written = (
        *(table[SLIP], table[STICK_BIAS], table[RIM_TURN], table[NORMAL]),
        *(table[FORWARD_LIMIT], table[BACKWARD_LIMIT]),
    )
    times, wrap, power = (h, 1.0 / system.chain.mass), contacts.wrap, 0.0
    for j in range(system.pulleys.table.shape[1]):
        part = (j, contacts.offsets[j], contacts.offsets[j + 1])
        power += midpoint_rows(times, bodies, read, wrap, contact.damping, stiff, written, part)
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
        add_normal_forces(contacts, 1.0 / chain.mass, a[0], a[1])
    else:
        pulley = pulleys.table
        for j in pulleys.free:
            external = pulley[INERTIA, j] * pulley[ALPHA, j]
            pulley[ALPHA, j] = solve_pulley_motion(
                j, pulley[SPEED_OLD, j], external, contacts, pulleys, chain.mass
            )
        rubbed = apply_friction_law(contacts, pulleys, chain.mass)
        add_contact_forces(h, contacts, chain, a[0], a[1])
    return rubbed


@inline_kernel
def apply_friction_law(contacts: "Contacts", pulleys: "Pulleys", mass: float) -> float:
    """Write FRICTION, STICKING and SLIP at the speeds in ALPHA; return the heat."""
    pulley, table = pulleys.table, contacts.table
    read = (table[STICK_BIAS], table[RIM_TURN], table[FORWARD_LIMIT], table[BACKWARD_LIMIT])
    written = (table[FRICTION], table[STICKING], table[SLIP])
    rubbed = 0.0
    for j in range(pulley.shape[1]):
        radius = pulley[PULLEY_RADIUS, j]
        rims = (radius * pulley[SPEED_OLD, j], radius * pulley[ALPHA, j])
        part = (contacts.offsets[j], contacts.offsets[j + 1])
        rubbed += friction_rows(part, rims, mass, contacts.wrap, read, written)
    return rubbed


@loop_kernel
def friction_rows(
    part: tuple[int, int],
    rims: tuple[float, float],
    mass: float,
    wrap: "WrapFactors | None",
    read: tuple["Array", "Array", "Array", "Array"],
    written: tuple["Array", "Array", "Array"],
) -> float:
    """Write the rows of `apply_friction_law` of one pulley."""
    (bias, turn, forward, backward), (friction, sticking, slip) = read, written
    before, after = rims
    rubbed = 0.0
    for block in range(part[0], part[1], SIMD_WIDTH):
        for s in range(block, block + SIMD_WIDTH):
            inertia = mass * mass_ratio(wrap, s)
            needed = inertia * (after + bias[s])
            impulse = min(max(needed, -backward[s]), forward[s])
            left = after + bias[s] - impulse / inertia
            rubbed += impulse * 0.5 * (before - slip[s] + left + turn[s])
            friction[s], slip[s] = impulse, left
            sticking[s] = 1.0 if impulse == needed else 0.0
    return rubbed


@inline_kernel
def add_contact_forces(
    h: float, contacts: "Contacts", chain: "Chain", ax: "Array", ay: "Array"
) -> None:
    """Add what normal forces and impulses of friction do in a step to the accelerations."""
    table, inv_mass = contacts.table, 1.0 / chain.mass
    read = (table[NORMAL], table[FRICTION], table[NX], table[NY])
    rates, count = (inv_mass, inv_mass / h), contacts.offsets[-1]
    add_rows(contacts.body, count, rates, contacts.wrap, read, ax, ay)


@loop_kernel
def add_rows(
    body: "Bodies",
    count: int,
    rates: tuple[float, float],
    wrap: "WrapFactors | None",
    read: tuple["Array", "Array", "Array", "Array"],
    ax: "Array",
    ay: "Array",
) -> None:
    """Add normal forces and impulses of so many candidates to accelerations."""
    normal, friction, nx, ny = read
    start = 0
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            out, along = rates[0] * normal[s], times_factor(wrap, s, rates[1] * friction[s])
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
