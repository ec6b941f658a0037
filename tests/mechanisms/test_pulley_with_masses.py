"""A pulley with masses on its cord against closed forms: friction, slip, slack, torques."""

from math import copysign, exp, hypot, log, pi
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT, Quantity
from tests.support.lifts import (
    CORD,
    GRAVITY,
    SHAFT,
    changes,
    gap_rates,
    grips,
    lift,
    ramp,
    solved,
)
from tests.support.scenarios import SCENARIOS, Scenario, changed, events, scenario_run, times

R, INERTIA, M1, M2 = 0.25, 2.0, 100.0, 80.0
R_S, R_K = 0.05 * 0.3 / hypot(1.0, 0.3), 0.05 * 0.2 / hypot(1.0, 0.2)
EPS = 1e-12


def balance(direction: int, torque: float) -> tuple[float, float, float]:
    """Return acceleration and tensions of a taut cord: the three equations, solved as they are."""
    r_f = direction * R_K
    matrix = [
        [INERTIA, R + r_f, -R + r_f],  # I w' = (T2 - T1) r + tau - s r_k (T1 + T2)
        [M1 * R, -1.0, 0.0],  # m1 r w' = T1 - m1 g
        [M2 * R, 0.0, 1.0],  # m2 r w' = m2 g - T2
    ]
    solution = np.linalg.solve(matrix, [torque, -M1 * GRAVITY, M2 * GRAVITY])
    return float(solution[0]), float(solution[1]), float(solution[2])


@pytest.mark.parametrize(("torque", "direction"), [(0.0, BACKWARD), (150.0, FORWARD)])
def test_masses_and_friction_accelerate_as_the_equations_say(torque: float, direction: int) -> None:
    result = solved(lift(drive__torque=torque, effects__shaft_friction=SHAFT))
    acceleration, t1, t2 = balance(direction, torque)
    assert events(result) == [("shaft", STICK, direction)]
    channels, time = result.channels, result.time
    assert channels["angle"] == pytest.approx(0.5 * acceleration * time**2, abs=1e-11)
    assert channels["rope_tension_car"][1:] == pytest.approx(t1, rel=EPS)
    assert channels["rope_tension_counterweight"][1:] == pytest.approx(t2, rel=EPS)
    assert channels["shaft_reaction"][1:] == pytest.approx(t1 + t2, rel=EPS)
    assert channels["friction_torque"][1:] == pytest.approx(-direction * R_K * (t1 + t2), rel=EPS)


@pytest.mark.parametrize("side", ["lift", "hold"])
def test_the_force_of_the_statics_is_the_limit_of_rest(side: str) -> None:
    data = lift(drive={"force": 0.0}, effects__shaft_friction=SHAFT)
    limit = fs.static(data)[f"force_to_{side}"].value
    assert limit is not None
    way = 1.0 if side == "lift" else -1.0
    t1, t2 = M1 * GRAVITY, limit + M2 * GRAVITY
    assert way * (t2 - t1) * R == pytest.approx(R_S * (t1 + t2), rel=EPS)
    for share, mode in ((0.999999, STICK), (1.000001, int(way))):
        force = limit + way * (share - 1.0) * t2
        result = solved(lift(drive={"force": force}, effects__shaft_friction=SHAFT))
        assert result.channels["mode"][-1] == mode


def test_a_cord_slips_at_the_ratio_of_euler_and_eytelwein_and_keeps_it() -> None:
    data = lift(
        drive={"force": ramp((0.0, 200.0), (1.0, 1200.0))},
        effects__shaft_friction={"shaft_radius": 0.2, "mu_s": 1.0, "mu_k": 0.9},
        effects__cord_friction=CORD | {"mu_k": CORD["mu_s"]},
    )
    result = solved(data)
    ratio = exp(0.12 * pi)
    assert result.quantities["tension_ratio_allowed"].value == pytest.approx(ratio, rel=EPS)
    assert events(result) == [("cord", STICK, FORWARD)]
    force = ratio * M1 * GRAVITY - M2 * GRAVITY
    assert result.quantities["force_to_lift"].value == pytest.approx(force, rel=EPS)
    start = (force - 200.0) / 1000.0
    assert times(result)[0] == pytest.approx(start, abs=1e-12)
    channels, slips = result.channels, result.time > start
    ratios = channels["rope_tension_counterweight"][slips] / channels["rope_tension_car"][slips]
    assert ratios == pytest.approx(ratio, rel=EPS)
    # Until the end of the ramp (m2 + E m1) x'' = m2 P' t E/(...) grows with the time from start.
    rising = slips & (result.time <= 1.0)
    slip = 1000.0 / (M2 + ratio * M1) * (result.time[rising] - start) ** 3 / 6.0
    assert channels["cord_slip"][rising] == pytest.approx(slip, abs=1e-11)
    assert np.all(channels["angle"] == 0.0)


