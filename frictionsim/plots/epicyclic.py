"""The pictures of an epicyclic gear."""

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle

from frictionsim.errors import InputError
from frictionsim.mechanisms.tracer_point import TracerPoint, tracer_position
from frictionsim.plots import time_history
from frictionsim.plots.finer_samples import refined
from frictionsim.plots.path_marks import draw_marks
from frictionsim.plots.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    WIDTH,
    add_legend,
    grid,
    line_style,
    require_channels,
    set_up,
    width_of,
)
from frictionsim.scenario.recorded import scenario_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

TORQUES = {
    "drive_torque": "drive",
    "uniform_torque": "for uniform rotation",
    "friction_torque": "friction",
}
TORQUE_HEIGHT, PATH_HEIGHT = 4.0, 6.5  # inches
PATH_SPARE = 1.6  # inches beside the plane, in a picture of WIDTH
TURN = 2.0 * pi
PARTS = ("sun", "planet")
SUN_COLOUR = "#D0D0D0"
STEP, MAX_POINTS = 0.02, 20_000  # of a path: crank angle between points, rad; number of points


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw channels over time, with torques finer than the samples where the crank turns fast."""
    time_history.response(refined(result), figure, channels)


def torque(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the torques on the crank over its angle: drive, uniform rotation and friction.

    The friction torque is signed: negative where it opposes a forward motion.
    """
    require_channels(result, "torque", ("angle",))
    found = {name: words for name, words in TORQUES.items() if name in result.channels}
    if not found:
        raise InputError(
            "cannot draw the view 'torque': this result has none of the channels"
            f" {', '.join(TORQUES)} (see output.channels)"
        )
    set_up(figure, result, TORQUE_HEIGHT)
    ax = figure.subplots()
    fine = refined(result)
    handles = [
        ax.plot(fine.channels["angle"], fine.channels[name], **line_style(i), label=words)[0]
        for i, (name, words) in enumerate(found.items())
    ]
    grid(ax)
    ax.axhline(0.0, color=BLACK, linewidth=0.6)
    ax.set_ylabel("torque on the crank, N m")
    ax.set_xlabel("angle of the crank, rad")
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
    result : Record
    figure : Figure or SubFigure
    instant : Record, optional
        The result up to another instant, at which planet and crank are drawn.
    """
    if not {"tracer_x", "tracer_y"} <= result.channels.keys():
        raise InputError(
            "cannot draw the view 'path': this result has no channel tracer_x, tracer_y; add"
            " effects.tracer_point to the scenario (see output.channels)"
        )
    sun_radius, radius = (scenario_value(result, "mechanism", f"{part}_radius") for part in PARTS)
    notes = [] if instant is None else [f"at {instant.channels['time'][-1]:.6g} s"]
    set_up(figure, result, _height_of_path(figure), *notes, scaled=False)
    plane = figure.subplots()
    sun = Circle((0.0, 0.0), sun_radius, fc=SUN_COLOUR, ec=BLACK, label="sun")
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
    count = int(min(2 + (high - low) / STEP, MAX_POINTS))
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
        point = {"marker": "D", "mfc": "white", "mec": BLACK, "markersize": 6, "linestyle": ""}
        parts += plane.plot(*end, **point, zorder=5, label="tracer point")
    return parts
