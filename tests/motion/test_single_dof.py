"""Pulley, marble machine and epicyclic gear in motion, against formulas of their own."""

from cmath import exp
from math import cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest

from tests.support.motions import (
    Arrow,
    Band,
    Body,
    Disc,
    Motion,
    Trail,
    body,
    is_visible,
    line_of,
    moment_of,
    motion,
    path_until,
    place_of,
    point_of,
    record_of,
)
from tests.support.scenarios import shipped

DRAWN = range(6)
TIMES = np.linspace(0.0, 2.0, 41)


def drawn_angles(rng: Any) -> Any:
    """Return angles that swing, run on or run back."""
    start, speed, swing = rng.uniform(-3.0, 3.0), rng.uniform(-9.0, 9.0), rng.uniform(0.0, 4.0)
    return start + speed * TIMES + swing * np.sin(3.0 * TIMES)


def arrow(animation: Motion, name: str) -> Arrow:
    return next(part for part in animation.parts if isinstance(part, Arrow) and part.name == name)


def drawn_pulley(number: int) -> tuple[dict[str, Any], dict[str, Any]]:
    rng = np.random.default_rng(number)
    angle, force = drawn_angles(rng), rng.uniform(100.0, 900.0) + 200.0 * np.sin(TIMES)
    radius = rng.uniform(0.02, 2.0)
    data = shipped(
        "pulley",
        mechanism__cord_radius=radius,
        mechanism__load=rng.uniform(10.0, 900.0),
        drive__direction=("vertical", "horizontal")[number % 2],
        effects__shaft_friction__shaft_radius=0.4 * radius,
    )
    torque = rng.uniform(-1.0, 1.0) * radius * force
    return data, {"time": TIMES, "angle": angle, "drive_force": force, "friction_torque": torque}


@pytest.mark.parametrize("number", DRAWN)
def test_a_pulley_turns_and_lifts_and_its_forces_are_on_one_scale(number: int) -> None:
    data, channels = drawn_pulley(number)
    animation, radius = (
        motion(record_of("pulley", channels, data)),
        data["mechanism"]["cord_radius"],
    )
    angle = channels["angle"]
    for i in (0, 7, 40):
        rim = point_of(animation, "pulley", TIMES[i], radius, 0.0)
        assert rim == pytest.approx(radius * exp(1j * angle[i]))
    between = 0.5 * (TIMES[3] + TIMES[4])
    assert point_of(animation, "pulley", between, radius, 0.0) == pytest.approx(
        radius * exp(0.5j * (angle[3] + angle[4]))
    )
    travel = next(r.value for r in animation.readouts if r.name == "travel of the load")
    assert travel == pytest.approx(radius * (angle - angle[0]))
    load = body(animation, "load")
    seen = np.ones(len(TIMES), bool) if load.visible is None else load.visible
    assert seen[0]
    assert load.y[seen] - load.y[0] == pytest.approx(travel[seen], abs=1e-9 * radius)
    cord = next(part for part in animation.parts if isinstance(part, Band))
    for i in (0, 20, 40):
        line = line_of(cord, moment_of(animation.time, TIMES[i]))
        assert line[0] == pytest.approx([load.x[i], load.y[i]])
        assert np.hypot(*line[1:-1].T) == pytest.approx(radius)
        # Tangential: the straight parts are at right angles to the radius where they meet it.
        assert np.dot(line[1], line[0] - line[1]) == pytest.approx(0.0, abs=1e-9)
        assert np.dot(line[-2], line[-1] - line[-2]) == pytest.approx(0.0, abs=1e-9)
    force, weight = channels["drive_force"], data["mechanism"]["load"]
    names = ("drive force", "weight of the load", "reaction of the shaft")
    drive, hung, reaction = (arrow(animation, name) for name in names)
    scale = -hung.dy[0] / weight
    assert scale > 0.0
    along = drive.dx if data["drive"]["direction"] == "horizontal" else drive.dy
    assert -along / force == pytest.approx(np.full(len(TIMES), scale))
    # The three forces balance, and the reaction has the moment of the friction.
    assert drive.dx + hung.dx + reaction.dx == pytest.approx(0.0 * TIMES, abs=1e-9)
    assert drive.dy + hung.dy + reaction.dy == pytest.approx(0.0 * TIMES, abs=1e-9)
    moment = (reaction.x * reaction.dy - reaction.y * reaction.dx) / scale
    assert moment == pytest.approx(channels["friction_torque"])