def test_a_cord_that_slips_turns_by_its_kinetic_ratio() -> None:
    data = lift(drive__torque=600.0, effects__cord_friction=CORD, effects__shaft_friction=SHAFT)
    result = solved(data)
    assert events(result) == [("shaft", STICK, FORWARD), ("cord", STICK, BACKWARD)]
    ratio = exp(-0.1 * pi)
    t1 = 2.0 * GRAVITY * M1 * M2 / (M2 + ratio * M1)
    channels = result.channels
    assert channels["rope_tension_car"][1:] == pytest.approx(t1, rel=EPS)
    assert channels["car_acceleration"][1:] == pytest.approx(t1 / M1 - GRAVITY, rel=1e-11)
    slip = channels["car_position"] - R * channels["angle"]
    assert channels["cord_slip"] == pytest.approx(slip, abs=1e-11)
    turning = ((ratio - 1.0) * t1 * R + 600.0 - R_K * (1.0 + ratio) * t1) / INERTIA
    assert channels["angular_acceleration"][1:] == pytest.approx(turning, rel=EPS)


def test_two_contacts_that_reach_their_limits_together_do_not_chatter() -> None:
    # (r + r_s)/(r - r_s) = exp(mu phi) at the same force; sliding, the shaft needs less.
    mu = log((R + R_S) / (R - R_S)) / pi
    for kinetic in (1.0, 0.7):
        data = lift(
            drive={"force": ramp((0.0, 200.0), (1.0, 1200.0))},
            effects__shaft_friction=SHAFT | {"mu_k": 0.3 * kinetic},
            effects__cord_friction={"mu_s": mu, "mu_k": mu * kinetic},
        )
        result = solved(data)
        start = ((R + R_S) / (R - R_S) * M1 * GRAVITY - M2 * GRAVITY - 200.0) / 1000.0
        assert times(result)[0] == pytest.approx(start, abs=1e-9)
        assert len(result.transitions) <= 2
        assert FORWARD in (result.channels["mode"][-1], result.channels["cord_mode"][-1])


def angle_of_a_cord_that_sticks(car: float) -> float:
    """Return the angle after 3 s: the torque beyond the limit, over the inertia, integrated twice.

    (I + m1 r (r - r_k) + m2 r (r + r_k)) w' = tau - r (m1 - m2) g + r_s (m1 + m2) g
    """
    r, other, r_f, slope = 0.24, 45.0, 0.045 * 0.3 / hypot(1.0, 0.3), -17.0 / 2.0
    limit = GRAVITY * (r * (car - other) - r_f * (car + other))
    rising = 2.0 - (limit + 28.0) / slope  # s, from breakaway to the end of the ramp
    inertia = 0.2 + car * r * (r - r_f) + other * r * (r + r_f)
    return slope * (rising**3 / 6.0 + rising**2 / 2.0 + rising / 2.0) / inertia


@pytest.mark.parametrize("way", [1, -1])
def test_a_cord_within_its_limit_does_not_slip_where_the_shaft_breaks_away(way: int) -> None:
    for car in np.linspace(31.0, 35.0, 3):
        torque = ramp((0.0, -28.0 * way), (2.0, -45.0 * way))
        result = solved(grips(float(car), torque, mirrored=way < 0))
        assert events(result) == [("shaft", STICK, -way)]
        # Cubic in time: the steps leave roundoff, some 1e-14 rad.
        expected = angle_of_a_cord_that_sticks(float(car))
        assert way * result.channels["angle"][-1] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (
            {"drive__torque": ramp((0.0, 0.0), (1.0, 40.0)), "effects__shaft_friction": SHAFT,
             "effects__cord_friction": {"mu_s": 0.05, "mu_k": 0.02}},
            [("shaft", STICK, FORWARD), ("cord", STICK, BACKWARD)],
        ),
        (
            {"drive": {"force": ramp((0.0, 50.0), (0.8, 0.0), (1.2, -100.0))}},
            [("car_rope", TAUT, SLACK), ("counterweight_rope", TAUT, SLACK),
             ("car_rope", SLACK, TAUT)],
        ),
    ],
    ids=["from rest", "moving"],
)  # fmt: skip
def test_a_load_that_vanishes_at_one_instant_is_no_chattering(
    keys: Scenario, expected: list[tuple[str, int, int]]
) -> None:
    # Without weight all limits are zero where the drive is: every contact is at its limit.
    result = solved(lift(effects__hanging_masses__g=0.0, **keys))
    assert events(result) == expected
    assert len(set(times(result))) == 1


