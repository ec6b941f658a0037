"""End stops: located impacts, rest on a stop and leaving it, which `events` alone has."""

from math import ceil, degrees, log, pi, radians, sqrt
from typing import Any

import numpy as np
import pytest

from tests.support.end_stops_reference import drawn_body, events_of
from tests.support.scenarios import changed, events, simulate, sound, times
from tests.support.stopped_bodies import scenario_of, stopped, with_friction

HIGHEST = radians(60.0)
PRESSED = {"time": [0.0, 4.0, 5.0, 8.0], "value": [0.5, 0.5, -0.5, -0.5]}  # turns at 4.5 s


def test_under_a_constant_torque_the_times_of_impact_are_a_geometric_series() -> None:
    done = sound(stopped(0.5))
    fall = sqrt(2.0 * HIGHEST)  # the acceleration is 1 rad/s^2
    count = ceil(log(1e-3 / fall) / log(0.6)) + 1
    assert events(done) == [("stop", 1, -1)] * (count - 1) + [("stop", 1, 0)]
    flights = 2.0 * fall * 0.6 ** np.arange(1.0, count)
    expected = fall + np.concatenate(([0.0], np.cumsum(flights)))
    accuracy = 3e-12  # of the last flights: some roundings of the angle, at 1e-3 rad/s
    assert times(done) == pytest.approx(expected, abs=accuracy)
    # A flight begins and ends at the stop: most have two steps.
    assert done.statistics.steps < 6 * count
    # The quantities and the lost energy from the closed form.
    assert done.quantities["impacts"].value == count
    assert done.quantities["impact_speed_max"].value == pytest.approx(fall, rel=accuracy)
    assert done.quantities["energy_impact"].value == pytest.approx(0.5 * HIGHEST, rel=accuracy)


SEEDS = (0, 2, 4, 6, 8, 10, 12, 14, 16, 18)


@pytest.mark.parametrize("seed", SEEDS)
def test_drawn_bodies_move_as_in_the_independent_program(seed: int) -> None:
    body = drawn_body(np.random.default_rng(seed))
    expected, angle, velocity, speeds = events_of(body)
    done = sound(scenario_of(body))
    assert events(done) == [event[1:4] for event in expected]
    time, place = 1e-9, 1e-8
    assert times(done) == pytest.approx([event[0] for event in expected], abs=time)
    angles = [event.position for event in done.transitions]
    assert angles == pytest.approx([event[4] for event in expected], abs=place)
    last = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert last == pytest.approx([angle, velocity], abs=10.0 * place)
    assert done.quantities["impacts"].value == len(speeds)
    largest = done.quantities["impact_speed_max"].value
    assert largest == (pytest.approx(max(speeds), abs=10.0 * place) if speeds else None)


def test_the_drawn_bodies_are_of_all_sorts() -> None:
    bodies = [drawn_body(np.random.default_rng(seed)) for seed in SEEDS]
    for attribute in ("static", "stiffness", "damping"):
        assert {getattr(body, attribute) > 0.0 for body in bodies} == {False, True}
    ends = [events_of(body)[0] for body in bodies]
    seen = {(name, s * a, s * b) for of_one in ends for _, name, a, b, _ in of_one for s in (1, -1)}
    impacts = {("stop", 1, 0), ("stop", 1, -1), ("stop", 0, 1)}
    assert seen >= {*impacts, ("shaft", 0, -1), ("shaft", 1, 0), ("shaft", 1, -1)}


@pytest.mark.parametrize(("is_dry", "at"), [(False, 4.5), (True, 4.6)])
def test_a_body_rests_on_a_stop_until_the_torque_turns(is_dry: bool, at: float) -> None:
    """And passes 0.1 N m of dry friction."""
    data = stopped(PRESSED, effects__end_stops__restitution=0.0, solver__duration=5.5)
    done = sound(with_friction(data, 0.1, 0.1) if is_dry else data)
    hit = next(e for e in done.transitions if e.contact == "stop")
    assert (hit.mode_from, hit.mode_to, hit.position) == (1, 0, HIGHEST)
    left = next(e for e in done.transitions if e.time > hit.time)
    assert left.mode_to == -1
    assert left.time == pytest.approx(at, abs=1e-12)
    assert left.position == pytest.approx(HIGHEST, abs=1e-12)
    assert left.contact == ("shaft" if is_dry else "stop")
    channels, time = done.channels, done.time
    # Not a bit of motion; the stop takes all of the torque, dry friction none.
    resting = (time > hit.time) & (time < 4.5)
    assert resting.sum() > 20
    assert np.unique(channels["angle"][resting]).tolist() == [HIGHEST]
    assert not np.any(channels["angular_acceleration"][resting])
    assert np.array_equal(channels["stop_torque"][resting], -channels["applied_torque"][resting])
    assert not np.any(channels["stop_torque"][(time > 4.5) | (time < hit.time)])
    if is_dry:
        assert not np.any(channels["friction_torque"][resting])
        held = (time > 4.5) & (time < 4.6)
        assert np.array_equal(channels["friction_torque"][held], -channels["applied_torque"][held])


