"""The pictures of a marble machine."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from frictionsim.plots.style import (
    add_legend,
    grid,
    label,
    line_style,
    require_channels,
    set_up,
)
from frictionsim.plots.time_history import OTHER_EVENT
from frictionsim.scenario.recorded import scenario_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

HEIGHT = 5.5  # inches
MARGIN = 0.25  # of the range of load and friction, above and below it
TRANSFER = "transfer"
MAX_TRANSFERS = 60  # marks of more transfers would hide the channels


def torque(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the torques on the gear over its angle: all, and again at the scale of the load.

    The torque of the motor is multiplied by the gear ratio. In steady motion it equals the load
    minus the (negative) friction torque, which is drawn too.
    """
    require_channels(result, "torque", ("angle", "motor_torque"))
    ratio = scenario_value(result, "mechanism", "gear_ratio")
    driving = {"motor, times the gear ratio": ratio * result.channels["motor_torque"]}
    resisting = _resisting(result)
    set_up(figure, result, HEIGHT)
    axes = figure.subplots(2 if resisting else 1, 1, sharex=True, squeeze=False)[:, 0]
    for ax in axes:
        handles = _draw(ax, result.channels["angle"], driving | resisting)
    if resisting:
        _scale_to(axes[-1], list(resisting.values()))
    axes[0].set_ylabel(label(result, "motor_torque", "torque on the gear"))
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
    grid(ax)
    return [
        ax.plot(angle, channel, **line_style(i), label=name)[0]
        for i, (name, channel) in enumerate(torques.items())
    ]


def _scale_to(ax: Any, channels: Sequence[Any]) -> None:
    """Set the limits of an Axes to the range of some of its channels."""
    low, high = np.min(channels), np.max(channels)
    margin = MARGIN * (high - low)
    if margin > 0.0:
        ax.set_ylim(low - margin, high + margin)


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