def test_bounces_end_below_the_capture_speed() -> None:
    masses = {"car": M1, "counterweight": 0.0, "restitution": 0.5, "capture_speed": 0.01}
    data = lift(
        drive__torque=ramp((0.0, 600.0), (1.0, -400.0), (1.2, 300.0)),
        effects__hanging_masses=masses,
        solver__duration=4.0,
    )
    result = solved(data)
    hits = [i for i, e in enumerate(result.transitions) if e.mode_from == SLACK]
    rates = gap_rates(result, R, "before")["car_rope"][hits]
    assert len(hits) > 4
    assert all(rates[:-1] < -0.01)
    assert -0.01 < rates[-1] < 0.0
    assert result.transitions[hits[-1]].mode_to == TAUT


def test_a_load_beside_the_car_is_left_out_or_zero() -> None:
    left_out = lift(effects__shaft_friction=SHAFT)
    assert "load" not in left_out["mechanism"]
    one, other = solved(left_out), solved(changed(left_out, mechanism__load=0.0))
    for name, channel in one.channels.items():
        assert np.array_equal(channel, other.channels[name]), name
    # A result holds the load as 0: its scenario loads again.
    whole = scenario_run(one).to_dict()
    assert whole["mechanism"]["load"] == 0.0
    again = scenario_run(other).replace({"output.interval": 0.1})
    assert fs.load(whole, folder=SCENARIOS) == again


def test_slack_of_both_ropes_is_a_warning_of_each() -> None:
    points = ((0.0, 0.0), (0.3, 900.0), (0.5, -900.0), (0.9, 900.0), (1.4, -900.0), (2.0, 0.0))
    result = solved(lift(drive__torque=ramp(*points), output__interval=0.02))
    first = [
        [t for t, before, _, _ in changes(result, rope) if before == TAUT]
        for rope in ("car_rope", "counterweight_rope")
    ]
    assert [len(times) for times in first] == [3, 2]
    assert [text.partition(";")[0] for text in result.warnings if "slack" in text] == [
        f"the car rope goes slack 3 times, first at {first[0][0]:.6g} s",
        f"the counterweight rope goes slack 2 times, first at {first[1][0]:.6g} s",
    ]
    sides = {0: "none", 1: "car", 2: "counterweight", 3: "both"}
    assert dict(result.flags["slack"]) == sides


# --- which contact is released at the start: the one that is beyond its limit


def of_two(torque: Any, masses: tuple[float, float], *contacts: Any, **mechanism: float) -> Any:
    """Return the run of a lift of which shaft and cord could each be the one to slip."""
    cord, shaft = contacts
    data = lift(
        mechanism=mechanism,
        drive__torque=torque,
        effects__hanging_masses={"car": masses[0], "counterweight": masses[1]},
        effects__cord_friction=dict(zip(("mu_s", "mu_k"), cord, strict=True)),
        effects__shaft_friction=dict(zip(("shaft_radius", "mu_s", "mu_k"), shaft, strict=True)),
        solver__duration=1.0,
    )
    return solved(data)


@pytest.mark.parametrize("torque", [44.0, 48.0])
def test_a_load_at_once_releases_what_a_load_that_comes_quickly_does(torque: float) -> None:
    runs = [
        of_two(drive, (90.0, 50.0), (0.25, 0.127), (0.0636, 0.155, 0.147),
               cord_radius=0.16, inertia=0.9)
        for drive in (torque, {"time": [0.0, 1e-6], "value": [49.5, torque]})
    ]  # fmt: skip
    for run in runs:
        assert [event.contact for event in run.transitions] == ["shaft"]
        assert run.quantities["cord_slip_max"].value == 0.0
    # The ramp takes some 1e-6 s, of motion over 1 s.
    end, expected = (run.channels["angle"][-1] for run in runs)
    assert end == pytest.approx(expected, rel=1e-4)


def test_two_contacts_that_are_released_at_the_start_pass_the_audit() -> None:
    """Either would hold if the other did; here the cord is beyond its limit, and then the shaft."""
    run = of_two(-161.676, (74.49028338371194, 191.51925754389023), (0.2974, 0.24344),
                 (0.048187, 0.26605, 0.25351), cord_radius=0.117984, inertia=0.605019)  # fmt: skip
    assert [event.time for event in run.transitions][:2] == [0.0, 0.0]


# --- torques of a lift whose cord slips: none where its `traction_margin` is below 1

