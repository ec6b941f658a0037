"""Curves of the quantities of a sweep over one key; one for each text of a second key."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D

from frictionsim.display import BLACK, GREY, VERMILION
from frictionsim.io.sweep_table import SweepTable
from frictionsim.parameter_study.block import AUDIT_FAILED, DONE, FAILED, NOT_RUN
from frictionsim.parameter_study.statistics import sound_values
from frictionsim.plots.style import Style, grid, line_style
from frictionsim.plots.sweep_axes import KeyAxis

if TYPE_CHECKING:
    from frictionsim.results import Array

MAX_MARKED = 60  # runs along a curve
FLAT = 1e-6  # a quantity that varies relatively less is drawn as constant
LOG_RATIO = 1e3  # of largest to least value, above which the axis of a quantity is logarithmic
MARKERS = ("o", "s", "^", "D", "v", "P", "*", "h")
RAISED = 0.05  # of the height of a panel, from curve to curve, of the marks at its lower edge

# At the lower edge of a panel, or around the value of a run with a failed audit.
MARKS: dict[str, Style] = {
    "failed": {"marker": "x", "color": VERMILION, "markersize": 7, "markeredgewidth": 1.8},
    "not defined": {"marker": "v", "color": GREY, "markersize": 6, "fillstyle": "none"},
    "not run": {"marker": "_", "color": BLACK, "markersize": 8, "markeredgewidth": 1.5},
    "audit failed": {"marker": "D", "color": VERMILION, "markersize": 7, "fillstyle": "none"},
}


class Outcomes(NamedTuple):
    """Which runs are drawn how, beside those with a sound value.

    Attributes
    ----------
    values : array
        Of runs that are done and passed their audit; else NaN.
    of_failed_audit : array
        Of runs whose audit failed; else NaN.
    marks : dict of bool arrays
        By the names of MARKS.
    """

    values: "Array"
    of_failed_audit: "Array"
    marks: dict[str, Any]


def outcomes_of(table: SweepTable, name: str, runs: Any) -> Outcomes:
    """Return how the runs are drawn, in their shape."""
    status = table.status[runs]
    values = sound_values(table, name)[runs]
    audit = np.where(status == AUDIT_FAILED, table.values[name][runs], np.nan)
    undefined = ((status == DONE) & np.isnan(values)) | ((status == AUDIT_FAILED) & np.isnan(audit))
    marks = {
        "failed": status == FAILED,
        "not defined": undefined,
        "not run": status == NOT_RUN,
        "audit failed": (status == AUDIT_FAILED) & ~np.isnan(audit),
    }
    return Outcomes(values, audit, marks)


def draw_curves(
    ax: Any, table: SweepTable, name: str, axes: tuple[KeyAxis, ...], runs: Any, joined: bool
) -> None:
    """Draw a quantity over the first key, with a curve for each text of the second one.

    Parameters
    ----------
    ax : Axes
    table : SweepTable
    name : str
        The quantity.
    axes : tuple of KeyAxis
        One, or two of which the second has labels.
    runs : array of int
        In the shape of the axes.
    joined : bool
        Neighbours are joined by lines.
    """
    grid(ax)
    ax.margins(x=0.03)
    axes[0].prepare(ax, "x")
    columns = runs[:, None] if len(axes) == 1 else runs
    found = outcomes_of(table, name, columns)
    x = axes[0].values
    for number in range(columns.shape[1]):
        values = found.values[:, number]
        lines = joined and not (table.units[name] == "1" and is_count(values))
        ax.plot(x, values, **curve_style(number, x.size, lines))
        for mark, style in MARKS.items():
            at = found.marks[mark][:, number]
            if not at.any():
                continue
            own = dict(style) if columns.shape[1] == 1 else style | {"color": _colour(number)}
            if mark == "audit failed":
                ax.plot(x[at], found.of_failed_audit[at, number], linestyle="", **own)
            else:
                height = np.full(at.sum(), RAISED * (0.4 + number))
                transform = ax.get_xaxis_transform()
                ax.plot(x[at], height, linestyle="", transform=transform, **own)
    scale_values(ax, np.concatenate((found.values.ravel(), found.of_failed_audit.ravel())))
    below = [where.any(axis=0) for mark, where in found.marks.items() if mark != "audit failed"]
    if np.any(below):
        _make_room(ax, RAISED * (2.0 + int(np.flatnonzero(np.any(below, axis=0))[-1])))


def is_count(values: "Array") -> bool:
    """Return whether all values are whole numbers, between which there is nothing."""
    found = values[np.isfinite(values)]
    return bool(found.size and (found == np.round(found)).all() and np.ptp(found) > 0.0)


def curve_style(number: int, points: int, joined: bool) -> Style:
    """Return the style of a curve: with a marker at each run if there are not too many."""
    style = line_style(number)
    if not joined:
        style["linestyle"] = ""
    if points <= MAX_MARKED or not joined:
        style |= {"marker": MARKERS[number % len(MARKERS)], "markersize": 4}
    return style


def _colour(number: int) -> Any:
    return line_style(number)["color"]


def scale_values(ax: Any, values: "Array") -> None:
    """Set scale and limits of y for the values of a quantity."""
    found = values[np.isfinite(values)]
    if not found.size:
        ax.set_yticks([])
        return
    least, largest = float(found.min()), float(found.max())
    size = max(abs(least), abs(largest))
    if largest - least <= FLAT * size:
        middle = 0.5 * (least + largest)
        half = 0.1 * size or 1.0
        ax.set_ylim(middle - half, middle + half)
    elif least > 0.0 and largest >= LOG_RATIO * least:
        ax.set_yscale("log")


def _make_room(ax: Any, part: float) -> None:
    """Extend the scale of y downwards, so that marks take a part of the height for themselves."""
    low, high = ax.get_ylim()
    ratio = part / (1.0 - part)
    if ax.get_yscale() == "log":
        ax.set_ylim(low * (low / high) ** ratio, high)
    else:
        ax.set_ylim(low - ratio * (high - low), high)


def legend_of(marks: dict[str, str], several: bool = False) -> list[Line2D]:
    """Return legend texts by marker name.

    Marks of `several` curves have the colours of these.
    """
    colour = {"color": BLACK} if several else {}
    return [
        Line2D([], [], linestyle="", **(MARKS[name] | colour), label=text)
        for name, text in marks.items()
    ]


def legend_of_curves(axis: KeyAxis, points: int, joined: bool) -> list[Line2D]:
    """Return the legend of a second key whose values are texts."""
    return [
        Line2D([], [], **curve_style(number, points, joined), label=axis.text(number))
        for number in range(len(axis.labels))
    ]
