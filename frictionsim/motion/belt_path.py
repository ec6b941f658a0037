"""The ideal line of a belt: for guided strings where they are, for others where their spans are."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.geometry import Path, PathError, PulleyCircle, belt_path
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]


class DrawnPulley(NamedTuple):
    """A pulley of a belt; lengths in m."""

    name: str
    x: float
    y: float
    radius: float


def drawn_pulleys(result: "Record") -> list[DrawnPulley]:
    """Return the pulleys of the scenario, in their order."""
    where = ("mechanism", "pulleys")
    return [
        DrawnPulley(
            str(scenario_value(result, *where, i, "name")),
            float(scenario_value(result, *where, i, "center", 0)),
            float(scenario_value(result, *where, i, "center", 1)),
            float(scenario_value(result, *where, i, "radius")),
        )
        for i in range(len(scenario_value(result, *where)))
    ]


LINE_TOLERANCE = 1e-3  # of the smallest radius: points no further off are on the line
FINE = 0.05  # rad, between the points of a drawn arc


def path_of(result: "Record") -> Path | None:
    """Return the line of an ideal taut belt round the pulleys of a scenario, if there is one."""
    tables = scenario_value(result, "mechanism", "pulleys")
    try:
        return belt_path(
            [
                PulleyCircle(
                    table["name"],
                    (float(table["center"][0]), float(table["center"][1])),
                    float(table["radius"]),
                    table.get("side", "inside"),
                )
                for table in tables
            ]
        )
    except (PathError, KeyError, TypeError, ValueError):
        return None


def guiding_path(result: "Record", sample: int) -> Path | None:
    """Return the line that the points of a guided string lie on; None for bodies in the plane."""
    try:
        in_plane = "contact" in scenario_of(result).get("effects", {})
        path = None if in_plane else path_of(result)
    except InputError:
        return None
    if path is None:
        return None
    points = np.column_stack([result.channels["x"][sample], result.channels["y"][sample]])
    off = np.hypot(*(path.at(places_on(path, points)).position - points).T)
    radius = min(table["radius"] for table in scenario_value(result, "mechanism", "pulleys"))
    return path if np.max(off, initial=0.0) <= LINE_TOLERANCE * radius else None


def places_on(path: Path, points: "Array") -> "Array":
    """Return the places along a line, m in [0, length), that are nearest to points (n, 2)."""
    ends = path.breakpoints
    candidates = []
    for i in range(len(path.arcs)):
        start, stop = np.array(path.spans[i].start), np.array(path.spans[i].end)
        leg, length = stop - start, ends[2 * i + 1] - ends[2 * i]
        along = np.clip((points - start) @ leg / length**2, 0.0, 1.0)
        candidates.append(ends[2 * i] + along * length)
        arc = path.arcs[(i + 1) % len(path.arcs)]
        length = ends[2 * i + 2] - ends[2 * i + 1]
        sweep, radius = abs(arc.wrap_angle), length / abs(arc.wrap_angle)
        outward = np.array([np.cos(arc.start), np.sin(arc.start)])
        away = points - (stop - radius * outward)
        turned = np.sign(arc.wrap_angle) * (np.arctan2(away[:, 1], away[:, 0]) - arc.start)
        turned %= 2.0 * np.pi
        beyond = turned > 0.5 * sweep + np.pi  # nearer to the start of the arc than to its end
        candidates.append(
            ends[2 * i + 1] + np.where(beyond, 0.0, np.minimum(turned, sweep)) * radius
        )
    places = np.array(candidates) % path.length
    off = [np.hypot(*(path.at(place).position - points).T) for place in places]
    return np.asarray(places[np.argmin(off, axis=0), np.arange(len(points))])


def middles_on(path: Path, places: "Array") -> "Array":
    """Return the places of the joints: joint k is halfway from point k - 1 to point k.

    Each is before its point, where the line begins also below zero.

    Parameters
    ----------
    places : (n,), m
        Of the points.
    """
    return np.asarray(places - 0.5 * ((places - np.roll(places, 1)) % path.length))


def line_between(path: Path, start: float, stop: float) -> "Array":
    """Return fine points (n, 2) of a line between two places, m; stop is not before start."""
    curved = np.asarray([abs(arc.wrap_angle) for arc in path.arcs])
    lengths = np.roll(np.diff(path.breakpoints)[1::2], 1)
    step = FINE * float(np.min(lengths / curved))
    count = 2 + int((stop - start) / step)
    turns = np.arange(np.floor(start / path.length), np.floor(stop / path.length) + 1.0)
    corners = (path.breakpoints[:-1] + turns[:, None] * path.length).ravel()
    inside = corners[(corners > start) & (corners < stop)]
    places = np.union1d(np.linspace(start, stop, count), inside)
    return path.at(places % path.length).position


def arc_of(path: Path, number: int) -> tuple[float, float]:
    """Return the places, m, at which the arc of a pulley begins and ends."""
    at = 2 * ((number - 1) % len(path.arcs)) + 1
    return float(path.breakpoints[at]), float(path.breakpoints[at + 1])


def patch_members(result: "Record") -> "npt.NDArray[np.bool_] | None":
    """Return a flag of each body in the patch with another friction, (n,); None without a patch.

    A patch lies by the unstretched length of the belt, here from the first sample.
    """
    if "patch" not in scenario_of(result).get("effects", {}):
        return None
    start, end = (float(scenario_value(result, "effects", "patch", k)) for k in ("from", "to"))
    x, y = (np.asarray(result.channels[axis][0]) for axis in "xy")
    length = np.hypot(x - np.roll(x, 1), y - np.roll(y, 1))
    belt = scenario_value(result, "mechanism", "belt")
    if "tension" in result.channels and "axial_rigidity" in belt:
        strain = np.asarray(result.channels["tension"][0]) / float(belt["axial_rigidity"])
        length = length / (1.0 + strain)
    places = (np.arange(len(x)) + 0.5) * float(length.mean())
    return np.asarray((places >= start) & (places < end))
