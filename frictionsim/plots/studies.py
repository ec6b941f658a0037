"""The pictures of studies: the cost of accuracy, and data with a fit.

A study of costs has the error against wall time and against evaluations of the right-hand side, a
line for each method. A study of meshes has a line for each method and number of bodies: left the
error against the limit of fine meshes, right that from the scenario's own mesh converged in time,
on the same axes: a run that is exact in time stays as far off on the left as its mesh is. Failed
runs are marked above the errors.
"""

from collections.abc import Sequence
from itertools import cycle
from math import floor, isnan, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import BLACK, GREY, LINE_COLOURS, STICK_SHADE, VERMILION
from frictionsim.io.cost_table import BELOW, MIN_ERROR, TARGETS, WORK, line_of
from frictionsim.plots.over_time import FULL_SIZE_POINTS
from frictionsim.plots.style import (
    MARKERS,
    Look,
    add_legend,
    axis_label,
    new_figure,
    quantity_label,
    set_height,
    set_title,
    styled,
)
from frictionsim.scenario.model_fields import description_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fits.data import Target
    from frictionsim.fits.outcome import FitOutcome, TargetResiduals
    from frictionsim.io.cost_table import CostTable, Row

    Array = npt.NDArray[np.float64]


FAILED = 0.96  # of the height of a panel, at which failed runs are marked
# Markers and line styles differ too, for grey print.
LINES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)))
WIDTH, HEIGHT, COLUMNS = 9.0, 4.9, 5  # inches, without the legend, and its columns


def cost_diagram(table: "CostTable", figure: Any = None) -> Any:
    """Draw the errors of a study of costs, a line for each method, into an empty or new figure."""
    figure = new_figure(WIDTH) if figure is None else figure
    with styled():
        _draw_costs(table, figure)
    return figure


def _draw_costs(table: "CostTable", figure: "Figure | SubFigure") -> None:
    meshes, rows = table.of_meshes, table.rows
    set_height(figure, HEIGHT)
    what = "what accuracy costs" if meshes else "error against run time"
    set_title(figure, f"{table.title or table.kind}: {what}")
    panels = table.panels
    errors = [row[of.error] for row in rows for of in panels if not isnan(row[of.error])]
    least = min([*errors, *(of.band for of in panels if of.band > 0.0)], default=MIN_ERROR)
    lowest = 10.0 ** floor(log10(max(least, MIN_ERROR))) / 10.0
    axes = figure.subplots(1, 2, sharex=meshes, sharey=True)
    handles: dict[str, Any] = {}
    highest = 10.0 * max([1.0, *errors])
    for ax, panel in zip(axes, panels, strict=True):
        ax.set(xscale="log", yscale="log", xlabel=WORK[panel.work], ylim=(lowest, highest))
        ax.set_title(panel.title, fontsize="medium")
        ax.grid(linewidth=0.3)
        if panel.band > 0.0:
            ax.axhspan(lowest, max(panel.band, lowest), color=STICK_SHADE, linewidth=0)
            handles[BELOW] = Patch(color=STICK_SHADE)
        for target in TARGETS if meshes else ():
            ax.axhline(target, color=GREY, linewidth=0.8, linestyle=":")
        handles |= _draw_lines(ax, rows, panel.work, panel.error, meshes)
    axes[0].set_ylabel("largest relative error")
    add_legend(figure, handles, COLUMNS)


def _draw_lines(
    ax: Any, rows: "Sequence[Row]", work: str, error: str, meshes: bool
) -> dict[str, Any]:
    """Draw the lines of a panel and the failed runs above them; return handles by their words."""
    counts = sorted({row["bodies"] for row in rows}) if meshes else []
    least = min((row[work] for row in rows if row[work] > 0.0), default=1.0)  # of refused runs 0
    handles: dict[str, Any] = {}
    for number, name in enumerate(dict.fromkeys(map(line_of, rows))):
        look: Look = {"color": LINE_COLOURS[number % len(LINE_COLOURS)], "linewidth": 1.2}
        look["linestyle"] = LINES[number % len(LINES)]
        of_line = [row for row in rows if line_of(row) == name]
        done = [row for row in of_line if not isnan(row[error])]
        of_mesh = [[row for row in done if row["bodies"] == count] for count in counts] or [done]
        for i, group in enumerate(of_mesh):
            marker = MARKERS[(i if meshes else number) % len(MARKERS)]
            (line,) = ax.plot(*_points(group, work, error), marker=marker, **look)
        if meshes and error == "error":  # from mesh to mesh, by the longest step of each
            ax.plot(*_points([of[0] for of in of_mesh if of], work, error), **look)
        if done:
            handles[name] = Line2D([], [], **look) if meshes else line
        failed = [max(row[work], least) for row in of_line if row["status"] == "failed"]
        if failed and error == "error":
            cross: Look = {"marker": "x", "markersize": 8, "markeredgewidth": 2.0}
            cross |= {"color": look["color"], "linestyle": ""}
            height = [FAILED] * len(failed)
            ax.plot(failed, height, transform=ax.get_xaxis_transform(), **cross)
            handles[f"{name}: {len(failed)} failed"] = Line2D([], [], **cross)
    for count, marker in zip(counts, cycle(MARKERS), strict=False):
        handles[f"{count:.0f} bodies"] = Line2D([], [], color=GREY, linestyle="", marker=marker)
    return handles


