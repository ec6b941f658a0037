"""Pictures of result files: the only module that imports matplotlib."""

from pathlib import Path
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from frictionsim.errors import InputError, OutputError
from frictionsim.mechanisms import KINDS, module_of

if TYPE_CHECKING:
    from frictionsim.recorder import Result

# Okabe and Ito: told apart also by colour-blind readers, and in grey.
EVENT_COLOUR, STICK_COLOUR = "#D55E00", "#E5E5E5"
COURSE_COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#CC79A7"),
    *("#56B4E9", "#000000", "#F0E442", "#999999"),
)
MOST_LINES = len(COURSE_COLOURS)  # in one panel
WIDTH, PANEL_HEIGHT = 8.0, 1.7  # inches
MOST_MARKS = 60  # events; more would hide the courses
JUMPING = ("friction_torque", "angular_acceleration")
FORMATS = (".png", ".pdf", ".svg")


def plot(result: "Result", path: Path) -> None:
    """Draw the courses of a result over time, stick phases shaded and events marked.

    Parameters
    ----------
    result : Result
    path : Path
        Ends in .png, .pdf or .svg.

    Raises
    ------
    InputError
        If the format is another one.
    OutputError
        If the picture cannot be written.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: pictures are written as {', '.join(FORMATS)}; name one of them")
    names = _panels(result)
    figure = Figure(figsize=(WIDTH, 0.8 + PANEL_HEIGHT * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    events = result.events["time"]
    for panel, name in zip(panels, names, strict=True):
        _shade_sticks(panel, result)
        _draw_course(panel, result, name)
        height = panel.get_xaxis_transform()
        if len(events) <= MOST_MARKS:
            panel.vlines(events, 0.0, 1.0, EVENT_COLOUR, "--", linewidth=0.8, transform=height)
        panel.set_ylabel(f"{name.replace('_', ' ')},\n{_unit(result.units[name])}")
        panel.margins(x=0.0)
        panel.grid(linewidth=0.3)
    panels[-1].set_xlabel("time, s")
    figure.align_ylabels(panels)
    figure.suptitle(_title(result), fontsize="medium", wrap=True)
    try:
        # No date, no version, no random names: the same result gives the same picture.
        with mpl.rc_context({"svg.hashsalt": "frictionsim"}), catch_warnings():
            simplefilter("ignore")  # a title in letters that the font does not have
            figure.savefig(path, dpi=100, metadata=_metadata(path))
    except OSError as error:
        raise OutputError(f"{path}: cannot write the picture: {error.strerror or error}") from None


def _panels(result: "Result") -> list[str]:
    """Return the courses that the mechanism wants drawn, or any if the file has none of them."""
    kind = result.attributes["kind"]
    if kind not in KINDS:
        raise InputError(f"cannot draw a result of kind '{kind}'; known: {', '.join(KINDS)}")
    drawable = [
        name
        for name, axis in result.axes.items()
        if name not in ("time", "mode") and (not axis or len(result.members[axis]) <= MOST_LINES)
    ]
    names = [name for name in module_of(kind).PANELS if name in drawable] or drawable
    if not names:
        raise InputError("cannot draw this result: it has no course that can be drawn as a line")
    return names


def _draw_course(panel: Any, result: "Result", name: str) -> None:
    """Draw a course; if it has columns, one line for each and a legend."""
    time, values = _with_jumps(result, name)
    axis = result.axes[name]
    if not axis:
        panel.plot(time, values, color=COURSE_COLOURS[0], linewidth=1.5)
        return
    members = result.members[axis]
    for course, member, colour in zip(values.T, members, COURSE_COLOURS, strict=False):
        panel.plot(time, course, color=colour, linewidth=1.5, label=f"{axis} {member}")
    if members:
        panel.legend(loc="upper right", fontsize="small", ncols=4)


def _title(result: "Result") -> str:
    attributes = result.attributes
    title = (attributes["title"] or attributes["kind"]).replace("$", r"\$")  # no formula
    notes = [f"backend {attributes['backend']}"]
    if attributes["status"] != "done":
        notes.append(attributes["status"])
    elif attributes["reason"]:
        notes.append("self-audit failed")
    if _has_sticks(result):
        notes.append("grey: sticking")
    count = len(result.events["time"])
    if count:
        notes.append("dashed: event" if count <= MOST_MARKS else f"{count} events, not marked")
    return f"{title} ({'; '.join(notes)})"


def _with_jumps(result: "Result", name: str) -> tuple[Any, Any]:
    """Return times and values of a course, with a gap where an event makes it jump."""
    time, values = result.courses["time"], result.courses[name]
    if name not in JUMPING or len(result.events["time"]) > MOST_MARKS:
        return time, values
    places = np.searchsorted(time, result.events["time"])
    gaps = np.insert(values, places, np.nan, axis=0)
    return np.insert(time, places, result.events["time"]), gaps


def _unit(unit: str) -> str:
    return unit.replace("^2", "²")


def _metadata(path: Path) -> dict[str, Any]:
    return {
        ".png": {"Software": None},
        ".pdf": {"CreationDate": None},
        ".svg": {"Date": None},
    }[path.suffix.lower()]


def _has_sticks(result: "Result") -> bool:
    """Return whether all rests of a result are those of one contact."""
    return result.axes.get("mode") == ""


def _shade_sticks(panel: Any, result: "Result") -> None:
    """Shade the time from every rest to the next breakaway."""
    if not _has_sticks(result):
        return
    time, events = result.courses["time"], result.events
    if not time.size:
        return
    resting_since = time[0] if result.courses["mode"][0] == 0 else None
    for at, mode in zip(events["time"], events["mode_to"], strict=True):
        if mode == 0:
            resting_since = at
        elif resting_since is not None:
            panel.axvspan(resting_since, at, color=STICK_COLOUR, linewidth=0)
            resting_since = None
    if resting_since is not None:
        panel.axvspan(resting_since, time[-1], color=STICK_COLOUR, linewidth=0)
