"""Sobol indices of functions whose indices are known, as a picture of the sample shows them."""

from typing import Any, NamedTuple

import numpy as np
from scipy import stats

import frictionsim as fs
from tests.support.sweep_files import LOAD, LOOSE, PULLEY
from tests.support.sweeps import FAILED, Function, Sampling, sample_of, with_outcomes

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


class Drawn(NamedTuple):
    """The bars of a quantity by key, in the order of the keys, and what is written above."""

    first: Any
    total: Any
    first_interval: Any  # (keys, 2)
    total_interval: Any
    basis: str


def drawn_indices(table: Any, names: list[str]) -> list[Drawn]:
    """Return the indices of some quantities, of a picture."""
    panels = fs.plot(fs.Sweep(table), ",".join(names)).axes[1::2]
    return [_drawn(panel, list(table.coordinates)) for panel in panels]


def _drawn(panel: Any, keys: list[str]) -> Drawn:
    if not panel.patches:
        (text,) = panel.texts
        return Drawn(*4 * (np.empty(0),), " ".join(text.get_text().split()))
    order = [[label.get_text() for label in panel.get_yticklabels()].index(key) for key in keys]
    widths = np.array([bar.get_width() for bar in panel.patches]).reshape(2, -1)[:, order]
    ends = [
        np.array([[x for x, _ in segment] for segment in lines.get_segments()])[order]
        for lines in panel.collections
    ]
    return Drawn(*widths, *ends, " ".join(panel.get_title(loc="left").split()))


def indices(vary: dict[str, str], function: Function, sampling: Sampling) -> Drawn:
    return drawn_indices(sample_of(vary, {"f": function}, sampling), ["f"])[0]


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
        assert (interval[:, 0] <= known).all()
        assert (known <= interval[:, 1]).all()
        assert (np.ptp(interval, axis=1) < 0.25).all()


def test_intervals_agree_with_those_of_scipy() -> None:
    table = sample_of(CUBE, {"f": ishigami}, Sampling(256, indices=True))
    values = table.values["f"]
    f_a, f_b, *f_ab = values.reshape(5, 256)
    data = {"f_A": f_a[None], "f_B": f_b[None], "f_AB": np.array(f_ab)[:, None]}
    other = stats.sobol_indices(func=data, n=256).bootstrap(n_resamples=2000)
    (estimate,) = drawn_indices(table, ["f"])
    for ours, theirs in (
        (estimate.first_interval, other.first_order.confidence_interval),
        (estimate.total_interval, other.total_order.confidence_interval),
    ):
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


def test_a_constant_has_no_indices() -> None:
    rounding = 3.0 * (1.0 + np.finfo(float).eps)
    for function in (lambda *x: 3.0 + 0.0 * x[0], lambda *x: np.where(x[0] > 3.0, 3.0, rounding)):
        estimate = indices(MIXED, function, Sampling(64, indices=True))
        assert estimate.first.size == 0
        assert estimate.basis == "no Sobol indices: the quantity does not vary"


def test_rows_with_a_run_that_failed_are_left_out() -> None:
    table = sample_of(CUBE, {"f": ishigami}, Sampling(256, indices=True))
    # Row 3 in A, row 5 in the third mixed sample; what such runs hold does not count.
    table.values["f"][[3, 4 * 256 + 5]] = 1e6
    table = with_outcomes(table, {3: FAILED, 4 * 256 + 5: FAILED})
    (estimate,) = drawn_indices(table, ["f"])
    assert estimate.basis.startswith("from 128 rows of 256")
    rows = [row for row in range(256) if row not in (3, 5)][:128]
    blocks = table.values["f"].reshape(5, 256)[:, rows]
    a, b, mixed = blocks[0], blocks[1], blocks[2:]
    variance = np.var(np.concatenate((a, b)))
    np.testing.assert_allclose(estimate.total, 0.5 * ((a - mixed) ** 2).mean(axis=1) / variance)


def test_one_key_causes_all_of_the_variance() -> None:
    sweep = fs.sweep(PULLEY, {LOAD: "uniform(1900, 2100)"}, LOOSE, sample=32, indices=True)
    told = sweep.to_json()["sobol_indices"]["final_angle"]
    assert told["basis"] == "only one key is varied"
    assert (told["keys"][LOAD]["first"], told["keys"][LOAD]["total"]) == (1.0, 1.0)
