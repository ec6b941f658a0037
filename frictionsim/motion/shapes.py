"""Shapes of wheels, blocks and forces that several mechanisms share."""

from collections.abc import Iterable
from math import cos, floor, log10, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.motion.parts import Arrow, Body, Detail, Disc, Line, Outline, Part
from frictionsim.motion.samples import effect_in

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array, Bounds, Role
    from frictionsim.motion.samples import Samples

MAX_ARC, HEAD, POINTS = 0.75 * pi, 0.2, 25  # of a couple: rad of the largest; head, of the radius
RING = 49  # points of a circle whose radius changes


def points_of(*pairs: Any) -> "Array":
    """Return points (frames, n, 2) of pairs of x and y, each (frames,) or a number."""
    numbers = [np.atleast_1d(each) for pair in pairs for each in pair]
    flat = np.stack(np.broadcast_arrays(*numbers), axis=-1)
    return flat.reshape(len(flat), -1, 2).astype(float)


def vectors(x: Any, y: Any) -> "Array":
    """Return (frames, 2) of x and y, each (frames,) or a number."""
    return points_of((x, y))[:, 0]


def torque_arc(
    name: str,
    torque: "Array",
    radius: float,
    largest: float | None = None,
    role: "Role" = "force",
    about: Any = 0.0,
) -> list[Line]:
    """Return a couple as an arc with a head; nothing if it is zero throughout.

    It begins below the axis and goes the way the couple turns: to the right where it is positive.

    Parameters
    ----------
    torque : (frames,), N m
    radius : float, m
        Of the arc.
    largest : float, N m, optional
        The couple of the longest arc; by default the largest of this one.
    about : (frames, 1, 2), m, optional
        The middle of the arc; by default the origin.
    """
    own = float(np.abs(torque).max(initial=0.0))
    if own == 0.0:
        return []
    turn = MAX_ARC * torque / (own if largest is None else largest)
    angle = -0.5 * pi + np.linspace(0.0, 1.0, POINTS) * turn[:, None]
    bow = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    # The head shrinks with the arc where the arc is shorter than it.
    head = np.clip(turn, -HEAD, HEAD)
    back = radius * np.stack([np.cos(angle[:, -1] - head), np.sin(angle[:, -1] - head)], axis=-1)
    wide = 0.5 * np.abs(head)[:, None]
    barbs = ((1.0 + wide) * back, bow[:, -1], (1.0 - wide) * back)
    points = np.concatenate([bow, np.stack(barbs, axis=1)], axis=1)
    return [Line(name, points + about, role, unit="N m", size=torque)]


def reaction(across: "Array", up: "Array", torque: "Array", vanishes: Any = False) -> Arrow:
    """Return the reaction of a shaft, N, on its line of action, from the foot of its perpendicular.

    With the force (F_x, F_y) the foot (e_x, e_y) has the moment e_x F_y - e_y F_x = torque. For a
    force that vanishes it is the axis.

    Parameters
    ----------
    torque : (frames,), N m
        The friction torque.
    vanishes : (frames,) of bool, optional
        Where the force is rounding.
    """
    square = np.where(vanishes, np.inf, across**2 + up**2)
    square = np.maximum(square, np.finfo(float).tiny)
    foot = vectors(torque * up / square, -torque * across / square)
    return Arrow("reaction of the shaft", foot, vectors(across, up), "friction")


def scale_of(forces: Iterable[Part], length: float) -> float:
    """Return the scale, m/N, on which the largest of some arrows has a length, m; 0 without any."""
    sizes = [part.size.max() for part in forces if isinstance(part, Arrow)]
    largest = float(max(sizes, default=0.0))
    return length / largest if largest > 0.0 else 0.0


WINDOW = 2.5  # of the static friction circle: half the side of what is shown larger
WHOLE = 1.6  # times as large it is, where this shows the edge of the shaft as well


