"""Pictures of sweeps: curves over one key, maps over two, histograms and indices of samples.

Those quantities are drawn that vary and equal no varied key and none before them, MAX_PANELS at
most in the order of `telling`. Of a grid

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
    picture_text,
    short_names,
    study_text,
    with_unit,
)
from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.io.sweep_table import AUDIT_FAILED, DONE, FAILED, NOT_RUN, SobolIndices, SweepTable
from frictionsim.plots.style import (
    MAX_LINES,
    Look,
    add_legend,
    axis_label,
    line_look,
    new_figure,
    plain,
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
    sound_values,
    statistics_of,
    telling,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.io.sweep_table import Coordinate
    from frictionsim.results import Array

MAX_PANELS, MAX_KEYS, COLUMNS = 6, 3, 2
MAX_DRAWN = 1e100  # a scale of larger numbers would overflow
HEADING, CURVES, MAPS, SAMPLES = 0.9, 2.1, 2.7, 2.0  # inches, of titles and of rows of panels
MAX_WORD, MAX_SHOWN = 30, 8  # letters of a name; values of a key in a message
MAX_CELLS = (6, 8)  # columns and rows of cells with their values written in them
LOG_RATIO = 1e3  # of the largest value to the least, above which a scale is logarithmic
MARKERS = ("o", "s", "^", "D", "v", "P", "*", "h")
# At the lower edge of a panel or in a cell, or around the value of a run with a failed audit.
MARKS: dict[str, Look] = {
    "failed": {"marker": "x", "color": VERMILION, "markersize": 6, "markeredgewidth": 1.6},
    "not defined": {"marker": "v", "color": GREY, "markersize": 5, "fillstyle": "none"},
    "not run": {"marker": "_", "color": BLACK, "markersize": 7, "markeredgewidth": 1.5},
    "audit failed": {"marker": "D", "color": VERMILION, "markersize": 6, "fillstyle": "none"},
}


class KeyAxis(NamedTuple):
    """A varied key along an axis.

    Attributes
    ----------
    key, unit : str
    values : (n,)
        In ascending order; of text, or if values are equal, the numbers from 0.
    order : (n,) of int
        The place of each in the sweep.
    labels : tuple of str
        Of text; empty for numbers.
    """

    key: str
    unit: str
    values: Any
    order: Any
    labels: tuple[str, ...] = ()

    @property
    def log(self) -> bool:
        """Whether the numbers are spaced evenly in their logarithms rather than in themselves."""
        if self.labels or self.values.size < 3 or self.values[0] <= 0.0:
            return False
        steps, ratios = np.diff(self.values), np.diff(np.log(self.values))
        unevenness = float(ratios.max() / ratios.min())
        wide = self.values[-1] >= 3.0 * self.values[0]  # else it shows nothing more
        return bool(wide and unevenness < min(1.6, steps.max() / steps.min()))

    @property
    def edges(self) -> Any:
        """The edges of the cells around the values, halfway between them."""
        values = np.log(self.values) if self.log else self.values
        middle = 0.5 * (values[1:] + values[:-1])
        if values.size == 1:
            middle = values + (0.5 * abs(values) or 0.5)
        ends = [2.0 * values[0] - middle[0]], [2.0 * values[-1] - middle[-1]]
        edges = np.concatenate((ends[0], middle, ends[1]) if values.size > 1 else (ends[0], middle))
        return np.exp(edges) if self.log else edges

    def text(self, place: int) -> str:
        """Return a value with its unit; `place` is that along the axis."""
        if self.labels:
            return shorten_word(self.labels[place])
        return with_unit(study_text(self.values[place]), self.unit)

    def plain(self, place: int) -> str:
        """Return a value as the argument `at` takes it."""
        return self.labels[place] if self.labels else repr(float(self.values[place]))

    def prepare(self, ax: Any, side: str) -> None:
        """Give the x or y axis of Axes its scale and label, and ticks at the values of text."""
        words = ",\n".join(names_in(self.key))
        ax.set(**{f"{side}label": axis_label(words, self.unit, 60)})
        if self.log:
            ax.set(**{f"{side}scale": "log"})
        if self.labels:
            step = -(-len(self.labels) // 20)
            texts = [plain(shorten_word(label)) for label in self.labels[::step]]
            turned = (
                {"rotation": 30, "ha": "right"} if side == "x" and len("".join(texts)) > 40 else {}
            )
            getattr(ax, f"set_{side}ticks")(self.values[::step], labels=texts, **turned)


def key_axis(key: str, coordinate: "Coordinate") -> KeyAxis:
    """Return the axis of a varied key."""
    values = coordinate.values
    if isinstance(values, list) or values.dtype in (np.bool_, np.int8):  # true and false
        texts = values if isinstance(values, list) else [("false", "true")[int(v)] for v in values]
        places = np.arange(len(texts))
        return KeyAxis(key, "", places.astype(float), places, tuple(texts))
    numbers = np.asarray(values, dtype=float)
    order = np.argsort(numbers, kind="stable")
    if (np.diff(numbers[order]) <= 0.0).any():
        places = np.arange(numbers.size)
        labels = tuple(map(study_text, numbers[order]))
        return KeyAxis(key, coordinate.unit, places.astype(float), order, labels)
    return KeyAxis(key, coordinate.unit, numbers[order], order)


def shorten_word(text: str) -> str:
    """Return a text that is not too long for a label."""
    return text if len(text) <= MAX_WORD else f"{text[: MAX_WORD - 1]}…"


def short_keys(keys: Sequence[str]) -> list[str]:
    """Return the shortest ends of keys that tell them apart, for labels in little space."""
    names = [name for key in keys for name in names_in(key)]
    short = dict(zip(names, short_names(names), strict=True))
    return [", ".join(short[name] for name in names_in(key)) for key in keys]


def draw_sweep(
    table: SweepTable,
    quantities: Sequence[str] = (),
    at: Mapping[str, Any] | None = None,
    figure: "Figure | SubFigure | None" = None,
) -> Any:
    """Draw a sweep into an empty figure or a new one; return it.

    Parameters
    ----------
    quantities : sequence of str
        By default the first ones that vary.
    at : mapping, optional
        By key of a grid, the one value of it that is drawn.
    """
    _check(table, quantities)
    figure = new_figure() if figure is None else figure
    if table.attributes["design"] == SAMPLE:
        if at:
            raise ArgumentError("at", "it applies to a grid; this sweep is a sample")
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
    for name, values in (keys | table.values).items():
        finite = np.asarray(values, dtype=float)[np.isfinite(values)]
        if np.abs(finite).max(initial=0.0) > MAX_DRAWN:
            raise InputError(f"cannot draw this sweep: '{name}' has numbers above {MAX_DRAWN:g}")


def _axes_of(table: SweepTable, at: Mapping[str, Any]) -> tuple[list[KeyAxis], Any, list[str]]:
    """Return the axes of the keys with several values, the runs in their shape, and notes."""
    if "run" in table.dimensions:  # values together: over the first key of numbers
        if at:
            design = table.attributes["design"]
            raise ArgumentError("at", f"it applies to a grid; this sweep is a {design}")
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
    free = several or [next(iter(table.dimensions))]  # a single run is a point over its first key
    drawn: list[KeyAxis] = []
    fixed: list[str] = []
    for key in table.dimensions:
        axis = key_axis(key, table.coordinates[key])
        runs = runs.take(axis.order, axis=len(drawn))
        place = _place(axis, at[key]) if key in at else 0
        if key not in free:
            runs = runs.take(place, axis=len(drawn))
            fixed.append(f"{key} = {axis.text(place)}")
            continue
        if key in at:
            runs = runs.take([place], axis=len(drawn))
            labels = axis.labels[place : place + 1]
            values = np.zeros(1) if labels else axis.values[place : place + 1]
            axis = axis._replace(values=values, labels=labels)
        drawn.append(axis)
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
    if len(axes) > MAX_KEYS:
        raise ArgumentError(
            "at",
            f"{len(axes)} keys have several values ({', '.join(keys)}), a picture shows {MAX_KEYS}"
            " at most; give values of the others",
        )
    names, more = list(quantities), list[str]()
    if len(axes) == MAX_KEYS:
        third, axis = _third(axes, quantities)
        names, more = (names, more) if names else chosen(table, runs, 1)
        axes = axes[:third] + axes[third + 1 :]
        titles = [f"{axis.key} = {axis.text(i)}" for i in range(axis.values.size)]
        panels = [_Panel(names[0], runs.take(i, axis=third), t) for i, t in enumerate(titles)]
    else:
        names, more = (names, more) if names else chosen(table, runs, MAX_PANELS)
        panels = [_Panel(name, runs) for name in names]
    is_map = len(axes) == 2
    if is_map and bool(axes[0].labels) != bool(axes[1].labels):
        if axes[0].labels:
            axes = axes[::-1]
            panels = [panel._replace(runs=panel.runs.T) for panel in panels]
        is_map = axes[1].values.size > MAX_LINES
    places = _places(figure, len(panels), MAPS if is_map else CURVES, sharey=bool(panels[0].title))
    for ax, panel in zip(places, panels, strict=True):
        ax.set_title(plain(panel.title), fontsize="small")
        draw = _draw_map if is_map else _draw_curves
        draw(ax, table, panel, axes, runs if panel.title else panel.runs)
    for ax in places[:-COLUMNS] if len(panels) > 1 else []:
        ax.set_xlabel("")
    for ax in places[1::2] if is_map else []:
        ax.set_ylabel("")
    figure.align_ylabels(places)
    _title(figure, table, keys, [*notes, *more], drawn)
    curves = places[0].lines[: axes[1].values.size] if len(axes) == 2 and not is_map else []
    names = [f"{short_keys([axes[1].key])[0]} = {axes[1].text(i)}" for i in range(len(curves))]
    handles = dict(zip(names, curves, strict=True)) | _marks_drawn(table, panels, curves)
    add_legend(figure, handles, columns=3)


def _third(axes: list[KeyAxis], quantities: Sequence[str]) -> tuple[int, KeyAxis]:
    """Return the key with a panel for each value: the last of text, else the last."""
    third = max((i for i, axis in enumerate(axes) if axis.labels), default=len(axes) - 1)
    axis = axes[third]
    if axis.values.size > MAX_PANELS:
        raise ArgumentError(
            "at",
            f"three keys have several values, and {axis.key} has {axis.values.size}, more than the"
            f" {MAX_PANELS} panels of a picture; give a value of it, e.g. {axis.plain(0)}",
        )
    if len(quantities) > 1:
        raise ArgumentError(
            "view",
            "with three keys of several values a picture shows one quantity, got"
            f" {len(quantities)}; give one, or a value of {axis.key} as 'at', e.g. {axis.plain(0)}",
        )
    return third, axis


def chosen(table: SweepTable, runs: Any, count: int = MAX_PANELS) -> tuple[list[str], list[str]]:
    """Return the first quantities that tell something of some runs, and a note on the others.

    Those that do not vary are drawn if there are no others.
    """
    varying = telling(table, runs)
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
    looks = []
    for i in range(columns.shape[1]):
        y = values[:, i]
        height = np.log(y) if isinstance(norm, LogNorm) else y
        jumps = jumps_between(x, height)
        if axes[0].log:
            jumps &= jumps_between(np.log(x), height)
        places = np.arange(1, x.size)[jumps]
        look = curve_look(i, x.size, is_joined(axes[0], y, table.units[panel.name]))
        ax.plot(np.insert(x, places, np.nan), np.insert(y, places, np.nan), **look)
        looks.append(look)
    for i, look in enumerate(looks):
        for n, (mark, own) in enumerate(MARKS.items()):
            at = marks[mark][:, i]
            if not at.any():
                continue
            own = own if columns.shape[1] == 1 else own | {"color": look["color"]}
            if mark == "audit failed":
                ax.plot(x[at], table.values[panel.name][columns[at, i]], linestyle="", **own)
            else:
                low = np.full(at.sum(), 0.03 + 0.05 * i + 0.01 * n)
                ax.plot(x[at], low, linestyle="", transform=ax.get_xaxis_transform(), **own)
    below = any(marks[mark].any() for mark in MARKS if mark != "audit failed")
    if norm is None:
        ax.set_yticks([])
        return
    if isinstance(norm, LogNorm):
        ax.set_yscale("log")
    ax.margins(x=0.03, y=0.1 + 0.06 * columns.shape[1] * below)  # marks are below all values
    if is_constant(known):
        ax.set_ylim(norm.vmin, norm.vmax)


def is_joined(axis: KeyAxis, values: "Array", unit: str) -> bool:
    """Return whether a line joins values: not those of texts, nor counts."""
    whole = values[np.isfinite(values)]
    counts = unit == "1" and whole.size and (whole == np.round(whole)).all() and np.ptp(whole) > 0.0
    return not axis.labels and not counts


def curve_look(number: int, points: int, joined: bool) -> Look:
    """Return the look of a curve: with a marker at each run."""
    look = line_look(number) | {"marker": MARKERS[number % len(MARKERS)]}
    look["markersize"] = 4 if points <= 60 else 2
    return look if joined else look | {"linestyle": ""}


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
            ax.plot(x.values[columns], y.values[rows], linestyle="", **MARKS[mark])
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
            handles[words] = Line2D([], [], linestyle="", **(look | black))
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
    ax.set_xlabel(axis_label(name.replace("_", " "), unit, 60), fontsize="small")
    ax.set_ylabel("runs", fontsize="small")
    if not s.runs:
        _write(ax, "not defined in any run")
        return
    known = values[np.isfinite(values)]
    norm = norm_of(known)
    edges = np.array([norm.vmin, norm.vmax])
    if not is_constant(known):
        edges = np.histogram_bin_edges(known, "rice")
        edges = np.linspace(edges[0], edges[-1], min(edges.size, MAX_BINS + 1))
    ax.hist(known, bins=edges, color=SKY, edgecolor=BLACK, linewidth=0.4)
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
    ax.set_yticks(places, labels=[plain(shorten_word(names[i])) for i in order], fontsize="small")
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
    return axis_label(name.replace("_", " "), table.units[name], MAX_WORD)


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
    varied = f"{len(names)} keys"
    if len(names) <= MAX_KEYS:
        varied = " and ".join([*([", ".join(names[:-1])] if names[:-1] else []), names[-1]])
    title = shorten(attributes["title"] or attributes["kind"], 240, placeholder="…")
    set_title(figure, f"{title}: sweep over {varied}\n({'; '.join(parts)})")
