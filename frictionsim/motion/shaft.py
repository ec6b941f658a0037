"""A body on a dry shaft in motion, with its forces, cords, spring, stops and the shaft's reaction.

A scenario has no outline: it has points at which forces act and radii at which cords leave. An arm
goes to each point that turns with the body; cords and points that are fixed in space have a disc of
their radius, and so has a body on which only couples act. Forces are arrows from where they act, on
one scale; a cord leaves the body at its radius and runs with it. The reaction is drawn where it
acts: at the distance `friction torque / reaction` from the axis. Where friction is that of the
reaction, no constant normal load, it touches the kinetic friction circle while the body slips, and
stays within the static one while it sticks.
"""

from math import acos, atan2, ceil, hypot, pi, radians
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.shaft.equation import load_of, weights_of
from frictionsim.mechanisms.shaft.loads import ANGLE, SPEED, TIME
from frictionsim.motion.parts import (
    FORCE_ROLES,
    Arrow,
    Body,
    Disc,
    Line,
    Motion,
    Outline,
    Part,
    Readout,
)
from frictionsim.motion.samples import Samples, scenario_in
from frictionsim.motion.shapes import (
    arc,
    bounds_of,
    journal_of,
    reaction,
    scale_of,
    torque_arc,
    vectors,
    wheel,
)

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.loads import Load
    from frictionsim.mechanisms.shaft.schema import Couple, Force, ShaftScenario
    from frictionsim.motion.parts import Array, Role
    from frictionsim.results import Record

# Relative to the reach of the body.
HUB, TIP, PIN, MASS, DRAWN_SHAFT = 0.11, 0.05, 0.02, 0.09, 0.06
STOP_INNER, STOP_OUTER, STOP_WIDTH = 0.55, 0.75, 0.08  # along an arm, and beside it
LUG = 0.06  # half the width of what comes against a stop where there is no arm
SPRING = 0.30  # outer radius of a torsion spring
ARROW, CORD, MARKS = 0.9, 0.7, 0.3  # largest force, length of cords, distance of marks on them
ARC, ARC_SPACING = 0.5, 0.2  # radius of the arc of the first couple; how much smaller the next is
COIL, MAX_COILS = 1.5, 6.0  # turns of a torsion spring: at least; with more it is left out
HUB_OF_SHAFT = 1.7  # radius of a hub relative to its shaft
BARE_RADIUS = 5.0  # radius of a body on which only couples act, relative to its shaft
# Names with spaces, which no force or couple of a scenario has.
WEIGHTS = "weight of the body", "weight of the eccentric mass"
INERTIA_FORCE = "inertia force of the eccentric mass"
ROLES: "dict[str, Role]" = {**dict.fromkeys(WEIGHTS, "load"), INERTIA_FORCE: "path"}
VANISHES = 1e-9  # of the sum of the sizes: a resultant that is not larger is rounding
READOUTS = {
    "angle": "angle",
    "angular_velocity": "angular velocity",
    "applied_torque": "applied torque",
    "drive_torque": "torque of the drive",
    "friction_torque": "friction torque",
    "stop_torque": "torque of the end stop",
}


class Sizes(NamedTuple):
    """Sizes of the drawing of a body, m."""

    reach: float  # distance of the outermost point from the axis
    shaft: float  # drawn radii
    hub: float
    arms: tuple[tuple[float, float], ...]  # points at the angle 0 to which arms go
    rim: float  # radius of the disc; 0 for none