OF_REST = ("torque_to_lift", "torque_to_hold")
OF_MOTION = ("torque_to_keep_lifting", "torque_to_keep_lowering")


def gripped(
    masses: tuple[float, float], mu_s: float, mu_k: float, torque: float, **keys: Any
) -> Any:
    plain = {"car": masses[0], "counterweight": masses[1], "g": GRAVITY}
    cord = {"mu_s": mu_s, "mu_k": mu_k, "wrap_deg": 180.0}
    effects = {"effects__hanging_masses": plain, "effects__cord_friction": cord}
    return lift(drive__torque=torque, solver__duration=1.0, **effects, **keys)


def values(of: dict[str, Quantity]) -> dict[str, Any]:
    return {name: quantity.value for name, quantity in of.items()}


@pytest.mark.parametrize(
    ("masses", "mu_s", "mu_k"),
    [((100.0, 80.0), 0.0, 0.0), ((90.0, 40.0), 0.1, 0.02), ((30.0, 200.0), 0.4, 0.3)],
)
@pytest.mark.parametrize("share", [1.2, 30.0])
def test_no_torque_lifts_or_holds_masses_whose_cord_slips(
    masses: tuple[float, float], mu_s: float, mu_k: float, share: float
) -> None:
    # Against the heavier side, which the cord's friction alone is too little for.
    car, counterweight = masses
    data = gripped(masses, mu_s, mu_k, share * R * GRAVITY * (car - counterweight))
    static, run = values(fs.static(data)), values(solved(data).quantities)
    assert static["traction_margin"] < 1.0
    assert [static[name] for name in OF_REST + OF_MOTION] == [None] * 4
    assert [run[name] for name in OF_REST] == [None] * 2
    # What the run does instead: the lighter side has the kinetic ratio less than the heavier.
    ratio = exp(copysign(mu_k * pi, car - counterweight))
    fall = 0.5 * GRAVITY * (car - counterweight * ratio) / (car + counterweight * ratio)
    # Of a constant acceleration, exact but for the rounding of the steps.
    assert run["car_travel"] == pytest.approx(-fall, rel=1e-9)


@settings(max_examples=8)
@given(
    masses=st.tuples(st.floats(10.0, 1000.0), st.floats(10.0, 1000.0)),
    mu_s=st.floats(0.0, 0.5),
    slower=st.floats(0.0, 1.0),
    mu=st.floats(0.05, 0.5),
)
def test_a_torque_is_none_exactly_where_the_cord_slips(
    masses: tuple[float, float], mu_s: float, slower: float, mu: float
) -> None:
    # With one coefficient of the shaft, the pulley starts without a jerk, which would slip too.
    shaft = {"effects__shaft_friction": {"shaft_radius": 0.05, "mu_s": mu, "mu_k": mu}}
    static = fs.static(gripped(masses, mu_s, mu_s * slower, 0.0, **shaft))
    margin: Any = static["traction_margin"].value
    assume(not 0.999999 < margin < 1.02)  # nearer, the acceleration of the test may slip
    torques: list[Any] = [static[name].value for name in OF_REST + OF_MOTION]
    assert [torque is None for torque in torques] == [margin < 1.0] * 4
    assert [("slips at any torque" in note) for note in static.notes] == [True] * (margin < 1.0)
    if margin < 1.0:
        return
    to_lift, to_hold, *_ = torques
    bit = 1e-3 * (to_lift - to_hold)
    for torque, way in ((to_lift - bit, 0), (to_lift + bit, 1), (to_hold - bit, -1)):
        run = solved(gripped(masses, mu_s, mu_s * slower, torque, **shaft))
        assert np.sign(run.quantities["car_travel"].value) == way


@pytest.mark.parametrize(("name", "speed"), [(OF_MOTION[0], 1.0), (OF_MOTION[1], -1.0)])
def test_a_cord_that_sticks_to_a_turning_pulley_keeps_its_load_moving(
    name: str, speed: float
) -> None:
    # Between the limits: the ratio at rest, 1.25, is above exp(mu_k phi), and below exp(mu_s phi).
    keys: Any = {"mechanism__initial_angular_velocity": speed, "effects__shaft_friction": SHAFT}
    torque = fs.static(gripped((M1, M2), 0.1, 0.04, 0.0, **keys))[name].value
    assert torque is not None
    run = values(solved(gripped((M1, M2), 0.1, 0.04, torque, **keys)).quantities)
    # The balance of the torques is exact but for rounding.
    assert run["car_travel"] == pytest.approx(speed * R, rel=1e-9)
    assert run["cord_slip_max"] == 0.0
