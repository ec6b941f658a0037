"""Values of a key: lists, ranges and distributions, and refusals."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from frictionsim.parameter_study.values import Distribution, Levels, values_of

KEY = "mechanism.load"


def levels(given: object) -> tuple[object, ...]:
    values = values_of(KEY, given)
    assert isinstance(values, Levels)
    return values.values


def test_a_list_gives_its_values() -> None:
    assert levels("[0.1, 0.2]") == (0.1, 0.2)
    assert levels('["events", "rkf45"]') == ("events", "rkf45")
    assert levels(np.array([1.0, 2.0])) == (1.0, 2.0)
    assert levels((1, 2)) == (1, 2)
    assert levels(range(3)) == (0, 1, 2)
    assert levels("[[1.0, 2.0], [3.0, 4.0]]") == ([1.0, 2.0], [3.0, 4.0])


def test_a_range_gives_numbers_apart_by_a_step_or_a_factor() -> None:
    assert levels("lin(1, 2, 5)") == (1.0, 1.25, 1.5, 1.75, 2.0)
    assert levels("log(0.01, 1.0, 3)") == (0.01, pytest.approx(0.1, rel=1e-15), 1.0)
    assert levels("lin(-1, 1.5, 1)".replace("1.5", "-1")) == (-1,)
    assert levels(" lin( 3 , 1 , 3 ) ") == (3, 2, 1)
    assert all(type(value) is int for value in levels("lin(100, 300, 3)"))
    assert all(type(value) is float for value in levels("lin(100.0, 300.0, 3)"))


@given(
    st.floats(-1e6, 1e6, allow_nan=False), st.floats(-1e6, 1e6, allow_nan=False), st.integers(2, 50)
)
@example(0.0, 2.2250738585e-313, 5)
def test_a_range_begins_and_ends_with_the_given_numbers(a: float, b: float, n: int) -> None:
    numbers = np.array(levels(f"lin({a!r}, {b!r}, {n})"))
    assert (numbers[0], numbers[-1], len(numbers)) == (a, b, n)
    steps = np.diff(numbers)
    # Each step is a difference of numbers of this size, rounded; tiny ones to the least number.
    rounding = np.finfo(float).eps * max(abs(a), abs(b)) + np.finfo(float).smallest_subnormal
    assert np.ptp(steps) <= 8 * rounding


@pytest.mark.parametrize(
    "zero", ["1e-1000000000", "-1e-1000000000", "0e1000000000", "0e-1000000000", f"0.{'0' * 5000}"]
)
def test_a_range_ends_at_a_number_that_has_no_fraction_of_a_usable_size(zero: str) -> None:
    assert levels(f"lin({zero}, 1, 5)") == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert levels(f"lin(1, {zero}, 2)") == (1.0, 0.0)


def test_the_numbers_of_a_range_are_nearest_to_its_decimal_numbers() -> None:
    assert levels("lin(0.1, 0.4, 31)")[1] == 0.11
    for text in ("0.12345678901234567", "0.12345678901234561", "1.000000000000000099e-3"):
        exact = (Fraction(text) + Fraction(1, 5)) / 2
        assert levels(f"lin({text}, 0.2, 3)")[1] == float(exact)
    assert levels(f"lin(1.{'1' * 5000}, 2, 2)") == (float(f"1.{'1' * 20}"), 2.0)


# Closed forms of mean, variance and cumulated probability.
CLOSED = [
    ("uniform(2, 5)", 3.5, 0.75, lambda x: (x - 2) / 3),
    ("triangular(0, 1, 4)", 5 / 3, (16 + 1 - 4) / 18, lambda x: 1 - (4 - x) ** 2 / 12),
    ("normal(3, 2)", 3.0, 4.0, None),
    (
        "lognormal(0.5, 0.25)",
        np.exp(0.5 + 0.25**2 / 2),
        (np.exp(0.25**2) - 1) * np.exp(1 + 0.25**2),
        None,
    ),
]


@pytest.mark.parametrize(("text", "mean", "variance", "cumulated"), CLOSED)
def test_distributions_have_their_moments(
    text: str, mean: float, variance: float, cumulated: object
) -> None:
    distribution = values_of(KEY, text)
    assert isinstance(distribution, Distribution)
    # Midpoints of equal probabilities: the error of the tails of 1e5 points is below 1e-3.
    p = (np.arange(100_000) + 0.5) / 100_000
    x = distribution.quantiles(p)
    assert np.mean(x) == pytest.approx(mean, rel=1e-3)
    assert np.var(x) == pytest.approx(variance, rel=1e-3)
    if callable(cumulated):
        upper = p > 0.5
        assert cumulated(x[upper]) == pytest.approx(p[upper], abs=1e-12)


def test_no_quantile_is_infinite() -> None:
    for text in ("normal(0, 1)", "lognormal(0, 1)"):
        distribution = values_of(KEY, text)
        assert isinstance(distribution, Distribution)
        assert np.isfinite(distribution.quantiles(np.array([0.0, 1.0]))).all()
