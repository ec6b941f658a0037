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
    accelerate,
    bend,
    damp_axially,
    stretch,
    weigh,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    ALPHA,
    INERTIA,
    PULLEY_RADIUS,
    SPEED,
    TORQUE,
    Contact,
    ContactDamping,
    Creep,
    ExactStick,
    Regularised,
    damp_contact,
    drag,
    friction_heat,
    grip,
    press,
    push,
    rub,
    slide,
    stick,
    turn_freely,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import entry, kernel
from frictionsim.mechanisms.belt_drive.kernels.signals import (
    Pieces,
    add_sine,
    add_sine_slope,
    slope,
    value,
)

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

LEDGER = 3  # energies that are integrated along: input, friction, damping


class Laws(NamedTuple):
    """What acts in a belt drive; None for each effect that the scenario lacks."""

    chain: Chain
    contact: Contact
    axial_damping: AxialDamping | None
    bending: Bending | None
    weight: Weight | None
    contact_damping: ContactDamping | None
    exact: ExactStick | None
    regularised: Regularised | None
    creep: Creep | None


class Torques(NamedTuple):
    """Torque on the pulleys `which` over time."""

    which: "Indices"
    pieces: Pieces
    sines: "Array | None"


class Loads(NamedTuple):
    """Torque on the pulleys `which` over their own speed."""

    which: "Indices"
    pieces: Pieces


class Speeds(NamedTuple):
    """Prescribed speed of the pulleys `which` over time."""

    which: "Indices"
    pieces: Pieces
    sines: "Array | None"


@kernel
def motion_in(state, room):
    """Return the motion that a state vector, or its rate, begins with, (6, width)."""
    width = room.shape[1]
    return state[: 6 * width].reshape((6, width))


@kernel
def drive(t, torque, torques):
    """Add the torques that are signals in time."""
    if torques is not None:
        for k in range(len(torques.which)):
            torque[torques.which[k]] += value(torques.pieces, k, t)
        add_sine(torque, torques.which, t, torques.sines)


@kernel
def resist(speed, torque, loads):
    """Add the torques that are signals of the pulley's own speed."""
    if loads is not None:
        for k in range(len(loads.which)):
            j = loads.which[k]
            torque[j] += value(loads.pieces, k, speed[j])


@kernel
def load(t, pulleys, torques, loads):
    """Write the torques on the pulleys from outside."""
    speed, torque = pulleys.table[SPEED], pulleys.table[TORQUE]
    for j in range(len(torque)):
        torque[j] = 0.0
    drive(t, torque, torques)
    resist(speed, torque, loads)


@kernel
def copy(source, target):
    """Copy an array; a slice would be looked at for overlaps first, which takes longer."""
    for i in range(len(source)):
        target[i] = source[i]


@kernel
def prescribe(t, pulleys, speeds):
    """Write the speeds, and their derivatives, that are prescribed."""
    if speeds is not None:
        speed, alpha = pulleys.table[SPEED], pulleys.table[ALPHA]
        for k in range(len(speeds.which)):
            j = speeds.which[k]
            speed[j] = value(speeds.pieces, k, t)
            alpha[j] = slope(speeds.pieces, k, t)
        add_sine(speed, speeds.which, t, speeds.sines)
        add_sine_slope(alpha, speeds.which, t, speeds.sines)


@kernel
def react(slots, pulleys, speeds):
    """Write the torque that it takes to keep a prescribed speed."""
    if speeds is not None:
        table = pulleys.table
        for j in speeds.which:
            table[TORQUE, j] = table[INERTIA, j] * table[ALPHA, j]
            table[TORQUE, j] += table[PULLEY_RADIUS, j] * grip(j, slots)


@kernel
def act(laws, motion, room, slots, ax, ay, spin_up):
    """Write the accelerations of the bodies without friction; return the power damped, W."""
    chain = laws.chain
    stretch(chain, motion, room)
    damped = damp_axially(chain, motion, room, laws.axial_damping)
    accelerate(chain, room, ax, ay, spin_up)
    damped += bend(chain, motion, room, spin_up, laws.bending)
    weigh(chain, ax, ay, laws.weight)
    press(motion, slots, laws.contact)
    damped += damp_contact(slots, laws.contact_damping)
    push(slots, 1.0 / chain.mass, ax, ay)
    return damped


@entry
def rates(t, h, state, rate, laws, torques, loads, speeds, room, slots, pulleys):
    """Write the rate of a state: positions, velocities, pulleys' angles, speeds, and energies.

    The state holds the six rows of the motion, the angle of every pulley, the speed of every free
    one, and the energies put in and lost in friction and damping. h is the length of the step, s,
    that a published law asks for.
    """
    pulley, free, per_mass = pulleys.table, pulleys.free, 1.0 / laws.chain.mass
    width, count = room.shape[1], pulley.shape[1]
    velocities = state[3 * width : 6 * width]
    for i in range(3 * width):
        rate[i] = velocities[i]
    angles = 6 * width
    speed, ledger = angles + count, angles + count + len(free)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = state[speed + k]
    prescribe(t, pulleys, speeds)
    load(t, pulleys, torques, loads)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    spin_up = rate[5 * width : 6 * width]
    damped = act(laws, motion_in(state, room), room, slots, ax, ay, spin_up)
    slide(slots, pulleys)
    stick(slots, pulleys, laws.chain.mass, ax, ay, laws.exact)
    rub(slots, pulleys, laws.regularised, laws.creep, h)
    if laws.exact is None and laws.regularised is None:
        turn_freely(slots, pulleys)
    drag(slots, per_mass, ax, ay)
    react(slots, pulleys, speeds)
    rate[ledger] = 0.0
    for j in range(count):
        rate[angles + j] = pulley[SPEED, j]
        rate[ledger] += pulley[TORQUE, j] * pulley[SPEED, j]
    for k in range(len(free)):
        rate[speed + k] = pulley[ALPHA, free[k]]
    rate[ledger + 1] = friction_heat(slots)
    rate[ledger + 2] = damped
