"""The pictures of studies: the cost of accuracy, and data with a fit.

A study of costs has the error against wall time and against evaluations of the right-hand side. A
study of meshes has the error of the mesh beside that of the steps. Left: error against the limit of
fine meshes, a line for each model, a marker for each number of bodies. Right: how far runs on the
scenario's own mesh are from that mesh converged in time. Both have the same axes: a run that is
exact in time stays as far off on the left as its mesh is. Failed runs are marked in a strip above
the errors.
"""

from collections.abc import Sequence
from math import floor, isnan, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import BLACK, COLOURS, GREY, STICK_SHADE, VERMILION, WINE
from frictionsim.io.cost_table import line_of
from frictionsim.plots.style import (
    add_legend,
    axis_label,
    new_figure,
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


BELOW = "below the reference uncertainty"
STRIP = 0.09  # of the height of a panel


def add_strip(ax: Any) -> float:
    """Extend the scale of errors of a panel by a strip for failed runs; return its middle.

    Parameters
    ----------
    ax : Axes
        With its limits, and a logarithmic scale of y.
    """
    low, high = ax.get_ylim()
    top = high * (high / low) ** (STRIP / (1.0 - STRIP))
    ax.axhspan(high, top, facecolor=STICK_SHADE, linewidth=0, zorder=0.5)
    ax.axhline(high, color=GREY, linewidth=0.8)
    ax.set_yticks([tick for tick in ax.get_yticks() if low <= tick <= high])  # none in the strip
    ax.set_yticks([], minor=True)
    ax.set_ylim(low, top)
    if ax.get_subplotspec() is None or ax.get_subplotspec().is_first_col():
        ax.annotate(
            "failed",
            (0.0, 1.0 - 0.5 * STRIP),
            (-5.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize="small",
        )
    return float(np.sqrt(high * top))


def places_of(work: Sequence[float], others: Sequence[float]) -> "Array":
    """Return the positions of failed runs along a logarithmic axis of work.

    One that was refused has done none: it is marked at the least work of all.
    """
    done = [value for value in (*work, *others) if value > 0.0]
    return np.maximum(np.asarray(work, dtype=np.float64), min(done, default=1.0))


MESH_MARKERS = ("o", "s", "^", "D", "v", "P", "*", "<", ">", "h")  # of numbers of bodies
MESH_LINES: tuple[Any, ...] = ("-", "--", "-.", ":")  # of models
STEP_MARKERS = ("+", "x", "1", "2", "3", "4", "|", "_")  # of methods on the scenario's own mesh
MESH_HEIGHT = 5.1  # inches, without the legend
MIN_MESH_ERROR, MIN_ERROR = 1e-12, 1e-16  # smaller errors are drawn here
TARGETS = (1e-2, 1e-3)
LINE_COLOURS = (*COLOURS, WINE)
# Markers and line styles differ too, for grey print.
LINES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)))
WIDTH, HEIGHT = 9.0, 4.9  # inches, without the legend
COLUMNS = 5  # of the legend
WORK = (("wall_seconds", "wall time, s"), ("rhs_evaluations", "right-hand-side evaluations"))


def cost_diagram(table: "CostTable", figure: Any = None) -> Any:
    """Draw one line for each backend; failed settings are marked in a strip above them.

    A study of meshes has the panels that the head of this module names.

    Parameters
    ----------
    figure : Figure or SubFigure, optional
        An empty one that is drawn into.
    """
    draw = _draw_meshes if table.of_meshes else _draw
    figure = new_figure(WIDTH) if figure is None else figure
    with styled():
        draw(table, figure)
    return figure


def _draw(table: "CostTable", figure: "Figure | SubFigure") -> None:
    set_height(figure, HEIGHT)
    set_title(figure, f"{table.title or table.kind}: error against run time")
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (quantity, label) in zip(axes, WORK, strict=True):
        _set_scales(ax, label)
        _draw_panel(ax, table, quantity)
    axes[0].set_ylabel("largest relative error")
    handles, words = axes[0].get_legend_handles_labels()
    add_legend(figure, dict(zip(words, handles, strict=True)), COLUMNS)


def _set_scales(ax: Any, label: str) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.grid(linewidth=0.3)
    ax.set_xlabel(label)


def _draw_panel(ax: Any, table: "CostTable", quantity: str) -> None:
    rows = table.rows
    done = [row for row in rows if not isnan(row["error"])]
    errors = [max(row["error"], MIN_ERROR) for row in done]
    uncertainty = max(table.floor, MIN_ERROR)
    lowest = 10.0 ** floor(log10(min([uncertainty, *errors]))) / 10.0
    ax.set_ylim(lowest, 10.0 * max([1.0, *errors]))
    if table.floor > 0.0:
        ax.axhspan(lowest, uncertainty, color=STICK_SHADE, linewidth=0, label=BELOW)
    work = [row[quantity] for row in rows]
    middle = add_strip(ax) if len(done) < len(rows) else 0.0
    for number, name in enumerate(dict.fromkeys(map(line_of, rows))):
        of_line = [row for row in done if line_of(row) == name]
        colour = LINE_COLOURS[number % len(LINE_COLOURS)]
        if of_line:
            ax.plot(
                [row[quantity] for row in of_line],
                [max(row["error"], MIN_ERROR) for row in of_line],
                color=colour,
                marker=MESH_MARKERS[number % len(MESH_MARKERS)],
                linestyle=LINES[number % len(LINES)],
                linewidth=1.2,
                markersize=6,
                label=name,
            )
        failed = [r[quantity] for r in rows if isnan(r["error"]) and line_of(r) == name]
        if failed:
            _draw_failed(ax, failed, work, middle, f"{name}: {len(failed)} failed", color=colour)


