"""The path of a point of a planet that rolls on a sun: position, cusps, dwell."""

from math import pi, radians
from typing import Any, NamedTuple

from frictionsim.mechanisms.single_dof import cos, sin
from frictionsim.scenario.schema import Params, unit_field


class TracerPoint(Params):
    """A point of the planet whose path is recorded; with angle_deg = 180 it starts on the sun.

    The point dwells while it is within `dwell_distance` of a position.
    """

    radius: float = unit_field("m", "Distance of the point from the planet's centre.", ge=0)
    angle_deg: float = unit_field(
        "deg", "Angle of the point where the crank is at 0; 180 is on the sun.", 180.0
    )
    dwell_distance: float = unit_field(
        "m", "Distance from a place within which the point dwells there.", 1e-3, gt=0
    )


def tracer_position(length: float, turns: float, point: TracerPoint, angle: Any) -> tuple[Any, Any]:
    """Return the position of a point of the planet; its path is an epicycloid if radius = r2.

    x = L cos phi + rho cos(psi_0 + lambda phi), y the same with sin.

    Parameters
    ----------
    length : float, m
        L, of the crank.
    turns : float
        lambda, rotations of the planet per turn of the crank.
    point : TracerPoint
    angle : float or (n,), rad
        phi, of the crank.

    Returns
    -------
    x, y : float or (n,), m
    """
    psi = radians(point.angle_deg) + turns * angle
    x = length * cos(angle) + point.radius * cos(psi)
    y = length * sin(angle) + point.radius * sin(psi)
    return x, y


def count_cusps(
    sun_radius: float, planet_radius: float, point: TracerPoint, angle: Any
) -> float | None:
    """Return the number of cusps in the path of a rim point, where it touches the sun.

    A cusp is at psi_0 + lambda phi - phi = pi + 2 pi k.

    Parameters
    ----------
    sun_radius, planet_radius : float, m
    point : TracerPoint
    angle : (n,), rad
        phi, of the crank.

    Returns
    -------
    float or None
        None for points off the rim, which have no cusps.
    """
    if point.radius != planet_radius or not angle.size:
        return None
    first, last = _cusp_numbers(sun_radius / planet_radius, point, angle)
    return max(last - first + 1.0, 0.0)


def cusp_angles(sun_radius: float, planet_radius: float, point: TracerPoint, angle: Any) -> Any:
    """Return the angles of the crank, (m,), rad, at which a path has cusps; none off the rim.

    Cusps are between the smallest and the largest of the given angles, (n,), rad.
    """
    import numpy as np

    if point.radius != planet_radius or not angle.size:
        return np.zeros(0)
    sun_planet_ratio = sun_radius / planet_radius
    first, last = _cusp_numbers(sun_planet_ratio, point, angle)
    return (2.0 * pi * np.arange(first, last + 0.5) - _cusp_offset(point)) / sun_planet_ratio


def _cusp_offset(point: TracerPoint) -> float:
    return radians(point.angle_deg) - pi


def _cusp_numbers(sun_planet_ratio: float, point: TracerPoint, angle: Any) -> tuple[float, float]:
    """Return k of the first and the last cusp within the angles; the last is less if none is."""
    slack = 1e-9  # a cusp at the start or end counts, in spite of rounding
    revolutions = (_cusp_offset(point) + sun_planet_ratio * angle) / (2.0 * pi)
    lowest, highest = float(revolutions.min()), float(revolutions.max())
    return -((-(lowest - slack)) // 1.0), (highest + slack) // 1.0


def pace(length: float, turns: float, point: TracerPoint, angle: Any, velocity: Any) -> Any:
    """Return the speed of a point of the planet, m/s: |phi'| times the derivative of its position.

    `velocity` is phi', rad/s; the rest as in `tracer_position`.
    """
    own = radians(point.angle_deg) + (turns - 1.0) * angle
    lever = turns * point.radius
    square = length * length + lever * lever + 2.0 * length * lever * cos(own)
    return abs(velocity) * (square * (square > 0.0)) ** 0.5


class Dwell(NamedTuple):
    """A stay near a position of minimum speed: its sample, start and end, s."""

    sample: int
    start: float
    stop: float


def longest_dwell(time: Any, speed: Any, x: Any, y: Any, distance: float) -> float | None:
    """Return the longest time that a point stays near a position of minimum speed, s.

    Parameters as of `place_of_longest_dwell`.
    """
    if time.size < 3:
        return None
    dwell = place_of_longest_dwell(time, speed, x, y, distance)
    return dwell.stop - dwell.start if dwell else 0.0


def place_of_longest_dwell(time: Any, speed: Any, x: Any, y: Any, distance: float) -> Dwell | None:
    """Return where a point stays longest near a position of minimum speed, and when.

    Such positions are the samples without a slower neighbour, including the first and the last.
    A dwell ends where the linearly interpolated distance from the position exceeds `distance`.

    Parameters
    ----------
    time : (n,), s
    speed : (n,), m/s
    x, y : (n,), m
    distance : float, m
    """
    import numpy as np

    if time.size < 3:
        return None
    before, after = np.append(np.inf, speed[:-1]), np.append(speed[1:], np.inf)
    longest, last = None, None
    for i in np.flatnonzero((speed <= before) & (speed <= after)).tolist():
        if last == (x[i], y[i]):
            continue  # the same rest
        last = x[i], y[i]
        dwell = _dwell(time, np.hypot(x - x[i], y - y[i]), i, distance)
        if longest is None or dwell.stop - dwell.start > longest.stop - longest.start:
            longest = dwell
    return longest


def _dwell(time: Any, far: Any, i: int, distance: float) -> Dwell:
    """Return when a point is within a distance around sample i."""
    import numpy as np

    outside = far > distance
    before, after = np.flatnonzero(outside[:i]), np.flatnonzero(outside[i:])
    start = _crossing_time(time, far, before[-1], distance) if before.size else time[0]
    stop = _crossing_time(time, far, i + after[0] - 1, distance) if after.size else time[-1]
    return Dwell(i, float(start), float(stop))


def _crossing_time(time: Any, far: Any, i: int, distance: float) -> float:
    """Return the time at which a distance is passed between the samples i and i + 1, s."""
    fraction = (distance - far[i]) / (far[i + 1] - far[i])
    return float(time[i] + fraction * (time[i + 1] - time[i]))
