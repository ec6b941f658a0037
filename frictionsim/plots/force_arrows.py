"""Forces in a drawing: straight and curved arrows with names, and samples of them for a key."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path

from frictionsim.plots.direct_labels import Label, View, draw_labels
from frictionsim.plots.style import Style

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.plots.free_body import Resultant

    Array = npt.NDArray[np.floating[Any]]
    Pair = tuple[float, float]

WIDTH, BROAD = 2.0, 4.0  # points, of an arrow, and of one that others lie over
HEAD = 11.0  # points
MIN_ARROW, MIN_NAMED = 3.0, 12.0  # points: a shorter arrow is left out, or has no name beside it
STEP = 4.0  # points between places of a line that names keep away from
CURVED = (0, (3, 1))
LINE: Style = {"linewidth": 0.8, "linestyle": (0, (5, 3)), "scalex": False, "scaley": False}


class ForceDrawing:
    """A drawing of forces, whose names are written when all of them are drawn."""

    def __init__(self, ax: Any, view: View) -> None:
        self.ax, self.view = ax, view
        self._labels: list[Label] = []
        self._lines: list[Any] = [np.zeros((1, 2))]

    def arrow(self, name: str, tail: "Pair", way: "Pair", colour: str, broad: bool = False) -> bool:
        """Draw an arrow from a place; return whether it is long enough for a name."""
        length = np.hypot(*way) * self.view.scale
        if not self.shows(way):
            return False
        tip = tail[0] + way[0], tail[1] + way[1]
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

    def shows(self, way: "Pair") -> bool:
        """Return whether an arrow is long enough to be drawn."""
        return bool(np.hypot(*way) * self.view.scale >= MIN_ARROW)

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
        way = length * ux, length * uy
        if self.arrow(name, force.foot, way, colour, broad):
            self.name(name, (x + way[0], y + way[1]), way)

    def name(self, text: str, place: "Pair", away: "Pair", first: bool = False) -> None:
        """Write a name beside a place, on the side of a direction if there is room."""
        self._labels.insert(0 if first else len(self._labels), Label(text, place, away))

    def keep_free(self, points: "Array") -> None:
        """Keep names away from a line through points (n, 2), m."""
        for start, end in pairwise(points):
            count = 2 + int(float(np.hypot(*(end - start))) * self.view.scale / STEP)
            part = np.linspace(0.0, 1.0, min(count, 400))[:, None]
            self._lines.append(start + part * (end - start))

    def write_names(self) -> None:
        """Write the names, and show what the view says."""
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
