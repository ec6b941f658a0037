"""A body at rest on an end stop is at rest, with dry friction and without it."""

from math import degrees, sqrt
from typing import Any

import pytest

import frictionsim as fs


def body(value: Any, highest: float = 1.0, start: float = 0.0, **stop: float) -> fs.Scenario:
    return fs.load(
        {
            "kind": "shaft",
            "mechanism": {"inertia": 1.0, "initial_angle_deg": degrees(start)},
            "couples": [{"name": "motor", "size": value}],
            "effects": {"end_stops": {"highest_angle_deg": degrees(highest), **stop}},
            "solver": {"duration": 8.0},
        }
    )


def times(scenario: fs.Scenario) -> tuple[float | None, float | None]:
    quantities = fs.solve(scenario).quantities
    return quantities["breakaway_time"].value, quantities["last_rest_time"].value


@pytest.mark.parametrize(("torque", "highest"), [(1.0, 1.0), (3.0, 0.2)])
def test_a_body_without_friction_comes_to_rest_on_its_stop(torque: float, highest: float) -> None:
    breakaway, rest = times(body(torque, highest))
    assert breakaway is None
    # Uniformly accelerated, exact but for the rounding of the steps.
    assert rest == pytest.approx(sqrt(2.0 * highest / torque), rel=1e-12)


def test_a_body_that_bounces_comes_to_rest_after_its_last_bounce() -> None:
    # A restitution of 1/2: flights of 2 v/M, each half as long, from v = sqrt(2 M q).
    _, rest = times(body(1.0, restitution=0.5, capture_speed=1e-6))
    # The flights that are left out, below the capture speed, take 4e-6 s at most.
    assert rest == pytest.approx(sqrt(2.0) * (1.0 + 2.0 * 0.5 / (1.0 - 0.5)), abs=4e-6)


@pytest.mark.parametrize("turn", [3.0, 4.0, 5.5])
def test_it_leaves_the_stop_where_the_torque_turns(turn: float) -> None:
    torque = {"time": [0.0, turn - 1.0, turn + 1.0], "value": [1.0, 1.0, -1.0]}
    breakaway, rest = times(body(torque))
    assert breakaway == pytest.approx(turn, rel=1e-12)
    assert rest == pytest.approx(sqrt(2.0), rel=1e-12)


def test_a_body_that_never_meets_its_stop_is_never_at_rest() -> None:
    assert times(body(-1.0)) == (None, None)


def test_a_sweep_has_when_a_body_rests_on_its_stop() -> None:
    sweep = fs.sweep(body(1.0), vary={"couples.motor.size": [1.0, 2.0, -1.0]})
    rests = sweep["last_rest_time"].values
    assert rests[:2] == pytest.approx([sqrt(2.0), 1.0], rel=1e-12)
    assert rests[2] != rests[2]  # none
