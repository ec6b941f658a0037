"""Statistics of samples against closed forms and SciPy; extremes, counts and groups of grids."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

import frictionsim as fs
from tests.support.sweeps import (
    AUDIT_FAILED,
    FAILED,
    NOT_RUN,
    Sampling,
    grid_of,
    sample_of,
    with_outcomes,
)

VARY = {"a": "normal(3.0, 0.5)", "b": "uniform(0.0, 2.0)"}
NONE = {"runs": 0, "mean": None, "standard_deviation": None}


def quantities_of(table: Any) -> Any:
    return fs.Sweep(table).to_json()["quantities"]


def test_statistics_are_those_of_scipy() -> None:
    values = np.random.default_rng(4).gamma(2.0, size=501)
    column = np.concatenate((values, [np.nan, np.nan]))
    sampling = Sampling(503, "random")
    told = quantities_of(sample_of(VARY, {"f": lambda a, b: column}, sampling))["f"]
    assert told["runs"] == 501
    assert told["mean"] == pytest.approx(stats.tmean(values), rel=1e-14)
    assert told["standard_deviation"] == pytest.approx(stats.tstd(values), rel=1e-13)
    quantiles = stats.mstats.mquantiles(values, (0.05, 0.5, 0.95), alphap=1.0, betap=1.0)
    found = [told[f"quantile_{percent}"] for percent in (5, 50, 95)]
    assert found == pytest.approx(quantiles.tolist(), rel=1e-14)


def test_only_independent_runs_count_in_a_sample_with_indices() -> None:
    table = sample_of(VARY, {"f": lambda a, b: a}, Sampling(64, indices=True))
    told = fs.Sweep(table).to_json()
    assert (told["runs"]["all"], told["independent_runs"]) == (256, 128)
    first = table.values["f"][:128]
    assert told["quantities"]["f"]["runs"] == 128
    assert told["quantities"]["f"]["mean"] == pytest.approx(first.mean(), rel=1e-15)
    deviation = told["quantities"]["f"]["standard_deviation"]
    assert deviation == pytest.approx(first.std(ddof=1), rel=1e-15)


def test_runs_that_are_not_sound_do_not_count() -> None:
    table = sample_of(VARY, {"f": lambda a, b: a}, Sampling(16, "random"))
    table.values["f"][3] = np.nan
    table = with_outcomes(table, {0: FAILED, 1: AUDIT_FAILED, 2: NOT_RUN})
    kept = table.values["f"][4:]
    told = fs.Sweep(table).to_json()
    assert told["quantities"]["f"]["runs"] == 12
    assert told["quantities"]["f"]["mean"] == pytest.approx(kept.mean())
    counted = {"all": 16, "not_run": 1, "done": 13, "failed": 1, "audit_failed": 1}
    assert told["runs"] == counted


def test_a_quantity_of_one_run_has_no_deviation_and_of_none_no_statistics() -> None:
    functions = {"one": lambda a, b: 2.0, "none": lambda a, b: np.nan}
    told = quantities_of(sample_of(VARY, functions, Sampling(1, "random")))
    assert told["one"]["standard_deviation"] is None
    assert told["one"]["quantile_50"] == 2.0
    assert told["none"].items() >= NONE.items()


def test_extremes_of_a_grid_and_where_they_are() -> None:
    table = grid_of(
        {"a": [1.0, 2.0, 3.0], "b": [10.0, 20.0]},
        {"f": lambda a, b: a * b, "none": lambda a, b: np.nan},
    )
    # The largest one failed.
    told = quantities_of(with_outcomes(table, {5: FAILED}))
    assert told["f"]["runs"] == 5
    assert told["f"]["least"] == {"value": 10.0, "run": 0, "at": {"a": 1.0, "b": 10.0}}
    assert told["f"]["largest"] == {"value": 40.0, "run": 3, "at": {"a": 2.0, "b": 20.0}}
    assert told["none"]["runs"] == 0
    assert told["none"]["least"] == told["none"]["largest"]
    assert told["none"]["least"] == {"value": None, "run": None, "at": None}
    together = grid_of({"a": [1.0, 2.0], "b": [5.0, 6.0]}, {"f": lambda a, b: a}, "zip")
    assert quantities_of(together)["f"]["largest"]["at"] == {"a": 2.0, "b": 6.0}


def test_texts_that_differ_in_numbers_are_one_group() -> None:
    table = grid_of({"a": [float(i) for i in range(8)]}, {"f": lambda a: a})
    assert fs.Sweep(table).to_json()["warnings"] == []
    texts = {2: "stopped at t = 1 s\nsecond", 4: "other", 7: "stopped at t = 3.5e-2 s"}
    table.texts["warnings"].update(texts)
    first, *others = fs.Sweep(table).to_json()["warnings"]
    assert first == {"runs": 2, "first_run": 2, "text": "stopped at t = 1 s"}
    assert {group["text"] for group in others} == {"second", "other"}


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("sample = 16", "sample = 8", "describes 8 runs, but it has 16"),
        ("[study]", "[study", "cannot read the study in this sweep"),
    ],
)
def test_a_study_that_does_not_describe_the_runs_is_refused(old: str, new: str, told: str) -> None:
    table = sample_of(VARY, {"f": lambda a, b: a}, Sampling(16))
    study = table.attributes["study"].replace(old, new)
    changed = table._replace(attributes=table.attributes | {"study": study})
    with pytest.raises(fs.InputError, match=told):
        fs.Sweep(changed).summary()