def motion(record: "Record", sample: int | None = None) -> Motion:
    """Return the motion of a result, or of one of its samples.

    Without a channel that a force depends on, as the angular velocity, no forces are drawn.
    """
    at, scenario = Samples(record, sample), scenario_in(record)
    angle, size = at["angle"], sizes_of(scenario)
    reach, (journal, details) = size.reach, journal_of(at, size.shaft)
    parts, scale, resisting = [*_bodies(scenario, size, angle), *journal], 0.0, list[Readout]()
    if _is_known(at, scenario):
        cords, forces = _forces(at, scenario, reach)
        torque, resisting = at.get("friction_torque", at.still), _resisting(at, scenario)
        lever = _reaction(forces, torque)
        scale = scale_of([*forces, lever], ARROW * reach)
        parts += [*cords, *forces, *_couples(at, scenario, reach)]
        drive = at.get("drive_torque", at.still)
        parts += torque_arc("torque of the drive", drive, 0.6 * reach)
        if torque.any():
            line = np.stack([np.zeros_like(lever.foot), lever.foot], axis=1)
            parts.append(Line("lever arm of the reaction", line, "cord"))
        parts.append(lever)
    drawn = [part for part in parts if not isinstance(part, Body)]
    return Motion(
        at.time,
        tuple(parts),
        bounds_of(drawn, reach, 0.12 * reach, scale),
        scale,
        (*at.contact(), *at.readouts(READOUTS), *resisting),
        details,
    )


# The body.


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
    reach = max([rim, *(hypot(*point) for point in arms), eccentric.radius if eccentric else 0.0])
    shaft = journal.shaft_radius if journal is not None else DRAWN_SHAFT * (reach or 1.0)
    if not reach > HUB_OF_SHAFT * shaft:
        reach = rim = max(reach, BARE_RADIUS * shaft if reach == 0.0 else HUB_OF_SHAFT * shaft)
    hub = min(max(HUB_OF_SHAFT * shaft, HUB * reach), reach)
    seen = tuple(point for point in arms if hypot(*point) > hub)
    return Sizes(reach, shaft, hub, seen, rim or (0.0 if seen else reach))


def _bodies(scenario: "ShaftScenario", sizes: Sizes, angle: "Array") -> list[Part]:
    """Return body, end stops and spring at some angles, rad."""
    still = np.zeros_like(angle)
    parts: list[Part] = [Body("body", _shapes(scenario, sizes), still, still, angle)]
    stops = _stops(scenario, sizes)
    if stops:
        parts.append(Body("end stops", stops, still, still, still))
    spring = _spring(scenario, sizes, angle)
    if spring is not None:
        parts.append(Line("torsion spring", spring, "cord"))
        end = Disc(float(spring[0, -1, 0]), float(spring[0, -1, 1]), PIN * sizes.reach, "fixed")
        parts.append(Body("", (end,), still, still, still))
    return parts


def _shapes(scenario: "ShaftScenario", sizes: Sizes) -> tuple[Disc | Outline, ...]:
    """Return the shapes of the body at the angle 0, from back to front."""
    shapes: list[Disc | Outline] = []
    if sizes.rim:
        shapes += wheel(sizes.rim, hub=min(sizes.hub / sizes.rim, 0.7))
        cords = {abs(force.cord_radius) for force in scenario.forces if force.cord_radius}
        inner = sorted((r for r in cords if sizes.hub < r < sizes.rim), reverse=True)
        shapes += [Disc(0.0, 0.0, radius, "fixed", open=True) for radius in inner]
    tip = TIP * sizes.reach
    shapes += [Outline(arm(point, sizes.hub, tip), "moving", closed=True) for point in sizes.arms]
    if sizes.arms or sizes.hub < sizes.rim:
        shapes.append(Disc(0.0, 0.0, sizes.hub, "moving"))
    shapes += [Disc(*point, PIN * sizes.reach, "fixed") for point in sizes.arms]
    if not sizes.rim:  # what the eye follows: a mark on the hub, towards the first arm
        x, y = (0.5 * (sizes.shaft + sizes.hub) * c / hypot(*sizes.arms[0]) for c in sizes.arms[0])
        shapes.append(Disc(x, y, 0.5 * PIN * sizes.reach, "marked"))
    eccentric = scenario.effects.eccentric_mass
    if eccentric is not None and eccentric.mass > 0.0:
        ((x, y),) = arc(eccentric.radius, radians(eccentric.azimuth_deg), 0.0, 1).tolist()
        shapes.append(Disc(x, y, MASS * sizes.reach, "load"))
    if scenario.effects.end_stops is not None and not sizes.arms:
        rim, half = sizes.rim, LUG * sizes.rim
        corners = [(0.97 * rim, -half), (1.15 * rim, -half), (1.15 * rim, half), (0.97 * rim, half)]
        shapes.append(Outline(np.array(corners), "marked", closed=True))
    return tuple(shapes)


