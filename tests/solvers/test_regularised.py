"""The regularised friction law, with our own integrator and those of SciPy."""

from collections.abc import Callable
from itertools import pairwise
from math import log10
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import NonFinite
from frictionsim.mechanisms.extension import INPUT, OneCoordinate, Term
from frictionsim.results import Record
from frictionsim.solvers.friction_curve import friction_curve
from tests.support.cases import slow
from tests.support.problems import BREAKAWAY, CORD_RADIUS, INERTIA, LOAD, R_K, R_S, RAMP
from tests.support.scenarios import changed, pulley, shipped, simulate, with_method
from tests.support.wheels import signal, solved

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


def delay(speed: float) -> float:
    """Return how late a breakaway on a ramp is: the torque passes the curve's maximum, a fold."""
    return smoothed("radau", speed, solver__duration=0.7).transitions[0].time - BREAKAWAY


@pytest.mark.parametrize(
    ("error", "order", "within"), [(sliding_error, 1.0, 0.01), (delay, 2.0 / 3.0, 0.02)]
)
def test_errors_have_their_order_in_the_transition_speed(
    error: Callable[[float], float], order: float, within: float
) -> None:
    """But for what the first quotient shows of the next order."""
    for coarse, fine in pairwise([error(speed) for speed in (1e-2, 1e-3, 1e-4)]):
        assert log10(coarse / fine) == pytest.approx(order, abs=within)


def test_regularised_friction_creeps_instead_of_sticking() -> None:
    force, speed = 2500.0, 1e-3  # between what holds and what lifts
    run = smoothed("radau", speed, drive__force=force, effects__viscous_damping=None)
    moment, limit = (force - LOAD) * CORD_RADIUS, R_S * (force + LOAD)
    x = run.channels["angular_velocity"][-1] / speed
    assert 1.5 * x - 0.5 * x**3 == pytest.approx(moment / limit, rel=1e-6)
    assert np.all(run.channels["mode"] == 0)


@pytest.mark.parametrize("backend", SMOOTHING)
def test_without_friction_or_at_a_given_speed_all_methods_agree(backend: str) -> None:
    speed = {"sine": {"mean": 1.0, "amplitude": 2.0, "frequency_hz": 1.0}}
    for data in (pulley(effects=None), shipped("epicyclic", drive={"speed": speed})):
        exact = simulate(data)
        run = simulate(changed(data, solver__backend=backend, solver__rtol=1e-9))
        assert run.checks.keys() == exact.checks.keys()
        # SciPy's bound is on a mean over the states, whose energies are thousands.
        for name in {"angle", "drive_torque"} & exact.channels.keys():
            assert run.channels[name] == pytest.approx(exact.channels[name], abs=1e-4)
        assert run.checks["energy_balance"].value < 1e-6


@pytest.mark.parametrize("backend", ["rkf45", "lsoda"])
def test_failures_of_scipy_are_reported_in_plain_words(backend: str) -> None:
    run = smoothed(backend, 1e-3, solver__max_steps=20)
    assert run.status == "failed"
    assert run.reason.startswith("limit of 20 steps reached at t = ")
    huge = smoothed(backend, 1e-3, drive__force={"time": [0.0, 1.0], "value": [0.0, 1e49]})
    assert huge.status == "failed"
    assert "step size" not in huge.reason
    assert "spacing" not in huge.reason


@pytest.mark.parametrize("method", ["rk45", "bdf"])
def test_a_run_in_which_one_number_of_the_state_overflows_ends_by_name(method: str) -> None:
    """A wheel turns at 1e154 rad/s under 1e154 N m: its energy overflows after 1.8 s."""
    system = OneCoordinate(
        signal(1e154), None, 1e300, (Term(lambda u, q, v: u, INPUT),), None, start=(0.0, 1e154)
    )
    with pytest.raises(NonFinite, match="the state of the motion is not finite after t = "):
        solved(system, 1e3, backend=method)


# --- a smoothed law is stiff ----------------------------------------------------------------------

SPRING = {
    "kind": "shaft",
    "mechanism": {"inertia": 1.0, "initial_angular_velocity": 5.0},
    "forces": [{"name": "clamp", "size": 1000.0, "point": [0.0, 0.0], "direction": [0.0, -1.0]}],
    "effects": {
        "torsion_spring": {"stiffness": 1.0},
        "shaft_friction": {
            "shaft_radius": 0.0125,
            "mu_s": 4.0 / 3.0,
            "mu_k": 4.0 / 3.0,
            "law": "regularised",
            "transition_speed": 1e-4,
        },
    },
    "solver": {"backend": "bdf", "duration": 31.4, "rtol": 1e-8, "atol": 1e-10},
}


@pytest.mark.parametrize(
    ("backend", "speed"), [("bdf", 1e-4), ("bdf", 1e-5), ("radau", 1e-3), ("lsoda", 1e-6)]
)
def test_a_stiff_method_solves_a_smoothed_stop_in_few_steps(backend: str, speed: float) -> None:
    """The limit is r_s F = 10 N m: v^2 = 25 - 20 x - x^2 ends at sqrt(125) - 10."""
    changes = {
        "solver.backend": backend,
        "effects.shaft_friction.transition_speed": speed,
    }
    done = fs.solve(SPRING, changes, max_steps=3000, check=True)
    # It creeps on by v_t k x/(1.5 L_s) for 31 s, and stops with an error of the order of v_t.
    angle = done.quantities["final_angle"].value
    assert angle == pytest.approx(125.0**0.5 - 10.0, abs=4.0 * speed)


def test_a_smoothed_law_without_a_method_is_told_of_one_that_works(
    told: Callable[..., tuple[str, str]],
) -> None:
    speed = "effects.shaft_friction.transition_speed=1e-4"
    sets = ("--set", REGULARISED, "--set", speed, "--set", "solver.duration=0.5")
    _, said = told("solve", "marble_machine", *sets, "-o", "a.h5", code=2)
    (advice,) = {part for part in said.split("--set ") if part.startswith("solver.backend=")}
    assert advice.startswith("solver.backend=bdf)")
    told("solve", "marble_machine", *sets, "--set", "solver.backend=bdf", "-o", "a.h5", "--quiet")
    assert Path("a.h5").exists()


def test_limits_of_explicit_methods_name_stiff_ones() -> None:
    for limit in ({"max_steps": 20}, {"max_wall": 1e-9}):
        reason = fs.solve(SPRING, {"solver.backend": "dop853"}, **limit).reason
        assert "take a stiff method, bdf, radau or lsoda (--set solver.backend=bdf)" in reason
        assert "loosen the tolerances" not in reason
    exact = with_method(SPRING, "set-valued", "rkf45")
    exact = changed(exact, effects__shaft_friction__transition_speed=None)
    reason = fs.solve(exact, max_steps=20).reason
    assert "loosen the tolerances" in reason
    assert "stiff" not in reason
