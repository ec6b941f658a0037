"""The forces and couples on a body that turns about a fixed shaft.

A body turns by the angle q. The moment about the axis and the components of a force of size S are

    (M, F_x, F_y) = S (a + b cos q + c sin q)

with three constant vectors a, b, c, whichever of its point and its direction turns with the body. A
cord that leaves the body at a radius pulls in a fixed direction with a constant arm: b = c = 0. The
sizes are numbers, or functions of time, speed or angle; time is the drive of the mechanism.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from math import hypot, inf
from typing import Any, NamedTuple

from frictionsim.mechanisms.single_dof import cos, sin
from frictionsim.scenario.signals import Constant, CubicPiece, Signal
from frictionsim.solvers.mechanism import SwitchingSurface, Value

Triple = tuple[float, float, float]
Size = Callable[[Value, Value, Value], Value]
NONE: Triple = (0.0, 0.0, 0.0)
_ARGUMENT = {"time": 0, "angle": 1, "speed": 2}  # of a function of time, angle and velocity


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
        return Arms(*(_scaled(triple, size) for triple in self))

    def plus(self, other: "Arms") -> "Arms":
        """Return the sum."""
        return Arms(*(_sum(one, two) for one, two in zip(self, other, strict=True)))

    @property
    def slopes(self) -> "Arms":
        """The derivatives over the angle, per rad."""
        return Arms(NONE, self.sine, _scaled(self.cosine, -1.0))

    def at(self, angle: float) -> Triple:
        """Return moment and components per size at an angle, rad."""
        turned = _sum(_scaled(self.cosine, cos(angle)), _scaled(self.sine, sin(angle)))
        return _sum(self.constant, turned)


def _scaled(triple: Triple, size: float) -> Triple:
    return (triple[0] * size, triple[1] * size, triple[2] * size)


def _sum(one: Triple, two: Triple) -> Triple:
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

    def function(self) -> Size:
        """Return the size as a function of time, angle and velocity, of numbers or arrays."""
        signal = self.size
        if self.over == "speed":
            return lambda time, angle, velocity: _at(signal, velocity)
        if self.over == "angle":
            return lambda time, angle, velocity: _at(signal, angle)
        return lambda time, angle, velocity: _at(signal, time)


def _at(signal: Signal, x: Value) -> Value:
    """Return a signal at a number, or at each element of an array."""
    if isinstance(x, float):
        return signal(x)
    import numpy as np  # imported here because `check` does not need it

    return np.array([signal(value) for value in np.ravel(x).tolist()]).reshape(np.shape(x))


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


class Loads:
    """All forces and couples of a scenario.

    Parameters
    ----------
    loads : iterable of Load
    friction_radius : float, m
        Of the static limit.
    """

    def __init__(self, loads: Iterable[Load], friction_radius: float = 0.0) -> None:
        self.constant = Arms()
        self.variable: list[Load] = []
        self._sizes: list[float] = []
        self._force = 0.0
        self._radius = friction_radius
        for load in loads:
            if load.is_constant:
                self.constant = self.constant.plus(load.arms.times(load.size(0.0)))
                self._sizes.append(abs(load.size(0.0)) * self._reach(load.arms))
                self._force += 0.0 if load.arms == COUPLE else abs(load.size(0.0))
            else:
                self.variable.append(load)

    def component(self, i: int) -> Size:
        """Return the sum of the moments (0) or of the components along x (1) or y (2).

        Loads that have none have no term. It is a loop, not a sum of functions: a thousand of them
        would be nested too deep.
        """
        a, b, c = (triple[i] for triple in self.constant)
        terms: list[tuple[Any, ...]] = [
            (_ARGUMENT[load.over], load.size, *(triple[i] for triple in load.arms))
            for load in self.variable
            if any(triple[i] for triple in load.arms)
        ]
        turns = any((b, c)) or any(any(term[3:]) for term in terms)
        if not terms and not turns:
            return lambda time, angle, velocity: a

        def component(time: Value, angle: Value, velocity: Value) -> Value:
            cosine, sine = (cos(angle), sin(angle)) if turns else (0.0, 0.0)
            total = a + b * cosine + c * sine
            arguments: tuple[Any, ...] = time, angle, velocity
            is_number = isinstance(time, float) and isinstance(angle, float)
            for over, size, p, q, r in terms:
                x = arguments[over]
                total += (size(x) if is_number else _at(size, x)) * (p + q * cosine + r * sine)
            return total

        return component

    def scale(self, time: Value, angle: Value) -> Value:
        """Return the sum of the sizes of all terms of moment and limit at rest, N m."""
        total = sum(self._sizes)
        for load in self.variable:
            total = total + abs(load.function()(time, angle, 0.0)) * self._reach(load.arms)
        return total

    def total_force(self, time: float, angle: float) -> float:
        """Return the sum of the sizes of all forces at rest, N."""
        forces = [load for load in self.variable if load.arms != COUPLE]
        return self._force + sum(abs(load.at_rest(time, angle)) for load in forces)

    def _reach(self, arms: Arms) -> float:
        """Return the torque and the limit of a load per size: that of a couple has no limit."""
        is_couple = arms == COUPLE
        return largest_arm(arms) + (0.0 if is_couple else self._radius)

    def rates(self, time: float, angle: float) -> Triple:
        """Return the derivatives of moment and components at rest, N m/s and N/s, after a time."""
        total = NONE
        for load in self.over_time:
            total = _sum(total, _scaled(load.arms.at(angle), load.size.derivative(time)))
        return total

    def slopes(self, time: float, angle: float) -> Triple:
        """Return the derivatives of moment and components over the angle at rest, per rad."""
        total = self.constant.slopes.at(angle)
        for load in self.variable:
            total = _sum(total, _scaled(load.arms.slopes.at(angle), load.at_rest(time, angle)))
            if load.over == "angle":
                total = _sum(total, _scaled(load.arms.at(angle), load.size.derivative(angle)))
        return total

    @property
    def over_time(self) -> list[Load]:
        """The loads whose sizes change over time."""
        return [load for load in self.variable if load.over == "time"]

    @property
    def has_constant_resultant(self) -> bool:
        """Whether the resultant of all forces has a constant size."""
        return not any(any(triple[1:]) for load in self.variable for triple in load.arms) and not (
            any(self.constant.constant[1:]) and any(self.constant.cosine[1:])
        )

    @property
    def turns(self) -> bool:
        """Whether a moment or a component of a force depends on the angle of the body."""
        if any(self.constant.cosine) or any(self.constant.sine):
            return True
        return any(
            load.over == "angle" or any(load.arms.cosine) or any(load.arms.sine)
            for load in self.variable
        )

    def surfaces(self) -> tuple[SwitchingSurface, ...]:
        """Return where the slopes of sizes over speed or angle jump."""
        surfaces = []
        for load in self.variable:
            if load.over != "time":
                surfaces += [_surface_at(piece.knot, load.over) for piece in load.size.pieces()[1:]]
        return tuple(surfaces)


def largest_arm(arms: Arms) -> float:
    """Return the largest arm over a turn; the largest moment of a couple of size 1."""
    return abs(arms.constant[0]) + hypot(arms.cosine[0], arms.sine[0])


def _surface_at(knot: float, over: str) -> SwitchingSurface:
    if over == "speed":
        return SwitchingSurface(lambda angle, velocity: velocity - knot, is_of_table=True)
    return SwitchingSurface(lambda angle, velocity: angle - knot, is_of_table=True)


class Elapsed:
    """Time as the drive of a mechanism on which several signals act.

    Parameters
    ----------
    signals : sequence of Signal
        Steps end at their discontinuities.
    """

    def __init__(self, signals: Sequence[Signal]) -> None:
        self.signals = signals

    def __call__(self, t: float) -> float:
        return t

    def derivative(self, t: float) -> float:
        return 1.0

    def next_discontinuity(self, t: float) -> float:
        return min((signal.next_discontinuity(t) for signal in self.signals), default=inf)

    next_extremum = next_discontinuity

    def pieces(self) -> list[CubicPiece]:
        return [CubicPiece(0.0, 0.0, 1.0)]

    def harmonic(self) -> Any:
        return None


def largest_curvature(signal: Signal) -> Callable[[float, float], float]:
    """Return a bound of the second derivative of a signal between two times, per s^2.

    Between the times its pieces have no end.
    """
    pieces, harmonic = signal.pieces(), signal.harmonic()
    knots = [piece.knot for piece in pieces[1:]]
    wave = 0.0 if harmonic is None else abs(harmonic.amplitude) * harmonic.angular_frequency**2

    def bound(begin: float, end: float) -> float:
        piece = pieces[bisect_right(knots, begin)]
        ends = (abs(2.0 * piece.c2 + 6.0 * piece.c3 * (t - piece.knot)) for t in (begin, end))
        return wave + (max(ends) if piece.c2 or piece.c3 else 0.0)

    return bound


def middle_and_range(signal: Signal) -> Callable[[float, float], tuple[float, float]]:
    """Return a function of two times: a middle value of a signal between them, and a bound.

    The signal differs from the middle value by no more than the bound. Between the times its
    pieces have no end.
    """
    pieces, harmonic = signal.pieces(), signal.harmonic()
    knots = [piece.knot for piece in pieces[1:]]
    wave = 0.0 if harmonic is None else abs(harmonic.amplitude)
    curvature = largest_curvature(signal) if harmonic is None else None

    def middle_and_bound(begin: float, end: float) -> tuple[float, float]:
        piece = pieces[bisect_right(knots, begin)]
        first, last = (_value(piece, t - piece.knot) for t in (begin, end))
        length = end - begin
        bend = 0.0 if curvature is None else curvature(begin, end) * length * length / 8.0
        return 0.5 * (first + last), 0.5 * abs(last - first) + bend + wave

    return middle_and_bound


def _value(piece: CubicPiece, x: float) -> float:
    return piece.c0 + x * (piece.c1 + x * (piece.c2 + x * piece.c3))
