"""The charts of studies by Plotly: error against work, and the quantities of a sweep over its keys.

No line joins the two sides of a jump, and a map has its cells: nothing is drawn where no run was.
"""

from math import isnan, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import COLOURS, GREY, labelled
from frictionsim.io.cost_table import line_of
from frictionsim.io.sweep_table import RUN
from frictionsim.reports.charts import DASHES, SHADE
from frictionsim.reports.html import chart_text
from frictionsim.sweeps.statistics import is_constant, is_defined, sound_values, varied_values

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionsim.io.cost_table import CostTable
    from frictionsim.io.sweep_table import SweepTable

MARKS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "star", "hexagon")
MIN_ERROR, MAX_DRAWN = 1e-16, 1e100  # smaller errors are drawn here; larger numbers nowhere
TARGETS = {1e-2: "1 %", 1e-3: "0.1 %"}
FAILED_ABOVE = 4.0  # failed settings, as a multiple of the largest error
WORK = {"wall_seconds": "wall time, s", "rhs_evaluations": "evaluations of the right-hand side"}
MAX_QUANTITIES, MAX_KEYS = 12, 5  # panels; columns of a study of many keys
PANEL, GAP = 250, 70  # pixels
JUMP = 8.0  # a step is a jump where it is larger than so many of the usual ones,
LARGE = 0.1  # and than so much of all


def cost_figure(table: "CostTable") -> tuple[Any, str]:
    """Return the error against work, a line for each method, and a note on what is not drawn.

    Left against wall time, right against evaluations; of meshes right the error in time alone.
    """
    panels = [("wall_seconds", "error"), ("rhs_evaluations", "error")]
    titles = ["", ""]
    if table.of_meshes:
        panels = [("wall_seconds", "error"), ("wall_seconds", "time_error")]
        titles = ["against the limit of fine meshes", "in time alone, on the scenario's own mesh"]
    numbers = {name for panel in panels for name in panel}
    rows = [row for row in table.rows if _is_drawable(row, numbers)]
    figure = _figure(1, 2, titles, shared_yaxes=True)
    errors = [max(row[e], MIN_ERROR) for row in rows for _, e in panels if not isnan(row[e])]
    top = FAILED_ABOVE * max(errors, default=1.0)
    for number, name in enumerate(dict.fromkeys(map(line_of, rows))):
        of_line = [row for row in rows if line_of(row) == name]
        for column, (work, error) in enumerate(panels, start=1):
            done = [row for row in of_line if not isnan(row[error])]
            failed = [row for row in of_line if row["status"] == "failed"]
            look = {"color": COLOURS[number % len(COLOURS)]}
            figure.add_trace(
                _scatter(
                    [row[work] for row in done],
                    [max(row[error], MIN_ERROR) for row in done],
                    mode="lines+markers" if not table.of_meshes else "markers",
                    name=chart_text(name),
                    legendgroup=name,
                    showlegend=column == 1 and bool(done),
                    text=[chart_text(row["setting"]) for row in done],
                    line=look | {"dash": DASHES[number % len(DASHES)], "width": 1.4},
                    marker=look | {"symbol": MARKS[number % len(MARKS)], "size": 8},
                ),
                row=1,
                col=column,
            )
            if failed and error == "error":
                figure.add_trace(
                    _scatter(
                        [row[work] for row in failed],
                        [top] * len(failed),
                        mode="markers",
                        name=f"{chart_text(name)}: {len(failed)} failed",
                        legendgroup=f"{name}, failed",
                        showlegend=column == 1,
                        text=[chart_text(row.get("reason", "")) for row in failed],
                        marker=look | {"symbol": "x", "size": 10},
                    ),
                    row=1,
                    col=column,
                )
    bands = (table.floor, table.time_uncertainty or 0.0 if table.of_meshes else table.floor)
    for column, ((work, _), band) in enumerate(zip(panels, bands, strict=True), start=1):
        figure.update_xaxes(type="log", title_text=WORK[work], row=1, col=column)
        if band > 0.0:
            low = min([band, *errors]) / 10.0
            area = {"y0": low, "y1": band, "line_width": 0, "fillcolor": SHADE, "layer": "below"}
            figure.add_hrect(row=1, col=column, **area)
            _label_level(figure, column, band, "below: the reference uncertainty")
        for target, words in TARGETS.items():
            line = {"color": GREY, "width": 1, "dash": "dot"}
            figure.add_hline(target, row=1, col=column, line=line)
            _label_level(figure, column, target, words)
    figure.update_yaxes(type="log", exponentformat="power")
    figure.update_yaxes(title_text="largest relative error", row=1, col=1)
    omitted = len(table.rows) - len(rows)
    words = f"{omitted} settings have numbers that no axis shows; the table has them."
    return figure, words if omitted else ""


def _label_level(figure: Any, column: int, level: float, words: str) -> None:
    """Write words above a level of the logarithmic axis of errors, at the right."""
    axis = "" if column == 1 else str(column)
    place = {"x": 1.0, "xref": f"x{axis} domain", "xanchor": "right", "yanchor": "bottom"}
    look: dict[str, Any] = {"text": words, "showarrow": False, "font_size": 11}
    figure.add_annotation(y=log10(level), yref=f"y{axis}", **place, **look)


def _is_drawable(row: dict[str, Any], numbers: set[str]) -> bool:
    known = [row[name] for name in numbers if not isnan(row[name])]
    return all(0.0 <= number < MAX_DRAWN for number in known)


