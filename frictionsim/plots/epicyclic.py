"""The pictures of an epicyclic gear.

Samples between the recorded ones, for curves over an angle that turns far from sample to sample.

What is drawn remains what the file says: the angle between two samples follows from its velocities
at these (a cubic polynomial), torques from the equations of the scenario at that angle, if these
give the recorded torques at both samples. Other channels are linear in between, as their drawn
lines are, and so is everything next to events, where torques may jump.
"""

from math import pi
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
from frictionsim.mechanisms.epicyclic.tracer_point import TracerPath, TracerPoint
from frictionsim.plots import time_history
from frictionsim.plots.old_style import (
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
from frictionsim.scenario.toml_data import scenario_value

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
    channels, path = result.channels, _path_of(result, sun_radius, radius)
    first, count = path.cusps(channels["angle"]) or (0.0, 0.0)
    handles = []
    if 0.0 < count <= MAX_CUSPS:
        x, y = path.position(path.angle_of(first + np.arange(count)))
        places = np.round(np.column_stack([x, y]) / (SAME * path.length)).astype(np.int64)
        _, once = np.unique(places, axis=0, return_index=True)
        label = counted(int(count), "cusp")
        handles += plane.plot(x[once], y[once], **CUSP, zorder=3.5, label=label)
    if "angular_velocity" in channels:
        handles += _draw_dwell(plane, result, path)
    return handles


def _path_of(result: "Record", sun_radius: float, radius: float) -> TracerPath:
    point = TracerPoint.model_validate(scenario_value(result, "effects", "tracer_point"))
    return TracerPath(sun_radius, radius, point)


def _draw_dwell(plane: Any, result: "Record", path: TracerPath) -> list[Any]:
    channels = result.channels
    dwell = path.longest_dwell((channels["time"], channels["angle"], channels["angular_velocity"]))
    if dwell is None:
        return []
    turned = np.linspace(dwell.angle - dwell.half, dwell.angle + dwell.half, FINE)
    plane.plot(*path.position(turned), **DWELL, zorder=2.5)
    words = f"longest dwell, {picture_text(dwell.time)} s"
    return list(plane.plot(*path.position(dwell.angle), **PLACE, zorder=4.5, label=words))


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


response = time_history.response


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
    handles = [
        ax.plot(result.channels["angle"], result.channels[name], **line_style(i), label=words)[0]
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
    return _path_of(result, sun_radius, radius).position(np.linspace(low, high, count))


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
