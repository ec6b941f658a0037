"""The picture of a pulley: its response to force or torque, with the limits of static friction."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.plots import hanging_masses, time_history
from frictionsim.plots.hanging_masses import traction as traction
from frictionsim.plots.static_limit import LIMIT_LINE, draw_static_limit
from frictionsim.plots.style import add_legend
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.recorded import scenario_of
from frictionsim.scenario.validation import ValidationFailure, validate

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Quantities, Record

LIMITS = ("to hold", "to lift")
DRIVES = {"drive_force": "force", "drive_torque": "torque"}
LABEL_POINTS = 11.0  # height of a label beside a line
PANEL_SHARE = 0.5  # at least, of what a panel has of the height of its figure
MAX_LIMIT = 3.0  # of the largest force; a higher limit line would flatten the channel


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw force or torque, friction torque, angular velocity and angle over time.

    Lines show the forces or torques of impending motion, from rest, and the static limit of the
    friction torque. Of masses on the cord tensions, speeds, height and slip or slack are drawn.
    """
    masses = hanging_masses.has_masses(result)
    if masses and not channels:
        axes, handles = hanging_masses.draw_panels(result, figure)
    else:
        axes, handles = time_history.draw_channels(result, figure, channels)
    if masses or "friction_torque" in result.channels:
        limits = _limits(result)
        for drive in DRIVES:
            if drive in axes:
                _draw_limits(axes[drive], len(axes), result, limits, drive)
    handles += draw_static_limit(axes, result)
    add_legend(figure, handles)


def _limits(result: "Record") -> "Quantities":
    """Return the quantities of impending motion; none if another version wrote the scenario."""
    try:
        scenario = validate(scenario_of(result), Path())
    except ValidationFailure:
        return {}
    return mechanism_module(scenario.kind).statics(scenario)


def _draw_limits(ax: Any, panels: int, result: "Record", limits: "Quantities", drive: str) -> None:
    """Draw lines at the drive of impending motion, and label them within the panel's height."""
    highest = MAX_LIMIT * np.max(np.abs(result.channels[drive]))
    names = ((f"{DRIVES[drive]}_{words.replace(' ', '_')}", words) for words in LIMITS)
    found = [(limits[name].value, words) for name, words in names if name in limits]
    drawn = sorted(
        (force, words) for force, words in found if force is not None and abs(force) <= highest
    )
    unit = result.units[drive]
    for force, _ in drawn:
        ax.axhline(force, **LIMIT_LINE)
    figure, (low, high) = ax.figure, ax.get_ylim()
    points = 72.0 * figure.bbox.height / figure.dpi / panels
    places = label_places(
        [(force - low) / (high - low) for force, _ in drawn],
        min(0.5, LABEL_POINTS / (PANEL_SHARE * points)),
    )
    for (force, words), place in zip(drawn, places, strict=True):
        ax.annotate(
            f"{force:.1f} {unit} {words}".replace("-", "\N{MINUS SIGN}"),
            (1.0, place),
            (4.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center",
            fontsize="small",
        )


def label_places(lines: Sequence[float], height: float) -> list[float]:
    """Return where the middles of the labels of at most two lines are, in parts of a panel.

    The label of the lower line is below it, that of the upper one above it, but no label leaves the
    panel or overlaps the other.

    Parameters
    ----------
    lines : sequence of float
        Heights of the lines, ascending.
    height : float
        Of a label, at most 1/2.
    """
    half = 0.5 * height
    if len(lines) < 2:
        return [min(max(line + half, half), 1.0 - half) for line in lines]
    low = min(max(lines[0] - half, half), 1.0 - 3.0 * half)
    high = min(max(lines[1] + half, low + height), 1.0 - half)
    return [low, high]
