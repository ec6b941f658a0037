"""Designs: which combinations are run, in which order, and which are refused."""

import csv
import io
from itertools import product
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


def test_a_grid_has_all_combinations_with_the_last_key_fastest() -> None:
    sweep = run({LOAD: "[2000, 2100]", MU_S: "[0.2, 0.3, 0.25]", DAMPING: "[1, 2]"})
    assert dict(sweep.sizes) == {LOAD: 2, MU_S: 3, DAMPING: 2}
    assert sweep["status"].dims == (LOAD, MU_S, DAMPING)
    assert combinations_of(sweep, 3) == list(product([2000, 2100], [0.2, 0.3, 0.25], [1, 2]))


def test_keys_are_walked_together_and_may_repeat_values() -> None:
    sweep = run({LOAD: "[2000, 2100, 2000]", DAMPING: "[3, 4, 5]"}, zip=True)
    assert dict(sweep.sizes) == {"run": 3}
    assert combinations_of(sweep, 2) == [(2000, 3), (2100, 4), (2000, 5)]


@pytest.mark.parametrize("method", ["sobol", "lhs", "random"])
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
