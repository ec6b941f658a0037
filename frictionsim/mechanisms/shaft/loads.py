"""The forces and couples on a body that turns about a fixed shaft.

A body turns by the angle q. The moment about the axis and the components of a force of size S are

    (M, F_x, F_y) = S (a + b cos q + c sin q)

with three constant vectors a, b, c, whichever of its point and its direction turns with the body. A
cord that leaves the body at a radius pulls in a fixed direction with a constant arm: b = c = 0. The
sizes are numbers, or functions of time, speed or angle; time is the drive of the mechanism.
"""

from array import array
from collections.abc import Iterable
from math import hypot, inf
from typing import Any, NamedTuple

from frictionsim.mechanisms.single_dof import cos, sin
from frictionsim.scenario.signals import Constant, CubicPiece, Signal
from frictionsim.solvers.compilation import compilable, compiled_as
from frictionsim.solvers.mechanism import Value

Triple = tuple[float, float, float]
NONE: Triple = (0.0, 0.0, 0.0)


class Arms(NamedTuple):
    """Moment and components per size: a + b cos q + c sin q; m, 1, 1.

    Attributes
    ----------
    constant, cosine, sine : (float, float, float)
    """

    constant: Triple = NONE
    cosine: Triple = NONE
    sine: Triple = NONE

    def times(self, size: float) -> "Arms":
        """Return moment and components of a size, N m, N, N."""
        return Arms(*(scaled(triple, size) for triple in self))

    def plus(self, other: "Arms") -> "Arms":
        """Return the sum."""
        return Arms(*(sum_of(one, two) for one, two in zip(self, other, strict=True)))

    @property
    def slopes(self) -> "Arms":
        """The derivatives over the angle, per rad."""
        return Arms(NONE, self.sine, scaled(self.cosine, -1.0))

    @property
    def turn(self) -> bool:
        """Whether they depend on the angle."""
        return any(self.cosine) or any(self.sine)

    def at(self, angle: Value) -> Triple:
        """Return moment and components per size at an angle, rad."""
        turned = sum_of(scaled(self.cosine, cos(angle)), scaled(self.sine, sin(angle)))
        return sum_of(self.constant, turned)


@compilable
def scaled(triple: Triple, size: Value) -> Triple:
    """Return a multiple of a triple."""
    return (triple[0] * size, triple[1] * size, triple[2] * size)


@compilable
def sum_of(one: Triple, two: Triple) -> Triple:
    """Return the sum of two triples."""
    return (one[0] + two[0], one[1] + two[1], one[2] + two[2])


class Load(NamedTuple):
    """A force or couple.

    Attributes
    ----------
    arms : Arms
    size : Constant, Signal, or PiecewiseLinear of speed or angle
        N, or N m of a couple.
    over : {"time", "speed", "angle"}
        What the size is a function of.
    """

    arms: Arms
    size: Signal
    over: str = "time"

    @property
    def is_constant(self) -> bool:
        """Whether the size is a number."""
        return isinstance(self.size, Constant)

    def at_rest(self, time: float, angle: float) -> float:
        """Return the size at rest, N or N m."""
        return self.size({"time": time, "speed": 0.0, "angle": angle}[self.over])

    def over_samples(self, time: Any, angle: Any, velocity: Any) -> Any:
        """Return the size at each of some samples, (n,)."""
        import numpy as np  # imported here because `check` does not need it

        x = {"time": time, "speed": velocity, "angle": angle}[self.over]
        return np.array([self.size(value) for value in x.tolist()])


class Turning(NamedTuple):
    """Whether direction and point of a force turn with the body."""

    direction: bool
    point: bool


def arms_of_force(unit: Any, point: Any, turning: Turning) -> Arms:
    """Return moment and components of a force per size, in numbers of any type.

    With a point p and a unit direction d at q = 0, and J a quarter turn,

        both fixed     M = p x d
        both turn      M = p x d,                          F = d cos q + J d sin q
        point turns    M = (p x d) cos q - (p . d) sin q
        direction      M = (p x d) cos q + (p . d) sin q,  F = d cos q + J d sin q
    """
    (x, y), (p_x, p_y) = unit, point
    across = p_x * y - p_y * x
    along = p_x * x + p_y * y
    if not turning.direction:
        if not turning.point:
            return Arms((across, x, y))
        return Arms((0.0, x, y), (across, 0.0, 0.0), (-along, 0.0, 0.0))
    if turning.point:
        return Arms((across, 0.0, 0.0), (0.0, x, y), (0.0, -y, x))
    return Arms(NONE, (across, x, y), (along, -y, x))