def arm(point: tuple[float, float], hub: float, tip: float) -> "Array":
    """Return the outline (n, 2) of an arm from a hub to a round end about a point, m."""
    length, azimuth = hypot(*point), atan2(point[1], point[0])
    side = acos((hub - tip) / length) if length > abs(hub - tip) else 0.5 * pi
    end = arc(tip, -side, side, 9) + np.array([length, 0.0])
    return _turned(np.concatenate([end, arc(hub, side, 2.0 * pi - side, 13)]), azimuth)


def _stops(scenario: "ShaftScenario", sizes: Sizes) -> tuple[Outline, ...]:
    """Return the end stops, beside the longest arm where it is against them.

    None are drawn where the body may turn by more than a turn between them.
    """
    stops = scenario.effects.end_stops
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
    outlines = []
    for degrees, side in ((low, -1.0), (high, 1.0)):
        if degrees is not None:
            near, far = side * half, side * (half + STOP_WIDTH * sizes.reach)
            corners = np.array([(begin, near), (end, near), (end, far), (begin, far)])
            turned = _turned(corners, azimuth + radians(degrees))
            outlines.append(Outline(turned, "fixed", closed=True))
    return tuple(outlines)


def _turned(points: "Array", angle: Any) -> "Array":
    """Return points (n, 2) that have turned about the axis; or one (2,), by angles (frames,)."""
    (x, y), cosine, sine = points.T, np.cos(angle), np.sin(angle)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def _spring(scenario: "ShaftScenario", sizes: Sizes, angle: "Array") -> "Array | None":
    """Return the torsion spring, (frames, n, 2) in m: a spiral from the hub to a fixed place.

    None if it would have too many turns.
    """
    spring = scenario.effects.torsion_spring
    if spring is None or spring.stiffness == 0.0:
        return None
    free = radians(spring.free_angle_deg)
    # Its turns when it is free, of which enough are left at all angles.
    turns = COIL + ceil(2.0 * max(float(np.max(angle - free, initial=0.0)), 0.0) / (2.0 * pi)) / 2.0
    most = turns + float(np.max(free - angle, initial=0.0)) / (2.0 * pi)
    if most > MAX_COILS:
        return None
    part = np.linspace(0.0, 1.0, 1 + 30 * ceil(most))
    winding = angle[:, None] + part * (free + 2.0 * pi * turns - angle[:, None])
    radius = sizes.hub + part * (max(SPRING * sizes.reach, 1.4 * sizes.hub) - sizes.hub)
    return np.stack([radius * np.cos(winding), radius * np.sin(winding)], axis=-1)


# What acts on it.


def _is_known(at: Samples, scenario: "ShaftScenario") -> bool:
    """Return whether a result has the channels that the forces depend on."""
    effects, names = scenario.effects, list[str]()
    given: list[Force | Couple] = [*scenario.forces, *scenario.couples]
    over_speed = any(load_of(part).over == SPEED for part in given)
    if over_speed or effects.viscous_damping is not None or effects.eccentric_mass is not None:
        names.append("angular_velocity")
    if effects.eccentric_mass is not None:
        names.append("angular_acceleration")
    if effects.shaft_friction is not None:
        names.append("friction_torque")
    return all(name in at for name in names)


def _size(at: Samples, load: "Load") -> "Array":
    """Return the size of a load, (frames,) in N or N m."""
    over = {TIME: "time", ANGLE: "angle", SPEED: "angular_velocity"}[load.over]
    return np.array([load.size(value) for value in at[over].tolist()])


