"""Channels, states and statics of belts."""

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from tests.support.belt_scenarios import NO_MOTION_ACROSS, pair, shipped, trio
from tests.support.falsified import falsified
from tests.support.scenarios import Scenario, scenario_run, simulate


@pytest.fixture(scope="module", params=["rkf45", "moreau"])
def done(request: pytest.FixtureRequest) -> Record:
    return simulate(trio(solver__backend=request.param, solver__duration=0.02))


def test_what_the_channels_mean(done: Record) -> None:
    c = done.channels
    assert done.members["pulley"] == ("driver", "roller", "driven")
    assert set(np.unique(c["pulley_index"])) == {-1.0, 0.0, 1.0, 2.0}
    assert set(np.unique(c["sticking"])) == {0.0, 1.0}
    assert np.all(c["normal_force"] >= 0.0)
    assert np.array_equal(c["normal_force"][1:] > 0.0, c["pulley_index"][1:] >= 0.0)
    # The prescribed speed is that of the scenario: 8 rad/s, 20 Hz.
    speed = 8.0 * np.sin(40.0 * np.pi * done.time)
    # Between two fixed steps a sample is interpolated: 1.3e5 rad/s^3 at most, by h^2/8 at 8e-5 s.
    close = 1e-12 if scenario_run(done).solver.backend == "rkf45" else 2e-4
    assert c["pulley_speed"][:, 0] == pytest.approx(speed, abs=close)
    # Bodies are one length and one stretch of a joint apart.
    apart = np.hypot(np.diff(c["x"], axis=1), np.diff(c["y"], axis=1))
    assert np.all(np.abs(apart / np.mean(apart) - 1.0) < 0.1)


GIVEN = {"speed": 1.0}
NO_DAMPERS = {"effects__axial_damping": None, "effects__contact__damping": None}
# Changes, and the states beside those of the bodies.
STATES: dict[str, tuple[Scenario, int]] = {
    "all effects": ({}, 2 * 2 + 3),
    "two given speeds": ({"drive__driver": GIVEN, "drive__driven": GIVEN}, 2 + 3),
    "a damper in bending": ({**NO_DAMPERS, "effects__bending__damping": 1e-6}, 4 + 3),
    "springs only": ({"effects": {"contact": {"c2": 2e5}}}, 4 + 1),
}


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("name", STATES)
def test_states_are_those_of_the_effects(name: str) -> None:
    """Six per body, an angle per pulley, a speed per free one, an energy per effect with one."""
    changes, others = STATES[name]
    data = pair(**changes, solver__duration=2e-5)  # a few steps
    done = simulate(data)
    assert done.statistics is not None
    assert done.statistics.states == 6 * 24 + others
    named = [effect for effect in EFFECTS if effect in data["effects"]]
    assert done.attributes["effects"].split() == named


EFFECTS = ("contact", "belt_friction", "axial_damping", "bending", "gravity", "patch")


def test_static_has_the_rest_position() -> None:
    quantities = {name: quantity.value for name, quantity in fs.static(pair()).items()}
    assert quantities["pretension"] == pytest.approx(200.0, rel=1e-7)
    assert quantities["residual_force"] <= 1e-7 * 200.0
    assert quantities["wrap_angle_driver"] == pytest.approx(np.pi)
    assert quantities["capstan_ratio_driver"] == pytest.approx(np.exp(0.6 * np.pi))
    assert quantities["path_length"] == pytest.approx(0.5 + 0.16 * np.pi)
    assert quantities["belt_length"] == pytest.approx(24 * quantities["body_length"])
    # Two spans of 200 N; bodies bend on to their pulleys a little before the ideal line.
    assert quantities["shaft_load_driven"] == pytest.approx(400.0, rel=0.02)


def test_the_depth_of_contact_is_that_of_the_first_sample_and_of_the_tension() -> None:
    data = shipped("belt_firm_contact", solver__duration=1e-5, output__interval=1e-5)
    quantities, done = fs.static(fs.load(data)), simulate(data)
    contact = data["effects"]["contact"]
    for j, pulley in enumerate(data["mechanism"]["pulleys"]):
        x, y = (
            done.channels[name][0] - at for name, at in zip("xy", pulley["center"], strict=True)
        )
        depth = pulley["radius"] - np.hypot(x, y)[done.channels["pulley_index"][0] == j]
        value = quantities[f"contact_depth_{pulley['name']}"].value
        assert value == pytest.approx(np.mean(depth), rel=1e-9)
        # N = T l/R = c1 p^2 + c2 p; the bodies at the ends of an arc are pressed less.
        force = 555.0 * quantities["body_length"].value / pulley["radius"]
        share = contact["reference_bodies"] / data["mechanism"]["belt"]["bodies"]
        c1, c2 = share * contact["c1"], share * contact["c2"]
        expected = 2.0 * force / (c2 + np.sqrt(c2 * c2 + 4.0 * c1 * force))
        assert value == pytest.approx(expected, rel=0.1)


def test_a_belt_that_has_more_energy_than_it_was_given_is_stopped() -> None:
    """Samples say that its springs held ten times less at first than they do."""
    data = pair(solver__backend="moreau", solver__duration=0.01, **NO_MOTION_ACROSS)
    run = falsified(data, 4.9e-3, energy_potential=lambda energy: energy - 10.0 * energy[0])
    assert (run.status, run.failure) == ("failed", "diverged")
    assert "at t = 0.006 s the belt has 1.11 times the energy that it was given" in run.reason