def arms_of_weight(radius: float, azimuth: float) -> Arms:
    """Return the arms of a weight on the body, at a radius, m, and an azimuth at q = 0, rad."""
    x, y = radius * cos(azimuth), radius * sin(azimuth)
    return Arms((0.0, 0.0, -1.0), (-x, 0.0, 0.0), (y, 0.0, 0.0))


COUPLE = Arms((1.0, 0.0, 0.0))


def largest_arm(arms: Arms) -> float:
    """Return the largest arm over a turn; the largest moment of a couple of size 1."""
    return abs(arms.constant[0]) + hypot(arms.cosine[0], arms.sine[0])


# A row of the table of loads: what the size is a function of; its first cubic piece and the end of
# its pieces; its harmonic; torque and limit per size; the arms.
OVER, FIRST, END, AMPLITUDE, FREQUENCY, PHASE, REACH, A = range(8)
B, C, ROW = A + 3, A + 6, A + 9
TIME, ANGLE, SPEED = 0.0, 1.0, 2.0
PIECE = 5  # knot and four coefficients


class Loads(NamedTuple):
    """All forces and couples; the drive of the body is the time.

    The moment of an eccentric mass is a term of its own (`equation.EccentricWeight`).

    Attributes
    ----------
    constant : Arms, N m, N, N
        The sum of those of constant size.
    scale : float, N m
        The sum of torques and limits of those of constant size.
    rows : array
        A row for each of the others.
    pieces : array
        The cubic pieces of their sizes (`frictionsim.scenario.signals.CubicPiece`).
    """

    constant: Arms
    scale: float
    rows: "array[float]"
    pieces: "array[float]"

    def at(self, t: float) -> float:
        """Return the time."""
        return t

    def next_extremum(self, t: float) -> float:
        """Return the next time after t, s, at which a derivative of a size jumps."""
        rows, until = self.rows, inf
        for k in range(0, len(rows), ROW):
            if rows[k + OVER] == TIME:
                following = piece_number(self.pieces, rows[k + FIRST], rows[k + END], t) + 1
                if following < rows[k + END]:
                    until = min(until, self.pieces[PIECE * following])
        return until

    def resultant(
        self, time: Value, angle: Value, velocity: Value
    ) -> tuple[Value, Value, Value, Value, Value]:
        """Return the moment, N m, the components of the force, N, cosine and sine of the angle."""
        (m, x, y), (m_c, x_c, y_c), (m_s, x_s, y_s) = self.constant
        rows, pieces, c, s = self.rows, self.pieces, cos(angle), sin(angle)
        m, x, y = m + m_c * c + m_s * s, x + x_c * c + x_s * s, y + y_c * c + y_s * s
        for k in range(0, len(rows), ROW):
            size = size_of(rows, pieces, k, time, angle, velocity)
            m = m + size * (rows[k + A] + rows[k + B] * c + rows[k + C] * s)
            x = x + size * (rows[k + A + 1] + rows[k + B + 1] * c + rows[k + C + 1] * s)
            y = y + size * (rows[k + A + 2] + rows[k + B + 2] * c + rows[k + C + 2] * s)
        return m, x, y, c, s

    def rates(self, time: float, angle: float) -> Triple:
        """Return the derivatives of moment and components at rest, N m/s and N/s, after a time."""
        total = NONE
        for k in range(0, len(self.rows), ROW):
            if self.rows[k + OVER] == TIME:
                rate = rate_of(self, k, time)
                total = sum_of(total, scaled(arms_in(self.rows, k).at(angle), rate))
        return total

    def sizes(self, time: Value, angle: Value) -> Value:
        """Return the sum of torques and limits of all loads at rest, N m."""
        total = self.scale
        for k in range(0, len(self.rows), ROW):
            total = (
                total
                + abs(size_of(self.rows, self.pieces, k, time, angle, 0.0)) * self.rows[k + REACH]
            )
        return total


@compilable
def arms_in(rows: Any, k: int) -> Arms:
    """Return the arms of a row that begins at k."""
    return Arms(
        (rows[k + A], rows[k + A + 1], rows[k + A + 2]),
        (rows[k + B], rows[k + B + 1], rows[k + B + 2]),
        (rows[k + C], rows[k + C + 1], rows[k + C + 2]),
    )


