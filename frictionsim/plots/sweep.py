"""Pictures of sweeps: curves over one key, maps over two, histograms and indices of samples.

Those quantities are drawn that vary and equal no varied key and none before them, MAX_PANELS at
most in the order of `varying_quantities`. Of a grid

- with one key of several values: a curve of each quantity; over a key of text: points;
- with two: a map of each quantity; if one has few texts as values: a curve for each of them;
- with three: one quantity, a panel for each value of the third key: the last one of text, else the
  last one.

No line joins the two sides of a jump. Runs without a sound value are marked, and counted in the
legend.
"""

from collections.abc import Mapping, Sequence
from textwrap import fill, shorten
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    TENSION_COLOURS,
    VERMILION,
    cut_text,
    picture_text,
    study_text,
    with_unit,
)
from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.io.sweep_table import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    NOT_RUN,
    RUN,
    SobolIndices,
    SweepTable,
)
from frictionsim.plots.style import (
    MARKERS,
    MAX_LINES,
    Look,
    add_legend,
    axis_label,
    check_drawn,
    line_look,
    new_figure,
    plain,
    quantity_label,
    set_height,
    set_title,
    short_overrides,
)
from frictionsim.scenario.model_fields import names_in
from frictionsim.sweeps.design import SAMPLE
from frictionsim.sweeps.statistics import (
    independent_runs,
    indices_of,
    is_constant,
    jumps_between,
    sampling_of,
    short_keys,
    sound_values,
    statistics_of,
    varying_quantities,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.io.sweep_table import Coordinate
    from frictionsim.results import Array

MAX_PANELS, MAX_KEYS, COLUMNS = 6, 3, 2
HEADING, CURVES, MAPS, SAMPLES = 0.9, 2.1, 2.7, 2.0  # inches, of titles and of rows of panels
MAX_WORD, MAX_SHOWN = 30, 8  # letters of a name; values of a key in a message
MAX_CELLS = (6, 8)  # columns and rows of cells with their values written in them
LOG_RATIO = 1e3  # of the largest value to the least, above which a scale is logarithmic
# At the lower edge of a panel or in a cell, or around the value of a run with a failed audit.
MARKS: dict[str, Look] = {
    "failed": {"marker": "x", "color": VERMILION, "ms": 6, "mew": 1.6, "ls": ""},
    "not defined": {"marker": "v", "color": GREY, "ms": 5, "fillstyle": "none", "ls": ""},
    "not run": {"marker": "_", "color": BLACK, "ms": 7, "mew": 1.5, "ls": ""},
    "audit failed": {"marker": "D", "color": VERMILION, "ms": 6, "fillstyle": "none", "ls": ""},
}


class KeyAxis(NamedTuple):
    """A varied key along an axis."""

    key: str
    unit: str
    values: Any  # (n,); in ascending order; of text, or if values are equal, the numbers from 0
    order: Any  # (n,) of int; the place of each in the sweep
    labels: tuple[str, ...] = ()  # of text; empty for numbers

    @property
    def log(self) -> bool:
        """Whether the numbers are spaced evenly in their logarithms rather than in themselves."""
        if self.labels or self.values.size < 3 or self.values[0] <= 0.0:
            return False
        steps, ratios = np.diff(self.values), np.diff(np.log(self.values))
        wide = self.values[-1] >= 3.0 * self.values[0]  # else it shows nothing more
        uneven = float(ratios.max() / ratios.min())
        return bool(wide and uneven < min(1.6, steps.max() / steps.min()))

    @property
    def edges(self) -> Any:
        """The edges of the cells around the values, halfway between them."""
        if self.values.size == 1:
            half = 0.5 * abs(self.values[0]) or 0.5
            return np.array([self.values[0] - half, self.values[0] + half])
        values = np.log(self.values) if self.log else self.values
        middle = 0.5 * (values[1:] + values[:-1])
        edges = np.array([2.0 * values[0] - middle[0], *middle, 2.0 * values[-1] - middle[-1]])
        return np.exp(edges) if self.log else edges

    def text(self, place: int) -> str:
        """Return a value with its unit; `place` is that along the axis."""
        if self.labels:
            return cut_text(self.labels[place], MAX_WORD)
        return with_unit(study_text(self.values[place]), self.unit)

    def prepare(self, ax: Any, side: str) -> None:
        """Give the x or y axis of Axes its scale and label, and ticks at the values of text."""
        ax.set(**{f"{side}label": axis_label(",\n".join(names_in(self.key)), self.unit, 60)})
        if self.log:
            ax.set(**{f"{side}scale": "log"})
        if self.labels:
            step = -(-len(self.labels) // 20)
            texts = [plain(cut_text(label, MAX_WORD)) for label in self.labels[::step]]
            long = side == "x" and len("".join(texts)) > 40
            turned = {"rotation": 30, "ha": "right"} if long else {}
            getattr(ax, f"set_{side}ticks")(self.values[::step], labels=texts, **turned)


def key_axis(key: str, coordinate: "Coordinate") -> KeyAxis:
    """Return the axis of a varied key."""
    values = coordinate.values
    if not coordinate.is_number:
        texts = values if isinstance(values, list) else [("false", "true")[int(v)] for v in values]
        places = np.arange(len(texts))
        return KeyAxis(key, "", places.astype(float), places, tuple(texts))
    numbers = np.asarray(values, dtype=float)
    order = np.argsort(numbers, kind="stable")
    numbers, labels = numbers[order], tuple[str, ...]()
    if (np.diff(numbers) <= 0.0).any():  # equal ones are side by side
        numbers, labels = np.arange(float(numbers.size)), tuple(map(study_text, numbers))
    return KeyAxis(key, coordinate.unit, numbers, order, labels)


def draw_sweep(
    table: SweepTable,
    quantities: Sequence[str] = (),
    at: Mapping[str, Any] | None = None,
    figure: "Figure | SubFigure | None" = None,
) -> Any:
    """Draw a sweep into an empty figure or a new one; return it.

    By default the first quantities that vary; `at` has by key of a grid the value that is drawn.
    """
    _check(table, quantities)
    design = table.attributes["design"]
    if at and RUN in table.dimensions:
        raise ArgumentError("at", f"it applies to a grid; this sweep is a {design}")
    figure = new_figure() if figure is None else figure
    if design == SAMPLE:
        _draw_sample(table, quantities, figure)
    else:
        _draw_grid(table, quantities, figure, *_axes_of(table, at or {}))
    return figure


def _check(table: SweepTable, quantities: Sequence[str]) -> None:
    """Check that there is something to draw, and that a scale of it does not overflow."""
    if not table.values:
        reasons = [*table.texts["reason"].values(), "no run is done"]
        raise InputError(f"cannot draw this sweep: no run has quantities ({reasons[0]})")
    for name in quantities:
        if name not in table.values:
            raise InputError(unknown("quantity", name, list(table.values)))
    if len(quantities) > MAX_PANELS:
        raise ArgumentError(
            "view",
            f"expected at most {MAX_PANELS} quantities in a picture, got {len(quantities)}; draw"
            " them in several pictures",
        )
    keys = {k: c.values for k, c in table.coordinates.items() if not isinstance(c.values, list)}
    check_drawn("sweep", keys, table.values)


def _axes_of(table: SweepTable, at: Mapping[str, Any]) -> tuple[list[KeyAxis], Any, list[str]]:
    """Return the axes of the keys with several values, the runs in their shape, and notes."""
    if RUN in table.dimensions:  # values together: over the first key of numbers
        axes = [key_axis(*item) for item in table.coordinates.items()]
        axis = next((axis for axis in axes if not axis.labels), axes[0])
        others = [other.key for other in axes if other is not axis]
        notes = [f"together with {', '.join(short_keys(others))}"] if others else []
        return [axis], np.asarray(axis.order), notes
    for key in at:
        if key not in table.dimensions:
            raise ArgumentError("at", unknown("varied key", key, list(table.dimensions)))
    runs: Any = np.arange(table.runs).reshape(table.shape)
    several = [key for key, size in table.dimensions.items() if size > 1 and key not in at]
    single = [] if several else [next(iter(table.dimensions))]  # a run is a point over its key
    drawn: list[KeyAxis] = []
    fixed: list[str] = []
    for key in table.dimensions:
        axis = key_axis(key, table.coordinates[key])
        runs = runs.take(axis.order, axis=len(drawn))
        if key in several:
            drawn.append(axis)
            continue
        place = _place(axis, at[key]) if key in at else 0
        if key in single:
            runs = runs.take([place], axis=0)
            values = np.zeros(1) if axis.labels else axis.values[[place]]
            drawn.append(axis._replace(values=values, labels=axis.labels[place : place + 1]))
        else:
            runs = runs.take(place, axis=len(drawn))
            fixed.append(f"{key} = {axis.text(place)}")
    return drawn, runs, fixed


def _place(axis: KeyAxis, wanted: Any) -> int:
    """Return the place of a value along its axis."""
    text = str(wanted).strip().strip("\"'")
    known = [label.strip('"') for label in axis.labels]
    for candidate in (text, text.lower()):
        if candidate in known:
            return known.index(candidate)
    shown = list(axis.labels) or list(map(study_text, axis.values))
    try:
        off = np.abs(axis.values - float(wanted))
        if not axis.labels and off.min() <= 1e-9 * np.abs(axis.values).max():
            return int(np.argmin(off))
    except (TypeError, ValueError):
        pass
    if len(shown) > MAX_SHOWN:
        shown = [*shown[: MAX_SHOWN - 1], "...", shown[-1]]
    said = f"{axis.key}: the sweep has no value {text}; it has {', '.join(shown)}"
    raise ArgumentError("at", said)


class _Panel(NamedTuple):
    """A panel: its quantity, its runs in the shape of the axes, and its title."""

    name: str
    runs: Any
    title: str = ""


def _draw_grid(
    table: SweepTable,
    quantities: Sequence[str],
    figure: "Figure | SubFigure",
    axes: list[KeyAxis],
    runs: Any,
    notes: list[str],
) -> None:
    """Draw each quantity into a panel; with three keys one of them, for each value of the third."""
    keys, drawn = [axis.key for axis in axes], runs.size
    third = _third(axes, quantities) if len(axes) > 2 else None
    names, more = list(quantities), list[str]()
    if not names:
        names, more = chosen(table, runs, 1 if third is not None else MAX_PANELS)
    panels = [_Panel(name, runs) for name in names]
    if third is not None:
        axis = axes.pop(third)
        titles = [f"{axis.key} = {axis.text(i)}" for i in range(axis.values.size)]
        panels = [_Panel(names[0], runs.take(i, axis=third), t) for i, t in enumerate(titles)]
    is_map = len(axes) == 2
    if is_map and bool(axes[0].labels) != bool(axes[1].labels):
        if axes[0].labels:
            axes = axes[::-1]
            panels = [panel._replace(runs=panel.runs.T) for panel in panels]
        is_map = axes[1].values.size > MAX_LINES
    places = _places(figure, len(panels), MAPS if is_map else CURVES, sharey=third is not None)
    for ax, panel in zip(places, panels, strict=True):
        ax.set_title(plain(panel.title), fontsize="small")
        draw = _draw_map if is_map else _draw_curves
        draw(ax, table, panel, axes, runs if third is not None else panel.runs)
    for ax in places[:-COLUMNS] if len(panels) > 1 else []:
        ax.set_xlabel("")
    for ax in places[1::2] if is_map else []:
        ax.set_ylabel("")
    figure.align_ylabels(places)
    _title(figure, table, keys, [*notes, *more], drawn)
    curves = places[0].lines[: axes[1].values.size] if len(axes) == 2 and not is_map else []
    words = [f"{short_keys([axes[1].key])[0]} = {axes[1].text(i)}" for i in range(len(curves))]
    handles = dict(zip(words, curves, strict=True)) | _marks_drawn(table, panels, curves)
    add_legend(figure, handles, columns=3)


def _third(axes: list[KeyAxis], quantities: Sequence[str]) -> int:
    """Return which key has a panel for each value: the last of text, else the last."""
    third = max((i for i, axis in enumerate(axes) if axis.labels), default=len(axes) - 1)
    axis = axes[third]
    example = axis.labels[0] if axis.labels else repr(float(axis.values[0]))
    if len(axes) > MAX_KEYS:
        keys = ", ".join(axis.key for axis in axes)
        raise ArgumentError(
            "at",
            f"{len(axes)} keys have several values ({keys}), a picture shows {MAX_KEYS} at most;"
            " give values of the others",
        )
    if axis.values.size > MAX_PANELS:
        raise ArgumentError(
            "at",
            f"three keys have several values, and {axis.key} has {axis.values.size}, more than the"
            f" {MAX_PANELS} panels of a picture; give a value of it, e.g. {example}",
        )
    if len(quantities) > 1:
        raise ArgumentError(
            "view",
            "with three keys of several values a picture shows one quantity, got"
            f" {len(quantities)}; give one, or a value of {axis.key} as 'at', e.g. {example}",
        )
    return third


def chosen(table: SweepTable, runs: Any, count: int = MAX_PANELS) -> tuple[list[str], list[str]]:
    """Return the first quantities that tell something of some runs, and a note on the others.

    Those that do not vary are drawn if there are no others.
    """
    varying = varying_quantities(table, runs)
    candidates = varying or list(table.values)
    defined = any(np.isfinite(sound_values(table, name)[runs]).any() for name in table.values)
    several = isinstance(runs, slice) or runs.size > 1
    notes = ["no quantity varies"] if defined and several and not varying else []
    if len(candidates) > count:
        notes.append(f"{count} of {len(candidates)} quantities{' that vary' if varying else ''}")
    return candidates[:count], notes


def _marks(table: SweepTable, name: str, runs: Any) -> dict[str, Any]:
    """Return which runs have which mark."""
    status, missing = table.status[runs], ~np.isfinite(table.values[name][runs])
    return {
        "failed": status == FAILED,
        "not defined": missing & np.isin(status, (DONE, AUDIT_FAILED)),
        "not run": status == NOT_RUN,
        "audit failed": (status == AUDIT_FAILED) & ~missing,
    }


def values_of(table: SweepTable, name: str, runs: Any) -> "Array":
    """Return a quantity of runs that are done, whatever their audit; else NaN."""
    done = np.isin(table.status[runs], (DONE, AUDIT_FAILED))
    return np.where(done, table.values[name][runs], np.nan)


def _draw_curves(
    ax: Any, table: SweepTable, panel: _Panel, axes: Sequence[KeyAxis], scaled: Any
) -> None:
    """Draw a quantity over the first key, with a curve for each text of the second one."""
    x, columns = axes[0].values, panel.runs.reshape(axes[0].values.size, -1)
    axes[0].prepare(ax, "x")
    ax.set_ylabel(label_of(table, panel.name))
    ax.grid(visible=True)
    known = values_of(table, panel.name, scaled)
    norm = norm_of(known) if np.isfinite(known).any() else None
    values, marks = sound_values(table, panel.name)[columns], _marks(table, panel.name, columns)
    several = columns.shape[1] > 1
    whole = not (known[np.isfinite(known)] % 1.0).any()
    counts = whole and table.units[panel.name] == "1"
    for i, y in enumerate(values.T):
        height = np.log(y) if isinstance(norm, LogNorm) else y
        jumps = jumps_between(x, height)
        if axes[0].log:
            jumps &= jumps_between(np.log(x), height)
        places = np.arange(1, x.size)[jumps]
        look = line_look(i) | {"marker": MARKERS[i % len(MARKERS)]}
        look["markersize"] = 4 if x.size <= 60 else 2
        if axes[0].labels or counts:
            look["linestyle"] = ""
        ax.plot(np.insert(x, places, np.nan), np.insert(y, places, np.nan), **look)
    for n, (mark, own) in enumerate(MARKS.items()):
        for i, at in enumerate(marks[mark].T):
            look = own | {"color": line_look(i)["color"]} if several else own
            if at.any() and mark == "audit failed":
                ax.plot(x[at], table.values[panel.name][columns[at, i]], **look)
            elif at.any():
                low = np.full(at.sum(), 0.03 + 0.05 * i + 0.01 * n)
                ax.plot(x[at], low, transform=ax.get_xaxis_transform(), **look)
    if norm is None:
        ax.set_yticks([])
        return
    if isinstance(norm, LogNorm):
        ax.set_yscale("log")
    below = any(marks[mark].any() for mark in MARKS if mark != "audit failed")
    ax.margins(x=0.03, y=0.1 + 0.06 * columns.shape[1] * below)  # marks are below all values
    if is_constant(known):
        ax.set_ylim(norm.vmin, norm.vmax)


def norm_of(values: "Array") -> Normalize:
    """Return the scale of the values of a quantity, of which one is finite."""
    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    if is_constant(known):
        half = 0.1 * max(abs(low), abs(high)) or 1.0
        low, high = low - half, high + half
    return LogNorm(low, high) if low > 0.0 and high >= LOG_RATIO * low else Normalize(low, high)


def _draw_map(
    ax: Any, table: SweepTable, panel: _Panel, axes: Sequence[KeyAxis], scaled: Any
) -> None:
    """Draw a quantity over two keys as cells; few cells have their values written in them."""
    x, y = axes
    x.prepare(ax, "x")
    y.prepare(ax, "y")
    ax.set_facecolor("#EEEEEE")
    values, label = values_of(table, panel.name, panel.runs), label_of(table, panel.name)
    if np.isfinite(values).any():
        norm = norm_of(values_of(table, panel.name, scaled))
        look: Look = {"cmap": TENSION_COLOURS, "norm": norm, "rasterized": values.size > 5000}
        mesh = ax.pcolormesh(x.edges, y.edges, np.ma.masked_invalid(values).T, **look)
        ax.figure.colorbar(mesh, ax=ax, label=label)
        few = x.values.size <= MAX_CELLS[0] and y.values.size <= MAX_CELLS[1]
        for i, j in np.argwhere(np.isfinite(values)) if few else ():
            colour = "white" if norm(values[i, j]) < 0.5 else BLACK
            at = {"ha": "center", "va": "center", "fontsize": "x-small", "color": colour}
            ax.text(x.values[i], y.values[j], picture_text(values[i, j], 3), **at)
    else:
        ax.set_title(f"{label}: no values", fontsize="small")
    for mark, where in _marks(table, panel.name, panel.runs).items():
        columns, rows = np.nonzero(where)
        if columns.size:
            ax.plot(x.values[columns], y.values[rows], **MARKS[mark])
    ax.set(xlim=x.edges[[0, -1]], ylim=y.edges[[0, -1]])


def _marks_drawn(table: SweepTable, panels: Sequence[_Panel], curves: Any) -> dict[str, Any]:
    """Return the marks by words, with the number of their runs; black beside several curves."""
    handles: dict[str, Any] = {}
    for mark, look in MARKS.items():
        runs: dict[str, int] = {}
        for panel in panels:
            count = int(_marks(table, panel.name, panel.runs)[mark].sum())
            runs[panel.name] = runs.get(panel.name, 0) + count
        some = sorted({count for count in runs.values() if count})
        if some:
            several = f"{some[0]} to {some[-1]}" if len(some) > 1 else f"{some[0]}"
            words = f"{mark}: {several} run{'' if several == '1' else 's'}"
            black = {"color": BLACK} if curves else {}
            handles[words] = Line2D([], [], **(look | black))
    return handles


LINES: dict[str, Look] = {
    "mean": {"color": VERMILION, "linestyle": "-", "linewidth": 1.8},
    "50 %": {"color": BLACK, "linestyle": (0, (6, 2)), "linewidth": 1.3},
    "5 % and 95 %": {"color": BLACK, "linestyle": (0, (2, 1.5)), "linewidth": 1.3},
}
BARS = {"first-order index": BLUE, "total index": SKY}
MAX_BINS, MAX_BARS = 50, 8
MAX_INDEX = 2.0  # at the end of the scale; that of an estimate may be above 1


def _draw_sample(
    table: SweepTable, quantities: Sequence[str], figure: "Figure | SubFigure"
) -> None:
    """Draw histogram and indices of each quantity in a row; without indices no room for them."""
    sampling = sampling_of(table)
    runs = independent_runs(table, sampling)
    names, notes = (list(quantities), list[str]()) if quantities else chosen(table, runs)
    wanted = sampling is not None and sampling.indices and len(table.coordinates) > 1
    indices = indices_of(table, names) if wanted else {}
    bars = max(0, min(len(table.coordinates), MAX_BARS) - 2) if indices else 0
    set_height(figure, HEADING + (SAMPLES + 0.28 * bars) * len(names))
    axes = figure.subplots(len(names), 2 if indices else 1, squeeze=False)
    for (left, *right), name in zip(axes, names, strict=True):
        _draw_histogram(left, table, name, sound_values(table, name)[runs])
        for ax in right:
            _draw_tornado(ax, list(table.coordinates), indices[name])
    if sampling is not None:
        independent = f", {runs.stop} independent runs" if sampling.indices else ""
        notes.insert(0, f"{sampling.method} sample{independent}")
    _title(figure, table, list(table.coordinates), notes, table.runs)
    handles: dict[str, Any] = {name: Line2D([], [], **look) for name, look in LINES.items()}
    bar = {name: Patch(facecolor=colour, edgecolor=BLACK) for name, colour in BARS.items()}
    add_legend(figure, handles | (bar if indices else {}), columns=5)


def _draw_histogram(ax: Any, table: SweepTable, name: str, values: "Array") -> None:
    """Draw how often a quantity has which values, with its mean and quantiles."""
    unit, s = table.units[name], statistics_of(values)
    ax.set_xlabel(quantity_label(name, unit, 60), fontsize="small")
    ax.set_ylabel("runs", fontsize="small")
    if not s.runs:
        _write(ax, "not defined in any run")
        return
    known = values[np.isfinite(values)]
    norm, bins = norm_of(known), min(int(2.0 * known.size ** (1.0 / 3.0)) + 1, MAX_BINS)
    ends = norm.vmin, norm.vmax
    ax.hist(known, bins=bins, range=ends, color=SKY, edgecolor=BLACK, linewidth=0.4)
    ax.locator_params(axis="x", nbins=6)
    places = ((s.mean,), (s.quantile_50,), (s.quantile_5, s.quantile_95))
    for look, at in zip(LINES.values(), places, strict=True):
        for place in at:
            ax.axvline(place, **look)
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


def _draw_tornado(ax: Any, keys: Sequence[str], indices: SobolIndices) -> None:
    """Draw the indices of each key as bars, the largest total index at the top."""
    if not indices.exist:
        _write(ax, indices.basis)
        return
    first, total = indices.values[:3], indices.values[3:]  # each with the ends of its interval
    order = np.argsort(-total[0], kind="stable")[:MAX_BARS]
    places = np.arange(order.size, dtype=float)
    for (name, colour), (values, *ends), up in zip(
        BARS.items(), (first, total), (-1, 1), strict=True
    ):
        around = np.abs(np.array(ends)[:, order] - values[order])
        look: Look = {"facecolor": colour, "edgecolor": BLACK, "linewidth": 0.6, "label": name}
        error: Look = {"elinewidth": 1.0, "capsize": 2.0, "ecolor": BLACK}
        ax.barh(places + 0.19 * up, values[order], 0.38, xerr=around, error_kw=error, **look)
    names = short_keys(keys)
    ax.set_yticks(
        places, labels=[plain(cut_text(names[i], MAX_WORD)) for i in order], fontsize="small"
    )
    ax.set_ylim(order.size - 0.5, -0.5)
    low, high = (float(of(indices.values[:, order])) for of in (np.nanmin, np.nanmax))
    ax.set_xlim(max(-MAX_INDEX, min(0.0, 1.05 * low)), min(MAX_INDEX, max(1.0, 1.05 * high)))
    ax.grid(visible=True)
    ax.set_xlabel("part of the variance", fontsize="small")
    rest = len(keys) - order.size
    more = f"; {rest} keys with smaller indices are not shown" if rest else ""
    ax.set_title(fill(indices.basis + more, 52), fontsize="x-small", loc="left")


def _write(ax: Any, text: str) -> None:
    """Write a text instead of a drawing."""
    ax.set(xticks=[], yticks=[], ylabel="")
    where: Look = {"ha": "center", "va": "center", "fontsize": "small", "transform": ax.transAxes}
    ax.text(0.5, 0.5, fill(text, 42), **where)


def label_of(table: SweepTable, name: str) -> str:
    """Return the label of a quantity with its unit."""
    return quantity_label(name, table.units[name], MAX_WORD)


def _places(figure: "Figure | SubFigure", count: int, row: float, sharey: bool) -> list[Any]:
    """Return the Axes of panels, in one column or two."""
    columns = 1 if count == 1 else COLUMNS
    rows = -(-count // columns)
    set_height(figure, HEADING + (1.6 if rows == 1 else 1.0) * row * rows)
    axes = figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False)
    flat = list(axes.ravel())
    for empty in flat[count:]:
        empty.remove()
        axes[-2, -1].xaxis.set_tick_params(labelbottom=True)
    return flat[:count]


def _title(
    figure: "Figure | SubFigure",
    table: SweepTable,
    keys: Sequence[str],
    notes: Sequence[str],
    drawn: int,
) -> None:
    """Give a figure the title of a sweep: its varied keys, and the number of runs drawn."""
    attributes = table.attributes
    number = {status: table.count(status) for status in (NOT_RUN, FAILED, AUDIT_FAILED)}
    parts = [*short_overrides(attributes), *notes]
    if number[NOT_RUN]:
        parts.append(f"{attributes['status']}: {table.runs - number[NOT_RUN]} of {table.runs} runs")
    else:
        some = f"{drawn} of " if drawn < table.runs else ""
        parts.append(f"{some}{table.runs} run{'' if table.runs == 1 else 's'}")
    for status, words in ((FAILED, "failed"), (AUDIT_FAILED, "with a failed audit")):
        if number[status]:
            parts.append(f"{number[status]} {words}")
    names = short_keys(keys)
    first = ", ".join(names[:-1])
    varied = f"{first} and {names[-1]}" if first else names[-1]
    varied = varied if len(names) <= MAX_KEYS else f"{len(names)} keys"
    title = shorten(attributes["title"] or attributes["kind"], 240, placeholder="…")
    set_title(figure, f"{title}: sweep over {varied}\n({'; '.join(parts)})")
