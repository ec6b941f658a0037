"""Channels over time in stacked panels, with sticking shaded, events and static limits marked."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    STICK_SHADE,
    VERMILION,
    WINE,
    picture_text,
)
from frictionsim.errors import ArgumentError, InputError
from frictionsim.mechanisms.effects import friction_radius
from frictionsim.plots.old_style import (
    MAX_LINES,
    Style,
    add_legend,
    grid,
    label,
    line_style,
    relative_width,
    set_up,
    shrink,
    text_scale,
)
from frictionsim.results import SLACK, TAUT
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.toml_data import scenario_value
from frictionsim.simulation.record import (
    BREAKAWAY,
    ENGAGEMENT,
    IMPACT,
    LEFT,
    REST,
    REVERSAL,
    SLIPS,
    STICKS,
    event_labels,
    sticking_phases,
    sticking_words,
    with_jumps,
)
from frictionsim.solvers.events import STOP as END_STOP

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record


LIMIT_LINE: Style = {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.8}


def draw_static_limit(axes: dict[str, Any], result: "Record") -> list[Any]:
    """Draw the static limit of the friction torque of a journal; return legend handles.

    There is none without the panel of the friction torque, the reaction, or the friction of a
    shaft.

    Parameters
    ----------
    axes : dict of Axes
        By channel.
    """
    if "friction_torque" not in axes or "shaft_reaction" not in result.channels:
        return []
    try:
        journal = scenario_value(result, "effects", "shaft_friction")
        radius = friction_radius(float(journal["shaft_radius"]), float(journal["mu_s"]))
    except (InputError, KeyError, TypeError, ValueError):
        return []
    time, limit = result.channels["time"], radius * result.channels["shaft_reaction"]
    ax = axes["friction_torque"]
    ax.plot(time, -limit, **LIMIT_LINE)
    return list(ax.plot(time, limit, **LIMIT_LINE, label="limit of static friction"))


PANEL_HEIGHT = 1.7  # inches
MAX_PANELS = 16
ANNOTATION = 7.5  # points
MAX_MARKS = 60  # events; marks of more would hide the channels
# Lines of events that are closer, of the width of such a picture, are thinner, but not below a
# part of their width, and behind the channels: else bounces are a bar that hides these.
FRAME = 0.005  # width of the line around a panel, of the time axis
EVENT_SPACING, THINNEST = 0.008, 0.25
# For a letter of the label of a stick, for a time: of the width of a picture that is WIDTH wide.
MIN_LETTER_WIDTH, MIN_GAP = 0.0066, 0.08

EVENT_DASHES = ((5, 2), (5, 1.5, 1, 1.5), (1, 1))
EVENTS = (  # by colour: what they are of, and three events in the order of dashes
    (VERMILION, "", (BREAKAWAY, REST, REVERSAL)),
    (PURPLE, "cord: ", (SLIPS, STICKS, REVERSAL)),
    *(
        (BLUE, f"{side} rope: ", (ENGAGEMENT[SLACK], ENGAGEMENT[TAUT], IMPACT))
        for side in ("car", "counterweight")
    ),
    (WINE, f"{END_STOP}: ", (LEFT, REST, IMPACT)),
)
EVENT_LINES: dict[str, Style] = {
    f"{part}{word}": {"color": colour, "linestyle": (0, dashes), "linewidth": 1.0}
    for colour, part, words in EVENTS
    for word, dashes in zip(words, EVENT_DASHES, strict=True)
}
EVENT_LINES[REST]["color"] = GREEN
OTHER_EVENT: Style = {"color": GREY, "linestyle": (0, (1, 1.5)), "linewidth": 1.0}


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw the channels in PANELS of the kind, or all others if the file has none of them.

    Parameters
    ----------
    channels : sequence of str
        Those that are drawn instead.
    """
    _, handles = draw_channels(result, figure, channels)
    add_legend(figure, handles)


def draw_channels(
    result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()
) -> tuple[dict[str, Any], list[Any]]:
    """Draw the channels of `response`; return the Axes by channel, and legend handles."""
    count = len(result.events["time"])
    notes = [f"{count} events, not marked"] if count > MAX_MARKS else []
    axes = stacked_axes(result, figure, channels_of(result, channels), *notes)
    handles = []
    for name, ax in axes.items():
        handles += _draw_channel(ax, result, name)
    return axes, [*handles, *mark_modes(result, list(axes.values()))]


def channels_of(result: "Record", wanted: Sequence[str] = ()) -> list[str]:
    """Return the channels to draw over time: the wanted ones, or those of the kind."""
    for name in wanted:
        axis = result.axes[name]
        if axis and len(result.members[axis]) > MAX_LINES:
            raise ArgumentError(
                "channels",
                f"'{name}' has values for {len(result.members[axis])} members of the axis '{axis}',"
                f" a panel shows {MAX_LINES}; choose another one",
            )
    if len(wanted) > MAX_PANELS:
        raise ArgumentError("channels", f"expected at most {MAX_PANELS}, got {len(wanted)}")
    if wanted:
        return list(wanted)
    drawable = [
        name
        for name, axis in result.axes.items()
        if name not in ("time", "mode") and (not axis or len(result.members[axis]) <= MAX_LINES)
    ]
    wanted_by_kind = getattr(mechanism_module(result.attributes["kind"]), "PANELS", ())
    names = [name for name in wanted_by_kind if name in drawable] or drawable
    if not names:
        raise InputError("cannot draw this result: it has no channel that can be drawn over time")
    return names


