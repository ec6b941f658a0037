"""An epicyclic gear in motion: the crank carries a planet round a sun or in a ring; forces; a path.

The planet rolls: per turn of the crank it turns by lambda = L/r2 on a sun, by -lambda in a ring.
"""

from fractions import Fraction
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.epicyclic.equation import constants_of, path_of
from frictionsim.motion.parts import Arrow, Body, Disc, Line, Motion, Outline, Part
from frictionsim.motion.samples import REFUSED, Samples, scenario_in
from frictionsim.motion.shapes import bounds_of, ray, scale_of, torque_arc, vectors

if TYPE_CHECKING:
    from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
    from frictionsim.mechanisms.epicyclic.tracer_point import TracerPath
    from frictionsim.motion.parts import Array, Role
    from frictionsim.results import Record

# Of a path: rad of crank or planet between points, number of points, turns in which it may close.
STEP, MAX_POINTS, MAX_TURNS = 0.05, 3000, 50
SAME = 1e-9  # of the ratio of radii: a path that closes
CRANK, HINGE, POINT = 0.09, 0.16, 0.12  # half width and radii, of planet or crank, the smaller one
RING = 1.12  # outer radius of a ring, of its own
ARROW, ARC = 0.8, 0.6  # length of the largest force, of the crank; radii of arcs of couples
READOUTS = {
    "angle": "angle",
    "angular_velocity": "angular velocity",
    "planet_velocity": "angular velocity of the planet",
    "friction_torque": "friction torque",
}


def motion(record: "Record", sample: int | None = None) -> Motion:
    """Return the motion of a result, or of one of its samples.

    Without the angle it is that of the tracer point alone.
    """
    at, scenario = Samples(record, sample), scenario_in(record)
    gear, point = scenario.mechanism, scenario.effects.tracer_point
    size = min(gear.planet_radius, gear.length)
    parts: list[Part] = [_wheel(at, scenario, size)]
    forces: list[Part] = []
    ring, name = RING * gear.sun_radius, "path of the tracer point"
    reach = gear.length + max(gear.planet_radius, point.radius if point else 0.0)
    reach = max(reach, ring) if gear.mesh == "internal" else reach
    if "angle" in at:
        if point is not None:
            path = _path(path_of(scenario), at.whole("angle"))
            parts.append(Line(name, path[None], "path"))
        parts += _carried(at, scenario, size)
        forces = _forces(at, scenario)
    elif "tracer_x" in at and "tracer_y" in at:
        traced = np.stack([at.whole("tracer_x"), at.whole("tracer_y")], axis=-1)
        parts.append(Line(name, traced[None], "path"))
        dot, place = (Disc(0.0, 0.0, POINT * size, "path"),), (at["tracer_x"], at["tracer_y"])
        parts.append(Body("tracer point", dot, *place, at.still))
        reach = max(reach, float(np.hypot(*traced.T).max()))
    else:
        raise InputError(
            f"{REFUSED}: it has neither the channel angle nor tracer_x and tracer_y (see"
            " output.channels)"
        )
    scale = scale_of(forces, ARROW * gear.length)
    bounds = bounds_of(forces, reach, 2.0 * POINT * size, scale)
    readouts = (*at.contact(), *at.readouts(READOUTS))
    return Motion(at.time, (*parts, *forces), bounds, scale, readouts)


def _path(path: "TracerPath", angle: "Array") -> "Array":
    """Return the path over a range of angles of the crank by its closed form, (n, 2), m."""
    low, high = float(angle.min()), float(angle.max())
    turns = Fraction(path.turns).limit_denominator(MAX_TURNS)
    if abs(turns - path.turns) <= SAME * abs(path.turns):  # it closes
        high = min(high, low + 2.0 * pi * turns.denominator)
    count = min(int((high - low) * max(1.0, abs(path.turns)) / STEP) + 2, MAX_POINTS)
    return np.stack(path.position(np.linspace(low, high, count)), axis=-1)


