"""The self-audit passes sound runs and detects violations."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import FORWARD, STICK, failures
from tests.support.cases import one_in
from tests.support.changed_samples import Samples, nearly_done
from tests.support.problems import CORD_RADIUS, LOAD, R_S, RETURN_FORCE
from tests.support.scenarios import SCENARIOS, pulley, simulate

# A last corner at 10 s: to there it rests in one turn, and what follows is the last one.
FORCE = {
    "time": [*RETURN_FORCE["time"][:-1], 10.0, 12.0],
    "value": [*RETURN_FORCE["value"], 1840.0],
}
DATA = pulley(drive__force=FORCE, solver__duration=12.0)


@pytest.fixture(scope="module")
def stopped() -> fs.Result:
    """A run that sticks, slips and sticks again; not to be changed."""
    return nearly_done(DATA)


@pytest.fixture
def sound(stopped: fs.Result) -> Samples:
    return Samples(stopped)


def sticking(samples: Samples) -> int:
    """Return the last sample that sticks, before the run was stopped."""
    return int(np.flatnonzero(samples["mode"] == STICK)[-1])


def sliding(samples: Samples) -> int:
    return int(np.flatnonzero(samples["mode"] == FORWARD)[5])


def test_a_sound_run_passes_the_audit(sound: Samples) -> None:
    assert set(simulate(DATA).checks) == {
        "energy_balance",
        "friction_law",
        "dissipation_sign",
        "stick_drift",
        "release",
    }
    assert sound.failed() == set()
    assert sound["time"][sticking(sound)] > 6.0  # after it has come to rest


def test_what_it_reads_of_the_contact_is_torque_and_limit(sound: Samples) -> None:
    """Whose difference is the margin in a direction, while the body is at rest."""
    rest = sound["mode"] == STICK
    force = sound["drive_force"][rest]
    torque, limit = CORD_RADIUS * (force - LOAD), R_S * (force + LOAD)
    assert sound["margin_forward"][rest] == pytest.approx(limit - torque, rel=1e-12)
    assert sound["margin_backward"][rest] == pytest.approx(limit + torque, rel=1e-12)
    # Of three products, a few roundings each.
    assert np.all(sound["margin_roundoff"] < 1e-14 * (limit.max() + CORD_RADIUS * force.max()))


def test_missing_energy_is_detected(sound: Samples) -> None:
    sound["energy_friction"] *= 1.0 - 1e-5
    assert sound.failed() == {"energy_balance"}


def test_friction_beyond_its_limit_is_detected(sound: Samples) -> None:
    i = sticking(sound)
    limit = 0.5 * (sound["margin_forward"][i] + sound["margin_backward"][i])
    sound["friction_torque"][i] = -(1.0 - 1e-9) * limit
    assert sound.failed() == set()
    sound["friction_torque"][i] = -(1.0 + 1e-9) * limit
    assert sound.failed() == {"friction_law"}


def test_a_contact_that_holds_more_than_it_can_is_detected(sound: Samples) -> None:
    sound["margin_forward"][sticking(sound)] = -1e-9
    assert sound.failed() == {"friction_law"}


def test_driving_friction_is_detected(sound: Samples) -> None:
    sound["friction_torque"][sliding(sound)] *= -1.0
    assert sound.failed() == {"dissipation_sign"}


@pytest.mark.parametrize(("speed", "failing"), [(1e-11, {"dissipation_sign"}), (1e-13, set())])
def test_a_speed_below_the_absolute_tolerance_may_have_either_sign(
    sound: Samples, speed: float, failing: set[str]
) -> None:
    """Of 1e-12 rad/s: so small are the speeds of a load of 1e-45 N m."""
    i = sliding(sound)
    sound["angular_velocity"][i] = np.copysign(speed, sound["friction_torque"][i])
    assert sound.failed() == failing


@pytest.mark.parametrize("towards", [np.inf, -np.inf])
def test_drift_of_one_ulp_is_detected(towards: float, sound: Samples) -> None:
    i = sticking(sound)
    sound["angle"][i] = np.nextafter(sound["angle"][i], towards)
    assert "stick_drift" in sound.failed()


def test_slip_between_two_sticking_samples_is_not_drift() -> None:
    data = pulley(
        drive__force={"sine": {"mean": 2450.0, "amplitude": 450.0, "frequency_hz": 0.5}},
        solver__duration=8.0,
        output__interval=1.9,
    )
    run = simulate(data)
    assert np.any(np.diff(run.channels["angle"][run.channels["mode"] == 0]) > 1.0)
    assert failures(run.checks) == ""


LIFTING = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)  # N, the force that lifts


@pytest.mark.parametrize("shift", [1e-6, -1e-6])
def test_a_breakaway_off_its_limit_is_detected(shift: float) -> None:
    """As if it were located too late or too early on a ramp."""
    slope = 1281.15  # N/s
    force = {"time": [0.0, 1.0], "value": [1832.6, 1832.6 + slope]}
    samples = Samples(nearly_done(pulley(drive__force=force)))
    samples.shift_event(0, shift)
    samples.sides("margin_forward")[0] += slope * shift * (R_S - CORD_RADIUS)
    samples.sides("margin_backward")[0] += slope * shift * (R_S + CORD_RADIUS)
    check = samples.audit()["release"]
    # (P - W) r - r_s (P + W) over the sum of both, of a force that is off by its slope.
    off = slope * abs(shift) * (CORD_RADIUS - R_S) / (2.0 * (LIFTING - LOAD) * CORD_RADIUS)
    assert check.value == pytest.approx(off, rel=1e-5)
    assert not check.ok


@pytest.mark.parametrize("time", [0.0, 1.0], ids=["at the start", "at a jump"])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_breakaway_where_the_contact_could_hold_is_detected(time: float, share: float) -> None:
    """A force jumps to a share of the one that lifts, and the contact gives way in any case."""

    jump = {"time": [time, float(np.nextafter(time, 9.0))], "value": [LOAD, 1.1 * LIFTING]}
    samples = Samples(nearly_done(pulley(drive__force=jump if time else 1.1 * LIFTING)))
    assert samples.event(0) == (pytest.approx(time), STICK, FORWARD)
    force = share * LIFTING
    limit, torque = R_S * (force + LOAD), CORD_RADIUS * (force - LOAD)
    of_that_force = slice(1 if time else 0, None)  # at the jump the side after it
    samples.sides("margin_forward")[0, of_that_force] = limit - torque
    samples.sides("margin_backward")[0, of_that_force] = limit + torque
    check = samples.audit()["release"]
    # At the jump the torque just before is zero, and its distance is the whole of the limit.
    expected = (1.0 if time else (limit - torque) / (limit + torque)) if share < 1.0 else 0.0
    assert check.value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("rtol", [1e-10, 1e-3, 0.99])
def test_the_allowed_energy_error_is_at_most_one_percent(rtol: float) -> None:
    """The work of the force is 31 kJ, far below the absolute tolerance of 1e49 J."""
    # Short steps are accurate, whatever is allowed.
    step = {"solver__atol": 1e49, "solver__rtol": rtol, "solver__max_step": 0.02}
    run = nearly_done(pulley(drive__force=RETURN_FORCE, solver__duration=12.0, **step))
    allowed = min(max(100.0, 0.1 * run.statistics.steps) * rtol, 0.01)
    for factor, passes in ((0.0, True), (0.5, True), (1.1, False)):
        samples = Samples(run)
        samples["energy_input"] *= 1.0 - factor * allowed
        check = samples.audit()["energy_balance"]
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
    ("mu_k", "rtol"), one_in(5, product([None, 0.05], [1e-6, 1e-8, 1e-10, 1e-12]))
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
    assert fs.run_command_line(arguments) == 3


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
