"""Marble machine and epicyclic gear in motion, against formulas of their own."""

from math import cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.motions import Body, body, lines, motion, number, point_of, record_of
from tests.support.scenarios import shipped

TIMES = np.linspace(0.0, 2.0, 41)


def drawn_angles(rng: Any) -> Any:
    """Return angles that swing, run on or run back."""
    start, speed, swing = rng.uniform(-3.0, 3.0), rng.uniform(-9.0, 9.0), rng.uniform(0.0, 4.0)
    return start + speed * TIMES + swing * np.sin(3.0 * TIMES)


@pytest.mark.parametrize("drawn", range(4))
def test_slots_carry_marbles_on_the_rising_half(drawn: int) -> None:
    rng = np.random.default_rng(drawn)
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
    marbles = [part for part in animation.parts if isinstance(part, Body) and len(part.shapes) == 1]
    marbles = [part for part in marbles if part.visible is not None]
    pitch = 2.0 * pi / slots
    for i in range(len(TIMES)):
        seen = [
            point_of(part, i, part.shapes[0].x, part.shapes[0].y)
            for part in marbles
            if part.visible[i]
        ]
        delta = angle[i] % pitch
        turns = delta + pitch * np.arange(slots // 2)
        wanted = [complex(radius * sin(turn), -radius * cos(turn)) for turn in turns]
        order = np.argsort([z.imag for z in seen])
        assert np.array(seen)[order] == pytest.approx(np.array(wanted))
    # The pinion turns the other way, so that both rims have one speed where they touch.
    ratio = data["mechanism"]["gear_ratio"]
    azimuth = radians(data["mechanism"]["mesh_azimuth_deg"])
    distance = (ratio + 1.0) * data["mechanism"]["pinion_radius"]
    pinion = body(animation, "pinion")
    assert point_of(pinion, 9, 0.0, 0.0) == pytest.approx(distance * np.exp(1j * azimuth))
    assert np.diff(pinion.angle) == pytest.approx(-ratio * np.diff(angle))


def test_a_marble_changes_hands_at_its_transfer() -> None:
    record = fs.solve(shipped("marble_machine", solver__rtol=1e-6)).record
    animation = motion(record)
    transfers = [e for e in record.transitions if e.contact == "transfer"]
    assert len(transfers) > 6
    delivered = number(animation, "marbles delivered")
    for frame, time in enumerate(animation.time):
        assert delivered[frame] == sum(e.mode_to for e in transfers if e.time <= time)


@pytest.mark.parametrize("drawn", range(4))
def test_the_planet_rolls_and_the_tracer_point_is_on_its_path(drawn: int) -> None:
    rng = np.random.default_rng(drawn)
    sun, planet = rng.uniform(0.01, 0.5, 2)
    radius, degrees = rng.uniform(0.0, 2.0) * planet, rng.uniform(-180.0, 180.0)
    data = shipped(
        "epicyclic",
        mechanism__sun_radius=sun,
        mechanism__planet_radius=planet,
        effects__tracer_point__radius=radius,
        effects__tracer_point__angle_deg=degrees,
    )
    angle, length = drawn_angles(rng), sun + planet
    animation = motion(record_of("epicyclic", {"time": TIMES, "angle": angle}, data))
    (path,) = lines(animation, "path of the tracer point")
    traced = path.points[0] @ np.array([1.0, 1j])
    tracer, dot = body(animation, "tracer point"), body(animation, "tracer point").shapes[0]
    for i in (0, 9, 23, 40):
        turn = radians(degrees) + length / planet * angle[i]
        wanted = length * np.exp(1j * angle[i]) + radius * np.exp(1j * turn)
        assert point_of(tracer, i, dot.x, dot.y) == pytest.approx(wanted, abs=1e-9)
        assert np.abs(traced - wanted).min() < 1e-9
        # It rolls: the point of the planet at the mesh stands still, and is on the sun.
        hub = point_of(body(animation, "planet"), i, 0.0, 0.0)
        assert hub == pytest.approx(length * np.exp(1j * angle[i]))
    legs = np.abs(np.diff(traced))
    assert legs.max() <= 0.0501 * (length + length / planet * radius)  # |dz/dphi|
    left, right, bottom, top = animation.bounds
    assert min(-left, right, -bottom, top) >= max(length + radius, length + planet)


def test_a_gear_without_its_angle_shows_the_tracer_point_alone() -> None:
    x, y = 0.1 * np.cos(TIMES), 0.1 * np.sin(TIMES)
    record = record_of("epicyclic", {"time": TIMES, "tracer_x": x, "tracer_y": y})
    names = {part.name for part in motion(record).parts}
    assert names == {"sun", "path of the tracer point", "tracer point"}
