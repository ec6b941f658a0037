"""A body on a dry shaft in motion, with its forces, cords, spring, stops and the shaft's reaction.

A scenario has no outline: it has points at which forces act and radii at which cords leave. An arm
goes to each point that turns with the body; cords and points that are fixed in space have a disc of
their radius, and so has a body on which only couples act. Forces are arrows from where they act, on
one scale; a cord leaves the body at its radius and runs with it. The reaction is drawn where it
acts: at the distance `friction torque / reaction` from the axis, so that it touches the kinetic
friction circle while the body slips, and stays within the static one while it sticks.
"""

from math import acos, atan2, ceil, hypot, inf, pi, radians
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.shaft.free_body import (
    AppliedForce,
    FreeBody,
    channels_needed,
    free_body,
)
from frictionsim.motion.frames import (
    Frames,
    frames_with_events,
    readouts_at,
    state_at,
    values_at,
)
from frictionsim.motion.parts import (
    FORCE_ROLES,
    Arrow,
    Band,
    Body,
    Disc,
    Line,
    Motion,
    Part,
    Readout,
)
from frictionsim.motion.shapes import (
    arc,
    bounds_of,
    enlarged_circles,
    reaction_arrow,
    shaft_bodies,
    torque_arc,
    wheel,
)
from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import ShaftScenario
    from frictionsim.motion.parts import Array, Role
    from frictionsim.results import Record


# Relative to the reach of the body.
HUB, TIP, PIN, MASS, DRAWN_SHAFT = 0.11, 0.05, 0.02, 0.09, 0.06
STOP_INNER, STOP_OUTER, STOP_WIDTH = 0.55, 0.75, 0.08  # along an arm, and beside it
SPRING = 0.30  # outer radius of a torsion spring
COIL, MAX_COILS = 1.5, 6.0  # turns of a torsion spring: at least; with more it is left out
HUB_OF_SHAFT = 1.7  # radius of a hub relative to its shaft
BARE_RADIUS = 5.0  # radius of a body on which only couples act, relative to its shaft
MAX_ARMS = 12  # more are an outline around them


class Sizes(NamedTuple):
    """Sizes of the drawing of a body.

    Attributes
    ----------
    reach : float, m
        Distance of the outermost point from the axis.
    shaft : float, m
        Drawn radius of the shaft.
    hub : float, m
    arms : tuple of (float, float), m
        Points at the angle 0 to which arms go.
    rim : float, m
        Radius of the disc; 0 for none.
    """

    reach: float
    shaft: float
    hub: float
    arms: tuple[tuple[float, float], ...]
    rim: float


def sizes_of(scenario: "ShaftScenario") -> Sizes:
    """Return the sizes of the drawing of a body."""
    journal, eccentric = scenario.effects.shaft_friction, scenario.effects.eccentric_mass
    arms: dict[tuple[float, float], None] = {}
    rim = 0.0
    for force in scenario.forces:
        if force.point is None:
            rim = max(rim, abs(force.cord_radius or 0.0))
        elif force.point_turns:
            arms[force.point] = None
        else:
            rim = max(rim, hypot(*force.point))
    lengths = [hypot(*point) for point in arms]
    reach = max([rim, *lengths, eccentric.radius if eccentric else 0.0])
    shaft = journal.shaft_radius if journal is not None else DRAWN_SHAFT * (reach or 1.0)
    if not reach > HUB_OF_SHAFT * shaft:
        reach = rim = max(reach, BARE_RADIUS * shaft if reach == 0.0 else HUB_OF_SHAFT * shaft)
    hub = min(max(HUB_OF_SHAFT * shaft, HUB * reach), reach)
    seen = tuple(point for point in arms if hypot(*point) > hub)
    if not rim and not seen:
        rim = reach
    return Sizes(reach, shaft, hub, seen, rim)


