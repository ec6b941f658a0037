"""Runs of several contacts: resumption, samples, audit, studies and sweeps."""

from array import array
from collections.abc import Callable
from itertools import pairwise
from math import exp, hypot, radians
from typing import Any

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.mechanisms.pulley import build
from frictionsim.mechanisms.pulley.masses import CAR, OTHER
from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.scenario.loading import validate
from frictionsim.simulation.multi_contact import (
    MultiContactSimulation,
    audit,
    friction_violation,
    release_check,
)
from frictionsim.simulation.simulate import run
from frictionsim.solvers import multi_contact
from frictionsim.solvers.contacts import Contact, Friction
from frictionsim.solvers.mechanism import Trajectory
from frictionsim.solvers.multi_contact_modes import write_consistent_modes
from frictionsim.solvers.multi_contact_state import MODES
from frictionsim.work_precision.error_estimate import estimate
from frictionsim.work_precision.settings import CostOptions
from tests.support.lifts import CORD, GRAVITY, SHAFT, events, grips, lift, ramp, solved
from tests.support.scenarios import SCENARIOS, Scenario, scenario_run

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


@pytest.mark.parametrize(("array", "value"), [("solver.modes", 2.0), ("solver.modes", 0.5)])
def test_a_state_with_modes_of_no_contact_is_refused(array: str, value: float) -> None:
    scenario = validate(slack_lift(), SCENARIOS)
    state = MultiContactSimulation(scenario, build(scenario)).state()
    assert state is not None
    state[array][0] = value
    with pytest.raises(InputError) as refused:
        MultiContactSimulation(scenario, build(scenario)).restore(state)
    assert array in str(refused.value)


def test_samples_may_be_at_given_times() -> None:
    scenario = validate(slipping_lift(output__at_events=False), SCENARIOS)
    given = [0.0, 0.123, 0.7, 1.9]
    sampled = run(scenario, lambda t: None, sample_times=given)
    assert sampled.time.tolist() == given
    whole = solved(slipping_lift())
    assert sampled.transitions == whole.transitions


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


def trajectory(data: Scenario) -> tuple[Trajectory, Any]:
    scenario = validate(data, SCENARIOS)
    mechanism = build(scenario)
    simulation = MultiContactSimulation(scenario, mechanism)
    simulation.solve(lambda t: None)
    return simulation.trajectory(), mechanism


def failed(path: Trajectory, mechanism: Any) -> list[str]:
    checks = audit(path, mechanism, 1e-6, 1e-11)
    return [name for name, check in checks.items() if not check.ok]


def test_the_audit_sees_what_is_wrong() -> None:
    path, mechanism = trajectory(slipping_lift())
    assert failed(path, mechanism) == []
    moved = path.position.copy()
    held = int(np.flatnonzero((path.modes[1, 1:] == STICK) & (path.modes[1, :-1] == STICK))[0])
    moved[1, held] += 1e-15
    assert "stick_drift" in failed(path._replace(position=moved), mechanism)
    for row, check in ((0, "friction_law"), (2, "friction_law")):
        forces = path.forces.copy()
        forces[row] *= 1.0 + 1e-9
        assert check in failed(path._replace(forces=forces), mechanism)
    assert "dissipation_sign" in failed(path._replace(velocity=-path.velocity), mechanism)
    heat = dict(path.energy_integrals)
    heat["energy_cord_friction"] = 1.001 * heat["energy_cord_friction"]
    assert failed(path._replace(energy_integrals=heat), mechanism) == ["energy_balance"]


@pytest.mark.parametrize("side", [CAR, OTHER])
def test_the_audit_knows_that_a_cord_holds_unlike_forces_in_both_directions(side: int) -> None:
    """T1/T2 and T2/T1 are at most exp(mu_s phi): T1 - T2 has other limits than T2 - T1."""
    path, mechanism = trajectory(slipping_lift())
    index, cord = mechanism.frictions[1]
    held = int(np.flatnonzero(path.modes[index] == STICK)[0])
    ratio = exp(CORD["mu_s"] * radians(CORD.get("wrap_deg", 180.0)))
    for share, passes in ((0.999, True), (1.001, False)):
        forces = path.forces.copy()
        forces[side, held] = (1.0 + share * (ratio - 1.0)) * forces[CAR + OTHER - side, held]
        violation = friction_violation(path._replace(forces=forces), cord, index)
        assert (violation < 1e-12) is passes


def test_the_audit_sees_a_rope_that_pushes_and_an_impact_that_drives() -> None:
    path, mechanism = trajectory(slack_lift())
    assert failed(path, mechanism) == []
    forces = path.forces.copy()
    forces[1, 3] = -1e-6
    assert "rope_tension" in failed(path._replace(forces=forces), mechanism)
    lost = dict(path.energy_integrals)
    assert lost["energy_impact"][-1] > 0.0
    lost["energy_impact"] = -lost["energy_impact"]
    assert "dissipation_sign" in failed(path._replace(energy_integrals=lost), mechanism)


def with_other_modes(
    monkeypatch: pytest.MonkeyPatch, modes: tuple[int, ...], wrong: tuple[int, ...]
) -> None:
    """Have the solver take other modes than those that it finds."""

    def replaced(system: Any, run: Any, s: Any) -> None:
        write_consistent_modes(system, run, s)
        if tuple(s[MODES : MODES + len(modes)]) == modes:
            s[MODES : MODES + len(modes)] = array("d", wrong)

    monkeypatch.setattr(multi_contact, "write_consistent_modes", replaced)


