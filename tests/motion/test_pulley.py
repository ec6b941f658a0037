"""Pulleys in motion, with a load and with masses: places by closed forms, forces in balance."""

from functools import cache
from math import pi
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.motions import (
    Motion,
    arrow,
    body,
    lines,
    motion,
    number,
    point_of,
    record_of,
)
from tests.support.records import shown
from tests.support.scenarios import shipped

TIMES = np.linspace(0.0, 2.0, 41)
LIFT, SLACK_ROPE = "lift", "hard/lift_slack_rope"


def drawn_pulley(number: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a drawn scenario, and channels that no solver made."""
    rng = np.random.default_rng(number)
    angle = rng.uniform(-3.0, 3.0) + rng.uniform(-9.0, 9.0) * TIMES + 2.0 * np.sin(3.0 * TIMES)
    force = rng.uniform(100.0, 900.0) + 200.0 * np.sin(TIMES)
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


@pytest.mark.parametrize("number_", range(2))
def test_a_pulley_turns_and_lifts_and_its_forces_balance(number_: int) -> None:
    data, channels = drawn_pulley(number_)
    animation, radius = (
        motion(record_of("pulley", channels, data)),
        data["mechanism"]["cord_radius"],
    )
    angle, load = channels["angle"], body(animation, "load")
    for i in (0, 7, 40):
        rim = point_of(body(animation, "pulley"), i, radius, 0.0)
        assert rim == pytest.approx(radius * np.exp(1j * angle[i]))
    travel = number(animation, "travel of the load")
    assert travel - travel[0] == pytest.approx(radius * (angle - angle[0]))
    smaller = float(load.name.partition("1 : ")[2].rstrip(")") or 1.0)
    rise = smaller * (load.y - load.y[0])
    assert rise == pytest.approx(travel - travel[0], rel=5e-3, abs=5e-3 * radius)
    (cord,) = lines(animation, "cord")
    assert cord.points[:, 0] == pytest.approx(np.column_stack([load.x, load.y]))
    for line in cord.points[[0, 20, 40]]:
        assert np.hypot(*line[1:-1].T) == pytest.approx(radius)
        # The straight parts are at right angles to the radius where they meet it.
        assert np.dot(line[1], line[0] - line[1]) == pytest.approx(0.0, abs=1e-9)
        assert np.dot(line[-2], line[-1] - line[-2]) == pytest.approx(0.0, abs=1e-9)
    # The marks pass a fixed place as the rim does.
    assert cord.travel + load.y - load.y[0] == pytest.approx(travel)
    names = ("drive force", "weight of the load", "reaction of the shaft")
    drive, hung, reaction = (arrow(animation, name) for name in names)
    assert hung.vector[:, 1] == pytest.approx(-data["mechanism"]["load"])
    assert np.abs(drive.vector).max(axis=1) == pytest.approx(channels["drive_force"])
    assert drive.foot == pytest.approx(cord.points[:, -1])
    assert drive.vector + hung.vector + reaction.vector == pytest.approx(0.0, abs=1e-9)
    (x, y), (across, up) = reaction.foot.T, reaction.vector.T
    assert x * up - y * across == pytest.approx(channels["friction_torque"])
    longest = max(np.hypot(*each.vector.T).max() for each in (drive, hung, reaction))
    assert animation.scale * longest == pytest.approx(2.0 * radius)


def solved(name: str, **changes: Any) -> Record:
    return shown(name, solver__rtol=1e-8, **changes)


@cache
def moving(name: str) -> Motion:
    return motion(solved(name))


def integral(values: Any, time: Any) -> Any:
    """Return the integral from the start by trapezoids."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.mark.parametrize("name", [LIFT, SLACK_ROPE])
def test_the_masses_are_where_their_velocities_take_them(name: str) -> None:
    animation = moving(name)
    car, other = body(animation, "car"), body(animation, "counterweight")
    smaller = float(car.name.partition("1 : ")[2].rstrip(")") or 1.0)
    assert (smaller > 1.0) == (name == LIFT)
    way = integral(number(animation, "car, velocity"), animation.time)
    assert smaller * (car.y - car.y[0]) == pytest.approx(way, abs=5e-3 * np.ptp(way))
    slack = [one.value for one in animation.readouts if one.name == "rope of the car"]
    assert any(value.any() for value in slack) == (name == SLACK_ROPE)
    if name == LIFT:
        assert other.y - other.y[0] == pytest.approx(car.y[0] - car.y, abs=1e-12)


@pytest.mark.parametrize("name", [LIFT, SLACK_ROPE])
def test_tensions_and_reaction_are_the_channels_and_balance(name: str) -> None:
    animation, channels = moving(name), solved(name).channels
    at = np.searchsorted(channels["time"], animation.time, side="right") - 1
    right, left, reaction = (
        arrow(animation, each)
        for each in ("tension, car", "tension, counterweight", "reaction of the shaft")
    )
    assert right.vector[:, 1] == pytest.approx(-channels["rope_tension_car"][at])
    assert reaction.vector + right.vector + left.vector == pytest.approx(0.0, abs=1e-6)
    friction = channels["friction_torque"][at]
    assert reaction.foot[:, 0] * reaction.vector[:, 1] == pytest.approx(friction, abs=1e-9)
    assert right.foot[:, 0] == pytest.approx(shipped(name)["mechanism"]["cord_radius"])
    (drive,) = lines(animation, "torque of the drive")
    assert drive.size == pytest.approx(channels["drive_torque"][at])
    radius = 0.62 * shipped(name)["mechanism"]["cord_radius"]
    bow = drive.points[:, :25]
    assert np.hypot(*bow.reshape(-1, 2).T) == pytest.approx(radius)
    swept = np.unwrap(np.arctan2(bow[..., 1], bow[..., 0]), axis=1)
    turn = 0.75 * pi * drive.size / np.abs(drive.size).max()
    assert swept[:, -1] - swept[:, 0] == pytest.approx(turn)
    (detail,) = animation.details
    assert np.abs(reaction.foot[:, 0]).max() < detail.bounds[1]
