"""The model of a fit: samples at the times of the data, to the accuracy of the run."""

from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.fits.measurements import PULLEY
from tests.support.problems import BREAKAWAY, P_END, P_START, T_RAMP, SlipOnRamp

ON_RAMP = SlipOnRamp(P_START, (P_END - P_START) / T_RAMP, BREAKAWAY, 0.0, 1)
# The force stays after the ramp; its last value comes after all data, which nothing changes with.
FORCE = {"time": [0.0, T_RAMP, 4.0, 5.0], "value": [P_START, P_END, P_END, P_END]}
FREE = {"drive.force.value.3": (0.5 * P_END, 2.0 * P_END)}


def loaded(**overrides: Any) -> fs.Scenario:
    keys = {key.replace("__", "."): value for key, value in overrides.items()}
    return fs.load(PULLEY, {"drive.force": FORCE, **keys})


def sampled(scenario: fs.Scenario, times: Any, *channels: str) -> dict[str, Any]:
    """Return channels of a scenario at times: those of a fit that leaves it as it is."""
    data = {name: np.array(times) for name in ("time", *channels)}  # any values
    fit = fs.fit(scenario, data=data, channels=channels, free=FREE, starts=1)
    assert list(fit.not_identified) == list(FREE)
    return {part.name: part.fitted for part in fit.residuals}


def test_channels_are_those_of_the_closed_form_at_any_times() -> None:
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(BREAKAWAY, T_RAMP, 40))  # of no grid
    channels = sampled(loaded(), times, "angle", "angular_velocity")
    exact = np.array([ON_RAMP(t) for t in times]).T
    assert channels["angle"] == pytest.approx(exact[0], abs=1e-9)
    assert channels["angular_velocity"] == pytest.approx(exact[1], abs=1e-8)


def test_at_an_event_the_value_is_that_after_it() -> None:
    scenario = loaded()
    (event,) = fs.solve(scenario).events["time"].to_numpy()
    channels = sampled(scenario, [0.1, event, 1.0], "angular_acceleration", "friction_torque")
    sides = fs.solve(scenario).events
    after = float(sides["angular_acceleration_after"][0])
    assert after == pytest.approx(8.931678707)
    assert channels["angular_acceleration"].tolist()[:2] == [0.0, after]
    assert channels["friction_torque"][1] == float(sides["friction_torque_after"][0])


def test_a_mechanism_without_friction_and_scipy_sample_too() -> None:
    times = [0.111, 0.5, 0.987]
    keys = {"effects__shaft_friction": None, "solver__duration": 1.0}
    angles = [
        sampled(loaded(solver__backend=backend, **keys), times, "angle")["angle"]
        for backend in ("events", "dop853")
    ]
    assert angles[0] == pytest.approx(angles[1], rel=1e-7)