def _points(rows: "Sequence[Row]", work: str, error: str) -> tuple[list[float], list[float]]:
    return [row[work] for row in rows], [max(row[error], MIN_ERROR) for row in rows]


FIT_HEIGHT, FIT_MARGIN = 3.4, 0.8  # inches, of a channel with its residuals, and of title and axis
RATIOS = (3.0, 1.2)  # heights of data and residuals
RESIDUAL_WIDTH = 12  # characters beside a panel of residuals
DATA: dict[str, Any] = {"color": GREY, "linestyle": "", "marker": "o", "markerfacecolor": "none"}
FIT: dict[str, Any] = {"color": VERMILION, "linestyle": "-", "linewidth": 1.6}
RESIDUAL: dict[str, Any] = {"color": BLACK, "linestyle": "", "marker": "."}


def fit_diagram(outcome: "FitOutcome", figure: Any = None) -> Any:
    """Draw data and fit of each channel or quantity, with the residuals below.

    A grey band has the width of twice the standard deviation of the data. The figure is an empty
    one or a new one.
    """
    figure = new_figure() if figure is None else figure
    with styled():
        _draw_fit(outcome, figure)
    return figure


def _draw_fit(outcome: "FitOutcome", figure: "Figure | SubFigure") -> None:
    parts = list(zip(outcome.measured.targets, outcome.residuals, strict=True))
    title = outcome.scenario.title or outcome.scenario.kind
    set_height(figure, FIT_HEIGHT * len(parts) + FIT_MARGIN)
    set_title(figure, f"{title}: fit to measured data")
    axes = figure.subplots(2 * len(parts), 1, height_ratios=RATIOS * len(parts), squeeze=False)
    for number, (target, residuals) in enumerate(parts):
        upper, lower = axes[2 * number, 0], axes[2 * number + 1, 0]
        lower.sharex(upper)
        _draw_target(upper, lower, outcome, target, residuals)
    looks = {"data": DATA, "fit": FIT, "data minus fit": RESIDUAL}
    handles: dict[str, Any] = {words: Line2D([], [], **look) for words, look in looks.items()}
    if any(residuals.sigma is not None for _, residuals in parts):
        handles["± standard deviation of the data"] = Patch(color=STICK_SHADE)
    add_legend(figure, handles)


def _draw_target(
    upper: Any, lower: Any, outcome: "FitOutcome", target: "Target", residuals: "TargetResiduals"
) -> None:
    x, label = _abscissa(outcome, target)
    order = np.argsort(x, kind="stable")
    size = 5.0 if len(x) <= FULL_SIZE_POINTS else 2.5
    upper.plot(x, target.values, **DATA, markersize=size)
    upper.plot(x[order], residuals.fitted[order], **FIT)
    upper.set_ylabel(quantity_label(target.name, residuals.unit))
    upper.tick_params(labelbottom=False)
    if residuals.sigma is not None:
        lower.axhspan(-residuals.sigma, residuals.sigma, color=STICK_SHADE, linewidth=0)
    lower.axhline(0.0, color=VERMILION, linewidth=1.0)
    lower.plot(x, residuals.values, **RESIDUAL, markersize=size)
    lower.set_ylabel(axis_label("residual", residuals.unit, RESIDUAL_WIDTH))
    lower.set_xlabel(label)
    for ax in (upper, lower):
        ax.grid(linewidth=0.3)


def _abscissa(outcome: "FitOutcome", target: "Target") -> tuple[Any, str]:
    """Return the abscissae of a target's values, and the label of that axis."""
    if target.kind == "channel":
        return target.times, "time, s"
    if len(outcome.measured.over) == 1:
        key = outcome.measured.over[0]
        label = axis_label(key, description_of(type(outcome.scenario), key)[0])
        return np.array([outcome.measured.runs[run][key] for run in target.runs]), label
    return target.runs + 1.0, "run"