@pytest.mark.parametrize(("is_dry", "start"), [(False, 60.0), (True, 59.9)])
def test_a_short_turn_of_the_torque_after_a_long_rest_is_not_missed(
    is_dry: bool, start: float
) -> None:
    """At rest all rates are zero, so that the steps of an integrator grow without end."""
    mean, amplitude, limit, frequency = 1.0, 1.005, 1e-3, 0.0137
    sine = {"mean": mean, "amplitude": amplitude, "frequency_hz": frequency, "phase_deg": 90.0}
    data = stopped(
        {"sine": sine},
        mechanism__initial_angle_deg=start,
        effects__end_stops__restitution=0.0,
        solver={"duration": 60.0, "rtol": 1e-8},
        output__interval=1.0,
    )
    data = with_friction(data, limit, limit) if is_dry else data
    turn = (mean + (limit if is_dry else 0.0)) / amplitude  # cos w t = -turn
    expected = (pi - np.arccos(turn)) / (2.0 * pi * frequency)
    left = next(e for e in sound(data).transitions if e.time > 10.0)
    assert left.time == pytest.approx(expected, abs=1e-9)
    assert (left.contact, left.mode_from, left.mode_to) == ("shaft" if is_dry else "stop", 0, -1)


def test_a_turn_beyond_the_stop_and_back_within_a_step_is_an_impact() -> None:
    """Of a body that would fly as a parabola into the stop and away: both ends are on one side."""
    data = stopped(
        -0.5,
        mechanism__initial_angular_velocity=1.0,  # the top is at 1 s and 0.5 rad
        effects__end_stops={"highest_angle_deg": degrees(0.4999), "restitution": 0.5},
        solver__duration=1.9,
    )
    done = sound(data)
    assert events(done)[0] == ("stop", 1, -1)
    assert done.transitions[0].time == pytest.approx(1.0 - sqrt(2e-4), abs=1e-9)


def test_a_body_may_leave_a_stop_at_once() -> None:
    """The torque turned before it came: it rests for no time."""
    torque = {"time": [0.0, 0.5, 0.6], "value": [1.0, 1.0, -0.5]}
    done = sound(stopped(torque, effects__end_stops={"highest_angle_deg": 40.0}))
    assert events(done)[:2] == [("stop", 1, 0), ("stop", 0, -1)]
    assert times(done)[0] == times(done)[1]


@pytest.mark.parametrize("is_dry", [False, True])
def test_a_body_may_start_at_its_stop(is_dry: bool) -> None:
    data = stopped(0.5, mechanism__initial_angle_deg=60.0)
    data = with_friction(data, 0.1, 0.1) if is_dry else data
    pressed = sound(data)
    assert pressed.transitions == []
    assert pressed.warnings == ("nothing moves: the body rests on its end stop",)
    # Thrown into it: it rebounds at once.
    into = sound(changed(data, mechanism__initial_angular_velocity=0.5))
    assert into.transitions[0][:4] == (0.0, "stop", 1, -1)
    deceleration = 1.2 if is_dry else 1.0
    top = times(into)[1] if is_dry else 0.5 * times(into)[1]
    assert top == pytest.approx(0.6 * 0.5 / deceleration, abs=1e-7)
    # Away from it: as anywhere else.
    away = sound(changed(data, mechanism__initial_angular_velocity=-0.5))
    assert away.transitions[0].time > 0.1


@pytest.mark.parametrize("is_dry", [False, True])
def test_a_tiny_capture_speed_does_not_make_flights_without_end(is_dry: bool) -> None:
    """Where rounding would give the body as much speed as an impact takes, it stays at rest."""
    data = stopped(
        0.5,
        mechanism={"inertia": 0.5, "initial_angle_deg": -60.0},
        effects__end_stops={"highest_angle_deg": 0.0, "restitution": 0.9, "capture_speed": 1e-40},
        solver={"duration": 40.0, "rtol": 1e-9, "max_steps": 20_000},
        output__interval=1.0,
    )
    if is_dry:  # flights of nanoseconds
        failed = simulate(with_friction(data, 0.1, 0.05))
        assert failed.failure == "chattering"
        assert failed.reason.endswith("or give a larger effects.end_stops.capture_speed")
        return
    done = sound(data)
    assert done.transitions[-1][1:4] == ("stop", 1, 0)
    assert 50 < done.quantities["impacts"].value < 400


@pytest.mark.parametrize(
    ("size", "speed"),
    [
        ({"sine": {"amplitude": 1.0, "frequency_hz": 1.0}}, 0.0),
        (0.0, 0.0),
        ({"time": [0.0, 0.5, 1.0], "value": [0.0, 0.0, 0.2]}, 0.1),
        ({"time": [0.0, 1.0], "value": [1e-20, -1.0]}, -1.0),
    ],
)
def test_a_body_without_friction_starts_from_rest_between_its_stops(
    size: Any, speed: float
) -> None:
    """0.5 w is the integral of the couple, as it reaches no stop."""
    done = sound(stopped(size, solver__duration=1.0))
    assert done.channels["angular_velocity"][-1] == pytest.approx(speed, abs=1e-9)
    assert done.transitions == []
