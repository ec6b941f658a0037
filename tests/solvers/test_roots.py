"""The bracketing root finder, and the search for the first excess of a contact at rest.

The search misses no peak, and claims none.
"""

from collections.abc import Callable
from math import cos, exp, inf, pi, sin, ulp
from typing import Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import StepUnderflow
from frictionsim.solvers.roots import MAX_STEPS, bracket_root, time_of_excess

TIE = 1e-14
Function = Callable[[float], float]


@given(st.floats(0.001, 0.999), st.integers(0, 4))
def test_brackets_the_root_to_rounding(root: float, shape: int) -> None:
    f = (
        lambda x: x - root,
        lambda x: root - x,
        lambda x: (x - root) ** 3,
        lambda x: exp(20 * x) - exp(20 * root),
        lambda x: -1.0 if x < root else 1e-9,  # a jump
    )[shape]
    lo, hi = bracket_root(f, 0.0, 1.0)
    assert hi - lo <= 2 * ulp(1.0)
    assert (f(lo) > 0) == (f(0.0) > 0)
    assert (f(hi) > 0) == (f(1.0) > 0)
    # exp(20 x) is flat to rounding for 1e-15 about its root; the others are not.
    assert lo - 1e-14 <= root <= hi + 1e-14


def test_it_takes_few_evaluations_and_stops_at_the_required_resolution() -> None:
    calls = []
    bracket_root(lambda x: calls.append(x) or exp(x) - 2.0, 0.0, 1.0)  # type: ignore[func-returns-value]
    assert len(calls) < 20  # bisection would take 52
    lo, hi = bracket_root(lambda x: x * x - 2.0, 0.0, 2.0, 1e-3)
    assert 1e-6 < hi - lo <= 1e-3


def test_a_zero_counts_as_not_positive() -> None:
    lo, hi = bracket_root(lambda x: max(0.0, x - 0.5), 0.0, 1.0)
    assert lo == pytest.approx(0.5, abs=1e-15)
    assert hi > 0.5


def test_equal_signs_at_both_ends_are_an_error() -> None:
    with pytest.raises(StepUnderflow, match="no change of sign"):
        bracket_root(lambda x: 1.0 + x, 0.0, 1.0)


class Excess(NamedTuple):
    """A function of the time, and its derivative."""

    at: Function
    slope: Function


def searched(
    value: Function, slope: Function, curvature: float, end: float = 1.0
) -> tuple[float, int]:
    """Return the time found by searching on to the end, and the number of evaluations."""
    calls = 0

    def counted(t: float) -> float:
        nonlocal calls
        calls += 1
        return value(t)

    t = 0.0
    while t < end:
        t = time_of_excess(Excess(counted, slope), curvature, t, end, TIE)
        if value(t) > 0.0:
            return t, calls
    return inf, calls


def sine(peak: float, hz: float, amplitude: float = 1.0) -> tuple[Function, Function, float]:
    """Return a sine that peaks at `peak`, with its slope and the bound of its curvature."""
    w = 2.0 * pi * hz
    return (
        lambda t: amplitude * (sin(w * t) - 1.0) + peak,
        lambda t: amplitude * w * cos(w * t),
        amplitude * w**2,
    )


@pytest.mark.parametrize(("peak", "hz"), [(1e-3, 0.3), (1e-6, 5.0), (1e-9, 300.0), (1e-12, 300.0)])
def test_a_short_peak_above_zero_is_found_and_one_below_is_not(peak: float, hz: float) -> None:
    """The peak of 1e-12 at 300 Hz is above zero for 1.5 ns."""
    value, *rest = sine(peak, hz)
    time, _ = searched(value, *rest)
    assert 0.0 < value(time) <= peak * (1.0 + 1e-3)
    assert time * hz < 0.5  # in the first period, and not one of the next
    assert searched(*sine(-peak, hz))[0] == inf


