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

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.io.sweep_table import SOBOL, SobolIndices, SweepTable
from frictionsim.sweeps.statistics import sound_values, variation

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Array

MIN_ROWS = 16  # of A and B, below which the estimates are meaningless
ROUNDING = 1e-12  # relative variation below which a quantity is constant
RESAMPLES, CONFIDENCE = 999, 0.95
SEED = 0  # of the bootstrap: the same sample gives the same file and the same picture
MAX_DRAWN = 10_000_000  # numbers of the bootstrap in memory at a time


def indices_of(table: SweepTable, names: Iterable[str]) -> dict[str, SobolIndices]:
    """Return the Sobol indices of some quantities of a sample, by quantity."""
    sampling = variation(table)[1]
    keys, has_rows = len(table.coordinates), sampling is not None and sampling.indices
    return {name: _indices(sound_values(table, name), keys, has_rows) for name in names}


def _indices(values: "Array", keys: int, has_rows: bool) -> SobolIndices:
    if not (~np.isnan(values)).any():
        return _none(keys, "the quantity is not defined in any run")
    if _is_constant(values):
        return _none(keys, "the quantity does not vary")
    if keys == 1:
        one = np.full((len(SOBOL), 1), np.nan)
        one[[0, 3]] = 1.0
        return SobolIndices("only one key is varied", one)
    if not has_rows:
        return _none(keys, "they need a sweep with 'indices'")
    blocks = values.reshape(keys + 2, -1)  # in the samples A, B and A with one column of B
    complete = np.flatnonzero(~np.isnan(blocks).any(axis=0))
    rows, used = blocks.shape[1], 1 << complete.size.bit_length() >> 1
    if used < MIN_ROWS:
        return _none(
            keys,
            f"the quantity is defined in all runs of {complete.size} of {rows} rows of the sample,"
            f" which are fewer than {MIN_ROWS}",
        )
    blocks = blocks[:, complete[:used]]
    if _is_constant(blocks[:2]):
        return _none(keys, "the quantity does not vary")
    note = "" if used == rows else f" of {rows}: a power of two of those without undefined runs"
    return SobolIndices(f"from {used} rows{note}; 95 % confidence", _estimated(blocks))


def _is_constant(values: "Array") -> bool:
    defined = values[~np.isnan(values)]
    return bool(np.ptp(defined) <= ROUNDING * np.abs(defined).max())


def _none(keys: int, why: str) -> SobolIndices:
    return SobolIndices(f"no Sobol indices: {why}", np.full((len(SOBOL), keys), np.nan))


def _estimated(blocks: "Array") -> "Array":
    """Return first-order and total indices, each with the ends of its interval, (6, keys).

    The intervals are percentiles. The bootstrap of `scipy.stats.sobol_indices` draws other rows at
    each call, and its correction of bias omits each row in turn, in a time proportional to the
    square of their number.
    """
    from scipy.stats import bootstrap, sobol_indices

    f_a, f_b, f_ab = blocks[0], blocks[1], blocks[2:]
    data = {"f_A": f_a[None, :], "f_B": f_b[None, :], "f_AB": f_ab[:, None, :]}
    estimate: Any = sobol_indices(func=data, n=f_a.size)
    mean = 0.5 * (f_a.mean() + f_b.mean())
    f_a, f_b, f_ab = f_a - mean, f_b - mean, f_ab - mean
    variances = f_b * (f_ab - f_a), 0.5 * (f_a - f_ab) ** 2
    terms = np.vstack((*variances, 0.5 * (f_a + f_b), 0.5 * (f_a**2 + f_b**2)))

    def indices(rows: "npt.NDArray[np.int64]", axis: int) -> "Array":
        means = terms[:, rows].mean(axis=axis)
        variance = means[-1] - means[-2] ** 2
        return np.asarray(means[:-2] / np.where(variance > 0.0, variance, np.nan))

    drawn: Any = bootstrap(
        (np.arange(f_a.size),),
        indices,
        n_resamples=RESAMPLES,
        batch=max(1, MAX_DRAWN // terms.size),
        vectorized=True,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(SEED),
    )
    low, high = (ends.reshape(2, -1) for ends in drawn.confidence_interval)
    first, total = estimate.first_order, estimate.total_order
    return np.array((first, low[0], high[0], total, low[1], high[1]))
