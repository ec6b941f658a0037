"""Runs of several contacts: resumption, samples, audit, studies and sweeps."""

from itertools import pairwise
from math import exp, hypot, radians
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers import events as events_of_contacts
from frictionsim.solvers.modes import consistent
from tests.support.changed_samples import Samples, nearly_done
from tests.support.lifts import CORD, GRAVITY, SHAFT, events, grips, lift, ramp, solved
from tests.support.scenarios import Scenario, changed
from tests.support.stopped_runs import interrupted_at

STOP = ramp((0.0, 70.0), (0.3, 400.0), (0.6, 400.0), (0.65, -900.0), (1.0, -900.0), (1.1, 70.0))


def slack_lift(**changes: Any) -> Scenario:
    """Return a lift whose emergency stop lets both sides fall slack."""
    return lift(
        drive__torque=STOP,
        effects__shaft_friction=SHAFT,
        effects__hanging_masses__restitution=0.3,
        solver__rtol=1e-8,
        solver__atol=1e-11,
        **changes,
    )


def slipping_lift(**changes: Any) -> Scenario:
    return slack_lift(effects__cord_friction=CORD, **changes)


def test_events_have_both_sides_and_their_own_sample() -> None:
    result = solved(slipping_lift())
    assert np.isin([e.time for e in result.transitions], result.time).all()
    for i, event in enumerate(result.transitions):
        channel = {"shaft": "mode", "cord": "cord_mode"}[event.contact]
        assert result.events[f"{channel}_before" if channel != "mode" else "cord_mode_before"].size
        if channel == "cord_mode":
            assert result.events["cord_mode_before"][i] == event.mode_from
            assert result.events["cord_mode_after"][i] == event.mode_to
    assert np.all(np.diff(result.time) > 0.0)


@pytest.fixture(scope="module")
def slipping() -> fs.Result:
    """A run with a cord that sticks and slips; not to be changed."""
    return nearly_done(slipping_lift(output__interval=0.02))


def test_the_audit_sees_what_is_wrong(slipping: fs.Result) -> None:
    assert Samples(slipping).failed() == set()
    samples = Samples(slipping)
    held = int(
        np.flatnonzero((samples["cord_mode"][1:] == STICK) & (samples["cord_mode"][:-1] == STICK))[
            0
        ]
    )
    samples["cord_slip"][held] += 1e-15
    assert "stick_drift" in samples.failed()
    for margin in ("margin_backward", "cord_margin_forward"):
        samples = Samples(slipping)
        samples[margin] -= samples[margin] + 1e-9
        assert samples.failed() == {"friction_law"}
    samples = Samples(slipping)
    samples["cord_slip_rate"] *= -1.0
    assert samples.failed() == {"dissipation_sign"}
    samples = Samples(slipping)
    samples["energy_cord_friction"] *= 1.001
    assert samples.failed() == {"energy_balance"}


def test_what_the_audit_reads_of_a_cord_is_the_ratio_of_its_forces() -> None:
    """T1/T2 and T2/T1 are at most exp(mu_s phi): T1 - T2 has other limits than T2 - T1."""
    data = changed(slipping_lift(output__interval=0.02), effects__cord_friction__mu_s=0.25)
    samples = Samples(nearly_done(data))
    rest = samples["cord_mode"] == STICK
    assert 5 < rest.sum() < len(rest)
    ratio = exp(0.25 * radians(CORD["wrap_deg"]))
    car = samples["rope_tension_car"][rest]
    other = samples["rope_tension_counterweight"][rest]
    size = 1e-12 * np.max(car + other)  # of differences of both
    assert samples["cord_margin_forward"][rest] == pytest.approx(ratio * car - other, abs=size)
    assert samples["cord_margin_backward"][rest] == pytest.approx(ratio * other - car, abs=size)


