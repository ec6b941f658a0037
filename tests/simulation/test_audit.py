"""The self-audit passes sound runs and detects violations, of one contact and of several."""

from collections.abc import Callable
from functools import cache
from math import exp, radians
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import FORWARD, STICK, failures
from tests.support.changed_samples import Samples, nearly_done
from tests.support.lifts import CORD, GRAVITY, SHAFT, lift, ramp, solved
from tests.support.problems import CORD_RADIUS, LOAD, R_S, RETURN_FORCE
from tests.support.scenarios import Scenario, changed, pulley, simulate

# A last corner at 10 s: to there it rests in one turn, and what follows is the last one.
FORCE = {
    "time": [*RETURN_FORCE["time"][:-1], 10.0, 12.0],
    "value": [*RETURN_FORCE["value"], 1840.0],
}
STOP = ramp((0.0, 70.0), (0.3, 400.0), (0.6, 400.0), (0.65, -900.0), (1.0, -900.0), (1.1, 70.0))
# An emergency stop that lets both sides of a lift fall slack, and one in which its cord slips.
SLACK = lift(
    drive__torque=STOP,
    effects__shaft_friction=SHAFT,
    effects__hanging_masses__restitution=0.3,
    solver={"duration": 2.0, "rtol": 1e-8, "atol": 1e-11},
    output__interval=0.02,
)
SLIPPING = changed(SLACK, effects__cord_friction=CORD)
RUNS = {
    "pulley": pulley(drive__force=FORCE, solver__duration=12.0),  # sticks, slips, sticks again
    "slack": SLACK,
    "slipping": SLIPPING,
}


@cache
def stopped(name: str) -> fs.Result:
    return nearly_done(RUNS[name])


def last(samples: Samples, mode: str) -> int:
    """Return the last sample at which a contact sticks, before the run was stopped."""
    return int(np.flatnonzero((samples[mode][1:] == STICK) & (samples[mode][:-1] == STICK))[-1]) + 1


def scaled(name: str, factor: float, at: Any = slice(None)) -> Callable[[Samples], None]:
    def change(samples: Samples) -> None:
        samples[name][at] *= factor

    return change


def friction(share: float) -> Callable[[Samples], None]:
    """Have the friction at rest be a share of its limit."""

    def change(samples: Samples) -> None:
        i = last(samples, "mode")
        limit = 0.5 * (samples["margin_forward"][i] + samples["margin_backward"][i])
        samples["friction_torque"][i] = -share * limit

    return change


def sliding(name: str, to: Callable[[float], float]) -> Callable[[Samples], None]:
    """Change a column at a sample that slides; `to` is of the friction there."""

    def change(samples: Samples) -> None:
        i = np.flatnonzero(samples["mode"] == FORWARD)[5]
        samples[name][i] = to(samples["friction_torque"][i])

    return change


def moved(name: str, mode: str, towards: float = np.inf) -> Callable[[Samples], None]:
    """Move what sticks by a rounding."""

    def change(samples: Samples) -> None:
        i = last(samples, mode)
        samples[name][i] = np.nextafter(samples[name][i], towards)

    return change


def below_zero(name: str, at: int | str = "mode") -> Callable[[Samples], None]:
    def change(samples: Samples) -> None:
        samples[name][at if isinstance(at, int) else last(samples, at)] = -1e-6

    return change


