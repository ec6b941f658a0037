"""The Runge-Kutta-Fehlberg integrator on problems with closed solutions."""

from collections.abc import Callable
from itertools import pairwise
from math import cos, exp, inf, log2, sin

import numpy as np
import pytest

from frictionsim.errors import SolverError
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import load
from frictionsim.scenario.settings import SolverSettings
from frictionsim.solvers import new_solver, runge_kutta_fehlberg
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.runge_kutta_fehlberg import RungeKuttaFehlberg45, stages
from frictionsim.solvers.stepper import State
from tests.support.scenarios import SCENARIOS

pytestmark = pytest.mark.quick


def oscillator(t: float, y: State, dy: State) -> None:
    """x'' = -x: x = sin t, v = cos t from (0, 1)."""
    dy[0] = y[1]
    dy[1] = -y[0]


def growth_in_time(t: float, y: State, dy: State) -> None:
    """y' = y cos t: y = exp(sin t) from 1."""
    dy[0] = y[0] * cos(t)


def stepper(
    states: int,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_steps: int = 10**6,
    fixed: float | None = None,
) -> RungeKuttaFehlberg45:
    return RungeKuttaFehlberg45(states, rtol, atol, inf, max_steps, fixed)


def integrate(rkf: RungeKuttaFehlberg45, rhs: Callable, y: list[float], end: float) -> State:
    rkf.start(rhs, 0.0, y)
    while rkf.t < end:
        rkf.advance(end)
    return rkf.y


def error_of_fixed_steps(count: int) -> float:
    y = integrate(stepper(2, fixed=2.0 / count), oscillator, [0.0, 1.0], 2.0)
    return max(abs(y[0] - sin(2.0)), abs(y[1] - cos(2.0)))


def test_fixed_steps_converge_with_order_5() -> None:
    errors = [error_of_fixed_steps(count) for count in (20, 40, 80)]
    for coarse, fine in pairwise(errors):
        # The next term of the error moves the order by about h; below 80 steps it is seen.
        assert log2(coarse / fine) == pytest.approx(5.0, abs=0.15)


def final_angle_by_fixed_steps(count: int) -> float:
    """Return the angle after two breakaways and two rests of each direction, by `events`."""
    scenario = load(SCENARIOS / "pulley_horizontal.toml")
    mechanism = mechanism_module(scenario.kind).build(scenario)
    end = scenario.solver.duration
    buffer = SampleBuffer(SampleTimes(end, end))
    # The scenario of a user may not ask for this: `events` chooses its steps by the tolerances.
    solver = SolverSettings(duration=end, step=end / count)
    new_solver(mechanism, solver, buffer).run(lambda t: None)
    assert len(buffer.transitions) == 7
    return buffer.rows[-SampleBuffer.COLUMNS - len(mechanism.energy_integrals) + 2]


def test_fixed_steps_keep_their_order_through_located_events() -> None:
    angles = [final_angle_by_fixed_steps(count) for count in (80, 160, 320, 5120)]
    errors = [abs(angle - angles[-1]) for angle in angles[:-1]]
    for coarse, fine in pairwise(errors):
        # Order 5; where in its step each of the seven switches falls adds a factor of two.
        assert 4.0 < log2(coarse / fine) < 6.0


def test_error_estimate_is_of_order_5() -> None:
    """The local error of the solution of order 4 is of order h^5."""
    sizes = []
    for h in (0.1, 0.05):
        k: list[State] = [[0.0] for _ in range(6)]
        growth_in_time(0.3, [1.0], k[0])
        error: State = [0.0]
        stages(growth_in_time, 0.3, h, [1.0], k, [0.0], [0.0], error)
        sizes.append(abs(error[0]))
    assert log2(sizes[0] / sizes[1]) == pytest.approx(5.0, abs=0.2)  # next term, as above


@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-11])
def test_adaptive_error_is_near_its_tolerance(rtol: float) -> None:
    rkf = stepper(1, rtol, rtol * 1e-3)
    y = integrate(rkf, growth_in_time, [1.0], 20.0)
    # Each step may add the tolerance; what is kept, the solution of order 5, is better than the
    # estimate that the step was chosen by, but not by ten orders.
    error = abs(y[0] - exp(sin(20.0)))
    assert 1e-5 * rtol < error < rkf.steps * rtol
    assert rkf.rejected < 0.2 * rkf.steps


def test_interpolation_is_as_accurate_as_the_step() -> None:
    rkf = stepper(2, 1e-10)
    rkf.start(oscillator, 0.0, [0.0, 1.0])
    for _ in range(30):
        rkf.advance(100.0)
        for share in (0.0, 0.3, 0.9, 1.0):
            t = rkf.t_old + share * (rkf.t - rkf.t_old)
            assert rkf.interpolate(t)[0] == pytest.approx(sin(t), abs=1e-8)  # 30 steps of 1e-10


def test_steps_end_exactly_at_the_limit() -> None:
    rkf = stepper(2)
    rkf.start(oscillator, 0.0, [0.0, 1.0])
    for limit in (0.1, 0.1 + 1e-9, 0.3, 1.0):
        while rkf.t < limit:
            rkf.advance(limit)
        assert rkf.t == limit


def test_a_short_limit_does_not_shorten_the_steps_after_it() -> None:
    rkf = stepper(2)
    integrate(rkf, oscillator, [0.0, 1.0], 5.0)
    before = rkf.t - rkf.t_old
    rkf.advance(rkf.t + 1e-9)
    rkf.advance(10.0)
    assert rkf.t - rkf.t_old > 0.5 * before


def test_a_state_that_is_non_finite_is_reported() -> None:
    def diverging(t: float, y: State, dy: State) -> None:
        dy[0] = y[0] * y[0]  # y = 1/(1 - t)

    for start, time in ((1.0, "1"), (1e200, "0")):
        with pytest.raises(SolverError, match=f"is not finite after t = {time} s"):
            integrate(stepper(1), diverging, [start], 2.0)


def test_tolerances_that_cannot_be_met_are_reported() -> None:
    def jump(t: float, y: State, dy: State) -> None:
        dy[0] = 1e9 if t > 1.0 else 0.0

    with pytest.raises(SolverError, match=r"at t = 1 s the tolerances require a step of"):
        integrate(stepper(1, 1e-13, 1e-13), jump, [0.0], 2.0)


def test_the_step_limit_is_reported() -> None:
    with pytest.raises(SolverError, match=r"limit of 10 steps reached at t = "):
        integrate(stepper(2, max_steps=10), oscillator, [0.0, 1.0], 100.0)


WAYS = ("stage_2", "stage_3", "stage_4", "stage_5", "stage_6", "solution_5", "error_estimate_5")


@pytest.mark.parametrize("name", WAYS)
def test_compiled_stages_give_the_same_numbers(name: str) -> None:
    """The same functions run on lists of floats and are compiled for large systems."""
    numba = pytest.importorskip("numba")
    way = getattr(runge_kutta_fehlberg, name)
    arrays = list(np.random.default_rng(1).normal(size=(way.__code__.co_argcount - 2, 40)))
    plain, compiled = [0.0] * 40, np.zeros(40)
    way(0.1, *arrays, plain)
    numba.njit(way)(0.1, *arrays, compiled)
    # Fused multiplications may round differently in the compiled code.
    assert compiled == pytest.approx(np.array(plain), rel=1e-14, abs=1e-15)
