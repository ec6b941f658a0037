"""A body on a dry shaft in motion, with its forces, cords, spring, stops and the shaft's reaction.

The body is drawn from the points of its forces (`shaft_body`). Forces are arrows from where they
act, on one scale; a cord leaves the body at its radius and runs with it. The reaction is drawn
where it acts: at the distance `friction torque / reaction` from the axis, so that it touches the
kinetic friction circle while the body slips, and stays within the static one while it sticks.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.shaft.free_body import (
    AppliedForce,
    FreeBody,
    channels_needed,
    free_body,
)
from frictionsim.motion.event_frames import (
    Frames,
    frames_with_events,
    readouts_at,
    state_at,
    values_at,
)
from frictionsim.motion.parts import Arrow, Band, Body, Detail, Disc, Motion, Part, Readout
from frictionsim.motion.shaft_body import (
    circle_window,
    look_of,
    shapes_of,
    spring_line,
    stops_of,
)
from frictionsim.motion.shapes import around, torque_arc
from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import ShaftScenario
    from frictionsim.motion.parts import Array, Role
    from frictionsim.results import Record

ARROW, CORD, CORD_MARK = 0.9, 0.7, 0.3  # largest force, cords and marks on them, of the reach
ARC, BETWEEN = 0.5, 0.09  # radius of the arc of the first couple, and how much further in the next
MAX_COUPLES = 4  # that are drawn: the largest
MAX_ARROWS, MAX_NUMBERS = 24, 6  # of forces that are drawn; of those whose sizes stand beside it
ROLES: "dict[str, Role]" = {"force": "force", "cord": "force", "weight": "load", "inertia": "path"}
NUMBERS = {
    "angle": "angle",
    "angular_velocity": "angular velocity",
    "applied_torque": "applied torque",
    "friction_torque": "friction torque",
    "stop_torque": "torque of the end stop",
    "shaft_reaction": "reaction of the shaft",
}


def motion(result: "Record") -> Motion:
    """Return the motion of a result.

    Without a channel that a force depends on, as the angular velocity, no forces are drawn.
    """
    frames = frames_with_events(result)
    scenario = scenario_in(result)
    angle = values_at(result, "angle", frames)
    still = np.zeros_like(frames.time)
    found = _free_body(result, scenario, frames)
    parts: list[Part] = list(bodies_of(scenario, angle))
    readouts = list(readouts_at(result, NUMBERS, frames))
    if found is not None:
        reach = look_of(scenario).reach
        scale = scale_of(found, reach)
        torque = still
        if "friction_torque" in result.channels:
            torque = values_at(result, "friction_torque", frames)
        parts += [*cords_of(scenario, found, angle), *_arrows(found, scale, reach)]
        parts += _couples(scenario, found, reach)
        parts += _reaction(found, torque, scale)
        readouts[2:2] = _sizes(found)
    details: tuple[Detail, ...] = ()
    window = circle_window(scenario)
    if window:
        details = (
            Detail("friction circles of the shaft, enlarged", (-window, window, -window, window)),
        )
    return Motion(
        frames.time,
        tuple(parts),
        _bounds(parts, look_of(scenario).reach),
        state_at(result, frames),
        tuple(readouts),
        details,
    )


def scenario_in(result: "Record") -> "ShaftScenario":
    """Return the scenario of a result."""
    try:
        found: Any = validate(scenario_of(result), None)
    except ValidationFailure as failure:
        raise InputError(
            f"cannot draw this result: the scenario in it is not valid: {failure}"
        ) from None
    return found


def _free_body(result: "Record", scenario: "ShaftScenario", frames: Frames) -> FreeBody | None:
    needed = channels_needed(scenario)
    if not set(needed) <= result.channels.keys():
        return None
    still = np.zeros_like(frames.time)
    rest = ("angular_velocity", "angular_acceleration")
    rates = (values_at(result, name, frames) if name in needed else still for name in rest)
    velocity, acceleration = rates
    angle = values_at(result, "angle", frames)
    return free_body(scenario, (frames.time, angle, velocity, acceleration))


def bodies_of(scenario: "ShaftScenario", angle: "Array") -> list[Part]:
    """Return body, spring, stops, shaft and friction circles at some angles, rad."""
    still, look = np.zeros_like(angle), look_of(scenario)

    def fixed(name: str, *shapes: Any) -> Body:
        return Body(name, shapes, still, still, still)

    found: list[Part] = [Body("body", shapes_of(scenario), still, still, angle)]
    stops = stops_of(scenario)
    if stops:
        found.append(fixed("end stops", *stops))
    spring = spring_line(scenario, angle)
    if spring is not None:
        found.append(Band("torsion spring", *spring, closed=False))
        place = float(spring[0][0, -1]), float(spring[1][0, -1])
        found.append(fixed("", Disc(*place, 0.02 * look.reach, "fixed")))
    found.append(fixed("shaft", Disc(0.0, 0.0, look.shaft, "fixed")))
    journal = scenario.effects.shaft_friction
    if journal is not None:
        circles: tuple[tuple[str, float, Role], ...] = (
            ("static friction circle", journal.static_radius, "paper"),
            ("kinetic friction circle", journal.kinetic_radius, "friction"),
        )
        for name, radius, role in circles:
            if radius > 0.0:
                found.append(fixed(name, Disc(0.0, 0.0, radius, role, open=True)))
    return found


def scale_of(found: FreeBody, reach: float) -> float:
    """Return the length of a force in a drawing, m/N: the largest has its share of the reach."""
    sizes = [float(np.max(np.abs(force.size), initial=0.0)) for force in found.forces]
    reaction = np.hypot(found.reaction_across, found.reaction_up)
    largest = max([float(np.max(reaction, initial=0.0)), *sizes])
    return ARROW * reach / largest if largest > 0.0 else 0.0


def cords_of(scenario: "ShaftScenario", found: FreeBody, angle: "Array") -> list[Part]:
    """Return the cords, which run with the body: by the radius times its angle, along the pull."""
    reach, parts = look_of(scenario).reach, list[Part]()
    for force, shown in zip(scenario.forces, found.forces, strict=False):
        if force.cord_radius is None:
            continue
        ends = zip((shown.x, shown.y), tail_of(shown, reach), strict=True)
        x, y = (np.column_stack(pair) for pair in ends)
        run = force.cord_radius * (angle - angle[0])
        parts.append(Band("cord", x, y, False, travel=run, spacing=CORD_MARK * reach))
    return parts


def tail_of(force: AppliedForce, reach: float) -> "tuple[Array, Array]":
    """Return where the arrow of a force begins, m: where it acts, or at the end of its cord."""
    if force.kind != "cord":
        return force.x, force.y
    return force.x + CORD * reach * force.along_x, force.y + CORD * reach * force.along_y


def _arrows(found: FreeBody, scale: float, reach: float) -> list[Part]:
    parts: list[Part] = []
    by_size = sorted(found.forces, key=lambda force: -float(np.max(np.abs(force.size), initial=0)))
    drawn = {force.name for force in by_size[:MAX_ARROWS]}
    for force in found.forces:
        if force.name in drawn:
            x, y = tail_of(force, reach)
            across, up = scale * force.across, scale * force.up
            parts.append(Arrow(force.name, x, y, across, up, ROLES[force.kind]))
    return parts


def _couples(scenario: "ShaftScenario", found: FreeBody, reach: float) -> list[Part]:
    """Return the couples that the scenario gives, as arcs on one scale, each on its radius."""
    given = {couple.name for couple in scenario.couples}
    sizes = {
        couple.name: float(np.max(np.abs(couple.size), initial=0.0))
        for couple in found.couples
        if couple.name in given
    }
    drawn = sorted(sizes, key=lambda name: -sizes[name])[:MAX_COUPLES]
    parts: list[Part] = []
    for couple in found.couples:
        if couple.name in drawn:
            radius = (ARC - BETWEEN * drawn.index(couple.name)) * reach
            parts += torque_arc(couple.name, couple.size, radius, sizes[drawn[0]])
    return parts


def reaction_foot(
    across: "Array", up: "Array", torque: "Array", vanishes: Any
) -> "tuple[Array, Array]":
    """Return the foot of the perpendicular from the axis to the line of action of a force, m.

    With the force (F_x, F_y) its foot (e_x, e_y) has the moment e_x F_y - e_y F_x = torque. Of a
    force that vanishes it is the axis.
    """
    square = np.where(vanishes, np.inf, across**2 + up**2)
    square = np.maximum(square, np.finfo(float).tiny)
    return torque * up / square, -torque * across / square


def _reaction(found: FreeBody, torque: "Array", scale: float) -> list[Part]:
    """Return the reaction of the shaft on its line of action, and its lever arm."""
    across, up = found.reaction_across, found.reaction_up
    size = np.hypot(across, up)
    x, y = reaction_foot(across, up, torque, found.vanishes(size))
    parts: list[Part] = [
        Arrow("reaction of the shaft", x, y, scale * across, scale * up, "friction")
    ]
    if np.any(torque != 0.0):
        zero = np.zeros_like(x)
        line = np.column_stack([zero, x]), np.column_stack([zero, y])
        parts.insert(0, Band("lever arm of the reaction", *line, closed=False))
    return parts


def _sizes(found: FreeBody) -> list[Readout]:
    """Return the sizes of forces and couples that change."""
    given = [(force.name, "N", force.size) for force in found.forces if force.kind != "weight"]
    given += [(couple.name, "N m", couple.size) for couple in found.couples]
    return [Readout(name, unit, size) for name, unit, size in given if np.ptp(size) > 0.0][
        :MAX_NUMBERS
    ]


def _bounds(parts: list[Part], reach: float) -> tuple[float, float, float, float]:
    """Return the bounds of body, cords and arrows at all times, with a margin."""
    points = [np.array([[-reach, -reach], [reach, reach]])]
    for part in parts:
        if isinstance(part, Arrow):
            points.append(np.column_stack([part.x, part.y]))
            points.append(np.column_stack([part.x + part.dx, part.y + part.dy]))
        elif isinstance(part, Band):
            points.append(np.column_stack([part.x.ravel(), part.y.ravel()]))
    return around(np.concatenate(points), 0.12 * reach)