@pytest.mark.parametrize(
    ("name", "change", "failing"),
    [
        *[(name, lambda samples: None, set()) for name in RUNS],
        ("pulley", scaled("energy_friction", 1.0 - 1e-5), {"energy_balance"}),
        ("slipping", scaled("energy_cord_friction", 1.001), {"energy_balance"}),
        ("pulley", friction(1.0 - 1e-9), set()),
        ("pulley", friction(1.0 + 1e-9), {"friction_law"}),
        # A contact that holds more than it can, though its force is within the mean of the limits.
        ("pulley", below_zero("margin_forward"), {"friction_law"}),
        ("slipping", below_zero("cord_margin_forward", "cord_mode"), {"friction_law"}),
        ("pulley", sliding("friction_torque", lambda T: -T), {"dissipation_sign"}),
        ("slipping", scaled("cord_slip_rate", -1.0), {"dissipation_sign"}),
        # Below the absolute tolerance of 1e-12 rad/s a speed may have either sign.
        (
            "pulley",
            sliding("angular_velocity", lambda T: np.copysign(1e-11, T)),
            {"dissipation_sign"},
        ),
        ("pulley", sliding("angular_velocity", lambda T: np.copysign(1e-13, T)), set()),
        ("pulley", moved("angle", "mode"), {"stick_drift"}),
        ("pulley", moved("angle", "mode", -np.inf), {"stick_drift"}),
        ("slipping", moved("cord_slip", "cord_mode"), {"stick_drift"}),
        ("slack", below_zero("rope_tension_car", 3), {"rope_tension"}),
        ("slack", scaled("energy_impact", -1.0), {"dissipation_sign", "energy_balance"}),
    ],
)
def test_what_is_wrong_is_detected_and_what_is_not_passes(
    name: str, change: Callable[[Samples], None], failing: set[str]
) -> None:
    samples = Samples(stopped(name))
    change(samples)
    assert samples.failed() == failing


def test_what_it_reads_of_a_contact_is_torque_and_limit() -> None:
    """Whose difference is the margin in a direction, while the body is at rest."""
    sound = Samples(stopped("pulley"))
    rest = sound["mode"] == STICK
    force = sound["drive_force"][rest]
    torque, limit = CORD_RADIUS * (force - LOAD), R_S * (force + LOAD)
    assert sound["margin_forward"][rest] == pytest.approx(limit - torque, rel=1e-12)
    assert sound["margin_backward"][rest] == pytest.approx(limit + torque, rel=1e-12)
    # Of three products, a few roundings each.
    assert np.all(sound["margin_roundoff"] < 1e-14 * (limit.max() + CORD_RADIUS * force.max()))


def test_what_it_reads_of_a_cord_is_the_ratio_of_its_forces() -> None:
    """T1/T2 and T2/T1 are at most exp(mu_s phi): T1 - T2 has other limits than T2 - T1."""
    samples = Samples(nearly_done(changed(SLIPPING, effects__cord_friction__mu_s=0.25)))
    rest = samples["cord_mode"] == STICK
    assert 5 < rest.sum() < len(rest)
    ratio = exp(0.25 * radians(CORD["wrap_deg"]))
    car = samples["rope_tension_car"][rest]
    other = samples["rope_tension_counterweight"][rest]
    size = 1e-12 * np.max(car + other)  # of differences of both
    assert samples["cord_margin_forward"][rest] == pytest.approx(ratio * car - other, abs=size)
    assert samples["cord_margin_backward"][rest] == pytest.approx(ratio * other - car, abs=size)


def test_slip_between_two_sticking_samples_is_not_drift() -> None:
    data = pulley(
        drive__force={"sine": {"mean": 2450.0, "amplitude": 450.0, "frequency_hz": 0.5}},
        solver__duration=8.0,
        output__interval=1.9,
    )
    run = simulate(data)
    assert np.any(np.diff(run.channels["angle"][run.channels["mode"] == 0]) > 1.0)
    assert failures(run.checks) == ""


# --- breakaways -----------------------------------------------------------------------------------

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
    """A force jumps to a share of the one that lifts, and the contact breaks away in any case."""
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


