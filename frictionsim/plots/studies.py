"""The pictures of studies: the cost of accuracy, and data with a fit.

A study of costs has the error against wall time and against evaluations of the right-hand side. A
study of meshes has the error of the mesh beside that of the steps. Left: error against the limit of
fine meshes, a line for each model, a marker for each number of bodies. Right: how far runs on the
scenario's own mesh are from that mesh converged in time. Both have the same axes: a run that is
exact in time stays as far off on the left as its mesh is. Failed runs are marked in a strip above
the errors.
"""

from collections.abc import Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import BLACK, COLOURS, GREY, STICK_SHADE, VERMILION, WINE
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.style import (
    LABEL_WIDTH,
    add_legend,
    axis_label,
    set_log_ticks,
    set_title,
)
from frictionsim.scenario.model_fields import description_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fitting.data import Target
    from frictionsim.fitting.outcome import FitOutcome, TargetResiduals
    from frictionsim.work_precision.outcome import Row, WorkPrecision

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
MIN_MESH_ERROR = 1e-12  # smaller errors are drawn here
TARGETS = (1e-2, 1e-3)


def draw_mesh_study(study: "WorkPrecision", figure: "Figure | SubFigure") -> None:
    """Draw both panels into an empty figure."""
    set_title(
        figure, f"{study.title or study.kind}: what accuracy costs", MESH_HEIGHT, scaled=False
    )
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    in_time = study.floor_in_time
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
            ax.axhspan(lowest, max(height, lowest), color=STICK_SHADE, linewidth=0)
    handles: list[Any] = list(_draw_models(left, study.rows))
    handles += _draw_methods(left, right, [row for row in study.rows if row.time_error is not None])
    left.set_ylim(lowest, None)
    _set_work_ticks(left, [row.wall_seconds for row in study.rows])
    handles += _draw_failed_meshes(left, study.rows)
    if max(study.floor, in_time) > 0.0:
        handles.append(Patch(color=STICK_SHADE, label=BELOW))
    for ax in (left, right):
        for target in TARGETS:
            ax.axhline(target, color=GREY, linewidth=0.8, linestyle=":")
    add_legend(figure, handles)


def _lowest(study: "WorkPrecision", in_time: float) -> float:
    errors = [study.floor, in_time]
    errors += [row.error for row in study.rows if row.error is not None]
    errors += [row.time_error for row in study.rows if row.time_error is not None]
    least = min((value for value in errors if value > 0.0), default=MIN_MESH_ERROR)
    return float(10.0 ** floor(log10(max(least, MIN_MESH_ERROR))))


def cheapest_of_meshes(rows: "list[Row]") -> "dict[str, list[Row]]":
    """Return, by model, the first row of each of its meshes that is done: its longest step."""
    cheapest: dict[str, dict[int, Row]] = {}
    for row in rows:
        mesh = row.setting.mesh
        if mesh is not None and row.error is not None and row.setting.backend == "moreau":
            cheapest.setdefault(mesh.model, {}).setdefault(mesh.bodies, row)
    return {model: [of[count] for count in sorted(of)] for model, of in cheapest.items()}


def _draw_models(ax: Any, rows: "list[Row]") -> list[Line2D]:
    """Draw a line for each model; return legend handles: models, then bodies."""
    counts = sorted({row.setting.mesh.bodies for row in rows if row.setting.mesh})
    markers = {count: MESH_MARKERS[i % len(MESH_MARKERS)] for i, count in enumerate(counts)}
    handles = []
    for number, (model, model_rows) in enumerate(cheapest_of_meshes(rows).items()):
        colour = COLOURS[number % len(COLOURS)]
        style = {"color": colour, "linestyle": MESH_LINES[number % len(MESH_LINES)]}
        points = [(row.wall_seconds, max(row.error or 0.0, MIN_MESH_ERROR)) for row in model_rows]
        ax.plot(*zip(*points, strict=True), **style)
        for row, (x, y) in zip(model_rows, points, strict=True):
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
        line_rows = [row for row in rows if row.setting.line == line]
        seconds = [row.wall_seconds for row in line_rows]
        left.plot(seconds, [max(row.error or 0.0, MIN_MESH_ERROR) for row in line_rows], **style)
        right.plot(
            seconds, [max(row.time_error or 0.0, MIN_MESH_ERROR) for row in line_rows], **style
        )
        bodies = line_rows[0].setting.mesh.bodies if line_rows[0].setting.mesh else 0
        handles.append(Line2D([], [], **style, label=f"{line}, {bodies} bodies"))
    return handles


def _draw_failed_meshes(ax: Any, rows: "list[Row]") -> list[Line2D]:
    """Mark runs without an error in a strip above the others."""
    failed = [row for row in rows if row.error is None]
    if not failed:
        return []
    style: dict[str, Any] = {"color": "black", "marker": "x", "linestyle": "", "markersize": 7}
    at = places_of([row.wall_seconds for row in failed], [row.wall_seconds for row in rows])
    ax.plot(at, np.full(at.size, add_strip(ax)), **style)
    return [Line2D([], [], **style, label=f"{len(failed)} failed")]


LINE_COLOURS = (*COLOURS, WINE)
# Markers and line styles differ too, for grey print.
MARKERS = ("o", "s", "^", "D", "v", "P", "*", "<", ">", "h")
LINES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)))
WIDTH, HEIGHT = 9.0, 4.9  # inches, without the legend
COLUMNS = 5  # of the legend
MIN_ERROR = 1e-16  # smaller errors are drawn here
WORK = (("wall_seconds", "wall time, s"), ("rhs_evaluations", "right-hand-side evaluations"))


