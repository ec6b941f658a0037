"""End stops: located impacts, rest on a stop and leaving it, with every solver."""

from itertools import product
from math import ceil, inf, log, pi, radians, sqrt

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from frictionsim.results import Record
from frictionsim.solvers.end_stops import first_impact
from frictionsim.solvers.mechanism import EndStops
from tests.support.cases import one_in, slow
from tests.support.end_stops_reference import drawn_body, events_of, mirrored
from tests.support.scenarios import changed, simulate, sound
from tests.support.stopped_bodies import scenario_of, stopped, with_friction

HIGHEST, LOWEST = radians(60.0), radians(-50.0)
EXACT = ("events", "rkf45")
SMOOTH = ("events", "dop853", "radau", "lsoda")  # methods of a body without dry friction
PRESSED = {"time": [0.0, 4.0, 5.0, 8.0], "value": [0.5, 0.5, -0.5, -0.5]}  # turns at 4.5 s


def events(done: Record) -> list[tuple[str, int, int]]:
    return [(e.contact, e.mode_from, e.mode_to) for e in done.transitions]


def times(done: Record) -> list[float]:
    return [e.time for e in done.transitions]


@pytest.mark.parametrize("backend", SMOOTH)
def test_under_a_constant_torque_the_times_of_impact_are_a_geometric_series(backend: str) -> None:
    """And each flight is a parabola."""
    rtol = 1e-11 if backend == "events" else 1e-9
    done = sound(stopped(0.5, solver={"backend": backend, "duration": 8.0, "rtol": rtol}))
    fall = sqrt(2.0 * HIGHEST)  # the acceleration is 1 rad/s^2
    count = ceil(log(1e-3 / fall) / log(0.6)) + 1
    assert events(done) == [("stop", 1, -1)] * (count - 1) + [("stop", 1, 0)]
    flights = 2.0 * fall * 0.6 ** np.arange(1.0, count)
    expected = fall + np.concatenate(([0.0], np.cumsum(flights)))
    accuracy = {"events": 1e-12, "dop853": 1e-9, "radau": 1e-6, "lsoda": 1e-6}[backend]
    assert times(done) == pytest.approx(expected, abs=accuracy)
    angle = np.full(done.time.shape, HIGHEST)
    for begin, end, n in zip(expected, expected[1:], range(count), strict=False):
        x = done.time - begin
        inside = (x >= 0.0) & (done.time <= end)
        speed = fall * 0.6 ** (n + 1)
        angle[inside] += (-speed * x + 0.5 * x * x)[inside]
    first = done.time < fall
    angle[first] = 0.5 * done.time[first] ** 2
    assert done.channels["angle"] == pytest.approx(angle, abs=accuracy)
    if backend == "events":
        # A flight begins and ends at the stop within one step: some have no other.
        assert done.statistics.steps < 6 * count
    # The quantities and the lost energy from the closed form.
    assert done.quantities["impacts"].value == count
    assert done.quantities["impact_speed_max"].value == pytest.approx(fall, rel=accuracy)
    assert done.quantities["energy_impact"].value == pytest.approx(0.5 * HIGHEST, rel=accuracy)


@pytest.mark.parametrize(("seed", "backend"), one_in(3, product(range(25), EXACT)))
def test_drawn_bodies_move_as_in_the_independent_program(seed: int, backend: str) -> None:
    rng = np.random.default_rng(seed)
    body = drawn_body(rng)
    body = mirrored(body) if rng.random() < 0.5 else body
    expected, angle, velocity, speeds = events_of(body)
    done = sound(scenario_of(body, solver__backend=backend))
    assert events(done) == [event[1:4] for event in expected]
    # `rkf45` does not locate the rests.
    time, place = (1e-9, 1e-8) if backend == "events" or not body.static else (1e-7, 1e-7)
    assert times(done) == pytest.approx([event[0] for event in expected], abs=time)
    angles = [event.position for event in done.transitions]
    assert angles == pytest.approx([event[4] for event in expected], abs=place)
    last = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert last == pytest.approx([angle, velocity], abs=10.0 * place)
    assert done.quantities["impacts"].value == len(speeds)
    largest = done.quantities["impact_speed_max"].value
    assert largest == (pytest.approx(max(speeds), abs=10.0 * place) if speeds else None)


def test_the_drawn_bodies_are_of_all_sorts() -> None:
    bodies = [drawn_body(np.random.default_rng(seed)) for seed in range(25)]
    ends = [events_of(body)[0] for body in bodies]
    assert {body.restitution for body in bodies} == {0.0, 0.3, 0.6, 0.9}
    assert {body.lowest > -2.0 and body.highest < 2.0 for body in bodies} == {False, True}
    for attribute in ("static", "stiffness", "damping"):
        assert {getattr(body, attribute) > 0.0 for body in bodies} == {False, True}
    seen = {(name, s * a, s * b) for of_one in ends for _, name, a, b, _ in of_one for s in (1, -1)}
    impacts = {("stop", 1, 0), ("stop", 1, -1), ("stop", 0, 1)}
    assert seen >= {*impacts, ("shaft", 0, -1), ("shaft", 1, 0), ("shaft", 1, -1)}
    assert sum(map(len, ends)) > 150


