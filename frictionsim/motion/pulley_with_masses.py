"""A pulley with masses on its cord in motion: car, counterweight, ropes, forces and slip.

The car hangs on the right and rises where the pulley turns counter-clockwise. The wheel, its shaft
and the friction circles are true to scale; the ways of the masses are drawn smaller where they are
longer than the picture allows, by a round number that is said. Marks run with the rope over the
wheel, and ticks turn with the rim: where they pass each other the rope slips. A slack rope is a bow
that is as long as the rope, until it is too wide.
"""

from math import floor, log10, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.journal_friction import friction_radius
from frictionsim.motion.event_frames import (
    Frames,
    frames_with_events,
    readouts_at,
    state_at,
    values_at,
)
from frictionsim.motion.parts import Arrow, Band, Body, Detail, Disc, Line, Motion, Part, Readout
from frictionsim.motion.poses import STATES
from frictionsim.motion.pulley_parts import (
    ARC_OF_TORQUE,
    ARROW,
    BLOCK,
    HIGHEST,
    reaction_arrow,
    shaft_parts,
)
from frictionsim.motion.shapes import arc, around, block, ray, wheel
from frictionsim.motion.torque_arc import torque_arc
from frictionsim.scenario.recorded import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array
    from frictionsim.results import Record

# In radii of the pulley.
MAX_WAY = 3.2  # of car or counterweight that is drawn
MAX_BOW = 0.9  # of a slack rope
WINDOW = 2.5  # of the radius of the static friction circle: what is shown larger
TICKS = 12  # around the rim, and as far apart the marks on the rope
BOW_POINTS = 25
CAR, COUNTERWEIGHT = 1, 2  # bits of the channel `slack`
SHOWN_FORCES: tuple[str, ...] = (
    *("rope_tension_car", "rope_tension_counterweight", "shaft_reaction"),
    *("drive_force", "drive_torque", "friction_torque"),
)
ROUNDOFF = 1e-9  # of a gap, in radii of the pulley
TAUT_OR_SLACK = {"0": "taut", "1": "slack"}


class Rope(NamedTuple):
    """A side of the rope and what hangs on it.

    Attributes
    ----------
    side : int
        1 right, -1 left.
    height : (frames,), m
        Of the upper edge of what hangs on it, relative to the axis.
    gap : (frames,), m
        How much longer the rope is than the way from the wheel; 0 taut.
    scale : float
        How much smaller ways are drawn than they are.
    """

    side: int
    height: "Array"
    gap: "Array"
    scale: float


def motion(result: "Record") -> Motion:
    """Return the motion of a result of a pulley with hanging masses.

    Raises
    ------
    InputError
        If it lacks samples, the channels of angle or heights, or keys.
    """
    frames = frames_with_events(result)
    radius = float(scenario_value(result, "mechanism", "cord_radius"))
    angle = values_at(result, "angle", frames)
    car = values_at(result, "car_position", frames)
    other = values_at(result, "counterweight_position", frames)
    rim = radius * (angle - _start_angle(result))
    slips = "cord_friction" in scenario_of(result).get("effects", {})
    rope = car if slips else rim
    scale = drawn_scale(max(float(np.ptp(car)), float(np.ptp(other))), radius)
    ropes = (
        _rope(1, car, _gap(car - rope, radius), scale, radius),
        _rope(-1, other, _gap(other + rope, radius), scale, radius),
    )
    still = np.zeros_like(frames.time)
    parts: list[Part] = [
        *_lines(ropes, rope + radius * _start_angle(result), radius),
        Body("pulley", _sheave(radius), still, still, angle),
        *shaft_parts(result, radius, still, enlarged=True),
        *_blocks(result, ropes, radius),
        *_forces(result, frames, ropes, radius),
    ]
    readouts = _readouts(result, frames, (ropes[0].gap, ropes[1].gap))
    details = _friction_circles(result)
    return Motion(frames.time, tuple(parts), _bounds(parts, radius), None, tuple(readouts), details)


