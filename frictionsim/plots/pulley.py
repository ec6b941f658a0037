"""The picture of a pulley: what the force does to it, with the limits of rest."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.plots import time_history
from frictionsim.plots.style import BLACK, Style, add_legend, scenario_of
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import ValidationFailure, validate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from frictionsim.io.hdf5_reader import Result
    from frictionsim.results import Quantities

LIMIT_LINE: Style = {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.8}
# The words stand above the upper line and below the lower one, however close these are.
LIMIT_FORCES = {"force_to_lift": ("to lift", "bottom"), "force_to_hold": ("to hold", "top")}
FAR = 3.0  # largest forces of the channel: a limit beyond would press the channel flat


def response(result: "Result") -> "Figure":
    """Draw force, friction torque, angular velocity and angle over time, with the limits of rest.

    The forces that just lift and hold stand beside the force, the static limit of the shaft
    around the friction torque.
    """
    figure, panels, handles = time_history.draw_channels(result)
    if "friction_torque" in result.channels:
        limits = _limits(result)
        if "drive_force" in panels:
            _draw_limit_forces(panels["drive_force"], result, limits)
        if limits and "friction_torque" in panels and "shaft_reaction" in result.channels:
            handles.append(_draw_static_limit(panels["friction_torque"], result, limits))
    add_legend(figure, handles)
    return figure


def _limits(result: "Result") -> "Quantities":
    """Return the figures of impending motion; none of a scenario of another version's keys."""
    try:
        scenario = validate(scenario_of(result), Path())
    except ValidationFailure:
        return {}
    return mechanism_module(scenario.kind).statics(scenario)


def _draw_limit_forces(panel: Any, result: "Result", limits: "Quantities") -> None:
    highest = FAR * np.max(np.abs(result.channels["drive_force"]))
    for name, (words, side) in LIMIT_FORCES.items():
        force = limits[name].value if name in limits else None
        if force is not None and force <= highest:
            panel.axhline(force, **LIMIT_LINE)
            panel.annotate(
                f"{force:.1f} N {words}",
                (1.0, force),
                (4.0, 0.0),
                xycoords=panel.get_yaxis_transform(),
                textcoords="offset points",
                va=side,
                fontsize="small",
            )


def _draw_static_limit(panel: Any, result: "Result", limits: Mapping[str, Any]) -> Any:
    time = result.channels["time"]
    limit = limits["friction_radius_static"].value * result.channels["shaft_reaction"]
    panel.plot(time, -limit, **LIMIT_LINE)
    return panel.plot(time, limit, **LIMIT_LINE, label="limit of static friction")[0]
