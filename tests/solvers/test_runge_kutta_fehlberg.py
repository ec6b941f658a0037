"""The Runge-Kutta-Fehlberg integrator on problems with closed solutions."""

from collections.abc import Callable
from itertools import pairwise
from math import cos, exp, hypot, log2, sin

import pytest

import frictionsim as fs
from frictionsim.errors import BudgetExceeded, NonFinite, StepUnderflow
from frictionsim.solvers.rkf45 import E6, START, Step, Tolerances
from tests.support.problems import CORD_RADIUS, DRAG, INERTIA, LOAD, R_K, R_S
from tests.support.wheels import signal, solved, wheel

USUAL = Tolerances(rtol=1e-9, atol=1e-12)


class Acceleration:
    """x'' = a(t, x, v): of a `System` what steps need."""

    coordinates = 1

    def __init__(self, value: Callable[[float, float, float], float]) -> None:
        self.value = value

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        return [y[1], self.value(t, *y)]

    def first(self, y: list[float], tolerances: Tolerances = USUAL, t: float = 0.0) -> Step:
        """Return the step of no length at a state."""
        return START.started(self, [], t, y, tolerances)


OSCILLATOR = Acceleration(lambda t, x, v: -x)  # x = sin t, v = cos t from (0, 1)
GROWTH = Acceleration(lambda t, x, v: v * cos(t))  # v = exp(sin t) from 1


def integrate(
    system: Acceleration, y: list[float], end: float, tolerances: Tolerances = USUAL
) -> Step:
    step = system.first(y, tolerances)
    while step.t < end:
        step = step.advanced(system, [], end, tolerances)
    return step


def error_of_fixed_steps(count: int) -> float:
    fixed = USUAL._replace(fixed_step=2.0 / count)
    y = integrate(OSCILLATOR, [0.0, 1.0], 2.0, fixed).y
    return max(abs(y[0] - sin(2.0)), abs(y[1] - cos(2.0)))


def test_fixed_steps_converge_with_order_5() -> None:
    errors = [error_of_fixed_steps(count) for count in (20, 40, 80)]
    for coarse, fine in pairwise(errors):
        # The next term of the error moves the order by about h; below 80 steps it is seen.
        assert log2(coarse / fine) == pytest.approx(5.0, abs=0.15)


def final_angle_by_fixed_steps(count: int) -> float:
    """Return the angle after two breakaways and two rests of each direction, by `events`."""
    # The pulley whose cord is pulled horizontally: of a shaft that bears hypot(P, W).
    scenario = fs.load("pulley_horizontal").to_dict()
    end = scenario["solver"]["duration"]
    mechanism = wheel(
        signal(scenario["drive"]["force"]),
        lambda u, q, v: (u - LOAD) * CORD_RADIUS - DRAG * v,
        lambda u: R_S * hypot(u, LOAD),
        lambda u: R_K * hypot(u, LOAD),
        INERTIA,
    )
    # The scenario of a user may not ask for this: `events` chooses its steps by the tolerances.
    solver = solved(mechanism, end, Tolerances(1e-9, 1e-12, fixed_step=end / count))
    assert len(solver.recording.transitions) == 7
    angle: float = solver.state.y[0]
    return angle


def test_fixed_steps_keep_their_order_through_located_events() -> None:
    angles = [final_angle_by_fixed_steps(count) for count in (80, 160, 320, 2560)]
    errors = [abs(angle - angles[-1]) for angle in angles[:-1]]
    for coarse, fine in pairwise(errors):
        # Order 5; where in its step each of the seven switches falls adds a factor of two.
        assert 4.0 < log2(coarse / fine) < 6.0


def test_error_estimate_is_of_order_5() -> None:
    """The local error of the solution of order 4 is of order h^5."""
    sizes = []
    for h in (0.1, 0.05):
        tolerances = Tolerances(rtol=0.0, atol=1.0, fixed_step=h)  # the norm is the error itself
        first = GROWTH.first([0.0, 1.0], tolerances, 0.3)
        sizes.append(first.advanced(GROWTH, [], 1.0, tolerances).error)
    assert log2(sizes[0] / sizes[1]) == pytest.approx(5.0, abs=0.2)  # next term, as above


