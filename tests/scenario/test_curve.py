"""A signal as numbers has the values of the signal."""

from math import inf, isinf
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.mechanisms.extension import curve_of
from tests.scenario.test_signals import signal

NUMBER = st.floats(-1e3, 1e3)
POSITIVE = st.floats(1e-3, 1e3)


@st.composite
def linear(draw: Any) -> dict[str, Any]:
    times = sorted(draw(st.sets(st.floats(0.0, 10.0), min_size=1, max_size=6)))
    return {"time": times, "value": [draw(NUMBER) for _ in times]}


EXACT = st.one_of(
    NUMBER,
    linear(),
    st.fixed_dictionaries(
        {
            "mean": NUMBER,
            "amplitude": POSITIVE,
            "frequency_hz": POSITIVE,
            "phase_deg": st.floats(-400.0, 400.0),
        }
    ).map(lambda sine: {"sine": sine}),
)


@given(EXACT, st.floats(0.0, 12.0))
def test_the_bits_are_those_of_the_signal(table: Any, t: float) -> None:
    force = signal(table)
    curve = curve_of(force)
    assert curve.at(t) == force(t)
    assert curve.next_extremum(t) == force.next_extremum(t)


@given(NUMBER, NUMBER, st.floats(0.0, 5.0), POSITIVE, st.floats(0.0, 12.0))
def test_a_smooth_step_is_a_cubic(
    before: float, after: float, start: float, duration: float, t: float
) -> None:
    step = {"from": before, "to": after, "start": start, "stop": start + duration}
    force = signal({"smooth_step": step})
    curve = curve_of(force)
    # The terms of the cubic are at most three times the rise, of a few roundings each.
    size = abs(before) + 3.0 * abs(after - before)
    assert curve.at(t) == pytest.approx(force(t), rel=0.0, abs=1e-15 * 16.0 * size + 1e-300)
    assert curve.next_extremum(t) == force.next_extremum(t)


def test_periods_below_the_resolution_of_the_time_come_to_an_end() -> None:
    curve = curve_of(signal({"sine": {"amplitude": 1.0, "frequency_hz": 1.6e17}}))
    assert 10.0 < curve.next_extremum(10.0) < inf
    assert isinf(curve_of(signal(1.0)).next_extremum(0.0))
