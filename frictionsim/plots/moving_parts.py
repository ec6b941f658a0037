"""The parts of a motion as artists of matplotlib, which are moved from frame to frame."""

from typing import Any, Protocol

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Affine2D

from frictionsim.display import BELT_CONTACT, EDGE, ROLES, TENSION_COLOURS
from frictionsim.motion.parts import Arrow, Body, Disc, Line, Outline, Part

UNEDGED = ("fixed", "marked")
# Points.
BELT, BELT_EDGE, STRIP, HALO, TICK, PATCH, CORD = 4.6, 1.6, 1.8, 0.9, 4.4, 10.0, 2.2
HEAD = 9.0  # of an arrow
HALO_OF_ARROW = [withStroke(linewidth=3.6, foreground="white")]


class Moving(Protocol):
    """An artist of a part in one of the axes."""

    def move(self, frame: int) -> None:
        """Show the part at a frame."""


class MovingBody:
    """A rigid body, whose shapes have one transform."""

    def __init__(self, ax: Any, body: Body, thick: float) -> None:
        self._body, self._data, self._transform = body, ax.transData, Affine2D()
        self._artists = [_shape(ax, shape, thick) for shape in body.shapes]
        for artist in self._artists:
            artist.set_transform(self._transform + self._data)

    def move(self, frame: int) -> None:
        """Show the body at a frame."""
        body = self._body
        self._transform.clear().rotate(body.angle[frame]).translate(body.x[frame], body.y[frame])
        for artist in self._artists:
            artist.set_visible(body.visible is None or bool(body.visible[frame]))


def _shape(ax: Any, shape: "Disc | Outline", thick: float) -> Any:
    colour = ROLES[shape.role]
    if isinstance(shape, Disc):
        face, edge = ("none", colour) if shape.open else (colour, EDGE)
        width = 1.2 if shape.open else (0.0 if shape.role in UNEDGED else 0.8)
        return ax.add_patch(
            Circle((shape.x, shape.y), shape.radius, fc=face, ec=edge, lw=thick * width)
        )
    if not shape.closed:
        width = thick * (2.2 if shape.role == "marked" else 1.2)
        return ax.add_line(Line2D(*shape.points.T, color=colour, lw=width, solid_capstyle="round"))
    return ax.add_patch(Polygon(shape.points, fc=colour, ec=EDGE, lw=0.8, joinstyle="round"))


class MovingArrow:
    """A force. Its head is as large as the arrow is long enough for."""

    def __init__(self, ax: Any, arrow: Arrow, thick: float, per_point: float, scale: float) -> None:
        self._arrow, self._head, self._scale = arrow, thick * HEAD * per_point, scale
        colour, width = ROLES[arrow.role], 2.2 * thick
        halo = {"path_effects": HALO_OF_ARROW}
        (self._line,) = ax.plot([], [], color=colour, lw=width, solid_capstyle="butt", **halo)
        self._tip = ax.add_patch(Polygon(np.zeros((3, 2)), fc=colour, ec="none"))

    def move(self, frame: int) -> None:
        """Show the force at a frame."""
        foot, vector = self._arrow.foot[frame], self._scale * self._arrow.vector[frame]
        length = float(np.hypot(*vector))
        for artist in (self._line, self._tip):
            artist.set_visible(length > 0.05 * self._head)
        along = vector / max(length, np.finfo(float).tiny)
        head = min(self._head, 0.6 * length)
        base, across = foot + vector - head * along, 0.38 * head * np.array([-along[1], along[0]])
        self._line.set_data(*np.stack([foot, base + 0.2 * head * along], axis=1))
        self._tip.set_xy(np.stack([foot + vector, base + across, base - across]))


class MovingBars:
    """Bars for the forces on many points."""

    def __init__(self, ax: Any, bars: Arrow, scale: float) -> None:
        self._bars, self._scale = bars, scale
        self._lines = ax.add_collection(LineCollection([], colors=ROLES[bars.role]))

    def move(self, frame: int) -> None:
        """Show the forces at a frame."""
        foot = self._bars.foot[frame]
        tip = foot + self._scale * self._bars.vector[frame]
        self._lines.set_segments(np.stack([foot, tip], axis=1)[(foot != tip).any(axis=1)])


