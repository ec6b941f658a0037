"""A pulley on a dry shaft in motion, with its cord, its load and its forces.

The load hangs on the right and rises where the pulley turns counter-clockwise; the force pulls the
cord down on the left, or to the left from the top. Radii are true to scale, those of shaft and
friction circles as well. The reaction of the shaft is drawn where it acts: at the distance
`friction_torque / reaction` from the axis, so that it touches the kinetic friction circle while the
pulley slips, and stays within the static one while it sticks.
"""

from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.motion.event_frames import (
    Frames,
    frames_with_events,
    readouts_at,
    state_at,
    values_at,
)
from frictionsim.motion.frames import required
from frictionsim.motion.parts import Arrow, Band, Body, Motion, Part, Readout
from frictionsim.motion.pulley_parts import (
    ARC_OF_TORQUE,
    ARROW,
    BLOCK,
    HIGHEST,
    reaction_arrow,
    shaft_parts,
)
from frictionsim.motion.shapes import arc, around, block, wheel
from frictionsim.motion.torque_arc import torque_arc
from frictionsim.scenario.recorded import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array
    from frictionsim.results import Record

# In radii of the pulley.
TRAVEL = 2.5  # of the load: the longest way of it that is drawn
CORD_MARK = 0.5  # between marks on the cord


class _Cord(NamedTuple):
    """Where load and pulled end are, (frames,) in m.

    Attributes
    ----------
    height : y of the load's upper edge, at most `HIGHEST` radii below the axis.
    cut : of bool, where the load is beyond the picture.
    pulled : how far the pulled end is from the wheel.
    """

    height: "Array"
    cut: Any
    pulled: "Array"


def motion(result: "Record") -> Motion:
    """Return the motion of a result.

    Raises
    ------
    InputError
        If it lacks samples, the channel of the angle, or keys.
    """
    if "hanging_masses" in scenario_of(result).get("effects", {}):
        from frictionsim.motion.pulley_with_masses import motion as with_masses

        return with_masses(result)
    frames = frames_with_events(result)
    time = values_at(result, "time", frames)
    radius = float(scenario_value(result, "mechanism", "cord_radius"))
    horizontal = scenario_of(result).get("drive", {}).get("direction") == "horizontal"
    angle = values_at(result, "angle", frames)
    travel = radius * (angle - float(required(result, "angle")[0]))
    cord = _cord(travel, radius)
    still = np.zeros_like(time)
    parts: list[Part] = [
        _line(cord, travel, radius, horizontal),
        Body("pulley", wheel(radius, hub=0.0), still, still, angle),
        *shaft_parts(result, radius, still),
        *_loads(cord, radius, still),
        *_forces(result, frames, cord, radius, horizontal),
    ]
    state = state_at(result, frames)
    readouts = (
        *readouts_at(result, {"angle": "angle", "angular_velocity": "angular velocity"}, frames),
        Readout("travel of the load", "m", travel),
        *readouts_at(
            result,
            {
                "drive_force": "drive force",
                "drive_torque": "drive torque",
                "friction_torque": "friction torque",
            },
            frames,
        ),
    )
    return Motion(time, tuple(parts), _bounds(parts, radius), state, readouts)


def _cord(travel: "Array", radius: float) -> _Cord:
    """Return where load and pulled end are; beyond `TRAVEL` radii of travel the load is cut."""
    low, high = min(float(travel.min()), 0.0), max(float(travel.max()), 0.0)
    way = min(high - low, TRAVEL * radius)
    # What is cut off is shared between its rise and its fall, so that it starts in the picture.
    start = -HIGHEST * radius - way * (high / (high - low) if high > low else 0.0)
    lowest, highest = -HIGHEST * radius - way, -HIGHEST * radius
    height = start + travel
    cut = (height > highest + 1e-9 * radius) | (height < lowest - 1e-9 * radius)
    shown = np.clip(height, lowest, highest)
    return _Cord(shown, cut, HIGHEST * radius + shown - lowest)


