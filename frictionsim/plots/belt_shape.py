"""The shape of a belt at its last sample: its pieces, what touches a pulley, and its patch.

Bodies in the plane are links: the belt is drawn from centre to centre. A guided string follows its
line: it is drawn along spans and arcs, and what touches a pulley ends where the arc ends.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from frictionsim.errors import InputError
from frictionsim.motion.belt_path import (
    arc_of,
    guiding_path,
    line_between,
    middles_on,
    places_on,
)
from frictionsim.scenario.recorded import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.plots.belt_geometry import Pulley
    from frictionsim.results import Record

TENSION_COLOURS = "cividis"  # colour-blind safe, and monotonic in grey print


class ContactArc(NamedTuple):
    """The bodies on one pulley at the last sample.

    Attributes
    ----------
    place : (n, 2), m
        Positions.
    lines : list of (k, 2), m
        The line of each body on the pulley.
    normal : (n, 2)
        Unit normals, outwards from the centre of the pulley.
    normal_force, friction : (n,), N
        On the belt; friction is positive counter-clockwise about the pulley.
    sticks : (n,) of bool
        False without friction.
    """

    place: Any
    lines: list[Any]
    normal: Any
    normal_force: Any
    friction: Any
    sticks: Any


class Belt(NamedTuple):
    """The belt at the last sample.

    Attributes
    ----------
    bodies : (n, 2), m
        Positions.
    pieces : list of (k, 2), m
        The line from body k - 1 to body k, for each k.
    halves : list of (k, 2), m
        The line of each body, from joint to joint.
    pitch : float, m
        Between bodies.
    tension : (n,), N
        Of the pieces.
    colours : ScalarMappable
    path : Path or None
        The line of a guided string.
    """

    bodies: Any
    pieces: list[Any]
    halves: list[Any]
    pitch: float
    tension: Any
    colours: ScalarMappable
    path: "Path | None"


def belt_of(result: "Record") -> Belt:
    """Return the belt of a result at its last sample."""
    bodies = np.column_stack([result.channels["x"][-1], result.channels["y"][-1]])
    tension = result.channels["tension"][-1]
    scale = Normalize(float(np.min(tension)), float(np.max(tension)))
    before = np.roll(bodies, 1, axis=0)
    pitch = float(np.median(np.hypot(*(bodies - before).T)))
    path = guiding_path(result, -1)
    if path is None:
        joints = 0.5 * (bodies + before)
        pieces = list(np.stack([before, bodies], axis=1))
        halves = list(np.stack([joints, bodies, np.roll(joints, -1, axis=0)], axis=1))
    else:
        places = places_on(path, bodies)
        steps = (places - np.roll(places, 1)) % path.length
        ends = zip(places - steps, places, strict=True)
        pieces = [line_between(path, start, stop) for start, stop in ends]
        first, last = _extents(path, places)
        halves = [line_between(path, *of) for of in zip(first, last, strict=True)]
    return Belt(
        bodies, pieces, halves, pitch, tension, ScalarMappable(scale, TENSION_COLOURS), path
    )


def _extents(path: "Path", places: Any) -> tuple[Any, Any]:
    """Return where the part of the string of each point begins and ends, m."""
    first = middles_on(path, places)
    return first, first + (np.roll(first, -1) - first) % path.length


def contact_arc(
    result: "Record", number: int, pulley: "Pulley", belt: Belt, has_friction: bool
) -> ContactArc:
    """Return what touches a pulley, by its number."""
    channels = result.channels
    on = np.flatnonzero(channels["pulley_index"][-1] == number)
    place, lines = belt.bodies[on], [belt.halves[k] for k in on]
    if belt.path is not None and on.size:
        place, lines = _on_arc(belt.path, belt.bodies, on, arc_of(belt.path, number))
    away = place - (pulley.x, pulley.y)
    none = np.zeros(len(place))
    return ContactArc(
        place,
        lines,
        away / np.maximum(np.hypot(*away.T), np.finfo(float).tiny)[:, None],
        channels["normal_force"][-1][on],
        channels["friction_force"][-1][on] if has_friction else none,
        (channels["sticking"][-1][on] if has_friction else none) > 0,
    )


def _on_arc(path: "Path", bodies: Any, on: Any, arc: tuple[float, float]) -> tuple[Any, list[Any]]:
    """Return the middles of what points of a string have on an arc, and the lines of it."""
    first, last = (ends[on] for ends in _extents(path, places_on(path, bodies)))
    middle = 0.5 * (first + last)
    turns = np.round((0.5 * sum(arc) - middle) / path.length) * path.length
    start, stop = (np.clip(ends + turns, *arc) for ends in (first, last))
    lines = [line_between(path, *ends) for ends in zip(start, stop, strict=True)]
    return path.at(0.5 * (start + stop) % path.length).position, lines


class BeltPatch(NamedTuple):
    """The part of a belt with a friction of its own: its line (n, 2), m, and what it is."""

    line: Any
    words: str


def patch_of(result: "Record", belt: Belt) -> BeltPatch | None:
    """Return the patch of the scenario, where its bodies are; None if it has none."""
    try:
        table = scenario_of(result).get("effects", {}).get("patch")
        rigidity = float(scenario_value(result, "mechanism", "belt", "axial_rigidity"))
    except InputError:
        return None
    if table is None:
        return None
    # The patch lies by the unstretched length, which is the same at any time.
    steps = np.hypot(*(belt.bodies - np.roll(belt.bodies, 1, axis=0)).T)
    if belt.path is not None:
        places = places_on(belt.path, belt.bodies)
        steps = (places - np.roll(places, 1)) % belt.path.length
    length = float(np.median(steps / (1.0 + belt.tension / rigidity)))
    centres = (np.arange(len(belt.bodies)) + 0.5) * length
    within = np.flatnonzero((centres >= table["from"]) & (centres < table["to"]))
    if not within.size:
        return None
    coefficients = [
        f"{name} = {table[name]:g}"
        for name in ("mu_s", "mu_k")
        if isinstance(table.get(name), int | float)
    ]
    return BeltPatch(
        np.concatenate([belt.halves[k] for k in within]),
        ": ".join(["patch", ", ".join(coefficients)]) if coefficients else "patch",
    )
