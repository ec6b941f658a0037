"""The points of a guided string between its bodies, along spans and arcs."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.motion.belt_path import arc_of, places_on

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.motion.parts import Array, Bools

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
    path : Path
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
    """Return which points touch a pulley, and which stick.

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
        found = np.repeat(between, PIECES, axis=1) & on_arc
        found[:, PIECES - 1 :: PIECES] = bodies
        return found

    behind = np.roll(touching, 1, axis=1)
    touches = along(touching, touching | behind)
    if sticking is None:
        return touches, None
    held = np.where(touching, sticking, np.roll(sticking, 1, axis=1))
    return touches, along(sticking, held) & touches
