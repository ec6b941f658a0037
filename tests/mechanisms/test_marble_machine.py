"""The marble machine: torques of the paper, reconstruction, motion."""

from math import degrees, hypot, pi, radians, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.results import Record
from tests.support.cases import one_in, slow
from tests.support.examples import examples
from tests.support.problems import assert_agrees, cases
from tests.support.scenarios import (
    Scenario,
    shipped,
    simulate,
)
from tests.support.second_way import friction_radius

LIFT, HOLD = 3.631e-3, 2.44e-3  # N m, the paper's
LIFT_ONE = 0.007 * 9.81 * 0.0573425  # m g R, J


def machine(**changes: Any) -> Scenario:
    """Return the shipped machine, its pinion turned by a given torque."""
    plain: Scenario = {
        "drive": {"torque": 0.005},
        "effects__motor_inertia": None,
        "solver": {"duration": 1.0, "rtol": 1e-11, "atol": 1e-13},
    }
    return shipped("marble_machine", **plain | changes)


def statics(**changes: Any) -> dict[str, float | None]:
    return {name: quantity.value for name, quantity in fs.static(machine(**changes)).items()}


def moves(run: Record) -> list[tuple[int, int]]:
    """Return the changes of mode, without transfers."""
    return [(e.mode_from, e.mode_to) for e in run.transitions if e.contact == "shaft"]


def test_torques_agree_with_the_paper() -> None:
    values = statics()
    # What the reconstruction returns, to the digits of its azimuth and circle.
    assert values["torque_to_lift"] == pytest.approx(3.630998e-3, abs=5e-10)
    assert values["torque_to_hold"] == pytest.approx(2.442861e-3, abs=5e-10)
    assert values["torque_to_lift"] == pytest.approx(LIFT, rel=1.4e-4)  # four digits in print
    assert values["torque_to_hold"] == pytest.approx(HOLD, rel=2.1e-3)  # three digits in print
    assert values["torque_to_lift_in_gf_cm"] == pytest.approx(37.026, abs=5e-4)
    assert values["friction_radius_static"] == pytest.approx(1.3416407865e-3, rel=1e-10)
    assert values["self_locking"] == 0.0


def test_a_motor_has_no_margin_over_no_load() -> None:
    """A single marble has no torque at a transfer, except for rounding."""
    motor = {"stall_torque": 0.1, "no_load_speed": 6.0}
    alone = {"mechanism__slots": 2, "effects__shaft_friction": None, "drive": {"motor": motor}}
    values = statics(**alone)
    assert "motor_margin" not in values
    heaviest = LIFT_ONE / 4.0  # at mid-height, through the gear ratio
    assert values["motor_margin_worst"] == pytest.approx(0.1 / heaviest, rel=1e-12)  # roundings


def test_worst_position_is_half_a_pitch_after_a_transfer() -> None:
    """Five marbles at R = 57.35 mm over a cell: lift up to 3.7661, hold up to 2.6201 N mm."""
    values = statics(mechanism__marble_circle_radius=0.05735)
    assert values["torque_to_lift_worst"] == pytest.approx(3.7661e-3, abs=5e-8)  # its digits
    assert values["torque_to_hold_worst"] == pytest.approx(2.6201e-3, abs=5e-8)
    assert values["angle_of_the_worst"] == pytest.approx(radians(18.0))

    def lifts(torque: float, angle: float) -> bool:
        start = {"mechanism__initial_angle_deg": degrees(angle), "solver__duration": 1e-9}
        first = moves(simulate(machine(drive__torque=torque, **start)))[:1]
        return first == [(0, 1)]

    worst = statics()["torque_to_lift_worst"]
    assert worst is not None
    for angle in np.linspace(0.0, 2 * pi, 20):
        assert lifts(worst * (1 + 1e-9), float(angle))  # a hair above lifts everywhere
    assert not lifts(worst * (1 - 1e-9), radians(18.0))


def test_motor_margin_agrees_with_the_paper() -> None:
    motor = {"stall_torque": 0.1176798, "no_load_speed": 6.3}
    values = statics(drive={"motor": motor})
    assert values["motor_margin"] == pytest.approx(32.4, abs=0.05)  # the paper's, three digits
    assert values["motor_margin_worst"] == pytest.approx(0.1176798 / 3.765676e-3, rel=1e-6)


@pytest.mark.parametrize("backend", ["events", slow("rkf45")])
@pytest.mark.parametrize("case", one_in(4, cases("marble_machine")), ids=lambda case: case["name"])
def test_motion_agrees_with_the_reference(case: dict[str, Any], backend: str) -> None:
    data = case["scenario"]
    data["solver"] |= {"backend": backend, "rtol": 1e-11, "atol": 1e-13}
    run = simulate(data)
    shaft = [e for e in run.transitions if e.contact == "shaft"]
    # Some thousand steps of 1e-11; what is asked for is 1e-8 rad.
    assert_agrees(run, shaft, case)
    transfers = [e.time for e in run.transitions if e.contact == "transfer"]
    assert len(transfers) == case["transfer_count"]
    assert transfers[: len(case["transfers"])] == pytest.approx(case["transfers"], abs=1e-8)


@pytest.mark.parametrize(
    ("azimuth", "relieves"),
    [(102.6007, False), (-142.6007, False), (37.3993, True), (-77.3993, True)],
)
def test_four_azimuths_have_the_paper_s_mesh_force(azimuth: float, relieves: bool) -> None:
    sideways, down = mesh_of(statics(mechanism__mesh_azimuth_deg=azimuth))
    assert 1 / abs(sideways) == pytest.approx(20.07e-3, abs=1e-8)  # the azimuth's digits
    assert 1 / abs(down) == pytest.approx(31.38175e-3, abs=3e-8)
    assert (down < 0) == relieves


