"""An epicyclic gear in motion: the crank carries a planet round the sun; the tracer's path.

The planet rolls, so that it turns by lambda = (r1 + r2)/r2 times the angle of the crank.
"""

from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.epicyclic.tracer_point import TracerPath, TracerPoint
from frictionsim.motion.frames import frames_with_events, readouts_at, state_at, values_at
from frictionsim.motion.parts import Body, Disc, Line, Motion, Part, Trail
from frictionsim.motion.shapes import bounds_around, ray
from frictionsim.scenario.toml_data import scenario_of, scenario_value

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array
    from frictionsim.results import Record

STEP, MAX_POINTS = 0.02, 12_000  # of a path: rad of the crank between points; number of points
CRANK, HINGE, POINT = 0.09, 0.16, 0.12  # half width and radii, of the planet's radius
SHOWN = ("angle", "angular velocity", "torque on the crank", "friction torque")
CHANNELS = ("angle", "angular_velocity", "drive_torque", "friction_torque")


def motion(result: "Record") -> Motion:
    """Return the motion of a result; without its angle only that of the tracer point."""
    frames = frames_with_events(result)
    sun, planet = (
        float(scenario_value(result, "mechanism", f"{part}_radius")) for part in ("sun", "planet")
    )
    time = values_at(result, "time", frames)
    point, still = _tracer_point(result), np.zeros_like(time)
    parts: list[Part] = [Body("sun", _sun(sun, planet), still, still, still)]
    length, reach = sun + planet, sun + 2.0 * planet
    if "angle" in result.channels:
        angle = values_at(result, "angle", frames)
        if point is not None:
            parts.append(_path(time, angle, TracerPath(sun, planet, point)))
            reach = max(reach, length + point.radius)
        parts += _carried(angle, length, planet, point)
    elif {"tracer_x", "tracer_y"} <= result.channels.keys():
        x, y = (values_at(result, f"tracer_{axis}", frames) for axis in "xy")
        parts.append(Trail("path of the tracer point", time, x, y))
        dot = (Disc(0.0, 0.0, POINT * planet, "path"),)
        parts.append(Body("tracer point", dot, x, y, still))
        reach = max(reach, float(np.hypot(x, y).max()))
    else:
        raise InputError(
            "cannot show this result in motion: it has neither the channel angle nor tracer_x and"
            " tracer_y (see output.channels)"
        )
    bounds = bounds_around(np.array([(-reach, -reach), (reach, reach)]), 2.0 * POINT * planet)
    readouts = readouts_at(result, dict(zip(CHANNELS, SHOWN, strict=True)), frames)
    return Motion(time, tuple(parts), bounds, state_at(result, frames), readouts)


def _tracer_point(result: "Record") -> TracerPoint | None:
    table = scenario_of(result).get("effects", {}).get("tracer_point")
    if table is None:
        return None
    try:
        return TracerPoint.model_validate(table)
    except ValueError:
        raise InputError("the scenario in this result has no valid effects.tracer_point") from None


def _sun(radius: float, planet: float) -> tuple[Disc | Line, ...]:
    """Return the sun, whose marks show that it stands still."""
    marks = tuple(ray(0.25 * pi * i, 0.9 * radius, radius, "fixed") for i in range(8))
    hub = Disc(0.0, 0.0, HINGE * planet, "fixed")
    return Disc(0.0, 0.0, radius, "still"), *marks, hub


def _carried(angle: "Array", length: float, radius: float, point: TracerPoint | None) -> list[Part]:
    """Return planet, crank, hinges and tracer point."""
    still = np.zeros_like(angle)
    psi = radians(point.angle_deg) if point else pi
    turn = length / radius * angle
    planet = (
        Disc(0.0, 0.0, radius, "moving"),
        ray(psi, 0.0, max(radius, point.radius) if point else radius, "marked"),
        ray(psi + pi, 0.75 * radius, radius, "fixed"),
    )
    half = CRANK * radius
    corners = np.array([(0.0, half), (length, half), (length, -half), (0.0, -half)])
    hinges = (
        Disc(0.0, 0.0, HINGE * radius, "fixed"),
        Disc(length, 0.0, HINGE * radius, "fixed"),
        Disc(length, 0.0, 0.4 * HINGE * radius, "paper"),
    )
    crank = (Line(corners, "load", closed=True), *hinges)
    place = still + length
    parts: list[Part] = [
        Body("planet", planet, place, still, turn, carrier=angle),
        Body("crank", crank, still, still, angle),
    ]
    if point is not None:
        dot = Disc(point.radius * cos(psi), point.radius * sin(psi), POINT * radius, "path")
        parts.append(Body("tracer point", (dot,), place, still, turn, carrier=angle))
    return parts


def _path(time: "Array", angle: "Array", path: TracerPath) -> Trail:
    """Return the path of the tracer point, finer than the frames where the crank is fast.

    Between frames the angle is linear in time, as that of the drawing is: the point stays on it.
    """
    steps = np.abs(np.diff(angle))
    finest = max(STEP, float(steps.sum()) / MAX_POINTS)
    counts = np.maximum(1, np.ceil(steps / finest)).astype(int)
    fraction = np.concatenate([*(np.arange(n) / n + i for i, n in enumerate(counts)), [len(steps)]])
    frames = np.arange(len(time))
    fine = np.interp(fraction, frames, time)
    x, y = path.position(np.interp(fraction, frames, angle))
    return Trail("path of the tracer point", fine, x.astype(np.float32), y.astype(np.float32))
