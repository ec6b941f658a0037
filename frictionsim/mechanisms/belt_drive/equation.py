"""The equations of motion of a belt drive: pulleys, energies, and a belt of either kinematics."""

from frictionsim.mechanisms.belt_drive.effects.belt_friction import friction_power, total_friction
from frictionsim.mechanisms.belt_drive.kernels.contacts import assign_friction_coefficients
from frictionsim.mechanisms.belt_drive.kernels.jit import KernelChoice, inline_kernel, shared_kernel
from frictionsim.mechanisms.belt_drive.kernels.plane import plane_accelerations, search_plane
from frictionsim.mechanisms.belt_drive.kernels.string import search_line, string_accelerations
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    DAMPING_HEAT,
    FRICTION_HEAT,
    INERTIA,
    PULLEY_RADIUS,
    SPEED,
    SPEED_OVER_TIME,
    TORQUE,
    TORQUE_OVER_TIME,
    Array,
    Contacts,
    PitchLine,
    Plane,
    Pulleys,
    System,
    derivative,
    value,
)

# search(kinematics, system, rows): make candidates of what is near a pulley.
search = KernelChoice({Plane: search_plane, PitchLine: search_line})
# belt_accelerations(kinematics, h, state, rate, system): write them; return the power damped, W.
belt_accelerations = KernelChoice({Plane: plane_accelerations, PitchLine: string_accelerations})


@inline_kernel
def find_contact_candidates(system: System, kinematics: Array) -> None:
    """Make candidates of the bodies near a rim, with their coefficients of friction.

    Reads the kinematics, MODE and STICKING; writes all of the contacts but their forces.
    """
    search(system.kinematics, system, kinematics)
    count = system.pulleys.table.shape[1]
    assign_friction_coefficients(system.contacts, count, system.friction)


@inline_kernel
def pulley_torques(t: float, system: System) -> None:
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
def prescribed_speeds(t: float, system: System) -> None:
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
def reaction_torques(contacts: Contacts, pulleys: Pulleys) -> None:
    """Write the TORQUE that it takes to keep a prescribed speed."""
    table = pulleys.table
    for j in pulleys.prescribed:
        table[TORQUE, j] = table[INERTIA, j] * table[ALPHA, j]
        table[TORQUE, j] += table[PULLEY_RADIUS, j] * total_friction(j, contacts)


@shared_kernel
def rhs(t: float, h: float, state: Array, rate: Array, system: System) -> None:
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
    damped = belt_accelerations(system.kinematics, h, state, rate, system)
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