def shapes_of(scenario: "ShaftScenario") -> tuple[Disc | Line, ...]:
    """Return the shapes of the body at the angle 0, from back to front."""
    sizes = sizes_of(scenario)
    shapes: list[Disc | Line] = []
    if sizes.rim:
        shapes += wheel(sizes.rim, hub=min(sizes.hub / sizes.rim, 0.7))
        cords = {abs(force.cord_radius) for force in scenario.forces if force.cord_radius}
        shapes += [
            Disc(0.0, 0.0, radius, "fixed", open=True)
            for radius in sorted(cords, reverse=True)
            if sizes.hub < radius < sizes.rim
        ]
    tip = TIP * sizes.reach
    if len(sizes.arms) > MAX_ARMS:
        shapes.append(Line(_outline(sizes.arms), "moving", closed=True))
    else:
        shapes += [Line(arm(point, sizes.hub, tip), "moving", closed=True) for point in sizes.arms]
    if sizes.arms or sizes.hub < sizes.rim:
        shapes.append(Disc(0.0, 0.0, sizes.hub, "moving"))
    shapes += [Disc(*point, PIN * sizes.reach, "fixed") for point in sizes.arms]
    if not sizes.rim:  # what the eye follows
        shapes.append(Disc(*_hub_place(sizes), 0.5 * PIN * sizes.reach, "marked"))
    eccentric = scenario.effects.eccentric_mass
    if eccentric is not None and eccentric.mass > 0.0:
        azimuth = radians(eccentric.azimuth_deg)
        place = eccentric.radius * np.cos(azimuth), eccentric.radius * np.sin(azimuth)
        shapes.append(Disc(float(place[0]), float(place[1]), MASS * sizes.reach, "load"))
    if _stops(scenario) is not None and not sizes.arms:
        shapes.append(_lug(sizes))
    return tuple(shapes)


def _hub_place(sizes: Sizes) -> tuple[float, float]:
    """Return a place on the hub, on the side of the first arm."""
    x, y = sizes.arms[0]
    length, place = hypot(x, y), 0.5 * (sizes.shaft + sizes.hub)
    return place * x / length, place * y / length


def arm(point: tuple[float, float], hub: float, tip: float) -> "Array":
    """Return the outline (n, 2) of an arm from a hub to a round end about a point, m."""
    length, azimuth = hypot(*point), atan2(point[1], point[0])
    side = acos((hub - tip) / length) if length > abs(hub - tip) else 0.5 * pi
    end = arc(tip, -side, side, 9) + np.array([length, 0.0])
    x, y = np.concatenate([end, arc(hub, side, 2.0 * pi - side, 13)]).T
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    return np.column_stack([cosine * x - sine * y, sine * x + cosine * y])


def _outline(points: tuple[tuple[float, float], ...]) -> "Array":
    """Return a polygon through the outermost points, in the order of their azimuths."""
    corners = np.array(points)
    return corners[np.argsort(np.arctan2(corners[:, 1], corners[:, 0]))]


def _stops(scenario: "ShaftScenario") -> Any:
    return getattr(scenario.effects, "end_stops", None)


def stops_of(scenario: "ShaftScenario") -> tuple[Line, ...]:
    """Return the end stops, beside the longest arm where it is against them.

    None are drawn where the body may turn by more than a turn between them.
    """
    stops, sizes = _stops(scenario), sizes_of(scenario)
    if stops is None:
        return ()
    low, high = stops.lowest_angle_deg, stops.highest_angle_deg
    if low is not None and high is not None and high - low > 360.0:
        return ()
    if sizes.arms:
        point = max(sizes.arms, key=lambda point: hypot(*point))
        azimuth, length = atan2(point[1], point[0]), hypot(*point)
        begin, end = (max(part * length, 1.05 * sizes.hub) for part in (STOP_INNER, STOP_OUTER))
        half = sizes.hub + (TIP * sizes.reach - sizes.hub) * begin / length
    else:
        azimuth, begin, end, half = 0.0, 1.02 * sizes.rim, 1.2 * sizes.rim, LUG * sizes.rim
    wide = STOP_WIDTH * sizes.reach
    stop_lines = []
    for degrees, side in ((low, -1.0), (high, 1.0)):
        if degrees is not None:
            near, far = side * half, side * (half + wide)
            corners = np.array([(begin, near), (end, near), (end, far), (begin, far)])
            stop_lines.append(
                Line(_turned(corners, azimuth + radians(degrees)), "fixed", closed=True)
            )
    return tuple(stop_lines)


LUG = 0.06  # half the width of what comes against a stop, relative to the rim