def pushed_or_turned(seed: int) -> Scenario:
    """Return a drawn lift with a cord that slips.

    Of even seeds a rope may have to push if it holds; of odd ones equal masses swing to a sine.
    """
    rng, pushed = np.random.default_rng(seed), seed % 2 == 0
    draw = rng.uniform
    r, car = draw(0.1, 0.5), draw(10.0, 1000.0)
    other = car * draw(0.8, 1.2) if pushed else car
    size, mu, cord = (car + other) * GRAVITY * r, draw(0.05, 0.6), draw(0.05, 0.6)
    frequency = draw(2.0, 5.0)
    sine = {"amplitude": draw(0.4, 1.5) * size, "frequency_hz": frequency}
    shaft = {"shaft_radius": draw(0.02, 0.08), "mu_s": mu, "mu_k": 0.6 * mu}
    return lift(
        mechanism={"cord_radius": r, "inertia": draw(0.05, 3.0)},
        drive__torque=rng.choice([-1.0, 1.0]) * draw(0.5, 2.0) * size if pushed else {"sine": sine},
        effects__hanging_masses={"car": car, "counterweight": other},
        effects__cord_friction={"mu_s": cord, "mu_k": cord, "wrap_deg": draw(60.0, 400.0)},
        **({} if seed % 4 == 0 else {"effects__shaft_friction": shaft}),
        solver={"duration": 0.02 if pushed else 6.0 / frequency, "rtol": 1e-6, "atol": 1e-6},
    )


def test_no_drawn_lift_fails_its_audit_where_a_rope_would_push_or_a_cord_turns() -> None:
    for seed in range(350, 370):  # in which both decide of breakaways
        solved(pushed_or_turned(seed))


# --- the energy balance ---------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-10, 0.99])
def test_the_allowed_energy_error_is_at_most_one_percent(rtol: float) -> None:
    """The work of the force is 31 kJ, far below the absolute tolerance of 1e49 J."""
    # Short steps are accurate, whatever is allowed.
    step = {"solver__atol": 1e49, "solver__rtol": rtol, "solver__max_step": 0.02}
    run = nearly_done(pulley(drive__force=RETURN_FORCE, solver__duration=12.0, **step))
    allowed = min(max(100.0, 0.1 * run.statistics.steps) * rtol, 0.01)
    for factor, passes in ((0.5, True), (1.1, False)):
        samples = Samples(run)
        samples["energy_input"] *= 1.0 - factor * allowed
        check = samples.audit()["energy_balance"]
        assert check.limit <= 0.01
        assert check.ok is passes


def test_a_flywheel_of_many_turns_passes_the_audit() -> None:
    """An eccentric mass exchanges 2 J a turn with 750 J; errors of thousands of steps add up."""
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.4, "mass": 30.0, "initial_angular_velocity": 60.0},
        "effects": {"gravity": {}, "eccentric_mass": {"mass": 0.5, "radius": 0.2}},
        "solver": {"backend": "events", "duration": 20.0, "rtol": 1e-10},
    }
    run = simulate(data)
    check = run.checks["energy_balance"]
    assert check.ok
    # A tenth of a tolerance for each step, more than a hundred.
    assert run.statistics.steps > 1000
    limit = 0.1 * run.statistics.steps * 1e-10 + 1e-12
    assert check.limit == pytest.approx(limit, rel=1e-12)
    stored = run.channels["energy_kinetic"] + run.channels["energy_potential"]
    worst = np.max(np.abs(stored - stored[0])) / np.max(run.channels["energy_kinetic"])
    assert check.value == pytest.approx(worst, rel=1e-2, abs=1e-13)


def test_a_uniform_motion_passes_the_audit() -> None:
    """The roundoff of the kinetic energy exceeds the work of the torque."""
    gear = {"sun_radius": 0.08, "planet_radius": 0.06, "crank_mass": 0.188, "planet_mass": 4.47}
    data = {
        "kind": "epicyclic",
        "mechanism": gear | {"initial_angular_velocity": 4.083155205282193},
        "drive": {"torque": 1e-14},
        "solver": {"backend": "rkf45", "duration": 2.0, "rtol": 1e-4},
    }
    assert failures(simulate(data).checks) == ""