def test_a_long_travel_is_cut_and_said() -> None:
    animation = motion(record_of("pulley", {"time": TIMES, "angle": 50.0 * TIMES}))
    load, cut = body(animation, "load"), body(animation, "load, beyond the picture")
    assert np.array_equal(load.visible, ~cut.visible)
    assert load.visible[0]
    assert not load.visible[-1]
    cord = next(part for part in animation.parts if isinstance(part, Band))
    # The marks stand still on a cord that carries the load with it, and run once it is cut.
    moved = cord.travel + load.y - load.y[0]
    assert moved == pytest.approx(0.0508 * 50.0 * TIMES)


@pytest.mark.parametrize("number", DRAWN)
def test_slots_carry_marbles_on_the_rising_half(number: int) -> None:
    rng = np.random.default_rng(number)
    slots, radius = int(2 * rng.integers(2, 12)), rng.uniform(0.02, 0.5)
    data = shipped(
        "marble_machine",
        mechanism__slots=slots,
        mechanism__marble_circle_radius=radius,
        mechanism__gear_ratio=float(rng.uniform(2.0, 6.0)),
        mechanism__mesh_azimuth_deg=float(rng.uniform(-180.0, 180.0)),
    )
    angle = drawn_angles(rng)
    animation = motion(record_of("marble_machine", {"time": TIMES, "angle": angle}, data))
    first = next(i for i, p in enumerate(animation.parts) if p.name == "marbles")
    marbles = [
        part
        for part in animation.parts[first:]
        if isinstance(part, Body) and part.carrier is not None
    ]
    pitch = 2.0 * pi / slots
    for i, time in enumerate(TIMES):
        moment = moment_of(animation.time, time)
        seen = [place_of(part, moment)[:2] for part in marbles if is_visible(part, moment)]
        delta = angle[i] % pitch
        wanted = [
            (radius * sin(delta + j * pitch), -radius * cos(delta + j * pitch))
            for j in range(slots // 2)
        ]
        assert np.array(sorted(seen)) == pytest.approx(np.array(sorted(wanted)))
    # The pinion turns the other way, so that both rims have one speed where they touch.
    ratio = data["mechanism"]["gear_ratio"]
    azimuth = radians(data["mechanism"]["mesh_azimuth_deg"])
    distance = (ratio + 1.0) * data["mechanism"]["pinion_radius"]
    pinion = point_of(animation, "pinion", TIMES[9], 0.0, 0.0)
    assert pinion == pytest.approx(distance * exp(1j * azimuth))
    assert np.diff(body(animation, "pinion").angle) == pytest.approx(-ratio * np.diff(angle))


def teeth_of(shape: Any) -> int:
    """Return how often the outline of a gear rises above its mean radius; 0 of a disc."""
    if isinstance(shape, Disc):
        return 0
    high = np.hypot(*shape.points.T) > np.hypot(*shape.points.T).mean()
    return int(np.sum(high & ~np.roll(high, 1)))


@pytest.mark.parametrize(
    ("ratio", "teeth"), [(4.0, [56, 14]), (32.0 / 9.0, [64, 18]), (pi, [0, 0])]
)
def test_teeth_fit_the_ratio(ratio: float, teeth: list[int]) -> None:
    data = shipped("marble_machine", mechanism__gear_ratio=ratio)
    animation = motion(record_of("marble_machine", {"time": TIMES, "angle": TIMES}, data))
    assert [teeth_of(body(animation, name).shapes[0]) for name in ("gear", "pinion")] == teeth


@pytest.mark.parametrize("number", DRAWN)
def test_the_tracer_point_is_on_its_path(number: int) -> None:
    rng = np.random.default_rng(number)
    sun, planet = rng.uniform(0.01, 0.5, 2)
    radius, degrees = rng.uniform(0.0, 2.0) * planet, rng.uniform(-180.0, 180.0)
    data = shipped(
        "epicyclic",
        mechanism__sun_radius=sun,
        mechanism__planet_radius=planet,
        effects__tracer_point__radius=radius,
        effects__tracer_point__angle_deg=degrees,
    )
    angle = drawn_angles(rng)
    animation = motion(record_of("epicyclic", {"time": TIMES, "angle": angle}, data))
    trail = next(part for part in animation.parts if isinstance(part, Trail))
    dot = body(animation, "tracer point").shapes[0]
    length = sun + planet
    for time in rng.uniform(0.0, 2.0, 20):
        phi = np.interp(time, TIMES, angle)
        wanted = length * exp(1j * phi) + radius * exp(
            1j * (radians(degrees) + length / planet * phi)
        )
        seen = point_of(animation, "tracer point", time, dot.x, dot.y)
        assert seen == pytest.approx(wanted, abs=1e-9)
        tip = path_until(trail, time)[-1]
        assert complex(*tip) == pytest.approx(wanted, abs=0.001 * length)
        # It rolls: the point of the planet at the mesh stands still.
        assert point_of(animation, "planet", time, 0.0, 0.0) == pytest.approx(
            length * exp(1j * phi)
        )
    left, right, bottom, top = animation.bounds
    reach = max(length + radius, length + planet)
    assert min(-left, right, -bottom, top) >= reach


def test_a_fast_crank_has_a_fine_path() -> None:
    times = np.linspace(0.0, 1.0, 5)
    animation = motion(record_of("epicyclic", {"time": times, "angle": 12.0 * times}))
    trail = next(part for part in animation.parts if isinstance(part, Trail))
    legs = np.hypot(np.diff(trail.x), np.diff(trail.y))
    # |dz/dphi| <= L + lambda rho
    assert 0.0 < legs.max() <= 0.0201 * (0.18 + 3.0 * 0.06)
    assert np.all(np.diff(trail.time) > 0.0)


def test_a_gear_without_its_angle_shows_the_tracer_point_alone() -> None:
    x, y = 0.1 * np.cos(TIMES), 0.1 * np.sin(TIMES)
    record = record_of("epicyclic", {"time": TIMES, "tracer_x": x, "tracer_y": y})
    names = {part.name for part in motion(record).parts}
    assert names == {"sun", "path of the tracer point", "tracer point"}


@pytest.mark.parametrize("kind", ["pulley", "pulley_horizontal", "marble_machine", "epicyclic"])
def test_bounds_hold_everything_at_all_times(kind: str) -> None:
    data = shipped(kind)
    channels = {"time": TIMES, "angle": 5.0 * np.sin(2.0 * TIMES), "drive_force": 3e3 - 900 * TIMES}
    animation = motion(record_of(data["kind"], channels, data))
    left, right, bottom, top = animation.bounds
    for time in np.linspace(0.0, 2.0, 33):
        moment = moment_of(animation.time, time)
        for part in animation.parts:
            points: list[tuple[float, float]] = []
            if isinstance(part, Body):
                for shape in part.shapes if is_visible(part, moment) else ():
                    corners = (
                        shape.radius * np.exp(1j * np.arange(8)) + complex(shape.x, shape.y)
                        if isinstance(shape, Disc)
                        else shape.points @ np.array([1.0, 1j])
                    )
                    x, y, angle = place_of(part, moment)
                    points += [(z.real, z.imag) for z in corners * exp(1j * angle) + complex(x, y)]
            elif isinstance(part, Arrow):
                foot = moment.of(part.x), moment.of(part.y)
                points = [foot, (foot[0] + moment.of(part.dx), foot[1] + moment.of(part.dy))]
            elif isinstance(part, Band):
                points = [tuple(point) for point in line_of(part, moment)]
            for x, y in points:
                assert left <= x <= right, (part.name, x)
                assert bottom <= y <= top, (part.name, y)
