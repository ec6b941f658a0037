"""A pulley with masses on its cord against closed forms."""

from math import exp, hypot, log, pi

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT, Record
from tests.support.lift_reference import solve
from tests.support.lifts import (
    CORD,
    GRAVITY,
    SHAFT,
    changes,
    events,
    grips,
    lift,
    ramp,
    solved,
    times,
)
from tests.support.scenarios import SCENARIOS, Scenario, changed, scenario_run

R, INERTIA, M1, M2 = 0.25, 2.0, 100.0, 80.0
R_S, R_K = 0.05 * 0.3 / hypot(1.0, 0.3), 0.05 * 0.2 / hypot(1.0, 0.2)
EPS = 1e-12


def balance(direction: int, torque: float, force: float = 0.0) -> tuple[float, float, float]:
    """Return acceleration and tensions of a taut cord: the three equations, solved as they are."""
    r_f = direction * R_K
    matrix = [
        [INERTIA, R + r_f, -R + r_f],  # I w' = (T2 - T1) r + tau - s r_k (T1 + T2)
        [M1 * R, -1.0, 0.0],  # m1 r w' = T1 - m1 g
        [M2 * R, 0.0, 1.0],  # m2 r w' = P + m2 g - T2
    ]
    solution = np.linalg.solve(matrix, [torque, -M1 * GRAVITY, force + M2 * GRAVITY])
    return float(solution[0]), float(solution[1]), float(solution[2])


@pytest.mark.parametrize(("torque", "direction"), [(0.0, BACKWARD), (150.0, FORWARD)])
def test_masses_and_friction_accelerate_as_the_equations_say(torque: float, direction: int) -> None:
    data = lift(drive__torque=torque, effects__shaft_friction=SHAFT)
    result = solved(data)
    acceleration, t1, t2 = balance(direction, torque)
    assert events(result) == [("shaft", STICK, direction)]
    channels, time = result.channels, result.time
    assert channels["angle"] == pytest.approx(0.5 * acceleration * time**2, abs=1e-11)
    assert channels["rope_tension_car"][1:] == pytest.approx(t1, rel=EPS)
    assert channels["rope_tension_counterweight"][1:] == pytest.approx(t2, rel=EPS)
    assert channels["shaft_reaction"][1:] == pytest.approx(t1 + t2, rel=EPS)
    assert channels["friction_torque"][1:] == pytest.approx(-direction * R_K * (t1 + t2), rel=EPS)
    travel = 0.5 * R * acceleration * 4.0
    assert result.quantities["car_travel"].value == pytest.approx(travel, abs=1e-11)
    assert result.quantities["car_acceleration_max"].value == pytest.approx(
        R * abs(acceleration), rel=EPS
    )


def test_an_atwood_machine_without_friction_falls_as_in_the_textbook() -> None:
    result = solved(lift(mechanism__inertia=1e-9))
    fall = -GRAVITY * (M1 - M2) / (M1 + M2)
    assert result.channels["car_acceleration"] == pytest.approx(fall, rel=1e-9)
    assert result.channels["car_position"][-1] == pytest.approx(0.5 * fall * 4.0, rel=1e-9)
    assert result.channels["counterweight_position"][-1] == pytest.approx(-2.0 * fall, rel=1e-9)
    tension = 2.0 * M1 * M2 * GRAVITY / (M1 + M2)
    assert result.quantities["rope_tension_car_max"].value == pytest.approx(tension, rel=1e-9)


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
    slipping = CORD | {"mu_k": CORD["mu_s"]}
    locked = {"shaft_radius": 0.2, "mu_s": 1.0, "mu_k": 0.9}
    data = lift(
        drive={"force": ramp((0.0, 200.0), (1.0, 1200.0))},
        effects__shaft_friction=locked,
        effects__cord_friction=slipping,
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
    t = result.time[slips & (result.time <= 1.0)] - start
    jerk = 1000.0 / (M2 + ratio * M1)
    assert channels["cord_slip"][slips & (result.time <= 1.0)] == pytest.approx(
        jerk * t**3 / 6.0, abs=1e-11
    )
    assert np.all(channels["angle"] == 0.0)
    assert result.quantities["cord_slip_max"].value == channels["cord_slip"][-1]


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
    at_ramp_end = rising**3 / 6.0 + rising**2 / 2.0
    return slope * (at_ramp_end + rising / 2.0) / inertia


def test_a_cord_within_its_limit_does_not_slip_where_the_shaft_gives_way() -> None:
    assert angle_of_a_cord_that_sticks(33.0) == pytest.approx(-1.465, abs=5e-4)
    for car in np.linspace(31.0, 35.0, 60):
        expected = angle_of_a_cord_that_sticks(float(car))
        for way in (1, -1):
            torque = ramp((0.0, -28.0 * way), (2.0, -45.0 * way))
            result = solved(grips(float(car), torque, mirrored=way < 0))
            assert events(result) == [("shaft", STICK, -way)]
            # Cubic in time: the steps leave roundoff, some 1e-14 rad.
            assert way * result.channels["angle"][-1] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (
            {
                "drive__torque": ramp((0.0, 0.0), (1.0, 40.0)),
                "effects__shaft_friction": SHAFT,
                "effects__cord_friction": {"mu_s": 0.05, "mu_k": 0.02},
            },
            [("shaft", STICK, FORWARD), ("cord", STICK, BACKWARD)],
        ),
        (
            {"drive": {"force": ramp((0.0, 50.0), (0.8, 0.0), (1.2, -100.0))}},
            [
                ("car_rope", TAUT, SLACK),
                ("counterweight_rope", TAUT, SLACK),
                ("car_rope", SLACK, TAUT),
            ],
        ),
    ],
    ids=["from rest", "moving"],
)
def test_a_load_that_vanishes_at_one_instant_is_no_chattering(
    keys: Scenario, expected: list[tuple[str, int, int]]
) -> None:
    # Without weight all limits are zero where the drive is: every contact is at its limit.
    result = solved(lift(effects__hanging_masses__g=0.0, **keys))
    assert events(result) == expected
    assert len(set(times(result))) == 1


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_slack_and_impacts_of_a_car_alone_are_those_of_the_reference(restitution: float) -> None:
    data = lift(
        drive__torque=ramp((0.0, 600.0), (1.0, -400.0), (2.0, 1600.0)),
        effects__hanging_masses__counterweight=0.0,
        effects__hanging_masses__restitution=restitution,
    )
    result, exact = solved(data), solve(data)
    transitions, expected = changes(result, "car rope"), exact.of("car rope")
    assert [change[1:3] for change in transitions] == [change[1:3] for change in expected]
    assert [t for t, *_ in transitions] == pytest.approx([t for t, *_ in expected], abs=1e-10)
    # T1 = m1 (g + r w') = 0, with w' = (tau - m1 g r)/(I + m1 r^2) taut.
    assert transitions[0][0] == pytest.approx((600.0 + GRAVITY * INERTIA / R) / 1000.0, abs=1e-11)
    slack = (result.time > transitions[0][0]) & (result.time < times(result)[1])
    assert result.channels["rope_tension_car"][slack] == pytest.approx(0.0, abs=1e-12)
    rates = [
        result.events[f"car_velocity_{side}"] - R * result.events[f"angular_velocity_{side}"]
        for side in ("before", "after")
    ]
    hits = [i for i, event in enumerate(result.transitions) if event.mode_from == SLACK]
    speeds = [float(speed) for _, _, speed, *_ in exact.impacts]
    assert -rates[0][hits] == pytest.approx(speeds, rel=1e-9)
    rebounds = [speed * restitution * (speed >= 1e-3) for speed in speeds]
    assert rates[1][hits] == pytest.approx(rebounds, rel=1e-9, abs=1e-12)
    lost = sum(float(loss) for *_, loss, _ in exact.impacts)
    assert result.channels["energy_impact"][-1] == pytest.approx(lost, rel=1e-9)
    if not restitution:
        assert result.warnings == (
            "the car rope goes slack once, at 0.67848 s; retightening is modelled as the impact of"
            " a rigid rope: its force is undefined, and the energy lost depends on restitution",
        )


