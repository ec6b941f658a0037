"""The shipped lift and the hard ones against the reference in closed form."""

import tomllib
from math import pi

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.lifts import LIFTS, assert_events, changes
from tests.support.scenarios import SCENARIOS, simulate, sound_file

HARD = SCENARIOS / "hard"
NAMES = ("lift", "hard/lift_moment_of_slack", "hard/lift_slack_rope", "hard/lift_traction_limit")
LAST = -950.979211811449  # N m, of the traction limit


def outcome(name: str, *overrides: str) -> Record:
    """Run a lift, which must pass its audit."""
    return sound_file(SCENARIOS / f"{name}.toml", overrides)


def test_every_hard_lift_has_a_test() -> None:
    assert sorted(f"hard/{path.stem}" for path in HARD.glob("lift*.toml")) == list(NAMES[1:])


@pytest.mark.parametrize(
    ("name", "rtol", "time", "angle"),
    [
        (name, *tolerances)
        for name in NAMES
        for tolerances in [(1e-11, 1e-9, 1e-8), (1e-4, 0.03, 0.1)]
    ],
)
def test_a_hard_lift_gives_the_reference(name: str, rtol: float, time: float, angle: float) -> None:
    """No transition is missed and none is added, however long the steps are."""
    done = outcome(name, f"solver.rtol={rtol}")
    assert_events(done, name, time, angle)
    _, final_angle, _, height, *_ = LIFTS[name]["samples"][-1]
    assert done.channels["angle"][-1] == pytest.approx(final_angle, abs=angle)
    assert done.channels["car_position"][-1] == pytest.approx(height, abs=angle)


@pytest.mark.parametrize(("factor", "slips"), [(1 - 1e-9, False), (1.0, False), (1 + 1e-9, True)])
def test_traction_is_sharp_to_one_part_in_a_billion(factor: float, slips: bool) -> None:
    torque = f"{{ time = [0.0, 0.5, 0.6], value = [-500.0, -500.0, {LAST * factor!r}] }}"
    done = outcome("hard/lift_traction_limit", f"drive.torque={torque}")
    assert [change[1:3] for change in changes(done, "cord")] == ([(0, 1)] if slips else [])
    ratio = done.channels["rope_tension_counterweight"] / done.channels["rope_tension_car"]
    limit = np.exp(pi * 0.15)
    if slips:
        assert changes(done, "cord")[0][0] == pytest.approx(0.5999999997891301, abs=1e-10)
        assert changes(done, "shaft")[0][:3] == (pytest.approx(0.730962031, abs=1e-8), 1, -1)
    else:
        assert np.max(ratio) == pytest.approx(limit, rel=3e-9)


@pytest.mark.parametrize(
    ("lowest", "rtol"), [(1e-9, 1e-2), (-1e-9, 1e-2), (-1e-9, 1e-10), (-1e-3, 1e-2)]
)
def test_a_stop_for_a_moment_is_not_missed(lowest: float, rtol: float) -> None:
    """The speed has its minimum at 1 s; where that is below zero, the pulley stops just before.

    w = w0 - t + t^2/2, a parabola, which the integrator takes in one step.
    """
    data = tomllib.loads((HARD / "lift_moment_of_slack.toml").read_text())
    shaft = data["effects"]["shaft_friction"]
    shaft["mu_k"] = shaft["mu_s"]
    first, second, r, r_s = 60.0 * 9.81, 50.0 * 9.81, 0.2, 0.04 * 0.2 / np.hypot(1.0, 0.2)
    inertia = 1.0 + 60.0 * r * (r + r_s) + 50.0 * r * (r - r_s)
    balance = (first - second) * r + r_s * (first + second)
    torque = {"time": [0.0, 2.0], "value": [float(balance - inertia), float(balance + inertia)]}
    data["drive"]["torque"] = torque
    data["mechanism"]["initial_angular_velocity"] = 0.5 + lowest
    data["solver"] |= {"duration": 1.5, "rtol": rtol}
    transitions = changes(simulate(data), "shaft")
    if lowest > 0.0:
        assert transitions == []
        return
    (stop, *between), (start, *_) = (change[:3] for change in transitions)
    assert between == [1, 0]
    # A rounding of the speed is worth more time the nearer the stop is to the minimum.
    early = np.sqrt(-2.0 * lowest)
    assert 1.0 - stop == pytest.approx(early, abs=1e-9 + 1e-14 / early)
    assert start == pytest.approx(1.0, abs=1e-12)


def test_a_bouncing_car_comes_to_rest() -> None:
    done = outcome("hard/lift_slack_rope")
    shocks = [e for e in done.transitions if e.contact == "car_rope"]
    assert len(shocks) == 6  # slack, four bounces, taut
    # The rope keeps 0.09 of the work that takes it up, and the shaft gets warm besides.
    losses = np.diff(done.channels["energy_impact"])
    large = losses[losses > 0.0]
    assert large[:3] == pytest.approx([18.571543547755, 1.5710060200458, 0.1359302154656], rel=1e-6)
    assert done.channels["energy_impact"][-1] == pytest.approx(
        sum(loss for *_, loss in LIFTS["hard/lift_slack_rope"]["impacts"]), rel=1e-7
    )
