"""An epicyclic gear in motion: the crank carries a planet round the sun; the tracer's path.

The planet rolls, so that it turns by lambda = (r1 + r2)/r2 times the angle of the crank.
"""

from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.epicyclic.tracer_point import TracerPath, TracerPoint
from frictionsim.motion.parts import Body, Disc, Line, Motion, Outline, Part
from frictionsim.motion.samples import Samples
from frictionsim.motion.shapes import bounds_around, ray
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.results import Record

STEP, MAX_POINTS = 0.05, 3000  # of a path: rad of the crank between points; number of points
CRANK, HINGE, POINT = 0.09, 0.16, 0.12  # half width and radii, of the planet's radius
READOUTS = {
    "angle": "angle",
    "angular_velocity": "angular velocity",
    "drive_torque": "torque on the crank",
    "friction_torque": "friction torque",
}


def motion(record: "Record", sample: int | None = None) -> Motion:
    """Return the motion of a result, or of one of its samples.

    Without the angle it is that of the tracer point alone.
    """
    at = Samples(record, sample)
    sun, planet = (
        float(scenario_value(record, "mechanism", f"{part}_radius")) for part in ("sun", "planet")
    )
    point, length = _tracer_point(record), sun + planet
    reach = max(sun + 2.0 * planet, length + (point.radius if point else 0.0))
    marks = tuple(ray(0.25 * pi * i, 0.9 * sun, sun, "fixed") for i in range(8))
    hub = Disc(0.0, 0.0, HINGE * planet, "fixed")
    shapes: tuple[Disc | Outline, ...] = (Disc(0.0, 0.0, sun, "still"), *marks, hub)
    parts: list[Part] = [Body("sun", shapes, at.still, at.still, at.still)]
    if "angle" in at:
        angle = at["angle"]
        if point is not None:
            path = TracerPath(sun, planet, point)
            finest = max(STEP, float(np.abs(np.diff(angle)).sum()) / MAX_POINTS)
            counts = np.maximum(1, np.ceil(np.abs(np.diff(angle)) / finest)).astype(int)
            legs = zip(angle, angle[1:], counts, strict=False)
            fine = [np.linspace(start, stop, n, False) for start, stop, n in legs]
            xy = path.position(np.concatenate([*fine, angle[-1:]]))
            parts.append(Line("path of the tracer point", np.stack(xy, axis=-1)[None], "path"))
        parts += _carried(at, length, planet, point)
    elif "tracer_x" in at and "tracer_y" in at:
        x, y = at["tracer_x"], at["tracer_y"]
        parts.append(Line("path of the tracer point", np.stack([x, y], axis=-1)[None], "path"))
        parts.append(Body("tracer point", (Disc(0, 0, POINT * planet, "path"),), x, y, at.still))
        reach = max(reach, float(np.hypot(x, y).max()))
    else:
        raise InputError(
            "cannot show this result in motion: it has neither the channel angle nor tracer_x and"
            " tracer_y (see output.channels)"
        )
    bounds = bounds_around(np.array([(-reach, -reach), (reach, reach)]), 2.0 * POINT * planet)
    readouts = (*at.contact(), *at.readouts(READOUTS))
    return Motion(at.time, tuple(parts), bounds, readouts=readouts)


def _tracer_point(record: "Record") -> TracerPoint | None:
    table = scenario_of(record).get("effects", {}).get("tracer_point")
    if table is None:
        return None
    try:
        return TracerPoint.model_validate(table)
    except ValueError:
        raise InputError("the scenario in this result has no valid effects.tracer_point") from None


def _carried(at: Samples, length: float, radius: float, point: TracerPoint | None) -> list[Part]:
    """Return planet, crank with its hinges, and tracer point."""
    angle = at["angle"]
    psi = radians(point.angle_deg) if point else pi
    planet = (
        Disc(0.0, 0.0, radius, "moving"),
        ray(psi, 0.0, max(radius, point.radius) if point else radius, "marked"),
        ray(psi + pi, 0.75 * radius, radius, "fixed"),
    )
    half = CRANK * radius
    corners = np.array([(0.0, half), (length, half), (length, -half), (0.0, -half)])
    crank = (
        Outline(corners, "load", closed=True),
        Disc(0.0, 0.0, HINGE * radius, "fixed"),
        Disc(length, 0.0, HINGE * radius, "fixed"),
        Disc(length, 0.0, 0.4 * HINGE * radius, "paper"),
    )
    place = length * np.cos(angle), length * np.sin(angle), length / radius * angle
    parts: list[Part] = [
        Body("planet", planet, *place),
        Body("crank", crank, at.still, at.still, angle),
    ]
    if point is not None:
        dot = Disc(point.radius * cos(psi), point.radius * sin(psi), POINT * radius, "path")
        parts.append(Body("tracer point", (dot,), *place))
    return parts
