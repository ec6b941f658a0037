"""Lists of signals, which add: torques and given speeds of pulleys, and what is refused."""

from math import exp, expm1
from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import NO_FRICTION, NO_MOTION_ACROSS, pair
from tests.support.scenarios import Scenario, simulate

INERTIA = 2e-3  # kg m^2, of a pulley of `pair`
DURATION = 0.05  # s


def smooth_pulleys(signal: Any, **changes: Any) -> Scenario:
    """Return pulleys on which the belt slides without friction: nothing but torques turns them."""
    rubs = {"effects__belt_friction": NO_FRICTION, "drive": {"driven": {"torque": signal}}}
    return pair(**NO_MOTION_ACROSS, **rubs, **changes)


def over_speed(slope: float, offset: float = 0.0) -> dict[str, Any]:
    """Return a torque of `offset` less `slope` times the speed."""
    return {"speed": [-1e3, 1e3], "value": [offset + 1e3 * slope, offset - 1e3 * slope]}


@pytest.mark.parametrize(
    ("constants", "brakes", "sense", "backend"),
    [
        ([2.0], [(0.1, -1.0)], 1.0, "rkf45"),
        ([0.3, -1.7, 0.5], [(0.05, 0.7), (0.02, 0.0)], -1.0, "rkf45"),
        ([-0.4, 1.1], [(0.01, 1.0), (0.1, -0.3), (0.03, 0.2)], -1.0, "moreau"),
    ],
)
def test_constants_and_brakes_add_to_an_exponential_run_up(
    constants: list[float], brakes: list[tuple[float, float]], sense: float, backend: str
) -> None:
    """J w' = M - c w, with the sums M of the constants and c of the slopes."""
    terms = [sense * m for m in constants] + [over_speed(c, sense * m) for c, m in brakes]
    done = simulate(smooth_pulleys(terms, solver__backend=backend))
    assert done.status == "done"
    torque = sense * (sum(constants) + sum(m for _, m in brakes))
    slope = sum(c for c, _ in brakes)
    rate, final = slope / INERTIA, torque / slope
    end, left = done.channels["pulley_speed"][-1, 1], exp(-rate * DURATION)
    # Midpoint steps of 2.6e-4 s at rates of up to 150/s: (h rate)^2/24 = 6e-5 a time constant.
    # Torques of 100 N m, at the ends of the points, are rounded by 1e-14.
    close = 2e-4 * abs(final) + 1e-10
    assert end == pytest.approx(-final * expm1(-rate * DURATION), abs=close)
    # `moreau` has the torque in the middle of the last step, half of 2.6e-4 s before.
    late = 1.3e-4 * rate * abs(torque - slope * end)
    assert done.channels["pulley_torque"][-1, 1] == pytest.approx(
        torque - slope * end, abs=slope * close + 1.1 * late
    )
    # The integral of (M - c w) w: 1/2 J w^2, all that the torque has put in.
    work = 0.5 * INERTIA * (final * (1.0 - left)) ** 2
    assert done.channels["energy_input"][-1] == pytest.approx(
        work, abs=1e-3 * INERTIA * final**2 + 1e-12
    )
    assert done.channels["pulley_speed"][-1, 0] == 0.0


def test_a_step_ends_at_the_discontinuities_of_all_terms() -> None:
    """Adaptive steps are exact for straight lines, unless a bend is within one."""
    lines = [
        {"time": [0.00512, 0.0203, 0.0311], "value": [0.0, -2.0, 3.0]},
        {"time": [0.01013, 0.04], "value": [1.0, -1.0]},
        0.5,
    ]
    done = simulate(smooth_pulleys(lines))
    # The areas of trapezia; a bend of 130 N m/s within a step would be some 1e-3 rad/s.
    momentum = 0.5 * 0.01518 * -2.0 + 0.5 * 0.0108 * (-2.0 + 3.0) + (DURATION - 0.0311) * 3.0
    momentum += 0.01013 - 0.01 + 0.5 * DURATION
    speed = done.channels["pulley_speed"][-1, 1]
    assert speed == pytest.approx(momentum / INERTIA, abs=1e-10)


def test_terms_are_set_and_varied_by_their_index() -> None:
    scenario = fs.load(smooth_pulleys([1.0, over_speed(0.1)]), {"solver.duration": 1e-4})
    for key, unit in (("0", "N m"), ("1.value.0", "N m"), ("1.speed.1", "rad/s")):
        key = f"drive.driven.torque.{key}"
        assert f"{1.5e3}" in scenario.replace({key: 1.5e3}).to_toml()
        assert fs.sweep(scenario, {key: [1.5e3]}, workers=1)[key].attrs["units"] == unit
