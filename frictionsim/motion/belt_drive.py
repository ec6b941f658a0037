"""A belt drive in motion: the belt coloured by its tension, stick and slip, and its forces as bars.

A frame is a sample, with the positions of the file. Of a fine belt every second, third, ... body is
drawn, and of a long run fewer samples. What is lost is then what happens between them: waves that
are shorter than a few bodies, vibrations that are faster than a few samples.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.belt import patch_of_bodies
from frictionsim.mechanisms.belt_drive.geometry import Path, PulleyCircle
from frictionsim.motion.parts import Arrow, Body, Detail, Line, Motion, Part, Readout
from frictionsim.motion.samples import MAX_FRAMES, REFUSED, Samples, scenario_in
from frictionsim.motion.shapes import bounds_around, scale_of, wheel

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.motion.parts import Array, Bounds, Integers
    from frictionsim.results import Record

    Floats = npt.NDArray[np.float64]

PIECES = 5  # from one body of a guided string to the next, so that an arc looks like one
MAX_POINTS, MAX_VALUES, MIN_FRAMES = 300, 60_000, 2  # of a belt; of all its frames together
MARKS = 25  # approximate number of marks on the belt
BAR, GAP = 0.6, 0.11  # radii of the smallest pulley: the longest bar; from the belt to the bars
MAX_DETAILS, SMALL, WINDOW = 4, 0.1, 1.8  # pulleys shown larger; radius of one that needs it; view
MAX_SPEEDS = 6  # pulleys whose speed stands beside the drawing


def motion(record: "Record", sample: int | None = None) -> Motion:
    """Return the motion of a result, or of one of its samples.

    Without the tension the belt has one colour, without angles the pulleys have no marks, without
    the flags of contact neither arcs nor forces are drawn.
    """
    for name in "xy":
        Samples(record, sample, MIN_FRAMES)[name]
    bodies, scenario = record.channels["x"].shape[1], scenario_in(record)
    stride = -(-bodies // MAX_POINTS)
    path = scenario.mechanism.path() if stride == 1 and scenario.guided else None
    pieces, drawn = PIECES if path is not None else 1, np.arange(0, bodies, stride)
    count = MAX_VALUES // (pieces * len(drawn))
    at = Samples(record, sample, max(MIN_FRAMES, min(MAX_FRAMES, count)))
    pulleys = scenario.mechanism.circles
    points = np.stack([at[axis][:, drawn] for axis in "xy"], axis=-1)
    touched = at["pulley_index"][:, drawn].astype(int) if "pulley_index" in at else None
    tension = at["tension"][:, drawn] if "tension" in at else None
    stuck = None
    if touched is not None and "sticking" in at:
        stuck = np.where(touched >= 0, at["sticking"][:, drawn] > 0, -1).astype(np.int64)
    patch = None
    if scenario.effects.patches:
        patch = patch_of_bodies(scenario, body_length_of(scenario))[drawn] >= 0
    length = float(np.hypot(*(points[0] - np.roll(points[0], 1, axis=0)).T).sum())
    belt = Line(
        "belt",
        points,
        "cord",
        closed=True,
        value=tension,
        quantity="tension",
        unit="N",
        stuck=stuck,
        patch=patch,
        spacing=length / min(MARKS, len(drawn)),
    )
    if path is not None:
        belt = _along(path, belt)
    bars = [] if touched is None else _bars(at, points, touched, drawn, pulleys)
    corners = [points.reshape(-1, 2)]
    for pulley in pulleys:
        centre = np.array([pulley.center])
        corners += [centre - pulley.radius, centre + pulley.radius]
    size = float(np.ptp(np.concatenate(corners), axis=0).max())
    smallest = min(pulley.radius for pulley in pulleys)
    bounds = bounds_around(np.concatenate(corners), 0.02 * size + (BAR + GAP) * smallest)
    parts: tuple[Part, ...] = (*_wheels(at, pulleys), belt, *bars)
    scale, details = scale_of(bars, BAR * smallest), _details(pulleys, bounds)
    return Motion(at.time, parts, bounds, scale, _readouts(at, tension), details)


def _along(path: Path, belt: Line) -> Line:
    """Return a guided string with points on spans and arcs between its bodies.

    Each body comes after the points between it and the one before. Of those the points on an arc
    are as the body ahead if that touches a pulley, else as the one behind.
    """
    frames, count = belt.points.shape[:2]
    flat = belt.points.reshape(-1, 2).astype(np.float64)
    bodies = places_on(path, flat).reshape(frames, count)
    ahead = (bodies - np.roll(bodies, 1, axis=1)) % path.length
    left = 1.0 - np.arange(1, PIECES + 1) / PIECES
    places = (bodies[:, :, None] - ahead[:, :, None] * left).reshape(frames, -1) % path.length
    stuck = belt.stuck
    if stuck is not None:
        on_arc = np.zeros(places.shape, dtype=bool)
        for start, stop in path.arc_ends.T:
            on_arc |= (places - start) % path.length <= stop - start
        between = np.where(stuck >= 0, stuck, np.roll(stuck, 1, axis=1))
        along = np.where(on_arc, np.repeat(between, PIECES, axis=1), -1)
        along[:, PIECES - 1 :: PIECES] = stuck
        stuck = along

    def repeated(values: Any) -> Any:
        return None if values is None else np.repeat(values, PIECES, axis=-1)

    position = path.at(places.ravel()).position.reshape(*places.shape, 2)
    value, patch = repeated(belt.value), repeated(belt.patch)
    return belt._replace(points=position, value=value, stuck=stuck, patch=patch)


def _bars(
    at: Samples, points: "Array", touched: "Integers", drawn: Any, pulleys: "list[PulleyCircle]"
) -> list[Arrow]:
    """Return the normal forces outward of the belt, and the friction on it, by its way, inward."""
    if "normal_force" not in at or touched.max(initial=-1) >= len(pulleys):
        return []
    centres = np.array([pulley.center for pulley in pulleys])
    away = points - centres[touched]
    away /= np.maximum(np.linalg.norm(away, axis=-1), np.finfo(float).tiny)[..., None]
    gap = GAP * min(pulley.radius for pulley in pulleys)
    sizes = [("normal force on the belt", at["normal_force"][:, drawn], "force", 1.0)]
    if "friction_force" in at:
        friction = at["friction_force"][:, drawn]
        ways = (("counter-clockwise", friction, "friction"), ("clockwise", -friction, "load"))
        sizes += [(f"friction on the belt, {way}", size, role, -1.0) for way, size, role in ways]
    return [
        Arrow(
            name,
            points + side * gap * away,
            side * np.where(touched >= 0, np.maximum(size, 0.0), 0.0)[..., None] * away,
            role,  # type: ignore[arg-type]
        )
        for name, size, role, side in sizes
    ]


def _wheels(at: Samples, pulleys: "list[PulleyCircle]") -> list[Body]:
    angles = at.get("pulley_angle")
    if angles is not None and angles.shape[1] != len(pulleys):
        raise InputError(
            f"{REFUSED}: it has angles of {angles.shape[1]} pulleys, its scenario has"
            f" {len(pulleys)}"
        )
    return [
        Body(
            name,
            wheel(radius) if angles is not None else wheel(radius)[:1],
            at.still + x,
            at.still + y,
            at.still if angles is None else angles[:, i],
            label=True,
        )
        for i, (name, (x, y), radius, _) in enumerate(pulleys)
    ]


def _details(pulleys: "list[PulleyCircle]", bounds: "Bounds") -> tuple[Detail, ...]:
    """Return a view of each pulley if they are small in the whole drawing."""
    if max(pulley.radius for pulley in pulleys) > SMALL * (bounds[1] - bounds[0]):
        return ()
    return tuple(
        Detail(name, (x - WINDOW * r, x + WINDOW * r, y - WINDOW * r, y + WINDOW * r))
        for name, (x, y), r, _ in pulleys[:MAX_DETAILS]
    )


def _readouts(at: Samples, tension: "Array | None") -> tuple[Readout, ...]:
    """Return the speeds of the pulleys, and the extremes of the tension in the points drawn."""
    readouts = []
    if "pulley_speed" in at:
        speeds, unit = at["pulley_speed"], at.record.units["pulley_speed"]
        names = at.record.members[at.record.axes["pulley_speed"]][:MAX_SPEEDS]
        readouts = [Readout(f"speed of {name}", unit, speeds[:, i]) for i, name in enumerate(names)]
    if tension is not None:
        unit = at.record.units["tension"]
        readouts.append(Readout("largest tension", unit, tension.max(axis=1)))
        readouts.append(Readout("smallest tension", unit, tension.min(axis=1)))
    return tuple(readouts)


# The line of a belt.


def places_on(path: Path, points: "Floats") -> "Floats":
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


def body_length_of(scenario: "BeltDriveScenario") -> float:
    """Return the unstretched length of a body, m."""
    from frictionsim.mechanisms.belt_drive.equilibrium import at_rest  # slow: SciPy

    return at_rest(scenario).body_length


def wear_of(record: "Record", sample: int = -1) -> tuple["Floats", "Floats"]:
    """Return the ends of the bodies along the unstretched belt, m, and their work of friction, J/m.

    The work is that from the start until a sample.
    """
    length = body_length_of(scenario_in(record))
    work = np.asarray(record.channels["friction_work"][sample]) / length
    return np.linspace(0.0, length * len(work), len(work) + 1), work