def _lug(sizes: Sizes) -> Line:
    rim, half = sizes.rim, LUG * sizes.rim
    corners = [(0.97 * rim, -half), (1.15 * rim, -half), (1.15 * rim, half), (0.97 * rim, half)]
    return Line(np.array(corners), "marked", closed=True)


def _turned(points: "Array", angle: float) -> "Array":
    cosine, sine = np.cos(angle), np.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def spring_line(scenario: "ShaftScenario", angle: "Array") -> "tuple[Array, Array] | None":
    """Return the torsion spring at angles of the body, two arrays (frames, n) in m.

    A spiral from the hub to a fixed place; None if it would have too many turns.
    """
    spring, sizes = scenario.effects.torsion_spring, sizes_of(scenario)
    if spring is None or spring.stiffness == 0.0:
        return None
    free = radians(spring.free_angle_deg)
    # Its turns when it is free, of which enough are left at all angles.
    turns = COIL + ceil(2.0 * max(float(np.max(angle - free, initial=0.0)), 0.0) / (2.0 * pi)) / 2.0
    most = turns + float(np.max(free - angle, initial=0.0)) / (2.0 * pi)
    outer = max(SPRING * sizes.reach, 1.4 * sizes.hub)
    if most > MAX_COILS:
        return None
    part = np.linspace(0.0, 1.0, 1 + 30 * ceil(most))
    end = free + 2.0 * pi * turns
    winding = angle[:, None] + part * (end - angle[:, None])
    radius = sizes.hub + part * (outer - sizes.hub)
    return radius * np.cos(winding), radius * np.sin(winding)


def circle_window(scenario: "ShaftScenario") -> float:
    """Return half the side of the enlarged view of the friction circles, m.

    0 without dry friction, which has no shaft; that of the shaft where the circles are points.
    """
    journal = scenario.effects.shaft_friction
    if journal is None:
        return 0.0
    return min(3.0 * journal.static_radius or inf, 1.3 * journal.shaft_radius)


ARROW, CORD, CORD_MARK = 0.9, 0.7, 0.3  # largest force, cords and marks on them, of the reach
ARC, ARC_SPACING = (
    0.5,
    0.09,
)  # radius of the arc of the first couple, and how much further in the next
MAX_COUPLES = 4  # that are drawn: the largest
MAX_ARROWS, MAX_NUMBERS = 24, 6  # of forces that are drawn; of those whose sizes stand beside it
ROLES: "dict[str, Role]" = {"weight": "load", "inertia": "path"}
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
    forces = _free_body(result, scenario, frames)
    parts: list[Part] = list(bodies_of(scenario, angle))
    readouts = list(readouts_at(result, NUMBERS, frames))
    reach = sizes_of(scenario).reach
    if forces is not None:
        scale = scale_of(forces, reach)
        torque = still
        if "friction_torque" in result.channels:
            torque = values_at(result, "friction_torque", frames)
        parts += [*cords_of(scenario, forces, angle), *_arrows(forces, scale, reach)]
        parts += _couples(scenario, forces, reach)
        parts += _reaction(forces, torque, scale)
        readouts[2:2] = _sizes(forces)
    return Motion(
        frames.time,
        tuple(parts),
        bounds_of((part for part in parts if not isinstance(part, Body)), reach, 0.12 * reach),
        state_at(result, frames),
        tuple(readouts),
        enlarged_circles(circle_window(scenario)),
    )


def scenario_in(result: "Record") -> "ShaftScenario":
    """Return the scenario of a result."""
    try:
        scenario: Any = validate(scenario_of(result), None)
    except ValidationFailure as failure:
        raise InputError(
            f"cannot draw this result: the scenario in it is not valid: {failure}"
        ) from None
    return scenario


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
    still, sizes = np.zeros_like(angle), sizes_of(scenario)

    def fixed(name: str, *shapes: Any) -> Body:
        return Body(name, shapes, still, still, still)

    parts: list[Part] = [Body("body", shapes_of(scenario), still, still, angle)]
    stops = stops_of(scenario)
    if stops:
        parts.append(fixed("end stops", *stops))
    spring = spring_line(scenario, angle)
    if spring is not None:
        parts.append(Band("torsion spring", *spring, closed=False))
        place = float(spring[0][0, -1]), float(spring[1][0, -1])
        parts.append(fixed("", Disc(*place, 0.02 * sizes.reach, "fixed")))
    journal = scenario.effects.shaft_friction
    circles = (0.0, 0.0) if journal is None else (journal.static_radius, journal.kinetic_radius)
    return [*parts, *shaft_bodies(sizes.shaft, still, *circles)]


