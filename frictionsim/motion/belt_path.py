"""The ideal line of a belt: for guided strings where they are, for others where their spans are."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.geometry import Path, PathError, PulleyCircle, belt_path
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]


LINE_TOLERANCE = 1e-3  # of the smallest radius: points no further off are on the line


def pulleys_of(record: "Record") -> list[PulleyCircle]:
    """Return the pulleys of the scenario, in their order."""
    where = ("mechanism", "pulleys")

    def of(number: int, *keys: str | int) -> Any:
        return scenario_value(record, *where, number, *keys)

    return [
        PulleyCircle(
            str(of(i, "name")),
            (float(of(i, "center", 0)), float(of(i, "center", 1))),
            float(of(i, "radius")),
            table.get("side", "inside"),
        )
        for i, table in enumerate(scenario_value(record, *where))
    ]


def path_of(record: "Record") -> Path | None:
    """Return the line of an ideal taut belt round the pulleys of a scenario, if there is one."""
    try:
        return belt_path(pulleys_of(record))
    except (PathError, InputError):
        return None


def guiding_path(result: "Record", sample: int) -> Path | None:
    """Return the line that the points of a guided string lie on; None for bodies in the plane."""
    path = None if "contact" in scenario_of(result).get("effects", {}) else path_of(result)
    if path is None:
        return None
    points = np.column_stack([result.channels["x"][sample], result.channels["y"][sample]])
    off = np.hypot(*(path.at(places_on(path, points)).position - points).T)
    radius = min(pulley.radius for pulley in pulleys_of(result))
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


def arc_of(path: Path, number: int) -> tuple[float, float]:
    """Return the places, m, at which the arc of a pulley begins and ends."""
    at = 2 * ((number - 1) % len(path.arcs)) + 1
    return float(path.breakpoints[at]), float(path.breakpoints[at + 1])


def patch_members(result: "Record") -> "npt.NDArray[np.bool_] | None":
    """Return a flag of each body in a patch with another friction, (n,); None without a patch.

    Patches lie by the unstretched length of the belt, here from the first sample.
    """
    if "patch" not in scenario_of(result).get("effects", {}):
        return None
    given = scenario_value(result, "effects", "patch")
    x, y = (np.asarray(result.channels[axis][0]) for axis in "xy")
    length = np.hypot(x - np.roll(x, 1), y - np.roll(y, 1))
    belt = scenario_value(result, "mechanism", "belt")
    if "tension" in result.channels and "axial_rigidity" in belt:
        strain = np.asarray(result.channels["tension"][0]) / float(belt["axial_rigidity"])
        length = length / (1.0 + strain)
    places = (np.arange(len(x)) + 0.5) * float(length.mean())
    inside = np.zeros(len(x), dtype=bool)
    for patch in given if isinstance(given, list) else [given]:
        inside |= (places >= patch["from"]) & (places < patch["to"])
    return inside
