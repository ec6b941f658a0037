"""A marble machine in motion: gear with marbles, pinion, and the forces on both.

Which slots carry marbles is the rule of `frictionsim.mechanisms.marble_machine`: half of them, from
the bottom to the top on the rising side; one leaves at the top where the next is picked up. Pitch
circles, shaft and friction circles, and the circle of the marbles are true to scale; the size of a
marble is chosen for the eye. The forces are those of figs 4 and 11 of the paper: weights, the
force of the teeth in its components, which act on gear and pinion in opposite directions, and the
reactions of both shafts. The reaction of the gear's shaft, and opposite to it the resultant of all
other forces, pass the axis at the distance friction torque / reaction.
"""

from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.motion.parts import Arrow, Body, Detail, Disc, Motion, Part, Readout
from frictionsim.motion.samples import Samples, scenario_in
from frictionsim.motion.shapes import (
    bounds_around,
    bounds_of,
    journal_of,
    reaction,
    scale_of,
    torque_arc,
    vectors,
    wheel,
)

if TYPE_CHECKING:
    from frictionsim.mechanisms.marble_machine.schema import MarbleMachineScenario
    from frictionsim.motion.parts import Integers
    from frictionsim.results import Record

MARBLE, MAX_MARBLE = 0.3, 0.16  # its radius, of the distance between slots and of their circle
DRAWN_SHAFT = 0.05  # of the gear's radius, where the scenario has no shaft
MAX_SLOTS = 60  # that are drawn: of more every second, third, ... one
ARROW, ARC = 1.1, 0.6  # largest force, of the gear's radius; arc of the motor, of the pinion's
MESH = 0.5  # half the side of what is shown larger, of the pinion's radius
SLACK = 1e-9  # of a cell: a marble changes hands at its event, in spite of rounding
READOUTS = {
    "angle": "angle",
    "angular_velocity": "angular velocity",
    "motor_torque": "torque on the pinion",
    "friction_torque": "friction torque",
    "carried_marbles": "marbles on the gear",
}


def motion(record: "Record", sample: int | None = None) -> Motion:
    """Return the motion of a result, or of one of its samples."""
    at, scenario = Samples(record, sample), scenario_in(record)
    angle, still, machine = at["angle"], at.still, scenario.mechanism
    circle, pinion, ratio = machine.marble_circle_radius, machine.pinion_radius, machine.gear_ratio
    slots, gear = machine.slots, ratio * pinion
    size = min(2.0 * circle * sin(pi / max(slots, 2)) * MARBLE, MAX_MARBLE * circle)
    azimuth = radians(machine.mesh_azimuth_deg)
    x, y = (gear + pinion) * cos(azimuth), (gear + pinion) * sin(azimuth)
    places = [
        (slot, circle * cos(turn), circle * sin(turn))
        for slot in range(0, slots, -(-slots // MAX_SLOTS))
        for turn in (2.0 * pi * slot / slots - 0.5 * pi,)
    ]
    holes = tuple(Disc(a, b, size, "paper") for _, a, b in places)
    shaft, details = journal_of(at, DRAWN_SHAFT * gear)
    parts: list[Part] = [
        Body("gear", (*wheel(gear), *holes), still, still, angle),
        *shaft,
        Body("pinion", wheel(pinion), still + x, still + y, -ratio * angle),
    ]
    # The number of slots that have passed the bottom.
    cells = np.floor(at.whole("angle") * slots / (2.0 * pi) + SLACK).astype(np.int64)
    cell = cells[at.numbers]
    for slot, a, b in places:
        visible = (slot + cell) % slots < slots // 2
        if visible.any():
            name = "" if parts[-1].name in ("", "marbles") else "marbles"
            marble = (Disc(a, b, size, "load"),)
            parts.append(Body(name, marble, still, still, angle, visible))
    forces = _forces(at, scenario, cell)
    scale, margin, reach = scale_of(forces, ARROW * gear), 0.1 * pinion + 0.5 * size, circle + size
    corners = [(-reach, -reach), (reach, reach), (x - pinion, y - pinion), (x + pinion, y + pinion)]
    around = bounds_around(np.array(corners), margin)
    left, right, bottom, top = zip(
        around, bounds_of(forces, max(gear, reach), margin, scale), strict=True
    )
    bounds = min(left), max(right), min(bottom), max(top)
    if forces:
        a, b, half = gear * cos(azimuth), gear * sin(azimuth), MESH * pinion
        middles = {"forces of the teeth": (a, b), "reaction of the pinion's shaft": (x, y)}
        details += tuple(
            Detail(f"{words}, enlarged", (u - half, u + half, v - half, v + half))
            for words, (u, v) in middles.items()
        )
    delivered = Readout("marbles delivered", "1", (cell - cells[0]).astype(float))
    readouts = (*at.contact(), *at.readouts(READOUTS), delivered)
    return Motion(at.time, (*parts, *forces), bounds, scale, readouts, details)


def _forces(at: Samples, scenario: "MarbleMachineScenario", cell: "Integers") -> list[Part]:
    """Return the forces on gear and pinion; none without a channel that they depend on."""
    if "tooth_force_tangential" not in at or "tooth_force_radial" not in at:
        return []
    machine = scenario.mechanism
    tangential, radial = at["tooth_force_tangential"], at["tooth_force_radial"]
    azimuth, gear = radians(machine.mesh_azimuth_deg), machine.gear_ratio * machine.pinion_radius
    out = np.array([cos(azimuth), sin(azimuth)])
    teeth, axis = (f * out + at.still[:, None] for f in (gear, gear + machine.pinion_radius))
    along, inward = tangential[:, None] * (-out[1], out[0]), -radial[:, None] * out
    g, n = scenario.effects.g, machine.carried
    marble, own = (vectors(at.still, -m * g) for m in (machine.marble_mass, machine.gear_mass))
    resultant = along + inward + own + n * marble
    lever = reaction(-resultant[:, 0], -resultant[:, 1], at.get("friction_torque", at.still))
    delta = at["angle"] - machine.pitch * cell
    turns = [delta + machine.pitch * j for j in range(0, n, -(-machine.slots // MAX_SLOTS))]
    circle = machine.marble_circle_radius
    forces = [
        Arrow("resultant of the other forces", lever.foot, resultant, "cord"),
        *(
            Arrow("weight of a marble", circle * vectors(np.sin(a), -np.cos(a)), marble, "force-3")
            for a in turns
        ),
        Arrow("weight of the gear", 0.0 * teeth, own, "path"),
        Arrow("force of the teeth, tangential", teeth, along, "force"),
        Arrow("force of the teeth, radial", teeth, inward, "force-2"),
        # On the pinion, whose own weight is not in the scenario.
        Arrow("force of the teeth, tangential", teeth, -along, "force"),
        Arrow("force of the teeth, radial", teeth, -inward, "force-2"),
        Arrow("reaction of the pinion's shaft, tangential", axis, along, "force-4"),
        Arrow("reaction of the pinion's shaft, radial", axis, inward, "load"),
        lever,
    ]
    torque = at.get("motor_torque", at.still)
    turned = torque_arc(
        "drive of the pinion", -torque, ARC * machine.pinion_radius, about=axis[:, None]
    )
    # Of the size of its channel, whose sign is that of the gear's turn.
    return [*(f for f in forces if f.vector.any()), *(t._replace(size=torque) for t in turned)]
