"""Motor curves and sums of signals of pulley and lift, and an inertia that masses alone give.

A pulley on which a torque or forces act is a body on a shaft with couples and cords, for which
there is an independent program: each term of a sum is a load of its own there.
"""

from math import hypot, pi
from random import Random
from typing import Any

import numpy as np
import pytest

from tests.support.cases import one_in
from tests.support.problems import cases
from tests.support.scenarios import Scenario, pulley, shipped, simulate, sound
from tests.support.shaft_reference import solution
from tests.support.shaft_scenarios import ramp, signal, sine

TIME, ANGLE = 1e-9, 1e-8  # s, rad: rtol 1e-11 over some hundred steps


def motor(rng: Random, size: float) -> Scenario:
    """Return a motor curve, whose torque falls with the speed."""
    falls = [size, 0.8 * size, 0.3 * size, -0.5 * size, -size]
    return {"speed": [-6.0, -1.0, rng.choice([0.0, 0.4]), 3.0, 8.0], "value": falls}


def drawn_pulley(number: int) -> tuple[Scenario, Scenario]:
    """Return a pulley with a sum as its drive, and the same as a body on a shaft."""
    rng = Random(number)
    arm, load = rng.uniform(0.1, 0.3), rng.uniform(50.0, 200.0)
    by_torque = number % 3 != 0
    size, mean = (arm * load, arm * load) if by_torque else (load, load)
    terms: list[Any] = [mean, signal(rng, size), sine(0.0, 0.4 * size, rng.uniform(0.5, 3.0))]
    if by_torque:
        terms[rng.randrange(3)] = motor(rng, size)
        terms += [ramp(0.2, 0.0, 0.5, 0.5 * size, 1.5, -size)][: number % 2]
    mu = rng.uniform(0.1, 0.5)
    effects = {
        "shaft_friction": {"shaft_radius": 0.4 * arm, "mu_s": 1.3 * mu, "mu_k": mu},
        "viscous_damping": {"coefficient": rng.uniform(0.0, 0.5)},
    }
    mechanism = {"inertia": rng.uniform(0.5, 3.0)}
    common = {"effects": effects, "solver": {"duration": 2.0, "rtol": 1e-11, "atol": 1e-13}}
    drive: Scenario = {"torque" if by_torque else "force": terms}
    down = {"direction": [0.0, -1.0]}
    forces = [{"name": "load", "size": load, "cord_radius": -arm, **down}]
    named = [{"name": f"t{i}", "size": term} for i, term in enumerate(terms)]
    if not by_torque:
        forces += [{**each, "cord_radius": arm, **down} for each in named]
    body = {"forces": forces, "couples": named if by_torque else [], "mechanism": mechanism}
    hung = {"mechanism": {"cord_radius": arm, "load": load, **mechanism}, "drive": drive}
    return {"kind": "pulley", **hung, **common}, {"kind": "shaft", **body, **common}


@pytest.mark.parametrize("number", [0, 10, 40, 70, 90])
def test_a_drawn_sum_moves_a_pulley_as_its_terms_move_a_body_on_a_shaft(number: int) -> None:
    data, body = drawn_pulley(number)
    done, wanted = sound(data), solution(body)
    events = [(e.time, e.mode_from, e.mode_to) for e in done.transitions]
    assert [e[1:] for e in events] == [tuple(e[1:3]) for e in wanted["events"]]
    times = [e[0] for e in wanted["events"]]
    assert [e[0] for e in events] == pytest.approx(times, abs=TIME)
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert final == pytest.approx(wanted["final"], abs=ANGLE)


@pytest.mark.parametrize("case", one_in(5, cases("motor")), ids=lambda case: case["name"])
def test_a_drawn_motor_moves_a_lift_as_newton_and_euler_say(case: dict[str, Any]) -> None:
    """A lift whose ropes stay taut, its pulley with inertia and without."""
    done = sound(case["scenario"])
    assert {e.contact for e in done.transitions} == {"shaft"}
    modes = [[e.mode_from, e.mode_to] for e in done.transitions]
    assert modes == [event[1:] for event in case["events"]]
    times = [event[0] for event in case["events"]]
    assert [e.time for e in done.transitions] == pytest.approx(times, abs=TIME)
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert final == pytest.approx(case["final"], abs=ANGLE)


