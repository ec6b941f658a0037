"""The regularised friction law, with our own integrator and those of SciPy."""

import subprocess
import sys
from itertools import pairwise
from math import log10
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from frictionsim.solvers.friction_curve import friction_curve
from tests.support.cases import slow
from tests.support.problems import BREAKAWAY, CORD_RADIUS, INERTIA, LOAD, R_K, R_S, RAMP
from tests.support.scenarios import SCENARIOS, changed, pulley, shipped, simulate, with_method

REGULARISED = "effects.shaft_friction.law=regularised"
SCIPY = ("bdf", "radau", "lsoda", "rk45", "dop853")
SMOOTHING = ["rkf45", *SCIPY]


def smoothed(backend: str, speed: float, **changes: Any) -> Record:
    data = pulley(**{"solver__rtol": 1e-7, "solver__atol": 1e-11, **changes})
    data = with_method(data, "regularised", backend)
    return simulate(changed(data, effects__shaft_friction__transition_speed=speed))


def test_the_curve_passes_the_static_and_the_kinetic_limit() -> None:
    x = np.linspace(0.0, 2.0, 2001)
    curve = np.array([friction_curve(float(at), 3.0, 2.0) for at in x])
    assert curve[0] == 0.0
    assert curve[1000] == pytest.approx(3.0)
    assert np.all(curve[x >= 1.5] == 2.0)
    assert np.all(np.diff(curve[x <= 1.0]) > 0.0)
    assert np.all(np.diff(curve[x >= 1.0]) <= 0.0)
    # Its slope is at most 4.5, so that a step of 0.001 changes it by less than this: no jump;
    # nor does the slope jump, whose own is at most 24.
    assert np.max(np.abs(np.diff(curve))) < 0.005
    assert np.max(np.abs(np.diff(curve, 2))) < 30e-6


@pytest.mark.parametrize(
    "backend",  # explicit methods take the most steps; `test_shaft_reference` has rkf45
    [slow(name) if name in ("rkf45", "rk45", "dop853") else name for name in SMOOTHING],
)
def test_the_regularised_ramp_approximates_the_exact_one(backend: str) -> None:
    run = smoothed(backend, 1e-4, solver__duration=2.0)
    assert (run.status, len(run.transitions)) == ("done", 1)
    assert {name: check.ok for name, check in run.checks.items()} == {"energy_balance": True}
    # 2e-4 s late, as a test below has it, times some 20 rad/s.
    assert run.transitions[0].time == pytest.approx(BREAKAWAY, abs=3e-4)
    t, angle, velocity, _ = RAMP[2]
    at = np.searchsorted(run.time, t - 1e-9)
    assert run.channels["angle"][at] == pytest.approx(angle, abs=5e-3)
    assert run.channels["angular_velocity"][at] == pytest.approx(velocity, abs=5e-3)


def sliding_error(speed: float) -> float:
    """Return the error of the angle at 1 s, after sliding from 1 rad/s to a stop and creeping."""
    force = 2300.0  # N, which holds
    run = smoothed(
        "radau",
        speed,
        drive__force=force,
        mechanism__initial_angular_velocity=1.0,
        effects__viscous_damping=None,
        solver__duration=1.0,
    )
    torque = R_K * (force + LOAD) - (force - LOAD) * CORD_RADIUS
    return float(abs(run.channels["angle"][-1] - 0.5 * INERTIA / torque))


def test_the_error_of_a_stop_is_of_first_order_in_the_transition_speed() -> None:
    errors = [sliding_error(speed) for speed in (1e-2, 1e-3, 1e-4)]
    for coarse, fine in pairwise(errors):
        # What is passed on the way to rest is of second order, and seen in the first quotient.
        assert log10(coarse / fine) == pytest.approx(1.0, abs=0.01)


def test_the_delay_of_breakaway_on_a_ramp_is_of_order_two_thirds() -> None:
    """The torque passes the maximum of the curve, a fold, at a finite rate."""
    late = [
        smoothed("radau", speed).transitions[0].time - BREAKAWAY for speed in (1e-2, 1e-3, 1e-4)
    ]
    for coarse, fine in pairwise(late):
        assert log10(coarse / fine) == pytest.approx(2.0 / 3.0, abs=0.02)  # next order, as above


def test_regularised_friction_creeps_instead_of_sticking() -> None:
    force, speed = 2500.0, 1e-3  # between what holds and what lifts
    run = smoothed("radau", speed, drive__force=force, effects__viscous_damping=None)
    moment, limit = (force - LOAD) * CORD_RADIUS, R_S * (force + LOAD)
    x = run.channels["angular_velocity"][-1] / speed
    assert 1.5 * x - 0.5 * x**3 == pytest.approx(moment / limit, rel=1e-6)
    assert np.all(run.channels["mode"] == 0)


@pytest.mark.parametrize("backend", SMOOTHING)
def test_a_scenario_without_friction_needs_no_transition_speed(backend: str) -> None:
    exact = simulate(pulley(effects=None))
    run = simulate(pulley(effects=None, solver__backend=backend))
    # SciPy's bound is on a mean over the states, whose energies are thousands: rtol 1e-9 of them.
    assert run.channels["angle"] == pytest.approx(exact.channels["angle"], abs=1e-4)
    assert run.checks["energy_balance"].value < 1e-6


@pytest.mark.parametrize("backend", SMOOTHING)
def test_a_prescribed_speed_uses_the_set_valued_law(backend: str) -> None:
    speed = {"sine": {"mean": 1.0, "amplitude": 2.0, "frequency_hz": 1.0}}
    scenario = shipped("epicyclic", drive={"speed": speed})
    exact = simulate(scenario)
    run = simulate(changed(scenario, solver__backend=backend, solver__rtol=1e-8))
    assert run.checks.keys() == exact.checks.keys()
    assert run.channels["angle"] == pytest.approx(exact.channels["angle"], abs=1e-5)
    assert run.channels["drive_torque"] == pytest.approx(exact.channels["drive_torque"], abs=1e-4)


@pytest.mark.parametrize("backend", [slow(n) if n == "radau" else n for n in SMOOTHING])
def test_failures_of_scipy_are_reported_in_plain_words(backend: str) -> None:
    run = smoothed(backend, 1e-3, solver__max_steps=20)
    assert run.status == "failed"
    assert run.reason.startswith("limit of 20 steps reached at t = ")
    huge = smoothed(backend, 1e-3, drive__force={"time": [0.0, 1.0], "value": [0.0, 1e49]})
    if huge.status == "failed":
        assert "step size" not in huge.reason
        assert "spacing" not in huge.reason


def test_scipy_is_not_imported_by_our_own_backends() -> None:
    code = (
        "import sys; import frictionsim as fs;"
        f"scenario = fs.load({str(SCENARIOS / 'pulley.toml')!r}, [{REGULARISED!r}], 'rkf45');"
        "print(fs.solve(scenario).status, 'scipy' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=SCENARIOS.parent,
    )
    assert done.stdout.split() == ["done", "False"]
