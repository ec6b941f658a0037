"""A torque in a drawing: an arc with a head, as long as the torque is large.

It begins below the axis and goes the way the torque turns: to the right where it is positive,
counter-clockwise.
"""

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.motion.parts import Arrow, Band, Part

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array

LARGEST = 0.75 * pi  # rad: of the arc of the largest torque
HEAD = 0.22  # of the radius: the straight arrow at its end
POINTS = 25


def torque_arc(
    name: str, torque: "Array", radius: float, largest: float | None = None
) -> list[Part]:
    """Return a torque about the origin; nothing if it is zero throughout.

    Parameters
    ----------
    name : str
    torque : (frames,), N m
    radius : float, m
        Of the arc.
    largest : float, N m, optional
        The torque of the longest arc; by default the largest of this torque.
    """
    own = float(np.abs(torque).max(initial=0.0))
    if own == 0.0:
        return []
    turn = LARGEST * torque / (own if largest is None else largest)
    angle = -0.5 * pi + np.linspace(0.0, 1.0, POINTS) * turn[:, None]
    end = angle[:, -1]
    # The head shrinks with the arc where the arc is shorter than it.
    length = radius * np.clip(turn, -HEAD, HEAD)
    tip_x, tip_y = radius * np.cos(end), radius * np.sin(end)
    dx, dy = -length * np.sin(end), length * np.cos(end)
    line = Band("", radius * np.cos(angle), radius * np.sin(angle), closed=False, role="force")
    return [line, Arrow(name, tip_x, tip_y, dx, dy, "force")]