RISING = ramp((0.0, -28.0), (2.0, -45.0))
# A torque that jumps beyond the limit of the shaft, -38.147 N m.
JUMP = ramp((0.0, -28.0), (0.5, -28.0), (float(np.nextafter(0.5, 1.0)), -40.0))


@pytest.mark.parametrize("torque", [RISING, JUMP, -40.0], ids=["at its limit", "jump", "start"])
def test_the_audit_sees_a_cord_that_slips_within_its_limit(
    torque: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = grips(33.0, torque)
    assert solved(data).checks["release"].ok
    with_other_modes(monkeypatch, (BACKWARD, STICK), (BACKWARD, FORWARD))
    result = run(validate(data, SCENARIOS), lambda t: None)
    assert (result.status, result.exit_code) == ("done", 3)
    assert not result.checks["release"].ok
    # What the torque is beyond the limit of the shaft accelerates the masses.
    r, r_f, car, other = 0.24, 0.045 * 0.3 / hypot(1.0, 0.3), 33.0 * GRAVITY, 45.0 * GRAVITY
    limit = r * (car - other) - r_f * (car + other)
    beyond = 0.0 if torque is RISING else -40.0 - limit
    inertia = 0.2 + (car * r * (r - r_f) + other * r * (r + r_f)) / GRAVITY
    rise = r * beyond / inertia / GRAVITY
    t1, t2 = car * (1.0 + rise), other * (1.0 - rise)
    most = (exp(0.19 * radians(132.0)) - 1.0) * t1
    expected = (most - (t2 - t1)) / (most + (t2 - t1))
    assert result.checks["release"].value == pytest.approx(expected, rel=1e-9)


def both_sides(
    data: Scenario, which: Callable[[Transition], bool]
) -> tuple[Any, Trajectory, Trajectory]:
    """Return the mechanism, and the samples immediately before and after some of the events."""
    scenario = validate(data, SCENARIOS)
    mechanism = build(scenario)
    simulation = MultiContactSimulation(scenario, mechanism)
    simulation.solve(lambda t: None)
    samples = simulation._samples()
    chosen = [which(event) for event in samples.transitions]
    transitions = [event for event in samples.transitions if which(event)]
    before, after = (
        simulation._trajectory_of(rows[chosen], transitions)
        for rows in (samples.before, samples.after)
    )
    return mechanism, before, after


def with_static_limits(contact: Contact, share: float) -> Contact:
    """Return a contact with other static limits."""
    assert isinstance(contact.law, Friction)
    forward, backward = (tuple(share * x for x in form) for form in contact.law.static)
    return contact._replace(law=contact.law._replace(static=(forward, backward)))


@pytest.mark.parametrize("share", [1.0 + 1e-8, 1.0 - 1e-8])
def test_the_audit_sees_a_shaft_that_gives_way_off_its_limit(share: float) -> None:
    mechanism, before, after = both_sides(slack_lift(), lambda event: True)
    assert release_check(mechanism, before, after, 2.0).ok
    shaft, *ropes = mechanism.contacts
    other = with_static_limits(shaft, share)
    check = release_check(mechanism._replace(contacts=(other, *ropes)), before, after, 2.0)
    # Off by 1e-8 of the limit, relative to the sum of limit and force.
    assert check.value == pytest.approx(0.5e-8, rel=1e-5)


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
    mechanism, before, after = both_sides(data, lambda event: 2.034 < event.time < 2.036)
    assert [(e.contact, e.mode_from) for e in after.transitions] == [("shaft", STICK)]
    assert before.velocity[1].tolist() == after.velocity[1].tolist() == [0.0]
    assert before.modes[1].tolist() == after.modes[1].tolist() == [BACKWARD]
    assert release_check(mechanism, before, after, 2.1).value == 0.0
    # A shaft of six times the limit 2 r_s W holds the torque; then equal weights hold the cord.
    shaft, cord = mechanism.contacts
    other = with_static_limits(shaft, 6.0)
    check = release_check(mechanism._replace(contacts=(other, cord)), before, after, 2.1)
    r_s, torque = 0.06654055 * 0.36575418 / hypot(1.0, 0.36575418), abs(float(after.drive[0]))
    limit = 6.0 * 2.0 * r_s * (592.79549 + 2.5) * GRAVITY
    assert check.value == pytest.approx((limit - torque) / (limit + torque), rel=1e-9)


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
    for seed in range(340, 400):  # in which both decide of breakaways
        solved(pushed_or_turned(seed))


def test_a_study_compares_tolerances_of_events() -> None:
    scenario = validate(slipping_lift(), SCENARIOS)
    plan = CostOptions.of(tolerances=[1e-4, 1e-6]).plan(scenario)
    assert [setting.name for setting in plan.settings] == [
        "events, set-valued, rtol 1e-4",
        "events, set-valued, rtol 1e-6",
    ]
    assert [setting.name for setting in plan.references] == [
        "events, set-valued, rtol 5e-8",
        "events, set-valued, rtol 1e-7, max_step 2e-3",
    ]
    for setting in plan.references:
        scenario.replace(setting.all_overrides)


def test_the_error_is_estimated_by_a_second_run() -> None:
    done = solved(slack_lift())
    estimated = estimate(scenario_run(done), done, lambda t: None)
    assert estimated.errors["final_angle"] is not None
    assert estimated.errors["final_angle"] < 1e-6


def test_events_at_one_time_have_one_state_on_each_side() -> None:
    result = solved(slack_lift())
    together = [i for i, (a, b) in enumerate(pairwise(result.transitions)) if a.time == b.time]
    assert together
    for i in together:
        for side in ("before", "after"):
            values = result.events[f"angular_velocity_{side}"]
            assert values[i] == values[i + 1]
    assert BACKWARD in result.channels["mode"]
