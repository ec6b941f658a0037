"""The path of a point of a planet that rolls on a sun: position, cusps, dwell.

Per angle of the crank the point is slowest where it is nearest to the sun,

    psi_0 + (lambda - 1) phi_k = pi + 2 pi k

which are the cusps of a point of the rim. An angle p of the crank away from such a place, before or
after it, its distance from there is

    d(p) = |L (e^(ip) - 1) - rho (e^(i lambda p) - 1)|
"""

from collections.abc import Iterator
from math import asin, ceil, pi, radians
from typing import Any, NamedTuple

from frictionsim.mechanisms.single_dof import cos, sin
from frictionsim.scenario.schema import Params, unit_field


class TracerPoint(Params):
    """A point of the planet whose path is recorded; with angle_deg = 180 it starts on the sun.

    The point dwells while it passes a place nearest to the sun within `dwell_distance`.
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

    Where the path ends in the cusp that it started in, this counts once.

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
    return _angle_of_place(sun_planet_ratio, point, np.arange(first, last + 0.5))


def _place_number(sun_planet_ratio: float, point: TracerPoint, angle: Any) -> Any:
    """Return k of an angle of the crank, an integer where the point is nearest to the sun."""
    return (radians(point.angle_deg) - pi + sun_planet_ratio * angle) / (2.0 * pi)


def _angle_of_place(sun_planet_ratio: float, point: TracerPoint, k: Any) -> Any:
    return (2.0 * pi * k - (radians(point.angle_deg) - pi)) / sun_planet_ratio


def _cusp_numbers(sun_planet_ratio: float, point: TracerPoint, angle: Any) -> tuple[float, float]:
    """Return k of the first and the last cusp within the angles; the last is less if none is."""
    slack = 1e-9  # a cusp at the start or end counts, in spite of rounding
    lowest, highest = (
        float(_place_number(sun_planet_ratio, point, end)) for end in (angle.min(), angle.max())
    )
    first, last = -((-(lowest - slack)) // 1.0), (highest + slack) // 1.0
    turns = (last - first) / sun_planet_ratio
    at_ends = abs(first - lowest) <= slack and abs(last - highest) <= slack
    if at_ends and turns > 0.5 and abs(turns - round(turns)) <= slack:
        last -= 1.0  # the path is closed, and ends in its first cusp
    return first, last


class Dwell(NamedTuple):
    """A passage of a place nearest to the sun.

    Attributes
    ----------
    angle : float, rad
        Of the crank, at the place.
    half : float, rad
        The angle from there to where the point is farther than the distance.
    time : float, s
        How long it takes.
    """

    angle: float
    half: float
    time: float


def longest_dwell(
    sun_radius: float, planet_radius: float, point: TracerPoint, motion: tuple[Any, Any, Any]
) -> Dwell | None:
    """Return the longest passage of a place nearest to the sun; None if there is none.

    The crank passes all of it in one direction, without a rest: what begins or ends in it, or
    stands still, is no dwell of the mechanism.

    Parameters
    ----------
    sun_radius, planet_radius : float, m
    point : TracerPoint
    motion : tuple of (n,)
        Time, s, angle of the crank, rad, and its angular velocity, rad/s. Between samples, the
        angle is the cubic polynomial of both, exact for a uniform rotation.
    """
    import numpy as np

    length, ratio = sun_radius + planet_radius, sun_radius / planet_radius
    half = _half_angle(length, length / planet_radius, point)
    if half is None:
        return None
    longest = None
    for way in (1.0, -1.0):
        for time, angle, velocity in _one_way(motion, way):
            cubic = Cubic.of(time, angle, velocity)
            # A passage is longest near a sample, or where the speed is least between two.
            near = np.concatenate((angle, cubic.at(cubic.place_of_least_speed())))
            k = np.unique(np.floor(_place_number(ratio, point, way * near)))
            at = way * _angle_of_place(ratio, point, np.unique(k[:, None] + np.arange(-1.0, 3.0)))
            at = at[(at - half >= angle[0]) & (at + half <= angle[-1])]
            start, stop = (cubic.times_of(time, angle, at + p) for p in (-half, half))
            for i in np.argsort(start - stop, kind="stable")[:1].tolist():
                dwell = Dwell(float(way * at[i]), half, float(stop[i] - start[i]))
                longest = max(longest or dwell, dwell, key=lambda one: one.time)
    return longest


class Cubic(NamedTuple):
    """The angle of the crank between samples: start + u (rise + u (rest + u cubic)), u in 0 to 1.

    All are (n - 1,), in rad, but `step`, the time between two samples, s.
    """

    step: Any
    start: Any
    rise: Any
    rest: Any
    cubic: Any

    @classmethod
    def of(cls, time: Any, angle: Any, velocity: Any) -> "Cubic":
        """Return the polynomials of times, angles and angular velocities, each (n,)."""
        step, turned = time[1:] - time[:-1], angle[1:] - angle[:-1]
        rise, end_rise = step * velocity[:-1], step * velocity[1:]
        rest, cubic = 3.0 * turned - 2.0 * rise - end_rise, rise + end_rise - 2.0 * turned
        return cls(step, angle[:-1], rise, rest, cubic)

    def at(self, u: Any) -> Any:
        """Return the angle at u, rad."""
        return self.start + u * (self.rise + u * (self.rest + u * self.cubic))

    def place_of_least_speed(self) -> Any:
        """Return u where the speed has an extremum between two samples, else 0."""
        import numpy as np

        some = self.cubic != 0.0
        u = np.where(some, -self.rest / np.where(some, 3.0 * self.cubic, 1.0), 0.0)
        return np.where((u > 0.0) & (u < 1.0), u, 0.0)

    def place_of_rest(self) -> Any:
        """Return u where the speed is zero, of samples between which it changes its sign."""
        import numpy as np

        a, b, c = 3.0 * self.cubic, self.rest, self.rise  # a u^2 + 2 b u + c
        q = -(b + np.copysign(np.sqrt(np.maximum(b * b - a * c, 0.0)), b))
        u = q / np.where(a == 0.0, 1.0, a)
        return np.where((a != 0.0) & (u >= 0.0) & (u <= 1.0), u, c / np.where(q == 0.0, 1.0, q))

    def times_of(self, time: Any, angle: Any, at: Any) -> Any:
        """Return when a crank that turns forward has angles, (m,), by bisection, s."""
        import numpy as np

        i = np.clip(np.searchsorted(angle, at, side="right") - 1, 0, angle.size - 2)
        here, low, high = Cubic(*(part[i] for part in self)), np.zeros(at.size), np.ones(at.size)
        for _ in range(BISECTIONS):
            u = 0.5 * (low + high)
            below = here.at(u) < at
            low, high = np.where(below, u, low), np.where(below, high, u)
        return time[i] + high * here.step


BISECTIONS = 53  # to the roundoff of a number in 0 to 1


def _one_way(motion: tuple[Any, Any, Any], way: float) -> Iterator[tuple[Any, Any, Any]]:
    """Yield time, angle and velocity of each part of a motion in which the angle grows all along.

    With `way` -1, angle and velocity are of the opposite sign. Where the motion turns between two
    samples, a sample is inserted.
    """
    import numpy as np

    time, angle, velocity = motion[0], way * motion[1], way * motion[2]
    turns = np.flatnonzero(velocity[:-1] * velocity[1:] < 0.0)
    if turns.size:
        cubic = Cubic(*(part[turns] for part in Cubic.of(time, angle, velocity)))
        u = cubic.place_of_rest()
        angle = np.insert(angle, turns + 1, cubic.at(u))
        velocity = np.insert(velocity, turns + 1, 0.0)
        time = np.insert(time, turns + 1, time[turns] + u * cubic.step)
    grows = np.concatenate(([False], angle[1:] > angle[:-1], [False]))
    edges = np.flatnonzero(grows[1:] != grows[:-1]).tolist()
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        part = slice(first, last + 1)
        yield time[part], angle[part], velocity[part]


# Of the search for the end of a dwell: steps to half a rotation of the planet, and at once.
FINE, CHUNK = 64, 1024


def _half_angle(length: float, turns: float, point: TracerPoint) -> float | None:
    """Return the smallest p at which d(p) is the dwell distance, rad; None within a turn."""
    import numpy as np

    from frictionsim.solvers.root_finding import bracket_root

    def excess(p: Any) -> Any:
        a, b = length * np.sin(0.5 * p), point.radius * np.sin(0.5 * turns * p)
        square = (a - b) ** 2 + 4.0 * a * b * np.sin(0.25 * (turns - 1.0) * p) ** 2
        return 2.0 * np.sqrt(np.maximum(square, 0.0)) - point.dwell_distance

    if point.radius == 0.0:
        return None  # it is equally fast everywhere
    # At first d < 2 L sin(p/2) + 2 rho; a point of the centre of a tiny planet takes no search.
    surely = (point.dwell_distance - 2.0 * point.radius) / (2.0 * length)
    if surely >= 1.0:
        return None
    low, step = 2.0 * asin(max(surely, 0.0)), pi / (turns * FINE)
    for first in range(0, ceil((2.0 * pi - low) / step), CHUNK):
        p = low + step * np.arange(first, first + CHUNK + 1)
        above = np.flatnonzero(excess(p) > 0.0)
        if above.size:
            i = int(above[0])
            if i == 0:
                return float(p[0])  # by rounding
            return bracket_root(lambda x: float(excess(x)), float(p[i - 1]), float(p[i]))[0]
    return None