@pytest.mark.parametrize("rtol", [1e-5, 1e-11])
def test_adaptive_error_is_near_its_tolerance(rtol: float) -> None:
    end = integrate(GROWTH, [0.0, 1.0], 20.0, Tolerances(rtol, rtol * 1e-3))
    # Each step may add the tolerance; what is kept, the solution of order 5, is better than the
    # estimate that the step was chosen by, but not by ten orders.
    error = abs(end.y[1] - exp(sin(20.0)))
    assert 1e-5 * rtol < error < end.taken * rtol
    assert end.rejected < 0.2 * end.taken


def test_an_error_is_relative_to_the_larger_of_both_states() -> None:
    tolerances = Tolerances(rtol=1e-3, atol=1e-6)
    flat = [0.0, 0.0]

    def error(errors: list[float], y_old: list[float], y: list[float]) -> float:
        slopes = [e / E6 for e in errors]  # of the last stage of a step of 1 s
        return tolerances.error(y_old, y, flat, (flat, flat, flat, slopes), 1.0)

    assert error([2e-3, 0.0], [0.1, 1.0], [-2.0, 1.0]) == pytest.approx(1.0, rel=1e-3)
    assert error([2e-3, 0.0], [-2.0, 1.0], [0.1, 1.0]) == pytest.approx(1.0, rel=1e-3)
    assert error([0.0, -3e-6], [1.0, 0.0], [1.0, 0.0]) == pytest.approx(3.0)


def test_states_within_a_step_are_as_accurate_as_its_end() -> None:
    tolerances = Tolerances(1e-10, 1e-12)
    step = OSCILLATOR.first([0.0, 1.0], tolerances)
    for _ in range(30):
        step = step.advanced(OSCILLATOR, [], 100.0, tolerances)
        for share in (0.0, 0.3, 0.9, 1.0):
            t = step.t_old + share * (step.t - step.t_old)
            x = step.at(OSCILLATOR, [], t)[0]
            assert x == pytest.approx(sin(t), abs=1e-8)  # 30 steps of 1e-10
            cut = step.cut(OSCILLATOR, [], t)
            assert (cut.t_old, cut.t, cut.y) == (step.t_old, t, step.at(OSCILLATOR, [], t))
            assert cut.k == pytest.approx([cut.y[1], -cut.y[0]], abs=0.0)
            # The error of the cubic is at most h^4/384 of the fourth derivative, below 1.
            cubic = (step.t - step.t_old) ** 4 / 384.0
            assert step.near(share)[0] == pytest.approx(x, abs=cubic + 1e-10)


def test_steps_end_exactly_at_the_limit() -> None:
    step = OSCILLATOR.first([0.0, 1.0])
    for limit in (0.1, 0.1 + 1e-9, 0.3, 1.0):
        while step.t < limit:
            step = step.advanced(OSCILLATOR, [], limit, USUAL)
        assert step.t == limit


def test_a_short_limit_does_not_shorten_the_steps_after_it() -> None:
    step = integrate(OSCILLATOR, [0.0, 1.0], 5.0)
    before = step.t - step.t_old
    step = step.advanced(OSCILLATOR, [], step.t + 1e-9, USUAL)
    step = step.advanced(OSCILLATOR, [], 10.0, USUAL)
    assert step.t - step.t_old > 0.5 * before


@pytest.mark.parametrize(("start", "time"), [(1.0, "1 s"), (1e200, "0 s")])
def test_a_state_that_is_non_finite_is_reported(start: float, time: str) -> None:
    diverging = Acceleration(lambda t, x, v: v * v)  # v = 1/(1 - t)
    with pytest.raises(NonFinite, match=f"state of the motion is not finite after t = {time}"):
        integrate(diverging, [0.0, start], 2.0)


def test_tolerances_that_cannot_be_met_are_reported() -> None:
    jump = Acceleration(lambda t, x, v: 1e9 if t > 1.0 else 0.0)
    with pytest.raises(StepUnderflow, match="at t = 1 s the tolerances require a step"):
        integrate(jump, [0.0, 0.0], 2.0, Tolerances(1e-13, 1e-13))


def test_the_step_limit_is_reported() -> None:
    with pytest.raises(BudgetExceeded, match="limit of 10 steps reached at t = "):
        integrate(OSCILLATOR, [0.0, 1.0], 100.0, USUAL._replace(max_steps=10))