def _friction_circles(result: "Record") -> tuple[Detail, ...]:
    """Return what is shown larger, if the scenario has friction of the shaft."""
    if "shaft_friction" not in scenario_of(result).get("effects", {}):
        return ()
    shaft, mu = (
        float(scenario_value(result, "effects", "shaft_friction", key))
        for key in ("shaft_radius", "mu_s")
    )
    reach = min(1.1 * shaft, WINDOW * friction_radius(shaft, mu))
    if reach <= 0.0:
        return ()
    return (Detail("friction circles of the shaft, enlarged", (-reach, reach, -reach, reach)),)


def _start_angle(result: "Record") -> float:
    mechanism = scenario_of(result).get("mechanism", {})
    return float(np.radians(mechanism.get("initial_angle_deg", 0.0)))


def drawn_scale(way: float, radius: float) -> float:
    """Return how much smaller a way is drawn: 1, or 2, 5 or 10 times a power of ten.

    Parameters
    ----------
    way, radius : float, m
        The longest way of car and counterweight; of the pulley.
    """
    needed = way / (MAX_WAY * radius)
    if needed <= 1.0:
        return 1.0
    power = 10.0 ** floor(log10(needed))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if needed <= step * power)


def _rope(side: int, position: "Array", gap: "Array", scale: float, radius: float) -> Rope:
    """Return a side whose mass is at its highest place in the picture where it is highest."""
    height = -HIGHEST * radius + (position - position.max()) / scale
    return Rope(side, height, gap, scale)


def _gap(difference: "Array", radius: float) -> "Array":
    """Return how much a rope is too long, m, without the roundoff of one that is taut."""
    return np.where(difference > ROUNDOFF * radius, difference, 0.0)


def _sheave(radius: float) -> tuple[Disc | Line, ...]:
    """Return the wheel with ticks at its rim."""
    turns = 2.0 * pi / TICKS * np.arange(TICKS)
    ticks = (ray(float(turn), 0.88 * radius, radius, "fixed") for turn in turns)
    return (*wheel(radius, hub=0.0), *ticks)


def _lines(ropes: tuple[Rope, Rope], run: "Array", radius: float) -> list[Part]:
    """Return the rope: over the wheel with marks that run so far, and its two hanging sides."""
    over = arc(radius, 0.0, pi)
    x, y = (np.tile(values, (len(run), 1)) for values in over.T)
    spacing = 2.0 * pi / TICKS * radius
    found: list[Part] = [Band("rope", x, y, closed=False, travel=run, spacing=spacing)]
    for rope in ropes:
        x, y = hanging(rope, radius)
        if rope.scale == 1.0:  # marks go on from the wheel down: half a turn is 6 spacings
            down = -rope.side * run
            found.append(Band("rope", x, y, closed=False, travel=down, spacing=spacing))
        else:
            found.append(Band("rope", x, y, closed=False))
    return found


def hanging(rope: Rope, radius: float) -> "tuple[Array, Array]":
    """Return a side of the rope from the wheel down, (frames, points), m.

    A slack rope bows outwards by a sin^2 that makes it longer by its gap.
    """
    down = np.linspace(0.0, 1.0, BOW_POINTS if rope.gap.any() else 2)
    length = -rope.height
    bow = np.minimum(length * _bow_of(rope.gap / rope.scale / length), MAX_BOW * radius)
    x = rope.side * (radius + bow[:, None] * np.sin(pi * down) ** 2)
    return x, -length[:, None] * down


def _bow_of(excess: "Array") -> "Array":
    """Return the height of a bow of length 1 + excess over a distance of 1, by a table."""
    bows = np.concatenate([[0.0], np.geomspace(1e-6, 10.0, 300)])
    at = (np.arange(200) + 0.5) / 200
    lengths = np.sqrt(1.0 + (bows[:, None] * pi * np.sin(2.0 * pi * at)) ** 2).mean(axis=1)
    # Nearly quadratic for small bows.
    found = np.interp(np.sqrt(np.maximum(excess, 0.0)), np.sqrt(lengths - 1.0), bows)
    return np.asarray(found)


def _blocks(result: "Record", ropes: tuple[Rope, Rope], radius: float) -> list[Part]:
    """Return car and counterweight; without a counterweight nothing hangs on the left."""
    side, still = BLOCK * radius, np.zeros_like(ropes[0].height)
    scale = ropes[0].scale
    words = "" if scale == 1.0 else f" (height 1 : {scale:g})"
    shapes = {
        "car": (ropes[0], block(side, side, "load")),
        "counterweight": (ropes[1], block(0.7 * side, side, "still")),
    }
    masses = scenario_of(result).get("effects", {}).get("hanging_masses", {})
    return [
        Body(f"{name}{words}", (shape,), still + rope.side * radius, rope.height, still)
        for name, (rope, shape) in shapes.items()
        if float(masses.get(name, 0.0)) > 0.0
    ]


