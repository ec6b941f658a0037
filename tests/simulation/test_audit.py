"""The self-audit passes sound runs and detects violations."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frictionsim.cli.commands import run_command_line
from frictionsim.mechanisms.pulley import build
from frictionsim.results import FORWARD, STICK, failures
from frictionsim.scenario.loading import validate
from frictionsim.simulation.audit import allowed_residual, audit, energy_check
from frictionsim.simulation.single_dof import SingleDofSimulation
from frictionsim.solvers import one_contact
from frictionsim.solvers.mechanism import DryFriction, Trajectory
from tests.support.cases import one_in
from tests.support.problems import CORD_RADIUS, LOAD, R_S, RETURN_FORCE
from tests.support.scenarios import SCENARIOS, pulley, simulate

DATA = pulley(drive__force=RETURN_FORCE, solver__duration=12.0)
SCENARIO = validate(DATA, SCENARIOS)


@pytest.fixture(scope="module")
def sound() -> Trajectory:
    simulation = SingleDofSimulation(SCENARIO, build(SCENARIO))
    simulation.solve(lambda t: None)
    return simulation.trajectory()


def contact() -> DryFriction:
    friction = build(SCENARIO).contact
    assert friction is not None
    return friction


def failed(trajectory: Trajectory) -> set[str]:
    limit = allowed_residual(SCENARIO.solver.rtol)
    checks = audit(trajectory, contact(), limit, SCENARIO.solver.atol, size=45.0)
    return {name for name, check in checks.items() if not check.ok}


def with_sample(channel: Any, i: int, value: float) -> Any:
    channel = channel.copy()
    channel[i] = value
    return channel


def test_a_sound_run_passes_the_audit(sound: Trajectory) -> None:
    assert set(simulate(DATA).checks) == {
        "energy_balance",
        "friction_law",
        "dissipation_sign",
        "stick_drift",
        "release",
    }
    assert failed(sound) == set()


def test_missing_energy_is_detected(sound: Trajectory) -> None:
    lossy = sound.energy_integrals | {
        "energy_friction": sound.energy_integrals["energy_friction"] * (1.0 - 1e-5)
    }
    assert failed(sound._replace(energy_integrals=lossy)) == {"energy_balance"}


def test_friction_beyond_its_limit_is_detected(sound: Trajectory) -> None:
    stick, slip = np.flatnonzero(sound.mode == 0)[-1], np.flatnonzero(sound.mode == 1)[5]
    for i in (stick, slip):
        friction = with_sample(sound.friction, i, -1.1 * abs(sound.friction[i]))
        assert failed(sound._replace(forces=friction)) == {"friction_law"}


def test_driving_friction_is_detected(sound: Trajectory) -> None:
    slip = np.flatnonzero(sound.mode == 1)[5]
    friction = with_sample(sound.friction, slip, -sound.friction[slip])
    assert failed(sound._replace(forces=friction)) == {"dissipation_sign"}


@pytest.mark.parametrize(("speed", "failing"), [(1e-11, {"dissipation_sign"}), (1e-13, set())])
def test_a_speed_below_the_absolute_tolerance_may_have_either_sign(
    sound: Trajectory, speed: float, failing: set[str]
) -> None:
    """Of 1e-12 rad/s: so small are the speeds of a load of 1e-45 N m."""
    slip = np.flatnonzero(sound.mode == 1)[5]
    velocity = with_sample(sound.velocity, slip, np.copysign(speed, sound.friction[slip]))
    assert failed(sound._replace(velocity=velocity)) == failing


def test_friction_below_its_kinetic_size_is_detected(sound: Trajectory) -> None:
    slip = np.flatnonzero(sound.mode == 1)[5]
    friction = with_sample(sound.friction, slip, 0.9 * sound.friction[slip])
    assert failed(sound._replace(forces=friction)) == {"friction_law"}
    stick = np.flatnonzero(sound.mode == 0)[-1]  # there it has any size up to its limit
    friction = with_sample(sound.friction, stick, 0.5 * sound.friction[stick])
    assert failed(sound._replace(forces=friction)) == set()


@pytest.mark.parametrize("towards", [np.inf, -np.inf])
def test_drift_of_one_ulp_is_detected(towards: float, sound: Trajectory) -> None:
    drifted = with_sample(sound.position, -1, np.nextafter(sound.position[-1], towards))
    assert "stick_drift" in failed(sound._replace(position=drifted))


def test_slip_between_two_sticking_samples_is_not_drift() -> None:
    data = pulley(
        drive__force={"sine": {"mean": 2450.0, "amplitude": 450.0, "frequency_hz": 0.5}},
        solver__duration=8.0,
        output__interval=1.9,
    )
    run = simulate(data)
    assert np.any(np.diff(run.channels["angle"][run.channels["mode"] == 0]) > 1.0)
    assert failures(run.checks) == ""


@pytest.mark.parametrize("shift", [1e-6, -1e-6])
def test_a_breakaway_off_its_limit_is_detected(
    shift: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    exact = one_contact.breakaway

    def shifted(*arguments: Any) -> tuple[float, float]:
        held, time = exact(*arguments)
        return held + shift, time + shift

    monkeypatch.setattr(one_contact, "breakaway", shifted)
    force = {"time": [0.0, 1.0], "value": [1832.6, 3113.75]}
    check = simulate(pulley(drive__force=force)).checks["release"]
    # (P - W) r - r_s (P + W) over the sum of both, of a force that is off by its slope.
    lifting = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)
    off = 1281.15 * abs(shift) * (CORD_RADIUS - R_S) / (2.0 * (lifting - LOAD) * CORD_RADIUS)
    assert check.value == pytest.approx(off, rel=1e-5)
    assert not check.ok


@pytest.mark.parametrize("time", [0.0, 1.0], ids=["at the start", "at a jump"])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_breakaway_where_the_contact_could_hold_is_detected(
    time: float, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force jumps to a share of the one that lifts, and the contact gives way in any case."""
    lifting = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)
    jump = {"time": [time, float(np.nextafter(time, 9.0))], "value": [LOAD, share * lifting]}
    data = pulley(drive__force=jump if time else share * lifting)
    if time:
        exceeds = "excess_beyond_roundoff"
        monkeypatch.setattr(one_contact, exceeds, lambda system, s, t, direction: direction * t)
        monkeypatch.setattr(one_contact, "breakaway", lambda *arguments: jump["time"])
    else:
        monkeypatch.setattr(one_contact, "mode_from_rest", lambda system, s: FORWARD)
    result = simulate(data)
    assert (result.transitions[0].mode_from, result.transitions[0].mode_to) == (STICK, FORWARD)
    limit, torque = R_S * (share * lifting + LOAD), CORD_RADIUS * (share * lifting - LOAD)
    # At the jump the torque just before is zero, and its distance is the whole of the limit.
    expected = (1.0 if time else (limit - torque) / (limit + torque)) if share < 1.0 else 0.0
    assert result.checks["release"].value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("rtol", [1e-10, 1e-3, 0.99])
