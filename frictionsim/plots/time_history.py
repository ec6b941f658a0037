"""Channels over time, one panel under the other, with sticking shaded and events marked."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.errors import InputError
from frictionsim.plots.style import (
    BLUE,
    GREEN,
    GREY,
    MAX_LINES,
    STICK_COLOUR,
    VERMILION,
    Style,
    add_legend,
    blank,
    escape_mathtext,
    grid,
    label,
    line,
)
from frictionsim.scenario.kinds import mechanism_module

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from frictionsim.io.hdf5_reader import Result

PANEL_HEIGHT = 1.7  # inches
MAX_MARKS = 60  # events; more would hide the channels
MIN_STICK_WIDTH, MIN_GAP = 0.033, 0.08  # of the width, for the word `stick`, for a time

BREAKAWAY, REST, REVERSAL = "breakaway", "comes to rest", "reverses"
EVENT_LINES: dict[str, Style] = {
    BREAKAWAY: {"color": VERMILION, "linestyle": (0, (5, 2)), "linewidth": 1.0},
    REST: {"color": GREEN, "linestyle": (0, (5, 1.5, 1, 1.5)), "linewidth": 1.0},
    REVERSAL: {"color": VERMILION, "linestyle": (0, (1, 1)), "linewidth": 1.0},
}
OTHER_EVENT: Style = {"color": GREY, "linestyle": (0, (1, 1.5)), "linewidth": 1.0}


def response(result: "Result") -> "Figure":
    """Draw the channels that the kind wants drawn, or any if the file has none of them."""
    figure, _, handles = draw_channels(result)
    add_legend(figure, handles)
    return figure


def draw_channels(result: "Result") -> "tuple[Figure, dict[str, Any], list[Any]]":
    """Draw the channels of `response`; return picture, panels by channel, and handles for a key."""
    figure, panels = stack(result, _names(result))
    handles = []
    for name, panel in panels.items():
        handles += _draw_channel(panel, result, name)
    return figure, panels, [*handles, *mark_modes(result, list(panels.values()))]


def _names(result: "Result") -> list[str]:
    drawable = [
        name
        for name, axis in result.axes.items()
        if name not in ("time", "mode") and (not axis or len(result.members[axis]) <= MAX_LINES)
    ]
    wanted = mechanism_module(result.attributes["kind"]).PANELS
    names = [name for name in wanted if name in drawable] or drawable
    if not names:
        raise InputError("cannot draw this result: it has no channel that can be drawn as a line")
    return names


def stack(result: "Result", names: Sequence[str]) -> "tuple[Figure, dict[str, Any]]":
    """Return a picture with an empty panel over time for each channel, and the panels by name."""
    count = len(result.events["time"])
    notes = [f"{count} events, not marked"] if count > MAX_MARKS else []
    figure = blank(result, 0.8 + PANEL_HEIGHT * len(names), *notes)
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for panel, name in zip(panels, names, strict=True):
        panel.set_ylabel(label(result, name))
        grid(panel)
    panels[-1].set_xlabel("time, s")
    figure.align_ylabels(panels)
    return figure, dict(zip(names, panels, strict=True))


def _draw_channel(panel: Any, result: "Result", name: str) -> list[Any]:
    """Draw a channel; if it has columns, one line for each, and return their handles."""
    time, values = with_jumps(result, name)
    axis = result.axes[name]
    if not axis:
        panel.plot(time, values, color=BLUE, linewidth=1.5)
        return []
    return [
        panel.plot(
            time, column, **line(i), label=escape_mathtext(f"{axis} {result.members[axis][i]}")
        )[0]
        for i, column in enumerate(values.T)
    ]


def with_jumps(result: "Result", name: str) -> tuple[Any, Any]:
    """Return times and values of a channel, with both sides of each jump and a gap between them."""
    time, values = result.channels["time"], result.channels[name]
    sides = [result.events.get(f"{name}_{side}") for side in ("before", "after")]
    if sides[0] is None or sides[1] is None:
        return time, values
    jumps = sides[0] != sides[1]
    at = result.events["time"][jumps]
    others = ~np.isin(time, at)  # the sample at a jump has one side of it
    time, values = time[others], values[others]
    places = np.repeat(np.searchsorted(time, at), 3)
    gap = np.full(at.shape, np.nan)
    jump = np.stack((sides[0][jumps], gap, sides[1][jumps]), axis=1).ravel()
    return np.insert(time, places, np.repeat(at, 3)), np.insert(values, places, jump)


def mark_modes(result: "Result", panels: Sequence[Any]) -> list[Any]:
    """Shade the sticks and mark the events in all panels, label them above, return the handles."""
    sticks = list(_sticks(result))
    handles = _mark_events(result, panels, row=1 if sticks else 0)
    if not sticks:
        return handles
    for start, stop in sticks:
        for panel in panels:
            panel.axvspan(start, stop, color=STICK_COLOUR, linewidth=0)
        if stop - start > MIN_STICK_WIDTH * np.ptp(result.channels["time"]):
            annotate_above(panels[0], 0.5 * (start + stop), "stick", row=0)
    return [Patch(color=STICK_COLOUR, label="sticking"), *handles]


def _sticks(result: "Result") -> Iterator[tuple[float, float]]:
    """Yield the times from every rest to the next breakaway."""
    if result.axes.get("mode") != "":  # not all rests are those of one contact
        return
    time, events = result.channels["time"], result.events
    resting_since = time[0] if result.channels["mode"][0] == 0 else None
    for at, mode in zip(events["time"], events["mode_to"], strict=True):
        if mode == 0:
            resting_since = at
        elif resting_since is not None:
            yield resting_since, at
            resting_since = None
    if resting_since is not None:
        yield resting_since, time[-1]


def _mark_events(result: "Result", panels: Sequence[Any], row: int) -> list[Any]:
    """Mark the events, with their times from this row above the panels upwards."""
    times = result.events["time"]
    if len(times) > MAX_MARKS:
        return []
    names = _event_names(result)
    handles = {}
    for at, name in zip(times, names, strict=True):
        style = EVENT_LINES.get(name, OTHER_EVENT)
        handles[name] = Line2D([], [], label=escape_mathtext(name), **style)
        for panel in panels:
            panel.axvline(at, **style)
    least = MIN_GAP * np.ptp(result.channels["time"])
    for i, rows in enumerate(label_rows(times, least, most=2)):
        annotate_above(panels[0], times[i], f"{times[i]:.4g} s", row + rows)
    return list(handles.values())


def label_rows(places: Any, least: float, most: int) -> list[int]:
    """Return rows for texts at rising places that are so far apart in a row; none if too close."""
    for rows in range(1, most + 1):
        if all(b - a > least for a, b in zip(places, places[rows:], strict=False)):
            return [i % rows for i in range(len(places))]
    return []


def _event_names(result: "Result") -> list[str]:
    """Return what happens at each event: what the modes say, else the name of its contact."""
    columns = (result.events[name] for name in ("contact", "mode_from", "mode_to"))
    return [
        _event_name(result.contacts[int(contact)], before, after)
        for contact, before, after in zip(*columns, strict=True)
    ]


def _event_name(contact: str, before: float, after: float) -> str:
    if before == after:
        return contact
    if after == 0:
        return REST
    return BREAKAWAY if before == 0 else REVERSAL


def annotate_above(panel: Any, at: float, text: str, row: int) -> None:
    """Write a small text above a panel, in the first row over it or in a higher one."""
    panel.annotate(
        text,
        (at, 1.0),
        (0.0, 2.0 + 9.0 * row),
        xycoords=panel.get_xaxis_transform(),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize=7.5,
    )