def _draw_failed(
    ax: Any, failed: Sequence[float], work: Sequence[float], middle: float, label: str, **style: Any
) -> Line2D:
    """Mark failed runs by crosses in the middle of their strip; return the crosses."""
    style = {"marker": "x", "linestyle": "", "markersize": 8, "markeredgewidth": 2.0} | style
    (crosses,) = ax.plot(
        places_of(failed, work), np.full(len(failed), middle), **style, label=label
    )
    return crosses


def _draw_meshes(table: "CostTable", figure: "Figure | SubFigure") -> None:
    """Draw both panels into an empty figure."""
    set_height(figure, MESH_HEIGHT)
    set_title(figure, f"{table.title or table.kind}: what accuracy costs")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    titles = ("against the limit of fine meshes", "in time alone, on the scenario's own mesh")
    rows, bands = table.rows, (table.floor, table.time_uncertainty or 0.0)
    done = [row for row in rows if not isnan(row["error"])]
    errors = [row[name] for row in done for name in ("error", "time_error")]
    least = min((value for value in (*bands, *errors) if value > 0.0), default=MIN_MESH_ERROR)
    lowest = 10.0 ** floor(log10(max(least, MIN_MESH_ERROR)))
    for ax, title, band in zip((left, right), titles, bands, strict=True):
        _set_scales(ax, "wall time, s")
        ax.set_title(title, fontsize="medium")
        if band > 0.0:
            ax.axhspan(lowest, max(band, lowest), color=STICK_SHADE, linewidth=0)
        for target in TARGETS:
            ax.axhline(target, color=GREY, linewidth=0.8, linestyle=":")
    left.set_ylabel("largest relative error")
    handles = [*_draw_models(left, done), *_draw_methods(left, right, done)]
    left.set_ylim(lowest, None)
    work = [row["wall_seconds"] for row in rows]
    if failed := [row["wall_seconds"] for row in rows if isnan(row["error"])]:
        words = f"{len(failed)} failed"
        style = {"color": "black", "markersize": 7, "markeredgewidth": 1.5}
        handles.append(_draw_failed(left, failed, work, add_strip(left), words, **style))
    if max(bands) > 0.0:
        handles.append(Patch(color=STICK_SHADE, label=BELOW))
    add_legend(figure, {str(one.get_label()): one for one in handles})


def _draw_models(ax: Any, rows: "list[Row]") -> list[Any]:
    """Draw a line for each model; return legend handles: models, then bodies."""
    counts = sorted({row["bodies"] for row in rows})
    markers = {count: MESH_MARKERS[i % len(MESH_MARKERS)] for i, count in enumerate(counts)}
    cheapest: dict[str, dict[float, Row]] = {}  # by model and bodies: that with the longest step
    for row in rows:
        if row["backend"] == "moreau":
            cheapest.setdefault(row["model"], {}).setdefault(row["bodies"], row)
    handles = []
    for number, (model, of_model) in enumerate(cheapest.items()):
        colour = COLOURS[number % len(COLOURS)]
        style = {"color": colour, "linestyle": MESH_LINES[number % len(MESH_LINES)]}
        by_bodies = [of_model[count] for count in sorted(of_model)]
        points = [(row["wall_seconds"], max(row["error"], MIN_MESH_ERROR)) for row in by_bodies]
        ax.plot(*zip(*points, strict=True), **style)
        for row, point in zip(by_bodies, points, strict=True):
            ax.plot(*point, marker=markers[row["bodies"]], color=colour)
        handles.append(Line2D([], [], **style, label=f"moreau, {model}"))
    return handles + [
        Line2D([], [], color=GREY, linestyle="", marker=marker, label=f"{count:.0f} bodies")
        for count, marker in markers.items()
    ]


def _draw_methods(left: Any, right: Any, rows: "list[Row]") -> list[Any]:
    """Draw the settings of the scenario's own mesh into both panels."""
    in_time = [row for row in rows if not isnan(row["time_error"])]
    handles = []
    for number, name in enumerate(dict.fromkeys(map(line_of, in_time))):
        style: dict[str, Any] = {
            "color": COLOURS[-1 - number % len(COLOURS)],
            "marker": STEP_MARKERS[number % len(STEP_MARKERS)],
            "markersize": 8,
            "linewidth": 0.8,
        }
        of_line = [row for row in in_time if line_of(row) == name]
        seconds = [row["wall_seconds"] for row in of_line]
        for ax, error in ((left, "error"), (right, "time_error")):
            ax.plot(seconds, [max(row[error], MIN_MESH_ERROR) for row in of_line], **style)
        label = f"{name}, {of_line[0]['bodies']:.0f} bodies"
        handles.append(Line2D([], [], **style, label=label))
    return handles


FIT_HEIGHT, FIT_MARGIN = 3.4, 0.8  # inches, of a channel with its residuals, and of title and axis
RATIOS = (3.0, 1.2)  # heights of data and residuals
RESIDUAL_WIDTH = 12  # characters beside a panel of residuals
FULL_SIZE_POINTS = 60  # points: more are drawn smaller
DATA: dict[str, Any] = {"color": GREY, "linestyle": "", "marker": "o", "markerfacecolor": "none"}
FIT: dict[str, Any] = {"color": VERMILION, "linestyle": "-", "linewidth": 1.6}
RESIDUAL: dict[str, Any] = {"color": BLACK, "linestyle": "", "marker": "."}


def fit_diagram(outcome: "FitOutcome", figure: Any = None) -> Any:
    """Draw data and fit of each channel or quantity, with the residuals below.

    A grey band has the width of twice the standard deviation of the data.

    Parameters
    ----------
    figure : Figure or SubFigure, optional
        An empty one that is drawn into.
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
    upper.set_ylabel(axis_label(target.name.replace("_", " "), residuals.unit))
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