def test_the_audit_sees_a_rope_that_pushes_and_an_impact_that_drives() -> None:
    slack = nearly_done(slack_lift(output__interval=0.02))
    assert Samples(slack).failed() == set()
    samples = Samples(slack)
    samples["rope_tension_car"][3] = -1e-6
    assert "rope_tension" in samples.failed()
    samples = Samples(slack)
    assert samples["energy_impact"][-1] > 0.0
    samples["energy_impact"] *= -1.0
    assert "dissipation_sign" in samples.failed()


def with_other_modes(
    monkeypatch: pytest.MonkeyPatch, modes: tuple[int, ...], wrong: tuple[int, ...]
) -> None:
    """Have the solver take other modes than those that it finds."""

    def replaced(*arguments: Any) -> list[int]:
        found = consistent(*arguments)
        return list(wrong) if tuple(found) == modes else found

    monkeypatch.setattr(events_of_contacts, "consistent", replaced)


RISING = ramp((0.0, -28.0), (2.0, -45.0))
# A torque that jumps beyond the limit of the shaft, -38.147 N m.
JUMP = ramp((0.0, -28.0), (0.5, -28.0), (float(np.nextafter(0.5, 1.0)), -40.0))


@pytest.mark.parametrize("torque", [RISING, JUMP], ids=["at its limit", "jump"])
def test_the_audit_sees_a_cord_that_slips_within_its_limit(
    torque: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = grips(33.0, torque)
    assert solved(data).checks["release"].ok
    with_other_modes(monkeypatch, (BACKWARD, STICK), (BACKWARD, FORWARD))
    result = fs.solve(data).record
    assert (result.status, result.exit_code) == ("done", 3)
    assert not result.checks["release"].ok
    # What the torque is beyond the limit of the shaft accelerates the masses.
    r, r_f, car, other = 0.24, 0.045 * 0.3 / hypot(1.0, 0.3), 33.0 * GRAVITY, 45.0 * GRAVITY
    limit = r * (car - other) - r_f * (car + other)
    beyond = 0.0 if torque is RISING else -40.0 - limit
    inertia = 0.2 + (car * r * (r - r_f) + other * r * (r + r_f)) / GRAVITY
    rise = r * beyond / inertia / GRAVITY
    t1, t2 = car * (1.0 + rise), other * (1.0 - rise)
    ratio = exp(0.19 * radians(132.0))
    # Relative to half the sum of the limits in both directions, and as much of the margins' spread.
    size = 0.5 * ((ratio - 1.0) * (t1 + t2) + (ratio + 1.0) * (t2 - t1))
    expected = (ratio * t1 - t2) / size
    assert result.checks["release"].value == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("share", [1.0 + 1e-8, 1.0 - 1e-8])
def test_the_audit_sees_a_shaft_that_gives_way_off_its_limit(share: float) -> None:
    samples = Samples(nearly_done(slack_lift()))
    assert samples.audit()["release"].ok
    forward, backward = (samples.sides(f"margin_{side}") for side in ("forward", "backward"))
    more = (share - 1.0) * 0.5 * (forward + backward)
    forward += more
    backward += more
    # Off by 1e-8 of the limit, relative to the sum of limit and force.
    assert samples.audit()["release"].value == pytest.approx(0.5e-8, rel=1e-5)


@pytest.mark.parametrize("torque", [-3500.0, 3500.0, 4500.0])
def test_a_cord_slips_from_the_start_where_a_rope_would_push_if_it_held(torque: float) -> None:
    masses = {"car": 270.0, "counterweight": 240.0}
    # Held, the masses and the pulley have one acceleration; T1, T2 follow from those of the masses.
    inertia = 2.0 + 0.5**2 * (270.0 + 240.0)
    rim = 0.5 * (torque + 0.5 * GRAVITY * (240.0 - 270.0)) / inertia
    assert min(270.0 * (GRAVITY + rim), 240.0 * (GRAVITY - rim)) < 0.0
    result = solved(
        lift(
            mechanism={"cord_radius": 0.5, "inertia": 2.0},
            drive__torque=torque,
            effects__hanging_masses=masses,
            effects__cord_friction={"mu_s": 0.54, "mu_k": 0.54, "wrap_deg": 280.0},
            solver__duration=0.01,
        )
    )
    assert events(result) == [("cord", STICK, -1 if torque > 0.0 else 1)]
    assert result.checks["release"].value == 0.0


def turning_cord(rtol: float) -> Scenario:
    """Return a lift whose shaft gives way at 2.035 s, as its cord turns without an event."""
    return lift(
        mechanism={"cord_radius": 0.2707283148306785, "inertia": 2.0634048037161175},
        drive__torque={"sine": {"amplitude": 1574.3728041655054, "frequency_hz": 3.9995061167858}},
        effects__hanging_masses={"car": 592.79549, "counterweight": 592.79549, "rope": 5.0},
        effects__shaft_friction={"shaft_radius": 0.06654055, "mu_s": 0.36575418, "mu_k": 0.2194525},
        effects__cord_friction={"mu_s": 0.51802961, "mu_k": 0.51802961, "wrap_deg": 72.558713},
        solver__duration=2.1,
        solver__rtol=rtol,
        solver__atol=rtol,
    )


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_a_shaft_may_give_way_off_its_limit_where_the_cord_turns(rtol: float) -> None:
    data = turning_cord(rtol)
    solved(data)
    stopped = fs.solve(data, progress=interrupted_at(2.036))
    samples = Samples(stopped)
    times = np.array([samples.event(i)[0] for i in range(len(samples.sides("time")))])
    samples.keep_events((times > 2.034) & (times < 2.036))
    assert samples.event(0)[1] == STICK
    assert samples.sides("mode").tolist() != [[STICK, STICK]]
    assert samples.sides("cord_slip_rate").tolist() == [[0.0, 0.0]]
    assert samples.sides("cord_mode").tolist() == [[BACKWARD, BACKWARD]]
    assert samples.audit()["release"].value == 0.0


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
        solver__duration=0.02 if pushed else 6.0 / frequency,
        solver__rtol=1e-6,
        solver__atol=1e-6,
    )


