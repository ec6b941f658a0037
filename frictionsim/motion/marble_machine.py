"""A marble machine in motion: the gear with its marbles, and the pinion that drives it.

Which slots carry marbles is the rule of `frictionsim.mechanisms.marble_machine`: half of them, from
the bottom to the top on the rising side; one leaves at the top where the next is picked up. Pitch
circles and the circle of the marbles are true to scale; the size of a marble is chosen for the eye.
"""

from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.motion.parts import Body, Disc, Motion, Part, Readout
from frictionsim.motion.samples import Samples
from frictionsim.motion.shapes import bounds_around, wheel
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.results import Record

MARBLE, MAX_MARBLE = 0.3, 0.16  # its radius, of the distance between slots and of their circle
DRAWN_SHAFT = 0.05  # of the gear's radius, where the scenario has no shaft
MAX_SLOTS = 60  # that are drawn: of more every second, third, ... one
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
    at = Samples(record, sample)
    angle, still = at["angle"], at.still
    mechanism = [
        float(scenario_value(record, "mechanism", key))
        for key in ("marble_circle_radius", "pinion_radius", "gear_ratio", "mesh_azimuth_deg")
    ]
    circle, pinion, ratio, azimuth = mechanism
    slots, gear = int(scenario_value(record, "mechanism", "slots")), ratio * pinion
    size = min(2.0 * circle * sin(pi / max(slots, 2)) * MARBLE, MAX_MARBLE * circle)
    x, y = (f * (gear + pinion) for f in (cos(radians(azimuth)), sin(radians(azimuth))))
    places = [
        (slot, circle * cos(turn), circle * sin(turn))
        for slot in range(0, slots, -(-slots // MAX_SLOTS))
        for turn in (2.0 * pi * slot / slots - 0.5 * pi,)
    ]
    holes = tuple(Disc(a, b, size, "paper") for _, a, b in places)
    friction = scenario_of(record).get("effects", {}).get("shaft_friction", {})
    shaft = Disc(0.0, 0.0, float(friction.get("shaft_radius", DRAWN_SHAFT * gear)), "fixed")
    parts: list[Part] = [
        Body("gear", (*wheel(gear), *holes), still, still, angle),
        Body("shaft", (shaft,), still, still, still),
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
    reach = max(gear, circle + size)
    corners = [(-reach, -reach), (reach, reach), (x - pinion, y - pinion), (x + pinion, y + pinion)]
    bounds = bounds_around(np.array(corners), 0.1 * pinion + 0.5 * size)
    delivered = Readout("marbles delivered", "1", (cell - cells[0]).astype(float))
    readouts = (*at.contact(), *at.readouts(READOUTS), delivered)
    return Motion(at.time, tuple(parts), bounds, readouts=readouts)
