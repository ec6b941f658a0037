"""The picture of a fit: data and fit over time, or over the key that the runs vary; residuals."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from frictionsim.display import BLACK, GREY, VERMILION
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.style import LABEL_WIDTH, STICK_COLOUR, add_legend, axis_label, set_title
from frictionsim.scenario.model_fields import description_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fitting.data import Target
    from frictionsim.fitting.outcome import Outcome, TargetResiduals

HEIGHT, MARGIN = 3.4, 0.8  # inches, of a channel with its residuals, and of title and axis
RATIOS = (3.0, 1.2)  # heights of data and residuals
RESIDUAL_WIDTH = 12  # characters beside a panel of residuals
FEW = 60  # points: more are drawn smaller
DATA: dict[str, Any] = {"color": GREY, "linestyle": "", "marker": "o", "markerfacecolor": "none"}
FIT: dict[str, Any] = {"color": VERMILION, "linestyle": "-", "linewidth": 1.6}
RESIDUAL: dict[str, Any] = {"color": BLACK, "linestyle": "", "marker": "."}


def diagram(found: "Outcome", ax: Any = None) -> "Figure":
    """Draw data and fit of each channel or quantity, with the residuals below.

    A grey band has the width of twice the standard deviation of the data.

    Parameters
    ----------
    found : Outcome
    ax : optional
        As in `frictionsim.plots.draw`.
    """
    return drawn_in(lambda target: _draw(found, target), ax)


def _draw(found: "Outcome", figure: "Figure | SubFigure") -> None:
    parts = list(zip(found.data.targets, found.residuals, strict=True))
    title = found.fitted.title or found.fitted.kind
    set_title(figure, f"{title}: fit to measured data", HEIGHT * len(parts) + MARGIN, scaled=False)
    axes = figure.subplots(2 * len(parts), 1, height_ratios=RATIOS * len(parts), squeeze=False)
    for number, (target, residuals) in enumerate(parts):
        upper, lower = axes[2 * number, 0], axes[2 * number + 1, 0]
        lower.sharex(upper)
        _draw_target(upper, lower, found, target, residuals)
    handles = [Line2D([], [], **DATA, label="data"), Line2D([], [], **FIT, label="fit")]
    add_legend(figure, [*handles, Line2D([], [], **RESIDUAL, label="data minus fit")])


def _draw_target(
    upper: Any, lower: Any, found: "Outcome", target: "Target", residuals: "TargetResiduals"
) -> None:
    x, label = _abscissa(found, target)
    order = np.argsort(x, kind="stable")
    size = 5.0 if len(x) <= FEW else 2.5
    upper.plot(x, target.values, **DATA, markersize=size)
    upper.plot(x[order], residuals.fitted[order], **FIT)
    upper.set_ylabel(axis_label(target.name.replace("_", " "), residuals.unit, LABEL_WIDTH))
    upper.tick_params(labelbottom=False)
    if residuals.sigma is not None:
        lower.axhspan(-residuals.sigma, residuals.sigma, color=STICK_COLOUR, linewidth=0)
    lower.axhline(0.0, color=VERMILION, linewidth=1.0)
    lower.plot(x, residuals.values, **RESIDUAL, markersize=size)
    lower.set_ylabel(axis_label("residual", residuals.unit, RESIDUAL_WIDTH))
    lower.set_xlabel(label)
    for ax in (upper, lower):
        ax.grid(linewidth=0.3)


def _abscissa(found: "Outcome", target: "Target") -> tuple[Any, str]:
    """Return the abscissae of a target's values, and the label of that axis."""
    if target.of == "channel":
        return target.times, "time, s"
    if len(found.data.over) == 1:
        key = found.data.over[0]
        label = axis_label(key, description_of(type(found.fitted), key)[0])
        return np.array([found.data.runs[run][key] for run in target.runs]), label
    return target.runs + 1.0, "run"
