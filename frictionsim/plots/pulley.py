"""The picture of a pulley: its response to force or torque, with the limits of static friction."""

from collections.abc import Sequence
from math import radians
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch

from frictionsim.display import (
    BLACK,
    BLUE,
    CORD_SLIPS_SHADE,
    CORD_STICKS_SHADE,
    GREY,
    picture_text,
    with_minus,
)
from frictionsim.errors import InputError
from frictionsim.mechanisms.pulley.schema import limiting_ratio
from frictionsim.plots import time_history
from frictionsim.plots.style import Style, add_legend, label, line_style, require_channels
from frictionsim.plots.time_history import (
    LIMIT_LINE,
    annotate_above,
    draw_static_limit,
    mark_modes,
    stacked_axes,
)
from frictionsim.plots.view import View, over_time
from frictionsim.scenario.toml_data import scenario_of, scenario_value
from frictionsim.simulation.record import sticking_phases, with_jumps

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Quantities, Record

CORD = "cord"
CAR, COUNTERWEIGHT = "rope_tension_car", "rope_tension_counterweight"
RIM, SLIDING, RATIO = "rim_speed", "slip_speed", "tension_ratio"
CAR_GAP, COUNTERWEIGHT_GAP = "car_gap", "counterweight_gap"
DERIVED = {RIM: "m/s", SLIDING: "m/s", RATIO: "1", CAR_GAP: "m", COUNTERWEIGHT_GAP: "m"}
MIN_GAP = 1e-9  # of the cord radius: a smaller one is roundoff
STATIC: Style = {"color": BLACK, "linestyle": (0, (3, 2)), "linewidth": 0.9}
KINETIC: Style = {"color": GREY, "linestyle": (0, (1, 1.2)), "linewidth": 1.2}


# From top to bottom, by label: the channels in each panel, with the part that they are of.
PANELS = {
    "drive force": {"drive_force": ""},
    "drive torque": {"drive_torque": ""},
    "tension of the rope": {CAR: "car", COUNTERWEIGHT: "counterweight"},
    "friction torque": {"friction_torque": ""},
    "velocity": {"car_velocity": "car", RIM: "rim of the pulley"},
    "height above the start": {"car_position": "car"},
    "slip of the cord": {"cord_slip": ""},
    "slack rope": {CAR_GAP: "car", COUNTERWEIGHT_GAP: "counterweight"},
}
LINES = ("car", "counterweight", "rim of the pulley")  # in the order of colours


def has_masses(result: "Record") -> bool:
    """Return whether the scenario of a result has hanging masses."""
    return "hanging_masses" in scenario_of(result).get("effects", {})


def draw_panels(result: "Record", figure: "Figure | SubFigure") -> tuple[dict[str, Any], list[Any]]:
    """Draw drive, tensions, friction, speeds, height, and slip or slack over time.

    Returns
    -------
    dict of Axes
        By the first channel of each panel.
    list of matplotlib artists
        For the legend.
    """
    known = with_derived(result)
    shown_channels = {
        name
        for name, values in known.channels.items()
        if name not in DRIVES or np.any(values)  # nothing drives it
    }
    panels: dict[str, tuple[str, list[str]]] = {}
    for words, of_part in PANELS.items():
        if channels := [channel for channel in of_part if channel in shown_channels]:
            panels[channels[0]] = words, channels
    if not panels:
        raise InputError("cannot draw this result: it has no channel that can be drawn over time")
    axes = stacked_axes(known, figure, list(panels))
    handles: dict[str, Any] = {}
    for name, (words, channels) in panels.items():
        axes[name].set_ylabel(label(known, name, words))
        for channel in channels:
            of = PANELS[words][channel]
            style = line_style(LINES.index(of)) if of else {"color": BLACK, "linewidth": 1.5}
            (line,) = axes[name].plot(*with_jumps(known, channel), **style, label=of)
            if of:
                handles.setdefault(of, line)
    shown = list(handles.values())
    if {CAR, COUNTERWEIGHT} <= result.channels.keys():
        shown += _shade_traction(axes[CAR], result)
    return axes, [*shown, *mark_modes(result, list(axes.values()))]


