"""The pictures of a marble machine."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from frictionsim.plots.style import (
    Style,
    add_legend,
    grid,
    label,
    line_style,
    require_channels,
    set_up,
)
from frictionsim.plots.time_history import OTHER_EVENT, response
from frictionsim.plots.view import View, over_time
from frictionsim.scenario.toml_data import scenario_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

HEIGHT, SINGLE_HEIGHT = 5.5, 3.6  # inches, with two panels and with one
FINER = 0.5  # of the range of all torques: a panel with more of it would show the same
POINTS = ("o", "s", "^", "D")
MARGIN = 0.25  # of the range of load and friction, above and below it
TRANSFER = "transfer"
MAX_TRANSFERS = 60  # marks of more transfers would hide the channels


def torque(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the torques on the gear over its angle: all, and again at the scale of the load.

    The second panel is drawn only if its scale is finer, at most FINER of the first one.

    The torque of the motor is multiplied by the gear ratio. In steady motion it equals the load
    minus the (negative) friction torque, which is drawn too.
    """
    require_channels(result, "torque", ("angle", "motor_torque"))
    ratio = scenario_value(result, "mechanism", "gear_ratio")
    driving = {"motor, times the gear ratio": ratio * result.channels["motor_torque"]}
    resisting = _resisting(result)
    scale = _finer_scale(list(driving.values()), list(resisting.values()))
    set_up(figure, result, HEIGHT if scale else SINGLE_HEIGHT)
    axes = figure.subplots(2 if scale else 1, 1, sharex=True, squeeze=False)[:, 0]
    for ax in axes:
        handles = _draw(ax, result.channels["angle"], driving | resisting)
    axes[0].set_ylabel(label(result, "motor_torque", "torque on the gear"))
    if scale:
        axes[-1].set_ylim(scale)
        axes[-1].set_ylabel(label(result, "motor_torque", "at the scale of the load"))
    axes[-1].set_xlabel("angle of the gear, rad")
    figure.align_ylabels(axes)
    add_legend(figure, [*handles, *_mark_transfers(result, axes)], columns=3)


def _resisting(result: "Record") -> dict[str, Any]:
    """Return the recorded torques of the marbles and of friction, and their difference."""
    channels = result.channels
    torques = {}
    if "load_torque" in channels:
        torques["load of the marbles"] = channels["load_torque"]
    if "friction_torque" in channels:
        torques["friction"] = channels["friction_torque"]
    if len(torques) == 2:
        torques["load minus friction"] = channels["load_torque"] - channels["friction_torque"]
    return torques


def _draw(ax: Any, angle: Any, torques: dict[str, Any]) -> list[Any]:
    """Draw torques over the angle: as lines, or as points if the gear does not turn."""
    grid(ax)
    return [
        ax.plot(angle, channel, **line_style(i), **_point(angle, i), label=name)[0]
        for i, (name, channel) in enumerate(torques.items())
    ]


def _point(angle: Any, number: int) -> Style:
    """Return the marker of a line over a single angle, which could not be seen."""
    return {} if np.ptp(angle) > 0.0 else {"marker": POINTS[number % len(POINTS)]}


def _finer_scale(driving: Sequence[Any], resisting: Sequence[Any]) -> tuple[float, float] | None:
    """Return the range of the resisting torques with its margin; None if all have about that."""
    if not resisting:
        return None
    low, high = float(np.min(resisting)), float(np.max(resisting))
    margin = MARGIN * (high - low)
    all_low, all_high = min(low, float(np.min(driving))), max(high, float(np.max(driving)))
    if not 0.0 < high - low + 2.0 * margin <= FINER * (all_high - all_low):
        return None
    return low - margin, high + margin


def _mark_transfers(result: "Record", axes: Any) -> list[Any]:
    if TRANSFER not in result.contacts or "angle" not in result.events:
        return []
    which = result.events["contact"] == result.contacts.index(TRANSFER)
    angles = result.events["angle"][which]
    if not 0 < angles.size <= MAX_TRANSFERS:
        return []
    for ax in axes:
        for angle in angles:
            ax.axvline(angle, **OTHER_EVENT)
    return [Line2D([], [], **OTHER_EVENT, label=TRANSFER)]


VIEWS = {"response": over_time(response), "torque": View(torque, window=True)}
