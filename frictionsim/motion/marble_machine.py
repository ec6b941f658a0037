"""A marble machine in motion: the gear with its marbles, the pinion, the delivered marbles.

Which slots carry marbles is the rule of `frictionsim.mechanisms.marble_machine`: half of them, from
the bottom to the top on the rising side; one leaves at the top where the next is picked up. Pitch
circles and the circle of the marbles are true to scale. The scenario knows neither the numbers of
teeth nor the size of a marble: they are chosen for the eye, with numbers of teeth that fit the
ratio, or no teeth where none do.
"""

from math import cos, floor, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.motion.frames import (
    Frames,
    channel_at,
    frames_with_events,
    last_event,
    readouts_at,
    state_at,
    values_at,
)
from frictionsim.motion.parts import Body, Disc, Line, Motion, Part, Readout
from frictionsim.motion.shapes import block, bounds_around, gear_rim, ray
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array, Numbers
    from frictionsim.results import Record

PINION_TEETH = range(14, 31)
MARBLE = 0.3  # radius of a marble, of the distance between slots
MAX_MARBLE = 0.16  # of the radius of their circle
DRAWN_SHAFT = 0.05  # of the gear's radius, where the scenario has no shaft
MAX_SLOTS = 60  # that are drawn: of more every second, third, ... one
TRANSFER = "transfer"  # the event
TRAY = 12  # marbles that the tray of delivered ones holds; then it is emptied
SLACK = 1e-9  # of a cell: a marble changes hands at its event, in spite of rounding


