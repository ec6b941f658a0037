"""Geometry of a belt for its pictures: pulleys, positions along the belt, contact arcs."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.motion.belt_path import (
    DrawnPulley,
    arc_of,
    drawn_pulleys,
    guiding_path,
    middles_on,
    places_on,
)
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]


def pulleys_of(result: "Record") -> list[DrawnPulley]:
    """Return the pulleys of the scenario, in their order."""
    pulleys = drawn_pulleys(result)
    touched = result.channels.get("pulley_index", np.array(-1))
    if np.max(touched, initial=-1) >= len(pulleys):
        raise InputError("bodies in this result touch pulleys that are not in its scenario")
    return pulleys


def has_friction(result: "Record") -> bool:
    """Return whether the scenario has friction between belt and pulleys."""
    return "belt_friction" in scenario_of(result).get("effects", {})


def constant_runs(values: "Array") -> Iterator[tuple[float, int, int]]:
    """Yield each run of equal values: the value, its first index, and its last index plus one."""
    ends = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    for first, stop in pairwise(ends):
        yield float(values[first]), int(first), int(stop)


def first_free_body(touched: "Array") -> int:
    """Return the first body after the contact arc of the first pulley; 0 if none touches it.

    Bodies within the arc may lift off, so the arc ends where the longest gap begins.

    Parameters
    ----------
    touched : (n,)
        Index of the pulley that each body touches; -1 if none.
    """
    on = np.flatnonzero(touched == 0)
    if not on.size:
        return 0
    gaps = np.diff(on, append=on[0] + len(touched))
    return int(on[np.argmax(gaps)] + 1) % len(touched)


def middle_of_first_span(touched: "Array") -> int:
    """Return the body in the middle of the span after the first pulley."""
    start = first_free_body(touched)
    ahead = np.roll(touched, -start)
    stops = np.flatnonzero(ahead >= 0)
    return int(start + (stops[0] if stops.size else 0) // 2) % len(touched)


def joints_at(result: "Record", sample: int) -> "Array":
    """Return the positions (n, 2) of the joints, m; joint k is between the bodies k - 1 and k."""
    bodies = np.column_stack([result.channels["x"][sample], result.channels["y"][sample]])
    return 0.5 * (bodies + np.roll(bodies, 1, axis=0))


class BeltLine:
    """The closed line through the joints of a belt, starting where it leaves the first pulley.

    Attributes
    ----------
    order : (n,)
        Joint indices in the order of the line.
    place : (n + 1,), m
        Distances of the joints along the line; the last is the length of the line.
    """

    def __init__(self, result: "Record", sample: int) -> None:
        joints = joints_at(result, sample)
        start = first_free_body(result.channels["pulley_index"][sample])
        self.order = np.roll(np.arange(len(joints)), -start)
        self._points = joints[self.order]
        self._legs = np.roll(self._points, -1, axis=0) - self._points
        self.place = np.concatenate([[0.0], np.cumsum(np.hypot(*self._legs.T))])

    @property
    def length(self) -> float:
        """The length of the line, m."""
        return float(self.place[-1])

    def project(self, points: "Array") -> "Array":
        """Return the distances along the line, m, of the points nearest to given points (m, 2)."""
        from scipy.spatial import KDTree  # imported here: slow, and needed by this view only

        _, nearest = KDTree(self._points).query(points)
        legs = np.stack([nearest, (nearest - 1) % len(self._points)])
        away, along = points - self._points[legs], self._legs[legs]
        square = np.maximum(np.sum(along * along, axis=-1), np.finfo(float).tiny)
        fraction = np.clip(np.sum(away * along, axis=-1) / square, 0.0, 1.0)
        missed = np.sum((away - fraction[..., None] * along) ** 2, axis=-1)
        closer = np.argmin(missed, axis=0), np.arange(len(points))
        lengths = np.diff(self.place)[legs]
        return (self.place[legs] + fraction * lengths)[closer]

    def places_at(self, result: "Record", sample: int) -> "Array":
        """Return the distances of the joints along the line at a sample, (n,), m."""
        return self.project(joints_at(result, sample))

    def arcs(self, touched: "Array") -> Iterator[tuple[int, float, float]]:
        """Yield number of the pulley, start and end, m, of each stretch of belt on a pulley.

        Body k is between the joints k and k + 1.

        Parameters
        ----------
        touched : (n,)
            Index of the pulley that each body touches; -1 if none.
        """
        for value, first, stop in constant_runs(touched[self.order]):
            if value >= 0:
                yield int(value), float(self.place[first]), float(self.place[stop])

    def spans(self, touched: "Array") -> Iterator[tuple[int, float, float]]:
        """Yield the number of the pulley before each span, its start and its end, m.

        Parameters
        ----------
        touched : (n,)
            Index of the pulley that each body touches; -1 if none.
        """
        along = touched[self.order]
        for value, first, stop in constant_runs(along):
            if value < 0 and first > 0 and along[first - 1] != along[stop % len(along)]:
                yield int(along[first - 1]), float(self.place[first - 1]), float(self.place[stop])
        if len(along) and along[0] < 0 <= along[-1]:
            stop = int(np.argmax(along >= 0))
            yield int(along[-1]), float(self.place[0]), float(self.place[stop])

    def mean(self, result: "Record", samples: Any) -> "Array":
        """Return the mean tension over samples at the positions `place`, which are fixed in space.

        Returns
        -------
        (n + 1,), N
        """
        total = np.zeros_like(self.place)
        for sample in samples:
            places = self.places_at(result, sample)
            tension = result.channels["tension"][sample]
            total += np.interp(self.place, places, tension, period=self.length)
        return total / len(samples)


class GuidedLine(BeltLine):
    """The line of a guided string, with its spans and arcs, from where it leaves the first pulley.

    The first joint on it is less than the distance of two points behind that place.
    """

    def __init__(self, result: "Record", sample: int, path: "Path") -> None:
        self._path = path
        joints = self.places_at(result, sample)
        self.order = np.argsort(joints, kind="stable")
        along = joints[self.order]
        self.place = np.append(along, along[0] + path.length)

    @property
    def length(self) -> float:
        """The length of the line, m."""
        return self._path.length

    def places_at(self, result: "Record", sample: int) -> "Array":
        """Return the distances of the joints along the line at a sample, (n,), m."""
        points = np.column_stack([result.channels["x"][sample], result.channels["y"][sample]])
        joints = middles_on(self._path, places_on(self._path, points))
        return np.asarray(joints % self._path.length)

    def arcs(self, touched: "Array") -> Iterator[tuple[int, float, float]]:
        """Yield number of the pulley, start and end, m, of each arc of the line."""
        for number in range(len(self._path.arcs)):
            yield (number, *arc_of(self._path, number))

    def spans(self, touched: "Array") -> Iterator[tuple[int, float, float]]:
        """Yield the number of the pulley before each span of the line, its start and its end, m."""
        ends = self._path.breakpoints
        for number in range(len(self._path.spans)):
            yield number, float(ends[2 * number]), float(ends[2 * number + 1])


def belt_line(result: "Record", sample: int) -> BeltLine:
    """Return the line of a belt at a sample: that of a guided string, else through its joints."""
    path = guiding_path(result, sample)
    return BeltLine(result, sample) if path is None else GuidedLine(result, sample, path)
