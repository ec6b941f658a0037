"""A pulley on a dry shaft in motion, with its cord, its load and its forces.

The load hangs on the right and rises where the pulley turns counter-clockwise; the force pulls the
cord down on the left, or to the left from the top. Radii are true to scale, those of shaft and
friction circles as well. The reaction of the shaft is drawn where it acts: at the distance
`friction_torque / reaction` from the axis, so that it touches the kinetic friction circle while the
pulley slips, and stays within the static one while it sticks.

With masses on the cord, the car hangs on the right and rises where the pulley turns
counter-clockwise. Travels longer than the picture allows are drawn smaller, by a round number that
is shown. Marks run with the rope over the wheel, and ticks turn with the rim: where they pass each
other the rope slips. A slack rope is a bow that is as long as the rope, until it is too wide.
"""

from math import floor, log10, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import CONTACT_WORDS, MODE_WORDS, study_text
from frictionsim.mechanisms.effects import friction_radius
from frictionsim.motion.frames import (
    Frames,
    frames_with_events,
    readouts_at,
    required,
    state_at,
    values_at,
)
from frictionsim.motion.parts import Arrow, Band, Body, Detail, Disc, Line, Motion, Part, Readout
from frictionsim.motion.shapes import (
    arc,
    block,
    bounds_of,
    enlarged_circles,
    ray,
    reaction_arrow,
    shaft_bodies,
    torque_arc,
    wheel,
)
from frictionsim.results import SLACK, TAUT
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array
    from frictionsim.results import Record


# In radii of the pulley.
MAX_TRAVEL = 3.2  # of car or counterweight that is drawn
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
TAUT_OR_SLACK = {0: MODE_WORDS[TAUT], 1: MODE_WORDS[SLACK]}


class Rope(NamedTuple):
    """A side of the rope and its load.

    Attributes
    ----------
    side : int
        1 right, -1 left.
    height : (frames,), m
        Of the upper edge of what hangs on it, relative to the axis.
    gap : (frames,), m
        How much longer the rope is than the distance from the wheel; 0 taut.
    scale : float
        Ratio of travels to their drawn lengths.
    """

    side: int
    height: "Array"
    gap: "Array"
    scale: float


class ShaftRadii(NamedTuple):
    """Radii of the shaft and of its friction circles, m."""

    shaft: float
    static: float
    kinetic: float


def _journal(result: "Record") -> ShaftRadii | None:
    """Return the radii of a shaft with friction; None without it."""
    if "shaft_friction" not in scenario_of(result).get("effects", {}):
        return None
    shaft, mu_s, mu_k = (
        float(scenario_value(result, "effects", "shaft_friction", key))
        for key in ("shaft_radius", "mu_s", "mu_k")
    )
    return ShaftRadii(shaft, friction_radius(shaft, mu_s), friction_radius(shaft, mu_k))


def _shaft(journal: ShaftRadii | None, radius: float, still: "Array", least: float) -> list[Part]:
    """Return the shaft, true to scale if its friction is simulated, and its friction circles.

    Circles up to a radius `least`, m, are left out.
    """
    if journal is None:
        return shaft_bodies(DRAWN_SHAFT * radius, still)
    circles = (journal.static, journal.kinetic)
    return shaft_bodies(journal.shaft, still, *(size if size > least else 0.0 for size in circles))


def _friction_circles(journal: ShaftRadii | None) -> tuple[Detail, ...]:
    """Return the enlarged detail, if the scenario has friction of the shaft."""
    if journal is None:
        return ()
    return enlarged_circles(min(1.1 * journal.shaft, WINDOW * journal.static))


def motion_with_masses(result: "Record") -> Motion:
    """Return the motion of a result of a pulley with hanging masses."""
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
    still, journal = np.zeros_like(frames.time), _journal(result)
    parts: list[Part] = [
        *_lines(ropes, rope + radius * _start_angle(result), radius),
        Body("pulley", _sheave(radius), still, still, angle),
        *_shaft(journal, radius, still, least=0.0),
        *_blocks(result, ropes, radius),
        *_forces_with_masses(result, frames, ropes, radius),
    ]
    readouts = _readouts(result, frames, (ropes[0].gap, ropes[1].gap))
    bounds = bounds_of(parts, radius, 0.25 * radius)
    details = _friction_circles(journal)
    return Motion(frames.time, tuple(parts), bounds, None, tuple(readouts), details)


