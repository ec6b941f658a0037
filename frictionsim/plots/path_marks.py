"""Marks on the path of a tracer point: its cusps, and where it dwells longest."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.tracer_point import (
    TracerPoint,
    cusp_angles,
    pace,
    place_of_longest_dwell,
    tracer_position,
)
from frictionsim.plots.style import BLACK, ORANGE, Style
from frictionsim.scenario.recorded import scenario_value

if TYPE_CHECKING:
    from frictionsim.results import Record

CUSP: Style = {"marker": "D", "mfc": "white", "mec": BLACK, "markersize": 6, "linestyle": ""}
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


def draw_marks(plane: Any, result: "Record", sun_radius: float, radius: float) -> list[Any]:
    """Mark the cusps of a path, and the part of it where its point dwells longest.

    Both are as the summary counts them: only the path of a point of the rim has cusps, where it
    touches the sun; a point dwells within `dwell_distance` of a position of least speed.

    Parameters
    ----------
    plane : Axes
    result : Record
    sun_radius, radius : float, m
        Of sun and planet.
    """
    channels = result.channels
    point = TracerPoint.model_validate(scenario_value(result, "effects", "tracer_point"))
    length = sun_radius + radius
    angles = cusp_angles(sun_radius, radius, point, channels["angle"])
    handles = []
    if angles.size:
        x, y = tracer_position(length, length / radius, point, angles)
        places = np.round(np.column_stack([x, y]) / (SAME * length)).astype(np.int64)
        _, first = np.unique(places, axis=0, return_index=True)
        count = f"{angles.size} cusp{'' if angles.size == 1 else 's'}"
        handles += plane.plot(x[first], y[first], **CUSP, zorder=3.5, label=count)
    if "angular_velocity" in channels:
        handles += _draw_dwell(plane, result, length, radius, point)
    return handles


def _draw_dwell(
    plane: Any, result: "Record", length: float, radius: float, point: TracerPoint
) -> list[Any]:
    channels, turns = result.channels, length / radius
    time, angle = channels["time"], channels["angle"]
    speed = pace(length, turns, point, angle, channels["angular_velocity"])
    x, y = channels["tracer_x"], channels["tracer_y"]
    found = place_of_longest_dwell(time, speed, x, y, point.dwell_distance)
    if found is None or found.stop <= found.start:
        return []
    turned = np.interp(np.linspace(found.start, found.stop, FINE), time, angle)
    path = tracer_position(length, turns, point, turned)
    words = f"longest dwell, {found.stop - found.start:.4g} s"
    plane.plot(*path, **DWELL, zorder=2.5)
    at = x[found.sample], y[found.sample]
    return list(plane.plot(*at, **PLACE, zorder=4.5, label=words))
