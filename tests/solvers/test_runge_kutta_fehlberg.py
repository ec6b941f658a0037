"""The Runge-Kutta-Fehlberg integrator on problems with closed solutions."""

from array import array
from collections.abc import Callable
from itertools import pairwise
from math import cos, exp, hypot, inf, log2, sin
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.solvers import new_solver, runge_kutta_fehlberg
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.law_stepper import LawStepper
from frictionsim.solvers.one_contact_state import Failure, Run
from frictionsim.solvers.one_contact_step import trial_step
from tests.support.cases import one_in
from tests.support.problems import CORD_RADIUS, DRAG, INERTIA, LOAD, R_K, R_S
from tests.support.wheels import buffer_to, settings, signal, wheel


class Acceleration(NamedTuple):
    """x'' = a(t, x, v), as a system without friction."""

    value: Callable[[float, float, float], float]
    drive: Any = SimpleNamespace(at=lambda t: t)
    inertia: float = 1.0

    def torques_and_powers(self, t: float, q: float, v: float, s: float) -> Any:
        return self.value(t, q, v), 0.0, ()


OSCILLATOR = Acceleration(lambda t, x, v: -x)  # x = sin t, v = cos t from (0, 1)
GROWTH = Acceleration(lambda t, x, v: v * cos(t))  # v = exp(sin t) from 1


def stepper(
    system: Acceleration,
    rtol: float = 1e-9,
    atol: float = 1e-12,
    max_steps: int = 10**6,
    fixed: float = 0.0,
) -> LawStepper:
    numbers = {"end": inf, "interval": inf, "last": 0.0, "given": array("d"), "stored": ()}
    more = {"columns": 0, "energy_floor": 0.0, "input": 0, "heats": 0}
    run: Any = Run(
        states=2, rtol=rtol, atol=atol, max_step=inf, fixed_step=fixed, max_steps=max_steps,
        **numbers, **more,
    )  # fmt: skip
    problem: Any = SimpleNamespace(run=run, state=array("d", bytes(8 * layout.LENGTH)))
    return LawStepper(system, problem)


def integrate(rkf: LawStepper, y: list[float], end: float) -> list[float]:
    rkf.start(0.0, y)
    while rkf.t < end:
        rkf.advance(end)
    return rkf.y


def error_of_fixed_steps(count: int) -> float:
    y = integrate(stepper(OSCILLATOR, fixed=2.0 / count), [0.0, 1.0], 2.0)
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
    buffer = buffer_to(end)
    # The scenario of a user may not ask for this: `events` chooses its steps by the tolerances.
    solver = settings(backend="events", duration=end, step=end / count)
    new_solver(mechanism, solver, buffer).run(lambda t: None)
    assert len(buffer.transitions) == 7
    return buffer.rows[-layout.ROW_COLUMNS - len(mechanism.energy_integrals) + 2]


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
        rkf = stepper(GROWTH, rtol=0.0, atol=1.0)  # the norm is the error itself
        rkf.start(0.3, [0.0, 1.0])
        rkf.advance(0.3 + 1e-9)
        sizes.append(trial_step(GROWTH, rkf._problem.run, rkf._s, 1.0, h))
    assert log2(sizes[0] / sizes[1]) == pytest.approx(5.0, abs=0.2)  # next term, as above


@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-11])
def test_adaptive_error_is_near_its_tolerance(rtol: float) -> None:
    rkf = stepper(GROWTH, rtol, rtol * 1e-3)
    y = integrate(rkf, [0.0, 1.0], 20.0)
    # Each step may add the tolerance; what is kept, the solution of order 5, is better than the
    # estimate that the step was chosen by, but not by ten orders.
    error = abs(y[1] - exp(sin(20.0)))
    assert 1e-5 * rtol < error < rkf.steps * rtol
    assert rkf.rejected < 0.2 * rkf.steps


def test_interpolation_is_as_accurate_as_the_step() -> None:
    rkf = stepper(OSCILLATOR, 1e-10)
    rkf.start(0.0, [0.0, 1.0])
    for _ in range(30):
        rkf.advance(100.0)
        for share in (0.0, 0.3, 0.9, 1.0):
            t = rkf.t_old + share * (rkf.t - rkf.t_old)
            assert rkf.interpolate(t)[0] == pytest.approx(sin(t), abs=1e-8)  # 30 steps of 1e-10


def test_steps_end_exactly_at_the_limit() -> None:
    rkf = stepper(OSCILLATOR)
    rkf.start(0.0, [0.0, 1.0])
    for limit in (0.1, 0.1 + 1e-9, 0.3, 1.0):
        while rkf.t < limit:
            rkf.advance(limit)
        assert rkf.t == limit


def test_a_short_limit_does_not_shorten_the_steps_after_it() -> None:
    rkf = stepper(OSCILLATOR)
    integrate(rkf, [0.0, 1.0], 5.0)
    before = rkf.t - rkf.t_old
    rkf.advance(rkf.t + 1e-9)
    rkf.advance(10.0)
    assert rkf.t - rkf.t_old > 0.5 * before


def failure_of(rkf: LawStepper, y: list[float], end: float) -> tuple[int, float]:
    """Return why a run fails, and when."""
    with pytest.raises(Failure) as failure:
        integrate(rkf, y, end)
    return failure.value.reason, failure.value.numbers[0]


def test_a_state_that_is_non_finite_is_reported() -> None:
    diverging = Acceleration(lambda t, x, v: v * v)  # v = 1/(1 - t)
    for start, time in ((1.0, 1.0), (1e200, 0.0)):
        reason, t = failure_of(stepper(diverging), [0.0, start], 2.0)
        assert (reason, round(t, 9)) == (layout.NON_FINITE, time)


def test_tolerances_that_cannot_be_met_are_reported() -> None:
    jump = Acceleration(lambda t, x, v: 1e9 if t > 1.0 else 0.0)
    reason, t = failure_of(stepper(jump, 1e-13, 1e-13), [0.0, 0.0], 2.0)
    assert (reason, round(t, 9)) == (layout.UNDERFLOW, 1.0)


def test_the_step_limit_is_reported() -> None:
    limited = stepper(OSCILLATOR, max_steps=10)
    assert failure_of(limited, [0.0, 1.0], 100.0)[0] == layout.TOO_MANY_STEPS


WAYS = ("stage_2", "stage_3", "stage_4", "stage_5", "stage_6", "error_estimate_5")


@pytest.mark.parametrize("name", one_in(2, WAYS[::-1]))
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
