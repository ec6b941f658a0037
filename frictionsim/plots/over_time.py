"""Channels over time: of one result with sticking and events, or of several over each other."""

from collections.abc import Collection, Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from frictionsim.display import (
    BLACK,
    GREY,
    MAX_MARKS,
    STICK_SHADE,
    event_colour,
    event_dashes,
    picture_text,
)
from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.plots.style import (
    LIMIT,
    MARKERS,
    MAX_LINES,
    Look,
    axis_label,
    letters_across,
    line_look,
    plain,
    set_height,
    set_title,
    short_overrides,
    title_of,
)
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.simulation.record import (
    event_labels,
    sticking_phases,
    sticking_words,
    with_jumps,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.fits.data import Target
    from frictionsim.results import Record

    Panels = Mapping[str, Mapping[str, str]]
    Limits = Mapping[str, Mapping[str, Any]]
    Window = tuple[float | None, float | None]

PANEL_HEIGHT, FRAME = 1.7, 0.8  # inches, of a panel, and of title and axis
MAX_PANELS = 16
WHOLE: "Window" = (None, None)
POINTS: Look = {"color": BLACK, "linestyle": "", "markerfacecolor": "none"}
FULL_SIZE_POINTS = 60  # more are drawn smaller
ROW = 0.07  # of the height of a panel, of a row of marks above it, for each of several results

LIMIT_DASHES = ((3.0, 2.0), (1.0, 1.0), (6.0, 2.0, 1.0, 2.0), (10.0, 3.0))  # of limits, in turn


def event_look(words: str) -> Look:
    """Return the look of the lines of an event, which has the same one in each picture."""
    dashes = (0, event_dashes(words))
    return {"color": event_colour(words), "linestyle": dashes, "linewidth": 1.2}


def over_time(
    records: Sequence["Record"],
    panels: "Panels",
    figure: "Figure | SubFigure",
    *,
    names: Sequence[str] = (),
    limits: "Limits | None" = None,
    window: "Window" = WHOLE,
    events: bool = True,
    notes: Sequence[str] = (),
    measured: Sequence["Target"] = (),
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Draw panels of channels over time; return their Axes by label, and the legend by words.

    One result has its sticking phases shaded and its events marked; several have a colour each,
    and rows above the panels with their sticking phases as bars and their events as ticks.

    Parameters
    ----------
    panels : mapping
        By label the channels with their words in the legend; empty for none.
    names : sequence of str
        Of several results.
    limits : mapping, optional
        By label of a panel: by words for the legend a value, or times and values.
    window : pair of float or None, s
    events : bool
        Whether sticking and events of a single result are marked.
    notes : sequence of str
        For the title.
    measured : sequence of Target
        Measured values of channels or members of them, which are drawn as points.
    """
    one, several = records[0], len(records) > 1
    shown = [within(record, window) for record in records]
    set_height(figure, FRAME + PANEL_HEIGHT * len(panels))
    count = len(shown[0].events["time"])
    if not several and events and count > MAX_MARKS:
        notes = [*notes, f"{count} events, not marked"]
    set_title(figure, _title_of_several(records) if several else title_of(one, *notes))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    handles: dict[str, Any] = {}
    marks = _mark_several(axes[0], shown) if several else {}
    titles = [f"{i}: {name}" if marks else name for i, name in enumerate(names, 1)]
    known: dict[str, int] = {}  # by words the number of a look, which is the same in all panels
    limiting: dict[str, int] = {}  # the same of limits
    for ax, (label, channels) in zip(axes, panels.items(), strict=True):
        ax.set_ylabel(axis_label(label, one.units[next(iter(channels))]))
        ax.grid(visible=True)
        ax.margins(x=0.0)
        for number, record in enumerate(shown):
            for words, look, (times, values) in _lines(record, channels, known):
                if several:
                    words, look = titles[number], line_look(number)
                (line,) = ax.plot(times, values, label=words, **look)
                if words:
                    handles.setdefault(words, line)
        for words, limit in (limits or {}).get(label, {}).items():
            number = limiting.setdefault(words, len(limiting)) % len(LIMIT_DASHES)
            look = LIMIT | {"linestyle": (0, LIMIT_DASHES[number])}
            is_line = isinstance(limit, tuple)
            handles[words] = ax.plot(*limit, **look)[0] if is_line else ax.axhline(limit, **look)
        handles |= _draw_points(ax, measured, channels)
        if (first := next(iter(channels))) in one.flags:
            ticks = [(value, words.replace("_", " ")) for value, words in one.flags[first]]
            ax.set_yticks(*map(list, zip(*ticks, strict=True)))
    handles |= mark(axes, shown[0], window) if events and not several else marks
    axes[-1].set_xlabel("time, s")
    ends = [record.channels["time"][[0, -1]] for record in records]
    low, high = min(times[0] for times in ends), max(times[1] for times in ends)
    low, high = max(low, window[0] or low), min(high, high if window[1] is None else window[1])
    if low < high:
        axes[-1].set_xlim(low, high)
    figure.align_ylabels(axes)
    return dict(zip(panels, axes, strict=True)), handles


def _lines(record: "Record", channels: Mapping[str, str], known: dict[str, int]) -> Any:
    """Yield words, look and points of the lines of a panel: of each channel and each member."""
    for place, (name, words) in enumerate(channels.items()):
        times, values = with_jumps(record, name)
        axis = record.axes.get(name, "")
        if not axis:
            number = known.setdefault(words, len(known)) if words else 0
            several = _width(place) if len(channels) > 1 else {}
            yield words, line_look(number) | several, (times, values)
            continue
        for i, column in enumerate(values.T):
            width = _width(i)
            member = str(record.members[axis][i])
            if words in ("", member):
                yield member, line_look(i) | width, (times, column)


def _draw_points(
    ax: Any, measured: Sequence["Target"], channels: Collection[str]
) -> dict[str, Any]:
    """Draw measured values of some channels; return handles by their words."""
    handles: dict[str, Any] = {}
    for target, marker in zip(measured, cycle(MARKERS), strict=False):
        if target.name.partition(".")[0] not in channels:
            continue
        words = f"{target.name.replace('_', ' ').replace('.', ' of ')}, measured"
        size = 4.0 if len(target.times) <= FULL_SIZE_POINTS else 2.0
        look = POINTS | {"marker": marker, "markersize": size}
        (handles[words],) = ax.plot(target.times, target.values, **look)
    return handles


def _width(place: int) -> Look:
    """Return the width of a line of several: one that covers another is narrower."""
    return {"linewidth": 2.2 if place == 0 else 1.1}


def mark(axes: Any, record: "Record", window: "Window") -> dict[str, Any]:
    """Shade sticking phases and mark events, with their times; return handles by their words."""
    handles: dict[str, Any] = {}
    for start, stop in sticking_phases(record):
        for ax in axes:
            ax.axvspan(start, stop, color=STICK_SHADE, linewidth=0)
        handles[sticking_words(record)] = Patch(color=STICK_SHADE)
    times = record.events["time"]
    if len(times) > MAX_MARKS:
        return handles
    for words, at in zip(event_labels(record), times, strict=True):
        look = event_look(words)
        for ax in axes:
            ax.axvline(at, **look, zorder=1.6)  # behind the channels
        handles[words] = Line2D([], [], **look)
    low, high = window
    ends = record.time[0] if low is None else low, record.time[-1] if high is None else high
    write_above(axes[0], {float(at): f"{picture_text(at)} s" for at in times}, ends)
    return handles


def write_above(ax: Any, texts: Mapping[float, str], along: Any) -> None:
    """Write texts above Axes by their places, in two rows where there is room; it spans `along`."""
    low, high = float(np.min(along)), float(np.max(along))
    longest = 2 + max(map(len, texts.values()), default=0)
    room = (high - low) * longest / (0.8 * letters_across(ax.figure, 0.7))  # "x-small"
    ends = [-np.inf, -np.inf]
    for at, text in sorted(texts.items()):
        for row in (0, 1):
            if low <= at <= high and at - ends[row] > room:
                ends[row] = at
                ax.annotate(
                    plain(text),
                    (at, 1.0),
                    (0.0, 2.0 + 9.0 * row),
                    xycoords=ax.get_xaxis_transform(),
                    textcoords="offset points",
                    ha="center",
                    fontsize="x-small",
                )
                break


def _mark_several(ax: Any, records: Sequence["Record"]) -> dict[str, Any]:
    """Draw a row for each result above the first panel; return handles by their words."""
    handles: dict[str, Any] = {}
    for number, record in enumerate(records):
        height = 1.0 + ROW * (len(records) - number)
        before = len(ax.lines)
        place: Look = {"transform": ax.get_xaxis_transform(), "clip_on": False}
        place["color"] = line_look(number)["color"]
        for phase in sticking_phases(record):
            ax.plot(phase, [height] * 2, **place, linewidth=2.0, solid_capstyle="butt")
            handles["bars: sticking"] = Line2D([], [], color=GREY, linewidth=2.0)
        times = record.events["time"]
        if 0 < len(times) <= MAX_MARKS:
            ticks: Look = {"marker": "|", "markersize": 5.0, "linestyle": ""}
            ax.plot(times, [height] * len(times), **place, **ticks)
            handles["ticks: events"] = Line2D([], [], color=GREY, **ticks)
        if len(ax.lines) > before:
            where: Look = {"transform": ax.transAxes, "va": "center_baseline"}
            ax.text(1.005, height, str(number + 1), fontsize="xx-small", **where)
    return handles


def _title_of_several(records: Sequence["Record"]) -> str:
    titles = {record.attributes["title"] or record.attributes["kind"] for record in records}
    title = titles.pop() if len(titles) == 1 else records[0].attributes["kind"]
    each = [short_overrides(record.attributes) for record in records]
    common = [text for text in each[0] if all(text in texts for texts in each)]
    return f"{title} ({'; '.join([*common, f'{len(records)} results'])})"


def panels_of(record: "Record", channels: Sequence[str] = ()) -> dict[str, dict[str, str]]:
    """Return the panels of a result: chosen channels, or those of its kind, each by itself."""
    for name in channels:
        check_channel(record, name)
    if len(channels) > MAX_PANELS:
        raise ArgumentError("channels", f"expected at most {MAX_PANELS}, got {len(channels)}")
    drawable = [
        name
        for name, axis in record.axes.items()
        if name not in ("time", "mode") and (not axis or len(record.members[axis]) <= MAX_LINES)
    ]
    wanted = mechanism_module(record.attributes["kind"]).PANELS
    names = channels or [name for name in wanted if name in drawable] or drawable
    if not names:
        raise InputError("cannot draw this result: it has no channel that can be drawn over time")
    return {name.replace("_", " "): {name: ""} for name in names}


def check_channel(record: "Record", name: str) -> None:
    """Check that a result has a channel that is drawn over time."""
    known = [known for known in record.channels if known != "time"]
    if name == "time":
        raise ArgumentError("channels", "'time' is what the channels are drawn over")
    if name not in known:
        said = unknown("channel", name, known)
        there = "" if "known:" in said else f"; known: {', '.join(known)}"
        raise ArgumentError("channels", f"{said}{there}")
    axis = record.axes[name]
    if axis and len(record.members[axis]) > MAX_LINES:
        raise ArgumentError(
            "channels",
            f"'{name}' has values for {len(record.members[axis])} members of the axis '{axis}',"
            f" a panel shows {MAX_LINES}; choose another one",
        )


def within(record: "Record", window: "Window") -> "Record":
    """Return the samples and events of a window of time, with the samples around it."""
    if window == WHOLE:
        return record
    samples = np.asarray(record.channels["time"])
    first, last = float(samples[0]), float(samples[-1])
    low, high = first if window[0] is None else window[0], last if window[1] is None else window[1]
    if low >= last or high <= first or low >= high:
        raise InputError(
            f"the window from {low:g} s to {high:g} s shows nothing: this result has samples from"
            f" {first:.6g} s to {last:.6g} s"
        )
    start = max(int(np.searchsorted(samples, low, side="right")) - 1, 0)
    return part_of(record, slice(start, int(np.searchsorted(samples, high, side="left")) + 1))


def part_of(record: "Record", samples: slice) -> "Record":
    """Return some samples of a result, with the events from the first to the last of them."""
    channels = {name: np.asarray(values[samples]) for name, values in record.channels.items()}
    at = np.asarray(record.events["time"])
    chosen = (at >= channels["time"][0]) & (at <= channels["time"][-1])
    events = {name: np.asarray(values)[chosen] for name, values in record.events.items()}
    return record._replace(channels=channels, events=events)
