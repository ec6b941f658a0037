"""Pictures of sweeps: curves over one key, maps over two, histograms and indices of samples.

Those quantities are drawn that vary, the first MAX_PANELS of the summary. Of a grid

- with one key of several values: a curve of each quantity; over a key of text: points;
- with two: a map of each quantity; if one has few texts as values: a curve for each of them;
- with three: one quantity, a panel for each value of the third key: the last one of text, else the
  last one.

Failed runs, runs that are left, runs with a failed audit, and values that are not defined are
marked, and counted in the legend.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.io.sweep_table import AUDIT_FAILED, FAILED, NOT_RUN, SweepTable
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.style import (
    MAX_LINES,
    USUAL,
    Appearance,
    add_legend,
    axis_label,
    set_title,
    short_overrides,
)
from frictionsim.plots.sweep_axes import (
    MAX_WORD,
    Face,
    KeyAxis,
    face_of,
    short_keys,
    shortened_key,
)
from frictionsim.plots.sweep_panels import (
    MAX_BARS,
    draw_curves,
    draw_histogram,
    draw_map,
    draw_tornado,
    legend_of,
    legend_of_curves,
    legend_of_map,
    legend_of_sample,
    norm_of,
    outcomes_of,
)
from frictionsim.sweeps.design import SAMPLE
from frictionsim.sweeps.sensitivity import indices_of
from frictionsim.sweeps.statistics import (
    independent_runs,
    is_constant,
    sound_values,
    statistics_of,
    variation,
)

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure


MAX_PANELS = 6
MAX_KEYS = 3
MAX_DRAWN = 1e100
COLUMNS = 2
KEY_BESIDE = 28  # characters of a line of a key beside a map
MAX_TITLE = 240  # characters
HEADING = 0.9  # inches, of title and labels of the axes
CURVES, MAPS, SAMPLES = 2.1, 2.7, 2.0  # inches of a row of panels
HEIGHT_OF_BAR = 0.28  # inches


def draw_sweep(
    table: SweepTable,
    quantities: Sequence[str] = (),
    at: Mapping[str, Any] | None = None,
    ax: Any = None,
    appearance: Appearance = USUAL,
) -> Figure:
    """Draw a sweep as a matplotlib figure.

    Parameters
    ----------
    quantities : sequence of str
        By default the first ones that vary.
    at : mapping, optional
        By key of a grid, the one value of it that is drawn.
    ax, appearance : optional
        As in `frictionsim.plots.draw`.
    """
    _check(table, quantities)
    if table.attributes["design"] == SAMPLE:
        if at:
            raise ArgumentError("at", "it applies to a grid; this sweep is a sample")
        return drawn_in(
            lambda target: _draw_sample(table, quantities, target), ax, appearance=appearance
        )
    face = face_of(table, at or {})
    if len(face.axes) > MAX_KEYS:
        keys = ", ".join(axis.key for axis in face.axes)
        raise ArgumentError(
            "at",
            f"{len(face.axes)} keys have several values ({keys}), a picture shows {MAX_KEYS} at"
            " most; give values of the others",
        )
    third = _third(face, quantities) if len(face.axes) == MAX_KEYS else None
    return drawn_in(
        lambda target: _draw_face(table, face, third, quantities, target), ax, appearance=appearance
    )


def _third(face: Face, quantities: Sequence[str]) -> int:
    """Return the number of the key with a panel for each value: the last of text, else the last."""
    text_axes = [number for number, axis in enumerate(face.axes) if axis.labels]
    third = text_axes[-1] if text_axes else MAX_KEYS - 1
    axis = face.axes[third]
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
    return third


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
    numbers = {
        key: c.values for key, c in table.coordinates.items() if not isinstance(c.values, list)
    }
    for name, values in (numbers | table.values).items():
        finite = values[np.isfinite(values)]
        if finite.size and max(abs(float(finite.max())), abs(float(finite.min()))) > MAX_DRAWN:
            raise InputError(f"cannot draw this sweep: '{name}' has numbers above {MAX_DRAWN:g}")


def chosen(table: SweepTable, runs: Any, count: int = MAX_PANELS) -> tuple[list[str], list[str]]:
    """Return the first quantities of the summary that vary in some runs, and a note on the others.

    Those that do not vary are drawn if there are no others.
    """
    varying = [name for name in table.values if not is_constant(sound_values(table, name)[runs])]
    candidates = varying or list(table.values)
    defined = any(np.isfinite(sound_values(table, name)[runs]).any() for name in table.values)
    several = not isinstance(runs, np.ndarray) or runs.size > 1
    notes = ["no quantity varies"] if defined and several and not varying else []
    if len(candidates) > count:
        notes.append(f"{count} of {len(candidates)} quantities{' that vary' if varying else ''}")
    return candidates[:count], notes


class _QuantityPanel(NamedTuple):
    """A panel: its quantity, its runs in the shape of the axes, and its title."""

    name: str
    runs: Any
    title: str = ""


class _Layout(NamedTuple):
    """How the panels are drawn: as maps, or as curves over the first key."""

    axes: tuple[KeyAxis, ...]
    is_map: bool
    joined: bool


def _layout(axes: tuple[KeyAxis, ...], runs: Any, joined: bool) -> tuple[_Layout, Any]:
    """Return the layout of runs over one or two keys, and the runs in its shape."""
    if len(axes) == 1:
        return _Layout(axes, False, joined and not axes[0].labels), runs
    one, other = axes
    if bool(one.labels) != bool(other.labels):
        if one.labels:
            one, other, runs = other, one, runs.T
        if other.values.size <= MAX_LINES:
            return _Layout((one, other), False, True), runs
    return _Layout((one, other), True, False), runs


def _draw_face(
    table: SweepTable,
    face: Face,
    third: int | None,
    quantities: Sequence[str],
    figure: "Figure | SubFigure",
) -> None:
    """Draw each quantity into a panel; with three keys one of them, for each value of the third."""
    names, notes = list(quantities), list(face.fixed)
    if not names:
        names, note = chosen(table, face.runs, MAX_PANELS if third is None else 1)
        notes += note
    axes = face.axes
    if third is None:
        layout, runs = _layout(axes, face.runs, face.joined)
        panels = [_QuantityPanel(name, runs) for name in names]
    else:
        axis, rest = axes[third], axes[:third] + axes[third + 1 :]
        panels = []
        for place in range(axis.values.size):
            layout, runs = _layout(rest, face.runs.take(place, axis=third), True)
            key = shortened_key(axis.key)
            panels.append(_QuantityPanel(names[0], runs, f"{key} = {axis.text(place)}"))
    height = MAPS if layout.is_map else CURVES
    places = _panels(figure, len(panels), height, sharey=layout.is_map or third is not None)
    for ax, panel in zip(places, panels, strict=True):
        if panel.title:
            ax.set_title(panel.title, fontsize="small")
        if layout.is_map:
            common = panel.runs if third is None else face.runs
            norm = norm_of(_drawn_values(table, panel.name, common))
            mesh = draw_map(ax, table, panel.name, layout.axes, panel.runs, norm)
            if mesh is not None:
                figure.colorbar(mesh, ax=ax, label=label_of(table, panel.name))
            else:
                ax.set_title(label_of(table, panel.name) + ": no values", fontsize="small")
        else:
            draw_curves(ax, table, panel.name, layout.axes, panel.runs, layout.joined)
            ax.set_ylabel(label_of(table, panel.name))
    _label_keys(places, layout)
    if not layout.is_map:
        figure.align_ylabels(places)
    _title(figure, table, [axis.key for axis in axes], notes, face.runs.size)
    add_legend(figure, _handles(table, layout, panels), columns=3)


def _label_keys(places: list[Any], layout: _Layout) -> None:
    """Label the keys below the lowest panels, and of maps beside the left ones."""
    columns = min(len(places), COLUMNS)
    for ax in places[-columns:]:
        ax.set_xlabel(layout.axes[0].label(), fontsize="small")
    if layout.is_map:
        for ax in places[::columns]:
            ax.set_ylabel(layout.axes[1].label(KEY_BESIDE), fontsize="small")


def _drawn_values(table: SweepTable, name: str, runs: Any) -> Any:
    outcomes = outcomes_of(table, name, runs)
    return np.where(np.isnan(outcomes.values), outcomes.audit_failures, outcomes.values)


def _handles(table: SweepTable, layout: _Layout, panels: list[_QuantityPanel]) -> list[Any]:
    """Return the legend: curves, and marks with the number of their runs."""
    handles = []
    if not layout.is_map and len(layout.axes) == 2:
        handles = legend_of_curves(layout.axes[1], layout.axes[0].values.size, layout.joined)
        if layout.axes[1].key:
            key = shortened_key(layout.axes[1].key)
            handles.insert(0, Line2D([], [], linestyle="", label=f"{key}:"))
    marks: dict[str, str] = {}
    counted: dict[str, dict[str, set[int]]] = {}
    for panel in panels:
        for mark, where in outcomes_of(table, panel.name, panel.runs).marks.items():
            runs = counted.setdefault(mark, {}).setdefault(panel.name, set())
            runs |= set(panel.runs[where].tolist())
    for mark, by_name in counted.items():
        numbers = [len(runs) for runs in by_name.values()]
        if any(numbers):
            least = min(number for number in numbers if number)
            several = f"{least} to {max(numbers)}" if max(numbers) > least else f"{least}"
            marks[mark] = f"{mark}: {several} run{'' if several == '1' else 's'}"
    return [*handles, *(legend_of_map(marks) if layout.is_map else legend_of(marks, bool(handles)))]


def _draw_sample(
    table: SweepTable, quantities: Sequence[str], figure: "Figure | SubFigure"
) -> None:
    """Draw histogram and indices of each quantity in a row; of a single key no indices."""
    sampling = variation(table)[1]
    runs = independent_runs(table, sampling)
    names, notes = list(quantities), list[str]()
    if not names:
        names, notes = chosen(table, runs)
    indices = indices_of(table, names) if len(table.coordinates) > 1 else {}
    row = SAMPLES + HEIGHT_OF_BAR * max(0, min(len(table.coordinates), MAX_BARS) - 2)
    if isinstance(figure, Figure):
        figure.set_figheight(HEADING + row * len(names))
    axes = figure.subplots(len(names), 2 if indices else 1, squeeze=False)
    for (left, *right), name in zip(axes, names, strict=True):
        values = sound_values(table, name)[runs]
        draw_histogram(left, table, name, values, statistics_of(values))
        for ax in right:
            draw_tornado(ax, list(table.coordinates), indices[name])
    if sampling is not None:
        independent = f", {runs.stop} independent runs" if sampling.indices else ""
        notes.insert(0, f"{sampling.method} sample{independent}")
    _title(figure, table, list(table.coordinates), notes, table.runs)
    add_legend(figure, legend_of_sample(any(i.exist for i in indices.values())), columns=5)


def label_of(table: SweepTable, name: str) -> str:
    """Return the label of a quantity with its unit."""
    return axis_label(name.replace("_", " "), table.units[name], MAX_WORD)


def _panels(figure: "Figure | SubFigure", count: int, row: float, sharey: bool) -> list[Any]:
    """Return the Axes of panels, in one column or two."""
    columns = 1 if count == 1 else COLUMNS
    rows = -(-count // columns)
    if isinstance(figure, Figure):
        single = 1.6 if rows == 1 else 1.0
        figure.set_figheight(HEADING + single * row * rows)
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
    title = attributes["title"] or attributes["kind"]
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
    keys_varied = f"{len(names)} keys"
    if len(names) <= MAX_KEYS:
        keys_varied = " and ".join([*([", ".join(names[:-1])] if names[:-1] else []), names[-1]])
    short = title if len(title) <= MAX_TITLE else f"{title[: MAX_TITLE - 1]}…"
    text = f"{short}: sweep over {keys_varied}\n({'; '.join(parts)})"
    height = figure.get_figheight() if isinstance(figure, Figure) else 1.0
    set_title(figure, text, height, scaled=False)
