"""A pulley on a dry shaft in motion, with its cord, what hangs on it, and its forces.

The load, or the car, hangs on the right and rises where the pulley turns counter-clockwise; the
force pulls the cord down on the left, or to the left from the top. Radii are true to scale, those
of shaft and friction circles as well; travels longer than the picture allows are drawn smaller.
The reaction of the shaft is drawn where it acts: at the distance `friction_torque / reaction` from
the axis. Where friction is that of the reaction, no constant normal load, it touches the kinetic
friction circle while the pulley slips, and stays within the static one while it sticks. Marks run
with the cord over the wheel, and ticks turn with its rim: where they pass each other, it slips.
"""

from math import pi, radians
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import CONTACT_WORDS, MODE_WORDS
from frictionsim.motion.parts import Arrow, Body, Line, Motion, Part, Readout
from frictionsim.motion.samples import Samples, scenario_in
from frictionsim.motion.shapes import (
    arc,
    block,
    bounds_of,
    journal_of,
    points_of,
    reaction,
    scale_of,
    torque_arc,
    vectors,
    wheel,
)
from frictionsim.results import SLACK, TAUT

if TYPE_CHECKING:
    from frictionsim.mechanisms.pulley.schema import PulleyScenario
    from frictionsim.motion.parts import Array, Role
    from frictionsim.results import Record

# In radii of the pulley.
TRAVEL = 3.2  # the longest that is drawn
HIGHEST, BLOCK = 1.6, 0.9  # of what hangs on the cord, below the axis; its side
ARROW, ARC = 2.0, 0.62  # length of the largest force; radius of the arc of the drive
SPACING = 2.0 * pi / 12.0  # of marks on the cord, as of ticks at the rim
DRAWN_SHAFT = 0.06  # of a shaft whose friction is not simulated
ROUNDOFF = 1e-9  # of a gap
CAR, COUNTERWEIGHT = 1, 2  # bits of the channel `slack`
TAUT_OR_SLACK = {0: MODE_WORDS[TAUT], 1: MODE_WORDS[SLACK]}
MARGIN = 0.25
READOUTS = {
    "angle": "angle",
    "angular_velocity": "angular velocity",
    "car_position": "car, height above start",
    "car_velocity": "car, velocity",
    "cord_slip": "slip of the cord",
    "friction_torque": "friction torque",
}


def motion(record: "Record", sample: int | None = None, reduction: float = 1.0) -> Motion:
    """Return the motion of a result, or of one of its samples; travels at least so much smaller."""
    at, scenario = Samples(record, sample), scenario_in(record)
    radius = scenario.mechanism.cord_radius
    draw = _hoist if scenario.effects.hanging_masses is None else _lift
    (lines, loads, forces, more), smaller = draw(at, scenario, reduction)
    forces += torque_arc("torque of the drive", at.get("drive_torque", at.still), ARC * radius)
    journal, details = journal_of(at, DRAWN_SHAFT * radius)
    wheels = [Body("pulley", wheel(radius, hub=0.0), at.still, at.still, at["angle"]), *journal]
    scale = scale_of(forces, ARROW * radius)
    parts = (*lines, *wheels, *loads, *forces)
    bounds = bounds_of(parts, radius, MARGIN * radius, scale)
    readouts = (*more, *at.readouts(READOUTS))
    return Motion(at.time, parts, bounds, scale, readouts, details, smaller)


_Drawn = tuple[list[Part], list[Part], list[Part], list[Readout]]
"""Cords, what hangs on them, forces, and readouts."""


def _hoist(at: Samples, scenario: "PulleyScenario", least: float) -> tuple[_Drawn, float]:
    """Return a load that a force or torque lifts, and how much smaller its travel is drawn."""
    radius, weight = scenario.mechanism.cord_radius, scenario.mechanism.load
    horizontal = scenario.drive.direction == "horizontal"
    way = radius * (at.whole("angle") - radians(scenario.mechanism.initial_angle_deg))
    (heights,), smaller = _heights([way], radius, least)
    travel, height = way[at.numbers], heights[at.numbers]
    pulled = HIGHEST * radius + height - heights.min()  # how far its end is from the wheel
    end = (-pulled, radius) if horizontal else (-radius, -pulled)
    over = arc(radius, 0.0, 0.5 * pi if horizontal else pi)
    points = points_of((radius, height), *over, end)
    # Marks run from the load on, which itself moves.
    run = travel - (height - heights[0])
    lines: list[Part] = [Line("cord", points, "cord", travel=run, spacing=SPACING * radius)]
    side = BLOCK * radius
    shape = (block(side, side, "load"),)
    loads: list[Part] = [Body(_named("load", smaller), shape, at.still + radius, height, at.still)]
    foot = vectors(radius, height - side)
    forces: list[Part] = [Arrow("weight of the load", foot, vectors(at.still, -weight), "load")]
    turned = "drive_torque" in at
    force = at.still if turned else at.get("drive_force", at.still)
    if "drive_force" in at and not turned:
        pull = (-force, at.still) if horizontal else (at.still, -force)
        forces.append(Arrow("drive force", vectors(*end), vectors(*pull), "force"))
    if "friction_torque" in at and ("drive_force" in at or turned):
        across, up = (force, at.still) if horizontal else (at.still, force)
        forces.append(reaction(across, up + weight, at["friction_torque"]))
    readouts = [*at.contact(), Readout("travel of the load", "m", travel)]
    return (lines, loads, forces, readouts), smaller


