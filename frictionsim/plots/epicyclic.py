"""The pictures of an epicyclic gear.

Samples between the recorded ones, for curves over an angle that turns far from sample to sample.

What is drawn remains what the file says: the angle between two samples follows from its velocities
at these (a cubic polynomial), torques from the equations of the scenario at that angle, if these
give the recorded torques at both samples. Other channels are linear in between, as their drawn
lines are, and so is everything next to events, where torques may jump.
"""

from collections.abc import Sequence
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle

from frictionsim.display import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    ROLES,
    SKY,
    VERMILION,
    picture_text,
    study_text,
)
from frictionsim.errors import InputError, counted
from frictionsim.mechanisms.epicyclic.tracer_point import (
    Cubic,
    TracerPoint,
    count_cusps,
    cusp_angles,
    longest_dwell,
    tracer_position,
)
from frictionsim.plots import time_history
from frictionsim.plots.style import (
    WIDTH,
    Style,
    add_legend,
    axis_label,
    grid,
    line_style,
    require_channels,
    set_up,
    width_of,
)
from frictionsim.plots.view import View, over_time
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.toml_data import scenario_of, scenario_value
from frictionsim.solvers.mechanism import Mechanism, Trajectory

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

CUSP: Style = {"marker": "D", "mfc": "white", "mec": BLACK, "markersize": 6, "linestyle": ""}
TRACER: Style = {"marker": "o", "mfc": ROLES["path"], "mec": BLACK, "ms": 6, "linestyle": ""}
DWELL: Style = {"color": ORANGE, "linewidth": 5.0, "alpha": 0.8, "solid_capstyle": "butt"}
PLACE: Style = {
    "marker": "o",
    "mfc": "none",
    "mec": ORANGE,
    "mew": 2.5,
    "markersize": 14,
    "linestyle": "",
}
FINE = 200  # points of the path of a dwell
SAME = 1e-9  # of the length of the crank: cusps of several turns that lie in one place
MAX_CUSPS = 100_000  # more would cover the path and take minutes


def draw_marks(plane: Any, result: "Record", sun_radius: float, radius: float) -> list[Any]:
    """Mark the cusps of a path, and the part of it where its point dwells longest.

    Both are as the summary counts them: only the path of a point of the rim has cusps, where it
    touches the sun; a point dwells within `dwell_distance` of a place nearest to the sun.

    Parameters
    ----------
    sun_radius, radius : float, m
        Of sun and planet.
    """
    channels = result.channels
    point = TracerPoint.model_validate(scenario_value(result, "effects", "tracer_point"))
    length = sun_radius + radius
    cusps = count_cusps(sun_radius, radius, point, channels["angle"])
    handles = []
    if cusps and cusps <= MAX_CUSPS:
        angles = cusp_angles(sun_radius, radius, point, channels["angle"])
        x, y = tracer_position(length, length / radius, point, angles)
        places = np.round(np.column_stack([x, y]) / (SAME * length)).astype(np.int64)
        _, first = np.unique(places, axis=0, return_index=True)
        label = counted(angles.size, "cusp")
        handles += plane.plot(x[first], y[first], **CUSP, zorder=3.5, label=label)
    if "angular_velocity" in channels:
        handles += _draw_dwell(plane, result, (sun_radius, radius), point)
    return handles


def _draw_dwell(plane: Any, result: "Record", radii: tuple[float, float], point: Any) -> list[Any]:
    channels, (length, turns) = result.channels, (sum(radii), sum(radii) / radii[1])
    motion = channels["time"], channels["angle"], channels["angular_velocity"]
    dwell = longest_dwell(*radii, point, motion)
    if dwell is None:
        return []
    turned = np.linspace(dwell.angle - dwell.half, dwell.angle + dwell.half, FINE)
    plane.plot(*tracer_position(length, turns, point, turned), **DWELL, zorder=2.5)
    place = tracer_position(length, turns, point, dwell.angle)
    words = f"longest dwell, {picture_text(dwell.time)} s"
    return list(plane.plot(*place, **PLACE, zorder=4.5, label=words))


FAR = 0.06  # rad, between two samples: there are finer ones in between
ANGLE_STEP = 0.04  # rad, from one of these to the next
MAX_POINTS = 20_000
AGREES = 1e-6  # of the largest torque: the equations give what is recorded
NEEDED = ("angle", "angular_velocity", "mode")