def scale_of(body: FreeBody, reach: float) -> float:
    """Return the length of a force in a drawing, m/N: the largest has its share of the reach."""
    sizes = [float(np.max(np.abs(force.size), initial=0.0)) for force in body.forces]
    reaction = np.hypot(body.reaction_across, body.reaction_up)
    largest = max([float(np.max(reaction, initial=0.0)), *sizes])
    return ARROW * reach / largest if largest > 0.0 else 0.0


def cords_of(scenario: "ShaftScenario", body: FreeBody, angle: "Array") -> list[Part]:
    """Return the cords, which run with the body: by the radius times its angle, along the pull."""
    reach, parts = sizes_of(scenario).reach, list[Part]()
    for force, shown in zip(scenario.forces, body.forces, strict=False):
        if force.cord_radius is None:
            continue
        ends = zip((shown.x, shown.y), tail_of(shown, reach), strict=True)
        x, y = (np.column_stack(pair) for pair in ends)
        run = force.cord_radius * (angle - angle[0])
        parts.append(Band("cord", x, y, False, travel=run, spacing=CORD_MARK * reach))
    return parts


def tail_of(force: AppliedForce, reach: float) -> "tuple[Array, Array]":
    """Return the start of the arrow of a force, m: where it acts, or the end of its cord."""
    if force.kind != "cord":
        return force.x, force.y
    return force.x + CORD * reach * force.along_x, force.y + CORD * reach * force.along_y


def _arrows(body: FreeBody, scale: float, reach: float) -> list[Part]:
    parts: list[Part] = []
    largest_first = sorted(
        body.forces, key=lambda force: -float(np.max(np.abs(force.size), initial=0))
    )
    drawn = {force.name for force in largest_first[:MAX_ARROWS]}
    for i, force in enumerate(body.forces):  # those of the scenario are the first
        if force.name in drawn:
            x, y = tail_of(force, reach)
            across, up = scale * force.across, scale * force.up
            role = ROLES.get(force.kind, FORCE_ROLES[i % len(FORCE_ROLES)])
            parts.append(Arrow(force.name, x, y, across, up, role))
    return parts


def _couples(scenario: "ShaftScenario", body: FreeBody, reach: float) -> list[Part]:
    """Return the couples that the scenario gives, as arcs on one scale, each on its radius."""
    given = {couple.name for couple in scenario.couples}
    sizes = {
        couple.name: float(np.max(np.abs(couple.size), initial=0.0))
        for couple in body.couples
        if couple.name in given
    }
    drawn = sorted(sizes, key=lambda name: -sizes[name])[:MAX_COUPLES]
    parts: list[Part] = []
    for i, couple in enumerate(body.couples, start=len(scenario.forces)):
        if couple.name in drawn:
            radius = (ARC - ARC_SPACING * drawn.index(couple.name)) * reach
            role = FORCE_ROLES[i % len(FORCE_ROLES)]
            parts += torque_arc(couple.name, couple.size, radius, sizes[drawn[0]], role)
    return parts


def _reaction(body: FreeBody, torque: "Array", scale: float) -> list[Part]:
    """Return the reaction of the shaft on its line of action, and its lever arm."""
    across, up = body.reaction_across, body.reaction_up
    size = np.hypot(across, up)
    arrow = reaction_arrow((across, up), torque, scale, body.vanishes(size))
    if not np.any(torque != 0.0):
        return [arrow]
    zero = np.zeros_like(arrow.x)
    line = np.column_stack([zero, arrow.x]), np.column_stack([zero, arrow.y])
    return [Band("lever arm of the reaction", *line, closed=False), arrow]


def _sizes(body: FreeBody) -> list[Readout]:
    """Return the sizes of forces and couples that change."""
    given = [(force.name, "N", force.size) for force in body.forces if force.kind != "weight"]
    given += [(couple.name, "N m", couple.size) for couple in body.couples]
    return [Readout(name, unit, size) for name, unit, size in given if np.ptp(size) > 0.0][
        :MAX_NUMBERS
    ]