class MovingCord:
    """A cord with marks that run along it."""

    def __init__(self, ax: Any, line: Line, thick: float, per_point: float) -> None:
        self._cord, self._reach = line, thick * TICK * per_point
        colour = ROLES[line.role]
        (self._line,) = ax.plot([], [], color=colour, lw=CORD * thick, solid_joinstyle="round")
        self._marks = ax.add_collection(LineCollection([], colors=EDGE, linewidths=1.4 * thick))

    def move(self, frame: int) -> None:
        """Show the cord at a frame."""
        cord = self._cord
        points = cord.points[frame if len(cord.points) > 1 else 0]
        self._line.set_data(*points.T)
        if cord.travel is None:
            return
        legs = np.diff(points, axis=0)
        place = np.concatenate([[0.0], np.cumsum(np.hypot(*legs.T))])
        marks = np.arange(float(cord.travel[frame]) % cord.spacing, place[-1], cord.spacing)
        leg = np.clip(np.searchsorted(place, marks, side="right") - 1, 0, len(legs) - 1)
        where = np.column_stack([np.interp(marks, place, points[:, k]) for k in (0, 1)])
        self._marks.set_segments(_ticks(where, legs[leg], self._reach))


class MovingBelt:
    """A belt coloured by its tension, with strips where it sticks and slips, and marks."""

    def __init__(self, ax: Any, line: Line, thick: float, per_point: float) -> None:
        self._belt_line, self._reach = line, thick * 1.3 * TICK * per_point

        def lines(colour: str | None, width: float, **style: Any) -> Any:
            collection = LineCollection([], colors=colour, linewidths=thick * width, **style)
            return ax.add_collection(collection)

        if line.patch is not None:
            self._patch = lines(ROLES["friction"], PATCH)
        self._marks = lines(EDGE, 1.1)
        self._edge = lines(EDGE, BELT + BELT_EDGE, capstyle="round")
        # Colours that are given would hide those of the values.
        colour = ROLES["moving"] if line.value is None else None
        self._belt = lines(colour, BELT, capstyle="round")
        if line.value is not None:
            self._belt.set_cmap(TENSION_COLOURS)
            self._belt.set_clim(float(line.value.min()), float(line.value.max()))
        self._strips = [
            (int(mode == "sticks"), [lines(around, STRIP + HALO), lines(core, STRIP)])
            for mode, (_, core, around) in BELT_CONTACT.items()
            if mode != "touches"
        ]

    def move(self, frame: int) -> None:
        """Show the belt at a frame."""
        line, points = self._belt_line, self._belt_line.points[frame]
        before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
        pieces = np.stack([before, points], axis=1)
        for collection in (self._edge, self._belt):
            collection.set_segments(pieces)
        if line.value is not None:
            self._belt.set_array(line.value[frame])
        halves = np.stack([0.5 * (before + points), points, 0.5 * (after + points)], axis=1)
        if line.patch is not None:
            self._patch.set_segments(halves[line.patch])
        if line.spacing > 0.0:
            length = float(np.hypot(*(points - before).T).sum())
            some = slice(None, None, max(1, round(len(points) * line.spacing / length)))
            ticks = _ticks(points[some], (after - before)[some], self._reach)
            self._marks.set_segments(ticks)
        if line.stuck is not None:
            for stuck, strips in self._strips:
                for strip in strips:
                    strip.set_segments(halves[line.stuck[frame] == stuck])


def _ticks(points: Any, directions: Any, reach: float) -> Any:
    """Return lines (n, 2, 2) across directions at points, which reach so far to both sides."""
    lengths = np.maximum(np.hypot(*directions.T), np.finfo(float).tiny)[:, None]
    across = reach * np.column_stack([-directions[:, 1], directions[:, 0]]) / lengths
    return np.stack([points - across, points + across], axis=1)


def moving(ax: Any, part: Part, thick: float, per_point: float, scale: float = 0.0) -> Moving:
    """Return the artist that draws a part.

    Parameters
    ----------
    thick : float
        Factor of line widths, above 1 where the drawing is larger.
    per_point : float, m
        Length of a point on the paper.
    scale : float, m/N
    """
    if isinstance(part, Body):
        return MovingBody(ax, part, thick)
    if isinstance(part, Arrow):
        if part.is_bars:
            return MovingBars(ax, part, scale)
        return MovingArrow(ax, part, thick, per_point, scale)
    if not part.closed:
        return MovingCord(ax, part, thick, per_point)
    return MovingBelt(ax, part, thick, per_point)