def journal_of(at: "Samples", drawn: float) -> tuple[list[Part], tuple[Detail, ...]]:
    """Return the shaft, true to scale if its friction is simulated, and its enlarged circles.

    The kinetic one has a radius for each frame if friction is over the speed. `drawn` is the
    radius, m, of a shaft without friction.
    """
    journal = effect_in(at.record, "shaft_friction")
    discs: list[tuple[str, Disc]] = []
    rings: list[Part] = []
    details: tuple[Detail, ...] = ()
    size, static = drawn, 0.0
    if journal is not None:
        size, static, kinetic = (
            journal.shaft_radius,
            journal.static_radius,
            journal.radius_over_speed,
        )
        if static > 0.0:
            discs.append(("static friction circle", Disc(0.0, 0.0, static, "cord", open=True)))
            whole, half = 1.1 * size, WINDOW * static
            half = whole if whole < WHOLE * half else half
            words = "friction circles of the shaft, enlarged"
            details = (Detail(words, (-half, half, -half, half)),)
        if kinetic.varies and "angular_velocity" in at:
            radii = np.array([kinetic.at(w) for w in at["angular_velocity"].tolist()])
            ring = radii[:, None, None] * arc(1.0, 0.0, 2.0 * pi, RING)
            rings.append(Line("kinetic friction circle", ring, "friction"))
        elif not kinetic.varies and kinetic.at_rest > 0.0:
            disc = Disc(0.0, 0.0, kinetic.at_rest, "friction", open=True)
            discs.append(("kinetic friction circle", disc))
    discs.insert(0, ("shaft", Disc(0.0, 0.0, size, "still")))
    still = (at.still,) * 3
    return [*(Body(name, (disc,), *still) for name, disc in discs), *rings], details


SPOKES, TICKS = 5, 12  # an odd number: a turn by half of 360 degrees is seen
HUB, RIM = 0.16, 0.8  # of the radius
MARK = 0.07  # of the radius: the dot at the rim by which the eye sees a wheel turn


def wheel(radius: float, hub: float = HUB) -> tuple[Disc | Outline, ...]:
    """Return a wheel with spokes, ticks and a mark at angle 0; radius in m, hub relative to it."""
    turns = 2.0 * pi * np.arange(1, SPOKES) / SPOKES
    ticks = 2.0 * pi * np.arange(TICKS) / TICKS
    return (
        Disc(0.0, 0.0, radius, "moving"),
        *(ray(float(turn), hub * radius, RIM * radius, "fixed") for turn in turns),
        *(ray(float(turn), 0.9 * radius, radius, "fixed") for turn in ticks),
        ray(0.0, hub * radius, RIM * radius, "marked"),
        Disc((1.0 - 1.6 * MARK) * radius, 0.0, MARK * radius, "marked"),
    )


def ray(angle: float, inner: float, outer: float, role: "Role") -> Outline:
    """Return a straight line away from the origin, between two radii in m."""
    direction = np.array([cos(angle), sin(angle)])
    return Outline(np.array([inner * direction, outer * direction]), role)


def block(width: float, height: float, role: "Role") -> Outline:
    """Return a rectangle that hangs from the origin; lengths in m."""
    half = 0.5 * width
    corners = [(-half, 0.0), (half, 0.0), (half, -height), (-half, -height)]
    return Outline(np.array(corners), role, closed=True)


def arc(radius: float, start: float, end: float, count: int = 33) -> "Array":
    """Return points (count, 2) of an arc about the origin; angles in rad, lengths in m."""
    angle = np.linspace(start, end, count)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def bar_below(longest: float) -> float:
    """Return the largest of ..., 1, 2, 5, 10, ... that does not exceed a value: that of a scale."""
    power = 10.0 ** floor(log10(longest))
    return max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= longest)


def bounds_around(points: "Array", margin: float) -> "Bounds":
    """Return the bounds of points (n, 2), m, with a margin."""
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    return float(left - margin), float(right + margin), float(bottom - margin), float(top + margin)


def bounds_of(parts: Iterable[Part], reach: float, margin: float, scale: float) -> "Bounds":
    """Return the bounds of a reach, m, and of lines, arrows and blocks at all times.

    A block is a body whose first shape is an outline; blocks do not turn.
    """
    points = [np.array([[-reach, -reach], [reach, reach]])]
    for part in parts:
        if isinstance(part, Arrow):
            points += [part.foot.reshape(-1, 2), (part.foot + scale * part.vector).reshape(-1, 2)]
        elif isinstance(part, Line):
            points.append(part.points.reshape(-1, 2))
        elif isinstance(part.shapes[0], Outline):
            points += [vectors(part.x + x, part.y + y) for x, y in part.shapes[0].points]
    return bounds_around(np.concatenate(points), margin)