def test_the_allowed_energy_error_is_at_most_one_percent(rtol: float, sound: Trajectory) -> None:
    """The work of the force is 31 kJ, far below the absolute tolerance of 1e49 J."""
    allowed = min(100.0 * rtol, 0.01)
    for factor, passes in ((0.5, True), (1.1, False)):
        work = sound.energy_integrals["energy_input"]
        lossy = sound.energy_integrals | {"energy_input": work * (1.0 - factor * allowed)}
        run = sound._replace(energy_integrals=lossy)
        check = energy_check(run, allowed_residual(rtol), atol=1e49, size=45.0)
        assert check.limit <= 0.01
        assert check.ok is passes


FLYWHEEL = {
    "kind": "shaft",
    "mechanism": {"inertia": 0.4, "mass": 30.0, "initial_angular_velocity": 60.0},
    "effects": {"gravity": {}, "eccentric_mass": {"mass": 0.5, "radius": 0.2}},
    "solver": {"backend": "events", "duration": 20.0},
    "output": {"interval": 0.01},
}


@pytest.mark.parametrize(
    ("mu_k", "rtol"), one_in(3, product([None, 0.05], [1e-6, 1e-8, 1e-10, 1e-12]))
)
def test_a_flywheel_of_many_turns_passes_the_audit(rtol: float, mu_k: float | None) -> None:
    """An eccentric mass exchanges 2 J a turn with 750 J; errors of thousands of steps add up."""
    data: Any = FLYWHEEL | {"solver": FLYWHEEL["solver"] | {"rtol": rtol}}  # type: ignore[operator]
    if mu_k is not None:
        friction = {"shaft_radius": 0.02, "mu_s": 0.1, "mu_k": mu_k}
        data = data | {"effects": data["effects"] | {"shaft_friction": friction}}
    run = simulate(data)
    assert failures(run.checks) == ""
    check = run.checks["energy_balance"]
    # A hundred tolerances, or a tenth of one for each step.
    errors = max(100.0, 0.1 * run.statistics.steps)
    assert check.limit == pytest.approx(errors * rtol + 1e-12, rel=1e-12)
    stored = run.channels["energy_kinetic"] + run.channels["energy_potential"]
    lost = stored + run.channels.get("energy_friction", 0.0) - stored[0]
    worst = np.max(np.abs(lost)) / np.max(run.channels["energy_kinetic"])
    assert check.value == pytest.approx(worst, rel=1e-2, abs=1e-13)


def test_a_run_with_useless_tolerances_fails_the_audit(tmp_path: Path) -> None:
    arguments = ["solve", str(SCENARIOS / "pulley.toml"), "-q", "-o", str(tmp_path / "a.h5")]
    arguments += ["--backend", "radau", "--set", "effects.shaft_friction.law=regularised"]
    arguments += ["--set", "solver.rtol=0.99", "--set", "solver.atol=1e49"]
    assert run_command_line(arguments) == 3


def test_a_uniform_motion_passes_the_audit() -> None:
    """The roundoff of the kinetic energy exceeds the work of the torque."""
    data = {
        "kind": "epicyclic",
        "mechanism": {
            "sun_radius": 0.08,
            "planet_radius": 0.06,
            "crank_mass": 0.188,
            "planet_mass": 4.47,
            "initial_angular_velocity": 4.083155205282193,
        },
        "drive": {"torque": 1e-14},
        "solver": {"backend": "rkf45", "duration": 2.0, "rtol": 1e-4},
    }
    assert failures(simulate(data).checks) == ""