def _lift(at: Samples, scenario: "PulleyScenario", least: float) -> tuple[_Drawn, float]:
    """Return a car and a counterweight, and how much smaller their travel is drawn."""
    masses, radius = scenario.effects.hanging_masses, scenario.mechanism.cord_radius
    assert masses is not None  # else there is a load
    start = radians(scenario.mechanism.initial_angle_deg)
    car, other = at["car_position"], at["counterweight_position"]
    slips = scenario.effects.cord_friction is not None
    rope = car if slips else radius * (at["angle"] - start)
    ways = [at.whole(f"{name}_position") for name in ("car", "counterweight")]
    every, smaller = _heights(ways, radius, least)
    heights = [each[at.numbers] for each in every]
    gaps = (_gap(car - rope, radius), _gap(other + rope, radius))
    over = points_of(*arc(radius, 0.0, pi))
    marks: dict[str, Any] = {"travel": rope + radius * start, "spacing": SPACING * radius}
    lines: list[Part] = [Line("rope", over, "cord", **marks)]
    loads, forces = list[Part](), list[Part]()
    sides: list[tuple[str, float, float, Role]] = [
        ("car", masses.car, 1.0, "load"),
        ("counterweight", masses.counterweight, 0.7, "still"),
    ]
    for (name, mass, wide, role), x, height in zip(sides, (radius, -radius), heights, strict=True):
        lines.append(Line("rope", points_of((x, 0.0), (x, height)), "cord"))
        if mass > 0.0:
            shape = block(BLOCK * radius * wide, BLOCK * radius, role)
            loads.append(Body(_named(name, smaller), (shape,), at.still + x, height, at.still))
        if f"rope_tension_{name}" in at:
            pull = vectors(at.still, -at[f"rope_tension_{name}"])
            forces.append(Arrow(f"tension, {name}", vectors(at.still + x, 0.0), pull, "path"))
    if "drive_force" in at:
        edge = BLOCK * radius if masses.counterweight > 0.0 else 0.0
        foot = vectors(-radius, heights[1] - edge)
        pull = vectors(at.still, -at["drive_force"])
        forces.append(Arrow("drive force", foot, pull, "force"))
    if "shaft_reaction" in at:
        torque = at.get("friction_torque", at.still)
        forces.append(reaction(at.still, at["shaft_reaction"], torque))
    return (lines, loads, forces, _states(at, gaps)), smaller


def _states(at: Samples, gaps: "tuple[Array, Array]") -> list[Readout]:
    """Return the modes of shaft, cord and ropes."""
    states = list(at.contact("shaft"))
    if "cord_mode" in at:
        mode = at["cord_mode"].astype(float)
        states.append(Readout("cord on the pulley", "1", mode, CONTACT_WORDS))
    for bit, name, gap in zip((CAR, COUNTERWEIGHT), ("car", "counterweight"), gaps, strict=True):
        if "slack" in at:
            slack = ((at["slack"] & bit) != 0).astype(float)
            states.append(Readout(f"rope of the {name}", "1", slack, TAUT_OR_SLACK))
        if gap.any():
            states.append(Readout(f"slack rope, {name}", "m", gap))
    return states


def _heights(travels: "list[Array]", radius: float, least: float) -> "tuple[list[Array], float]":
    """Return the upper edges of what hangs on the cord, and how much smaller travels are drawn.

    Each is highest at HIGHEST radii below the axis. Travels are those of the whole run.
    """
    smaller = max(least, *(float(np.ptp(travel)) / (TRAVEL * radius) for travel in travels))
    heights = [-HIGHEST * radius + (travel - travel.max()) / smaller for travel in travels]
    return heights, smaller


def _named(name: str, smaller: float) -> str:
    return f"{name} (travel drawn 1 : {smaller:.3g})" if smaller > 1.0 else name


def _gap(difference: "Array", radius: float) -> "Array":
    """Return the excess length of a slack rope, m; 0 for the roundoff of a taut one."""
    return np.where(difference > ROUNDOFF * radius, difference, 0.0)
