"""Values of a key, and designs: which combinations are run, in which order."""

import csv
import io
from fractions import Fraction
from itertools import product
from math import erf, log, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

import frictionsim as fs
from tests.support.sweep_files import LOAD, MU_S, PULLEY, planned

SHORT = {"solver.duration": 1e-3}
DAMPING = "effects.viscous_damping.coefficient"


def run(vary: dict[str, Any], **options: Any) -> fs.Sweep:
    return fs.sweep(PULLEY, vary, SHORT, workers=1, **options)


def combinations_of(sweep: fs.Sweep, keys: int) -> list[tuple[float, ...]]:
    """Return the values of the keys in the order of the runs, as its table in CSV has them."""
    with TemporaryDirectory() as folder:
        text = sweep.save_csv(Path(folder) / "runs.csv").read_text()
    _, *rows = csv.reader(io.StringIO(text))
    return [tuple(map(float, row[1 : 1 + keys])) for row in rows]


def drawn(vary: dict[str, str], **options: Any) -> tuple[Any, ...]:
    """Return the values of the keys of a sample."""
    sweep = planned(vary, SHORT, **options)
    return tuple(sweep[key].values for key in vary)


# --- values ----------------------------------------------------------------------------------


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
    assert levels("log(0.01, 1.0, 3)") == (0.01, 0.1, 1.0)
    assert levels("lin(-1, -1, 1)") == (-1,)
    assert levels("lin(1e-1000000000, 1, 5)") == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert levels(" lin( 3 , 1 , 3 ) ") == (3, 2, 1)
    # Whole numbers stay whole: such a key takes no others.
    assert levels("lin(100, 300, 3)", STEPS) == (100, 200, 300)
    assert levels("log(20, 160, 4)", STEPS) == (20, 40, 80, 160)
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


# --- combinations ----------------------------------------------------------------------------


def test_a_grid_has_all_combinations_with_the_last_key_fastest() -> None:
    sweep = run({LOAD: "[2000, 2100]", MU_S: "[0.2, 0.3, 0.25]", DAMPING: "[1, 2]"})
    assert dict(sweep.sizes) == {LOAD: 2, MU_S: 3, DAMPING: 2}
    assert sweep["status"].dims == (LOAD, MU_S, DAMPING)
    assert combinations_of(sweep, 3) == list(product([2000, 2100], [0.2, 0.3, 0.25], [1, 2]))


def test_keys_are_walked_together_and_may_repeat_values() -> None:
    sweep = run({LOAD: "[2000, 2100, 2000]", DAMPING: "[3, 4, 5]"}, zip=True)
    assert dict(sweep.sizes) == {"run": 3}
    assert combinations_of(sweep, 2) == [(2000, 3), (2100, 4), (2000, 5)]


@pytest.mark.parametrize("method", ["sobol", "random"])
def test_a_sample_has_the_distributions_and_no_correlation(method: str) -> None:
    vary = {LOAD: "uniform(2000, 4000)", DAMPING: "normal(10, 1)"}
    a, b = drawn(vary, sample=1024, method=method, seed=5)
    # Of 1024 points at random, one sample in a thousand fails at this level.
    assert kstest((a - 2000) / 2000, "uniform").pvalue > 1e-3
    assert kstest(b - 10, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.1
    again = drawn(vary, sample=1024, method=method, seed=5)
    other = drawn(vary, sample=1024, method=method, seed=6)
    assert all(np.array_equal(x, y) for x, y in zip((a, b), again, strict=True))
    assert not np.array_equal(a, other[0])


def test_the_design_of_sobol_indices() -> None:
    vary = {LOAD: "uniform(2000, 2100)", DAMPING: "uniform(1, 2)", MU_S: "uniform(0.2, 0.3)"}
    sweep = run(vary, sample=8, indices=True)
    assert sweep.sizes["run"] == 8 * 5
    points = np.array(combinations_of(sweep, 3)).reshape(5, 8, 3)
    first, second = points[0], points[1]
    for key in range(3):
        mixed = points[2 + key]
        assert np.array_equal(mixed[:, key], second[:, key])
        others = [i for i in range(3) if i != key]
        assert np.array_equal(mixed[:, others], first[:, others])
    assert not np.isin(first, second).any()