def test_no_drawn_lift_fails_its_audit_where_a_rope_would_push_or_a_cord_turns() -> None:
    for seed in range(340, 370):  # in which both decide of breakaways
        solved(pushed_or_turned(seed))


@pytest.mark.parametrize(("torque", "moves"), [(50.0, False), (220.0, True)])
def test_a_lift_moves_although_its_cord_never_slips(torque: float, moves: bool) -> None:
    """Balanced by 49 N m, its shaft holds 25 N m; the cord of that friction holds much more."""
    data = lift(
        drive__torque=torque,
        effects__shaft_friction=SHAFT,
        effects__cord_friction={"mu_s": 2.0, "mu_k": 2.0},
        solver__duration=0.1,
    )
    done = solved(data)
    assert [e.contact for e in done.transitions] == (["shaft"] if moves else [])
    assert ("nothing moves: all contacts hold" not in done.warnings) is moves


def test_a_study_compares_tolerances_of_events() -> None:
    study = fs.cost(slipping_lift(), tolerances=[1e-4, 1e-6], repeats=1).to_json()
    settings = [(s["backend"], s["law"], s["setting"]) for s in study["settings"]]
    assert settings == [("events", "set-valued", f"rtol 1e-{digits}") for digits in (4, 6)]
    assert study["references"] == [
        "events, set-valued, rtol 5e-8",
        "events, set-valued, rtol 1e-7, max_step 2e-3",
    ]


def test_the_error_is_estimated_by_a_second_run() -> None:
    error = fs.solve(slack_lift(), estimate_error=True).errors["final_angle"]
    assert error is not None
    assert error < 1e-6


def test_events_at_one_time_have_one_state_on_each_side() -> None:
    result = solved(slack_lift())
    together = [i for i, (a, b) in enumerate(pairwise(result.transitions)) if a.time == b.time]
    assert together
    for i in together:
        for side in ("before", "after"):
            values = result.events[f"angular_velocity_{side}"]
            assert values[i] == values[i + 1]
    assert BACKWARD in result.channels["mode"]
