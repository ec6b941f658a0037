"""The path of a point of a planet that rolls on a sun: place, cusps, dwell."""

from math import pi, radians
from typing import Any

from frictionsim.mechanisms.scalar_math import cos, sin
from frictionsim.scenario.schema import Params, unit_field


class TracerPoint(Params):
    """A point of the planet whose path is recorded; at angle_deg = 180 it starts on the sun.

    `dwell_distance` is how far it may be from a place to be said to dwell there.
    """

    radius: float = unit_field("m", "Distance of the point from the planet's centre.", ge=0)
    angle_deg: float = unit_field(
        "deg", "Angle of the point where the crank is at 0; 180 is on the sun.", 180.0
    )
    dwell_distance: float = unit_field(
        "m", "Distance from a place within which the point dwells there.", 1e-3, gt=0
    )


def tracer_position(length: float, turns: float, point: TracerPoint, angle: Any) -> tuple[Any, Any]:
    """Return the place of a point of the planet, an epicycloid for radius = r2, m and m.

    x = L cos phi + rho cos(psi_0 + lambda phi), y the same with sin.
    """
    psi = radians(point.angle_deg) + turns * angle
    x = length * cos(angle) + point.radius * cos(psi)
    y = length * sin(angle) + point.radius * sin(psi)
    return x, y


def count_cusps(
    sun_radius: float, planet_radius: float, point: TracerPoint, angle: Any
) -> float | None:
    """Count the cusps in the path of a point of the rim: it touches the sun and stands still.

    There psi_0 + lambda phi - phi = pi + 2 pi k. Points within the rim have none: None.
    """
    if point.radius != planet_radius or not angle.size:
        return None
    sun_planet_ratio = sun_radius / planet_radius
    # A start or an end on a cusp counts, whatever the rounding of its angle.
    slack = 1e-9
    seen = (radians(point.angle_deg) - pi + sun_planet_ratio * angle) / (2.0 * pi)
    lowest, highest = float(seen.min()), float(seen.max())
    return float(int((highest + slack) // 1.0) - int(-((-(lowest - slack)) // 1.0)) + 1)


def pace(length: float, turns: float, point: TracerPoint, angle: Any, velocity: Any) -> Any:
    """Return the speed of a point of the planet, m/s.

    |phi'| times the derivative of its place by phi, the crank's end at L and the point at
    lambda rho across and along the crank.
    """
    own = radians(point.angle_deg) + (turns - 1.0) * angle
    lever = turns * point.radius
    square = length * length + lever * lever + 2.0 * length * lever * cos(own)
    return abs(velocity) * (square * (square > 0.0)) ** 0.5


def longest_dwell(time: Any, speed: Any, x: Any, y: Any, distance: float) -> float | None:
    """Return the longest time that a point stays within a distance of where it is slowest, s.

    It is slowest in the samples that have no slower neighbour, the first and the last among them.
    To the spacing of the samples: each dwell is counted from the last sample before it to the
    first after it that are too far, by linear interpolation of the distance.

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
    longest, last = 0.0, None
    for i in np.flatnonzero((speed <= before) & (speed <= after)).tolist():
        if last == (x[i], y[i]):
            continue  # at rest, one sample stands for all
        last = x[i], y[i]
        longest = max(longest, _dwell(time, np.hypot(x - x[i], y - y[i]), i, distance))
    return longest


def _dwell(time: Any, far: Any, i: int, distance: float) -> float:
    """Return for how long about sample i a point is not too far, s."""
    import numpy as np

    outside = far > distance
    before, after = np.flatnonzero(outside[:i]), np.flatnonzero(outside[i:])
    start = _crossing_time(time, far, before[-1], distance) if before.size else time[0]
    stop = _crossing_time(time, far, i + after[0] - 1, distance) if after.size else time[-1]
    return float(stop - start)


def _crossing_time(time: Any, far: Any, i: int, distance: float) -> float:
    """Return when a distance is passed between the samples i and i + 1."""
    share = (distance - far[i]) / (far[i + 1] - far[i])
    return float(time[i] + share * (time[i + 1] - time[i]))
