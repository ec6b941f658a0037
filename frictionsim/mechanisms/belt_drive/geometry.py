"""The line of an ideal belt round its pulleys: a closed chain of tangent spans and arcs.

A pulley has a sense sigma: +1 where the belt passes it counter-clockwise, with the centre on its
left, -1 where clockwise. For the span from circle i to circle j

    D = C_j - C_i,   e = sigma_j R_j - sigma_i R_i,   beta = atan2(D) - asin(e/|D|)

is the direction, and C - sigma R n are the points of tangency, n the normal to the left of the
direction. The belt has no thickness and no stiffness here; its pulleys do not overlap.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import asin, atan2, cos, degrees, dist, hypot, pi, sin, tau
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]

MAX_STRAIN = 0.5  # of a law of springs that is linear
MIN_BODIES = 4

# A belt that turns further than this round one pulley does not come from its neighbours.
MAX_WRAP_ANGLE = 1.8 * pi

# Directions carry a few roundings: a smaller angle counts as zero.
MIN_WRAP_ANGLE = 1e-9


class PathError(ValueError):
    """No belt passes the pulleys in this order; `pulley` is the index of the faulty one."""

    def __init__(self, message: str, pulley: int) -> None:
        super().__init__(message)
        self.pulley = pulley


class PulleyCircle(NamedTuple):
    """A circle that the belt passes, `inside` its loop or `outside`, on its back."""

    name: str
    center: Point
    radius: float
    side: Literal["inside", "outside"] = "inside"


class Arc(NamedTuple):
    """Where the belt touches a pulley: the polar angle of the first point and the signed sweep."""

    start: float
    wrap_angle: float


class Span(NamedTuple):
    """A straight stretch of belt, in the direction of the loop."""

    start: Point
    end: Point


class PathPoints(NamedTuple):
    """Points of a belt: position (n, 2), tangent angle (n,), index of the pulley (n,) or -1."""

    position: NDArray[np.float64]
    angle: NDArray[np.float64]
    pulley: NDArray[np.intp]


@dataclass(frozen=True)
class Path:
    """The line of a belt.

    Attributes
    ----------
    length : float, m
    total_turning : float, rad
        2 pi where the loop is passed counter-clockwise, -2 pi where clockwise.
    arcs : tuple of Arc, rad
        One for each pulley, in its order.
    spans : tuple of Span, m
        `spans[i]` leads from pulley i to the next one, cyclically.
    """

    length: float
    total_turning: float
    arcs: tuple[Arc, ...]
    spans: tuple[Span, ...]
    # The pieces in the order of the belt, span and arc by turns, the arc of the first pulley last.
    _starts: NDArray[np.float64]
    _points: NDArray[np.float64]
    _angles: NDArray[np.float64]
    _curvatures: NDArray[np.float64]
    _pulleys: NDArray[np.intp]

    @property
    def breakpoints(self) -> NDArray[np.float64]:
        """Arc lengths (2 n + 1,), m, at which spans and arcs begin by turns; last the length."""
        return np.append(self._starts, self.length)

    def at(self, s: NDArray[np.float64]) -> PathPoints:
        """Return the points of the line at arc lengths.

        Parameters
        ----------
        s : array (n,), m
            In [0, length), from where the belt leaves the first pulley, in its direction.

        Returns
        -------
        PathPoints
            Positions, m; tangent angles, rad, continuous along the belt; the pulley under the belt,
            -1 on a span.
        """
        piece = np.searchsorted(self._starts, s, side="right") - 1
        along = s - self._starts[piece]
        start, bend = self._angles[piece], self._curvatures[piece] * along
        # The chord of an arc: along sin(bend/2)/(bend/2), half the bend off the first tangent.
        chord = along * np.sinc(bend / tau)
        direction = start + 0.5 * bend
        step = chord[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
        return PathPoints(self._points[piece] + step, start + bend, self._pulleys[piece])


def belt_path(pulleys: Sequence[PulleyCircle]) -> Path:
    """Lay a taut belt round pulleys.

    Inside pulleys are passed counter-clockwise where the polygon of the centres has a positive
    area or none, as with two pulleys, clockwise where it is negative; outside pulleys the other
    way round.

    Parameters
    ----------
    pulleys : sequence of PulleyCircle, m
        At least two, in the order in which the belt passes them.

    Raises
    ------
    PathError
        Fewer than two pulleys; two that overlap; one that the belt does not touch, or in a point
        only; a span through another pulley; a belt that crosses itself.
    """
    n = len(pulleys)
    if n < 2:
        raise PathError(f"a belt needs at least two pulleys, not {n}", 0)
    _check_overlap(pulleys)
    loop = _sense_of_loop(pulleys)
    senses = [loop if pulley.side == "inside" else -loop for pulley in pulleys]
    directions, spans, arcs = [], [], []
    for i, a in enumerate(pulleys):
        j = (i + 1) % n
        b = pulleys[j]
        offset = senses[j] * b.radius - senses[i] * a.radius
        bearing = atan2(b.center[1] - a.center[1], b.center[0] - a.center[0])
        directions.append(bearing - asin(offset / dist(a.center, b.center)))
        ends = (_tangent_point(p, senses[k], directions[i]) for k, p in ((i, a), (j, b)))
        spans.append(Span(*ends))
    for i, (pulley, sense) in enumerate(zip(pulleys, senses, strict=True)):
        wrap_angle = (sense * (directions[i] - directions[i - 1])) % tau
        if min(wrap_angle, tau - wrap_angle) < MIN_WRAP_ANGLE:
            raise PathError(
                f"the belt touches pulley {pulley.name} in one point only, its arc is zero: "
                "leave it out or move it towards the belt",
                i,
            )
        if wrap_angle > MAX_WRAP_ANGLE:
            raise _untouched(pulley.name, wrap_angle, i)
        arcs.append(Arc(directions[i - 1] - sense * pi / 2, sense * wrap_angle))
    _check_turning(pulleys, arcs, loop)
    _check_obstacles(pulleys, spans)
    return _path(pulleys, senses, directions[0], arcs, spans)


def _check_overlap(pulleys: Sequence[PulleyCircle]) -> None:
    for (_, a), (j, b) in combinations(enumerate(pulleys), 2):
        overlap = a.radius + b.radius - dist(a.center, b.center)
        if overlap >= 0.0:
            raise PathError(
                f"pulleys {a.name} and {b.name} overlap by {overlap:.6g} m: their centres are "
                f"{dist(a.center, b.center):.6g} m apart, their radii add up to "
                f"{a.radius + b.radius:.6g} m",
                j,
            )


def _sense_of_loop(pulleys: Sequence[PulleyCircle]) -> int:
    x, y = np.array([pulley.center for pulley in pulleys]).T
    x, y = x - x[0], y - y[0]
    return -1 if float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) < 0.0 else 1


def _tangent_point(pulley: PulleyCircle, sense: int, direction: float) -> Point:
    r = sense * pulley.radius
    return pulley.center[0] + r * sin(direction), pulley.center[1] - r * cos(direction)


def _untouched(name: str, wrap_angle: float, i: int) -> PathError:
    return PathError(
        f"the belt does not touch pulley {name}: it would have to turn by"
        f" {degrees(wrap_angle):.4g} degrees round it. Leave it out, move it towards the belt, or"
        " change its side",
        i,
    )


def _check_turning(pulleys: Sequence[PulleyCircle], arcs: Sequence[Arc], loop: int) -> None:
    """Refuse a belt that does not turn once in all: it misses a pulley or crosses itself."""
    total_turning = loop * sum(arc.wrap_angle for arc in arcs)
    if total_turning > 1.5 * tau:
        i = max(range(len(arcs)), key=lambda k: abs(arcs[k].wrap_angle))
        raise _untouched(pulleys[i].name, abs(arcs[i].wrap_angle), i)
    if total_turning < 0.5 * tau:
        outside = [k for k, pulley in enumerate(pulleys) if pulley.side == "outside"]
        names = " and ".join(pulleys[k].name for k in outside)
        raise PathError(
            f"the belt would cross itself: with pulley {names} outside it turns by"
            f" {degrees(total_turning):.4g} degrees in all, not by 360, as if one outside does not"
            " touch it; move that towards the belt, leave it out, or change its side (a crossed"
            " belt cannot be described)",
            outside[0],
        )


def _check_obstacles(pulleys: Sequence[PulleyCircle], spans: Sequence[Span]) -> None:
    n = len(pulleys)
    for i, span in enumerate(spans):
        ends = f"from {pulleys[i].name} to {pulleys[(i + 1) % n].name}"
        for k, other in enumerate(pulleys):
            depth = other.radius - _distance(other.center, span)
            if k not in (i, (i + 1) % n) and depth > 0.0:
                raise PathError(
                    f"the span {ends} runs through pulley {other.name}, {depth:.6g} m deep: "
                    "is the order of the list wrong?",
                    k,
                )
    for (i, a), (k, b) in combinations(enumerate(spans), 2):
        if _cross(a, b):
            raise PathError(
                f"the span from {pulleys[i].name} to {pulleys[(i + 1) % n].name} crosses the one "
                f"from {pulleys[k].name} to {pulleys[(k + 1) % n].name}: "
                "is the order of the list wrong?",
                k,
            )


def _distance(point: Point, span: Span) -> float:
    (x, y), (dx, dy) = span.start, _vector(span.start, span.end)
    u = ((point[0] - x) * dx + (point[1] - y) * dy) / (dx * dx + dy * dy)
    u = min(max(u, 0.0), 1.0)
    return hypot(point[0] - x - u * dx, point[1] - y - u * dy)


def _cross(a: Span, b: Span) -> bool:
    return (
        _side_of(a, b.start) * _side_of(a, b.end) < 0.0
        and _side_of(b, a.start) * _side_of(b, a.end) < 0.0
    )


def _side_of(span: Span, point: Point) -> float:
    (dx, dy), (px, py) = _vector(span.start, span.end), _vector(span.start, point)
    return dx * py - dy * px


def _vector(start: Point, end: Point) -> Point:
    return end[0] - start[0], end[1] - start[1]


def _path(
    pulleys: Sequence[PulleyCircle],
    senses: Sequence[int],
    direction: float,
    arcs: Sequence[Arc],
    spans: Sequence[Span],
) -> Path:
    order = [*range(1, len(pulleys)), 0]  # the pulley that follows span i
    lengths, points, angles, angle = [], [], [], direction
    for span, i in zip(spans, order, strict=True):
        lengths += [dist(*span), pulleys[i].radius * abs(arcs[i].wrap_angle)]
        points += [span.start, span.end]
        angles += [angle, angle]
        angle += arcs[i].wrap_angle
    breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
    return Path(
        length=float(breakpoints[-1]),
        total_turning=tau if angle > direction else -tau,
        arcs=tuple(arcs),
        spans=tuple(spans),
        _starts=breakpoints[:-1],
        _points=np.array(points),
        _angles=np.array(angles),
        _curvatures=np.array([k for i in order for k in (0.0, senses[i] / pulleys[i].radius)]),
        _pulleys=np.array([k for i in order for k in (-1, i)]),
    )
