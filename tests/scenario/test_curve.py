"""A signal as numbers has the values of the signal."""

from math import inf, isinf
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.scenario.signals import Constant, PiecewiseLinear, Sine, SmoothStep, curve_of

NUMBER = st.floats(-1e3, 1e3)
POSITIVE = st.floats(1e-3, 1e3)


@st.composite
def linear(draw: Any) -> PiecewiseLinear:
    times = sorted(draw(st.sets(st.floats(0.0, 10.0), min_size=1, max_size=6)))
    return PiecewiseLinear(times, [draw(NUMBER) for _ in times])


EXACT = st.one_of(
    st.builds(Constant, NUMBER),
    linear(),
    st.builds(Sine, NUMBER, POSITIVE, POSITIVE, st.floats(-7.0, 7.0)),
)


@given(EXACT, st.floats(0.0, 12.0))
def test_the_bits_are_those_of_the_signal(signal: Any, t: float) -> None:
    curve = curve_of(signal)
    assert curve.at(t) == signal(t)
    assert curve.next_extremum(t) == signal.next_extremum(t)


@given(NUMBER, NUMBER, st.floats(0.0, 5.0), POSITIVE, st.floats(0.0, 12.0))
def test_a_smooth_step_is_a_cubic(
    before: float, after: float, start: float, duration: float, t: float
) -> None:
    signal = SmoothStep(before, after, start, start + duration)
    curve = curve_of(signal)
    # The terms of the cubic are at most three times the rise, of a few roundings each.
    size = abs(before) + 3.0 * abs(after - before)
    assert curve.at(t) == pytest.approx(signal(t), rel=0.0, abs=1e-15 * 16.0 * size + 1e-300)
    assert curve.next_extremum(t) == signal.next_extremum(t)


def test_periods_below_the_resolution_of_the_time_come_to_an_end() -> None:
    curve = curve_of(Sine(0.0, 1.0, 1e18, 0.0))
    assert 10.0 < curve.next_extremum(10.0) < inf
    assert isinf(curve_of(Constant(1.0)).next_extremum(0.0))