def test_a_linear_motor_curve_runs_up_exponentially() -> None:
    """I w' = M - c w - W r - r_k W."""
    curve = {"speed": [-100.0, 100.0], "value": [200.0 + 300.0, 200.0 - 300.0]}
    done = sound(pulley(drive={"torque": curve}, effects__viscous_damping=None))
    r_k = 0.0254 * 0.1 / hypot(1.0, 0.1)
    final = (200.0 - 2224.1 * (0.0508 + r_k)) / 3.0
    wanted = final * (1.0 - np.exp(-3.0 / 1.355 * done.time))
    assert done.channels["angular_velocity"] == pytest.approx(wanted, rel=1e-8, abs=1e-9)
    torque = 200.0 - 3.0 * done.channels["angular_velocity"]
    assert done.channels["drive_torque"] == pytest.approx(torque, rel=1e-12)


def test_a_short_peak_of_a_sum_is_not_missed() -> None:
    """Two waves exceed the limit together for 2 ms in 10 s, and nothing else does."""
    limit = 2224.1 * (0.0508 + 0.0254 * 0.2 / hypot(1.0, 0.2))
    low, high = sine(limit - 3.0, 2.0, 0.05, 0.0), sine(0.0, 1.0 + 1e-6, 7.0, 90.0)
    data = pulley(drive={"torque": [low, high]}, solver__duration=10.0, output__interval=1.0)
    done = sound(data)
    first = done.transitions[0]
    # Both peaks coincide at 5 s: 1e-6 = 1/2 w^2 dt^2 of the fast one.
    early = np.sqrt(2e-6) / (2.0 * pi * 7.0)
    assert first.time == pytest.approx(5.0 - early, abs=3e-7)


@pytest.mark.parametrize("number", [0, 40, 80])
def test_a_drawn_massless_body_moves_as_newton_and_euler_say(number: int) -> None:
    rng = Random(500 + number)
    eccentric = {"mass": rng.uniform(1.0, 5.0), "radius": rng.uniform(0.2, 0.5)}
    effects = {
        "gravity": {"g": 9.81},
        "eccentric_mass": eccentric | {"azimuth_deg": rng.uniform(-180.0, 180.0)},
        "shaft_friction": {"shaft_radius": 0.05, "mu_s": 0.4, "mu_k": 0.25},
    }
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.0, "mass": 3.0},
        "couples": [{"name": "c", "size": signal(rng, 10.0)}],
        "effects": effects,
        "solver": {"duration": 1.0, "rtol": 1e-11, "atol": 1e-13},
    }
    done, wanted = sound(data), solution(data)
    assert [(e.mode_from, e.mode_to) for e in done.transitions] == [
        tuple(e[1:3]) for e in wanted["events"]
    ]
    times = [e[0] for e in wanted["events"]]
    assert [e.time for e in done.transitions] == pytest.approx(times, abs=TIME)
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert final == pytest.approx(wanted["final"], abs=10.0 * ANGLE)


def test_a_motor_curve_is_over_the_speed_of_the_pulley_and_not_of_a_slipping_cord() -> None:
    curve = {"speed": [0.0, 4.0, 8.0], "value": [3000.0, 2000.0, -9000.0]}
    done = simulate(shipped("lift", drive={"torque": curve}, solver__duration=1.0))
    c = done.channels
    assert np.any(c["cord_mode"] != 0)
    torque = np.interp(c["angular_velocity"], curve["speed"], curve["value"])
    assert c["drive_torque"] == pytest.approx(torque, rel=1e-12)
    ratio = c["rope_tension_counterweight"] / c["rope_tension_car"]
    slipping = c["cord_mode"] == -1 if np.any(c["cord_mode"] == -1) else c["cord_mode"] == 1
    wanted = float(np.sign(c["cord_mode"][slipping][0])) * 0.116 * pi
    assert np.log(ratio[slipping]) == pytest.approx(wanted, rel=1e-12)
