"""The arrays of a belt drive, in SI units, and what acts in it, as one argument of the kernels.

A row over the bodies or joints is `width` long: the bodies, a copy of the first joint behind the
last one, in the place of an index that wraps around, and zeros up to a multiple of what a vector
instruction takes.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel

if TYPE_CHECKING:
    from frictionsim.scenario.signals import Signal

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Bodies = NDArray[np.uint64]  # an index that is never negative needs no check

SIMD_WIDTH = 8  # numbers of double precision in the widest vector

# Rows of the kinematics, (6, width): positions and velocities of all bodies, m, rad, m/s, rad/s.
X, Y, ANGLE, VX, VY, SPIN = range(6)
KINEMATIC_ROWS = 6
# Of a guided string, (2, width): positions along its line and velocities, m and m/s.
POSITION, VELOCITY = range(2)
STRING_ROWS = 2

# Rows of the workspace, (8, width), over bodies or joints: the directions of the bodies; the force
# of joint k on body k - 1, N, and the part of its damper; the angle that a joint is bent by, rad,
# and its rate, rad/s.
COS, SIN, FORCE_X, FORCE_Y, DAMPER_X, DAMPER_Y, BEND, BEND_RATE = range(8)
WORKSPACE_ROWS = 8
# Of a guided string, (3, width): tension of joint k, N, and the middle between its bodies, m; and
# accelerations across the belt, which are zero.
TENSION, MIDDLE, ACROSS = range(3)
STRING_WORKSPACE_ROWS = 3

# Rows of the pulleys' table, (8, pulleys): where a pulley is and its radius, m, and its inertia,
# kg m^2; what it does now: angular velocity and acceleration, rad/s and rad/s^2, the torque on it
# from outside, N m, and what its angular velocity was at the start of a fixed step.
PULLEY_X, PULLEY_Y, PULLEY_RADIUS, INERTIA, SPEED, ALPHA, TORQUE, SPEED_OLD = range(8)
PULLEY_ROWS = 8

# Rows of the contacts' table, (21, contacts): centre and radius of the pulley, m, with a radius of
# zero where there is no contact;
CENTRE_X, CENTRE_Y, RADIUS = range(3)
# of a guided string, instead of the centre, where the arc begins along the belt and its length, m;
ARC_START, ARC_LENGTH = CENTRE_X, CENTRE_Y
# coefficients of friction at rest and sliding, and those in force for T > 0 and for T < 0;
STATIC, KINETIC, FORWARD, BACKWARD = range(3, 7)
# the unit vector n and 1/r, and the velocity of the body, m/s;
NX, NY, INV_DISTANCE, BODY_VX, BODY_VY = range(7, 12)
# the normal force N; the bounds of T > 0 and of T < 0, N or N s; the slip, m/s; the bias of the
# force that sticking needs, m (R x + bias); T; 1 where T is within its bounds, else 0; and the
# mode, 0 where the static coefficient holds, else the direction of the slip;
NORMAL, FORWARD_LIMIT, BACKWARD_LIMIT, SLIP, STICK_BIAS, FRICTION, STICKING, MODE = range(12, 20)
# and by how much v . t, m/s, grows from the middle of a fixed step to its end as t turns.
RIM_TURN = 20
CONTACT_ROWS = 21

# Energies at the end of the state, J.
INPUT_ENERGY, FRICTION_HEAT, DAMPING_HEAT = range(3)
N_ENERGIES = 3


class BodyRows(NamedTuple):
    """The rows of the kinematics by name, (width,) each: m, rad, m/s, rad/s."""

    x: Array
    y: Array
    angle: Array
    vx: Array
    vy: Array
    spin: Array


@inline_kernel
def body_rows(kinematics: Array) -> BodyRows:
    """Return the rows of the kinematics by name."""
    return BodyRows(
        kinematics[X],
        kinematics[Y],
        kinematics[ANGLE],
        kinematics[VX],
        kinematics[VY],
        kinematics[SPIN],
    )


class Accelerations(NamedTuple):
    """The accelerations of bodies, (width,) each: m/s^2 and rad/s^2."""

    x: Array
    y: Array
    angle: Array


class ContactRows(NamedTuple):
    """The rows of the contacts' table by name, (contacts,) each, in the units of `kernels.system`.

    Loops take rows one by one: that these do not overlap is known, of parts of a table it is not.
    """

    centre_x: Array
    centre_y: Array
    radius: Array
    static: Array
    kinetic: Array
    forward: Array
    backward: Array
    nx: Array
    ny: Array
    inv_distance: Array
    vx: Array
    vy: Array
    normal: Array
    forward_limit: Array
    backward_limit: Array
    slip: Array
    stick_bias: Array
    friction: Array
    sticking: Array
    mode: Array
    rim_turn: Array


@inline_kernel
def contact_rows(table: Array) -> ContactRows:
    """Return the rows of the table of contacts by name."""
    return ContactRows(
        table[CENTRE_X],
        table[CENTRE_Y],
        table[RADIUS],
        table[STATIC],
        table[KINETIC],
        table[FORWARD],
        table[BACKWARD],
        table[NX],
        table[NY],
        table[INV_DISTANCE],
        table[BODY_VX],
        table[BODY_VY],
        table[NORMAL],
        table[FORWARD_LIMIT],
        table[BACKWARD_LIMIT],
        table[SLIP],
        table[STICK_BIAS],
        table[FRICTION],
        table[STICKING],
        table[MODE],
        table[RIM_TURN],
    )


class StateLayout(NamedTuple):
    """The parts of a state vector, and of its rate, one behind the other.

    The rows of the kinematics; the angle of every pulley, rad; the speed of every free one, rad/s;
    the energies put in and lost in friction and damping, J.

    Attributes
    ----------
    bodies, width : int
        Of a row.
    velocities : int
        Where the second half of the kinematics begins.
    angles, speeds, energies, end : int
        Where each part begins; `end` is the first number that belongs to none.
    size : int
        Of the vector: `end`, up to a multiple of what a vector instruction takes.
    """

    bodies: int
    width: int
    velocities: int
    angles: int
    speeds: int
    energies: int
    end: int
    size: int


def state_layout(
    bodies: int, pulleys: int, free: int, kinematic_rows: int = KINEMATIC_ROWS
) -> StateLayout:
    """Return the layout for so many bodies and pulleys, of which so many are free."""
    width = padded_width(bodies)
    angles = kinematic_rows * width
    speeds = angles + pulleys
    energies = speeds + free
    end = energies + N_ENERGIES
    return StateLayout(
        bodies, width, angles // 2, angles, speeds, energies, end, end + -end % SIMD_WIDTH
    )


def padded_width(bodies: int) -> int:
    """Return the length of a row over the joints, in full vectors.

    One vector more than the bodies fill: a loop over them in full vectors finds the joint behind.
    """
    return (-(-bodies // SIMD_WIDTH) + 1) * SIMD_WIDTH


def aligned_zeros(rows: int, width: int) -> Array:
    """Return zeros that begin where the widest vector is loaded fastest."""
    spare = np.zeros(rows * width + SIMD_WIDTH)
    offset = -spare.ctypes.data // spare.itemsize % SIMD_WIDTH
    return spare[offset : offset + rows * width].reshape(rows, width)


def zero_state(layout: StateLayout) -> Array:
    """Return a state vector of zeros, or a rate."""
    zeros: Array = aligned_zeros(1, layout.size)[0]
    return zeros


def kinematics_of(state: Array, layout: StateLayout) -> Array:
    """Return the kinematics that a state, or its rate, begins with: a view, (rows, width)."""
    return state[: layout.angles].reshape(-1, layout.width)


@inline_kernel
def full_vectors(size: int) -> int:
    """Return a length up to full vectors: a loop so long has no numbers left over at its end.

    Rows of bodies have room for it. What it writes behind the last body means nothing; the
    accelerations there are cleared by `clear_padding`.
    """
    return (size + SIMD_WIDTH - 1) // SIMD_WIDTH * SIMD_WIDTH


@inline_kernel
def clear_padding(bodies: int, ax: Array, ay: Array, aphi: Array) -> None:
    """Clear the accelerations behind the last body, so that nothing there ever moves."""
    for k in range(bodies, full_vectors(bodies)):
        ax[k] = ay[k] = aphi[k] = 0.0


@inline_kernel
def copy(source: Array, target: Array) -> None:
    """Copy an array; a slice would be looked at for overlaps first, which takes longer."""
    for i in range(len(source)):
        target[i] = source[i]


# --- signals that drive pulleys -----------------------------------------------------------------

# What a signal gives: a torque, N m, over time or over the speed of the pulley; a speed, rad/s.
TORQUE_OVER_TIME, TORQUE_OVER_SPEED, SPEED_OVER_TIME = range(3)


class Signals(NamedTuple):
    """The signals of a drive, one in a row; those of one pulley add.

    All drives are of one type, whatever signals they have, so that kernels are compiled once for
    all: a row is a sum of cubic pieces and a harmonic, of amplitude zero where it has none.

    Attributes
    ----------
    pulleys, kinds : (rows,)
        The pulley that a signal drives, and TORQUE_OVER_TIME, TORQUE_OVER_SPEED or SPEED_OVER_TIME.
    offsets : (rows + 1,)
        The pieces of row k are offsets[k] to offsets[k + 1] - 1; the first has no lower end.
    pieces : (pieces, 5)
        Knot and c0 to c3 of c0 + c1 (u - knot) + ... over time or speed u, from each knot on.
    harmonics : (rows, 3)
        Amplitude, angular frequency, rad/s, and phase, rad.
    """

    pulleys: Indices
    kinds: Indices
    offsets: Indices
    pieces: Array
    harmonics: Array


def stack_signals(rows: "Sequence[tuple[int, int, Signal]]") -> Signals:
    """Return the signals of pulleys as one, from the index of a pulley, the kind and the signal."""
    pieces = [signal.pieces for *_, signal in rows]
    harmonics = [signal.harmonic or (0.0, 0.0, 0.0) for *_, signal in rows]
    return Signals(
        np.array([pulley for pulley, *_ in rows], dtype=np.int64),
        np.array([kind for _, kind, _ in rows], dtype=np.int64),
        np.cumsum([0, *map(len, pieces)], dtype=np.int64),
        np.array([piece for signal_pieces in pieces for piece in signal_pieces]).reshape(-1, 5),
        np.array(harmonics).reshape(-1, 3),
    )


@inline_kernel
def find_piece(signals: Signals, k: int, u: float) -> tuple[float, float, float, float, float]:
    """Return the piece of signal k at u: knot and coefficients."""
    low, high = signals.offsets[k], signals.offsets[k + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if signals.pieces[middle, 0] <= u:
            low = middle
        else:
            high = middle
    p = signals.pieces[low]
    return p[0], p[1], p[2], p[3], p[4]


@inline_kernel
def value(signals: Signals, k: int, u: float) -> float:
    """Return the value of signal k at u."""
    knot, c0, c1, c2, c3 = find_piece(signals, k, u)
    x = u - knot
    signal = c0 + x * (c1 + x * (c2 + x * c3))
    amplitude, frequency, phase = signals.harmonics[k]
    if amplitude != 0.0:
        signal += amplitude * np.sin(frequency * u + phase)
    return signal


@inline_kernel
def derivative(signals: Signals, k: int, u: float) -> float:
    """Return the derivative of signal k at u."""
    knot, _, c1, c2, c3 = find_piece(signals, k, u)
    x = u - knot
    slope = c1 + x * (2.0 * c2 + x * 3.0 * c3)
    amplitude, frequency, phase = signals.harmonics[k]
    if amplitude != 0.0:
        slope += amplitude * frequency * np.cos(frequency * u + phase)
    return slope


# --- the system ---------------------------------------------------------------------------------


class Chain(NamedTuple):
    """The data that all bodies and joints share.

    Attributes
    ----------
    bodies : int
    length, mass, inertia : float, m, kg, kg m^2
        Of a body.
    total_turning : float, rad
        By which the belt turns in one round, 2 pi or -2 pi.
    """

    bodies: int
    length: float
    mass: float
    inertia: float
    total_turning: float


class Pulleys(NamedTuple):
    """The pulleys: the indices of those whose speed is free, and of those where it is prescribed.

    `table` is (8, pulleys).
    """

    free: Indices
    prescribed: Indices
    table: Array


class WrapFactors(NamedTuple):
    """The wrap factors of a state.

    Attributes
    ----------
    factor : (contacts,)
        kappa of the body of each candidate.
    mass_ratio : (contacts,)
        1/kappa^2, of the mass that yields to friction over that of the body.
    """

    factor: Array
    mass_ratio: Array


class Contacts(NamedTuple):
    """The candidates for a contact, bodies near pulleys.

    Those of pulley j are offsets[j] to offsets[j + 1] - 1, in blocks of neighbours: each block is a
    vector of the rows over bodies. Those of no radius, which touch nothing, fill the blocks up, so
    that loops over contacts have no branch.

    `offsets` is (pulleys + 1,), `body` (contacts,), `table` (21, contacts); `saved_modes`,
    (2, width), has mode and sticking of the bodies during a new search; `release`, (1,), is the
    largest deficit of a friction below its static limit when a body let go, over that limit;
    `wrap` has the wrap factors, None where the slip is that of the bodies' centres.
    """

    offsets: Indices
    body: Bodies
    table: Array
    saved_modes: Array
    release: Array
    wrap: WrapFactors | None


class FrictionCoefficients(NamedTuple):
    """Coefficients of friction of every body at every pulley, (pulleys, n): static and kinetic."""

    static: Array
    kinetic: Array


class Plane(NamedTuple):
    """Bodies that move in the plane: those nearer to a rim than `skin`, m, may touch it."""

    skin: float


class PitchLine(NamedTuple):
    """The line that a guided string moves along.

    Attributes
    ----------
    length : float, m
    starts, arcs : (pulleys,), m
        Where the arc of each pulley begins, from where the belt leaves the first pulley, and its
        length.
    senses : (pulleys,)
        +1 where the belt passes a pulley counter-clockwise, else -1.
    runs : (4, runs)
        Runs of candidates, with the rows of `kernels.string`.
    run_count : (1,)
    """

    length: float
    starts: Array
    arcs: Array
    senses: Array
    runs: Indices
    run_count: Indices


class System(NamedTuple):
    """A belt drive as its kernels see it.

    Attributes
    ----------
    layout : StateLayout
    chain : Chain
        What the bodies have in common.
    effects : named tuple
        The parameters of each effect by its name, None where the scenario lacks it: a kernel that
        finds None is compiled to nothing at all.
    friction : FrictionCoefficients or None
    signals : Signals
        What drives the pulleys.
    workspace : (8, width), of a guided string (3, width)
    contacts : Contacts
    pulleys : Pulleys
    kinematics : Plane or PitchLine
        How the belt can move: kernels of this argument differ by its class.
    """

    layout: StateLayout
    chain: Chain
    effects: Any
    friction: FrictionCoefficients | None
    signals: Signals
    workspace: Array
    contacts: Contacts
    pulleys: Pulleys
    kinematics: Any
