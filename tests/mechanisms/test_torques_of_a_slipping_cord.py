"""The torques of a lift whose cord slips: none where its `traction_margin` is below 1."""

import json
import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import frictionsim as fs

G = 9.80665
RADIUS, WRAP = 0.2, 180.0
OF_REST = ("torque_to_lift", "torque_to_hold")
OF_MOTION = ("torque_to_keep_lifting", "torque_to_keep_lowering")


def lift(
    car: float, counterweight: float, mu_s: float, mu_k: float, torque: float, **tables: Any
) -> fs.Scenario:
    return fs.load(
        {
            "kind": "pulley",
            "mechanism": {"cord_radius": RADIUS, "inertia": 1.0, **tables.pop("mechanism", {})},
            "drive": {"torque": torque},
            "solver": {"duration": 1.0},
            "effects": {
                "hanging_masses": {"car": car, "counterweight": counterweight, "g": G},
                "cord_friction": {"mu_s": mu_s, "mu_k": mu_k, "wrap_deg": WRAP},
                **tables.pop("effects", {}),
            },
        }
    )


def values(of: fs.Scenario | fs.Result) -> dict[str, float | None]:
    quantities = of.quantities if isinstance(of, fs.Result) else fs.static(of)
    return {name: quantity.value for name, quantity in quantities.items()}


@pytest.mark.parametrize(
    ("car", "counterweight", "mu_s", "mu_k"),
    [
        (100.0, 80.0, 0.02, 0.016),
        (100.0, 80.0, 0.0, 0.0),
        (500.0, 120.0, 0.3, 0.25),
        (90.0, 40.0, 0.1, 0.02),
        (60.0, 75.0, 0.05, 0.05),
        (30.0, 200.0, 0.4, 0.3),
    ],
)
@pytest.mark.parametrize("share", [1.2, 30.0])
def test_no_torque_lifts_or_holds_masses_whose_cord_slips(
    car: float, counterweight: float, mu_s: float, mu_k: float, share: float
) -> None:
    # Against the heavier side, which the cord's friction alone is too little for.
    torque = share * RADIUS * G * (car - counterweight)
    scenario = lift(car, counterweight, mu_s, mu_k, torque)
    static, run = values(scenario), values(fs.solve(scenario))
    margin = static["traction_margin"]
    assert margin is not None
    assert margin < 1.0
    assert [static[name] for name in OF_REST + OF_MOTION] == [None] * 4
    assert [run[name] for name in OF_REST] == [None] * 2
    # What the run does instead: the lighter side has the kinetic ratio less than the heavier.
    ratio = math.exp(math.copysign(mu_k * math.pi, car - counterweight))
    fall = 0.5 * G * (car - counterweight * ratio) / (car + counterweight * ratio)
    # Of a constant acceleration, exact but for the rounding of the steps.
    assert run["car_travel"] == pytest.approx(-fall, rel=1e-9)


coefficients = st.floats(0.0, 0.5)
masses = st.floats(10.0, 1000.0)


@settings(max_examples=12)
@given(
    car=masses,
    counterweight=masses,
    mu_s=coefficients,
    slower=st.floats(0.0, 1.0),
    mu=st.floats(0.05, 0.5),
)
def test_a_torque_is_none_exactly_where_the_cord_slips(
    car: float, counterweight: float, mu_s: float, slower: float, mu: float
) -> None:
    # With one coefficient of the shaft, the pulley starts without a jerk, which would slip too.
    shaft = {"shaft_friction": {"shaft_radius": 0.05, "mu_s": mu, "mu_k": mu}}
    static = values(lift(car, counterweight, mu_s, mu_s * slower, 0.0, effects=shaft))
    margin = static["traction_margin"]
    assert margin is not None
    assume(not 0.999999 < margin < 1.02)  # nearer, the acceleration of the test may slip
    torques = [static[name] for name in OF_REST + OF_MOTION]
    assert [torque is None for torque in torques] == [margin < 1.0] * 4
    if margin < 1.0:
        return
    to_lift, to_hold, *_ = (torque or 0.0 for torque in torques)
    bit = 1e-3 * (to_lift - to_hold)
    for torque, way in (
        (to_lift - bit, 0),
        (to_lift + bit, 1),
        (to_hold + bit, 0),
        (to_hold - bit, -1),
    ):
        scenario = lift(car, counterweight, mu_s, mu_s * slower, torque, effects=shaft)
        travel = values(fs.solve(scenario))["car_travel"]
        assert travel is not None
        assert (travel > 0.0) - (travel < 0.0) == way


@pytest.mark.parametrize("masses", [(100.0, 80.0), (80.0, 100.0), (300.0, 240.0)])
@pytest.mark.parametrize(("name", "speed"), [(OF_MOTION[0], 1.0), (OF_MOTION[1], -1.0)])
def test_a_cord_that_sticks_to_a_turning_pulley_keeps_its_load_moving(
    masses: tuple[float, float], name: str, speed: float
) -> None:
    # Between the limits: the ratio at rest, 1.25, is above exp(mu_k phi), and below exp(mu_s phi).
    def at(torque: float) -> fs.Scenario:
        shaft = {"shaft_radius": 0.05, "mu_s": 0.2, "mu_k": 0.1}
        return lift(
            *masses,
            0.1,
            0.04,
            torque,
            mechanism={"initial_angular_velocity": speed},
            effects={"shaft_friction": shaft},
        )

    torque = values(at(0.0))[name]
    assert torque is not None
    run = values(fs.solve(at(torque)))
    # The balance of the torques is exact but for rounding.
    assert run["car_travel"] == pytest.approx(speed * RADIUS, rel=1e-9)
    assert run["cord_slip_max"] == 0.0


def test_a_sweep_of_a_lift_has_no_torque_where_the_ropes_slip(
    told: Callable[..., tuple[str, str]],
) -> None:
    keys = "effects.cord_friction.mu_s,effects.cord_friction.mu_k"
    told("sweep", "lift", "--vary", f"{keys}=[0.03,0.06,0.09]", "-o", "s.h5")
    sweep = fs.open_sweep("s.h5")
    margins = sweep["traction_margin"]
    assert list(margins < 1.0) == [True, True, False]
    for name in OF_REST:
        assert [math.isnan(value) for value in sweep[name]] == [True, True, False]
    summary = json.loads(told("show", "s.h5", "--json")[0])
    assert summary["quantities"]["torque_to_lift"]["runs"] == 1


@pytest.mark.parametrize("mu_s", [0.0, 0.03, 0.06, 0.09])
def test_statics_say_why_there_is_no_torque(mu_s: float) -> None:
    friction = {"effects.cord_friction.mu_s": mu_s, "effects.cord_friction.mu_k": mu_s}
    statics = fs.static("lift", friction)
    slips = statics["torque_to_lift"].value is None
    assert slips == (mu_s < 0.0636)  # margins 0.92 at 0.06 and 1.01 at 0.09
    assert [("slips at any torque" in note) for note in statics.notes] == [True] * slips
