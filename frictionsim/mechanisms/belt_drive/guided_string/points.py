"""How many points a guided string needs to follow its line."""

from math import ceil
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from frictionsim.mechanisms.belt_drive.geometry import Path

ENOUGH = 4  # times as many as are needed: quantities depend little on their number then

ROUNDING = 1e-12  # of the belt's length: what is shorter is lost in the sums of lengths


def missing_points(
    path: "Path", names: "Sequence[str]", driven: "Collection[str]", points: int
) -> str | None:
    """Return why a guided belt of so many points cannot follow its line; None if it can.

    A point stands for the belt half way to its neighbours. None is to be on two pulleys at once:
    no span is shorter than their distance. The arcs of pulleys in `driven`, which carry a load,
    have a point at least.
    """
    length, what = min(_pieces(path, names, driven))
    if length <= path.length * ROUNDING:
        return (
            f"no number of bodies is enough for {what}, which is too short ({length:.3g} m) beside"
            f" the belt's {path.length:.3g} m; change the centers and radii of the pulleys"
        )
    needed = ceil(path.length / length)
    if points >= needed:
        return None
    return (
        f"{points} bodies, {path.length / points:.3g} m apart, are too few for {what},"
        f" {length:.3g} m: a belt without effects.contact needs at least {needed} here, and about"
        f" {ENOUGH * needed} for quantities that depend little on their number"
    )


def _pieces(
    path: "Path", names: "Sequence[str]", driven: "Collection[str]"
) -> list[tuple[float, str]]:
    """Return the lengths of spans, m, and of arcs that carry a load, with what they are."""
    lengths, found = np.diff(path.breakpoints), []
    for j, name in enumerate(names):
        after = names[(j + 1) % len(names)]
        found.append((float(lengths[2 * j]), f"the span from '{name}' to '{after}'"))
        if after in driven:
            found.append((float(lengths[2 * j + 1]), f"the arc on '{after}'"))
    return found
