"""The work-precision diagram of a study of meshes: the error of the mesh beside that of the steps.

Left: error against the limit of fine meshes, a line for each model, a marker for each number of
bodies. Right: how far runs on the scenario's own mesh are from that mesh converged in time. Both
have the same axes: a run that is exact in time stays as far off on the left as its mesh is.
"""

from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from frictionsim.plots.failed_runs import add_strip, places_of
from frictionsim.plots.style import (
    COLOURS,
    GREY,
    STICK_COLOUR,
    relative_width,
)

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.work_precision.outcome import Row, Study

MARKERS = ("o", "s", "^", "D", "v", "P", "*", "<", ">", "h")  # of numbers of bodies
LINES: tuple[Any, ...] = ("-", "--", "-.", ":")  # of models
STEP_MARKERS = ("+", "x", "1", "2", "3", "4", "|", "_")  # of methods on the scenario's own mesh
HEIGHT = 5.8  # inches
COLUMNS = 4  # of the legend
MIN_ERROR = 1e-12  # smaller errors are drawn here
TARGETS = (1e-2, 1e-3)


def draw_mesh_study(study: "Study", figure: "Figure | SubFigure") -> None:
    """Draw both panels into an empty figure."""
    if isinstance(figure, Figure):
        figure.set_figheight(HEIGHT)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    in_time = study.time_reference.uncertainty if study.time_reference else 0.0
    titles = ("against the limit of fine meshes", "in time alone, on the scenario's own mesh")
    for ax, title in zip((left, right), titles, strict=True):
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.grid(linewidth=0.3)
        ax.set_xlabel("wall time, s")
        ax.set_title(title, fontsize="medium")
    left.set_ylabel("largest relative error")
    lowest = _lowest(study, in_time)
    for ax, height in ((left, study.floor), (right, in_time)):
        if height > 0.0:
            ax.axhspan(lowest, max(height, lowest), color=STICK_COLOUR, linewidth=0)
    handles = _draw_models(left, study.rows)
    handles += _draw_methods(left, right, [row for row in study.rows if row.time_error is not None])
    left.set_ylim(lowest, None)
    handles += _draw_failed(left, study.rows)
    for ax in (left, right):
        for target in TARGETS:
            ax.axhline(target, color=GREY, linewidth=0.8, linestyle=":")
    columns = max(1, int(COLUMNS * min(1.0, relative_width(figure))))
    figure.legend(handles=handles, loc="outside lower center", fontsize="small", ncols=columns)
    title = study.scenario.title or study.scenario.kind
    figure.suptitle(f"{title}: what accuracy costs", fontsize="medium", wrap=True)


def _lowest(study: "Study", in_time: float) -> float:
    found = [study.floor, in_time]
    found += [row.error for row in study.rows if row.error is not None]
    found += [row.time_error for row in study.rows if row.time_error is not None]
    least = min((value for value in found if value > 0.0), default=MIN_ERROR)
    return float(10.0 ** floor(log10(max(least, MIN_ERROR))))


def cheapest_of_meshes(rows: "list[Row]") -> "dict[str, list[Row]]":
    """Return, by model, the first row of each of its meshes that is done: its longest step."""
    found: dict[str, dict[int, Row]] = {}
    for row in rows:
        mesh = row.setting.mesh
        if mesh is not None and row.error is not None and row.setting.backend == "moreau":
            found.setdefault(mesh.model, {}).setdefault(mesh.bodies, row)
    return {model: [of[count] for count in sorted(of)] for model, of in found.items()}


def _draw_models(ax: Any, rows: "list[Row]") -> list[Line2D]:
    """Draw a line for each model; return what the legend shows: models, then bodies."""
    counts = sorted({row.setting.mesh.bodies for row in rows if row.setting.mesh})
    markers = {count: MARKERS[i % len(MARKERS)] for i, count in enumerate(counts)}
    handles = []
    for number, (model, found) in enumerate(cheapest_of_meshes(rows).items()):
        colour = COLOURS[number % len(COLOURS)]
        style = {"color": colour, "linestyle": LINES[number % len(LINES)]}
        points = [(row.wall_seconds, max(row.error or 0.0, MIN_ERROR)) for row in found]
        ax.plot(*zip(*points, strict=True), **style)
        for row, (x, y) in zip(found, points, strict=True):
            if row.setting.mesh is not None:
                ax.plot(x, y, marker=markers[row.setting.mesh.bodies], color=colour)
        handles.append(Line2D([], [], **style, label=f"moreau, {model}"))
    return handles + [
        Line2D([], [], color=GREY, linestyle="", marker=marker, label=f"{count} bodies")
        for count, marker in markers.items()
    ]


def _draw_methods(left: Any, right: Any, rows: "list[Row]") -> list[Line2D]:
    """Draw the settings of the scenario's own mesh into both panels."""
    handles = []
    for number, line in enumerate(dict.fromkeys(row.setting.line for row in rows)):
        style: dict[str, Any] = {
            "color": COLOURS[-1 - number % len(COLOURS)],
            "marker": STEP_MARKERS[number % len(STEP_MARKERS)],
            "markersize": 8,
            "linewidth": 0.8,
        }
        found = [row for row in rows if row.setting.line == line]
        seconds = [row.wall_seconds for row in found]
        left.plot(seconds, [max(row.error or 0.0, MIN_ERROR) for row in found], **style)
        right.plot(seconds, [max(row.time_error or 0.0, MIN_ERROR) for row in found], **style)
        bodies = found[0].setting.mesh.bodies if found[0].setting.mesh else 0
        handles.append(Line2D([], [], **style, label=f"{line}, {bodies} bodies"))
    return handles


def _draw_failed(ax: Any, rows: "list[Row]") -> list[Line2D]:
    """Mark runs without an error in a strip above the others."""
    failed = [row for row in rows if row.error is None]
    if not failed:
        return []
    style: dict[str, Any] = {"color": "black", "marker": "x", "linestyle": "", "markersize": 7}
    at = places_of([row.wall_seconds for row in failed], [row.wall_seconds for row in rows])
    ax.plot(at, np.full(at.size, add_strip(ax)), **style)
    return [Line2D([], [], **style, label=f"{len(failed)} failed")]