def sweep_figure(table: "SweepTable") -> tuple[Any, str]:
    """Return the quantities that vary over the keys, and a note on those that are left out.

    Over one key they are curves, over two numbers maps; else each is a row with the points of all
    runs over each key. None if no quantity is defined.
    """
    defined = [name for name in table.values if is_defined(table, name)]
    sound = {name: sound_values(table, name) for name in defined}
    finite = {name: np.abs(values[np.isfinite(values)]) for name, values in sound.items()}
    drawable = [name for name in defined if finite[name].max() < MAX_DRAWN]
    varying = [name for name in drawable if not is_constant(sound[name])]
    drawn = (varying or drawable)[:MAX_QUANTITIES]
    others = [name for name in defined if name not in drawn]
    note = f"Without a picture: {', '.join(others)}; the table has them." if others else ""
    if not drawn:
        return None, note
    keys = [key for key, each in table.coordinates.items() if len(set(_listed(each.values))) > 1]
    keys = keys or list(table.coordinates)
    grid = RUN not in table.dimensions
    if grid and len(keys) == 2 and all(_is_number(table, key) for key in keys):
        return _maps(table, drawn, keys), note
    return _points(table, drawn, keys, joined=grid and len(keys) == 1), note


def _listed(values: Any) -> list[Any]:
    return values if isinstance(values, list) else list(values.tolist())


def _is_number(table: "SweepTable", key: str) -> bool:
    values = table.coordinates[key].values
    return not isinstance(values, list) and values.dtype.kind in "fi" and values.dtype.itemsize > 1


def _label(table: "SweepTable", name: str) -> str:
    units = table.units.get(name) if name in table.values else table.coordinates[name].unit
    return chart_text(labelled(name.rpartition(".")[2], units or "1"))


def _maps(table: "SweepTable", names: "Sequence[str]", keys: list[str]) -> Any:
    """Return a map of each quantity over two keys, a cell for each run."""
    from plotly.graph_objects import Heatmap

    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    titles = [_label(table, name) for name in names]
    figure = _figure(rows, columns, titles, horizontal_spacing=0.17)
    x, y = (table.coordinates[key].values for key in keys)
    place = [list(table.dimensions).index(key) for key in keys]
    for number, name in enumerate(names):
        row, column = divmod(number, columns)
        values = np.moveaxis(sound_values(table, name).reshape(table.shape), place, (0, 1))
        domain = figure.get_subplot(row + 1, column + 1)
        right, (low, high) = domain.xaxis.domain[1], domain.yaxis.domain
        bar = {"x": right + 0.005, "y": 0.5 * (low + high), "len": high - low, "thickness": 12}
        image = values.reshape(len(x), len(y)).T
        trace = Heatmap(x=x, y=y, z=image, colorscale="Cividis", colorbar=bar, showlegend=False)
        figure.add_trace(trace, row=row + 1, col=column + 1)
        figure.update_xaxes(title_text=_label(table, keys[0]), row=row + 1, col=column + 1)
        figure.update_yaxes(title_text=_label(table, keys[1]), row=row + 1, col=column + 1)
    return figure


def _points(table: "SweepTable", names: "Sequence[str]", keys: list[str], joined: bool) -> Any:
    """Return the quantities over each key, a point for each run; joined over one key of a grid."""
    keys = keys[:MAX_KEYS]
    figure = _figure(len(names), len(keys), shared_yaxes=True, panel=170)
    runs = [varied_values(table, run) for run in range(table.runs)]
    for row, name in enumerate(names, start=1):
        values = sound_values(table, name)
        figure.update_yaxes(title_text=_label(table, name), row=row, col=1)
        for column, key in enumerate(keys, start=1):
            x = [chart_text(v) if isinstance(v := run[key], str) else v for run in runs]
            y, mode = values, "markers"
            if joined and _is_number(table, key):
                x, y, mode = *_with_gaps(np.asarray(x, dtype=float), values), "lines+markers"
            look = {"color": COLOURS[0], "size": 7 if table.runs < 100 else 4}
            trace = _scatter(x, y, mode=mode, marker=look, line={"width": 1.4}, showlegend=False)
            figure.add_trace(trace, row=row, col=column)
            figure.update_xaxes(title_text=_label(table, key), row=row, col=column)
    return figure


def _with_gaps(x: Any, y: Any) -> tuple[Any, Any]:
    """Return points in the order of x, with a gap where y jumps."""
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    steps = np.abs(np.diff(y))
    known = steps[np.isfinite(steps)]
    if known.size < 3:
        return x, y
    large = (steps > JUMP * np.median(known)) & (steps > LARGE * np.nanmax(np.abs(y - y[0])))
    places = np.flatnonzero(large) + 1
    return np.insert(x, places, 0.5 * (x[places - 1] + x[places])), np.insert(y, places, np.nan)


def _figure(
    rows: int, columns: int, titles: "Sequence[str]" = (), panel: int = PANEL, **options: Any
) -> Any:
    from plotly.subplots import make_subplots

    height = rows * (panel + GAP)
    spacing = {"vertical_spacing": GAP / height if rows > 1 else 0.0}
    given = {"subplot_titles": list(titles)} if any(titles) else {}
    figure = make_subplots(rows=rows, cols=columns, **(spacing | given | options))
    figure.update_annotations(font_size=13)
    figure.update_layout(
        template="none",
        height=height + 40,
        margin={"l": 80, "r": 20, "t": 30, "b": 50},
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        font={"family": "system-ui, sans-serif", "size": 12},
        legend={"orientation": "h", "y": -0.2, "yanchor": "top", "x": 0.0},
    )
    figure.update_xaxes(gridcolor="#e4e4e4", zeroline=False, title_standoff=6)
    figure.update_yaxes(gridcolor="#e4e4e4", zeroline=False, title_standoff=6)
    return figure


def _scatter(x: Any, y: Any, **look: Any) -> Any:
    from plotly.graph_objects import Scatter

    return Scatter(x=x, y=y, **look)
