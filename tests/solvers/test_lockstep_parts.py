"""The parts of the solver of many runs, each against its counterpart of one run."""

import math
import random
from math import exp, inf
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import StepUnderflow
from frictionsim.scenario.signals import Constant, PiecewiseLinear, Signal, Sine, SmoothStep
from frictionsim.solvers import stepper as one_run
from frictionsim.solvers.lockstep_functions import (
    changed,
    functions_agree,
    joined,
    joined_mechanism,
    with_exact_powers,
)
from frictionsim.solvers.lockstep_roots import bracket_roots
from frictionsim.solvers.lockstep_signals import Unlike, joined_signal
from frictionsim.solvers.lockstep_stepper import (
    LockstepStepper,
    Tolerances,
    clipped_steps,
    reduced_steps,
)
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.runge_kutta_fehlberg import RungeKuttaFehlberg45
from tests.support.scenarios import mechanism_of, pulley, simulate

pytestmark = pytest.mark.quick

SHAPES: Any = (
    lambda x, root: x - root,
    lambda x, root: root - x,
    lambda x, root: (x - root) * (x - root) * (x - root),
    lambda x, root: -1.0 if x < root else 1e-9,  # a jump
    lambda x, root: exp(20 * x) - exp(20 * root),
)


@given(st.lists(st.tuples(st.floats(-0.2, 1.2), st.integers(0, 4)), min_size=1, max_size=8))
def test_roots_have_the_brackets_of_one_run(cases: list[tuple[float, int]]) -> None:
    def f(x: Any) -> Any:
        values = zip(x.tolist(), cases, strict=True)
        return np.array([SHAPES[shape](at, root) for at, (root, shape) in values])

    for resolution in (0.0, 1e-9):
        ends = np.zeros(len(cases)), np.ones(len(cases))
        found = bracket_roots(f, *ends, np.full(len(cases), True), resolution)
        for i, (root, shape) in enumerate(cases):

            def alone(x: float, root: float = root, shape: int = shape) -> float:
                value: float = SHAPES[shape](x, root)
                return value

            if found.hidden[i]:
                with pytest.raises(StepUnderflow):
                    bracket_root(alone, 0.0, 1.0, resolution)
            else:
                expected = bracket_root(alone, 0.0, 1.0, resolution)
                assert (found.low[i], found.high[i]) == expected


def test_roots_that_are_not_wanted_are_not_sought() -> None:
    found = bracket_roots(
        lambda x: x, np.array([-1.0, 1.0]), np.array([2.0, 2.0]), np.array([1, 0]) > 0
    )
    assert found.hidden.tolist() == [False, False]
    assert found.high.tolist()[1] == 2.0


SIGNALS: dict[str, list[Signal]] = {
    "constant": [Constant(1.5), Constant(-2.0), Constant(0.0)],
    "one table": [PiecewiseLinear([0.5, 1.0, 2.5], [1.0, 3.0, -1.0]) for _ in range(3)],
    "tables": [PiecewiseLinear([0.1 * k, 1.0, 2.0 + k], [1.0, 3.0 * k, 0.1]) for k in range(3)],
    "sine": [Sine(0.1, k, 7.0 + 1e3 * k, 0.3 * k) for k in (0.0, 0.5, 3.0)],
    "smooth step": [SmoothStep(1.0, 2.0 + k, 0.3, 0.7 + k) for k in (0.0, 0.1, 1.0)],
}


@pytest.mark.parametrize("form", SIGNALS)
def test_signals_have_the_values_and_extrema_of_one_run(form: str) -> None:
    signals, rng = SIGNALS[form], random.Random(1)
    together = joined_signal(signals)
    chosen = together.select(np.array([2, 0]))
    # Also the ends of its smooth parts, where the next part holds, and back again.
    ends = [signal.next_extremum(0.2) for signal in signals]
    times = [[rng.uniform(-0.5, 4.0) for _ in signals] for _ in range(40)]
    for now in (*times, [min(end, 9.0) for end in ends], times[0], [0.0, 1.0, 2.0], [5.0] * 3):
        t = np.array(now)
        expected = [signal(at) for signal, at in zip(signals, now, strict=True)]
        assert together(t).tolist() == expected
        extrema = [signal.next_extremum(at) for signal, at in zip(signals, now, strict=True)]
        assert together.next_extremum(t).tolist() == extrema
        assert chosen(t[[2, 0]]).tolist() == [expected[2], expected[0]]


def test_signals_of_unlike_forms_are_not_joined() -> None:
    unlike: list[list[Signal]] = [
        [Constant(1.0), Sine(0.0, 1.0, 1.0, 0.0)],
        [
            PiecewiseLinear([0.0, 1.0], [1.0, 2.0]),
            PiecewiseLinear([0.0, 1.0, 2.0], [1.0, 2.0, 3.0]),
        ],
        [PiecewiseLinear(range(99), [k * n % 7.0 for n in range(99)]) for k in (1, 2)],
    ]
    for signals in unlike:
        with pytest.raises(Unlike):
            joined_signal(signals)


class Lever:
    """An object with a number that a function holds."""

    def __init__(self, arm: float, name: str = "lever") -> None:
        self.arm, self.name = arm, name

    def moment(self, force: Any) -> Any:
        return self.arm * force


def moment_of(arm: float, offset: float, name: str = "lever") -> Any:
    lever, scales = Lever(arm, name), (2.0, arm)

    def inner(force: Any) -> Any:
        return lever.moment(force) * scales[1] + offset

    return lambda force: inner(force) / scales[0]


