"""Quantities of a sample: a histogram of each, and its Sobol indices as a tornado."""

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import BLACK, BLUE, SKY, VERMILION, with_unit
from frictionsim.io.sweep_table import SweepTable
from frictionsim.parameter_study.sensitivity import Indices
from frictionsim.parameter_study.statistics import Statistics
from frictionsim.plots.literal_text import LITERAL, literal
from frictionsim.plots.style import Style, axis_label, grid
from frictionsim.plots.sweep_axes import MAX_WORD, short_keys
from frictionsim.plots.sweep_curves import FLAT

if TYPE_CHECKING:
    from frictionsim.results import Array

MAX_BINS = 50
MAX_BARS = 8  # keys in a tornado
TEXT_WIDTH = 52  # characters of a small text above or beside a panel
LINES: dict[str, Style] = {
    "mean": {"color": VERMILION, "linestyle": "-", "linewidth": 1.8},
    "50 %": {"color": BLACK, "linestyle": (0, (6, 2)), "linewidth": 1.3},
    "5 % and 95 %": {"color": BLACK, "linestyle": (0, (2, 1.5)), "linewidth": 1.3},
}
BARS: dict[str, Style] = {
    "total index": {"facecolor": SKY, "edgecolor": BLACK, "linewidth": 0.6},
    "first-order index": {"facecolor": BLUE, "edgecolor": BLACK, "linewidth": 0.6},
}
MAX_INDEX = 2.0  # at the end of the scale; that of an estimate may be above 1
THICKNESS = 0.38  # of a bar, of the distance from key to key


def draw_histogram(
    ax: Any, table: SweepTable, name: str, values: "Array", statistics: Statistics
) -> None:
    """Draw how often a quantity has which values, with its mean and quantiles.

    Parameters
    ----------
    ax : Axes
    table : SweepTable
    name : str
        The quantity.
    values : (n,)
        Its values in the independent runs.
    statistics : Statistics
        Of these.
    """
    grid(ax)
    unit = table.units[name]
    words = axis_label(name.replace("_", " "), unit, 2 * MAX_WORD)
    ax.set_xlabel(words, fontsize="small")
    ax.set_ylabel("runs", fontsize="small")
    ax.tick_params(labelsize="small")
    if not statistics.runs:
        write(ax, "not defined in any run")
        return
    found = values[np.isfinite(values)]
    ax.hist(found, bins=_bins(found), color=SKY, edgecolor=BLACK, linewidth=0.4)
    ax.locator_params(axis="x", nbins=6)  # more labels would touch each other
    s = statistics
    for style, places in zip(
        LINES.values(), ((s.mean,), (s.median,), (s.low, s.high)), strict=True
    ):
        for place in places:
            ax.axvline(place, **style)
    deviation = "" if np.isnan(s.deviation) else f", standard deviation {s.deviation:.4g}"
    lines = [
        with_unit(f"mean {s.mean:.5g}{deviation}", unit),
        with_unit(f"5 %: {s.low:.5g}, 50 %: {s.median:.5g}, 95 %: {s.high:.5g}", unit),
    ]
    if s.runs < values.size:
        lines.append(f"from {s.runs} of {values.size} runs; the others failed or do not define it")
    ax.set_title("\n".join(lines), fontsize="x-small", loc="left")


def _bins(values: "Array") -> Any:
    """Return the edges of the bins; a quantity that does not vary has one."""
    least, largest = float(values.min()), float(values.max())
    size = max(abs(least), abs(largest))
    if largest - least <= FLAT * size:
        half = 0.1 * size or 1.0
        return np.array([least - half, largest + half])
    edges = np.histogram_bin_edges(values, "rice")
    return edges if edges.size <= MAX_BINS else np.linspace(least, largest, MAX_BINS + 1)


def draw_tornado(ax: Any, indices: Indices) -> None:
    """Draw the indices of each key as bars, the largest total index at the top."""
    if not indices.first.size:
        write(ax, indices.basis)
        return
    grid(ax)
    order = np.argsort(-indices.total, kind="stable")[:MAX_BARS]
    names = short_keys(indices.keys)
    places = np.arange(order.size, dtype=np.float64)
    for style, values, interval, offset in (
        (BARS["first-order index"], indices.first, indices.first_interval, -0.5 * THICKNESS),
        (BARS["total index"], indices.total, indices.total_interval, 0.5 * THICKNESS),
    ):
        ax.barh(places + offset, values[order], THICKNESS, **style)
        if interval is not None:
            around = np.abs(interval[order].T - values[order])
            bar = {"ecolor": BLACK, "elinewidth": 1.0, "capsize": 2.0}
            ax.errorbar(values[order], places + offset, xerr=around, fmt="none", **bar)
    labels = [literal(_cut_left(names[i])) for i in order]
    ax.set_yticks(places, labels=labels, **LITERAL)
    ax.set_ylim(order.size - 0.5, -0.5)
    ends = [indices.first, indices.total, indices.first_interval, indices.total_interval]
    drawn = np.concatenate([end[order].ravel() for end in ends if end is not None])
    low, high = float(np.nanmin(drawn)), float(np.nanmax(drawn))
    ax.set_xlim(max(-MAX_INDEX, min(0.0, 1.05 * low)), min(MAX_INDEX, max(1.0, 1.05 * high)))
    ax.tick_params(labelsize="small")
    ax.set_xlabel("part of the variance", fontsize="small")
    rest = len(indices.keys) - order.size
    more = f"; {rest} keys with smaller indices are not shown" if rest else ""
    ax.set_title(fill(indices.basis + more, TEXT_WIDTH), fontsize="x-small", loc="left")


def _cut_left(name: str) -> str:
    return name if len(name) <= MAX_WORD else f"…{name[1 - MAX_WORD :]}"


def write(ax: Any, text: str) -> None:
    """Write a text instead of a drawing."""
    ax.set_ylabel("")
    ax.set_xticks([])
    ax.set_yticks([])
    for side in ax.spines.values():
        side.set_visible(False)
    ax.text(
        0.5,
        0.5,
        fill(text, TEXT_WIDTH - 10),
        ha="center",
        va="center",
        fontsize="small",
        transform=ax.transAxes,
    )


def legend_of_sample(with_indices: bool) -> list[Any]:
    """Return the legend of lines and bars."""
    found: list[Any] = [Line2D([], [], **style, label=name) for name, style in LINES.items()]
    if with_indices:
        found += [Patch(**style, label=name) for name, style in BARS.items()]
    return found
