"""The panels of a sweep: curves over a key, maps over two, histograms and indices of a sample."""

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator

from frictionsim.display import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    TENSION_COLOURS,
    VERMILION,
    picture_text,
    with_unit,
)
from frictionsim.io.sweep_table import AUDIT_FAILED, DONE, FAILED, NOT_RUN, SobolIndices, SweepTable
from frictionsim.plots.style import Style, axis_label, grid, line_style
from frictionsim.plots.sweep_axes import MAX_WORD, KeyAxis, short_keys
from frictionsim.plots.texts import LITERAL, literal
from frictionsim.sweeps.statistics import Statistics, is_constant, sound_values

if TYPE_CHECKING:
    from frictionsim.results import Array


MAX_MARKED = 60  # runs along a curve
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
    audit_failures : array
        Of runs whose audit failed; else NaN.
    marks : dict of bool arrays
        By the names of MARKS.
    """

    values: "Array"
    audit_failures: "Array"
    marks: dict[str, Any]


def outcomes_of(table: SweepTable, name: str, runs: Any) -> Outcomes:
    """Return values and outcomes of runs, in the shape of `runs`."""
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
    outcomes = outcomes_of(table, name, columns)
    x = axes[0].values
    for number in range(columns.shape[1]):
        values = outcomes.values[:, number]
        lines = joined and not (table.units[name] == "1" and is_count(values))
        ax.plot(x, values, **curve_style(number, x.size, lines))
        for mark, style in MARKS.items():
            at = outcomes.marks[mark][:, number]
            if not at.any():
                continue
            own = dict(style) if columns.shape[1] == 1 else style | {"color": _colour(number)}
            if mark == "audit failed":
                ax.plot(x[at], outcomes.audit_failures[at, number], linestyle="", **own)
            else:
                height = np.full(at.sum(), RAISED * (0.4 + number))
                transform = ax.get_xaxis_transform()
                ax.plot(x[at], height, linestyle="", transform=transform, **own)
    scale_values(ax, np.concatenate((outcomes.values.ravel(), outcomes.audit_failures.ravel())))
    below = [where.any(axis=0) for mark, where in outcomes.marks.items() if mark != "audit failed"]
    if np.any(below):
        _make_room(ax, RAISED * (2.0 + int(np.flatnonzero(np.any(below, axis=0))[-1])))


def is_count(values: "Array") -> bool:
    """Return whether all values are whole numbers, between which there is nothing."""
    defined = values[np.isfinite(values)]
    return bool(defined.size and (defined == np.round(defined)).all() and np.ptp(defined) > 0.0)


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
    defined = values[np.isfinite(values)]
    if not defined.size:
        ax.set_yticks([])
        return
    least, largest = limits_of(defined)
    if is_constant(defined):
        ax.set_ylim(least, largest)
    elif is_over_decades(least, largest):
        ax.set_yscale("log")


def limits_of(values: "Array") -> tuple[float, float]:
    """Return the least and the largest value; two values around those that do not vary."""
    least, largest = float(values.min()), float(values.max())
    if not is_constant(values):
        return least, largest
    half = 0.1 * max(abs(least), abs(largest)) or 1.0
    return least - half, largest + half


def is_over_decades(least: float, largest: float) -> bool:
    """Return whether the scale of values is logarithmic."""
    return least > 0.0 and largest >= LOG_RATIO * least


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


HATCH = "/////"  # where the quantity is not defined
MIN_FOR_CONTOURS = 5  # values of each key
CONTOURS = 5
MIN_DISTANCE = 0.03  # of the scale of colours, where contour lines would follow rounding errors
MAX_PIECES = 40  # of contour lines, above which they hide the map
MAX_WRITTEN = (6, 8)  # columns and rows of cells with their values written in them
MAX_CELLS = 5000  # above which a PDF or SVG has the map as an image
DARK = 0.5  # of the scale of colours, below which text is white


def norm_of(values: "Array") -> Normalize | None:
    """Return the scale of colours of the values of a quantity; None if there are none."""
    defined = values[np.isfinite(values)]
    if not defined.size:
        return None
    scale = LogNorm if is_over_decades(*limits_of(defined)) else Normalize
    return scale(*limits_of(defined))


def draw_map(
    ax: Any,
    table: SweepTable,
    name: str,
    axes: tuple[KeyAxis, ...],
    runs: Any,
    norm: Normalize | None,
) -> Any:
    """Draw a quantity over two keys; return the artist of its colour bar, None without values.

    Parameters
    ----------
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
    outcomes = outcomes_of(table, name, runs)
    values = np.where(np.isnan(outcomes.values), outcomes.audit_failures, outcomes.values)
    ax.patch.set(facecolor="white", edgecolor=GREY, hatch=HATCH)
    edges, cells = (x.edges, y.edges), {"rasterized": values.size > MAX_CELLS, "linewidth": 0}
    blank = outcomes.marks["failed"] | outcomes.marks["not run"]
    if blank.any():
        covered = np.ma.masked_where(~blank, np.ones(blank.shape))
        ax.pcolormesh(*edges, covered.T, cmap=ListedColormap(["white"]), **cells)
    mesh = None
    if norm is not None:
        masked = np.ma.masked_invalid(values)
        mesh = ax.pcolormesh(*edges, masked.T, cmap=TENSION_COLOURS, norm=norm, **cells)
        if _has_contours(x, y, values):
            _draw_contours(ax, x, y, masked, norm)
        elif x.values.size <= MAX_WRITTEN[0] and y.values.size <= MAX_WRITTEN[1]:
            _write_values(ax, x, y, values, norm)
    _mark_runs(ax, x, y, outcomes.marks)
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
    """Return whether contour lines help: over enough numbers, of a quantity that varies."""
    over_numbers = not x.labels and not y.labels
    return over_numbers and min(values.shape) >= MIN_FOR_CONTOURS and not is_constant(values)


