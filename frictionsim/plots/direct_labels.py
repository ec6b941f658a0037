"""Names beside what they belong to in a drawing, where there is room for them."""

from collections.abc import Sequence
from math import cos, hypot, pi, sin
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.patheffects import withStroke

from frictionsim.plots.text_size import LINE_SPACING, points_of, text_width

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.floating[Any]]

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
    """What a drawing shows.

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


def draw_labels(ax: Any, labels: Sequence[Label], drawn: "Array", view: Area) -> None:
    """Write names beside their places, apart from each other and from lines where that is possible.

    A name without room is left out: what it names is in the key as well.

    Parameters
    ----------
    ax : Axes
    labels : sequence of Label
        The most important first.
    drawn : (n, 2), m
        Points of lines that should stay free.
    view : Area
    """
    lines = drawn * view.scale
    kept: list[tuple[float, float, float, float]] = []
    for label in labels:
        wide = text_width(label.text, SIZE) + 2.0 * SPARE
        high = LINE_SPACING * points_of(SIZE) + 2.0 * SPARE
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
            fontsize=SIZE,
            zorder=9,
        )
        text.set_path_effects(HALO)


def _offsets(away: tuple[float, float], wide: float, high: float) -> list[tuple[float, float]]:
    """Return the middles of a name relative to its place, points; the wanted direction first."""
    start = float(np.arctan2(away[1], away[0])) if hypot(*away) > 0.0 else 0.0
    turns = sorted(range(AROUND), key=lambda i: min(i, AROUND - i))
    found = []
    for gap in GAPS:
        for i in turns:
            angle = start + 2.0 * pi * i / AROUND
            c, s = cos(angle), sin(angle)
            # As far as the box touches the circle of the gap.
            out = gap + min(0.5 * wide / max(abs(c), 1e-9), 0.5 * high / max(abs(s), 1e-9))
            found.append((out * c, out * s))
    return found


def _leaves(box: tuple[float, float, float, float], view: Area) -> bool:
    low, high = (tuple(view.scale * value for value in corner) for corner in (view.low, view.high))
    return box[0] < low[0] or box[1] < low[1] or box[2] > high[0] or box[3] > high[1]


def _overlap(
    one: tuple[float, float, float, float], two: tuple[float, float, float, float]
) -> bool:
    return one[0] < two[2] and two[0] < one[2] and one[1] < two[3] and two[1] < one[3]
