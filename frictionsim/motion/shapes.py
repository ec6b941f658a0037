"""Shapes of wheels, blocks and arrows that several mechanisms share.

A torque is an arc with a head, as long as the torque is large. It begins below the axis and goes
the way the torque turns: to the right where it is positive, counter-clockwise.
"""

from collections.abc import Iterable
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.motion.parts import Arrow, Band, Body, Detail, Disc, Line, Part

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array, Bounds, Role


MAX_ARC = 0.75 * pi  # rad: of the arc of the largest torque
HEAD = 0.22  # of the radius: the straight arrow at its end
POINTS = 25


def torque_arc(
    name: str,
    torque: "Array",
    radius: float,
    largest: float | None = None,
    role: "Role" = "force",
) -> list[Part]:
    """Return a torque about the origin; nothing if it is zero throughout.

    Parameters
    ----------
    torque : (frames,), N m
    radius : float, m
        Of the arc.
    largest : float, N m, optional
        The torque of the longest arc; by default the largest of this torque.
    """
    own = float(np.abs(torque).max(initial=0.0))
    if own == 0.0:
        return []
    turn = MAX_ARC * torque / (own if largest is None else largest)
    angle = -0.5 * pi + np.linspace(0.0, 1.0, POINTS) * turn[:, None]
    end = angle[:, -1]
    # The head shrinks with the arc where the arc is shorter than it.
    length = radius * np.clip(turn, -HEAD, HEAD)
    tip_x, tip_y = radius * np.cos(end), radius * np.sin(end)
    dx, dy = -length * np.sin(end), length * np.cos(end)
    line = Band("", radius * np.cos(angle), radius * np.sin(angle), closed=False, role=role)
    return [line, Arrow(name, tip_x, tip_y, dx, dy, role)]


def reaction_foot(
    across: "Array", up: "Array", torque: "Array", vanishes: Any = False
) -> "tuple[Array, Array]":
    """Return the foot of the perpendicular from the axis to the line of action of a force, m.

    With the force (F_x, F_y) its foot (e_x, e_y) has the moment e_x F_y - e_y F_x = torque. For a
    force that vanishes it is the axis.
    """
    square = np.where(vanishes, np.inf, across**2 + up**2)
    square = np.maximum(square, np.finfo(float).tiny)
    return torque * up / square, -torque * across / square


def reaction_arrow(
    force: "tuple[Array, Array]", torque: "Array", scale: float, vanishes: Any = False
) -> Arrow:
    """Return the reaction of a shaft on its line of action.

    Parameters
    ----------
    force : ((frames,), (frames,)), N
        F_x and F_y.
    torque : (frames,), N m
        The friction torque.
    scale : float, m/N
    vanishes : (frames,) of bool, optional
        Where the force is rounding.
    """
    x, y = reaction_foot(*force, torque, vanishes)
    return Arrow("reaction of the shaft", x, y, scale * force[0], scale * force[1], "friction")


def shaft_bodies(
    radius: float, still: "Array", static: float = 0.0, kinetic: float = 0.0
) -> list[Part]:
    """Return a shaft and its friction circles of radii above 0, m; `still` are zeros, (frames,)."""
    discs: list[tuple[str, Disc]] = [("shaft", Disc(0.0, 0.0, radius, "fixed"))]
    if static > 0.0:
        discs.append(("static friction circle", Disc(0.0, 0.0, static, "paper", open=True)))
    if kinetic > 0.0:
        discs.append(("kinetic friction circle", Disc(0.0, 0.0, kinetic, "friction", open=True)))
    return [Body(name, (disc,), still, still, still) for name, disc in discs]


def enlarged_circles(half: float) -> tuple[Detail, ...]:
    """Return the detail of the friction circles with half its side in m; none if that is 0."""
    if half <= 0.0:
        return ()
    return (Detail("friction circles of the shaft, enlarged", (-half, half, -half, half)),)


SPOKES = 5  # an odd number: a turn by half of 360 degrees is seen
HUB, RIM = 0.16, 0.8  # of the radius
MARK = 0.07  # of the radius: the dot at the rim by which the eye sees a wheel turn


def wheel(radius: float, hub: float = HUB) -> tuple[Disc | Line, ...]:
    """Return a wheel with spokes and a mark at its rim, which is at the angle 0.

    Parameters
    ----------
    radius : float, m
    hub : float
        Relative to the radius.
    """
    shapes: list[Disc | Line] = [Disc(0.0, 0.0, radius, "moving")]
    for i in range(1, SPOKES):
        angle = 2.0 * pi * i / SPOKES
        shapes.append(ray(angle, hub * radius, RIM * radius, "fixed"))
    shapes.append(ray(0.0, hub * radius, RIM * radius, "marked"))
    shapes.append(Disc((1.0 - 1.6 * MARK) * radius, 0.0, MARK * radius, "marked"))
    return tuple(shapes)


def ray(angle: float, inner: float, outer: float, role: "Role") -> Line:
    """Return a straight line away from the origin, between two radii in m."""
    direction = np.array([cos(angle), sin(angle)])
    return Line(np.array([inner * direction, outer * direction]), role)


def block(width: float, height: float, role: "Role") -> Line:
    """Return a rectangle that hangs from the origin; lengths in m."""
    half = 0.5 * width
    corners = [(-half, 0.0), (half, 0.0), (half, -height), (-half, -height)]
    return Line(np.array(corners), role, closed=True)


def arc(radius: float, start: float, end: float, count: int = 33) -> "Array":
    """Return points (count, 2) of an arc about the origin; angles in rad, lengths in m."""
    angle = np.linspace(start, end, count)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def bounds_around(points: "Array", margin: float) -> "Bounds":
    """Return the bounds of points (n, 2), m, with a margin."""
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    return float(left - margin), float(right + margin), float(bottom - margin), float(top + margin)


def bounds_of(parts: Iterable[Part], reach: float, margin: float) -> "Bounds":
    """Return the bounds of a reach, m, and of bands, arrows and blocks at all times.

    A block is a body whose first shape is a line; blocks do not turn.
    """
    points = [np.array([[-reach, -reach], [reach, reach]])]
    for part in parts:
        if isinstance(part, Arrow):
            points.append(np.column_stack([part.x, part.y]))
            points.append(np.column_stack([part.x + part.dx, part.y + part.dy]))
        elif isinstance(part, Body) and isinstance(part.shapes[0], Line):
            points += [np.column_stack([part.x + x, part.y + y]) for x, y in part.shapes[0].points]
        elif isinstance(part, Band):
            points.append(np.column_stack([part.x.ravel(), part.y.ravel()]))
    return bounds_around(np.concatenate(points), margin)


def gear_rim(radius: float, teeth: int, phase: float = 0.0) -> Line:
    """Return the outline of a gear, with a tooth at the angle `phase`.

    The teeth are trapezoids of the usual height: 1 module above the pitch circle, 1.25 below it.

    Parameters
    ----------
    radius : float, m
        Of the pitch circle.
    phase : float, rad
    """
    module, pitch = 2.0 * radius / teeth, 2.0 * pi / teeth
    corners = [
        (radius - 1.25 * module, -0.34),
        (radius + module, -0.14),
        (radius + module, 0.14),
        (radius - 1.25 * module, 0.34),
    ]
    points = [
        (r * cos(phase + (i + part) * pitch), r * sin(phase + (i + part) * pitch))
        for i in range(teeth)
        for r, part in corners
    ]
    return Line(np.array(points), "moving", closed=True)