def _forces(at: Samples, scenario: "ShaftScenario", reach: float) -> tuple[list[Line], list[Arrow]]:
    """Return the cords, which run with the body, and the forces on it without the reaction.

    A cord of arm r that leaves the body in the unit direction d touches it at the point p with
    p x d = r, which is r (d_y, -d_x). The arrow of its force is at its end.
    """
    angle, cords, forces = at["angle"], list[Line](), list[Arrow]()
    cosine, sine = np.cos(angle), np.sin(angle)
    for i, force in enumerate(scenario.forces):
        load = load_of(force)
        parts = zip(*(triple[1:] for triple in load.arms), strict=True)
        along = vectors(*(a + b * cosine + c * sine for a, b, c in parts))
        if force.cord_radius is not None:
            start = force.cord_radius * vectors(along[:, 1], -along[:, 0])
            foot = start + CORD * reach * along
            run = force.cord_radius * (angle - at.whole("angle")[0])
            points = np.stack([start, foot], axis=1)
            cords.append(Line("cord", points, "cord", travel=run, spacing=MARKS * reach))
        else:
            foot = _turned(np.array(force.point), angle if force.point_turns else at.still)
        role = FORCE_ROLES[i % len(FORCE_ROLES)]
        forces.append(Arrow(force.name, foot, _size(at, load)[:, None] * along, role))
    places, eccentric = [vectors(at.still, 0.0)], scenario.effects.eccentric_mass
    if eccentric is not None:
        azimuth = angle + radians(eccentric.azimuth_deg)
        places.append(_turned(np.array([eccentric.radius, 0.0]), azimuth))
    for name, load, place in zip(WEIGHTS, weights_of(scenario), places, strict=False):
        if (size := load.size(0.0)) != 0.0:
            forces.append(Arrow(name, place, vectors(at.still, -size), ROLES[name]))
    if eccentric is not None:
        # The centre of mass accelerates by a J p - w^2 p at the place p, J a quarter turn.
        (x, y), w, a = places[1].T, at["angular_velocity"], at["angular_acceleration"]
        inert = eccentric.mass * vectors(w * w * x + a * y, w * w * y - a * x)
        forces.append(Arrow(INERTIA_FORCE, places[1], inert, ROLES[INERTIA_FORCE]))
    return cords, forces


def _reaction(forces: list[Arrow], torque: "Array") -> Arrow:
    """Return the force of the shaft, which balances all others; friction has the torque, N m."""
    across, up = -sum((force.vector for force in forces), np.zeros((len(torque), 2))).T
    scale = sum((force.size for force in forces), np.zeros(len(torque)))
    return reaction(across, up, torque, np.hypot(across, up) <= VANISHES * scale)


def _couples(at: Samples, scenario: "ShaftScenario", reach: float) -> list[Line]:
    """Return the couples that the scenario gives, as arcs on one scale, each on its radius."""
    sizes = [_size(at, load_of(couple)) for couple in scenario.couples]
    largest = max((float(np.abs(size).max()) for size in sizes), default=0.0)
    arcs: list[Line] = []
    for i, (couple, size) in enumerate(zip(scenario.couples, sizes, strict=True)):
        role = FORCE_ROLES[(len(scenario.forces) + i) % len(FORCE_ROLES)]
        arcs += torque_arc(couple.name, size, ARC * reach / (1.0 + ARC_SPACING * i), largest, role)
    return arcs


def _resisting(at: Samples, scenario: "ShaftScenario") -> list[Readout]:
    """Return the couples of spring and damping."""
    spring, damping = scenario.effects.torsion_spring, scenario.effects.viscous_damping
    couples: list[Readout] = []
    if spring is not None:
        twist = at["angle"] - radians(spring.free_angle_deg)
        couples.append(Readout("torsion spring", "N m", -spring.stiffness * twist))
    if damping is not None:
        torque = -damping.coefficient * at["angular_velocity"]
        couples.append(Readout("viscous damping", "N m", torque))
    return couples