def refined(result: "Record") -> "Record":
    """Return a record with finer samples where the angle turns far between its own.

    Parameters
    ----------
    result : Record
        Of one coordinate. Without `angle`, `angular_velocity` or `mode` it is returned as it is.
    """
    channels = result.channels
    if not set(NEEDED) <= channels.keys() or channels["time"].size < 2:
        return result
    mechanism = _mechanism_of(result)
    fine, interval = _fine_times(result)
    if mechanism is None or fine.size == channels["time"].size:
        return result
    time = channels["time"]
    angle, velocity = _hermite(
        time, channels["angle"], channels["angular_velocity"], fine, interval
    )
    values_at: dict[str, Any] = {}
    for name, values in channels.items():
        if result.axes.get(name):
            values_at[name] = np.stack(
                [np.interp(fine, time, column) for column in values.T], axis=1
            )
        elif np.asarray(values).dtype.kind in "iub":
            values_at[name] = values[interval]
        else:
            values_at[name] = np.interp(fine, time, values)
    values_at |= {"time": fine, "angle": angle, "angular_velocity": velocity}
    mode = values_at["mode"]
    at_samples = _torques(
        mechanism, channels["angle"], channels["angular_velocity"], channels["mode"]
    )
    between = _torques(mechanism, angle, velocity, mode)
    for name in at_samples.keys() & channels.keys():
        off = np.abs(at_samples[name] - channels[name])
        agree = off <= AGREES * float(np.max(np.abs(channels[name])))
        after = np.minimum(interval + 1, time.size - 1)
        sound = agree[interval] & agree[after] & ~np.isin(fine, time)
        values_at[name] = np.where(sound, between[name], values_at[name])
    return result._replace(channels=values_at)


def _mechanism_of(result: "Record") -> Mechanism | None:
    """Return the mechanism of the scenario; None if another version wrote it."""
    try:
        scenario = validate(scenario_of(result), Path())
    except (InputError, ValidationFailure):
        return None
    build = getattr(mechanism_module(scenario.kind), "build", None)
    mechanism = None if build is None else build(scenario)
    return mechanism if isinstance(mechanism, Mechanism) else None


