"""The forces and couples on a body that turns about a fixed shaft.

A body turns by the angle q. The moment about the axis and the components of a force of size S are

    (M, F_x, F_y) = S (a + b cos q + c sin q)

with three constant vectors a, b, c, whichever of its point and its direction turns with the body. A
cord that leaves the body at a radius pulls in a fixed direction with a constant arm: b = c = 0. The
sizes are numbers, or functions of time, speed or angle.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from math import cos, hypot, inf, sin
from typing import Any, NamedTuple

from frictionsim.scenario.signals import Constant, Signal

Triple = tuple[float, float, float]
NONE: Triple = (0.0, 0.0, 0.0)
TIME, ANGLE, SPEED = "time", "angle", "speed"


class Arms(NamedTuple):
    """Moment and components per size, m, 1, 1: constant + cosine cos q + sine sin q."""

    constant: Triple = NONE
    cosine: Triple = NONE
    sine: Triple = NONE

    @property
    def turn(self) -> bool:
        """Whether they depend on the angle."""
        return any(self.cosine) or any(self.sine)

    @property
    def is_force(self) -> bool:
        """Whether they load the shaft; a couple does not."""
        return any(any(triple[1:]) for triple in self)

    @property
    def moments(self) -> "Arms":
        """Those without the force."""
        return Arms(*((moment, 0.0, 0.0) for moment, _, _ in self))

    @property
    def largest(self) -> float:
        """The largest arm over a turn; the largest moment of a couple of size 1."""
        return abs(self.constant[0]) + hypot(self.cosine[0], self.sine[0])

    def at(self, angle: float) -> Triple:
        """Return moment and components per size at an angle, rad."""
        c, s = cos(angle), sin(angle)
        m, x, y = (a + (b * c + d * s) for a, b, d in zip(*self, strict=True))
        return m, x, y


class Load(NamedTuple):
    """A force or couple.

    Attributes
    ----------
    arms : Arms
    size : Constant, Signal, or another function of speed or angle
        N, or N m of a couple.
    over : {"time", "speed", "angle"}
        What the size is a function of.
    """

    arms: Arms
    size: Any
    over: str = TIME

    @property
    def is_constant(self) -> bool:
        """Whether the size is a number."""
        return isinstance(self.size, Constant)

    def at_rest(self, time: float, angle: float) -> float:
        """Return the size at rest, N or N m."""
        of = time if self.over == TIME else angle if self.over == ANGLE else 0.0
        size: float = self.size(of)
        return size


def carried(parts: Iterable[Any], normal_load: float | None, constant: Any) -> list[Any]:
    """Return the loads or terms that act on a body with their friction.

    A constant normal load, N, stands for all forces: they keep their moments, and a force through
    the axis, `constant(arms, size)`, has the friction.
    """
    if normal_load is None:
        return list(parts)
    moments = [part._replace(arms=part.arms.moments) for part in parts]
    return [*moments, constant(THROUGH_AXIS, normal_load)]


def arms_of_force(
    unit: Sequence[float], point: Sequence[float], direction_turns: bool, point_turns: bool
) -> Arms:
    """Return moment and components of a force per size.

    With a point p and a unit direction d at q = 0, and J a quarter turn,

        both fixed     M = p x d
        both turn      M = p x d,                          F = d cos q + J d sin q
        point turns    M = (p x d) cos q - (p . d) sin q
        direction      M = (p x d) cos q + (p . d) sin q,  F = d cos q + J d sin q
    """
    (x, y), (p_x, p_y) = unit, point
    across, along = p_x * y - p_y * x, p_x * x + p_y * y
    if not direction_turns:
        if not point_turns:
            return Arms((across, x, y))
        return Arms((0.0, x, y), (across, 0.0, 0.0), (-along, 0.0, 0.0))
    if point_turns:
        return Arms((across, 0.0, 0.0), (0.0, x, y), (0.0, -y, x))
    return Arms(NONE, (across, x, y), (along, -y, x))


def arms_of_weight(radius: float, azimuth: float) -> Arms:
    """Return the arms of a weight on the body, at a radius, m, and an azimuth at q = 0, rad."""
    x, y = radius * cos(azimuth), radius * sin(azimuth)
    return Arms((0.0, 0.0, -1.0), (-x, 0.0, 0.0), (y, 0.0, 0.0))


COUPLE = Arms((1.0, 0.0, 0.0))
THROUGH_AXIS = Arms((0.0, 1.0, 0.0))


def total_of(loads: Iterable[Load]) -> Arms:
    """Return the sum of the loads of constant size, N m, N, N."""
    total: Any = Arms()
    for load in loads:
        if load.is_constant:
            n = load.size(0.0)
            total = [
                tuple(a + b * n for a, b in zip(one, two, strict=True))
                for one, two in zip(total, load.arms, strict=True)
            ]
    return Arms(*total)


# Time, s; moment, N m, and components of the force, N, of the loads; cosine and sine of the angle.
Acting = tuple[float, float, float, float, float, float]


def acting_of(loads: Sequence[Load]) -> Callable[[float, float, float], Acting]:
    """Return what acts on the body as a function of time, angle and speed."""
    (m_0, x_0, y_0), (m_c, x_c, y_c), (m_s, x_s, y_s) = total_of(loads)
    varying = [load for load in loads if not load.is_constant]
    fixed = [(load.size, load.over, *load.arms.constant) for load in varying if not load.arms.turn]
    turning = [(load.size, load.over, *load.arms) for load in varying if load.arms.turn]

    def acting(t: float, q: float, v: float) -> Acting:
        c, s = cos(q), sin(q)
        m, x, y = m_0 + m_c * c + m_s * s, x_0 + x_c * c + x_s * s, y_0 + y_c * c + y_s * s
        for size, over, a_m, a_x, a_y in fixed:
            n = size(t if over == TIME else q if over == ANGLE else v)
            m, x, y = m + n * a_m, x + n * a_x, y + n * a_y
        for size, over, (a_m, a_x, a_y), (b_m, b_x, b_y), (c_m, c_x, c_y) in turning:
            n = size(t if over == TIME else q if over == ANGLE else v)
            m += n * (a_m + b_m * c + c_m * s)
            x += n * (a_x + b_x * c + c_x * s)
            y += n * (a_y + b_y * c + c_y * s)
        return t, m, x, y, c, s

    return acting


def sizes_of(loads: Iterable[Load], friction_radius: float) -> Callable[[float, float], float]:
    """Return the sum of torques and static limits of all loads at rest, N m, over time and angle.

    A couple has no limit.
    """
    scale, varying = 0.0, []
    for load in loads:
        reach = load.arms.largest + (friction_radius if load.arms.is_force else 0.0)
        if load.is_constant:
            scale += abs(load.size(0.0)) * reach
        else:
            varying.append((load, reach))
    if not varying:
        return lambda t, q: scale
    return lambda t, q: sum([abs(load.at_rest(t, q)) * reach for load, reach in varying], scale)


class Elapsed:
    """Time as the drive of a mechanism on which several signals act; steps end where they jump."""

    def __init__(self, signals: tuple[Signal, ...]) -> None:
        self.signals = signals

    def __call__(self, t: float) -> float:
        return t

    def next_discontinuity(self, t: float) -> float:
        """Return the first time after t, s, at which a derivative of a signal jumps."""
        return min([signal.next_discontinuity(t) for signal in self.signals], default=inf)

    next_extremum = next_discontinuity


class TableKnots(NamedTuple):
    """The surface at which the slope of a size over angle or speed jumps.

    Attributes
    ----------
    place : int
        Of the angle or the speed in the state.
    knots : tuple of float, rad or rad/s
        In ascending order.
    """

    place: int
    knots: tuple[float, ...]
    event: str = ""

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return a number that is positive beyond the first knot after the start of a step."""
        x_old, x, knots = step.y_old[self.place], y[self.place], self.knots
        above = bisect_right(knots, x_old)
        below = above - 1 if not above or knots[above - 1] != x_old else above - 2
        beyond = x - knots[above] if above < len(knots) else -inf
        return max(beyond, knots[below] - x) if below >= 0 else beyond


def knots_of(loads: Sequence[Load]) -> tuple[TableKnots, ...]:
    """Return where the slopes of sizes over angle or speed jump."""
    surfaces = []
    for place, over in enumerate((ANGLE, SPEED)):
        knots = {x for load in loads if load.over == over for x in load.size.knots}
        if knots:
            surfaces.append(TableKnots(place, tuple(sorted(knots))))
    return tuple(surfaces)
