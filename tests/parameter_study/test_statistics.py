"""Statistics of samples against closed forms and SciPy; extremes, counts and groups of grids."""

import numpy as np
import pytest
from scipy import stats

from frictionsim.errors import InputError
from frictionsim.parameter_study.block import AUDIT_FAILED, DONE, FAILED, NOT_RUN
from frictionsim.parameter_study.design import Sampling
from frictionsim.parameter_study.statistics import (
    counts,
    extremes,
    grouped,
    sample_statistics,
    sound_values,
    statistics_of,
    variation,
    varied_values,
)
from tests.support.sweeps import grid_of, sample_of, with_outcomes

VARY = {"a": "normal(3.0, 0.5)", "b": "uniform(0.0, 2.0)"}


def test_statistics_are_those_of_scipy() -> None:
    values = np.random.default_rng(4).gamma(2.0, size=501)
    summary = statistics_of(np.concatenate((values, [np.nan, np.nan])))
    assert summary.runs == 501
    assert summary.mean == pytest.approx(stats.tmean(values), rel=1e-14)
    assert summary.deviation == pytest.approx(stats.tstd(values), rel=1e-13)
    quantiles = stats.mstats.mquantiles(values, (0.05, 0.5, 0.95), alphap=1.0, betap=1.0)
    assert (summary.low, summary.median, summary.high) == pytest.approx(tuple(quantiles), rel=1e-14)


def test_only_independent_runs_count_in_a_sample_with_indices() -> None:
    table = sample_of(VARY, {"a": lambda a, b: a}, Sampling(64, indices=True))
    assert table.runs == 256
    summary = sample_statistics(table)["a"]
    first = table.values["a"][:128]
    assert summary.runs == 128
    assert summary.mean == pytest.approx(first.mean(), rel=1e-15)
    assert summary.deviation == pytest.approx(first.std(ddof=1), rel=1e-15)


def test_runs_that_are_not_sound_do_not_count() -> None:
    table = sample_of(VARY, {"a": lambda a, b: a}, Sampling(16, "random"))
    table.values["a"][3] = np.nan
    table = with_outcomes(table, {0: FAILED, 1: AUDIT_FAILED, 2: NOT_RUN})
    kept = table.values["a"][4:]
    assert sample_statistics(table)["a"].runs == 12
    assert sample_statistics(table)["a"].mean == pytest.approx(kept.mean())
    assert np.isnan(sound_values(table, "a")[:4]).all()
    assert counts(table) == {NOT_RUN: 1, DONE: 13, FAILED: 1, AUDIT_FAILED: 1}


def test_a_quantity_of_one_run_has_no_deviation_and_of_none_no_statistics() -> None:
    assert np.isnan(statistics_of(np.array([2.0])).deviation)
    assert statistics_of(np.array([2.0])).median == 2.0
    none = statistics_of(np.array([np.nan]))
    assert none.runs == 0
    assert np.isnan(none.mean)


def test_extremes_of_a_grid_and_where_they_are() -> None:
    table = grid_of(
        {"a": [1.0, 2.0, 3.0], "b": [10.0, 20.0]},
        {"f": lambda a, b: a * b, "none": lambda a, b: np.nan},
    )
    # The largest one failed.
    rows = extremes(with_outcomes(table, {5: FAILED}))
    assert list(rows) == ["f"]
    assert rows["f"] == (5, 10.0, 0, 40.0, 3)
    assert varied_values(table, 3) == {"a": 2.0, "b": 20.0}
    together = grid_of({"a": [1.0, 2.0], "b": [5.0, 6.0]}, {"f": lambda a, b: a}, "zip")
    assert varied_values(together, 1) == {"a": 2.0, "b": 6.0}


def test_texts_that_differ_in_numbers_are_one_group() -> None:
    texts = {7: "stopped at t = 3.5e-2 s", 2: "stopped at t = 1 s\nsecond", 4: "other"}
    groups = grouped(texts)
    assert groups[0] == (2, 2, "stopped at t = 1 s")
    assert {group.text for group in groups[1:]} == {"second", "other"}
    assert grouped({}) == []


def test_a_study_that_does_not_describe_the_runs_is_refused() -> None:
    table = sample_of(VARY, {"a": lambda a, b: a}, Sampling(16))
    short = table._replace(status=table.status[:8])
    with pytest.raises(InputError, match="describes 16 runs, but it has 8"):
        variation(short)
    broken = table._replace(attributes=table.attributes | {"study": "[study"})
    with pytest.raises(InputError, match="cannot read the study in this sweep"):
        variation(broken)
    renamed = table._replace(coordinates={"c": table.coordinates["a"]})
    with pytest.raises(InputError, match="does not describe its runs"):
        variation(renamed)