@compilable
def _size(rows: Any, pieces: Any, k: int, time: float, angle: float, velocity: float) -> float:
    over = rows[k + OVER]
    x = time if over == TIME else angle if over == ANGLE else velocity
    i = PIECE * piece_number(pieces, rows[k + FIRST], rows[k + END], x)
    z = x - pieces[i]
    size: float = pieces[i + 1] + z * (pieces[i + 2] + z * (pieces[i + 3] + z * pieces[i + 4]))
    if rows[k + AMPLITUDE] != 0.0:
        size += rows[k + AMPLITUDE] * sin(rows[k + FREQUENCY] * x + rows[k + PHASE])
    return size


@compiled_as(_size)
def size_of(rows: Any, pieces: Any, k: int, time: Value, angle: Value, velocity: Value) -> Value:
    """Return the size of the load whose row begins at k, N or N m, of numbers or arrays."""
    if isinstance(time, float) and isinstance(angle, float) and isinstance(velocity, float):
        return _size(rows, pieces, k, time, angle, velocity)
    import numpy as np  # imported here because `check` does not need it

    x = np.asarray((time, angle, velocity)[int(rows[k + OVER])])
    table = np.asarray(pieces).reshape(-1, PIECE)[int(rows[k + FIRST]) : int(rows[k + END])]
    at_x = table[np.searchsorted(table[1:, 0], x, side="right")]
    knot, c0, c1, c2, c3 = np.moveaxis(at_x, -1, 0)
    z = x - knot
    wave = rows[k + AMPLITUDE] * np.sin(rows[k + FREQUENCY] * x + rows[k + PHASE])
    return c0 + z * (c1 + z * (c2 + z * c3)) + wave


@compilable
def rate_of(loads: Loads, k: int, time: float) -> float:
    """Return the derivative over time of the size of a load, after a time."""
    rows = loads.rows
    knot, _, c1, c2, c3 = piece_at(loads.pieces, rows[k + FIRST], rows[k + END], time)
    z, frequency = time - knot, rows[k + FREQUENCY]
    wave = rows[k + AMPLITUDE] * frequency * cos(frequency * time + rows[k + PHASE])
    return c1 + z * (2.0 * c2 + z * (3.0 * c3)) + wave


@compilable
def largest_curvature(loads: Loads, k: int, begin: float, end: float) -> float:
    """Return a bound of the second derivative of a size between two times, per s^2.

    Between the times its pieces have no end.
    """
    rows = loads.rows
    wave = abs(rows[k + AMPLITUDE]) * rows[k + FREQUENCY] * rows[k + FREQUENCY]
    return wave + _bend(piece_at(loads.pieces, rows[k + FIRST], rows[k + END], begin), begin, end)


@compilable
def _bend(piece: Any, begin: float, end: float) -> float:
    knot, _, _, c2, c3 = piece
    if c2 == 0.0 and c3 == 0.0:  # also up to infinity
        return 0.0
    return max(abs(2.0 * c2 + 6.0 * c3 * (begin - knot)), abs(2.0 * c2 + 6.0 * c3 * (end - knot)))


@compilable
def middle_and_range(loads: Loads, k: int, begin: float, end: float) -> tuple[float, float]:
    """Return a middle value of a size between two times, and a bound.

    The size differs from the middle value by no more than the bound. Between the times its pieces
    have no end.
    """
    rows = loads.rows
    piece = piece_at(loads.pieces, rows[k + FIRST], rows[k + END], begin)
    knot, c0, c1, c2, c3 = piece
    y, z, length = begin - knot, end - knot, end - begin
    first, last = c0 + y * (c1 + y * (c2 + y * c3)), c0 + z * (c1 + z * (c2 + z * c3))
    bound = 0.5 * abs(last - first) + abs(rows[k + AMPLITUDE])
    return 0.5 * (first + last), bound + _bend(piece, begin, end) * length * length / 8.0


@compilable
def piece_number(pieces: Any, first: float, end: float, x: float) -> int:
    """Return the number of the piece at x, of those from first up to end."""
    return first_above(pieces, PIECE, int(first) + 1, int(end), x) - 1


