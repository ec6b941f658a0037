"""The switch of eq 30 in the five cases of the paper, eqs 31 to 35.

    I theta'' = {-sign(theta') r_k R + M} sign(|sign(|x| - x)| + |sign(theta')|),  x = r_s - |c|,
    c = M/R

"Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11), 2018.
"""

import pytest

from frictionsim.solvers.laws import Published
from frictionsim.solvers.recording import Recording
from tests.support.problems import CORD_RADIUS, DRAG, LOAD, R_K
from tests.support.scenarios import pulley, simulate, with_method
from tests.support.wheels import TIGHT, signal, wheel

# 2300 N on the cord are within the static limit, 2800 and 1750 N beyond it, above and below the
# load; what the damping takes of M at 1 rad/s changes nothing of that. The factor is the last sign.
CASES = {
    "1 and 5": (2300.0, 0.0, 0),
    "2": (2800.0, 0.0, 1),
    "2, down": (1750.0, 0.0, 1),
    "3": (2800.0, 1.0, 1),
    "3, down": (1750.0, -1.0, 1),
    "4": (2300.0, 1.0, 1),
    "4, down": (2300.0, -1.0, 1),
}


@pytest.mark.parametrize("number", CASES)
def test_switch_and_friction_of_eq_30_in_the_five_cases(number: str) -> None:
    force, velocity, factor = CASES[number]
    data = pulley(drive__force=force, mechanism__initial_angular_velocity=velocity)
    data["solver"] = {"duration": 1e-6}
    start = simulate(with_method(data, "published", "rkf45")).channels
    friction = start["friction_torque"][0]
    moment = (force - LOAD) * CORD_RADIUS - DRAG * velocity
    printed = factor * (moment - velocity * R_K * (force + LOAD))
    # What stands to the right of I theta'', less the moment, to the rounding of both.
    assert friction + moment == pytest.approx(printed, abs=1e-13)
    assert (friction == 0.0) == number.startswith("2")  # at rest sign(0) removes all friction


def test_a_torque_equal_to_the_limit_is_within_it() -> None:
    """x = 0 leaves sign(0) = 0, and what is to the right of I theta'' vanishes."""
    system = wheel(signal(0.0), lambda u, q, v: u, lambda u: 20.0, lambda u: 10.0)
    law = Published(system, TIGHT, Recording(system, 1.0, 1.0), 1.0)
    for torque in (20.0, -20.0):
        assert law.friction(0.0, 0.0, 0.0, 0, torque) == -torque
        assert law.friction(0.0, 0.0, 0.0, 0, 1.001 * torque) == 0.0
        assert law.friction(0.0, 0.0, -1.0, 0, torque) == 10.0
