"""The path of a point of a planet that rolls on a sun, or in a ring: position, cusps, dwell, swing.

With l rotations of the planet per turn of the crank, lambda on a sun and -lambda in a ring, the
point is at L e^(i phi) + rho e^(i psi), psi = psi_0 + l phi. Per angle of the crank it is slowest
where it is nearest to the sun, psi - phi = pi + 2 pi k, or to the ring, psi - phi = -2 pi k, which
are the cusps of a point of the rim. An angle p of the crank away from such a place, before or after
it, its distance from there, and the part of that along the path there, are

    d(p) = |L (e^(ip) - 1) -+ rho (e^(i l p) - 1)|,    y(p) = L sin p - rho sin(lambda p)

A point beyond the rim passes the place backwards: it swings from y(-p) to y(p), with the smallest p
at which dy/dp = 0.
"""

from collections.abc import Callable, Iterator
from math import asin, ceil, pi, radians, sin
from typing import Any, NamedTuple

from frictionsim.mechanisms.epicyclic.schema import EpicyclicParameters, TracerPoint
from frictionsim.results import Quantities, Quantity

Motion = tuple[Any, Any, Any]  # times, s, angles of the crank, rad, and its velocities, rad/s: (n,)


class Dwell(NamedTuple):
    """A passage of a place nearest to the sun or ring.

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


class TracerPath:
    """The path of a tracer point; of a point of the rim an epicycloid, or a hypocycloid in a ring.

    Parameters
    ----------
    gear : EpicyclicParameters
    point : TracerPoint
    """

    def __init__(self, gear: EpicyclicParameters, point: TracerPoint) -> None:
        self.length, self.turns = gear.length, gear.planet_speed_ratio
        self._planet, self._ratio = gear.planet_radius, gear.sun_radius / gear.planet_radius
        self.rho, self.psi_0 = point.radius, radians(point.angle_deg)
        self._start = self.psi_0 - pi if self.turns > 0.0 else -self.psi_0
        self._distance = point.dwell_distance

    def position(self, angle: Any) -> tuple[Any, Any]:
        """Return x = L cos phi + rho cos(psi_0 + l phi), m, and y, of angles of the crank."""
        import numpy as np

        psi = self.psi_0 + self.turns * angle
        x = self.length * np.cos(angle) + self.rho * np.cos(psi)
        return x, self.length * np.sin(angle) + self.rho * np.sin(psi)

    def cusps(self, angle: Any) -> tuple[float, float] | None:
        """Return k of the first cusp within angles of the crank, (n,), rad, and how many there are.

        A point of the rim has cusps, where it touches sun or ring; others have None. Where the path
        ends in the cusp that it started in, this counts once.
        """
        if self.rho != self._planet or not angle.size:
            return None
        slack = 1e-9  # a cusp at the start or end counts, in spite of rounding
        lowest, highest = float(self._number(angle.min())), float(self._number(angle.max()))
        first, last = -((-(lowest - slack)) // 1.0), (highest + slack) // 1.0
        turns = (last - first) / self._ratio
        at_ends = abs(first - lowest) <= slack and abs(last - highest) <= slack
        if at_ends and turns > 0.5 and abs(turns - round(turns)) <= slack:
            last -= 1.0  # the path is closed
        return first, max(last - first + 1.0, 0.0)

    def _number(self, angle: Any) -> Any:
        """Return k of an angle of the crank, an integer at a place nearest to sun or ring."""
        return (self._start + self._ratio * angle) / (2.0 * pi)

    def angle_of(self, k: Any) -> Any:
        """Return the angle phi_k of the crank, rad."""
        return (2.0 * pi * k - self._start) / self._ratio

    def swing(self) -> tuple[float, float] | None:
        """Return how far the point swings back at a place of least speed, m, and p there, rad.

        It is 2 |y(p)| at the smallest p with L cos p = rho lambda cos(lambda p); 0 for a point
        that is not beyond the rim; None if that is more than a turn.
        """
        import numpy as np

        if self.rho <= self._planet:
            return 0.0, 0.0
        turns = abs(self.turns)
        p = self._first(
            lambda p: self.length * np.cos(p) - self.rho * turns * np.cos(turns * p), 0.0
        )
        if p is None:
            return None
        return 2.0 * abs(self.length * sin(p) - self.rho * sin(turns * p)), p

    def quantities(self) -> Quantities:
        """Return the swing, and how far the crank turns while the point dwells."""
        swing, half = self.swing(), self.half_angle()
        return {
            "tracer_swing": Quantity(swing and swing[0], "m"),
            "tracer_dwell_angle": Quantity(half and 2.0 * half, "rad"),
        }

    def longest_dwell(self, motion: Motion) -> Dwell | None:
        """Return the longest passage of a place nearest to sun or ring; None if there is none.

        The crank passes all of it in one direction, without a rest: what begins or ends in it, or
        stands still, is no dwell of the mechanism. Between samples, the angle is the cubic
        polynomial of angles and velocities, exact for a uniform rotation.
        """
        import numpy as np

        half, longest = self.half_angle(), None
        if half is None:
            return None
        for way in (1.0, -1.0):
            for part in _one_way(motion, way):
                cubic, angle = Cubic(part), part[1]
                # A passage is longest near a sample, or where the speed is least between two.
                near = np.concatenate((angle, cubic.at_least_speed()))
                k = np.unique(np.floor(self._number(way * near)))
                at = way * self.angle_of(np.unique(k[:, None] + np.arange(-1.0, 3.0)))
                at = at[(at - half >= angle[0]) & (at + half <= angle[-1])]
                start, stop = (cubic.times_of(at + p) for p in (-half, half))
                for i in np.argsort(start - stop, kind="stable")[:1].tolist():
                    dwell = Dwell(float(way * at[i]), half, float(stop[i] - start[i]))
                    longest = max(longest or dwell, dwell, key=lambda one: one.time)
        return longest

    def half_angle(self) -> float | None:
        """Return the smallest p at which d(p) is the dwell distance, rad; None beyond a turn."""
        import numpy as np

        def excess(p: Any) -> Any:
            a, b = self.length * np.sin(0.5 * p), self.rho * np.sin(0.5 * abs(self.turns) * p)
            square = (a - b) ** 2 + 4.0 * a * b * np.sin(0.25 * (self.turns - 1.0) * p) ** 2
            return 2.0 * np.sqrt(np.maximum(square, 0.0)) - self._distance

        # At first d < 2 L sin(p/2) + 2 rho; a point of the centre of a tiny planet takes no search.
        surely = (self._distance - 2.0 * self.rho) / (2.0 * self.length)
        if self.rho == 0.0 or surely >= 1.0:
            return None  # it is equally fast everywhere, or never far from the place
        return self._first(excess, 2.0 * asin(max(surely, 0.0)))

    def _first(self, excess: Callable[[Any], Any], low: float) -> float | None:
        """Return the smallest root of a function of p, at first negative; None beyond a turn."""
        import numpy as np

        from frictionsim.solvers.roots import bracket_root

        step = pi / (max(abs(self.turns), 1.0) * FINE)
        for first in range(0, ceil((2.0 * pi - low) / step), CHUNK):
            p = np.minimum(low + step * np.arange(first, first + CHUNK + 1), 2.0 * pi)
            for i in np.flatnonzero(excess(p) > 0.0)[:1].tolist():
                if i == 0:
                    return float(p[0])  # by rounding
                return bracket_root(lambda x: float(excess(x)), float(p[i - 1]), float(p[i]))[0]
        return None


# Of the search for the end of a dwell or swing: steps to half a rotation of planet or crank, and
# how many at once.
FINE, CHUNK = 64, 1024
BISECTIONS = 53  # to the roundoff of a number in 0 to 1


class Cubic:
    """The angle of the crank between samples, rad: start + u (rise + u (rest + u cubic)).

    From sample i to the next, u goes from 0 to 1. All are (n - 1,), but `time` (n,).
    """

    def __init__(self, motion: Motion) -> None:
        self.time, angle, velocity = motion
        self.step, turned = self.time[1:] - self.time[:-1], angle[1:] - angle[:-1]
        self.start, self.rise = angle[:-1], self.step * velocity[:-1]
        end_rise = self.step * velocity[1:]
        self.rest = 3.0 * turned - 2.0 * self.rise - end_rise
        self.cubic = self.rise + end_rise - 2.0 * turned

    def at(self, i: Any, u: Any) -> Any:
        """Return the angle, rad."""
        return self.start[i] + u * (self.rise[i] + u * (self.rest[i] + u * self.cubic[i]))

    def velocity(self, i: Any, u: Any) -> Any:
        """Return the angular velocity, rad/s."""
        return (self.rise[i] + u * (2.0 * self.rest[i] + 3.0 * u * self.cubic[i])) / self.step[i]

    def at_least_speed(self) -> Any:
        """Return the angles where the speed has an extremum between two samples, else at them."""
        import numpy as np

        some = self.cubic != 0.0
        u = np.where(some, -self.rest / np.where(some, 3.0 * self.cubic, 1.0), 0.0)
        return self.at(slice(None), np.where((u > 0.0) & (u < 1.0), u, 0.0))

    def times_of(self, at: Any) -> Any:
        """Return when a crank that turns forward has angles, (m,), rad: times, (m,), s."""
        import numpy as np

        i = np.clip(np.searchsorted(self.start, at, side="right") - 1, 0, None)
        return self.time[i] + last_place(lambda u: self.at(i, u) < at, i.size) * self.step[i]


def last_place(is_before: Callable[[Any], Any], count: int) -> Any:
    """Return the places, (count,), in 0 to 1 up to which is_before(u) holds, by bisection."""
    import numpy as np

    low, high = np.zeros(count), np.ones(count)
    for _ in range(BISECTIONS):
        u = 0.5 * (low + high)
        before = is_before(u)
        low, high = np.where(before, u, low), np.where(before, high, u)
    return high


def _one_way(motion: Motion, way: float) -> Iterator[Motion]:
    """Yield each part of a motion, times -1 with `way` -1, in which the angle grows all along."""
    import numpy as np

    time, angle, velocity = motion[0], way * motion[1], way * motion[2]
    turns = np.flatnonzero(velocity[:-1] * velocity[1:] < 0.0)
    cubic = Cubic((time, angle, velocity))
    # Where the motion turns between two samples, a sample is inserted.
    u = last_place(lambda u: cubic.velocity(turns, u) * velocity[turns] > 0.0, turns.size)
    angle = np.insert(angle, turns + 1, cubic.at(turns, u))
    velocity = np.insert(velocity, turns + 1, 0.0)
    time = np.insert(time, turns + 1, time[turns] + u * cubic.step[turns])
    grows = np.concatenate(([False], angle[1:] > angle[:-1], [False]))
    edges = np.flatnonzero(grows[1:] != grows[:-1]).tolist()
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        part = slice(first, last + 1)
        yield time[part], angle[part], velocity[part]
