"""The bracketing root finder."""

from math import exp, ulp

import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import StepUnderflow
from frictionsim.solvers.roots import bracket_root


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
