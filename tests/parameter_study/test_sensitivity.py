"""Sobol indices of functions whose indices are known."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from frictionsim.parameter_study.block import FAILED
from frictionsim.parameter_study.design import Sampling
from frictionsim.parameter_study.sensitivity import (
    SensitivityIndices,
    indices_from_blocks,
    indices_of,
)
from tests.support.cases import slow
from tests.support.sweeps import Function, sample_of, with_outcomes

PI = repr(np.pi)
CUBE = dict.fromkeys(("x1", "x2", "x3"), f"uniform(-{PI}, {PI})")
MIXED = {
    "a": "normal(3.0, 0.5)",
    "b": "lognormal(0.5, 0.2)",
    "c": "triangular(1.0, 1.5, 4.0)",
    "d": "uniform(-1.0, 3.0)",
}
SAMPLING = Sampling(2048, indices=True)


def ishigami(x1: Any, x2: Any, x3: Any) -> Any:
    return np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def indices(vary: dict[str, str], function: Function, sampling: Sampling) -> SensitivityIndices:
    return indices_of(sample_of(vary, {"f": function}, sampling), ["f"])["f"]


def indices_of_ishigami() -> tuple[Any, Any]:
    """Return first-order and total indices: closed forms of Ishigami and Homma 1990."""
    a, b = 7.0, 0.1
    v1 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    v2, v13 = a**2 / 8.0, b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    first, total = np.array([v1, v2, 0.0]), np.array([v1 + v13, v2, v13])
    return first / (v1 + v2 + v13), total / (v1 + v2 + v13)


def test_the_indices_of_ishigami() -> None:
    first, total = indices_of_ishigami()
    estimate = indices(CUBE, ishigami, Sampling(4096, indices=True))
    np.testing.assert_allclose(estimate.first, first, atol=0.015)
    np.testing.assert_allclose(estimate.total, total, atol=0.015)
    assert estimate.basis == "from 4096 rows; 95 % confidence"
    for known, interval in ((first, estimate.first_interval), (total, estimate.total_interval)):
        assert interval is not None
        assert (interval[:, 0] <= known).all()
        assert (known <= interval[:, 1]).all()
        assert (np.ptp(interval, axis=1) < 0.25).all()


@pytest.mark.parametrize(
    ("method", "least", "most"), [("random", 0.8, 1.3), slow("sobol", 1.3, 2.5)]
)
def test_intervals_are_those_of_independent_rows(method: str, least: float, most: float) -> None:
    first, total = indices_of_ishigami()
    known = np.concatenate((first, total))
    estimates, widths, holds = [], [], []
    for seed in range(100):
        estimate = indices(CUBE, ishigami, Sampling(256, method, seed, indices=True))
        assert estimate.first_interval is not None
        assert estimate.total_interval is not None
        low, high = np.concatenate((estimate.first_interval, estimate.total_interval)).T
        estimates.append(np.concatenate((estimate.first, estimate.total)))
        widths.append(high - low)
        holds.append((low <= known) & (known <= high))
    # 95 of 100, within four standard deviations of that number; skewed total indices a bit less.
    assert (np.mean(holds, axis=0) >= 0.86).all()
    # The scatter from 100 seeds has an error of 7 %.
    ratio = np.mean(widths, axis=0) / (2.0 * 1.96 * np.std(estimates, axis=0))
    assert (ratio > least).all()
    assert (ratio < most).all()


def test_intervals_agree_with_those_of_scipy() -> None:
    values = sample_of(CUBE, {"f": ishigami}, Sampling(256, indices=True)).values["f"]
    f_a, f_b, *f_ab = values.reshape(5, 256)
    data = {"f_A": f_a[None], "f_B": f_b[None], "f_AB": np.array(f_ab)[:, None]}
    other = stats.sobol_indices(func=data, n=256).bootstrap(n_resamples=2000)
    estimate = indices_from_blocks(tuple(CUBE), values.reshape(5, 256))
    for ours, theirs in (
        (estimate.first_interval, other.first_order.confidence_interval),
        (estimate.total_interval, other.total_order.confidence_interval),
    ):
        assert ours is not None
        wanted = np.stack((theirs.low, theirs.high), axis=-1)
        # SciPy corrects the bias, and draws other rows: at most 0.1 of a width.
        assert (np.abs(ours - wanted) < 0.3 * np.ptp(wanted, axis=1)[:, None]).all()


def moments(vary: dict[str, str]) -> tuple[Any, Any]:
    """Return means and variances of the keys, by SciPy's own quadrature."""
    frozen = {
        "a": stats.norm(3.0, 0.5),
        "b": stats.lognorm(0.2, scale=np.exp(0.5)),
        "c": stats.triang(0.5 / 3.0, loc=1.0, scale=3.0),
        "d": stats.uniform(-1.0, 4.0),
    }
    pairs = np.array([frozen[key].stats("mv") for key in vary])
    return pairs[:, 0], pairs[:, 1]


def test_the_indices_of_a_sum_are_the_parts_of_its_variance() -> None:
    factors = np.array([2.0, -1.0, 1.0, 0.3])
    estimate = indices(MIXED, lambda *x: factors @ np.array(x), SAMPLING)
    parts = factors**2 * moments(MIXED)[1]
    parts /= parts.sum()
    np.testing.assert_allclose(estimate.first, parts, atol=0.03)
    np.testing.assert_allclose(estimate.total, parts, atol=0.03)


@pytest.mark.parametrize("sampling", [Sampling(64, indices=True), Sampling(64)])
def test_a_constant_has_no_indices(sampling: Sampling) -> None:
    rounding = 3.0 * (1.0 + np.finfo(float).eps)
    for function in (lambda *x: 3.0 + 0.0 * x[0], lambda *x: np.where(x[0] > 3.0, 3.0, rounding)):
        estimate = indices(MIXED, function, sampling)
        assert estimate.first.size == 0
        assert estimate.basis == "no Sobol indices: the quantity does not vary"


def test_rows_with_a_run_that_failed_are_left_out() -> None:
    table = sample_of(CUBE, {"f": ishigami}, Sampling(256, indices=True))
    # Row 3 in A, row 5 in the third mixed sample; what such runs hold does not count.
    table.values["f"][[3, 4 * 256 + 5]] = 1e6
    table = with_outcomes(table, {3: FAILED, 4 * 256 + 5: FAILED})
    estimate = indices_of(table, ["f"])["f"]
    assert estimate.basis.startswith("from 128 rows of 256")
    rows = [row for row in range(256) if row not in (3, 5)][:128]
    blocks = table.values["f"].reshape(5, 256)[:, rows]
    a, b, mixed = blocks[0], blocks[1], blocks[2:]
    variance = np.var(np.concatenate((a, b)))
    np.testing.assert_allclose(estimate.total, 0.5 * ((a - mixed) ** 2).mean(axis=1) / variance)


def test_too_few_rows_give_no_indices() -> None:
    estimate = indices(CUBE, ishigami, Sampling(8, indices=True))
    assert "8 of 8 rows of the sample, which are fewer than 16" in estimate.basis


def test_one_key_causes_all_of_the_variance() -> None:
    estimate = indices({"a": "uniform(0.0, 1.0)"}, lambda a: a**2, Sampling(32, indices=True))
    assert estimate.first.tolist() == estimate.total.tolist() == [1.0]
    assert estimate.basis == "only one key is varied"


def test_the_same_sample_gives_the_same_intervals() -> None:
    estimates = [indices(CUBE, ishigami, Sampling(64, indices=True)) for _ in range(2)]
    np.testing.assert_array_equal(estimates[0].total_interval, estimates[1].total_interval)
