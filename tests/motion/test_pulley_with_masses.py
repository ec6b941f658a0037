"""A pulley with hanging masses in motion, against its velocities, masses and closed forms."""

from functools import cache
from math import atan, hypot, pi, sin
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import MODES, SLACK, Record
from tests.support.motions import (
    Arrow,
    Band,
    Motion,
    body,
    moment_of,
    motion,
    record_of,
    shown_word,
)
from tests.support.records import shown
from tests.support.scenarios import shipped

LIFT, SLACK_ROPE = "lift", "hard/lift_slack_rope"
TURNED = {"time": [0.0, 1.0, 2.0], "value": [0.0, 90.0, -30.0]}


def solved(name: str, **changes: Any) -> Record:
    return shown(name, solver__rtol=1e-8, **changes)


@cache
def moving(name: str) -> Motion:
    return motion(solved(name))


def integral(values: Any, time: Any) -> Any:
    """Return the integral from the start by trapezoids."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


def number(animation: Motion, name: str) -> Any:
    return next(r.value for r in animation.readouts if r.name == name)


def arrows(animation: Motion, name: str) -> list[Arrow]:
    return [p for p in animation.parts if isinstance(p, Arrow) and p.name == name]


def bands(animation: Motion) -> list[Band]:
    return [p for p in animation.parts if isinstance(p, Band) and p.name == "rope"]


def block(animation: Motion, name: str) -> Any:
    return next(p for p in animation.parts if p.name.split(" (")[0] == name)


def scale_of(animation: Motion) -> float:
    words = block(animation, "car").name.partition("1 : ")[2].rstrip(")")
    return float(words or 1.0)


@pytest.mark.parametrize("name", [LIFT, SLACK_ROPE])
def test_the_masses_are_where_their_velocities_take_them(name: str) -> None:
    animation, scale = moving(name), scale_of(moving(name))
    assert scale == (10.0 if name == LIFT else 1.0)
    way = integral(number(animation, "car, velocity"), animation.time)
    car, other = block(animation, "car"), block(animation, "counterweight")
    assert scale * (car.y - car.y[0]) == pytest.approx(way, abs=2e-4 * np.ptp(way))
    # The counterweight is never slack in these runs.
    if name == LIFT:
        assert other.y - other.y[0] == pytest.approx(car.y[0] - car.y, abs=1e-12)
    else:
        turned = 0.15 * integral(number(animation, "angular velocity"), animation.time)
        assert other.y - other.y[0] == pytest.approx(-turned, abs=2e-4 * np.ptp(turned))


def test_marks_on_the_cord_pass_those_of_the_rim_by_the_slip() -> None:
    animation, radius = moving(LIFT), 0.265
    over = bands(animation)[0]
    assert np.hypot(over.x, over.y) == pytest.approx(radius)
    passed = over.travel - radius * body(animation, "pulley").angle
    slip = integral(
        number(animation, "car, velocity") - radius * number(animation, "angular velocity"),
        animation.time,
    )
    assert passed == pytest.approx(slip, abs=1e-3)
    assert passed[-1] > 1.0
    starts = next(e.time for e in solved(LIFT).transitions if e.contact == "cord")
    assert np.all(np.abs(passed[animation.time <= starts]) < 1e-12)
    # As many marks as ticks, so that they meet at the start.
    assert over.spacing == pytest.approx(2.0 * pi * radius / 12)
    assert over.travel[0] == pytest.approx(radius * body(animation, "pulley").angle[0])


def test_marks_pass_from_the_wheel_to_the_hanging_rope() -> None:
    over, right, left = bands(moving(SLACK_ROPE))
    # Along the rope, from where it meets the wheel on the right: -travel on the right hanging part,
    # beyond half a turn on the left one. All marks are whole spacings apart.
    for between in (right.travel + over.travel, left.travel + pi * 0.15 - over.travel):
        spacings = between / over.spacing
        assert spacings == pytest.approx(np.round(spacings), abs=1e-9)
    assert np.ptp(over.travel) > over.spacing


def test_a_slack_rope_is_a_bow_as_long_as_the_rope() -> None:
    animation, record = moving(SLACK_ROPE), solved(SLACK_ROPE)
    _, right, left = bands(animation)
    car = block(animation, "car")
    lengths = np.hypot(np.diff(right.x, axis=1), np.diff(right.y, axis=1)).sum(axis=1)
    # The car's way above that of the rim, each integrated.
    rim = 0.15 * integral(number(animation, "angular velocity"), animation.time)
    gap = integral(number(animation, "car, velocity"), animation.time) - rim
    assert lengths == pytest.approx(-car.y + gap, abs=3e-4)
    assert gap.max() > 0.02
    assert left.x == pytest.approx(-0.15)
    assert right.x[:, [0, -1]] == pytest.approx(0.15)
    assert right.x.max() > 0.16
    slack = [e.time for e in record.transitions if SLACK in (e.mode_from, e.mode_to)]
    outside = (animation.time < slack[0]) | (animation.time > slack[-1])
    assert np.ptp(right.x[outside]) == 0.0


def test_a_rope_that_is_far_too_long_is_no_wider_than_the_picture() -> None:
    time = np.linspace(0.0, 1.0, 5)
    data = shipped("hard/lift_slack_rope")
    zero = np.zeros(5)
    channels = {"time": time, "angle": zero, "car_position": time, "counterweight_position": zero}
    _, right, _ = bands(motion(record_of("pulley", channels, data)))
    assert right.x.max() == pytest.approx(1.9 * 0.15)


@pytest.mark.parametrize("name", [LIFT, SLACK_ROPE])
def test_tensions_accelerate_the_masses_and_the_reaction_has_the_moment_of_the_friction(
    name: str,
) -> None:
    animation, record = moving(name), solved(name)
    masses = shipped(name)["effects"]["hanging_masses"]
    m1, m2 = (masses[key] + 0.5 * masses.get("rope", 0.0) for key in ("car", "counterweight"))
    right, left = arrows(animation, "tension of the rope")
    assert right.x == pytest.approx(-left.x)
    assert right.x.min() == pytest.approx(shipped(name)["mechanism"]["cord_radius"])
    (reaction,) = arrows(animation, "reaction of the shaft")
    assert reaction.dy == pytest.approx(-right.dy - left.dy)
    scale = reaction.dy.max() / record.channels["shaft_reaction"].max()
    velocity, rate = number(animation, "car, velocity"), number(animation, "angular velocity")
    radius = shipped(name)["mechanism"]["cord_radius"]
    other = -velocity if name == LIFT else -radius * rate
    times = [e.time for e in record.transitions]
    steps = np.diff(animation.time)
    # Differences of velocities over intervals in which nothing happens.
    quiet = steps > 1e-3
    for at in times:
        quiet &= ~((animation.time[:-1] < at) & (at <= animation.time[1:]))
    assert quiet.sum() > 300
    for arrow, mass, speed in ((right, m1, velocity), (left, m2, other)):
        drawn = -0.5 * (arrow.dy[1:] + arrow.dy[:-1]) / scale
        wanted = mass * (9.81 + np.diff(speed) / np.where(steps > 0.0, steps, 1.0))
        slack = (arrow.dy[1:] == 0.0) & (arrow.dy[:-1] == 0.0)
        wanted[slack] = 0.0
        # Where the drive bends within an interval the mean is not that of the ends.
        error = np.abs(drawn - wanted)[quiet] / (mass * 9.81)
        assert np.quantile(error, 0.98) < 1e-3
    friction = number(animation, "friction torque")
    assert reaction.x * reaction.dy / scale == pytest.approx(friction, abs=1e-9)
    (detail,) = animation.details
    assert max(abs(reaction.x)) < detail.bounds[1]


def test_the_torque_of_the_drive_is_an_arc_the_way_it_turns() -> None:
    animation = moving(SLACK_ROPE)
    (head,) = arrows(animation, "torque of the drive")
    line = next(p for p in animation.parts if isinstance(p, Band) and p.role == "force")
    torque = number(animation, "drive torque")
    assert np.hypot(line.x, line.y) == pytest.approx(0.62 * 0.15)
    swept = np.unwrap(np.arctan2(line.y, line.x), axis=1)
    turn = swept[:, -1] - swept[:, 0]
    assert turn == pytest.approx(0.75 * pi * torque / np.abs(torque).max())
    assert np.sign(head.x * head.dy - head.y * head.dx) == pytest.approx(np.sign(torque))


READOUTS = {"shaft": "shaft", "cord": "cord on the pulley", "car_rope": "rope of the car"}


@pytest.mark.parametrize("name", [LIFT, SLACK_ROPE])
def test_words_change_at_the_events_of_their_contact(name: str) -> None:
    animation, record = moving(name), solved(name)
    words = {mode: word.replace("sliding", "slips") for mode, word in MODES}
    shown = {r.name: r for r in animation.readouts if r.words}
    now = {"shaft": "stick", "cord": "stick", "car_rope": "taut"}
    for time in sorted({e.time for e in record.transitions}):
        for at, modes in ((np.nextafter(time, -1.0), now), (time, dict(now))):
            if at == time:
                now = modes | {
                    e.contact: words[e.mode_to] for e in record.transitions if e.time == time
                }
            for contact, readout in READOUTS.items():
                if readout in shown and at >= 0.0:
                    word = shown_word(shown[readout], moment_of(animation.time, at))
                    wanted = now[contact].replace("_", " ").replace("stick", "sticks")
                    assert word == wanted, (at, contact)
    assert len(record.transitions) > 4
    assert animation.state is None


def test_a_mirrored_lift_is_drawn_mirrored() -> None:
    torque = shipped(SLACK_ROPE)["drive"]["torque"]
    other = shipped(
        SLACK_ROPE,
        solver__rtol=1e-8,
        effects__hanging_masses__car=60.0,
        effects__hanging_masses__counterweight=80.0,
        drive__torque={"time": torque["time"], "value": [-value for value in torque["value"]]},
    )
    one, two = moving(SLACK_ROPE), motion(fs.solve(other).record)
    assert two.time == pytest.approx(one.time, abs=1e-9)
    for here, there in (("car", "counterweight"), ("counterweight", "car")):
        assert block(two, there).y == pytest.approx(block(one, here).y, abs=1e-6)
    (_, right, left), (_, right_two, left_two) = bands(one), bands(two)
    assert left_two.x == pytest.approx(-right.x, abs=2e-4)
    assert right_two.x == pytest.approx(-left.x, abs=2e-4)
    (reaction,), (mirrored,) = (
        arrows(animation, "reaction of the shaft") for animation in (one, two)
    )
    assert mirrored.x == pytest.approx(-reaction.x, abs=1e-6)
    words = [{r.name: r.value for r in animation.readouts if r.words} for animation in (one, two)]
    assert np.array_equal(words[1]["rope of the counterweight"], words[0]["rope of the car"])
    assert words[0]["rope of the car"].any()


def test_scales_are_round_and_large_enough() -> None:
    data = shipped("hard/lift_slack_rope", mechanism__cord_radius=0.1)
    time = np.linspace(0.0, 1.0, 5)
    for way in (0.0, 0.31, 0.33, 0.65, 1.7, 3.1, 90.0, 3.2e5):
        channels = {"time": time, "angle": 10.0 * way * time}
        channels |= {"car_position": way * time, "counterweight_position": -way * time}
        scale = scale_of(motion(record_of("pulley", channels, data)))
        assert way / scale <= 0.32 * (1.0 + 1e-12)
        assert f"{scale:e}"[0] in "125"
        # A finer one would not do.
        assert scale == 1.0 or way / scale > 0.32 / 2.6


@pytest.mark.parametrize("name", [LIFT, SLACK_ROPE, "hard/lift_moment_of_slack"])
def test_everything_is_within_the_bounds(name: str) -> None:
    animation = moving(name)
    left, right, bottom, top = animation.bounds
    for part in animation.parts:
        if isinstance(part, Arrow):
            x, y = part.x + part.dx, part.y + part.dy
        else:
            x, y = part.x, part.y  # type: ignore[union-attr]
        assert left <= x.min() <= x.max() <= right, part.name
        assert bottom <= y.min() <= y.max() <= top, part.name
    side = 0.9 * float(shipped(name)["mechanism"]["cord_radius"])
    assert block(animation, "car").y.min() - side > bottom


def test_no_counterweight_is_an_end_that_a_force_pulls() -> None:
    data = shipped(
        "lift",
        drive__torque=None,
        drive__force=9000.0,
        effects__hanging_masses__counterweight=0.0,
        effects__cord_friction=None,
        solver__duration=0.2,
        solver__rtol=1e-6,
    )
    animation = motion(fs.solve(data).record)
    names = {part.name.split(" (")[0] for part in animation.parts}
    assert "counterweight" not in names
    (force,) = arrows(animation, "drive force")
    end = bands(animation)[2]
    assert force.y == pytest.approx(end.y[:, -1])


def test_a_pulley_that_a_torque_turns_shows_it_and_its_reaction() -> None:
    data = shipped(
        "pulley", drive__force=None, drive__torque=TURNED, solver__rtol=1e-6, solver__duration=2.0
    )
    animation = motion(fs.solve(data).record)
    (weight,), (reaction,) = (
        arrows(animation, "weight of the load"),
        arrows(animation, "reaction of the shaft"),
    )
    assert reaction.dy == pytest.approx(-weight.dy)
    friction = number(animation, "friction torque")
    assert reaction.x * data["mechanism"]["load"] == pytest.approx(friction, abs=1e-9)
    (head,) = arrows(animation, "torque of the drive")
    assert hypot(head.x[0], head.y[0]) == pytest.approx(0.62 * data["mechanism"]["cord_radius"])
    assert number(animation, "drive torque").max() == pytest.approx(90.0)


@pytest.mark.parametrize("shaft", [0.05, 0.01])
def test_both_friction_circles_are_in_the_enlarged_view(shaft: float) -> None:
    data = shipped("lift", effects__shaft_friction__shaft_radius=shaft)
    names = ("time", "angle", "car_position", "counterweight_position")
    animation = motion(record_of("pulley", dict.fromkeys(names, np.linspace(0.0, 0.1, 3)), data))
    friction = data["effects"]["shaft_friction"]
    (detail,) = animation.details
    for name, key in (("static friction circle", "mu_s"), ("kinetic friction circle", "mu_k")):
        (circle,) = body(animation, name).shapes
        assert circle.radius == pytest.approx(shaft * sin(atan(friction[key])))
        # Large enough to be seen, and inside.
        assert 0.2 * detail.bounds[1] < circle.radius < detail.bounds[1]
