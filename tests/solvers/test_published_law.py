"""The switch of eq 30 in the five cases of the paper, eqs 31 to 35.

    I theta'' = {-sign(theta') r_k R + M} sign(|sign(|x| - x)| + |sign(theta')|),  x = r_s - |c|,
    c = M/R

"Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11), 2018.
"""

from typing import NamedTuple

import pytest

from frictionsim.solvers.laws import Published
from frictionsim.solvers.recording import Recording
from tests.support.problems import CORD_RADIUS, DRAG, LOAD, R_K, R_S
from tests.support.scenarios import pulley, simulate, with_method
from tests.support.wheels import TIGHT, signal, wheel


class Case(NamedTuple):
    """A row of the table: the two terms in the outer sign(), and its value."""

    number: str
    force: float  # N, on the cord
    velocity: float  # rad/s
    beyond: int  # |sign(|x| - x)|: 1 beyond the static limit
    moving: int  # |sign(theta')|
    factor: int


# 2300 N are within the static limit, 2800 and 1750 N beyond it, above and below the
# load; what the damping takes of M at 1 rad/s changes nothing of that.
TABLE = [
    Case("1", 2300.0, 0.0, 0, 0, 0),
    Case("2", 2800.0, 0.0, 1, 0, 1),
    Case("2, down", 1750.0, 0.0, 1, 0, 1),
    Case("3", 2800.0, 1.0, 1, 1, 1),
    Case("3, down", 1750.0, -1.0, 1, 1, 1),
    Case("4", 2300.0, 1.0, 0, 1, 1),
    Case("4, down", 2300.0, -1.0, 0, 1, 1),
    Case("5", 2300.0, 0.0, 0, 0, 0),
]


def sign(x: float) -> int:
    return 1 if x > 0.0 else -1 if x < 0.0 else 0


def moment(case: Case) -> float:
    return (case.force - LOAD) * CORD_RADIUS - DRAG * case.velocity


@pytest.mark.parametrize("case", TABLE, ids=lambda case: case.number)
def test_switch_and_friction_of_eq_30_in_the_five_cases(case: Case) -> None:
    reaction = case.force + LOAD
    x = R_S - abs(moment(case) / reaction)
    assert abs(sign(abs(x) - x)) == case.beyond
    assert abs(sign(case.velocity)) == case.moving
    assert sign(case.beyond + case.moving) == case.factor
    data = pulley(
        drive__force=case.force,
        mechanism__initial_angular_velocity=case.velocity,
        solver={"duration": 1e-6},
    )
    start = simulate(with_method(data, "published", "rkf45")).channels
    friction = start["friction_torque"][0]
    printed = moment(case) - sign(case.velocity) * R_K * reaction
    # What stands to the right of I theta'', less the moment, to the rounding of both.
    assert friction + moment(case) == pytest.approx(case.factor * printed, abs=1e-13)
    at_rest_and_beyond = case.number.startswith("2")
    assert (friction == 0.0) == at_rest_and_beyond  # sign(0) removes all friction


def test_a_torque_equal_to_the_limit_is_within_it() -> None:
    """x = 0 leaves sign(0) = 0, and what is to the right of I theta'' vanishes."""
    system = wheel(signal(0.0), lambda u, q, v: u, lambda u: 20.0, lambda u: 10.0)
    law = Published(system, TIGHT, Recording(system, 1.0, 1.0), 1.0)
    for torque in (20.0, -20.0):
        assert law.friction(0.0, 0.0, 0.0, 0, torque) == -torque
        assert law.friction(0.0, 0.0, 0.0, 0, 1.001 * torque) == 0.0
        assert law.friction(0.0, 0.0, -1.0, 0, torque) == 10.0
