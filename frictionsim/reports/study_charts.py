"""The charts of studies for Plotly: error against work, and quantities of a sweep over its keys.

No line joins the two sides of a jump, and a map has its cells: nothing is drawn where no run was.
"""

from math import isnan, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import COLOURS, GREY, labelled
from frictionsim.io.cost_table import line_of
from frictionsim.io.sweep_table import RUN
from frictionsim.reports.charts import DASHES, GRID, LOOK, SHADE, Json, domains, heading, numbers
from frictionsim.reports.html import chart_text
from frictionsim.sweeps.statistics import (
    is_defined,
    jumps_between,
    sound_values,
    telling,
    varied_values,
)

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
PANEL, GAP = 250, 70  # pixels: height of a panel, and between panels
ABOVE, BELOW, TITLE = 60, 50, 24  # of the legend, of the lowest axis, of the title of a panel
WHY = "or the run failed, was not run, or failed its audit; the table says which."
WIDE = 0.08  # between panels side by side, relative to one


class Chart:
    """A figure of panels in rows and columns, numbered from 1 along the rows."""

    def __init__(self, rows: int, columns: int, panel: int = PANEL, wide: float = WIDE) -> None:
        across = domains([1.0] * columns, wide)
        down = [(1.0 - b, 1.0 - a) for a, b in domains([panel] * rows, GAP)]
        self.traces: list[Json] = []
        self._places = [(x, y) for y in down for x in across]
        self._columns = columns
        axis = {"gridcolor": GRID, "zeroline": False}
        inner = rows * (panel + GAP) - GAP
        self.layout: Json = LOOK | {
            "template": {"layout": {"xaxis": axis, "yaxis": axis}},
            "height": inner + ABOVE + BELOW,
            "margin": {"l": 80, "r": 20, "t": ABOVE, "b": BELOW},
            "legend": {"orientation": "h", "x": 0.0, "y": 1.0 + TITLE / inner, "yanchor": "bottom"},
            "annotations": [],
            "shapes": [],
        }

    def panel(self, number: int, x: Json, y: Json, title: str = "", shared: bool = False) -> Any:
        """Give a panel its axes, of y the first of its row if `shared`; return its place."""
        name, (across, up) = _suffix(number), self._places[number - 1]
        first = number - (number - 1) % self._columns
        if shared and first != number:
            y = y | {"matches": f"y{_suffix(first)}", "showticklabels": False, "title": {}}
        self.layout[f"xaxis{name}"] = {"domain": across, "anchor": f"y{name}", **x}
        self.layout[f"yaxis{name}"] = {"domain": up, "anchor": f"x{name}", **y}
        if title:
            middle = 0.5 * sum(across)
            self.layout["annotations"].append(heading(title, middle, up[1], "center"))
        return across, up

    def add(self, number: int, kind: str, **trace: Any) -> None:
        """Add a trace to a panel."""
        name = _suffix(number)
        self.traces.append({"type": kind, "xaxis": f"x{name}", "yaxis": f"y{name}", **trace})

    def level(self, number: int, value: float, words: str) -> None:
        """Mark a level of a logarithmic axis by words and a line."""
        name = _suffix(number)
        place = {"xref": f"x{name} domain", "yref": f"y{name}"}
        ends = {"x0": 0, "x1": 1, "y0": value, "y1": value}
        line = {"color": GREY, "width": 1, "dash": "dot"}
        self.layout["shapes"].append({"type": "line", "line": line, **place, **ends})
        look = {"text": words, "showarrow": False, "font": {"size": 11}}
        at = {"x": 1.0, "y": log10(value), "xanchor": "right", "yanchor": "bottom"}
        self.layout["annotations"].append(look | place | at)

    @property
    def figure(self) -> Json:
        """The figure for a page."""
        return {"data": self.traces, "layout": self.layout}


def _suffix(number: int) -> str:
    return "" if number == 1 else str(number)


def _title(text: str) -> Json:
    return {"title": {"text": text, "standoff": 6}}


