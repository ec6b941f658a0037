"""Which way a belt and its pulleys move: arrows on the spans, and inside the pulleys."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import senses_of
from frictionsim.motion.belt_path import path_of
from frictionsim.plots.belt_slip import recorded_speed_at_rest
from frictionsim.plots.style import BLACK

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.plots.belt_geometry import Pulley
    from frictionsim.plots.belt_shape import Belt
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

AT = 0.3  # radii, from the centre of a pulley to the arrow of its motion
HALF = np.radians(60.0)  # half the angle of that arrow, which is below the centre
MIN_SHARE = 1e-6  # of the largest speed in the run: slower is at rest
POINTS = 3  # of a triangle


def speeds_of(result: "Record", pulleys: "list[Pulley]") -> "Array":
    """Return the speed of each rim at the last sample, m/s; 0 at rest or if not recorded."""
    if "pulley_speed" not in result.channels:
        return np.zeros(len(pulleys))
    rims = result.channels["pulley_speed"] * np.array([p.radius for p in pulleys])
    at_rest = max(recorded_speed_at_rest(result), MIN_SHARE * float(np.max(np.abs(rims))))
    return np.where(np.abs(rims[-1]) > at_rest, rims[-1], 0.0)


def draw_belt_motion(ax: Any, result: "Record", belt: "Belt", rims: "Array") -> None:
    """Draw a triangle on each span that points where the belt moves; none if it is at rest.

    Parameters
    ----------
    ax : Axes
    result : Record
    belt : Belt
    rims : (pulleys,), m/s
        Of `speeds_of`.
    """
    try:
        path = path_of(result)
    except InputError:
        path = None
    if path is None:
        return
    along = float(np.mean(rims * senses_of(path)))
    if along == 0.0:
        return
    for span in path.spans:
        start, stop = np.array(span.start), np.array(span.end)
        middle = 0.5 * (start + stop)
        place = belt.bodies[np.argmin(np.hypot(*(belt.bodies - middle).T))]
        ahead = np.sign(along) * (stop - start)
        turned = float(np.degrees(np.arctan2(ahead[1], ahead[0]))) - 90.0  # it points upwards
        style = {"markersize": 11, "mfc": "white", "mec": BLACK, "mew": 1.2, "zorder": 7}
        ax.plot(*place, marker=(POINTS, 0, turned), linestyle="", **style)


def draw_rotation(ax: Any, pulley: "Pulley", rim: float) -> None:
    """Draw a curved arrow inside a pulley the way it turns; none at rest.

    Parameters
    ----------
    ax : Axes
    pulley : Pulley
    rim : float, m/s
        Positive counter-clockwise.
    """
    if rim == 0.0:
        return
    sign, centre = np.sign(rim), np.array([pulley.x, pulley.y])
    tail, tip = (
        centre + AT * pulley.radius * np.array([np.sin(turn), -np.cos(turn)])
        for turn in (-sign * HALF, sign * HALF)
    )
    bend = {"arrowstyle": "-|>", "connectionstyle": f"arc3,rad={sign * np.tan(0.5 * HALF):.4f}"}
    arrow = bend | {"color": BLACK, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", tuple(tip), tuple(tail), arrowprops=arrow)
