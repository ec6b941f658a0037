"""Pulley, lift and shaft of prescribed speed: closed forms, independent programs, refusals."""

from math import exp, hypot, pi
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import frictionsim as fs
from tests.support import shaft_forces
from tests.support.cases import one_in
from tests.support.problems import cases
from tests.support.scenarios import Scenario, pulley, shipped, sound
from tests.support.second_way import signal

R_K = 0.0254 * 0.1 / hypot(1.0, 0.1)  # m, of the shipped pulley
R_S = 0.0254 * 0.2 / hypot(1.0, 0.2)


def drum(speed: Any, **changes: Any) -> Scenario:
    """Return the shipped pulley at a given speed."""
    return pulley(drive={"speed": speed}, **changes)


CLOSE = 1e-9  # of what is largest; the run has a relative tolerance of 1e-12 a step
OFTEN = {f"given speed {n}" for n in (2, 8, 9, 23, 77)}  # ropes and cords


@pytest.mark.parametrize("case", [
    pytest.param(case, id=case["name"], marks=[] if case["name"] in OFTEN else pytest.mark.slow)
    for case in cases("given_speed")
])  # fmt: skip
def test_a_drawn_lift_has_the_events_and_numbers_of_an_independent_program(
    case: dict[str, Any],
) -> None:
    done = sound(case["scenario"])
    for contact in ("cord", "car_rope", "counterweight_rope"):
        seen = [e for e in done.transitions if e.contact == contact]
        wanted = [event for event in case["events"] if event[1] == contact]
        assert [[e.mode_from, e.mode_to] for e in seen] == [event[2:] for event in wanted]
        times = [event[0] for event in wanted]
        assert [e.time for e in seen] == pytest.approx(times, abs=CLOSE)
    times, *columns = zip(*case["samples"], strict=True)
    rows = [int(np.argmin(abs(done.time - t))) for t in times]
    names = ("angle", "angular_velocity", "rope_tension_car", "rope_tension_counterweight",
             "car_position", "car_velocity", "drive_torque")  # fmt: skip
    for name, values in zip(names, columns, strict=True):
        size = CLOSE * float(np.max(abs(done.channels[name])))
        assert done.channels[name][rows] == pytest.approx(np.array(values), abs=size), name
    scale = max(case["scale"], float(done.channels["energy_kinetic"].max()))
    for name, energy in case["energies"].items():
        seen_energy = done.channels.get(name, np.zeros(1))[-1]
        assert seen_energy == pytest.approx(energy, abs=CLOSE * scale), name


def test_a_drum_at_constant_speed_takes_load_friction_and_damping() -> None:
    done = sound(drum(3.0))
    torque = 2224.1 * 0.0508 + R_K * 2224.1 + 1.355 * 3.0
    assert done.channels["drive_torque"] == pytest.approx(torque, rel=1e-14)  # roundings
    assert done.channels["energy_input"][-1] == pytest.approx(9.0 * torque, rel=1e-12)
    assert done.channels["angle"] == pytest.approx(3.0 * done.time, rel=1e-12)


def test_a_drum_is_raised_held_and_reversed() -> None:
    speed = {"time": [0.0, 1.0, 2.0, 2.5, 3.0], "value": [0.0, 4.0, 0.0, 0.0, -2.0]}
    done = sound(drum(speed, effects__viscous_damping=None, output__interval=0.1))
    weight, friction = 2224.1 * 0.0508, R_K * 2224.1
    torque = np.interp(done.time, [0.5, 0.95, 1.05, 1.95, 2.0, 2.45, 2.55], [
        1.355 * 4.0 + friction, 1.355 * 4.0 + friction, -1.355 * 4.0 + friction,
        -1.355 * 4.0 + friction, 0.0, 0.0, -1.355 * 4.0 - friction,
    ])  # fmt: skip
    sure = np.min(np.abs(done.time[:, None] - np.array([1.0, 2.0, 2.5])), axis=1) > 1e-6
    assert done.channels["drive_torque"][sure] == pytest.approx((weight + torque)[sure], rel=1e-13)
    assert [(e.contact, e.mode_from, e.mode_to) for e in done.transitions] == [
        ("shaft", 1, 0),
        ("shaft", 0, -1),
    ]
    assert [e.time for e in done.transitions] == pytest.approx([2.0, 2.5], abs=1e-15)
    (warning,) = [text for text in done.warnings if "undetermined" in text]
    limit = f"{R_S * 2224.1:.4g} N m"
    assert warning.startswith("drive.speed is 0 at 2 s: ")
    assert warning.endswith(limit)