def test_functions_are_joined_with_all_that_they_hold() -> None:
    numbers = [(0.1, 1.0), (0.2, 1.0), (0.3, -0.0)]
    together = joined([moment_of(*pair) for pair in numbers])
    force = np.array([3.0, 5.0, 7.0])
    expected = [moment_of(*pair)(at) for pair, at in zip(numbers, force.tolist(), strict=True)]
    assert together(force).tolist() == expected
    chosen = changed(together, lambda values: values[[2, 0]])
    assert chosen(force[[2, 0]]).tolist() == [expected[2], expected[0]]
    assert together(force).tolist() == expected  # as before


def test_numbers_are_joined_by_their_bits() -> None:
    assert joined([2.0, 2.0]) == 2.0
    assert [math.copysign(1.0, zero) for zero in joined([0.0, -0.0])] == [1.0, -1.0]


def test_equal_words_and_counts_are_joined_also_if_they_are_other_objects() -> None:
    assert joined(["two words", " ".join(["two", "words"])]) == "two words"
    assert joined([1000, int("1000")]) == 1000


@pytest.mark.parametrize(
    "values",
    [
        [moment_of(0.1, 1.0), moment_of(0.1, 1.0, "crank")],
        [moment_of(0.1, 1.0), lambda force: force],
        [(1.0, 2.0), (1.0,)],
        [1, 2],
        [1.0, None],
    ],
)
def test_what_differs_in_more_than_numbers_is_not_joined(values: list[Any]) -> None:
    with pytest.raises(Unlike):
        joined(values)


def test_a_mechanism_without_dry_friction_is_not_joined() -> None:
    mechanism = mechanism_of(simulate(pulley()))
    with pytest.raises(Unlike):
        joined_mechanism([mechanism, mechanism._replace(contact=None)])


def test_the_powers_in_functions_are_those_of_floats() -> None:
    def reaction_of(load: float) -> Any:
        return lambda force, angle: (force * force + load * load) ** 0.5

    mechanism = mechanism_of(simulate(pulley()))
    contact = mechanism.contact
    assert contact is not None
    forces, loads = np.random.default_rng(1).uniform(1.0, 1e4, (2, 5000))
    reactions = [reaction_of(load) for load in loads.tolist()]
    mechanisms = [mechanism._replace(contact=contact._replace(static_limit=f)) for f in reactions]
    exact = with_exact_powers(joined_mechanism(mechanisms)).contact
    assert exact is not None
    expected = [f(force, 0.0) for f, force in zip(reactions, forces.tolist(), strict=True)]
    assert exact.static_limit(forces, 0.0).tolist() == expected


def test_powers_and_sines_of_arrays_are_those_of_floats_here() -> None:
    """Else nothing goes in lockstep on this machine, and the other tests compare nothing."""
    assert functions_agree()


@given(
    st.lists(st.tuples(st.floats(1e-9, 10.0), st.floats(1e-9, 10.0), st.booleans()), min_size=1),
    st.floats(1e-9, 1e9),
)
def test_step_sizes_are_those_of_one_run(
    steps: list[tuple[float, float, bool]], error: float
) -> None:
    h, planned, rejected = (np.array(column) for column in zip(*steps, strict=True))
    n = len(steps)
    tolerances = Tolerances(*(np.full(n, x) for x in (1e-6, 1e-9, 2.0, 10.0)))
    stepper = LockstepStepper(1, n, lambda t, y, dy: None, tolerances)
    last = np.full(n, 0.3)
    found = stepper.next_step_size(h, planned, np.full(n, error), last, rejected)
    assert found.tolist() == [
        one_run.next_step_size(*step[:2], error, 0.3, step[2], 2.0) for step in steps
    ]
    assert clipped_steps(h, planned).tolist() == [one_run.clipped_step(*s[:2]) for s in steps]
    above = np.full(n, error + 1.0)
    assert reduced_steps(h, above).tolist() == [
        one_run.reduced_step(s[0], error + 1.0) for s in steps
    ]


@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=6), st.sampled_from([0.1, inf]))
def test_steps_are_those_of_one_run(rates: list[float], max_step: float) -> None:
    def rhs_of(rate: Any) -> Any:
        def rhs(t: Any, y: Any, dy: Any) -> None:
            dy[0] = y[1]
            dy[1] = rate * y[0] - 0.3 * y[1] + t

        return rhs

    n = len(rates)
    tolerances = Tolerances(*(np.full(n, x) for x in (1e-6, 1e-9, max_step, 10.0)))
    stepper = LockstepStepper(2, n, rhs_of(np.array(rates)), tolerances)
    t, y = np.full(n, 0.5), np.array([[1.0] * n, rates])
    start = stepper.start(t, y)
    assert start.finite.all()
    end = stepper.step(t, start.h, y, start.f)
    norm = stepper.error_norm(y, end)
    for i, rate in enumerate(rates):
        alone = RungeKuttaFehlberg45(2, 1e-6, 1e-9, max_step, 100)
        alone.start(rhs_of(rate), 0.5, [1.0, rate])
        assert (alone._h, alone.f) == (start.h[i], start.f[:, i].tolist())
        alone.advance(1e9)
        assert alone.rejected == 0
        assert alone.y == end[:, i].tolist()
        assert alone._error_norm() == norm[i]
