"""A quantity of a sweep over two keys as a map."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator

from frictionsim.io.sweep_table import SweepTable
from frictionsim.plots.style import BLACK, GREY
from frictionsim.plots.sweep_axes import KeyAxis
from frictionsim.plots.sweep_curves import FLAT, LOG_RATIO, MARKS, outcomes_of

if TYPE_CHECKING:
    from frictionsim.results import Array

COLOURS = "cividis"  # its lightness rises with the value, also for the colour-blind
HATCH = "/////"  # where the quantity is not defined
MIN_FOR_CONTOURS = 5  # values of each key
CONTOURS = 5
AT_ENDS = 0.03  # of the scale of colours, where contour lines would follow rounding errors
MAX_PIECES = 40  # of contour lines, above which they hide the map
MAX_WRITTEN = (6, 8)  # columns and rows of cells with their values written in them
MAX_CELLS = 5000  # above which a PDF or SVG has the map as an image
DARK = 0.5  # of the scale of colours, below which text is white


def norm_of(values: "Array") -> Normalize | None:
    """Return the scale of colours of the values of a quantity; None if there are none."""
    found = values[np.isfinite(values)]
    if not found.size:
        return None
    least, largest = float(found.min()), float(found.max())
    size = max(abs(least), abs(largest))
    if largest - least <= FLAT * size:
        half = 0.1 * size or 1.0
        return Normalize(least - half, largest + half)
    if least > 0.0 and largest >= LOG_RATIO * least:
        return LogNorm(least, largest)
    return Normalize(least, largest)


def draw_map(
    ax: Any,
    table: SweepTable,
    name: str,
    axes: tuple[KeyAxis, ...],
    runs: Any,
    norm: Normalize | None,
) -> Any:
    """Draw a quantity over two keys; return what a colour bar is made of, None without values.

    Parameters
    ----------
    ax : Axes
    table : SweepTable
    name : str
        The quantity.
    axes : tuple of KeyAxis
        Of x and y.
    runs : array of int
        In the shape of the axes.
    norm : Normalize or None
        Of `norm_of`.
    """
    x, y = axes
    x.prepare(ax, "x")
    y.prepare(ax, "y")
    found = outcomes_of(table, name, runs)
    values = np.where(np.isnan(found.values), found.of_failed_audit, found.values)
    ax.patch.set(facecolor="white", edgecolor=GREY, hatch=HATCH)
    edges, cells = (x.edges, y.edges), {"rasterized": values.size > MAX_CELLS, "linewidth": 0}
    blank = found.marks["failed"] | found.marks["not run"]
    if blank.any():
        covered = np.ma.masked_where(~blank, np.ones(blank.shape))
        ax.pcolormesh(*edges, covered.T, cmap=ListedColormap(["white"]), **cells)
    mesh = None
    if norm is not None:
        masked = np.ma.masked_invalid(values)
        mesh = ax.pcolormesh(*edges, masked.T, cmap=COLOURS, norm=norm, **cells)
        if _has_contours(x, y, values):
            _draw_contours(ax, x, y, masked, norm)
        elif x.values.size <= MAX_WRITTEN[0] and y.values.size <= MAX_WRITTEN[1]:
            _write_values(ax, x, y, values, norm)
    _mark_runs(ax, x, y, found.marks)
    ax.set_xlim(edges[0][0], edges[0][-1])
    ax.set_ylim(edges[1][0], edges[1][-1])
    return mesh


def _mark_runs(ax: Any, x: KeyAxis, y: KeyAxis, marks: dict[str, Any]) -> None:
    size = float(np.clip(120.0 / max(x.values.size, y.values.size), 1.5, 7.0))
    for mark in ("failed", "audit failed"):
        columns, rows = np.nonzero(marks[mark])
        if columns.size:
            style = MARKS[mark] | {"markersize": size, "markeredgewidth": size / 4.0}
            ax.plot(x.values[columns], y.values[rows], linestyle="", **style)


def _has_contours(x: KeyAxis, y: KeyAxis, values: "Array") -> bool:
    """Return whether contour lines help: over numbers, enough of them, and of what varies."""
    found = values[np.isfinite(values)]
    return (
        not x.labels
        and not y.labels
        and min(values.shape) >= MIN_FOR_CONTOURS
        and bool(np.ptp(found) > FLAT * np.abs(found).max())
    )


def _draw_contours(ax: Any, x: KeyAxis, y: KeyAxis, masked: Any, norm: Normalize) -> None:
    locator = LogLocator() if isinstance(norm, LogNorm) else MaxNLocator(CONTOURS)
    levels = [
        level
        for level in locator.tick_values(norm.vmin or 0.0, norm.vmax or 0.0)
        if AT_ENDS < norm(level) < 1.0 - AT_ENDS
    ]
    if not levels:
        return
    stroke = [withStroke(linewidth=2.2, foreground="white")]
    lines = ax.contour(x.values, y.values, masked.T, levels=levels, colors=BLACK, linewidths=0.7)
    pieces = sum(len(path.to_polygons(closed_only=False)) for path in lines.get_paths())
    if pieces > MAX_PIECES:
        lines.remove()
        return
    lines.set_path_effects(stroke)
    for text in ax.clabel(lines, fontsize=7, fmt="%.4g"):
        text.set_path_effects(stroke)


def _write_values(ax: Any, x: KeyAxis, y: KeyAxis, values: "Array", norm: Normalize) -> None:
    """Write the value into each cell."""
    for i, column in enumerate(x.values):
        for j, row in enumerate(y.values):
            value = values[i, j]
            if np.isfinite(value):
                colour = "white" if norm(value) < DARK else BLACK
                text = f"{value:.3g}"
                ax.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)


def legend_of_map(marks: dict[str, str]) -> list[Any]:
    """Return what the legend says of cells without a sound value, by their names the texts."""
    found: list[Any] = []
    for name, text in marks.items():
        if name == "not defined":
            found.append(Patch(facecolor="white", edgecolor=GREY, hatch=HATCH, label=text))
        elif name == "not run":
            found.append(Patch(facecolor="white", edgecolor=GREY, label=text))
        else:
            found.append(Line2D([], [], linestyle="", **MARKS[name], label=text))
    return found