def test_the_peak_of_the_drive_may_be_at_an_event_between_samples() -> None:
    """It brakes a load on its way down; damping falls up to rest, where friction vanishes."""
    speed = {"time": [0.0, 1.0, 1.1], "value": [-1.0, -1.0, 0.0]}
    done = sound(drum(speed, output__interval=0.07, solver__duration=1.4))
    peak = 2224.1 * 0.0508 - R_K * 2224.1 + 1.355 * 10.0
    assert done.quantities["drive_torque_peak"].value == pytest.approx(peak, rel=1e-13)
    assert np.abs(done.channels["drive_torque"]).max() < peak - 0.05
    gear = {"drive.speed": 40.0, "effects.rolling_friction.normal_load": "radial"}
    values = fs.solve("epicyclic_dwell", gear).quantities
    # Level at the start: the slow torque there and f lambda m_2 L phi'^2.
    peak = 0.8 * 9.81 * 0.09 + 1.2 * 9.81 * 0.18 + 0.3 + 5e-4 * 3.0 * 1.2 * 0.18 * 40.0**2
    assert values["drive_torque_peak"].value == pytest.approx(peak, rel=1e-14)
    assert values["uniform_torque_max"].value < 0.9 * peak
    held = {"drive.speed": 0.0, "forces.effort.size": 100.0, "solver.duration": 0.1}
    values = fs.solve("shaft", held).quantities
    assert values["drive_torque_peak"].value == pytest.approx(400.0 * 0.1 - 100.0 * 0.2, rel=1e-14)
    free = fs.solve("pulley", {"solver.duration": 0.1})
    assert "drive_torque_peak" not in free.quantities


def test_the_cord_of_a_held_drum_slips_by_the_capstan_equation() -> None:
    """The car of 1600 kg is too heavy for the ropes on a sheave that a brake holds."""
    held: Scenario = {"drive": {"speed": 0.0}, "effects__hanging_masses__car": 1600.0}
    done = sound(shipped("lift", **held, effects__shaft_friction=None, solver__duration=2.0))
    m1, m2, ratio = 1623.0, 1023.0, exp(-0.116 * pi)
    tension = 2.0 * m1 * m2 * 9.81 / (m2 + ratio * m1)
    fall = 9.81 - tension / m1
    c = done.channels
    assert c["rope_tension_car"] == pytest.approx(tension, rel=1e-14)
    assert c["drive_torque"] == pytest.approx(0.265 * tension * (1.0 - ratio), rel=1e-13)
    peak = done.quantities["drive_torque_peak"].value
    assert peak == pytest.approx(0.265 * tension * (1.0 - ratio), rel=1e-13)
    assert c["car_position"] == pytest.approx(-0.5 * fall * done.time**2, rel=1e-11)
    assert np.all(c["angle"] == 0.0)
    assert np.all(c["energy_input"] == 0.0)
    assert [(e.contact, e.mode_to) for e in done.transitions] == [("cord", -1)]


def test_a_brake_that_acts_fast_makes_the_cord_slip_until_the_car_rests() -> None:
    """From 1 m/s to rest in 0.1 s: the car slides on at g less the traction, and then is held."""
    speed = {"time": [0.0, 1.0, 1.1], "value": [1.0 / 0.265, 1.0 / 0.265, 0.0]}
    done = sound(shipped("lift", drive={"speed": speed}, solver__duration=6.0))
    m1, m2, ratio = 783.0, 1023.0, exp(0.116 * pi)
    slowing = 9.81 - 2.0 * m2 * 9.81 / (m2 + ratio * m1)
    events = [(e.contact, e.mode_from, e.mode_to) for e in done.transitions]
    assert events == [("cord", 0, 1), ("shaft", 1, 0), ("cord", 1, 0)]
    times = [e.time for e in done.transitions]
    assert times == pytest.approx([1.0, 1.1, 1.0 + 1.0 / slowing], abs=1e-9)
    travel = 1.0 + 0.5 / slowing
    assert done.channels["car_position"][-1] == pytest.approx(travel, rel=1e-9)


