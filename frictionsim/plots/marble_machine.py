"""The pictures of a marble machine."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from frictionsim.plots.style import add_legend, blank, given, grid, label, line, need
from frictionsim.plots.time_history import OTHER_EVENT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from frictionsim.io.hdf5_reader import Result

HEIGHT = 5.5  # inches
ROOM = 0.25  # of the range of load and friction, above and below it
TRANSFER = "transfer"
MAX_TRANSFERS = 60  # more would hide the channels


def torque(result: "Result") -> "Figure":
    """Draw the torques on the gear over its angle: all, and again at the scale of the load.

    The torque of the motor stands there times the gear ratio. In steady motion it is the load
    less the friction, which is drawn too.
    """
    need(result, "torque", ("angle", "motor_torque"))
    ratio = given(result, "mechanism", "gear_ratio")
    driving = {"motor, times the gear ratio": ratio * result.channels["motor_torque"]}
    resisting = _resisting(result)
    figure = blank(result, HEIGHT)
    panels = figure.subplots(2 if resisting else 1, 1, sharex=True, squeeze=False)[:, 0]
    for panel in panels:
        handles = _draw(panel, result.channels["angle"], driving | resisting)
    if resisting:
        _scale_to(panels[-1], list(resisting.values()))
    panels[0].set_ylabel(label(result, "motor_torque", "torque on the gear"))
    panels[-1].set_ylabel(label(result, "motor_torque", "at the scale of the load"))
    panels[-1].set_xlabel("angle of the gear, rad")
    figure.align_ylabels(panels)
    add_legend(figure, [*handles, *_mark_transfers(result, panels)], columns=3)
    return figure


def _resisting(result: "Result") -> dict[str, Any]:
    """Return the torques of the marbles and of the friction, of those that the result has."""
    channels = result.channels
    found = {}
    if "load_torque" in channels:
        found["load of the marbles"] = channels["load_torque"]
    if "friction_torque" in channels:
        found["friction"] = channels["friction_torque"]
    if len(found) == 2:
        found["load less friction"] = channels["load_torque"] - channels["friction_torque"]
    return found


def _draw(panel: Any, angle: Any, torques: dict[str, Any]) -> list[Any]:
    grid(panel)
    return [
        panel.plot(angle, channel, **line(i), label=name)[0]
        for i, (name, channel) in enumerate(torques.items())
    ]


def _scale_to(panel: Any, channels: Sequence[Any]) -> None:
    """Have a panel show the range of some of its channels, the others as far as they are in it."""
    low, high = np.min(channels), np.max(channels)
    room = ROOM * (high - low)
    if room > 0.0:
        panel.set_ylim(low - room, high + room)


def _mark_transfers(result: "Result", panels: Any) -> list[Any]:
    if TRANSFER not in result.contacts or "angle" not in result.events:
        return []
    which = result.events["contact"] == result.contacts.index(TRANSFER)
    angles = result.events["angle"][which]
    if not 0 < angles.size <= MAX_TRANSFERS:
        return []
    for panel in panels:
        for angle in angles:
            panel.axvline(angle, **OTHER_EVENT)
    return [Line2D([], [], **OTHER_EVENT, label=TRANSFER)]