def test_bounces_end_below_the_capture_speed() -> None:
    data = lift(
        drive__torque=ramp((0.0, 600.0), (1.0, -400.0), (1.2, 300.0)),
        effects__hanging_masses__counterweight=0.0,
        effects__hanging_masses__restitution=0.5,
        effects__hanging_masses__capture_speed=0.01,
        solver__duration=4.0,
    )
    result = solved(data)
    taken = [i for i, e in enumerate(result.transitions) if e.mode_from == SLACK]
    rates = [
        float(
            result.events["car_velocity_before"][i]
            - R * result.events["angular_velocity_before"][i]
        )
        for i in taken
    ]
    assert len(taken) > 4
    assert all(rate < -0.01 for rate in rates[:-1])
    assert -0.01 < rates[-1] < 0.0
    assert result.transitions[taken[-1]].mode_to == TAUT


def test_a_plain_pulley_may_be_turned_by_a_torque() -> None:
    load, arm = 200.0, 0.25
    data: Scenario = {
        "kind": "pulley",
        "mechanism": {"cord_radius": arm, "inertia": 2.0, "load": load},
        "drive": {"torque": ramp((0.0, 48.0), (1.0, 88.0))},
        "effects": {"shaft_friction": SHAFT},
        "solver": {"duration": 1.0},
    }
    result = solved(data)
    limit = load * (arm + R_S)
    assert result.quantities["torque_to_lift"].value == pytest.approx(limit, rel=EPS)
    assert times(result) == [pytest.approx((limit - 48.0) / 40.0, abs=1e-12)]
    work = result.channels["energy_input"][-1]
    assert work > 0.0
    assert np.all(result.channels["shaft_reaction"] == load)
    quantities = fs.static(data)
    assert quantities["torque_to_hold"].value == pytest.approx(load * (arm - R_S), rel=EPS)


def test_a_load_beside_the_car_is_left_out_or_zero() -> None:
    left_out = lift(effects__shaft_friction=SHAFT)
    zero = changed(left_out, mechanism__load=0.0)
    assert "load" not in left_out["mechanism"]
    one, other = solved(left_out), solved(zero)
    for name, channel in one.channels.items():
        assert np.array_equal(channel, other.channels[name]), name
    # A result holds the load as 0: its scenario loads again.
    whole = scenario_run(one).to_dict()
    assert whole["mechanism"]["load"] == 0.0
    again = scenario_run(other).replace({"output.interval": 0.1})
    assert fs.load(whole, folder=SCENARIOS) == again


def test_slack_of_both_ropes_is_a_warning_of_each() -> None:
    points = ((0.0, 0.0), (0.3, 900.0), (0.5, -900.0), (0.9, 900.0), (1.4, -900.0), (2.0, 0.0))
    result: Record = solved(lift(drive__torque=ramp(*points), output__interval=0.02))
    taken = {
        name: [e.time for e in result.transitions if e.contact == name and e.mode_from == TAUT]
        for name in ("car_rope", "counterweight_rope")
    }
    assert [len(times) for times in taken.values()] == [3, 2]
    assert [text.partition(";")[0] for text in result.warnings if "slack" in text] == [
        f"the car rope goes slack 3 times, first at {taken['car_rope'][0]:.6g} s",
        "the counterweight rope goes slack 2 times, first at"
        f" {taken['counterweight_rope'][0]:.6g} s",
    ]