def stacked_axes(
    result: "Record", figure: "Figure | SubFigure", names: Sequence[str], *notes: str
) -> dict[str, Any]:
    """Add stacked, empty Axes over time to an empty figure, one for each channel.

    Parameters
    ----------
    names : sequence of str
        The channels; other names are those of panels without a unit, yet to be labelled.
    *notes : str
        Further notes in the title.

    Returns
    -------
    dict of Axes
        By channel.
    """
    scale = set_up(figure, result, panel_heights(len(names)), *notes)
    labels = [label(result, name) if name in result.units else name for name in names]
    axes = panels_over_time(figure, labels)
    for ax in axes:
        shrink(ax.yaxis.label, scale)
    return dict(zip(names, axes, strict=True))


def panels_over_time(figure: "Figure | SubFigure", labels: Sequence[str]) -> list[Any]:
    """Add stacked, empty Axes over time with labels to an empty figure."""
    axes = figure.subplots(len(labels), 1, sharex=True, squeeze=False)[:, 0]
    for ax, text in zip(axes, labels, strict=True):
        ax.set_ylabel(text)
        grid(ax)
    axes[-1].set_xlabel("time, s")
    figure.align_ylabels(axes)
    return list(axes)


def panel_heights(count: int) -> float:
    """Return the height of a picture of stacked panels, inches."""
    return 0.8 + PANEL_HEIGHT * count


def _draw_channel(ax: Any, result: "Record", name: str) -> list[Any]:
    """Draw a channel; return the legend handles of its columns, if it has any."""
    time, values = with_jumps(result, name)
    axis = result.axes[name]
    if not axis:
        ax.plot(time, values, color=BLUE, linewidth=1.5)
        if name in result.flags:
            label_flags(ax, result, name)
        return []
    return [
        ax.plot(
            time,
            column,
            **line_style(i),
            label=f"{axis} {result.members[axis][i]}",
        )[0]
        for i, column in enumerate(values.T)
    ]


def label_flags(ax: Any, result: "Record", name: str) -> None:
    """Write the meanings of the values of a channel, such as a mode, at the axis."""
    ticks = [(value, words.replace("_", " ")) for value, words in result.flags[name]]
    ax.set_yticks(*map(list, zip(*ticks, strict=True)))


def mark_modes(result: "Record", axes: Sequence[Any]) -> list[Any]:
    """Shade sticking phases and mark events in all Axes; return the legend handles.

    Parameters
    ----------
    axes : sequence of Axes
        Labels are written above the first.
    """
    sticks = list(sticking_phases(result))
    handles = _mark_events(result, axes, row=1 if sticks else 0)
    if not sticks:
        return handles
    words = sticking_words(result)
    short = words.removesuffix("ing")  # stick
    narrow = len(short) * MIN_LETTER_WIDTH / relative_width(axes[0].figure)
    narrow *= np.ptp(result.channels["time"])
    for start, stop in sticks:
        for ax in axes:
            ax.axvspan(start, stop, color=STICK_SHADE, linewidth=0)
        if stop - start > narrow:
            annotate_above(axes[0], 0.5 * (start + stop), short, row=0)
    return [Patch(color=STICK_SHADE, label=words), *handles]


def _mark_events(result: "Record", axes: Sequence[Any], row: int) -> list[Any]:
    """Mark the events, and write their times above the first Axes from `row` upwards."""
    times = result.events["time"]
    if len(times) > MAX_MARKS:
        return []
    names = event_labels(result)
    handles = {}
    samples = result.channels["time"]
    span = np.ptp(samples) / relative_width(axes[0].figure)
    widths = line_widths(times, EVENT_SPACING * span)
    for at, name, width in zip(times, names, widths, strict=True):
        style = EVENT_LINES.get(name, OTHER_EVENT)
        handles[name] = Line2D([], [], label=name, **style)
        thin = {"linewidth": width * style["linewidth"], "zorder": 2.0 if width == 1.0 else 1.5}
        if min(at - samples[0], samples[-1] - at) <= FRAME * span:  # which would hide it
            thin |= {"zorder": 3.0, "clip_on": False}
        for ax in axes:
            ax.axvline(at, **style | thin)
    min_gap = MIN_GAP * span
    for i, rows in enumerate(label_rows(times, min_gap, max_rows=2)):
        annotate_above(axes[0], times[i], f"{picture_text(times[i])} s", row + rows)
    return list(handles.values())


def line_widths(positions: Any, near: float) -> "npt.NDArray[np.float64]":
    """Return the widths of lines relative to the usual one: less where they are dense.

    Parameters
    ----------
    positions : (n,)
        In increasing order.
    near : float
        Lines with nearer neighbours on both sides are thinner.
    """
    gaps = np.diff(np.asarray(positions, dtype=float), prepend=-np.inf, append=np.inf)
    # Two lines beside each other hide nothing.
    wider = np.maximum(gaps[:-1], gaps[1:])
    return np.clip(wider / near, THINNEST, 1.0) if near > 0.0 else np.ones(len(wider))


def label_rows(positions: Any, min_gap: float, max_rows: int) -> list[int]:
    """Distribute labels over rows so that they do not overlap.

    Parameters
    ----------
    positions : (n,)
        In increasing order.
    min_gap : float
        Smallest distance of two labels in a row.

    Returns
    -------
    list of int
        Row of each label; empty if they do not fit into max_rows.
    """
    for rows in range(1, max_rows + 1):
        if all(b - a > min_gap for a, b in zip(positions, positions[rows:], strict=False)):
            return [i % rows for i in range(len(positions))]
    return []


def annotate_above(ax: Any, at: float, text: str, row: int) -> None:
    """Write a small text above an Axes.

    Parameters
    ----------
    at : float
        Position in x, in data units.
    row : int
        0 is the row next to the Axes.
    """
    ax.annotate(
        text,
        (at, 1.0),
        (0.0, 2.0 + 9.0 * row * text_scale()),
        xycoords=ax.get_xaxis_transform(),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize=ANNOTATION * text_scale(),
    )
