"""Sobol indices: the part of a quantity's variance that each varied key causes.

The first-order index of a key is its part alone, the total index its part with all interactions.
They are computed from the samples A, B and A with one column of B that a sweep runs with `indices`:
the estimators of Saltelli et al. 2010 as in SciPy, with 95 % intervals from its bootstrap over the
rows. The bootstrap assumes independent rows. Those of a Sobol sequence are spread more evenly, so
that the intervals are too wide. A row counts if the quantity is defined in all its runs; SciPy
requires a power of two of them. Any other sample has no indices.

Reference
---------
A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics
Communications 181, 2010.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_table import SOBOL, SobolIndices, SweepTable
from frictionsim.sweeps.design import Sampling
from frictionsim.sweeps.statistics import sound_values, variation

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Array

MIN_ROWS = 16  # of A and B, below which the estimates are meaningless
ROUNDING = 1e-12  # relative variation below which a quantity is constant
RESAMPLES, CONFIDENCE = 999, 0.95
SEED = 0  # of the bootstrap: the same sample gives the same file and the same picture
MAX_DRAWN = 10_000_000  # numbers of the bootstrap in memory at a time


class SensitivityIndices(NamedTuple):
    """The Sobol indices of a quantity, or the reason why there are none."""

    keys: tuple[str, ...]
    first: "Array"  # (keys,); empty if there are none, like the total indices
    total: "Array"
    basis: str  # the data of the indices, or why there are none
    first_interval: "Array | None" = None  # (keys, 2), of 95 % confidence; None if not known
    total_interval: "Array | None" = None


def indices_of(table: SweepTable, names: list[str]) -> dict[str, SensitivityIndices]:
    """Return the Sobol indices of some quantities of a sample."""
    distributions, sampling = variation(table)
    if sampling is None:
        return {name: _no_indices(tuple(table.coordinates), "not a sample") for name in names}
    keys = tuple(distributions)
    return {name: _indices_from_values(sound_values(table, name), keys, sampling) for name in names}


def sobol_indices_of(table: SweepTable) -> SobolIndices | None:
    """Return the indices of all quantities of a sample with `indices`; None of another sweep."""
    sampling = variation(table)[1]
    if sampling is None or not sampling.indices:
        return None
    by_name = indices_of(table, list(table.values))
    keys = list(table.coordinates)
    unknown = np.full(len(keys), np.nan)
    columns: dict[str, list[Array]] = {name: [] for name in SOBOL}
    for indices in by_name.values():
        for name, values, interval in (
            ("sobol_first", indices.first, indices.first_interval),
            ("sobol_total", indices.total, indices.total_interval),
        ):
            low, high = (unknown, unknown) if interval is None else interval.T
            columns[name].append(values if values.size else unknown)
            columns[f"{name}_low"].append(low)
            columns[f"{name}_high"].append(high)
    return SobolIndices(
        quantities=list(by_name),
        keys=keys,
        basis=[indices.basis for indices in by_name.values()],
        columns={n: np.array(rows).reshape(len(by_name), len(keys)) for n, rows in columns.items()},
    )


def _no_indices(keys: tuple[str, ...], why: str) -> SensitivityIndices:
    return SensitivityIndices(keys, np.empty(0), np.empty(0), why)


def _indices_from_values(
    values: "Array", keys: tuple[str, ...], sampling: Sampling
) -> SensitivityIndices:
    defined = values[~np.isnan(values)]
    if not defined.size:
        return _no_indices(keys, "no Sobol indices: the quantity is not defined in any run")
    if np.ptp(defined) <= ROUNDING * np.abs(defined).max():
        return _no_indices(keys, "no Sobol indices: the quantity does not vary")
    if len(keys) == 1:
        return SensitivityIndices(keys, np.ones(1), np.ones(1), "only one key is varied")
    if not sampling.indices:
        return _no_indices(keys, "no Sobol indices: they need a sweep with 'indices'")
    return indices_from_blocks(keys, values.reshape(len(keys) + 2, sampling.runs))


def indices_from_blocks(keys: tuple[str, ...], blocks: "Array") -> SensitivityIndices:
    """Return the indices of at least two keys.

    `blocks`, (keys + 2, n), are the values in the samples A, B and A with one column of B.
    """
    from scipy.stats import sobol_indices

    complete = np.flatnonzero(~np.isnan(blocks).any(axis=0))
    used = 1 << (complete.size.bit_length() - 1) if complete.size else 0
    rows = blocks.shape[1]
    if used < MIN_ROWS:
        return _no_indices(
            keys,
            f"no Sobol indices: the quantity is defined in all runs of {complete.size} of {rows}"
            f" rows of the sample, which are fewer than {MIN_ROWS}",
        )
    f = blocks[:, complete[:used]]
    f_a, f_b, f_ab = f[0], f[1], f[2:]
    if np.ptp(f[:2]) <= ROUNDING * np.abs(f[:2]).max():
        return _no_indices(keys, "no Sobol indices: the quantity does not vary")
    data = {"f_A": f_a[None, :], "f_B": f_b[None, :], "f_AB": f_ab[:, None, :]}
    estimate: Any = sobol_indices(func=data, n=used)
    first, total = _bootstrap(f_a, f_b, f_ab)
    row_note = "" if used == rows else f" of {rows}: a power of two of those without undefined runs"
    basis = f"from {used} rows{row_note}; 95 % confidence"
    return SensitivityIndices(keys, estimate.first_order, estimate.total_order, basis, first, total)


def _bootstrap(f_a: "Array", f_b: "Array", f_ab: "Array") -> "tuple[Array, Array]":
    """Return the intervals of the indices, (keys, 2) each: percentiles of SciPy's bootstrap.

    The bootstrap of `scipy.stats.sobol_indices` draws other rows at each call, and its correction
    of bias omits each row in turn, in a time proportional to the square of their number.
    """
    from scipy.stats import bootstrap

    mean = 0.5 * (f_a.mean() + f_b.mean())
    f_a, f_b, f_ab = f_a - mean, f_b - mean, f_ab - mean
    count = f_a.size
    terms = np.vstack(
        (
            f_b * (f_ab - f_a),
            0.5 * (f_a - f_ab) ** 2,
            0.5 * (f_a + f_b),
            0.5 * (f_a**2 + f_b**2),
        )
    )

    def indices(rows: "npt.NDArray[np.int64]", axis: int) -> "Array":
        means = terms[:, rows].mean(axis=axis)
        variance = means[-1] - means[-2] ** 2
        return np.asarray(means[:-2] / np.where(variance > 0.0, variance, np.nan))

    result: Any = bootstrap(
        (np.arange(count),),
        indices,
        n_resamples=RESAMPLES,
        batch=max(1, MAX_DRAWN // terms.size),
        vectorized=True,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(SEED),
    )
    bounds = np.stack(result.confidence_interval, axis=-1)
    keys = len(f_ab)
    return bounds[:keys], bounds[keys:]
