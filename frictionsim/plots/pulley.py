"""The picture of a pulley: its response to the force, with the limits of static friction."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.plots import time_history
from frictionsim.plots.style import (
    BLACK,
    Style,
    add_legend,
)
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.recorded import scenario_of
from frictionsim.scenario.validation import ValidationFailure, validate

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Quantities, Record

LIMIT_LINE: Style = {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.8}
# Labels are above the upper line and below the lower one, so that they do not overlap.
LIMIT_FORCES = {"force_to_lift": ("to lift", "bottom"), "force_to_hold": ("to hold", "top")}
MAX_LIMIT = 3.0  # of the largest force; a higher limit line would flatten the channel


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw force, friction torque, angular velocity and angle over time.

    Lines show the forces of impending motion and the static limit of the friction torque.
    """
    axes, handles = time_history.draw_channels(result, figure, channels)
    if "friction_torque" in result.channels:
        limits = _limits(result)
        if "drive_force" in axes:
            _draw_limit_forces(axes["drive_force"], result, limits)
        if limits and "friction_torque" in axes and "shaft_reaction" in result.channels:
            handles.append(_draw_static_limit(axes["friction_torque"], result, limits))
    add_legend(figure, handles)


def _limits(result: "Record") -> "Quantities":
    """Return the quantities of impending motion; none if another version wrote the scenario."""
    try:
        scenario = validate(scenario_of(result), Path())
    except ValidationFailure:
        return {}
    return mechanism_module(scenario.kind).statics(scenario)


def _draw_limit_forces(ax: Any, result: "Record", limits: "Quantities") -> None:
    highest = MAX_LIMIT * np.max(np.abs(result.channels["drive_force"]))
    for name, (words, side) in LIMIT_FORCES.items():
        force = limits[name].value if name in limits else None
        if force is not None and force <= highest:
            ax.axhline(force, **LIMIT_LINE)
            ax.annotate(
                f"{force:.1f} N {words}",
                (1.0, force),
                (4.0, 0.0),
                xycoords=ax.get_yaxis_transform(),
                textcoords="offset points",
                va=side,
                fontsize="small",
            )


def _draw_static_limit(ax: Any, result: "Record", limits: Mapping[str, Any]) -> Any:
    time = result.channels["time"]
    limit = limits["friction_radius_static"].value * result.channels["shaft_reaction"]
    ax.plot(time, -limit, **LIMIT_LINE)
    return ax.plot(time, limit, **LIMIT_LINE, label="limit of static friction")[0]