def cost_diagram(study: "WorkPrecision", ax: Any = None) -> "Figure":
    """Draw one line for each backend; failed settings are marked in a strip above them.

    A study of meshes has the panels of `frictionsim.plots.studies`.

    Parameters
    ----------
    study : WorkPrecision
    ax : optional
        As in `frictionsim.plots.draw`.
    """
    draw = draw_mesh_study if study.of_meshes else _draw
    return drawn_in(lambda target: draw(study, target), ax, WIDTH)


def _draw(study: "WorkPrecision", figure: "Figure | SubFigure") -> None:
    set_title(figure, f"{study.title or study.kind}: error against run time", HEIGHT, scaled=False)
    axes = figure.subplots(1, 2, sharey=True)
    for ax, (quantity, label) in zip(axes, WORK, strict=True):
        _draw_panel(ax, study, quantity)
        ax.set_xlabel(label)
    axes[0].set_ylabel("largest relative error")
    add_legend(figure, axes[0].get_legend_handles_labels()[0], COLUMNS)


def _draw_panel(ax: Any, study: "WorkPrecision", quantity: str) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.grid(linewidth=0.3)
    errors = [max(row.error, MIN_ERROR) for row in study.rows if row.error is not None]
    floor_height = max(study.floor, MIN_ERROR)
    lowest = 10.0 ** floor(log10(min([floor_height, *errors]))) / 10.0
    ax.set_ylim(lowest, 10.0 * max([1.0, *errors]))
    if study.floor > 0.0:
        ax.axhspan(
            lowest,
            floor_height,
            color=STICK_SHADE,
            linewidth=0,
            label=BELOW,
        )
    work = [getattr(row, quantity) for row in study.rows]
    _set_work_ticks(ax, work)
    middle = add_strip(ax) if any(row.error is None for row in study.rows) else 0.0
    names = list(dict.fromkeys(row.setting.line for row in study.rows))
    for number, name in enumerate(names):
        rows = [row for row in study.rows if row.setting.line == name]
        _draw_backend(ax, rows, quantity, number)
        places = places_of([getattr(row, quantity) for row in rows if row.error is None], work)
        if places.size:
            _draw_failed(ax, places, middle, number, f"{name}: {places.size} failed")


def _set_work_ticks(ax: Any, work: Sequence[float]) -> None:
    """Label the axis of work; a refused run has done none."""
    done = [value for value in work if value > 0.0]
    if done:
        set_log_ticks(ax.xaxis, max(done) / min(done))


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


FIT_HEIGHT, FIT_MARGIN = 3.4, 0.8  # inches, of a channel with its residuals, and of title and axis
RATIOS = (3.0, 1.2)  # heights of data and residuals
RESIDUAL_WIDTH = 12  # characters beside a panel of residuals
FULL_SIZE_POINTS = 60  # points: more are drawn smaller
DATA: dict[str, Any] = {"color": GREY, "linestyle": "", "marker": "o", "markerfacecolor": "none"}
FIT: dict[str, Any] = {"color": VERMILION, "linestyle": "-", "linewidth": 1.6}
RESIDUAL: dict[str, Any] = {"color": BLACK, "linestyle": "", "marker": "."}


def fit_diagram(outcome: "FitOutcome", ax: Any = None) -> "Figure":
    """Draw data and fit of each channel or quantity, with the residuals below.

    A grey band has the width of twice the standard deviation of the data.

    Parameters
    ----------
    ax : optional
        As in `frictionsim.plots.draw`.
    """
    return drawn_in(lambda target: _draw_fit(outcome, target), ax)


def _draw_fit(outcome: "FitOutcome", figure: "Figure | SubFigure") -> None:
    parts = list(zip(outcome.data.targets, outcome.residuals, strict=True))
    title = outcome.fitted.title or outcome.fitted.kind
    set_title(
        figure, f"{title}: fit to measured data", FIT_HEIGHT * len(parts) + FIT_MARGIN, scaled=False
    )
    axes = figure.subplots(2 * len(parts), 1, height_ratios=RATIOS * len(parts), squeeze=False)
    for number, (target, residuals) in enumerate(parts):
        upper, lower = axes[2 * number, 0], axes[2 * number + 1, 0]
        lower.sharex(upper)
        _draw_target(upper, lower, outcome, target, residuals)
    handles: list[Any] = [Line2D([], [], **DATA, label="data"), Line2D([], [], **FIT, label="fit")]
    handles.append(Line2D([], [], **RESIDUAL, label="data minus fit"))
    if any(residuals.sigma is not None for _, residuals in parts):
        handles.append(Patch(color=STICK_SHADE, label="± standard deviation of the data"))
    add_legend(figure, handles)


def _draw_target(
    upper: Any, lower: Any, outcome: "FitOutcome", target: "Target", residuals: "TargetResiduals"
) -> None:
    x, label = _abscissa(outcome, target)
    order = np.argsort(x, kind="stable")
    size = 5.0 if len(x) <= FULL_SIZE_POINTS else 2.5
    upper.plot(x, target.values, **DATA, markersize=size)
    upper.plot(x[order], residuals.fitted[order], **FIT)
    upper.set_ylabel(axis_label(target.name.replace("_", " "), residuals.unit, LABEL_WIDTH))
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
    if len(outcome.data.over) == 1:
        key = outcome.data.over[0]
        label = axis_label(key, description_of(type(outcome.fitted), key)[0])
        return np.array([outcome.data.runs[run][key] for run in target.runs]), label
    return target.runs + 1.0, "run"
