"""The epicyclic gear against independently computed motions, closed forms and invariants."""

from math import cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.cases import one_in, slow
from tests.support.problems import assert_agrees, cases
from tests.support.scenarios import Scenario, shipped, simulate, sound


def gear(**changes: Any) -> Scenario:
    """Return the shipped gear on a level crank under 6 N m, its hinge with one coefficient."""
    plain: Scenario = {
        "mechanism__initial_angle_deg": None,
        "drive": {"torque": 6.0},
        "effects__hinge_friction": {"torque_static": 0.15, "torque_kinetic": 0.15},
        "effects__tracer_point": None,
        "solver": {"duration": 1.0, "rtol": 1e-11, "atol": 1e-13},
    }
    return shipped("epicyclic", **plain | changes)


@pytest.mark.parametrize("backend", ["events", slow("rkf45")])
@pytest.mark.parametrize("case", one_in(6, cases("epicyclic")), ids=lambda case: case["name"])
def test_motion_agrees_with_the_reference(case: dict[str, Any], backend: str) -> None:
    data = case["scenario"]
    data["solver"] |= {"backend": backend, "rtol": 1e-11, "atol": 1e-13}
    run = simulate(data)
    assert run.status == "done"
    # Some thousand steps of 1e-11; what is asked for is 1e-8 rad.
    assert_agrees(run, run.transitions, case)
    work = case["energy"][0]
    assert run.channels["energy_input"][-1] == pytest.approx(work, rel=1e-8, abs=1e-8)


# Eq 28 in both forms, N m.
@pytest.mark.parametrize(
    ("degrees", "published", "consistent"),
    [
        (0, 5.39424, 3.12528),
        (60, 2.937412276580026, 1.727932276580026),
        (90, 0.467658, 0.317658),
        (180, -4.49424, -2.52528),
        (270, 0.432342, 0.317658),
    ],
)
def test_uniform_torque_is_eq_28(degrees: float, published: float, consistent: float) -> None:
    for formulation, torque in (("published", published), ("consistent", consistent)):
        data = gear(
            mechanism__formulation=formulation,
            mechanism__initial_angle_deg=float(degrees),
            solver__duration=1e-3,
        )
        run = simulate(data)
        # A few roundings of terms near 5 N m.
        assert run.channels["uniform_torque"][0] == pytest.approx(torque, abs=1e-14)


def test_prescribed_speed_needs_the_uniform_torque() -> None:
    speed = 4.0
    data = gear(drive={"speed": speed}, solver__duration=2 * pi / speed)
    run = simulate(data)
    channels = run.channels
    assert channels["drive_torque"] == pytest.approx(
        channels["uniform_torque"], abs=1e-14
    )  # roundings
    # 2 pi M_A r1/r2 + 4 f G_2 lambda over a turn; rtol of the run
    heat = 2 * pi * 0.15 * 2.0 + 4 * 5e-4 * 1.2 * 9.81 * 3.0
    assert run.channels["energy_friction"][-1] == pytest.approx(heat, rel=1e-9)
    assert run.channels["energy_input"][-1] == pytest.approx(heat, rel=1e-9)


def test_friction_reverses_with_the_prescribed_speed() -> None:
    data = gear(
        drive={"speed": {"time": [0.0, 1.0, 1.5], "value": [2.0, -2.0, 0.0]}}, solver__duration=2.0
    )
    run = simulate(data)
    assert [(e.mode_from, e.mode_to) for e in run.transitions] == [(1, -1), (-1, 0)]
    assert [e.time for e in run.transitions] == pytest.approx([0.5, 1.5], abs=1e-15)
    assert [name for name, check in run.checks.items() if not check.ok] == []


@pytest.mark.parametrize("speed", [1e-300, 1e-30, 1e-3])
def test_a_drive_of_any_slowness_passes_the_audit(speed: float) -> None:
    """The slower it raises the crank, the less the potential energy tells of its work."""
    bare = {"effects__hinge_friction": None, "effects__rolling_friction": None}
    sound(gear(drive={"speed": speed}, mechanism__initial_angle_deg=50.0, **bare))


def test_without_gravity_there_is_no_weight() -> None:
    run = simulate(gear(effects__gravity=None, drive__torque=1.0))
    channels = run.channels
    assert "energy_potential" not in channels
    assert np.all(channels["normal_load"] == 0.0)
    # J phi'' = M_O - M_A r1/r2, uniformly accelerated; rtol of the run
    assert run.channels["angle"][-1] == pytest.approx(0.5 * (1.0 - 0.3) / 0.06696, rel=1e-10)