def cost_figure(table: "CostTable") -> tuple[Json, str]:
    """Return the error against work, a line for each method, and a note on what is not drawn.

    Left against wall time, right against evaluations; of meshes right the error in time alone.
    """
    panels, titles = [("wall_seconds", "error"), ("rhs_evaluations", "error")], ["", ""]
    if table.of_meshes:
        panels = [("wall_seconds", "error"), ("wall_seconds", "time_error")]
        titles = ["against the limit of fine meshes", "in time alone, on the scenario's own mesh"]
    names = {name for panel in panels for name in panel}
    rows = [row for row in table.rows if _is_drawable(row, names)]
    errors = [max(row[e], MIN_ERROR) for row in rows for _, e in panels if not isnan(row[e])]
    bands = (table.floor, table.time_uncertainty or 0.0 if table.of_meshes else table.floor)
    chart = Chart(1, 2)
    y = {"type": "log", "exponentformat": "power"} | _title("largest relative error")
    for number, ((work, error), band) in enumerate(zip(panels, bands, strict=True), start=1):
        x = {"type": "log", **_title(WORK[work])}
        chart.panel(number, x, y, titles[number - 1], shared=True)
        for i, name in enumerate(dict.fromkeys(map(line_of, rows))):
            of_line = [row for row in rows if line_of(row) == name]
            done = [row for row in of_line if not isnan(row[error])]
            failed = [row for row in of_line if row["status"] == "failed" and error == "error"]
            colour = {"color": COLOURS[i % len(COLOURS)]}
            chart.add(
                number,
                "scatter",
                x=[row[work] for row in done],
                y=[max(row[error], MIN_ERROR) for row in done],
                mode="markers" if table.of_meshes else "lines+markers",
                name=chart_text(name),
                legendgroup=name,
                showlegend=number == 1 and bool(done),
                text=[chart_text(row["setting"]) for row in done],
                line=colour | {"dash": DASHES[i % len(DASHES)], "width": 1.4},
                marker=colour | {"symbol": MARKS[i % len(MARKS)], "size": 8},
            )
            if failed:
                chart.add(
                    number,
                    "scatter",
                    x=[row[work] for row in failed],
                    y=[FAILED_ABOVE * max(errors, default=1.0)] * len(failed),
                    mode="markers",
                    name=f"{chart_text(name)}: {len(failed)} failed",
                    legendgroup=f"{name}, failed",
                    showlegend=number == 1,
                    text=[chart_text(row.get("reason", "")) for row in failed],
                    marker=colour | {"symbol": "x", "size": 10},
                )
        if band > 0.0:
            suffix = _suffix(number)
            area = {"type": "rect", "xref": f"x{suffix} domain", "yref": f"y{suffix}", "x0": 0}
            area |= {"x1": 1, "y0": min([band, *errors]) / 10.0, "y1": band, "layer": "below"}
            chart.layout["shapes"].append(area | {"line": {"width": 0}, "fillcolor": SHADE})
            chart.level(number, band, "below: the reference uncertainty")
        for target, words in TARGETS.items():
            chart.level(number, target, words)
    omitted = len(table.rows) - len(rows)
    words = f"{omitted} settings have numbers that no axis shows; the table has them."
    return chart.figure, words if omitted else ""


def _is_drawable(row: dict[str, Any], names: set[str]) -> bool:
    known = [row[name] for name in names if not isnan(row[name])]
    return all(0.0 <= number < MAX_DRAWN for number in known)


