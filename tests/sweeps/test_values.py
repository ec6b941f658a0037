"""Values of a key: lists, ranges and distributions, and refusals."""

from fractions import Fraction
from math import erf, log, sqrt
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.sweep_files import planned

SPEED = "mechanism.initial_angular_velocity"  # which may be any number
STEPS = "solver.max_steps"  # a whole number without a unit


def values_of(given: object, key: str = SPEED, **options: Any) -> Any:
    """Return the values of a key in the runs of a sweep."""
    return planned({key: given}, {"solver.duration": 1e-3}, **options)[key].values


def levels(given: object, key: str = SPEED) -> tuple[object, ...]:
    """Return the values of a list or range, which may be given twice."""
    return tuple(values_of(given, key, zip=True).tolist())


def test_a_list_gives_its_values() -> None:
    assert levels("[0.1, 0.2]") == (0.1, 0.2)
    assert levels('["events", "rkf45"]', "solver.backend") == ("events", "rkf45")
    assert levels(np.array([1.0, 2.0])) == (1.0, 2.0)
    assert levels((1, 2), STEPS) == (1, 2)
    assert levels(range(1, 4), STEPS) == (1, 2, 3)
    two = "[[1.0, 2.0], [3.0, 4.0]]"
    assert levels(two, "drive.force.value") == ("[1.0, 2.0]", "[3.0, 4.0]")


def test_a_range_gives_numbers_apart_by_a_step_or_a_factor() -> None:
    assert levels("lin(1, 2, 5)") == (1.0, 1.25, 1.5, 1.75, 2.0)
    assert levels("log(0.01, 1.0, 3)") == (0.01, pytest.approx(0.1, rel=1e-15), 1.0)
    assert levels("lin(-1, -1, 1)") == (-1,)
    assert levels("lin(1e-1000000000, 1, 5)") == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert levels(" lin( 3 , 1 , 3 ) ") == (3, 2, 1)
    # Whole numbers stay whole: such a key takes no others.
    assert levels("lin(100, 300, 3)", STEPS) == (100, 200, 300)
    with pytest.raises(fs.InputError, match=r"max_steps=100\.0 is not valid"):
        levels("lin(100.0, 300.0, 3)", STEPS)


def test_the_numbers_of_a_range_are_nearest_to_its_decimal_numbers() -> None:
    assert levels("lin(0.1, 0.4, 31)")[1] == 0.11
    for text in ("0.12345678901234567", "0.12345678901234561", "1.000000000000000099e-3"):
        exact = (Fraction(text) + Fraction(1, 5)) / 2
        assert levels(f"lin({text}, 0.2, 3)")[1] == float(exact)
    assert levels(f"lin(1.{'1' * 5000}, 2, 2)") == (float(f"1.{'1' * 20}"), 2.0)


# Cumulated probabilities in closed form.
CUMULATED = {
    "uniform(2, 5)": lambda x: (x - 2.0) / 3.0,
    "triangular(0, 1, 4)": lambda x: x**2 / 4.0 if x < 1.0 else 1.0 - (4.0 - x) ** 2 / 12.0,
    "normal(3, 2)": lambda x: 0.5 * (1.0 + erf((x - 3.0) / 2.0 / sqrt(2.0))),
    "lognormal(0.5, 0.25)": lambda x: 0.5 * (1.0 + erf((log(x) - 0.5) / 0.25 / sqrt(2.0))),
}


@pytest.mark.parametrize("text", CUMULATED)
def test_one_value_of_a_sample_lies_in_each_part_of_equal_probability(text: str) -> None:
    values = values_of(text, sample=32, method="lhs")
    probabilities = np.sort([CUMULATED[text](x) for x in values.tolist()])
    assert (32.0 * probabilities).astype(int).tolist() == list(range(32))