@pytest.mark.parametrize(
    ("peak", "amplitude", "most"), [(0.0, 1.0, 60), (-0.9, 0.1, 20), (-0.5, 0.5, 30)]
)
def test_a_period_costs_few_evaluations(peak: float, amplitude: float, most: int) -> None:
    """One that touches zero is passed."""
    time, calls = searched(*sine(peak, 1.0, amplitude), 50.0)
    assert time == inf
    assert calls < most * 50


def test_one_call_takes_a_bounded_number_of_steps() -> None:
    """Between calls a run can be interrupted, however long the rest is."""
    value, slope, curvature = sine(-0.1, 1e6)
    calls: list[float] = []
    counted: Any = Excess(lambda t: calls.append(t) or value(t), slope)
    assert 0.0 < time_of_excess(counted, curvature, 0.0, 1.0, TIE) < 1.0
    assert len(calls) <= MAX_STEPS


@pytest.mark.parametrize("begin", [0.0, 1e6])
def test_linear_functions_take_a_handful_of_evaluations(begin: float) -> None:
    """Without curvature the first step is to the root; the roundoff of the time passes it."""
    calls = []

    def value(t: float) -> float:
        calls.append(t)
        return 0.7 * (t - begin) - 0.35

    time = time_of_excess(Excess(value, lambda t: 0.7), 0.0, begin, begin + 1.0, TIE)
    assert time == pytest.approx(begin + 0.5, rel=1e-12)
    assert value(time) > 0.0
    assert len(calls) < 12
    falling = time_of_excess(Excess(lambda t: -t - 1.0, lambda t: -1.0), 0.0, 0.0, 1.0, TIE)
    assert falling == 1.0


def test_a_slope_that_jumps_downwards_hides_no_excess() -> None:
    """As the static limit of a load that passes zero at 0.5: a corner that points upwards."""

    def value(t: float) -> float:
        return 1e-9 - abs(t - 0.5)

    def slope(t: float) -> float:
        return 1.0 if t < 0.5 else -1.0

    time, calls = searched(value, slope, 0.0)
    assert value(time) > 0.0
    assert calls < 20
    assert searched(lambda t: value(t) - 2e-9, slope, 0.0)[0] == inf


WAVE = st.tuples(st.floats(-1.0, 1.0), st.floats(0.2, 30.0), st.floats(0.0, 2.0 * pi))


@given(
    st.lists(WAVE, min_size=1, max_size=4),
    st.floats(-3.0, 3.0),
    st.one_of(st.floats(0.0, 1.5), st.sampled_from([0.0, 1e-9, 1e-6])),
)
def test_the_first_excess_of_any_sum_of_sines_is_found(
    waves: list[tuple[float, float, float]], ramp: float, above: float
) -> None:
    """Against the largest of a thousand values; `above` of it is above zero."""

    def plain(t: float) -> float:
        return ramp * t + sum(a * sin(2.0 * pi * f * t + p) for a, f, p in waves)

    def slope(t: float) -> float:
        return ramp + sum(2.0 * pi * f * a * cos(2.0 * pi * f * t + p) for a, f, p in waves)

    values = {k / 1000.0: plain(k / 1000.0) for k in range(1001)}
    shift = max(values.values()) - above
    curvature = sum(abs(a) * (2.0 * pi * f) ** 2 for a, f, _ in waves)

    def value(t: float) -> float:
        return plain(t) - shift

    if value(0.0) > 0.0:
        return
    time, _ = searched(value, slope, curvature)
    sampled = min((t for t, v in values.items() if v > shift + 10.0 * TIE), default=inf)
    if time == inf:
        assert sampled == inf
        return
    assert value(time) > 0.0
    first = bracket_root(value, 0.0, time)[1]
    assert first <= sampled
    # Before it, nothing is above zero by more than the tie.
    assert all(value(first * k / 500.0) <= TIE + 1e-15 for k in range(500))
