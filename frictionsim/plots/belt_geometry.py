"""A belt as its pictures need it: pulleys, places along it, and where it touches what."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.plots.style import given, scenario_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.io.hdf5_reader import Result

    Array = npt.NDArray[np.float64]


class Pulley(NamedTuple):
    """A pulley of the scenario; lengths in m."""

    name: str
    x: float
    y: float
    radius: float


def pulleys_of(result: "Result") -> list[Pulley]:
    """Return the pulleys of the scenario, in their order.

    Raises
    ------
    InputError
        If the scenario is not that of the result's bodies.
    """
    where = ("mechanism", "pulleys")
    pulleys = [
        Pulley(
            given(result, *where, i, "name"),
            given(result, *where, i, "center", 0),
            given(result, *where, i, "center", 1),
            given(result, *where, i, "radius"),
        )
        for i in range(len(given(result, *where)))
    ]
    if np.max(result.channels["pulley_index"], initial=-1) >= len(pulleys):
        raise InputError("bodies in this result touch pulleys that its scenario does not have")
    return pulleys


def has_friction(result: "Result") -> bool:
    """Return whether the scenario has friction between belt and pulleys."""
    return "belt_friction" in scenario_of(result).get("effects", {})


def runs(values: "Array") -> Iterator[tuple[float, int, int]]:
    """Yield each run of equal values: the value, its first index and the one after its last."""
    ends = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    for first, stop in pairwise(ends):
        yield float(values[first]), int(first), int(stop)


def first_free_body(touched: "Array") -> int:
    """Return the first body that has left the first pulley; 0 if none touches it.

    Bodies may lift off between others that touch: what counts is the longest way without touch.
    """
    on = np.flatnonzero(touched == 0)
    if not on.size:
        return 0
    gaps = np.diff(on, append=on[0] + len(touched))
    return int(on[np.argmax(gaps)] + 1) % len(touched)


def middle_of_first_span(touched: "Array") -> int:
    """Return the body in the middle between the first pulley and the next that is touched."""
    start = first_free_body(touched)
    ahead = np.roll(touched, -start)
    stops = np.flatnonzero(ahead >= 0)
    return int(start + (stops[0] if stops.size else 0) // 2) % len(touched)


def joints_at(result: "Result", sample: int) -> "Array":
    """Return the places (n, 2) of the joints, m; joint k is between the bodies k - 1 and k."""
    bodies = np.column_stack([result.channels["x"][sample], result.channels["y"][sample]])
    return 0.5 * (bodies + np.roll(bodies, 1, axis=0))


class BeltLine:
    """A closed line through the joints of a belt, measured from where it leaves the first pulley.

    Attributes
    ----------
    order : (n,)
        The joints in the order of the line.
    place : (n + 1,), m
        Their distances along it, and last the length of the line.
    """

    def __init__(self, result: "Result", sample: int) -> None:
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
        """Return the distances along the line, m, of the places on it nearest to points (m, 2)."""
        from scipy.spatial import KDTree  # which the other pictures do without

        _, nearest = KDTree(self._points).query(points)
        legs = np.stack([nearest, (nearest - 1) % len(self._points)])
        away, along = points - self._points[legs], self._legs[legs]
        square = np.maximum(np.sum(along * along, axis=-1), np.finfo(float).tiny)
        share = np.clip(np.sum(away * along, axis=-1) / square, 0.0, 1.0)
        missed = np.sum((away - share[..., None] * along) ** 2, axis=-1)
        closer = np.argmin(missed, axis=0), np.arange(len(points))
        lengths = np.diff(self.place)[legs]
        return (self.place[legs] + share * lengths)[closer]

    def mean(self, result: "Result", samples: Any) -> "Array":
        """Return the mean tension at `place` over samples, in space: the belt runs through it."""
        total = np.zeros_like(self.place)
        for sample in samples:
            places = self.project(joints_at(result, sample))
            tension = result.channels["tension"][sample]
            total += np.interp(self.place, places, tension, period=self.length)
        return total / len(samples)