@compilable
def first_above(values: Any, stride: int, low: int, high: int, x: float) -> int:
    """Return the first i from low on with values[stride i] > x, in ascending order, or high."""
    while low < high:
        middle = (low + high) // 2
        if x < values[stride * middle]:
            high = middle
        else:
            low = middle + 1
    return low


@compilable
def piece_at(pieces: Any, first: float, end: float, x: float) -> Any:
    """Return knot and coefficients of the piece at x."""
    i = PIECE * piece_number(pieces, first, end, x)
    return pieces[i], pieces[i + 1], pieces[i + 2], pieces[i + 3], pieces[i + 4]


class Elapsed(NamedTuple):
    """Time as the drive of a mechanism on which several signals act; steps end where they jump."""

    signals: tuple[Signal, ...]

    def __call__(self, t: float) -> float:
        return t

    def derivative(self, t: float) -> float:
        """Return 1."""
        return 1.0

    def next_discontinuity(self, t: float) -> float:
        """Return the first time after t, s, at which a derivative of a signal jumps."""
        return min((signal.next_discontinuity(t) for signal in self.signals), default=inf)

    def next_extremum(self, t: float) -> float:
        """Return the same time."""
        return self.next_discontinuity(t)

    def pieces(self) -> list[CubicPiece]:
        """Return the time as a cubic piece."""
        return [CubicPiece(0.0, 0.0, 1.0)]

    def harmonic(self) -> None:
        """Return none."""


class TableKnots(NamedTuple):
    """The switching surface at which the slope of a size over angle or speed jumps.

    Attributes
    ----------
    knots : array
        The angles, rad, then the speeds, rad/s, each in ascending order.
    angles : int
        The number of angles.
    """

    knots: "array[float]"
    angles: int
    event: str = ""
    is_event: bool = False
    is_of_table: bool = True

    def beyond(self, q0: float, v0: float, q1: float, q: float, v: float) -> float:
        """Return a number that is positive beyond the first knot after (q0, v0)."""
        knots, angles = self.knots, self.angles
        return max(
            _beyond_next(knots, 0, angles, q0, q), _beyond_next(knots, angles, len(knots), v0, v)
        )


@compilable
def _beyond_next(knots: Any, begin: int, end: int, x0: float, x: float) -> float:
    """Return how far x is beyond the next knot above or below x0."""
    above, beyond = first_above(knots, 1, begin, end, x0), -inf
    below = above - 1
    if below >= begin and knots[below] == x0:
        below -= 1
    if above < end:
        beyond = x - knots[above]
    if below >= begin:
        beyond = max(beyond, knots[below] - x)
    return beyond


def loads_in(loads: Iterable[Load], friction_radius: float) -> Loads:
    """Return loads as one table.

    Parameters
    ----------
    loads : iterable of Load
    friction_radius : float, m
        Of the static limit; 0 without dry friction.
    """
    constant, scale, rows, pieces = Arms(), 0.0, array("d"), array("d")
    for load in loads:
        reach = reach_of(load.arms, friction_radius)
        if load.is_constant:
            size = load.size(0.0)
            constant, scale = constant.plus(load.arms.times(size)), scale + abs(size) * reach
            continue
        first, own = len(pieces) // PIECE, load.size.pieces()
        wave = load.size.harmonic() or (0.0, 0.0, 0.0)
        over = {"time": TIME, "angle": ANGLE, "speed": SPEED}[load.over]
        rows.extend((over, first, first + len(own), *wave, reach))
        rows.extend(number for triple in load.arms for number in triple)
        pieces.extend(number for piece in own for number in piece)
    return Loads(constant, scale, rows, pieces)


def reach_of(arms: Arms, friction_radius: float) -> float:
    """Return the torque and the limit of a load per size: that of a couple has no limit."""
    return largest_arm(arms) + (0.0 if arms == COUPLE else friction_radius)


def knots_of(loads: Iterable[Load]) -> tuple[TableKnots, ...]:
    """Return where the slopes of sizes over angle or speed jump; none if there are no tables."""
    knots: dict[str, set[float]] = {"angle": set(), "speed": set(), "time": set()}
    for load in loads:
        knots[load.over].update(piece.knot for piece in load.size.pieces()[1:])
    angles, speeds = sorted(knots["angle"]), sorted(knots["speed"])
    return (TableKnots(array("d", angles + speeds), len(angles)),) if angles or speeds else ()