def _draw_contours(ax: Any, x: KeyAxis, y: KeyAxis, masked: Any, norm: Normalize) -> None:
    locator = LogLocator() if isinstance(norm, LogNorm) else MaxNLocator(CONTOURS)
    levels = [
        level
        for level in locator.tick_values(norm.vmin or 0.0, norm.vmax or 0.0)
        if MIN_DISTANCE < norm(level) < 1.0 - MIN_DISTANCE
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
    for text in ax.clabel(lines, fontsize=7, fmt=picture_text):
        text.set_path_effects(stroke)


def _write_values(ax: Any, x: KeyAxis, y: KeyAxis, values: "Array", norm: Normalize) -> None:
    """Write the value into each cell."""
    for i, column in enumerate(x.values):
        for j, row in enumerate(y.values):
            value = values[i, j]
            if np.isfinite(value):
                colour = "white" if norm(value) < DARK else BLACK
                text = picture_text(value, 3)
                ax.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)


def legend_of_map(marks: dict[str, str]) -> list[Any]:
    """Return legend texts of cells without a valid value, by marker name."""
    handles: list[Any] = []
    for name, text in marks.items():
        if name == "not defined":
            handles.append(Patch(facecolor="white", edgecolor=GREY, hatch=HATCH, label=text))
        elif name == "not run":
            handles.append(Patch(facecolor="white", edgecolor=GREY, label=text))
        else:
            handles.append(Line2D([], [], linestyle="", **MARKS[name], label=text))
    return handles


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
    defined = values[np.isfinite(values)]
    ax.hist(defined, bins=_bins(defined), color=SKY, edgecolor=BLACK, linewidth=0.4)
    ax.locator_params(axis="x", nbins=6)  # more labels would touch each other
    s = statistics
    for style, places in zip(
        LINES.values(), ((s.mean,), (s.quantile_50,), (s.quantile_5, s.quantile_95)), strict=True
    ):
        for place in places:
            ax.axvline(place, **style)
    spread = f", standard deviation {picture_text(s.standard_deviation)}"
    deviation = "" if np.isnan(s.standard_deviation) else spread
    low, median, high = (picture_text(value, 5) for value in s[3:])
    lines = [
        with_unit(f"mean {picture_text(s.mean, 5)}{deviation}", unit),
        with_unit(f"5 %: {low}, 50 %: {median}, 95 %: {high}", unit),
    ]
    if s.runs < values.size:
        lines.append(f"from {s.runs} of {values.size} runs; the others failed or do not define it")
    ax.set_title("\n".join(lines), fontsize="x-small", loc="left")


def _bins(values: "Array") -> Any:
    """Return the edges of the bins; a quantity that does not vary has one."""
    if is_constant(values):
        return np.array(limits_of(values))
    edges = np.histogram_bin_edges(values, "rice")
    return edges if edges.size <= MAX_BINS else np.linspace(*limits_of(values), MAX_BINS + 1)


def draw_tornado(ax: Any, keys: Sequence[str], indices: SobolIndices) -> None:
    """Draw the indices of each key as bars, the largest total index at the top."""
    if not indices.exist:
        write(ax, indices.basis)
        return
    grid(ax)
    first, total = indices.values[:3], indices.values[3:]  # each with the ends of its interval
    order = np.argsort(-total[0], kind="stable")[:MAX_BARS]
    names = short_keys(keys)
    places = np.arange(order.size, dtype=np.float64)
    for style, (values, *ends), offset in (
        (BARS["first-order index"], first[:, order], -0.5 * THICKNESS),
        (BARS["total index"], total[:, order], 0.5 * THICKNESS),
    ):
        ax.barh(places + offset, values, THICKNESS, **style)
        around = np.abs(np.array(ends) - values)
        bar = {"ecolor": BLACK, "elinewidth": 1.0, "capsize": 2.0}
        ax.errorbar(values, places + offset, xerr=around, fmt="none", **bar)
    labels = [literal(_cut_left(names[i])) for i in order]
    ax.set_yticks(places, labels=labels, **LITERAL)
    ax.set_ylim(order.size - 0.5, -0.5)
    drawn = indices.values[:, order]
    low, high = float(np.nanmin(drawn)), float(np.nanmax(drawn))
    ax.set_xlim(max(-MAX_INDEX, min(0.0, 1.05 * low)), min(MAX_INDEX, max(1.0, 1.05 * high)))
    ax.tick_params(labelsize="small")
    ax.set_xlabel("part of the variance", fontsize="small")
    rest = len(keys) - order.size
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
    handles: list[Any] = [Line2D([], [], **style, label=name) for name, style in LINES.items()]
    if with_indices:
        handles += [Patch(**style, label=name) for name, style in BARS.items()]
    return handles