def sweep_figure(table: "SweepTable") -> "tuple[Json | None, str]":
    """Return the quantities that vary over the keys, and a note on those that are left out.

    Over one key they are curves, over two numbers maps; else each is a row with the points of all
    runs over each key. None if no quantity is defined.
    """
    defined = [name for name in table.values if is_defined(table, name)]
    sound = {name: sound_values(table, name) for name in defined}
    finite = {name: np.abs(values[np.isfinite(values)]) for name, values in sound.items()}
    drawable = [name for name in defined if finite[name].max() < MAX_DRAWN]
    varying = [name for name in telling(table) if name in drawable]
    drawn = (varying or drawable)[:MAX_QUANTITIES]
    others = [name for name in defined if name not in drawn]
    notes = [f"Without a picture: {', '.join(others)}; the table has them."] if others else []
    if not drawn:
        return None, " ".join(notes)
    keys = [key for key, each in table.coordinates.items() if len(set(_listed(each.values))) > 1]
    keys = keys or list(table.coordinates)
    grid = RUN not in table.dimensions
    if grid and len(keys) == 2 and all(_is_number(table, key) for key in keys):
        empty = [name for name in drawn if not np.isfinite(sound[name]).all()]
        if empty:
            notes.insert(0, f"An empty cell: {', '.join(empty)} not defined in that run, {WHY}")
        return _maps(table, drawn, keys), " ".join(notes)
    return _points(table, drawn, keys, joined=grid and len(keys) == 1), " ".join(notes)


def _listed(values: Any) -> list[Any]:
    return values if isinstance(values, list) else list(values.tolist())


def _is_number(table: "SweepTable", key: str) -> bool:
    values = table.coordinates[key].values
    return not isinstance(values, list) and values.dtype.kind in "fi" and values.dtype.itemsize > 1


def _label(table: "SweepTable", name: str) -> str:
    units = table.units.get(name) if name in table.values else table.coordinates[name].unit
    return chart_text(labelled(name.rpartition(".")[2], units or "1"))


def _maps(table: "SweepTable", names: "Sequence[str]", keys: list[str]) -> Json:
    """Return a map of each quantity over two keys, a cell for each run."""
    columns = min(2, len(names))
    chart = Chart(-(-len(names) // columns), columns, wide=0.4)
    x, y = (numbers(table.coordinates[key].values, "f8") for key in keys)
    place = [list(table.dimensions).index(key) for key in keys]
    across, up = (_title(_label(table, key)) for key in keys)
    for number, name in enumerate(names, start=1):
        values = np.moveaxis(sound_values(table, name).reshape(table.shape), place, (0, 1))
        (_, right), (low, high) = chart.panel(number, across, up, _label(table, name))
        bar = {"x": right + 0.005, "y": 0.5 * (low + high), "len": high - low, "thickness": 12}
        image = numbers(values.reshape(table.shape[place[0]], -1).T, "f8")
        chart.add(number, "heatmap", x=x, y=y, z=image, colorscale="Cividis", colorbar=bar)
    return chart.figure


def _points(table: "SweepTable", names: "Sequence[str]", keys: list[str], joined: bool) -> Json:
    """Return the quantities over each key, a point for each run; joined over one key of a grid."""
    keys = keys[:MAX_KEYS]
    chart = Chart(len(names), len(keys), panel=170)
    runs = [varied_values(table, run) for run in range(table.runs)]
    marker = {"color": COLOURS[0], "size": 7 if table.runs < 100 else 4}
    look = {"marker": marker, "line": {"width": 1.4}, "showlegend": False}
    for row, name in enumerate(names):
        values = sound_values(table, name)
        for column, key in enumerate(keys, start=1):
            number, mode, y = row * len(keys) + column, "markers", values
            x: Any = [chart_text(v) if isinstance(v := run[key], str) else v for run in runs]
            if joined and _is_number(table, key):
                places, mode = np.asarray(x, dtype=float), "lines+markers"
                order = np.argsort(places, kind="stable")
                at = 1 + np.flatnonzero(jumps_between(places[order], values[order]))
                x = numbers(np.insert(places[order], at, np.nan), "f8")
                y = np.insert(values[order], at, np.nan)
            axes = _title(_label(table, key)), _title(_label(table, name))
            chart.panel(number, *axes, shared=True)
            chart.add(number, "scatter", x=x, y=numbers(y, "f8"), mode=mode, **look)
    return chart.figure