def motion(result: "Record") -> Motion:
    """Return the motion of a result."""
    frames = frames_with_events(result)
    time, angle = (values_at(result, name, frames) for name in ("time", "angle"))
    holes = int(scenario_value(result, "mechanism", "slots"))
    circle = float(scenario_value(result, "mechanism", "marble_circle_radius"))
    pinion = float(scenario_value(result, "mechanism", "pinion_radius"))
    ratio = float(scenario_value(result, "mechanism", "gear_ratio"))
    azimuth = radians(float(scenario_value(result, "mechanism", "mesh_azimuth_deg")))
    gear, still = ratio * pinion, np.zeros_like(time)
    size = min(2.0 * circle * sin(pi / max(holes, 2)) * MARBLE, MAX_MARBLE * circle)
    cell = _cells(result, frames, holes)
    centre = (gear + pinion) * np.array([cos(azimuth), sin(azimuth)])
    delivered = cell - int(cell[0])
    wheels, drawn = (
        _gears(gear, pinion, ratio, azimuth),
        np.arange(holes)[:: -(-holes // MAX_SLOTS)],
    )
    openings = tuple(
        Disc(circle * cos(a), circle * sin(a), size, "paper")
        for a in (2.0 * pi * drawn / holes - 0.5 * pi).tolist()
    )
    top = max(gear, circle + size, float(centre[1]) + pinion) + 3.0 * size
    parts: list[Part] = [
        Body("gear", (*wheels[0], *openings), still, still, angle),
        Body("shaft", (Disc(0.0, 0.0, _shaft(result, gear), "fixed"),), still, still, still),
        Body("pinion", wheels[1], still + centre[0], still + centre[1], -ratio * angle),
        *_carried(circle, size, (holes, drawn.tolist()), angle, cell),
        *_tray(size, top, delivered, still),
    ]
    reach = max(gear * 1.05, circle + size)
    tray = 1.15 * size * (TRAY + 1)
    corners = [(-reach, -reach), (reach, reach), (-tray, top - 2.0 * size), (tray, top + size)]
    outer = 1.15 * pinion
    corners += [tuple(centre - outer), tuple(centre + outer)]
    state = state_at(result, frames)
    readouts = (
        *readouts_at(result, {"angle": "angle", "angular_velocity": "angular velocity"}, frames),
        *readouts_at(
            result,
            {"motor_torque": "torque on the pinion", "carried_marbles": "marbles on the gear"},
            frames,
        ),
        Readout("marbles delivered", "1", delivered.astype(float)),
    )
    return Motion(time, tuple(parts), bounds_around(np.array(corners), 0.5 * size), state, readouts)


def _cells(result: "Record", frames: Frames, holes: int) -> "Numbers":
    """Return the number of slots that have passed the bottom; each does so at its transfer."""
    pitch = 2.0 * pi / holes
    samples = channel_at(result, "angle", frames.sample)
    cells = np.floor(samples / pitch + SLACK).astype(np.int64)
    events = result.events
    if TRANSFER not in result.contacts or "angle" not in events:
        return cells
    chosen = np.asarray(events["contact"]) == result.contacts.index(TRANSFER)
    event = last_event(result, frames, chosen)
    passed = event >= 0
    if passed.any():
        angle, mode = (np.asarray(events[name])[event[passed]] for name in ("angle", "mode_to"))
        # At its event an angle is that of a slot: the cell is that ahead of it or behind it.
        cells[passed] = np.round(angle / pitch).astype(np.int64) - (mode < 0)
    return cells


def teeth_of(ratio: float) -> tuple[int, int] | None:
    """Return numbers of teeth of gear and pinion that have a ratio; None if there are none."""
    for teeth in PINION_TEETH:
        gear_teeth = round(ratio * teeth)
        if gear_teeth >= min(PINION_TEETH) and abs(gear_teeth - ratio * teeth) < 1e-6 * teeth:
            return gear_teeth, teeth
    return None


def _gears(
    gear: float, pinion: float, ratio: float, azimuth: float
) -> tuple[tuple[Disc | Line, ...], tuple[Disc | Line, ...]]:
    """Return the shapes of gear and pinion, whose teeth mesh at the azimuth at the angle 0."""
    teeth = teeth_of(ratio)
    mark = Disc(0.6 * pinion, 0.0, 0.13 * pinion, "marked")
    hub = Disc(0.0, 0.0, 0.25 * pinion, "fixed")
    pointer = ray(-0.5 * pi, 0.12 * gear, 0.55 * gear, "marked")
    if teeth is None:
        return (Disc(0.0, 0.0, gear, "moving"), pointer), (
            Disc(0.0, 0.0, pinion, "moving"),
            mark,
            hub,
        )
    # A tooth of the gear points at the pinion, and a gap of the pinion back at it.
    outlines = (
        gear_rim(gear, teeth[0], azimuth),
        gear_rim(pinion, teeth[1], azimuth + pi + pi / teeth[1]),
    )
    return (outlines[0], pointer), (outlines[1], mark, hub)


def _shaft(result: "Record", gear: float) -> float:
    friction = scenario_of(result).get("effects", {}).get("shaft_friction")
    if friction is None:
        return DRAWN_SHAFT * gear
    return float(scenario_value(result, "effects", "shaft_friction", "shaft_radius"))


def _carried(
    circle: float, size: float, shown: tuple[int, list[int]], angle: "Array", cell: "Numbers"
) -> list[Part]:
    """Return a marble for each slot that is drawn, visible where the slot carries one."""
    holes, drawn = shown
    still = np.zeros_like(angle)
    parts: list[Part] = []
    for hole in drawn:
        visible = (hole + cell) % holes < holes // 2
        if visible.any():
            place = 2.0 * pi * hole / holes - 0.5 * pi
            parts.append(
                Body(
                    "" if parts else "marbles",
                    (Disc(0.0, 0.0, size, "load"),),
                    still + circle * cos(place),
                    still + circle * sin(place),
                    still,
                    visible,
                    carrier=angle,
                )
            )
    return parts


def _tray(size: float, top: float, delivered: "Numbers", still: "Array") -> list[Part]:
    """Return the delivered marbles in a tray that is emptied when it is full."""
    count = np.where(delivered > 0, (delivered - 1) % TRAY + 1, 0)
    step = 2.15 * size
    parts: list[Part] = []
    rail = block(step * (TRAY + 0.5), 0.3 * size, "fixed")
    parts.append(Body("", (rail,), still, still + top - 1.1 * size, still))
    for i in range(min(TRAY, floor(float(count.max())))):
        x = still + step * (0.5 * (TRAY - 1) - i)
        marble = (Disc(0.0, 0.0, size, "load"),)
        name = "" if i else "delivered marbles"
        parts.append(Body(name, marble, x, still + top, still, count > i))
    return parts