def traction(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the ratio of the tensions with its limits (Euler, Eytelwein), and slip of the cord.

    Phases in which the cord slips are shaded.
    """
    limits = ratios(result)
    if limits is None:
        raise InputError(
            "cannot draw the view 'traction': the scenario of this result has no"
            " [effects.cord_friction], so that its cord never slips"
        )
    require_channels(result, "traction", (CAR, COUNTERWEIGHT))
    known = with_derived(result)
    words = {
        RATIO: "tension of the counterweight over that of the car",
        SLIDING: "speed of slip",
        "cord_slip": "slip of the cord",
    }
    names = [name for name in words if name in known.channels]
    axes = stacked_axes(known, figure, names)
    for name, ax in axes.items():
        ax.set_ylabel(label(known, name, words[name]))
        ax.plot(*with_jumps(known, name), color=BLUE, linewidth=1.5)
    first = next(iter(axes.values()))
    handles = []
    for ratio, style, sort in zip(limits, (STATIC, KINETIC), ("static", "kinetic"), strict=True):
        first.axhline(1.0 / ratio, **style)
        text = f"limit of {sort} friction: {picture_text(1.0 / ratio)} and {picture_text(ratio)}"
        handles.append(first.axhline(ratio, **style, label=text))
    slips, ends = slipping_phases(result), result.channels["time"][[0, -1]]
    for start, stop in slips:
        for ax in axes.values():
            ax.axvspan(start, stop, color=CORD_SLIPS_SHADE, linewidth=0)
        for at, row in ((start, 0), (stop, 1)):
            if ends[0] < at < ends[1]:  # not where the run begins or ends
                annotate_above(first, at, f"{picture_text(at)} s", row)
    if slips:
        handles.append(Patch(color=CORD_SLIPS_SHADE, label="the cord slips"))
    add_legend(figure, handles, columns=3)


def ratios(result: "Record") -> tuple[float, float] | None:
    """Return the largest ratios of tensions, static and kinetic; None if the cord cannot slip."""
    if CORD + "_friction" not in scenario_of(result).get("effects", {}):
        return None
    cord = scenario_value(result, "effects", "cord_friction")
    wrap = float(cord["wrap_deg"])
    return limiting_ratio(float(cord["mu_s"]), wrap), limiting_ratio(float(cord["mu_k"]), wrap)


def slipping_phases(result: "Record") -> list[tuple[float, float]]:
    """Return start and end of each phase in which the cord slips, s; none if it is not recorded."""
    time = result.channels["time"]
    if "cord_mode" not in result.channels or not len(time):
        return []
    ends = [float(time[0])]
    for start, stop in sticking_phases(result, CORD):
        ends += [float(start), float(stop)]
    ends.append(float(time[-1]))
    return [(a, b) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]


def _shade_traction(ax: Any, result: "Record") -> list[Any]:
    """Shade the tensions of the counterweight at which the cord keeps sticking, while it does."""
    limits = ratios(result)
    if limits is None:
        return []
    time, tension = with_jumps(result, CAR)
    slips = np.zeros(time.shape, dtype=bool)
    for start, stop in slipping_phases(result):
        slips |= (time > start) & (time < stop)
    low, high = tension / limits[0], tension * limits[0]
    ax.fill_between(time, low, high, where=~slips, color=CORD_STICKS_SHADE, zorder=1.1)
    words = "counterweight's tension\nat which the cord keeps sticking"
    return [Patch(color=CORD_STICKS_SHADE, label=words)]


def with_derived(result: "Record") -> "Record":
    """Return a result with speed of the rim, speed of slip, ratio of tensions and gaps of ropes.

    Each is there if the channels are from which it follows; a gap only if the rope falls slack.
    """
    radius = float(scenario_value(result, "mechanism", "cord_radius"))
    known = {name: np.asarray(values) for name, values in result.channels.items()}
    start = radians(float(scenario_value(result, "mechanism", "initial_angle_deg")))

    def derive(of: Any) -> dict[str, Any]:
        new = {}
        if "angular_velocity" in of:
            new[RIM] = radius * of["angular_velocity"]
            if "car_velocity" in of and "cord_slip" in of:
                new[SLIDING] = of["car_velocity"] - new[RIM]
        if {CAR, COUNTERWEIGHT} <= of.keys():
            with np.errstate(divide="ignore", invalid="ignore"):
                new[RATIO] = of[COUNTERWEIGHT] / of[CAR]
        if "angle" in of and "slack" in of:
            rim = radius * (of["angle"] - start)
            if "car_position" in of:
                new[CAR_GAP] = of["car_position"] - rim
            if "counterweight_position" in of:
                new[COUNTERWEIGHT_GAP] = of["counterweight_position"] + rim
        return new

    new = derive(known)
    for name in (CAR_GAP, COUNTERWEIGHT_GAP):
        if name in new and np.max(new[name], initial=0.0) <= MIN_GAP * radius:
            del new[name]
    sides: dict[str, Any] = {}
    for side in ("before", "after"):
        names = {n: result.events.get("angle" if n == "angle" else f"{n}_{side}") for n in known}
        at_events = derive({n: values for n, values in names.items() if values is not None})
        sides |= {f"{n}_{side}": values for n, values in at_events.items() if n in new}
    none = dict.fromkeys(new, "")
    return result._replace(
        channels={**result.channels, **new},
        axes=result.axes | none,
        units=result.units | {name: DERIVED[name] for name in new},
        long_names=result.long_names | none,
        events=result.events | sides,
    )


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
    masses = has_masses(result)
    if masses and not channels:
        axes, handles = draw_panels(result, figure)
    else:
        axes, handles = time_history.draw_channels(result, figure, channels)
    if masses or "friction_torque" in result.channels:
        limits = result.quantities
        for drive in DRIVES:
            if drive in axes:
                _draw_limits(axes[drive], len(axes), result, limits, drive)
    handles += draw_static_limit(axes, result)
    add_legend(figure, handles)


def _draw_limits(ax: Any, panels: int, result: "Record", limits: "Quantities", drive: str) -> None:
    """Draw lines at the drive of impending motion, and label them within the panel's height."""
    highest = MAX_LIMIT * np.max(np.abs(result.channels[drive]))
    names = ((f"{DRIVES[drive]}_{words.replace(' ', '_')}", words) for words in LIMITS)
    shown = [(limits[name].value, words) for name, words in names if name in limits]
    drawn = sorted(
        (force, words) for force, words in shown if force is not None and abs(force) <= highest
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
            f"{with_minus(f'{force:.1f}')} {unit} {words}",
            (1.0, place),
            (4.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center",
            fontsize="small",
        )


def label_places(lines: Sequence[float], height: float) -> list[float]:
    """Return the middles of the labels of at most two lines, in parts of a panel.

    A label stands at its line but within the panel; two that would overlap are moved apart.

    Parameters
    ----------
    lines : sequence of float
        Heights of the lines, ascending.
    height : float
        Of a label, at most 1/2.
    """
    half = 0.5 * height
    if len(lines) < 2:
        return [min(max(line, half), 1.0 - half) for line in lines]
    apart = 0.5 * max(height - (lines[1] - lines[0]), 0.0)
    low = min(max(lines[0] - apart, half), 1.0 - 3.0 * half)
    high = min(max(lines[1] + apart, low + height), 1.0 - half)
    return [low, high]


VIEWS = {
    "response": over_time(response),
    "traction": View(traction, window=True, effect="cord_friction"),
}