def _start_angle(result: "Record") -> float:
    mechanism = scenario_of(result).get("mechanism", {})
    return float(np.radians(mechanism.get("initial_angle_deg", 0.0)))


def drawn_scale(travel: float, radius: float) -> float:
    """Return the scale 1 : n of a travel in the drawing: 1, or 2, 5 or 10 times a power of ten.

    Parameters
    ----------
    travel, radius : float, m
        The longest travel of car and counterweight; of the pulley.
    """
    needed = travel / (MAX_TRAVEL * radius)
    if needed <= 1.0:
        return 1.0
    power = 10.0 ** floor(log10(needed))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if needed <= step * power)


def _rope(side: int, position: "Array", gap: "Array", scale: float, radius: float) -> Rope:
    """Return a side of the rope; its mass is at the upper edge when it is highest."""
    height = -HIGHEST * radius + (position - position.max()) / scale
    return Rope(side, height, gap, scale)


def _gap(difference: "Array", radius: float) -> "Array":
    """Return the excess length of a slack rope, m; 0 for the roundoff of a taut one."""
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
    parts: list[Part] = [Band("rope", x, y, closed=False, travel=run, spacing=spacing)]
    for rope in ropes:
        x, y = hanging(rope, radius)
        if rope.scale == 1.0:  # marks continue from the wheel down: half a turn is 6 spacings
            down = -rope.side * run
            parts.append(Band("rope", x, y, closed=False, travel=down, spacing=spacing))
        else:
            parts.append(Band("rope", x, y, closed=False))
    return parts


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
    heights = np.interp(np.sqrt(np.maximum(excess, 0.0)), np.sqrt(lengths - 1.0), bows)
    return np.asarray(heights)


def _blocks(result: "Record", ropes: tuple[Rope, Rope], radius: float) -> list[Part]:
    """Return car and counterweight; without a counterweight nothing hangs on the left."""
    side, still = BLOCK * radius, np.zeros_like(ropes[0].height)
    scale = ropes[0].scale
    words = "" if scale == 1.0 else f" (height 1 : {study_text(scale)})"
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


def _forces_with_masses(
    result: "Record", frames: Frames, ropes: tuple[Rope, Rope], radius: float
) -> list[Part]:
    """Return tensions, reaction, and force or torque of the drive, forces on one scale."""
    forces = {
        name: values_at(result, name, frames) for name in SHOWN_FORCES if name in result.channels
    }
    zero, parts = np.zeros_like(frames.time), list[Part]()
    sizes = [np.abs(v).max() for name, v in forces.items() if not name.endswith("torque")]
    largest = max(map(float, sizes), default=0.0)
    scale = ARROW * radius / largest if largest > 0.0 else 0.0
    for rope, name in zip(ropes, ("car", "counterweight"), strict=True):
        tension = forces.get(f"rope_tension_{name}")
        if tension is not None:
            foot = zero + rope.side * radius
            parts.append(Arrow("tension of the rope", foot, zero, zero, -scale * tension, "path"))
    edge = BLOCK * radius
    if "drive_force" in forces:
        masses = scenario_of(result).get("effects", {}).get("hanging_masses", {})
        foot = ropes[1].height - (edge if masses.get("counterweight", 0.0) > 0.0 else 0.0)
        pull = -scale * forces["drive_force"]
        parts.append(Arrow("drive force", zero - radius, foot, zero, pull, "force"))
    if "drive_torque" in forces:
        parts += torque_arc("torque of the drive", forces["drive_torque"], ARC_OF_TORQUE * radius)
    if "shaft_reaction" in forces:
        torque = forces.get("friction_torque", zero)
        parts.append(reaction_arrow((zero, forces["shaft_reaction"]), torque, scale))
    return parts


def _readouts(result: "Record", frames: Frames, gaps: "tuple[Array, Array]") -> list[Readout]:
    """Return the modes of shaft, cord and ropes, and the numbers beside the drawing."""
    readouts, state = list[Readout](), state_at(result, frames)
    if state is not None:
        readouts.append(Readout("shaft", "1", state.astype(float), words=CONTACT_WORDS))
    if "cord_mode" in result.channels:
        mode = values_at(result, "cord_mode", frames)
        readouts.append(Readout("cord on the pulley", "1", mode.astype(float), words=CONTACT_WORDS))
    if "slack" in result.channels:
        flags = values_at(result, "slack", frames)
        for bit, name in ((CAR, "rope of the car"), (COUNTERWEIGHT, "rope of the counterweight")):
            slack = (flags & bit) != 0
            readouts.append(Readout(name, "1", slack.astype(float), words=TAUT_OR_SLACK))
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
    readouts += readouts_at(result, names, frames)
    for gap, name in zip(gaps, ("car", "counterweight"), strict=True):
        if gap.any():
            readouts.append(Readout(f"slack rope, {name}", "m", gap))
    return readouts