def _forces(
    result: "Record", frames: Frames, ropes: tuple[Rope, Rope], radius: float
) -> list[Part]:
    """Return tensions, reaction, and force or torque of the drive, forces on one scale."""
    found = {
        name: values_at(result, name, frames) for name in SHOWN_FORCES if name in result.channels
    }
    zero, parts = np.zeros_like(frames.time), list[Part]()
    sizes = [np.abs(v).max() for name, v in found.items() if not name.endswith("torque")]
    largest = max(map(float, sizes), default=0.0)
    scale = ARROW * radius / largest if largest > 0.0 else 0.0
    for rope, name in zip(ropes, ("car", "counterweight"), strict=True):
        tension = found.get(f"rope_tension_{name}")
        if tension is not None:
            foot = zero + rope.side * radius
            parts.append(Arrow("tension of the rope", foot, zero, zero, -scale * tension, "path"))
    edge = BLOCK * radius
    if "drive_force" in found:
        masses = scenario_of(result).get("effects", {}).get("hanging_masses", {})
        foot = ropes[1].height - (edge if masses.get("counterweight", 0.0) > 0.0 else 0.0)
        pull = -scale * found["drive_force"]
        parts.append(Arrow("drive force", zero - radius, foot, zero, pull, "force"))
    if "drive_torque" in found:
        parts += torque_arc("torque of the drive", found["drive_torque"], ARC_OF_TORQUE * radius)
    if "shaft_reaction" in found:
        torque = found.get("friction_torque", zero)
        parts.append(reaction_arrow(zero, found["shaft_reaction"], torque, scale))
    return parts


def _readouts(result: "Record", frames: Frames, gaps: "tuple[Array, Array]") -> list[Readout]:
    """Return what shaft, cord and ropes do, and the numbers beside the drawing."""
    found, state = list[Readout](), state_at(result, frames)
    if state is not None:
        found.append(Readout("shaft", "1", state.astype(float), words=STATES))
    if "cord_mode" in result.channels:
        mode = values_at(result, "cord_mode", frames)
        found.append(Readout("cord on the pulley", "1", mode.astype(float), words=STATES))
    if "slack" in result.channels:
        flags = values_at(result, "slack", frames)
        for bit, name in ((CAR, "rope of the car"), (COUNTERWEIGHT, "rope of the counterweight")):
            slack = (flags & bit) != 0
            found.append(Readout(name, "1", slack.astype(float), words=TAUT_OR_SLACK))
    names = {
        "angle": "angle",
        "angular_velocity": "angular velocity",
        "car_position": "car, height above start",
        "car_velocity": "car, velocity",
        "cord_slip": "slip of the cord",
        "rope_tension_car": "tension, car",
        "rope_tension_counterweight": "tension, counterweight",
        "drive_force": "drive force",
        "drive_torque": "drive torque",
        "friction_torque": "friction torque",
    }
    found += readouts_at(result, names, frames)
    for gap, name in zip(gaps, ("car", "counterweight"), strict=True):
        if gap.any():
            found.append(Readout(f"slack rope, {name}", "m", gap))
    return found


def _bounds(parts: list[Part], radius: float) -> tuple[float, float, float, float]:
    """Return the bounds of wheel, ropes, masses and arrows at all times, with a margin."""
    points = [np.array([[-radius, -radius], [radius, radius]])]
    for part in parts:
        if isinstance(part, Arrow):
            points.append(np.column_stack([part.x, part.y]))
            points.append(np.column_stack([part.x + part.dx, part.y + part.dy]))
        elif isinstance(part, Body) and isinstance(part.shapes[0], Line):
            for corner in part.shapes[0].points:
                points.append(np.column_stack([part.x + corner[0], part.y + corner[1]]))
        elif isinstance(part, Band):
            points.append(np.column_stack([part.x.ravel(), part.y.ravel()]))
    return around(np.concatenate(points), 0.25 * radius)
