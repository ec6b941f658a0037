"""The model of a fit: samples at the times of the data, to the accuracy of the run."""

from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.fitting.data import FitOptions, measured
from frictionsim.fitting.problem import FitProblem
from tests.fitting.measurements import PULLEY
from tests.support.problems import BREAKAWAY, P_END, P_START, T_RAMP, SlipOnRamp

ON_RAMP = SlipOnRamp(P_START, (P_END - P_START) / T_RAMP, BREAKAWAY, 0.0, 1)


def sampled(scenario: fs.Scenario, times: Any, *channels: str) -> dict[str, Any]:
    """Return channels of a scenario at times."""
    zeros = {name: np.zeros(len(times)) for name in channels}
    options = FitOptions.of(data={"time": np.array(times), **zeros}, channels=channels)
    data = measured(options, scenario)
    values = FitProblem(scenario, (), data, lambda runs: None).model(np.empty(0)).values
    assert values is not None
    return dict(zip(channels, np.split(values, len(channels)), strict=True))


def test_channels_are_those_of_the_closed_form_at_any_times() -> None:
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(BREAKAWAY, T_RAMP, 40))  # of no grid
    channels = sampled(fs.load(PULLEY), times, "angle", "angular_velocity")
    exact = np.array([ON_RAMP(t) for t in times]).T
    assert channels["angle"] == pytest.approx(exact[0], abs=1e-9)
    assert channels["angular_velocity"] == pytest.approx(exact[1], abs=1e-8)


def test_at_an_event_the_value_is_that_after_it() -> None:
    scenario = fs.load(PULLEY)
    (event,) = fs.solve(scenario).events["time"].to_numpy()
    channels = sampled(scenario, [0.1, event, 1.0], "angular_acceleration", "friction_torque")
    sides = fs.solve(scenario).events
    after = float(sides["angular_acceleration_after"][0])
    assert after == pytest.approx(8.931678707)
    assert channels["angular_acceleration"].tolist()[:2] == [0.0, after]
    assert channels["friction_torque"][1] == float(sides["friction_torque_after"][0])


def test_a_run_ends_with_the_data_and_gives_the_same() -> None:
    scenario, times = fs.load(PULLEY), [0.0, 0.3, 0.7, 1.13]
    short = sampled(scenario, times, "angle")["angle"]
    whole = sampled(scenario, [*times, 3.0], "angle")["angle"]
    assert short == pytest.approx(whole[:-1], rel=1e-9)


def test_a_mechanism_without_friction_and_scipy_sample_too() -> None:
    keys = {"effects.shaft_friction": None, "solver.duration": 1.0}
    times = [0.111, 0.5, 0.987]
    angles = [
        sampled(fs.load(PULLEY, {**keys, "solver.backend": backend}), times, "angle")["angle"]
        for backend in ("events", "dop853")
    ]
    assert angles[0] == pytest.approx(angles[1], rel=1e-7)
