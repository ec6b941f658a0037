"""A belt drive in motion: the belt coloured by its tension, stick and slip on its pulleys.

A frame is a sample, with the positions of the file, rounded to what a drawing can show. Of a fine
belt every second, third, ... body is drawn, and of a long run fewer samples, so that a drawing has
`MAX_VALUES` positions at most. What is lost is then what happens between them: waves that are
shorter than a few bodies, vibrations that are faster than a few samples.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.motion.belt_path import (
    arc_of,
    drawn_pulleys,
    guiding_path,
    patch_members,
    places_on,
)
from frictionsim.motion.frames import (
    MAX_FRAMES,
    channel_at,
    frames_of,
    required,
    rounded,
)
from frictionsim.motion.parts import Band, Body, Detail, Motion, Part, Readout
from frictionsim.motion.shapes import bounds_around, wheel

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.motion.parts import Array, Bools, Bounds, Numbers
    from frictionsim.results import Record

PIECES = 5  # from one body to the next, so that an arc looks like one


class Points(NamedTuple):
    """Points along a string: each body comes after the points between it and the one before.

    Attributes
    ----------
    x, y : (frames, n * PIECES), m
    on_arc : (frames, n * PIECES) of bool
        They are where the line touches a pulley.
    """

    x: "Array"
    y: "Array"
    on_arc: "Bools"


def points_along(path: "Path", x: "Array", y: "Array") -> Points:
    """Return points along the line of a string.

    Parameters
    ----------
    x, y : (frames, n), m
        Of the bodies, which are on the line.
    """
    bodies = places_on(path, np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    ahead = (bodies - np.roll(bodies, 1, axis=1)) % path.length
    left = 1.0 - np.arange(1, PIECES + 1) / PIECES
    places = (bodies[:, :, None] - ahead[:, :, None] * left).reshape(len(x), -1) % path.length
    position = path.at(places.ravel()).position.reshape(*places.shape, 2)
    on_arc = np.zeros(places.shape, dtype=bool)
    for number in range(len(path.arcs)):
        start, stop = arc_of(path, number)
        on_arc |= (places - start) % path.length <= stop - start
    return Points(position[..., 0], position[..., 1], on_arc)


def flags_along(
    touching: "Bools", sticking: "Bools | None", on_arc: "Bools"
) -> tuple["Bools", "Bools | None"]:
    """Return flags of the points that touch a pulley, and of those that stick.

    Between two bodies these are the points on an arc if one of the bodies is on it: as the body
    ahead if that touches, else as the body behind.

    Parameters
    ----------
    touching : (frames, n) of bool
        Of the bodies.
    sticking : (frames, n) of bool, or None
    on_arc : (frames, n * PIECES) of bool
    """

    def along(bodies: "Bools", between: "Bools") -> "Bools":
        flags = np.repeat(between, PIECES, axis=1) & on_arc
        flags[:, PIECES - 1 :: PIECES] = bodies
        return flags

    behind = np.roll(touching, 1, axis=1)
    touches = along(touching, touching | behind)
    if sticking is None:
        return touches, None
    held = np.where(touching, sticking, np.roll(sticking, 1, axis=1))
    return touches, along(sticking, held) & touches


MAX_POINTS, MAX_VALUES = 300, 90_000  # of a belt; of all its frames together
MIN_FRAMES = 2
STEPS, COLOURS = 40_000.0, 250.0  # distinguishable in a drawing, and in a scale of colours
MARKS = 25  # approximate number of marked points of the belt
MAX_DETAILS, SMALL, WINDOW = 4, 0.1, 1.5  # pulleys shown larger; radius of one that needs it; view
MAX_SPEEDS = 6  # pulleys whose speed stands beside the drawing


def motion(result: "Record") -> Motion:
    """Return the motion of a result.

    Without the tension the belt has one colour, without angles the pulleys have no marks, without
    the flags of contact the arcs are not marked.
    """
    bodies = required(result, "x").shape[1]
    stride = -(-bodies // MAX_POINTS)
    drawn = np.arange(0, bodies, stride)
    required(result, "y")
    path = guiding_path(result, -1) if stride == 1 and result.channels["time"].size else None
    pieces = PIECES if path is not None else 1
    count = MAX_VALUES // (pieces * len(drawn))
    frames = frames_of(result, max(MIN_FRAMES, min(MAX_FRAMES, count)))
    time = channel_at(result, "time", frames)
    x, y = (channel_at(result, axis, frames)[:, drawn] for axis in "xy")
    wheels = _wheels(result, frames)
    bounds = _bounds(result, x, y)
    size = max(bounds[1] - bounds[0], bounds[3] - bounds[2])
    tension = None
    if "tension" in result.channels:
        tension = channel_at(result, "tension", frames)[:, drawn]
    touching, sticking = _contact(result, frames, drawn)
    patch = patch_members(result)
    band = Band(
        "belt",
        rounded(x, size, STEPS),
        rounded(y, size, STEPS),
        closed=True,
        value=None if tension is None else rounded(tension, float(np.ptp(tension)), COLOURS),
        quantity="tension",
        unit="N",
        touching=touching,
        sticking=sticking,
        marks=np.arange(0, len(drawn), max(1, round(len(drawn) / MARKS))),
        patch=None if patch is None else patch[drawn],
    )
    if path is not None:
        band = _along_line(band, points_along(path, x, y), size)
    parts: tuple[Part, ...] = (*wheels, band)
    details = _details(result, bounds)
    return Motion(time, parts, bounds, None, _readouts(result, frames, tension), details)


def _wheels(result: "Record", frames: "Numbers") -> list[Body]:
    pulleys = drawn_pulleys(result)
    angles = None
    if "pulley_angle" in result.channels:
        angles = channel_at(result, "pulley_angle", frames)
        if angles.shape[1] != len(pulleys):
            raise InputError(
                f"cannot show this result in motion: it has angles of {angles.shape[1]} pulleys,"
                f" its scenario has {len(pulleys)}"
            )
    still = np.zeros(len(frames))
    return [
        Body(
            name,
            wheel(radius) if angles is not None else wheel(radius)[:1],
            still + x,
            still + y,
            still if angles is None else angles[:, i],
            label=True,
        )
        for i, (name, x, y, radius) in enumerate(pulleys)
    ]


def _along_line(band: Band, points: Points, size: float) -> Band:
    """Return the band of a guided string, which follows spans and arcs between its bodies."""

    def repeated(values: Any) -> Any:
        return None if values is None else np.repeat(values, PIECES, axis=-1)

    touching = sticking = None
    if band.touching is not None:
        touching, sticking = flags_along(band.touching, band.sticking, points.on_arc)
    return band._replace(
        x=rounded(points.x, size, STEPS),
        y=rounded(points.y, size, STEPS),
        value=repeated(band.value),
        touching=touching,
        sticking=sticking,
        marks=None if band.marks is None else (band.marks + 1) * PIECES - 1,
        patch=repeated(band.patch),
    )


def _contact(
    result: "Record", frames: "Numbers", drawn: "Numbers"
) -> tuple["Bools | None", "Bools | None"]:
    """Return flags of the points that touch a pulley and that stick; None where not recorded."""
    if "pulley_index" not in result.channels:
        return None, None
    touching = channel_at(result, "pulley_index", frames)[:, drawn] >= 0
    if "sticking" not in result.channels:
        return touching, None
    return touching, (channel_at(result, "sticking", frames)[:, drawn] > 0) & touching


def _bounds(result: "Record", x: Any, y: Any) -> "Bounds":
    """Return the bounds of belt and pulleys at all frames."""
    points = [np.column_stack([x.ravel(), y.ravel()])]
    for _, *centre, radius in drawn_pulleys(result):
        points += [np.array([centre]) - radius, np.array([centre]) + radius]
    corners = np.concatenate(points)
    return bounds_around(corners, 0.03 * float(np.ptp(corners, axis=0).max()))


def _details(result: "Record", bounds: "Bounds") -> tuple[Detail, ...]:
    """Return a view of each pulley if they are small in the whole drawing."""
    pulleys, width = drawn_pulleys(result), bounds[1] - bounds[0]
    if max(radius for *_, radius in pulleys) > SMALL * width:
        return ()
    return tuple(
        Detail(name, (x - WINDOW * r, x + WINDOW * r, y - WINDOW * r, y + WINDOW * r))
        for name, x, y, r in pulleys[:MAX_DETAILS]
    )


def _readouts(result: "Record", frames: "Numbers", tension: "Array | None") -> tuple[Readout, ...]:
    """Return the speeds of the pulleys, and the extremes of the tension in the points drawn."""
    readouts = []
    if "pulley_speed" in result.channels:
        channel = "pulley_speed"
        members = result.members[result.axes[channel]][:MAX_SPEEDS]
        speeds = channel_at(result, channel, frames)
        for i, name in enumerate(members):
            readouts.append(
                Readout(f"speed of {name}", result.units[channel], speeds[:, i], channel, name)
            )
    if tension is not None:
        unit = result.units["tension"]
        readouts.append(Readout("largest tension", unit, tension.max(axis=1)))
        readouts.append(Readout("smallest tension", unit, tension.min(axis=1)))
    return tuple(readouts)
