"""Statistics and Sobol indices of samples against closed forms and SciPy; extremes of grids.

Sobol indices are read from a picture of the sample.
"""

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy import stats

import frictionsim as fs
from frictionsim.io.sweep_table import from_stored
from frictionsim.sweeps.statistics import varying_quantities
from tests.support.sweep_files import LOAD, LOOSE, PULLEY
from tests.support.sweeps import (
    AUDIT_FAILED,
    FAILED,
    NOT_RUN,
    Function,
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


def test_true_and_false_are_no_numbers_when_they_are_run_and_when_they_are_read() -> None:
    """A quantity of a 0 or 1 in the unit of the key tells something: it is not the key."""
    table = grid_of({"a": [False, True]}, {"f": lambda a: 1.0 * a, "g": lambda a: 5.0 - a})
    (key,) = table.coordinates.values()
    read = key._replace(values=from_stored(key.stored))
    for coordinate in (key, read):
        assert not coordinate.is_number
        assert varying_quantities(table._replace(coordinates={"a": coordinate})) == ["f", "g"]


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


# --- Sobol indices ---------------------------------------------------------------------------

PI = repr(np.pi)
CUBE = dict.fromkeys(("x1", "x2", "x3"), f"uniform(-{PI}, {PI})")


def ishigami(x1: Any, x2: Any, x3: Any) -> Any:
    return np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def sample(rows: int, function: Function = ishigami) -> Any:
    return sample_of(CUBE, {"f": function}, Sampling(rows, indices=True))


class Drawn(NamedTuple):
    """The bars of the quantity by key, in the order of the keys, and what is written above."""

    first: Any
    total: Any
    first_interval: Any  # (keys, 2)
    total_interval: Any
    basis: str


def indices(table: Any) -> Drawn:
    """Return the indices of the quantity, of a picture."""
    panel: Any = fs.plot(fs.Sweep(table), "f").axes[1]
    if not panel.patches:
        (text,) = panel.texts
        return Drawn(*4 * (np.empty(0),), " ".join(text.get_text().split()))
    labels = [label.get_text() for label in panel.get_yticklabels()]
    order = [labels.index(key) for key in table.coordinates]
    widths = np.array([bar.get_width() for bar in panel.patches]).reshape(2, -1)[:, order]
    ends = [
        np.array([[x for x, _ in segment] for segment in lines.get_segments()])[order]
        for lines in panel.collections
    ]
    return Drawn(*widths, *ends, " ".join(panel.get_title(loc="left").split()))


def test_the_indices_of_ishigami() -> None:
    """Closed forms of Ishigami and Homma 1990."""
    a, b = 7.0, 0.1
    v1 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2
    v2, v13 = a**2 / 8.0, b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    first, total = (np.array(v) / (v1 + v2 + v13) for v in ((v1, v2, 0.0), (v1 + v13, v2, v13)))
    estimate = indices(sample(4096))
    np.testing.assert_allclose(estimate.first, first, atol=0.015)
    np.testing.assert_allclose(estimate.total, total, atol=0.015)
    assert estimate.basis == "from 4096 rows; 95 % confidence"
    for known, interval in ((first, estimate.first_interval), (total, estimate.total_interval)):
        assert (interval[:, 0] <= known).all()
        assert (known <= interval[:, 1]).all()
        assert (np.ptp(interval, axis=1) < 0.25).all()


def test_intervals_agree_with_those_of_scipy_and_are_always_the_same() -> None:
    table = sample(256)
    f_a, f_b, *f_ab = table.values["f"].reshape(5, 256)
    data = {"f_A": f_a[None], "f_B": f_b[None], "f_AB": np.array(f_ab)[:, None]}
    other = stats.sobol_indices(func=data, n=256).bootstrap(n_resamples=2000)
    estimate = indices(table)
    for ours, theirs in (
        (estimate.first_interval, other.first_order.confidence_interval),
        (estimate.total_interval, other.total_order.confidence_interval),
    ):
        wanted = np.stack((theirs.low, theirs.high), axis=-1)
        # SciPy corrects the bias, and draws other rows: at most 0.1 of a width.
        assert (np.abs(ours - wanted) < 0.3 * np.ptp(wanted, axis=1)[:, None]).all()
    np.testing.assert_array_equal(indices(table).total_interval, estimate.total_interval)


def test_a_constant_has_no_indices() -> None:
    rounding = 3.0 * (1.0 + np.finfo(float).eps)
    estimate = indices(sample(64, lambda *x: np.where(x[0] > 0.0, 3.0, rounding)))
    assert estimate.first.size == 0
    assert estimate.basis == "no Sobol indices: the quantity does not vary"


def test_rows_with_a_run_that_failed_are_left_out() -> None:
    table = sample(256)
    # Row 3 in A, row 5 in the third mixed sample; what such runs hold does not count.
    table.values["f"][[3, 4 * 256 + 5]] = 1e6
    table = with_outcomes(table, {3: FAILED, 4 * 256 + 5: FAILED})
    estimate = indices(table)
    assert estimate.basis.startswith("from 128 rows of 256")
    rows = [row for row in range(256) if row not in (3, 5)][:128]
    a, b, *mixed = table.values["f"].reshape(5, 256)[:, rows]
    variance = np.var(np.concatenate((a, b)))
    wanted = 0.5 * ((a - np.array(mixed)) ** 2).mean(axis=1) / variance
    np.testing.assert_allclose(estimate.total, wanted)
    assert "8 of 8 rows of the sample, which are fewer than 16" in indices(sample(8)).basis


def test_one_key_causes_all_of_the_variance() -> None:
    sweep = fs.sweep(PULLEY, {LOAD: "uniform(1900, 2100)"}, LOOSE, sample=32, indices=True)
    told = sweep.to_json()["sobol_indices"]["final_angle"]
    assert told["basis"] == "only one key is varied"
    assert (told["keys"][LOAD]["first"], told["keys"][LOAD]["total"]) == (1.0, 1.0)