def _wheel(at: Samples, scenario: "EpicyclicScenario", size: float) -> Body:
    """Return the sun, or the ring, with the bearing of the crank."""
    radius, hub = scenario.mechanism.sun_radius, Disc(0.0, 0.0, HINGE * size, "fixed")
    name, inner, discs = "sun", 0.9 * radius, [Disc(0.0, 0.0, radius, "still")]
    if scenario.mechanism.mesh == "internal":
        name, inner = "ring", radius
        discs = [Disc(0.0, 0.0, RING * radius, "still"), Disc(0.0, 0.0, radius, "paper")]
    outer = discs[0].radius
    marks = [ray(0.25 * pi * i, inner, outer, "fixed") for i in range(8)]
    return Body(name, (*discs, *marks, hub), at.still, at.still, at.still)


def _forces(at: Samples, scenario: "EpicyclicScenario") -> list[Part]:
    """Return G_OA, G_2, R_2, M_A and M_O of the paper's fig 2, as far as they are there.

    Hinge and mesh share a friction torque of a gear that sticks in a way that is indeterminate:
    the mesh takes as much of it as it can hold.
    """
    gear, effects, constants = scenario.mechanism, scenario.effects, constants_of(scenario)
    angle, parts = at["angle"], list[Part]()
    outward = vectors(np.cos(angle), np.sin(angle))
    g = effects.gravity.g if effects.gravity else 0.0
    weights: list[tuple[str, float, float, Role]] = [
        ("crank", 0.5, gear.crank_mass, "force-2"),
        ("planet", 1.0, gear.planet_mass, "load"),
    ]
    for name, part, mass, role in weights:
        if mass * g > 0.0:
            foot, weight = part * gear.length * outward, vectors(at.still, -mass * g)
            parts.append(Arrow(f"weight of the {name}", foot, weight, role))
    if "drive_torque" in at:
        parts += torque_arc("torque of the drive", at["drive_torque"], ARC * gear.length)
    if "angular_velocity" not in at:
        return parts
    speed, load = at["angular_velocity"], constants.G_2 * np.sin(angle)
    if constants.is_radial:
        load -= constants.mass_length * speed**2
    if "mesh" in constants.parts:
        foot, force = gear.sun_radius * outward, load[:, None] * outward
        parts.append(Arrow("force of the mesh on the planet", foot, force, "friction"))
    if "hinge" in constants.parts and "friction_torque" in at:
        torque, turns = at["friction_torque"], gear.planet_speed_ratio
        if gear.formulation == "published":
            couple = (torque + constants.lever.at_rest * load) / turns
        else:
            rolls = np.array([constants.lever.at(v) for v in speed])
            lever = np.where(speed == 0.0, constants.static_lever, rolls)
            mesh = np.minimum(lever * np.abs(load), np.abs(torque))
            couple = (torque - np.copysign(mesh, torque)) / (turns - 1.0)
        radius, hinge = ARC * gear.planet_radius, (gear.length * outward)[:, None]
        words = "couple of the hinge on the planet"
        parts += torque_arc(words, couple, radius, role="force-3", about=hinge)
    return parts


def _carried(at: Samples, scenario: "EpicyclicScenario", size: float) -> list[Part]:
    """Return planet, crank with its hinges, and tracer point."""
    angle, point, gear = at["angle"], scenario.effects.tracer_point, scenario.mechanism
    length, radius = gear.length, gear.planet_radius
    psi = radians(point.angle_deg) if point else pi
    planet = (
        Disc(0.0, 0.0, radius, "moving"),
        ray(psi, 0.0, max(radius, point.radius) if point else radius, "marked"),
        ray(psi + pi, 0.75 * radius, radius, "fixed"),
    )
    half = CRANK * size
    corners = np.array([(0.0, half), (length, half), (length, -half), (0.0, -half)])
    crank = (
        Outline(corners, "load", closed=True),
        Disc(0.0, 0.0, HINGE * size, "fixed"),
        Disc(length, 0.0, HINGE * size, "fixed"),
        Disc(length, 0.0, 0.4 * HINGE * size, "paper"),
    )
    place = length * np.cos(angle), length * np.sin(angle), gear.planet_speed_ratio * angle
    parts: list[Part] = [
        Body("planet", planet, *place),
        Body("crank", crank, at.still, at.still, angle),
    ]
    if point is not None:
        dot = Disc(point.radius * cos(psi), point.radius * sin(psi), POINT * size, "path")
        parts.append(Body("tracer point", (dot,), *place))
    return parts