def test_rolling_friction_without_weight_is_told() -> None:
    run = simulate(gear(effects__gravity=None, effects__hinge_friction=None, drive__torque=1.0))
    assert [w.partition(",")[0] for w in run.warnings] == ["effects.rolling_friction has no effect"]
    assert run.channels["angle"][-1] == pytest.approx(0.5 / 0.06696, rel=1e-10)


@pytest.mark.parametrize(
    ("radius", "x", "y"),
    [(0.06, 0.1314402418608, 0.0041610212473), (0.03, 0.1526534452964, 0.0253742246829)],
)
def test_tracer_is_on_its_epicycloid(radius: float, x: float, y: float) -> None:
    point = {"radius": radius, "angle_deg": 180.0}
    still = {"mechanism__initial_angle_deg": 15.0, "solver__duration": 1e-3}
    channels = simulate(gear(effects__tracer_point=point, **still)).channels
    position = channels["tracer_x"][0], channels["tracer_y"][0]
    assert position == pytest.approx((x, y), abs=1e-12)  # the digits that are given


def test_path_of_a_rim_point_has_the_known_range_and_length() -> None:
    run = simulate(
        gear(
            drive={"speed": 2 * pi},
            effects__tracer_point={"radius": 0.06},
            output={"interval": 1e-4},
        )
    )
    x, y = run.channels["tracer_x"], run.channels["tracer_y"]
    distance = np.hypot(x, y)
    assert distance.min() == pytest.approx(0.12, abs=1e-12)  # roundings
    assert distance.max() == pytest.approx(0.24, abs=1e-8)  # order h^2 of the samples
    chords, long_chords = (
        np.sum(np.hypot(np.diff(x[::step]), np.diff(y[::step]))) for step in (1, 2)
    )
    path = (4 * chords - long_chords) / 3  # without their error of order h^2
    assert path == pytest.approx(8 * 0.18, rel=1e-8)


def test_torques_of_impending_motion_bound_the_stick_band() -> None:
    quantities = fs.static(gear(mechanism__initial_angle_deg=-60.0))
    limit = 0.15 * 2 + 5e-4 * 1.2 * 9.81 * sin(radians(60)) * 3
    balance = 2.82528 * cos(radians(60))
    assert quantities["torque_to_start_forward"].value == pytest.approx(balance + limit, rel=1e-14)
    assert quantities["torque_to_start_backward"].value == pytest.approx(balance - limit, rel=1e-14)
    assert quantities["uniform_torque_mean_published"].value == pytest.approx(0.45, rel=1e-14)
    assert quantities["gravity_moment"].value == pytest.approx(2.82528, rel=1e-12)
    published = fs.static(gear(mechanism__formulation="published"))
    assert published["gravity_moment"].value == pytest.approx(4.94424, rel=1e-12)  # as printed
    assert not any(name.startswith("torque_to_start") for name in published)


def test_the_extremes_of_eq_28_are_those_of_a_turn() -> None:
    """Over 100 drawn gears, at 20 000 angles and at the given ones."""
    rng = np.random.default_rng(9)
    turn = np.linspace(0.0, 2.0 * pi, 20_001)
    for number in range(100):
        published, inside = number % 2 == 1, number % 4 > 1
        couple, arm = rng.uniform(0.0, 1.0), rng.uniform(0.0, 0.02)
        planet = 0.12 * rng.uniform(0.1, 0.9)
        data = gear(
            mechanism__formulation="published" if published else "consistent",
            mechanism__mesh="internal" if inside else "external",
            mechanism__planet_radius=planet,
            effects__hinge_friction={"torque_static": couple, "torque_kinetic": couple},
            effects__rolling_friction__arm=arm,
        )
        values = {name: each.value for name, each in fs.static(data).items()}
        length = 0.12 - planet if inside else 0.12 + planet
        turns, weight = length / planet, 1.2 * 9.81

        def torque(phi: Any, K: float, C: float, F: float, is_signed: bool = published) -> Any:
            return C + K * np.cos(phi) + F * (np.sin(phi) if is_signed else np.abs(np.sin(phi)))

        K = (0.5 * 0.8 * 9.81 + weight * (1 + published)) * length
        of_gear = K, couple * (turns if published else 0.12 / planet), arm * weight * turns
        sampled, size = torque(turn, *of_gear), sum(of_gear)
        for name, extreme in (("max", sampled.max()), ("min", sampled.min())):
            known = torque(values[f"uniform_torque_{name}_angle"], *of_gear)
            assert values[f"uniform_torque_{name}"] == pytest.approx(known, abs=1e-14 * size)
            # Between two angles the torque goes on by at most its slope at a kink, or h^2/8.
            assert values[f"uniform_torque_{name}"] == pytest.approx(extreme, abs=2e-8 * size)
        assert values["uniform_torque_max"] >= sampled.max() - 1e-14 * size
        assert values["uniform_torque_min"] <= sampled.min() + 1e-14 * size