LEAVING = [
    # law, method, when the body leaves a stop against 0.1 N m of dry friction, within
    ("", "events", 4.5, 1e-12),
    ("", "dop853", 4.5, 1e-12),
    ("", "radau", 4.5, 1e-12),
    ("set-valued", "events", 4.6, 1e-12),
    ("set-valued", "rkf45", 4.6, 1e-12),
    ("regularised", "rkf45", 4.6, 0.02),
    ("regularised", "lsoda", 4.6, 0.02),
]


@pytest.mark.parametrize(("law", "backend", "at", "within"), LEAVING)
def test_a_body_rests_on_a_stop_until_the_torque_turns(
    law: str, backend: str, at: float, within: float
) -> None:
    data = stopped(PRESSED, effects__end_stops__restitution=0.0, solver__backend=backend)
    data = changed(data, solver__duration=5.5)
    if law:
        data = with_friction(data, 0.1, 0.1, law=law)
    if backend != "events":
        data = changed(data, solver__rtol=1e-8)
    done = sound(data)
    hit = next(e for e in done.transitions if e.contact == "stop")
    assert (hit.mode_from, hit.mode_to, hit.position) == (1, 0, HIGHEST)
    left = next(e for e in done.transitions if e.time > hit.time)
    assert left.mode_to == -1
    assert left.time == pytest.approx(at, abs=within)
    assert left.position == pytest.approx(HIGHEST, abs=1e-12 if within < 1e-9 else 1e-3)
    assert left.contact == ("shaft" if law else "stop")
    channels, time = done.channels, done.time
    # Not a bit of motion; the stop takes all of the torque, dry friction none.
    resting = (time > hit.time) & (time < 4.5)
    assert resting.sum() > 20
    assert np.unique(channels["angle"][resting]).tolist() == [HIGHEST]
    assert not np.any(channels["angular_velocity"][resting])
    assert not np.any(channels["angular_acceleration"][resting])
    assert np.array_equal(channels["stop_torque"][resting], -channels["applied_torque"][resting])
    assert np.all(channels["stop_torque"][resting] < 0.0)
    assert not np.any(channels["stop_torque"][time > 4.5])
    assert not np.any(channels["stop_torque"][time < hit.time])
    if law == "set-valued":
        assert not np.any(channels["friction_torque"][resting])
        held = (time > 4.5) & (time < 4.6)
        assert np.array_equal(channels["friction_torque"][held], -channels["applied_torque"][held])


@pytest.mark.parametrize(
    ("law", "backend", "start"),
    [
        ("", "events", 60.0),
        slow("", "events", 59.9),
        slow("", "dop853", 60.0),
        slow("", "dop853", 59.9),
        slow("set-valued", "events", 60.0),
        ("set-valued", "events", 59.9),
        slow("set-valued", "rkf45", 60.0),
        slow("set-valued", "rkf45", 59.9),
        slow("regularised", "rkf45", 60.0),
        slow("regularised", "rkf45", 59.9),
        ("regularised", "radau", 60.0),
        slow("regularised", "radau", 59.9),
    ],
)
def test_a_short_turn_of_the_torque_after_a_long_rest_is_not_missed(
    law: str, backend: str, start: float
) -> None:
    """At rest all rates are zero, so that the steps of an integrator grow without end."""
    mean, amplitude, limit, frequency = 1.0, 1.005, 1e-3, 0.0137
    sine = {"mean": mean, "amplitude": amplitude, "frequency_hz": frequency, "phase_deg": 90.0}
    data = stopped(
        {"sine": sine},
        mechanism__initial_angle_deg=start,
        effects__end_stops__restitution=0.0,
        solver={"backend": backend, "duration": 60.0, "rtol": 1e-8},
        output__interval=1.0,
    )
    data = with_friction(data, limit, limit, law=law) if law else data
    turn = (mean + (limit if law else 0.0)) / amplitude  # cos w t = -turn
    expected = (pi - np.arccos(turn)) / (2.0 * pi * frequency)
    left = next(e for e in sound(data).transitions if e.time > 10.0)
    assert left.time == pytest.approx(expected, abs=0.5 if law == "regularised" else 1e-9)
    assert (left.contact, left.mode_from, left.mode_to) == ("shaft" if law else "stop", 0, -1)


