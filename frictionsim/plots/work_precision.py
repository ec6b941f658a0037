"""The work-precision diagram: error against wall time and right-hand-side evaluations."""

from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from frictionsim.plots.failed_runs import add_strip, places_of
from frictionsim.plots.mesh_errors import draw_mesh_study
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.style import COLOURS, STICK_COLOUR, WINE, relative_width

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.work_precision.outcome import Row, Study

LINE_COLOURS = (*COLOURS, WINE)
# Markers and line styles differ too, for grey print.
MARKERS = ("o", "s", "^", "D", "v", "P", "*", "<", ">", "h")
LINES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)))
WIDTH, HEIGHT = 9.0, 5.4  # inches
COLUMNS, LONG_LABEL = 5, 24  # of the legend; characters of a name with which there is one fewer
DECADE = 10.0
MIN_ERROR = 1e-16  # smaller errors are drawn here
WORK = (("wall_seconds", "wall time, s"), ("rhs_evaluations", "right-hand-side evaluations"))


def diagram(study: "Study", figure: "Figure | SubFigure | None" = None, ax: Any = None) -> Figure:
    """Draw one line for each backend; failed settings are marked in a strip above them.

    A study of meshes has the panels of `frictionsim.plots.mesh_errors`.

    Parameters
    ----------
    study : Study
    figure, ax : optional
        As in `frictionsim.plots.draw`.

    Raises
    ------
    InputError
        If the figure is not empty, or the axes cannot be replaced.
    """
    draw = draw_mesh_study if study.of_meshes else _draw
    return drawn_in(lambda target: draw(study, target), figure, ax, WIDTH)


def _draw(study: "Study", figure: "Figure | SubFigure") -> None:
    if isinstance(figure, Figure):
        figure.set_figheight(HEIGHT)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (quantity, label) in zip(axes, WORK, strict=True):
        _draw_panel(ax, study, quantity)
        ax.set_xlabel(label)
    axes[0].set_ylabel("largest relative error")
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        columns = COLUMNS - (max(map(len, labels)) > LONG_LABEL)
        columns = max(1, int(columns * min(1.0, relative_width(figure))))
        figure.legend(handles, labels, loc="outside lower center", fontsize="small", ncols=columns)
    title = study.scenario.title or study.scenario.kind
    figure.suptitle(f"{title}: error against run time", fontsize="medium", wrap=True)


def _draw_panel(ax: Any, study: "Study", quantity: str) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.grid(linewidth=0.3)
    errors = [max(row.error, MIN_ERROR) for row in study.rows if row.error is not None]
    floor_height = max(study.floor, MIN_ERROR)
    lowest = 10.0 ** floor(log10(min([floor_height, *errors]))) / 10.0
    ax.set_ylim(lowest, 10.0 * max([1.0, *errors]))
    if study.reference and study.reference.floor:
        ax.axhspan(
            lowest,
            floor_height,
            color=STICK_COLOUR,
            linewidth=0,
            label="below the reference uncertainty",
        )
    work = [getattr(row, quantity) for row in study.rows]
    if max(work, default=0.0) > DECADE * min(filter(None, work), default=1.0):
        ax.xaxis.set_minor_formatter(NullFormatter())  # those of powers of ten are enough
    middle = add_strip(ax) if any(row.error is None for row in study.rows) else 0.0
    names = list(dict.fromkeys(row.setting.line for row in study.rows))
    for number, name in enumerate(names):
        rows = [row for row in study.rows if row.setting.line == name]
        _draw_backend(ax, rows, quantity, number)
        places = places_of([getattr(row, quantity) for row in rows if row.error is None], work)
        if places.size:
            _draw_failed(ax, places, middle, number, f"{name}: {places.size} failed")


def _draw_backend(ax: Any, rows: "list[Row]", quantity: str, number: int) -> None:
    colour = LINE_COLOURS[number % len(LINE_COLOURS)]
    done = [row for row in rows if row.error is not None]
    if done:
        ax.plot(
            [getattr(row, quantity) for row in done],
            [max(row.error or 0.0, MIN_ERROR) for row in done],
            color=colour,
            marker=MARKERS[number % len(MARKERS)],
            linestyle=LINES[number % len(LINES)],
            linewidth=1.2,
            markersize=6,
            label=done[0].setting.line,
        )


def _draw_failed(ax: Any, places: Any, middle: float, number: int, words: str) -> None:
    """Mark the failed runs of a backend in their strip."""
    ax.plot(
        places,
        np.full(places.size, middle),
        color=LINE_COLOURS[number % len(LINE_COLOURS)],
        marker="x",
        linestyle="",
        markersize=8,
        markeredgewidth=2.0,
        label=words,
    )
