"""The equations of motion of a belt drive, composed of the effects that its scenario names.

Bodies move in the plane, or along the line of a guided string, whose equations are in
`guided_string`: tensions, normal forces and friction, in the order of a step.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.effects import in_order
from frictionsim.mechanisms.belt_drive.effects.base import Stage
from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    add_friction_forces,
    friction_power,
    slip_velocities,
    solve_friction,
    total_friction,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import COUNT, FIRST_CANDIDATE, FIRST_POINT
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, shared_kernel, sum_of
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ACROSS,
    ALPHA,
    ARC_LENGTH,
    ARC_START,
    BODY_VX,
    DAMPING_HEAT,
    FRICTION,
    FRICTION_HEAT,
    INERTIA,
    KINEMATIC_ROWS,
    MIDDLE,
    NORMAL,
    NY,
    PULLEY_RADIUS,
    RADIUS,
    SPEED,
    TENSION,
    TORQUE,
    clear_padding,
)
from frictionsim.mechanisms.belt_drive.kernels.signals import (
    SPEED_OVER_TIME,
    TORQUE_OVER_TIME,
    derivative,
    value,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import update_bend_rates

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.axial import AxialParameters
    from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect, Chain
    from frictionsim.mechanisms.belt_drive.effects.contact import ContactParameters
    from frictionsim.mechanisms.belt_drive.kernels.system import (
        Contacts,
        PitchLine,
        Pulleys,
        System,
    )

    Array = npt.NDArray[np.float64]


def sum_of_forces(effects: "Iterable[BeltEffect]") -> Any:
    """Return a kernel that writes the accelerations under forces, and returns the power damped."""
    return sum_of(
        {
            f"system.effects.{effect.key}, system, kinematics, ax, ay, aphi": effect.add_forces
            for effect in effects
            if effect.add_forces is not None
        },
        "system, kinematics, ax, ay, aphi",
    )


# Write the accelerations of the bodies without friction; return the power damped, W.
smooth_accelerations = sum_of_forces(in_order())
# The same where nothing touches a pulley.
contactless_accelerations = sum_of_forces(e for e in in_order() if e.stage is not Stage.CONTACT)


@inline_kernel
def pulley_torques(t: float, system: "System") -> None:
    """Write TORQUE, on the pulleys from outside; reads SPEED."""
    signals = system.signals
    speed, torque = system.pulleys.table[SPEED], system.pulleys.table[TORQUE]
    for j in range(len(torque)):
        torque[j] = 0.0
    for k in range(len(signals.pulleys)):
        j = signals.pulleys[k]
        if signals.kinds[k] != SPEED_OVER_TIME:
            u = t if signals.kinds[k] == TORQUE_OVER_TIME else speed[j]
            torque[j] += value(signals, k, u)


@inline_kernel
def prescribed_speeds(t: float, system: "System") -> None:
    """Write SPEED and ALPHA of the pulleys whose speeds are prescribed."""
    signals = system.signals
    speed, alpha = system.pulleys.table[SPEED], system.pulleys.table[ALPHA]
    for j in system.pulleys.prescribed:
        speed[j] = alpha[j] = 0.0
    for k in range(len(signals.pulleys)):
        j = signals.pulleys[k]
        if signals.kinds[k] == SPEED_OVER_TIME:
            speed[j] += value(signals, k, t)
            alpha[j] += derivative(signals, k, t)


@inline_kernel
def reaction_torques(contacts: "Contacts", pulleys: "Pulleys") -> None:
    """Write the TORQUE that it takes to keep a prescribed speed."""
    table = pulleys.table
    for j in pulleys.prescribed:
        table[TORQUE, j] = table[INERTIA, j] * table[ALPHA, j]
        table[TORQUE, j] += table[PULLEY_RADIUS, j] * total_friction(j, contacts)


@inline_kernel
def plane_rates(
    contact: "ContactParameters | None", h: float, state: "Array", rate: "Array", system: "System"
) -> float:
    """Write the accelerations of bodies in the plane; return the power damped, W."""
    damped = 0.0
    if contact is not None:
        layout, contacts, chain = system.layout, system.contacts, system.chain
        width, half = layout.width, layout.velocities
        ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
        aphi = rate[half + 2 * width : half + 3 * width]
        kinematics = state[: layout.angles].reshape((KINEMATIC_ROWS, width))
        damped = smooth_accelerations(system, kinematics, ax, ay, aphi)
        clear_padding(chain.bodies, ax, ay, aphi)
        update_bend_rates(contacts.wrap, chain, kinematics, system.workspace)
        slip_velocities(contacts, system.pulleys)
        solve_friction(system.effects.belt_friction, system, ax, ay, h)
        add_friction_forces(contacts, 1.0 / chain.mass, ax, ay)
    return damped


@shared_kernel
def rhs(t: float, h: float, state: "Array", rate: "Array", system: "System") -> None:
    """Write the rate of a state, both as `StateLayout` has them.

    h is the length of the step, s, that the published creep law asks for. The system's workspace,
    contacts and pulleys have the forces of the state afterwards.
    """
    layout, pulley, free = system.layout, system.pulleys.table, system.pulleys.free
    half, count = layout.velocities, pulley.shape[1]
    velocities = state[half : layout.angles]
    for i in range(half):
        rate[i] = velocities[i]
    for k in range(len(free)):
        pulley[SPEED, free[k]] = state[layout.speeds + k]
    prescribed_speeds(t, system)
    pulley_torques(t, system)
    damped = plane_rates(system.effects.contact, h, state, rate, system)
    damped += string_rates(system.line, h, state, rate, system)
    reaction_torques(system.contacts, system.pulleys)
    energies = layout.energies
    rate[energies] = 0.0
    for j in range(count):
        rate[layout.angles + j] = pulley[SPEED, j]
        rate[energies] += pulley[TORQUE, j] * pulley[SPEED, j]
    for k in range(len(free)):
        rate[layout.speeds + k] = pulley[ALPHA, free[k]]
    rate[energies + FRICTION_HEAT] = friction_power(system.contacts)
    rate[energies + DAMPING_HEAT] = damped


@inline_kernel
def string_rates(
    line: "PitchLine | None", h: float, state: "Array", rate: "Array", system: "System"
) -> float:
    """Write the accelerations of a guided string; return the power its dampers take, W.

    h is the length of the step, s, that the published creep law asks for.
    """
    damped = 0.0
    if line is not None:
        layout, axial = system.layout, system.effects.axial_damping
        position = state[: layout.velocities]
        velocity = state[layout.velocities : layout.angles]
        acceleration = rate[layout.velocities : layout.angles]
        tensions(line.length, axial, system.chain, position, system.workspace)
        damped = add_damping(axial.damping, velocity, system.workspace[TENSION], system.chain)
        tension, inv_mass = system.workspace[TENSION], 1.0 / system.chain.mass
        for k in range(system.chain.bodies):
            acceleration[k] = inv_mass * (tension[k + 1] - tension[k])
        normal_forces(line, velocity, system)
        for s in range(system.contacts.offsets[-1]):
            system.contacts.table[BODY_VX, s] = velocity[system.contacts.body[s]]
        across = system.workspace[ACROSS]
        slip_velocities(system.contacts, system.pulleys)
        solve_friction(system.effects.belt_friction, system, acceleration, across, h)
        add_friction(inv_mass, system.contacts, acceleration)
    return damped


@inline_kernel
def add_friction(inv_mass: float, contacts: "Contacts", acceleration: "Array") -> None:
    """Add what the friction accelerates along the line."""
    friction, ny, body = contacts.table[FRICTION], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        acceleration[body[s]] -= inv_mass * friction[s] * ny[s]


@inline_kernel
def tensions(
    length: float, axial: "AxialParameters", chain: "Chain", position: "Array", workspace: "Array"
) -> None:
    """Write the TENSION of the joints' springs, and the MIDDLE of each joint.

    `length` is that of the line, m. Joint n, behind the last point, is joint 0 a round further on.
    """
    n, c, rest = chain.bodies, axial.stiffness, axial.stiffness * chain.length
    tension, middle = workspace[TENSION], workspace[MIDDLE]
    for k in range(1, n):
        tension[k] = c * (position[k] - position[k - 1]) - rest
    for k in range(1, n):
        middle[k] = 0.5 * (position[k] + position[k - 1])
    tension[n] = c * (position[0] + length - position[n - 1]) - rest
    middle[n] = 0.5 * (position[0] + length + position[n - 1])
    tension[0], middle[0] = tension[n], middle[n] - length


@inline_kernel
def add_damping(
    damping: float | None, velocity: "Array", tension: "Array", chain: "Chain"
) -> float:
    """Add the forces of the dampers to the tensions; return the power that they take, W."""
    power = 0.0
    if damping is not None:
        n = chain.bodies
        for k in range(1, n):
            rate = velocity[k] - velocity[k - 1]
            tension[k] += damping * rate
            power += damping * rate * rate
        rate = velocity[0] - velocity[n - 1]
        tension[n] += damping * rate
        power += damping * rate * rate
        tension[0] = tension[n]
    return power


@inline_kernel
def normal_forces(line: "PitchLine", velocity: "Array", system: "System") -> None:
    """Write NORMAL; reads TENSION and MIDDLE."""
    table, mass = system.contacts.table, system.chain.mass
    tension, middle = system.workspace[TENSION], system.workspace[MIDDLE]
    for run in range(line.run_count[0]):
        i, s, count = (
            line.runs[FIRST_POINT, run],
            line.runs[FIRST_CANDIDATE, run],
            line.runs[COUNT, run],
        )
        start, arc, inv_radius = table[ARC_START, s], table[ARC_LENGTH, s], 1.0 / table[RADIUS, s]
        normal = table[NORMAL, s : s + count]
        before, after = middle[i : i + count], middle[i + 1 : i + 1 + count]
        pull, pull_after = tension[i : i + count], tension[i + 1 : i + 1 + count]
        v = velocity[i : i + count]
        for k in range(count):
            on_arc = min(max(after[k] - start, 0.0), arc) - min(max(before[k] - start, 0.0), arc)
            force = 0.5 * (pull[k] + pull_after[k]) - mass * v[k] * v[k] / (after[k] - before[k])
            normal[k] = max(force * on_arc * inv_radius, 0.0)