class _Step:
    """A step whose angle is a polynomial of the time."""

    def __init__(self, rates: list[float], length: float, states: int) -> None:
        self._angle, self.t_old, self.t = Polynomial(rates), 0.0, length
        self._others = [0.0] * (states - 2)
        self.y_old, self.y = self.interpolate(0.0), self.interpolate(length)

    def interpolate(self, t: float) -> list[float]:
        return [float(self._angle(t)), float(self._angle.deriv()(t)), *self._others]

    def acceleration(self, t: float, y: list[float]) -> float:
        return float(self._angle.deriv(2)(t))


@pytest.mark.parametrize("top", [0.03, 0.2, 0.45, 0.8])
@pytest.mark.parametrize("s", [1, -1])
def test_a_body_that_turns_twice_within_a_step_hits_the_stop_in_between(top: float, s: int) -> None:
    """It turns at `top` of the step and once more after 0.1 of it, and is fast at both ends."""
    stops = EndStops(-HIGHEST, HIGHEST, restitution=0.0, capture_speed=1e-3)
    # v = (t - top)(t - top - 0.1) is positive but for a tenth of the step.
    speed = Polynomial.fromroots([top, top + 0.1])
    angle = speed.integ(lbnd=top)
    states = 5  # with the energies
    for excess, hit in ((1e-6, True), (-1e-6, False)):
        rates = (s * (angle + HIGHEST + excess)).coef.tolist()
        step = _Step(rates, top + 0.12, states)
        assert abs(step.y[0]) < HIGHEST
        time = first_impact(step, stops, step.acceleration)
        if not hit:
            assert time == inf
        else:
            assert abs(step.interpolate(time)[0]) == pytest.approx(HIGHEST, abs=1e-15)
            assert 0.0 < top - time < 0.1


def test_a_turn_beyond_the_stop_and_back_within_a_step_is_an_impact() -> None:
    """Of a body that would fly as a parabola into the stop and away: both ends are on one side."""
    data = stopped(
        -0.5,
        mechanism__initial_angular_velocity=1.0,  # the top is at 1 s and 0.5 rad
        effects__end_stops={"highest_angle_deg": degrees_of(0.4999), "restitution": 0.5},
        solver__duration=1.9,
    )
    for backend in ("events", "dop853", "rk45"):
        done = sound(changed(data, solver__backend=backend))
        assert events(done)[0] == ("stop", 1, -1)
        assert done.transitions[0].time == pytest.approx(1.0 - sqrt(2e-4), abs=1e-9)


def degrees_of(angle: float) -> float:
    return angle * 180.0 / pi


@pytest.mark.parametrize("backend", EXACT)
@pytest.mark.parametrize("is_dry", [False, True])
def test_a_body_may_start_at_its_stop(backend: str, is_dry: bool) -> None:
    data = stopped(0.5, mechanism__initial_angle_deg=60.0, solver__backend=backend)
    data = with_friction(data, 0.1, 0.1) if is_dry else data
    pressed = sound(data)
    assert pressed.transitions == []
    assert pressed.warnings == ("nothing moves: the body rests on its end stop",)
    # Thrown into it: it rebounds at once.
    into = sound(changed(data, mechanism__initial_angular_velocity=0.5))
    assert into.transitions[0][:4] == (0.0, "stop", 1, -1)
    assert into.quantities["impact_speed_max"].value == 0.5
    deceleration = 1.2 if is_dry else 1.0
    top = times(into)[1] if is_dry else 0.5 * times(into)[1]
    assert top == pytest.approx(0.6 * 0.5 / deceleration, abs=1e-7)
    # Away from it: as anywhere else.
    away = sound(changed(data, mechanism__initial_angular_velocity=-0.5))
    assert away.transitions[0].time > 0.1


@pytest.mark.parametrize(
    ("stop", "law", "backend"),
    one_in(
        3,
        [
            (stop, law, backend)
            for stop in (0.0, 60.0)
            for law, backend in [("", "events"), *(("dry", name) for name in EXACT)]
        ],
    ),
)
def test_a_tiny_capture_speed_does_not_make_flights_without_end(
    stop: float, law: str, backend: str
) -> None:
    """Where rounding would give the body as much speed as an impact takes, it stays at rest."""
    stops = {"highest_angle_deg": stop, "restitution": 0.9, "capture_speed": 1e-40}
    data = stopped(
        0.5,
        mechanism={"inertia": 0.5, "initial_angle_deg": stop - 60.0},
        effects__end_stops=stops,
        solver={"duration": 40.0, "rtol": 1e-9, "max_steps": 20_000, "backend": backend},
        output__interval=1.0,
    )
    data = with_friction(data, 0.1, 0.05) if law else data
    if (law, backend, stop) == ("dry", "events", 0.0):  # flights of nanoseconds
        failed = simulate(data)
        assert failed.failure == "chattering"
        assert failed.reason.endswith("or give a larger effects.end_stops.capture_speed")
        return
    done = sound(data)
    assert done.transitions[-1][1:4] == ("stop", 1, 0)
    assert 50 < done.quantities["impacts"].value < 400