DRAWN_SHAFT = 0.06  # of the pulley's radius: a shaft that the scenario does not have is drawn so
# Of the pulley's radius: a smaller friction circle is a dot, and left out where none is enlarged.
CIRCLE_SEEN = 0.02
# In radii of the pulley.
HIGHEST = 1.6  # of what hangs on the cord, below the axis
BLOCK, ARROW = 0.9, 2.0  # side of what hangs on the cord; length of the largest force
ARC_OF_TORQUE = 0.62  # of the drive


# In radii of the pulley.
TRAVEL = 2.5  # of the load: the longest travel that is drawn
CORD_MARK = 0.5  # between marks on the cord


class _CordEnds(NamedTuple):
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
    """Return the motion of a result."""
    if "hanging_masses" in scenario_of(result).get("effects", {}):
        return motion_with_masses(result)
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
        *_shaft(_journal(result), radius, still, least=CIRCLE_SEEN * radius),
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
    return Motion(time, tuple(parts), bounds_of(parts, radius, 0.25 * radius), state, readouts)


def _cord(travel: "Array", radius: float) -> _CordEnds:
    """Return the places of load and pulled end; beyond `TRAVEL` radii the load is cut."""
    low, high = min(float(travel.min()), 0.0), max(float(travel.max()), 0.0)
    drawn_travel = min(high - low, TRAVEL * radius)
    # What is cut off is shared between its rise and its fall, so that it starts in the picture.
    start = -HIGHEST * radius - drawn_travel * (high / (high - low) if high > low else 0.0)
    lowest, highest = -HIGHEST * radius - drawn_travel, -HIGHEST * radius
    height = start + travel
    cut = (height > highest + 1e-9 * radius) | (height < lowest - 1e-9 * radius)
    shown = np.clip(height, lowest, highest)
    return _CordEnds(shown, cut, HIGHEST * radius + shown - lowest)


def _line(cord: _CordEnds, travel: "Array", radius: float, horizontal: bool) -> Band:
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


def _loads(cord: _CordEnds, radius: float, still: "Array") -> list[Part]:
    x, side = still + radius, BLOCK * radius
    load = Body("load", (block(side, side, "load"),), x, cord.height, still, ~cord.cut)
    if not cord.cut.any():
        return [load]
    outline = (block(side, side, "cut"),)
    return [load, Body("load, beyond the picture", outline, x, cord.height, still, cord.cut)]


def _forces(
    result: "Record", frames: Frames, cord: _CordEnds, radius: float, horizontal: bool
) -> list[Part]:
    """Return weight, force or torque of the drive, and reaction of the shaft, on one scale."""
    weight = float(scenario_value(result, "mechanism", "load"))
    zero = np.zeros_like(frames.time)
    x, y = zero + radius, cord.height - BLOCK * radius
    by_torque = "drive_torque" in result.channels
    if not by_torque and "drive_force" not in result.channels:
        return [Arrow("weight of the load", x, y, zero, zero - 0.5 * ARROW * radius, "load")]
    force = zero if by_torque else values_at(result, "drive_force", frames)
    across, up = (force, zero + weight) if horizontal else (zero, force + weight)
    sizes = (weight, np.abs(force).max(), np.hypot(across, up).max())
    largest = max(map(float, sizes))
    scale = ARROW * radius / largest if largest > 0.0 else 0.0
    parts: list[Part] = [Arrow("weight of the load", x, y, zero, zero - scale * weight, "load")]
    pull = -scale * force
    if by_torque:
        torque = values_at(result, "drive_torque", frames)
        parts += torque_arc("torque of the drive", torque, ARC_OF_TORQUE * radius)
    elif horizontal:
        parts.append(Arrow("drive force", -cord.pulled, zero + radius, pull, zero, "force"))
    else:
        parts.append(Arrow("drive force", zero - radius, -cord.pulled, zero, pull, "force"))
    if "friction_torque" in result.channels:
        torque = values_at(result, "friction_torque", frames)
        parts.append(reaction_arrow((across, up), torque, scale))
    return parts