def mesh_of(values: dict[str, float | None]) -> tuple[float, float]:
    """Return the force of the mesh sideways and down over the torque of the pinion, 1/m."""
    sideways, down = (values[f"mesh_force_{way}_per_torque"] for way in ("sideways", "down"))
    assert sideways is not None
    assert down is not None
    return sideways, down


ratios, marbles, gears = st.floats(0.5, 10.0), st.floats(1e-6, 0.05), st.floats(0.01, 1.0)
mus = st.floats(1e-6, 2.0)


@examples(12)
@given(ratios, mus, marbles, gears, st.floats(-180.0, 180.0))
def test_torques_are_roots_of_eq_24(
    k: float, mu: float, marble: float, gear: float, azimuth: float
) -> None:
    """At the start, which is a transfer: the gear carries six marbles."""
    values = statics(
        mechanism__gear_ratio=k,
        mechanism__marble_mass=marble,
        mechanism__gear_mass=gear,
        mechanism__mesh_azimuth_deg=azimuth,
        effects__shaft_friction={"shaft_radius": 0.003, "mu_s": mu, "mu_k": mu},
    )
    (sideways, down), radius = mesh_of(values), friction_radius(0.003, mu)
    moment, weight = values["load_torque_at_transfer"], (gear + 6 * marble) * 9.81
    assert moment is not None
    lift, hold = values["torque_to_lift"], values["torque_to_hold"]
    assert lift is not None
    assert hold is not None
    rounding = 1e-13 * (moment + radius * weight)
    assert k * lift >= moment - rounding
    assert k * hold <= moment + rounding
    for torque in (lift, hold):
        reaction = hypot(sideways * torque, weight + down * torque)
        off = abs(k * torque - moment) - radius * reaction
        assert off == pytest.approx(0.0, abs=rounding + 1e-13 * k * abs(torque))


def test_a_thick_shaft_locks_the_machine() -> None:
    values = statics(effects__shaft_friction__shaft_radius=0.03)
    assert values["self_locking"] == 1.0
    assert values["torque_to_hold_worst"] is not None
    assert values["torque_to_hold_worst"] < 0.0
    run = simulate(machine(effects__shaft_friction__shaft_radius=0.03, drive__torque=0.0))
    assert run.transitions == []


@pytest.mark.parametrize(
    ("torque", "expected"),
    [
        (0.0, [(0, -1)]),
        # With five marbles in motion, not the six of the transfer: 2.4657 and 3.6077 N mm.
        (2.465e-3, [(0, -1)]),
        (2.467e-3, []),
        (3.607e-3, []),
        (3.609e-3, [(0, 1)]),
    ],
)
def test_between_hold_and_lift_the_gear_stays(
    torque: float, expected: list[tuple[int, int]]
) -> None:
    assert moves(simulate(machine(drive__torque=torque))) == expected


def test_each_delivered_marble_is_lifted_by_two_radii() -> None:
    run = simulate(machine(drive__torque=0.006, solver__duration=2.0))
    transfers = [e for e in run.transitions if e.contact == "transfer"]
    quantities = run.quantities
    assert quantities["marbles_delivered"].value == len(transfers) > 10
    assert [e.position for e in transfers] == pytest.approx(
        [radians(36.0) * (i + 1) for i in range(len(transfers))], abs=1e-12
    )
    for i, transfer in enumerate(transfers[:4]):
        # A sample at the transfer itself, where the next marble takes the place of the last.
        (sample,) = set(run.channels["energy_potential"][run.time == transfer.time].tolist())
        assert sample == pytest.approx(2 * LIFT_ONE * (i + 1), abs=1e-12)


def test_tooth_force_with_motor_inertia_is_consistent() -> None:
    """T_m = T_p - J k theta'' is solved implicitly, not taken from the previous step."""
    inertia = 2e-5
    run = simulate(
        machine(
            effects__motor_inertia={"inertia": inertia},
            drive__torque={"sine": {"mean": 3e-3, "amplitude": 3e-3, "frequency_hz": 2.0}},
        )
    )
    channels = run.channels
    sliding = channels["mode"] != 0
    assert np.any(channels["mode"] == 1)
    assert np.any(channels["mode"] == -1)
    r_k = friction_radius(0.003, 0.4)
    assert np.abs(channels["friction_torque"])[sliding] == pytest.approx(
        r_k * channels["shaft_reaction"][sliding],
        rel=1e-12,  # roundings
    )
    through_mesh = channels["motor_torque"] - inertia * 4.0 * channels["angular_acceleration"]
    weight = (0.128 + 5 * 0.007) * 9.81
    expected = np.sqrt((49.826 * through_mesh) ** 2 + (weight + 31.865 * through_mesh) ** 2)
    assert channels["shaft_reaction"] == pytest.approx(
        expected, rel=1e-5
    )  # digits of the lever arms
    assert [name for name, check in run.checks.items() if not check.ok] == []


def test_steady_speed_balances_motor_load_and_friction() -> None:
    """Without gravity, the only load is the friction due to the tooth force."""
    motor = {"stall_torque": 0.01, "no_load_speed": 6.0}
    run = simulate(
        machine(
            drive={"motor": motor},
            effects__gravity=None,
            effects__viscous_damping={"coefficient": 0.02},
            solver__duration=3.0,
        )
    )
    # k T - r_k c T = b w with T = T_stall (1 - k w/w_0): linear in w
    pull = 4.0 - friction_radius(0.003, 0.4) * sqrt(49.8259943**2 + 31.8650527**2)
    speed = pull * 0.01 / (0.02 + pull * 0.01 * 4.0 / 6.0)
    assert run.channels["angular_velocity"][-1] == pytest.approx(
        speed, rel=1e-8
    )  # digits of the lever arms
