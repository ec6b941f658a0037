"""Designs: which combinations are run, in which order, and which are refused."""

from itertools import product

import numpy as np
import pytest
from scipy.stats import kstest

from frictionsim.errors import InputError
from frictionsim.parameter_study import design as designs
from frictionsim.parameter_study import values
from frictionsim.parameter_study.design import Design, Sampling, design_of
from frictionsim.parameter_study.values import values_of


def design(
    vary: dict[str, str], together: bool = False, sampling: Sampling | None = None
) -> Design:
    levels = {key: values_of(key, text) for key, text in vary.items()}
    return design_of(levels, together, sampling)


def test_a_grid_has_all_combinations_with_the_last_key_fastest() -> None:
    plan = design({"a": "[1, 2]", "b": "[3, 4, 5]", "c": "[6, 7]"})
    assert (plan.runs, plan.shape, plan.dimensions) == (12, (2, 3, 2), ("a", "b", "c"))
    assert plan.combinations(0, 12) == list(product([1, 2], [3, 4, 5], [6, 7]))
    assert plan.combinations(5, 7) == [(1, 5, 7), (2, 3, 6)]


def test_keys_are_walked_together_and_may_repeat_values() -> None:
    plan = design({"a": "[1, 2, 1]", "b": "[3, 4, 5]"}, together=True)
    assert (plan.runs, plan.dimensions) == (3, ("run",))
    assert plan.combinations(0, 3) == [(1, 3), (2, 4), (1, 5)]


def test_the_values_of_keys_that_are_walked_together_are_limited(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(designs, "MAX_RUNS", 6)
    assert design({"a": "lin(1, 3, 3)", "b": "lin(1, 3, 3)"}, together=True).runs == 3
    monkeypatch.delattr(values, "_evenly")  # they are not made
    with pytest.raises(InputError, match=r"zip: 2 keys x 4 runs = 8 values are more than"):
        design({"a": "lin(1, 4, 4)", "b": "lin(1, 4, 4)"}, together=True)


@pytest.mark.parametrize(("sampling", "runs"), [(Sampling(5), 5), (Sampling(2, indices=True), 8)])
def test_the_values_of_a_sample_are_limited_before_they_are_drawn(
    monkeypatch: pytest.MonkeyPatch, sampling: Sampling, runs: int
) -> None:
    vary = {"a": "uniform(2, 4)", "b": "normal(1, 3)"}
    monkeypatch.setattr(designs, "MAX_RUNS", 2 * runs)
    assert design(vary, sampling=sampling).runs == runs
    monkeypatch.setattr(designs, "MAX_RUNS", 2 * runs - 1)
    monkeypatch.delattr(designs, "_points")
    message = rf"sample: 2 keys x {runs} runs = {2 * runs} values are more than the limit"
    with pytest.raises(InputError, match=message):
        design(vary, sampling=sampling)


@pytest.mark.parametrize("method", ["sobol", "lhs", "random"])
def test_a_sample_has_the_distributions_and_no_correlation(method: str) -> None:
    vary = {"a": "uniform(2, 4)", "b": "normal(1, 3)"}
    plan = design(vary, sampling=Sampling(1024, method, seed=5))
    a, b = plan.levels
    # Of 1024 points at random, one sample in a thousand fails at this level.
    assert kstest((a - 2) / 2, "uniform").pvalue > 1e-3
    assert kstest((b - 1) / 3, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.1
    again = design(vary, sampling=Sampling(1024, method, seed=5))
    other = design(vary, sampling=Sampling(1024, method, seed=6))
    assert all(np.array_equal(x, y) for x, y in zip(plan.levels, again.levels, strict=True))
    assert not np.array_equal(plan.levels[0], other.levels[0])
    assert all(type(value) is float for value in plan.combinations(3, 4)[0])


def test_points_of_lhs_and_sobol_are_spread_evenly() -> None:
    for method in ("sobol", "lhs"):
        plan = design({"a": "uniform(0, 64)"}, sampling=Sampling(64, method))
        assert sorted(plan.levels[0].astype(int).tolist()) == list(range(64)), method


def test_the_design_of_sobol_indices() -> None:
    vary = {"a": "uniform(0, 1)", "b": "uniform(0, 1)", "c": "uniform(0, 1)"}
    plan = design(vary, sampling=Sampling(8, indices=True))
    assert plan.runs == 8 * 5
    points = np.array(plan.combinations(0, 40)).reshape(5, 8, 3)
    first, second = points[0], points[1]
    for key in range(3):
        mixed = points[2 + key]
        assert np.array_equal(mixed[:, key], second[:, key])
        others = [i for i in range(3) if i != key]
        assert np.array_equal(mixed[:, others], first[:, others])
    assert not np.isin(first, second).any()
