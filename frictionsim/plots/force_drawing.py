"""A drawing of forces as arrows, with names beside them where there is room."""

from collections.abc import Sequence
from itertools import pairwise
from math import cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from frictionsim.plots.old_style import Style
from frictionsim.plots.texts import LINE_SPACING, points_of, text_width

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.floating[Any]]
    Point = tuple[float, float]


SIZE = "small"
GAPS = (5.0, 14.0, 26.0)  # points between a place and its name
SPARE = 2.0  # points around a name
AROUND = 16  # directions that are tried
HALO = [withStroke(linewidth=2.5, foreground="white")]


class Label(NamedTuple):
    """A name for a place in a drawing.

    Attributes
    ----------
    text : str
    place : (float, float), m
    away : (float, float)
        Direction in which the name stands if it can.
    """

    text: str
    place: tuple[float, float]
    away: tuple[float, float]


class Area(NamedTuple):
    """The visible area of a drawing.

    Attributes
    ----------
    low, high : (float, float), m
        Its corners.
    scale : float
        Points of the paper per metre, rather too few than too many.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    scale: float


def draw_labels(
    ax: Any, labels: Sequence[Label], drawn: "Array", view: Area, size: str = SIZE
) -> "Array":
    """Write names beside their places, apart from each other and from lines where that is possible.

    A name without room is left out: what it names is in the key as well. Returns the corners
    (left, bottom, right, top) of the others, m.

    Parameters
    ----------
    labels : sequence of Label
        The most important first.
    drawn : (n, 2), m
        Points of lines that should stay free.
    view : Area
    """
    lines = drawn * view.scale
    kept: list[tuple[float, float, float, float]] = []
    for label in labels:
        wide = text_width(label.text, size) + 2.0 * SPARE
        high = LINE_SPACING * points_of(size) + 2.0 * SPARE
        best: tuple[float, Any] = (np.inf, None)
        for order, (x, y) in enumerate(_offsets(label.away, wide, high)):
            at_x, at_y = label.place[0] * view.scale + x, label.place[1] * view.scale + y
            box = at_x - 0.5 * wide, at_y - 0.5 * high, at_x + 0.5 * wide, at_y + 0.5 * high
            if _leaves(box, view) or any(_overlap(box, other) for other in kept):
                continue
            inside = (lines > box[:2]).all(axis=1) & (lines < box[2:]).all(axis=1)
            cost = float(np.count_nonzero(inside)) + 0.1 * order
            if cost < best[0]:
                best = cost, (x, y, box)
        if best[1] is None:
            continue
        x, y, box = best[1]
        kept.append(box)
        text = ax.annotate(
            label.text,
            label.place,
            (x, y),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=size,
            zorder=9,
        )
        text.set_path_effects(HALO)
    return np.array(kept).reshape(-1, 4) / view.scale


def _offsets(away: tuple[float, float], wide: float, high: float) -> list[tuple[float, float]]:
    """Return the middles of a name relative to its place, points; the wanted direction first."""
    start = float(np.arctan2(away[1], away[0])) if hypot(*away) > 0.0 else 0.0
    turns = sorted(range(AROUND), key=lambda i: min(i, AROUND - i))
    offsets = []
    for gap in GAPS:
        for i in turns:
            angle = start + 2.0 * pi * i / AROUND
            c, s = cos(angle), sin(angle)
            # As far as the box touches the circle of the gap.
            out = gap + min(0.5 * wide / max(abs(c), 1e-9), 0.5 * high / max(abs(s), 1e-9))
            offsets.append((out * c, out * s))
    return offsets


def _leaves(box: tuple[float, float, float, float], view: Area) -> bool:
    low, high = (tuple(view.scale * value for value in corner) for corner in (view.low, view.high))
    return box[0] < low[0] or box[1] < low[1] or box[2] > high[0] or box[3] > high[1]


def _overlap(
    one: tuple[float, float, float, float], two: tuple[float, float, float, float]
) -> bool:
    return one[0] < two[2] and two[0] < one[2] and one[1] < two[3] and two[1] < one[3]


WIDTH, BROAD = 2.0, 4.0  # points, of an arrow, and of one that others lie over
HEAD = 11.0  # points
MIN_ARROW, MIN_NAMED = 3.0, 12.0  # points: a shorter arrow is left out, or has no name beside it
STEP = 4.0  # points between places of a line that names keep away from
CURVED = (0, (3, 1))
LINE: Style = {"linewidth": 0.8, "linestyle": (0, (5, 3)), "scalex": False, "scaley": False}


class Resultant(NamedTuple):
    """A force on its line of action.

    Attributes
    ----------
    across, up : float, N
    foot : (float, float), m
        Of the perpendicular from the axis.
    torque : float, N m
        Its moment about the axis.
    vanishes : bool
        Whether it is rounding.
    """

    across: float
    up: float
    foot: "Point"
    torque: float
    vanishes: bool

    @property
    def size(self) -> float:
        """Its size, N."""
        return float(np.hypot(self.across, self.up))

    @property
    def arm(self) -> float:
        """Its distance from the axis, m."""
        return float(np.hypot(*self.foot))

    @property
    def direction(self) -> "Point":
        """Its unit vector."""
        size = self.size or 1.0
        return self.across / size, self.up / size


class ForceDrawing:
    """A drawing of forces, whose names are written when all of them are drawn."""

    def __init__(self, ax: Any, view: Area) -> None:
        self.ax, self.view = ax, view
        self._labels: list[Label] = []
        self._lines: list[Any] = [np.zeros((1, 2))]

    def arrow(
        self, name: str, tail: "Point", vector: "Point", colour: str, broad: bool = False
    ) -> bool:
        """Draw an arrow from a place; return whether it is long enough for a name."""
        length = np.hypot(*vector) * self.view.scale
        if not self.shows(vector):
            return False
        tip = tail[0] + vector[0], tail[1] + vector[1]
        arrow = FancyArrowPatch(
            tail,
            tip,
            arrowstyle="-|>",
            mutation_scale=HEAD * (1.2 if broad else 1.0),
            shrinkA=0.0,
            shrinkB=0.0,
            color=colour,
            linewidth=BROAD if broad else WIDTH,
            zorder=4.5 if broad else 6,
            label=name,
        )
        self.ax.add_patch(arrow)
        self.keep_free(np.array([tail, tip]))
        return bool(length >= MIN_NAMED)

    def shows(self, vector: "Point") -> bool:
        """Return whether an arrow is long enough to be drawn."""
        return bool(np.hypot(*vector) * self.view.scale >= MIN_ARROW)

    def curved_arrow(self, name: str, points: "Array", colour: str) -> None:
        """Draw a curved arrow along points (n, 2), with its name beside it."""
        arrow = FancyArrowPatch(
            path=Path(points),
            arrowstyle="-|>",
            mutation_scale=HEAD,
            color=colour,
            linewidth=WIDTH,
            linestyle=CURVED,
            fill=False,
            zorder=5,
            label=name,
        )
        self.ax.add_patch(arrow)
        self.keep_free(points)
        x, y = (float(value) for value in points[len(points) // 2])
        self.name(name, (x, y), (x, y))

    def force(
        self, name: str, force: "Resultant", length: float, colour: str, broad: bool = False
    ) -> None:
        """Draw a force with its line of action, from the foot of its lever arm."""
        (x, y), (ux, uy) = force.foot, force.direction
        (left, bottom), (right, top) = self.view.low, self.view.high
        far = 2.0 * float(np.hypot(right - left, top - bottom))
        ends = [x - far * ux, x + far * ux], [y - far * uy, y + far * uy]
        self.ax.plot(*ends, **LINE, color=colour)
        vector = length * ux, length * uy
        if self.arrow(name, force.foot, vector, colour, broad):
            self.name(name, (x + vector[0], y + vector[1]), vector)

    def name(self, text: str, place: "Point", away: "Point", first: bool = False) -> None:
        """Write a name beside a place, on the side of a direction if there is room."""
        self._labels.insert(0 if first else len(self._labels), Label(text, place, away))

    def keep_free(self, points: "Array") -> None:
        """Keep names away from a line through points (n, 2), m."""
        for start, end in pairwise(points):
            count = 2 + int(float(np.hypot(*(end - start))) * self.view.scale / STEP)
            part = np.linspace(0.0, 1.0, min(count, 400))[:, None]
            self._lines.append(start + part * (end - start))

    def write_names(self) -> None:
        """Write the names, and set the limits of the view."""
        draw_labels(self.ax, self._labels, np.concatenate(self._lines), self.view)
        (left, bottom), (right, top) = self.view.low, self.view.high
        self.ax.set_xlim(left, right)
        self.ax.set_ylim(bottom, top)
        self.ax.set_aspect("equal")


def arrow_sample(colour: str, words: str, broad: bool = False, curved: bool = False) -> Any:
    """Return a sample of an arrow for a key."""
    tip: Style = {"marker": ">", "markevery": [-1], "markersize": 6}
    width = BROAD if broad else WIDTH
    dashes: Any = (0, (1, 1)) if curved else "-"
    return Line2D([0, 1], [0, 0], color=colour, lw=width, linestyle=dashes, label=words, **tip)