def _fine_times(result: "Record") -> tuple["Array", Any]:
    """Return all times, s, those of the samples among them, and the sample before each."""
    time, angle = result.channels["time"], result.channels["angle"]
    turned = np.abs(np.diff(angle))
    at_event = np.isin(time, result.events["time"])
    smooth = ~(at_event[1:] | at_event[:-1]) & np.isfinite(turned) & (turned > FAR)
    counts = np.where(smooth, np.ceil(turned / ANGLE_STEP), 1.0).astype(int)
    if counts.sum() > MAX_POINTS:
        counts = np.minimum(counts, max(1, MAX_POINTS // counts.size))
    interval = np.repeat(np.arange(counts.size), counts)
    within = np.arange(interval.size) - np.repeat(np.cumsum(counts) - counts, counts)
    share = within / counts[interval]
    fine = time[interval] + share * np.diff(time)[interval]
    fine = np.where(within == 0, time[interval], fine)
    return np.append(fine, time[-1]), np.append(interval, time.size - 1)


def _hermite(
    time: "Array", angle: "Array", velocity: "Array", fine: "Array", interval: Any
) -> tuple["Array", "Array"]:
    """Return angle and velocity at fine times, by the cubic polynomial between two samples."""
    first = np.minimum(interval, time.size - 2)
    cubic = Cubic(*(part[first] for part in Cubic.of(time, angle, velocity)))
    u = (fine - time[first]) / cubic.step
    slope = cubic.rise + u * (2.0 * cubic.rest + 3.0 * u * cubic.cubic)
    return cubic.at(u), slope / cubic.step


def _torques(mechanism: Mechanism, angle: "Array", velocity: "Array", mode: Any) -> dict[str, Any]:
    """Return the torques that follow from angle, velocity and mode, N m, by channel."""
    none = np.zeros_like(angle)
    trajectory = Trajectory(
        none, none, angle, velocity, none, none, np.asarray(mode, dtype=float), {}, {}, []
    )
    torques = dict(mechanism.channels(trajectory))
    torques.pop("drive_torque", None)  # of the time
    if mechanism.contact is not None:
        forward = mechanism.contact.kinetic_limit(0.0, angle, velocity, 1)
        backward = mechanism.contact.kinetic_limit(0.0, angle, velocity, -1)
        torques["friction_torque"] = np.where(
            mode > 0, -forward, np.where(mode < 0, backward, none)
        )
    return torques


TORQUES = {
    "drive_torque": "drive",
    "uniform_torque": "for uniform rotation",
    "friction_torque": "friction",
}
TORQUE_HEIGHT, PATH_HEIGHT = 4.0, 6.5  # inches
PATH_SPARE = 1.6  # inches beside the plane, in a picture of WIDTH
TURN = 2.0 * pi
PARTS = ("sun", "planet")
PATH_STEP, MAX_PATH_POINTS = (
    0.02,
    20_000,
)  # of a path: crank angle between points, rad; number of points


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw channels over time, with torques finer than the samples where the crank turns fast."""
    time_history.response(refined(result), figure, channels)


def torque(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the torques on the crank over its angle: drive, uniform rotation and friction.

    The friction torque is signed: negative where it opposes a forward motion.
    """
    require_channels(result, "torque", ("angle",))
    shown = {name: words for name, words in TORQUES.items() if name in result.channels}
    if not shown:
        raise InputError(
            "cannot draw the view 'torque': this result has none of the channels"
            f" {', '.join(TORQUES)} (see output.channels)"
        )
    set_up(figure, result, TORQUE_HEIGHT)
    ax = figure.subplots()
    fine = refined(result)
    handles = [
        ax.plot(fine.channels["angle"], fine.channels[name], **line_style(i), label=words)[0]
        for i, (name, words) in enumerate(shown.items())
    ]
    grid(ax)
    ax.axhline(0.0, color=BLACK, linewidth=0.6)
    ax.set_ylabel(axis_label("torque on the crank", result.units[next(iter(shown))]))
    ax.set_xlabel(axis_label("angle of the crank", result.units["angle"]))
    turns = ax.secondary_xaxis("top", functions=(_turns, _radians))
    turns.set_xlabel("turns from the horizontal")
    add_legend(figure, handles)


def _turns(angle: Any) -> Any:
    return angle / TURN


def _radians(turns: Any) -> Any:
    return turns * TURN


def path(result: "Record", figure: "Figure | SubFigure", instant: "Record | None" = None) -> None:
    """Draw the path of the tracer point with sun, planet and crank at the last sample.

    Cusps are marked, and where the point dwells longest, as the summary counts both.
    Without the channel of the crank's angle, only sun and path are drawn.

    Parameters
    ----------
    instant : Record, optional
        The result up to another instant, at which planet and crank are drawn.
    """
    if not {"tracer_x", "tracer_y"} <= result.channels.keys():
        raise InputError(
            "cannot draw the view 'path': this result has no channel tracer_x, tracer_y; add"
            " effects.tracer_point to the scenario (see output.channels)"
        )
    sun_radius, radius = (scenario_value(result, "mechanism", f"{part}_radius") for part in PARTS)
    notes = [] if instant is None else [f"at {study_text(instant.channels['time'][-1])} s"]
    set_up(figure, result, _height_of_path(figure), *notes, scaled=False)
    plane = figure.subplots()
    sun = Circle((0.0, 0.0), sun_radius, fc=ROLES["still"], ec=BLACK, label="sun")
    handles = [plane.add_patch(sun), *_draw_path(plane, result, _path(result, sun_radius, radius))]
    if "angle" in result.channels:
        handles += draw_marks(plane, result, sun_radius, radius)
        handles += _draw_planet(
            plane, instant or result, sun_radius + radius, radius, at_end=instant is None
        )
    plane.set_aspect("equal")
    plane.margins(0.04)
    plane.grid(linewidth=0.3)
    plane.set_axisbelow(True)
    plane.set_xlabel("x, m")
    plane.set_ylabel("y, m")
    add_legend(figure, handles, columns=3)


def _height_of_path(figure: "Figure | SubFigure") -> float:
    """Return the height of a picture in which the plane is as wide as there is room for, inches."""
    return PATH_HEIGHT - max(0.0, WIDTH - width_of(figure) - PATH_SPARE)


def _path(result: "Record", sun_radius: float, radius: float) -> tuple[Any, Any]:
    """Return the path between the smallest and the largest angle, finer than the samples."""
    if "angle" not in result.channels:
        return result.channels["tracer_x"], result.channels["tracer_y"]
    low, high = np.min(result.channels["angle"]), np.max(result.channels["angle"])
    count = int(min(2 + (high - low) / PATH_STEP, MAX_PATH_POINTS))
    point = TracerPoint.model_validate(scenario_value(result, "effects", "tracer_point"))
    length = sun_radius + radius
    return tracer_position(length, length / radius, point, np.linspace(low, high, count))


def _draw_path(plane: Any, result: "Record", path: tuple[Any, Any]) -> list[Any]:
    x, y = result.channels["tracer_x"], result.channels["tracer_y"]
    start = {"marker": "o", "mfc": "white", "mec": VERMILION, "markersize": 7, "linestyle": ""}
    end = start | {"mfc": VERMILION}
    return [
        plane.plot(*path, color=BLUE, linewidth=1.2, label="path of the tracer point")[0],
        plane.plot(x[:1], y[:1], **start, zorder=4, label="start of the path")[0],
        plane.plot(x[-1:], y[-1:], **end, zorder=4, label="end of the path")[0],
    ]


def _draw_planet(
    plane: Any, result: "Record", length: float, radius: float, at_end: bool
) -> list[Any]:
    """Draw planet and crank at the last sample; the tracer point unless the path ends in it."""
    angle = result.channels["angle"][-1]
    centre = length * float(np.cos(angle)), length * float(np.sin(angle))
    end = result.channels["tracer_x"][-1], result.channels["tracer_y"][-1]
    disc = Circle(centre, radius, fc=(SKY, 0.4), ec=BLACK, zorder=3, label="planet")
    planet = plane.add_patch(disc)
    plane.plot(*zip(centre, end, strict=True), color=GREY, linewidth=1.0, zorder=3)
    crank = {"color": ORANGE, "linewidth": 3.0, "marker": "o", "markersize": 5, "zorder": 3}
    parts = [planet, *plane.plot([0.0, centre[0]], [0.0, centre[1]], **crank, label="crank")]
    if not at_end:  # where the end of the path is marked
        parts += plane.plot(*end, **TRACER, zorder=5, label="tracer point")
    return parts


VIEWS = {
    "response": over_time(response),
    "torque": View(torque, window=True),
    "path": View(path, instant=True, whole=True),
}
