"""The equations of motion of a belt drive, composed of the effects that its scenario names.

What acts is handed to the kernels in two kinds of parcels: `Laws` of numbers only, and a few of
arrays. A tuple of arrays within a tuple would have all of its arrays counted as in use, and out of
use, in every call; that took longer than the forces themselves.
"""

from typing import TYPE_CHECKING, NamedTuple

from frictionsim.mechanisms.belt_drive.kernels.chain import (
    AxialDamping,
    Bending,
    Chain,
    Weight,
    add_bending,
    add_gravity,
    add_joint_damping,
    body_accelerations,
    joint_forces,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    ALPHA,
    INERTIA,
    PULLEY_RADIUS,
    SPEED,
    TORQUE,
    Contact,
    ContactDamping,
    CreepFriction,
    RegularisedFriction,
    SetValuedFriction,
    add_contact_damping,
    add_friction_forces,
    add_normal_forces,
    contact_forces,
    friction_power,
    pulley_accelerations,
    regularised_friction,
    slip_velocities,
    solve_sticking,
    total_friction,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel
from frictionsim.mechanisms.belt_drive.kernels.signals import (
    PiecewiseCubics,
    add_sine,
    add_sine_derivative,
    derivative,
    value,
)

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

N_ENERGIES = 3  # energies that are integrated along: input, friction, damping


class ForceLaws(NamedTuple):
    """What acts in a belt drive; None for each effect that the scenario lacks."""

    chain: Chain
    contact: Contact
    axial_damping: AxialDamping | None
    bending: Bending | None
    weight: Weight | None
    contact_damping: ContactDamping | None
    set_valued: SetValuedFriction | None
    regularised: RegularisedFriction | None
    creep: CreepFriction | None


class TimeTorques(NamedTuple):
    """Torque on the pulleys `which` over time."""

    targets: "Indices"
    pieces: PiecewiseCubics
    sines: "Array | None"


class SpeedTorques(NamedTuple):
    """Torque on the pulleys `which` over their own speed."""

    targets: "Indices"
    pieces: PiecewiseCubics


class PrescribedSpeeds(NamedTuple):
    """Prescribed speed of the pulleys `which` over time."""

    targets: "Indices"
    pieces: PiecewiseCubics
    sines: "Array | None"


@inline_kernel
def kinematics_of(state, workspace):
    """Return the motion that a state vector, or its rate, begins with, (6, width)."""
    width = workspace.shape[1]
    return state[: 6 * width].reshape((6, width))


@inline_kernel
def add_time_torques(t, torque, torques):
    """Add the torques that are signals in time."""
    if torques is not None:
        for k in range(len(torques.targets)):
            torque[torques.targets[k]] += value(torques.pieces, k, t)
        add_sine(torque, torques.targets, t, torques.sines)


@inline_kernel
def add_speed_torques(speed, torque, loads):
    """Add the torques that are signals of the pulley's own speed."""
    if loads is not None:
        for k in range(len(loads.targets)):
            j = loads.targets[k]
            torque[j] += value(loads.pieces, k, speed[j])


@inline_kernel
def pulley_torques(t, pulleys, torques, loads):
    """Write the torques on the pulleys from outside."""
    speed, torque = pulleys.table[SPEED], pulleys.table[TORQUE]
    for j in range(len(torque)):
        torque[j] = 0.0
    add_time_torques(t, torque, torques)
    add_speed_torques(speed, torque, loads)


@inline_kernel
def copy(source, target):
    """Copy an array; a slice would be looked at for overlaps first, which takes longer."""
    for i in range(len(source)):
        target[i] = source[i]


@inline_kernel
def prescribed_speeds(t, pulleys, speeds):
    """Write the speeds, and their derivatives, that are prescribed."""
    if speeds is not None:
        speed, alpha = pulleys.table[SPEED], pulleys.table[ALPHA]
        for k in range(len(speeds.targets)):
            j = speeds.targets[k]
            speed[j] = value(speeds.pieces, k, t)
            alpha[j] = derivative(speeds.pieces, k, t)
        add_sine(speed, speeds.targets, t, speeds.sines)
        add_sine_derivative(alpha, speeds.targets, t, speeds.sines)


@inline_kernel
def reaction_torques(contacts, pulleys, speeds):
    """Write the torque that it takes to keep a prescribed speed."""
    if speeds is not None:
        table = pulleys.table
        for j in speeds.targets:
            table[TORQUE, j] = table[INERTIA, j] * table[ALPHA, j]
            table[TORQUE, j] += table[PULLEY_RADIUS, j] * total_friction(j, contacts)


@inline_kernel
def smooth_accelerations(laws, kinematics, workspace, contacts, ax, ay, aphi):
    """Write the accelerations of the bodies without friction; return the power damped, W."""
    chain = laws.chain
    joint_forces(chain, kinematics, workspace)
    damped = add_joint_damping(chain, kinematics, workspace, laws.axial_damping)
    body_accelerations(chain, workspace, ax, ay, aphi)
    damped += add_bending(chain, kinematics, workspace, aphi, laws.bending)
    add_gravity(chain, ax, ay, laws.weight)
    contact_forces(kinematics, contacts, laws.contact)
    damped += add_contact_damping(contacts, laws.contact_damping)
    add_normal_forces(contacts, 1.0 / chain.mass, ax, ay)
    return damped


@kernel
def rhs(t, h, state, rate, laws, torques, loads, speeds, workspace, contacts, pulleys):
    """Write the rate of a state: positions, velocities, pulleys' angles, speeds, and energies.

    The state holds the six rows of the motion, the angle of every pulley, the speed of every free
    one, and the energies put in and lost in friction and damping. h is the length of the step, s,
    that a published law asks for.
    """
    pulley, free, inv_mass = pulleys.table, pulleys.free, 1.0 / laws.chain.mass
    width, count = workspace.shape[1], pulley.shape[1]
    velocities = state[3 * width : 6 * width]
    for i in range(3 * width):
        rate[i] = velocities[i]
    angles = 6 * width
    speed, energies = angles + count, angles + count + len(free)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = state[speed + k]
    prescribed_speeds(t, pulleys, speeds)
    pulley_torques(t, pulleys, torques, loads)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    aphi = rate[5 * width : 6 * width]
    damped = smooth_accelerations(
        laws, kinematics_of(state, workspace), workspace, contacts, ax, ay, aphi
    )
    slip_velocities(contacts, pulleys)
    solve_sticking(contacts, pulleys, laws.chain.mass, ax, ay, laws.set_valued)
    regularised_friction(contacts, pulleys, laws.regularised, laws.creep, h)
    if laws.set_valued is None and laws.regularised is None:
        pulley_accelerations(contacts, pulleys)
    add_friction_forces(contacts, inv_mass, ax, ay)
    reaction_torques(contacts, pulleys, speeds)
    rate[energies] = 0.0
    for j in range(count):
        rate[angles + j] = pulley[SPEED, j]
        rate[energies] += pulley[TORQUE, j] * pulley[SPEED, j]
    for k in range(len(free)):
        rate[speed + k] = pulley[ALPHA, free[k]]
    rate[energies + 1] = friction_power(contacts)
    rate[energies + 2] = damped