def _line(cord: _Cord, travel: "Array", radius: float, horizontal: bool) -> Band:
    """Return the cord from the load over the wheel to its pulled end."""
    over = arc(radius, 0.0, 0.5 * pi if horizontal else pi)
    x, y = (np.tile(values, (len(travel), 1)) for values in over.T)
    end = (-cord.pulled, radius) if horizontal else (-radius, -cord.pulled)
    ends = [np.broadcast_to(np.asarray(value)[..., None], (len(travel), 1)) for value in end]
    first = np.full((len(travel), 1), radius), cord.height[:, None]
    # The marks run from the load to the pulled end, relative to the load: they are laid from it.
    return Band(
        "cord",
        np.concatenate([first[0], x, ends[0]], axis=1),
        np.concatenate([first[1], y, ends[1]], axis=1),
        closed=False,
        travel=travel - (cord.height - cord.height[0]),
        spacing=CORD_MARK * radius,
    )


def _loads(cord: _Cord, radius: float, still: "Array") -> list[Part]:
    x, side = still + radius, BLOCK * radius
    load = Body("load", (block(side, side, "load"),), x, cord.height, still, ~cord.cut)
    if not cord.cut.any():
        return [load]
    outline = (block(side, side, "cut"),)
    return [load, Body("load, beyond the picture", outline, x, cord.height, still, cord.cut)]


def _forces(
    result: "Record", frames: Frames, cord: _Cord, radius: float, horizontal: bool
) -> list[Part]:
    """Return drive force, weight and reaction of the shaft, as long as they are large."""
    weight = float(scenario_value(result, "mechanism", "load"))
    zero = np.zeros_like(frames.time)
    x, y = zero + radius, cord.height - BLOCK * radius
    if "drive_torque" in result.channels:
        return _with_torque(result, frames, (x, y), weight, radius)
    if "drive_force" not in result.channels:
        return [Arrow("weight of the load", x, y, zero, zero - 0.5 * ARROW * radius, "load")]
    force = values_at(result, "drive_force", frames)
    reaction = np.hypot(force, weight) if horizontal else force + weight
    largest = max(weight, float(np.abs(force).max()), float(np.abs(reaction).max()))
    scale = ARROW * radius / largest if largest > 0.0 else 0.0
    parts: list[Part] = [Arrow("weight of the load", x, y, zero, zero - scale * weight, "load")]
    pull = -scale * force
    if horizontal:
        parts.append(Arrow("drive force", -cord.pulled, zero + radius, pull, zero, "force"))
    else:
        parts.append(Arrow("drive force", zero - radius, -cord.pulled, zero, pull, "force"))
    if "friction_torque" in result.channels:
        torque = values_at(result, "friction_torque", frames)
        if horizontal:
            parts.append(reaction_arrow(force, np.full_like(force, weight), torque, scale))
        else:
            parts.append(reaction_arrow(zero, force + weight, torque, scale))
    return parts


def _with_torque(
    result: "Record", frames: Frames, foot: "tuple[Array, Array]", weight: float, radius: float
) -> list[Part]:
    """Return weight, torque of the drive and reaction of a pulley that a torque turns."""
    zero = np.zeros_like(frames.time)
    scale = ARROW * radius / weight if weight > 0.0 else 0.0
    parts: list[Part] = [Arrow("weight of the load", *foot, zero, zero - scale * weight, "load")]
    drive = values_at(result, "drive_torque", frames)
    parts += torque_arc("torque of the drive", drive, ARC_OF_TORQUE * radius)
    if "friction_torque" in result.channels:
        torque = values_at(result, "friction_torque", frames)
        parts.append(reaction_arrow(zero, zero + weight, torque, scale))
    return parts


def _bounds(parts: list[Part], radius: float) -> tuple[float, float, float, float]:
    """Return the bounds of wheel, cord, load and arrows at all times, with a margin."""
    points = [np.array([[-radius, -radius], [radius, radius]])]
    for part in parts:
        if isinstance(part, Arrow):
            points.append(np.column_stack([part.x, part.y]))
            points.append(np.column_stack([part.x + part.dx, part.y + part.dy]))
        elif isinstance(part, Body) and part.name.startswith("load"):
            side = BLOCK * radius
            points.append(np.column_stack([part.x - 0.5 * side, part.y - side]))
            points.append(np.column_stack([part.x + 0.5 * side, part.y]))
        elif isinstance(part, Band):
            points.append(np.column_stack([part.x.ravel(), part.y.ravel()]))
    return around(np.concatenate(points), 0.25 * radius)