def of_all_loads(data: Scenario, done: Any) -> Any:
    """Return the moment of all loads, and the load of the shaft."""
    c = {name: done.channels[name] for name in ("angle", "angular_velocity")}
    c |= {"angular_acceleration": done.channels["angular_acceleration"], "time": done.time}
    forces = list(shaft_forces.acting(data, c).values())
    total = sum(force for _, force in forces)
    return sum(shaft_forces.moment(*each) for each in forces) + sum(
        shaft_forces.couples(data, c).values()
    ), abs(total)


@pytest.mark.parametrize("number", one_in(9, range(100)))
def test_a_drawn_shaft_takes_what_newton_and_euler_say(number: int) -> None:
    rng = np.random.default_rng(2000 + number)
    wave = {"amplitude": float(rng.normal() * 3.0), "frequency_hz": float(rng.uniform(0.3, 1.5))}
    speeds = [
        {"sine": wave},
        {"time": [0.0, 0.7, 1.5, 2.0], "value": rng.normal(size=4).tolist()},
        [float(rng.normal()), {"sine": wave}, {"sine": {"amplitude": 1.0, "frequency_hz": 1.7}}],
        0.0,
    ]
    data = shaft_forces.drawn_shaft(number) | {"drive": {"speed": speeds[number % 4]}}
    data["solver"] |= {"rtol": 1e-11, "atol": 1e-13}
    data["output"] = {"at_events": False}
    done = sound(data)
    others, load = of_all_loads(data, done)
    c = done.channels
    w, a = c["angular_velocity"], c["angular_acceleration"]
    r_k = 0.02 * 0.2 / hypot(1.0, 0.2)
    friction = -np.sign(w) * r_k * load
    torque = 2.0 * a - others - friction
    largest = float(np.max(np.abs(torque)))
    sure = np.abs(w) > 1e-9 if number % 4 else slice(0)
    assert c["drive_torque"][sure] == pytest.approx(torque[sure], abs=1e-12 * largest)
    assert c["shaft_reaction"] == pytest.approx(load, rel=1e-12)
    terms = speeds[number % 4] if isinstance(speeds[number % 4], list) else [speeds[number % 4]]
    assert w == pytest.approx(sum(signal(term, done.time) for term in terms), abs=1e-13)
    turned = sum(integral_of(term, done.time) for term in terms)
    assert c["angle"] == pytest.approx(turned, abs=1e-9)


def integral_of(term: Any, time: Any) -> Any:
    """Return the integral of a signal, exactly."""
    if isinstance(term, float):
        return term * time
    if "sine" in term:
        k = 2.0 * pi * term["sine"]["frequency_hz"]
        return term["sine"]["amplitude"] / k * (1.0 - np.cos(k * time))
    grid = np.union1d(time, term["time"])
    area = cumulative_trapezoid(np.interp(grid, term["time"], term["value"]), grid, initial=0.0)
    return np.interp(time, grid, area)


@pytest.mark.parametrize("seed", range(4))
def test_a_reversal_has_its_direction_where_friction_has_corners(seed: int) -> None:
    """A step ends at each corner; the one before the reversal may be as short as a rounding."""
    rng = np.random.default_rng(seed)
    up, down = rng.uniform(0.5, 5.0, 2)
    speed = {"time": [0.0, 1.0, 2.0], "value": [0.0, up, -down]}
    curve = [
        {"speed": [0.01, 0.03], "value": [0.1, 0.05]},
        {"stribeck": {"mu_c": 0.05, "speed": 0.01, "exponent": 1.0}},
    ][seed % 2]
    changes = {"effects__shaft_friction__mu_k": curve, "solver__duration": 2.0}
    load = {"effects__shaft_friction__normal_load": 50.0} if seed % 3 else {}
    result = fs.solve(drum(speed, **changes, **load))
    (event,) = result.transitions
    assert event.time == pytest.approx(1.0 + up / (up + down), abs=1e-12)
    assert (event.mode_from, event.mode_to) == (1, -1)
    assert not any("undetermined" in warning for warning in result.warnings)
