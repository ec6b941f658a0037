"""Sobol indices: which part of a quantity's variance each varied key causes.

The first-order index of a key is its part alone, the total index its part with all interactions.
They are computed in one of two ways:

- From the samples A, B and A with one column of B that a sweep runs with `indices`: the estimators
  of Saltelli et al. 2010, with 95 % intervals from SciPy's bootstrap over the rows. It takes the
  rows as independent. Those of a Sobol sequence are not: they are spread more evenly, and the
  intervals are too wide. A row counts if the quantity is defined in all its runs; SciPy wants a
  power of two of them.
- From any other sample: of a polynomial that is fitted to it. In polynomials that are orthonormal
  for the distributions of the keys the indices are sums of squares of its coefficients (Sudret
  2008). They are given only if the polynomial predicts runs that it was not fitted to: Q², the part
  of the variance that it explains when each run is left out in turn, is at least MIN_Q2.

References
----------
A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics
Communications 181, 2010. B. Sudret, Global sensitivity analysis using polynomial chaos expansions,
Reliability Engineering and System Safety 93, 2008.
"""

from collections.abc import Mapping
from itertools import combinations_with_replacement
from math import comb
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_table import SOBOL, SobolIndices, SweepTable
from frictionsim.parameter_study.design import Sampling
from frictionsim.parameter_study.statistics import sound_values, variation
from frictionsim.parameter_study.values import Distribution

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Array

MIN_ROWS = 16  # of A and B, below which the estimates mean nothing
MIN_Q2 = 0.9
DEGREES = (1, 2, 3)
DEGREE_WORDS = {1: "linear", 2: "quadratic", 3: "cubic"}
RUNS_PER_TERM = 2  # at least, of a polynomial
MAX_FITTED = 8192  # runs
MAX_TERMS = 500
ROUNDING = 1e-12  # a quantity that varies relatively less is constant
RESAMPLES, CONFIDENCE = 999, 0.95
SEED = 0  # of the bootstrap: the same sample gives the same file and the same picture
MAX_DRAWN = 10_000_000  # numbers of the bootstrap in memory at a time


class Indices(NamedTuple):
    """The Sobol indices of a quantity; or the reason why there are none.

    Attributes
    ----------
    keys : tuple of str
    first, total : (keys,)
        Empty if there are none.
    first_interval, total_interval : (keys, 2)
        Of 95 % confidence; None if they are not known.
    basis : str
        What they are computed from, or why there are none.
    """

    keys: tuple[str, ...]
    first: "Array"
    total: "Array"
    basis: str
    first_interval: "Array | None" = None
    total_interval: "Array | None" = None


def indices_of(table: SweepTable, names: list[str]) -> dict[str, Indices]:
    """Return the Sobol indices of some quantities of a sample.

    Raises
    ------
    InputError
        If the study in its file is not valid.
    """
    distributions, sampling = variation(table)
    if sampling is None:
        return {name: _none(tuple(table.coordinates), "not a sample") for name in names}
    points = np.array([table.coordinates[key].values for key in distributions], dtype=np.float64)
    return {
        name: _of_values(sound_values(table, name), points, distributions, sampling)
        for name in names
    }


def sobol_indices_of(table: SweepTable) -> SobolIndices | None:
    """Return the indices of all quantities of a sample with `indices`; None of another sweep.

    Raises
    ------
    InputError
        If the study in its file is not valid.
    """
    sampling = variation(table)[1]
    if sampling is None or not sampling.indices:
        return None
    found = indices_of(table, list(table.values))
    keys = list(table.coordinates)
    unknown = np.full(len(keys), np.nan)
    columns: dict[str, list[Array]] = {name: [] for name in SOBOL}
    for each in found.values():
        for name, values, interval in (
            ("sobol_first", each.first, each.first_interval),
            ("sobol_total", each.total, each.total_interval),
        ):
            low, high = (unknown, unknown) if interval is None else interval.T
            columns[name].append(values if values.size else unknown)
            columns[f"{name}_low"].append(low)
            columns[f"{name}_high"].append(high)
    return SobolIndices(
        quantities=list(found),
        keys=keys,
        basis=[each.basis for each in found.values()],
        columns={n: np.array(rows).reshape(len(found), len(keys)) for n, rows in columns.items()},
    )


def _none(keys: tuple[str, ...], why: str) -> Indices:
    return Indices(keys, np.empty(0), np.empty(0), why)


def _of_values(
    values: "Array",
    points: "Array",
    distributions: Mapping[str, Distribution],
    sampling: Sampling,
) -> Indices:
    keys = tuple(distributions)
    defined = values[~np.isnan(values)]
    if not defined.size:
        return _none(keys, "no Sobol indices: the quantity is not defined in any run")
    if np.ptp(defined) <= ROUNDING * np.abs(defined).max():
        return _none(keys, "no Sobol indices: the quantity does not vary")
    if len(keys) == 1:
        return Indices(keys, np.ones(1), np.ones(1), "only one key is varied")
    if sampling.indices:
        return of_blocks(keys, values.reshape(len(keys) + 2, sampling.runs))
    scores = np.array([_score(d, x) for d, x in zip(distributions.values(), points, strict=True)])
    return of_polynomial(distributions, scores, values)


def of_blocks(keys: tuple[str, ...], blocks: "Array") -> Indices:
    """Return the indices from the values in the samples A, B and A with one column of B.

    Parameters
    ----------
    keys : tuple of str
        At least two.
    blocks : (keys + 2, n)
    """
    from scipy.stats import sobol_indices

    complete = np.flatnonzero(~np.isnan(blocks).any(axis=0))
    used = 1 << (complete.size.bit_length() - 1) if complete.size else 0
    rows = blocks.shape[1]
    if used < MIN_ROWS:
        return _none(
            keys,
            f"no Sobol indices: the quantity is defined in all runs of {complete.size} of {rows}"
            f" rows of the sample, which are fewer than {MIN_ROWS}",
        )
    f = blocks[:, complete[:used]]
    f_a, f_b, f_ab = f[0], f[1], f[2:]
    if np.ptp(f[:2]) <= ROUNDING * np.abs(f[:2]).max():
        return _none(keys, "no Sobol indices: the quantity does not vary")
    data = {"f_A": f_a[None, :], "f_B": f_b[None, :], "f_AB": f_ab[:, None, :]}
    found: Any = sobol_indices(func=data, n=used)
    first, total = _bootstrap(f_a, f_b, f_ab)
    of_rows = "" if used == rows else f" of {rows}: a power of two of those without undefined runs"
    basis = f"from {used} rows{of_rows}; 95 % confidence"
    return Indices(keys, found.first_order, found.total_order, basis, first, total)


def _bootstrap(f_a: "Array", f_b: "Array", f_ab: "Array") -> "tuple[Array, Array]":
    """Return the intervals of the indices, (keys, 2) each: percentiles of SciPy's bootstrap.

    That of `scipy.stats.sobol_indices` draws other rows each time, and its correction of bias
    leaves out each row in turn, which takes a time that grows with the square of their number.
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

    found: Any = bootstrap(
        (np.arange(count),),
        indices,
        n_resamples=RESAMPLES,
        batch=max(1, MAX_DRAWN // terms.size),
        vectorized=True,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(SEED),
    )
    bounds = np.stack(found.confidence_interval, axis=-1)
    keys = len(f_ab)
    return bounds[:keys], bounds[keys:]


def of_polynomial(
    distributions: Mapping[str, Distribution], scores: "Array", values: "Array"
) -> Indices:
    """Return the indices of the polynomial that fits a sample best, if it is good enough.

    Parameters
    ----------
    distributions : mapping of Distribution
        By key.
    scores : (keys, n)
        The values of the keys as `_score` gives them.
    values : (n,)
        Of the quantity, NaN where it is not defined.
    """
    keys = tuple(distributions)
    used = np.flatnonzero(~np.isnan(values))[:MAX_FITTED]
    found = [
        fit
        for degree in DEGREES
        if RUNS_PER_TERM * comb(len(keys) + degree, degree) <= used.size
        and comb(len(keys) + degree, degree) <= MAX_TERMS
        if (fit := _fit(distributions, scores[:, used], values[used], degree))
    ]
    way_out = "; --indices runs what they need"
    if not found:
        least = RUNS_PER_TERM * (len(keys) + 1)
        return _none(
            keys,
            f"no Sobol indices: {used.size} runs in which the quantity is defined are fewer than"
            f" the {least} that a fit needs{way_out}",
        )
    q2, degree, coefficients, powers = max(found, key=lambda fit: fit[0])
    words = f"{DEGREE_WORDS[degree]} polynomial"
    if not q2 >= MIN_Q2:
        return _none(
            keys,
            f"no Sobol indices: the best polynomial ({DEGREE_WORDS[degree]}) predicts"
            f" {max(0.0, 100.0 * q2):.0f} % of the variance, less than {100.0 * MIN_Q2:.0f} %"
            + way_out,
        )
    parts = coefficients[1:] ** 2 / (coefficients[1:] ** 2).sum()
    involved = powers[1:] > 0
    alone = involved.sum(axis=1) == 1
    first = np.array([parts[alone & involved[:, i]].sum() for i in range(len(keys))])
    total = np.array([parts[involved[:, i]].sum() for i in range(len(keys))])
    basis = f"of a {words}, which predicts {_percent(q2)} % of the variance"
    return Indices(keys, first, total, basis)


def _percent(part: float) -> str:
    """Return a part in percent, not rounded up to 100."""
    return f"{np.floor(1000.0 * part) / 10.0:.4g}"


def _fit(
    distributions: Mapping[str, Distribution], scores: "Array", values: "Array", degree: int
) -> "tuple[float, int, Array, Array] | None":
    """Return Q², degree, coefficients and powers (terms, keys); None if the points do not do."""
    one_key = [
        _orthonormal(d, x, degree) for d, x in zip(distributions.values(), scores, strict=True)
    ]
    powers = _powers(len(scores), degree)
    columns = np.ones((values.size, len(powers)))
    for i, polynomials in enumerate(one_key):
        columns *= polynomials[powers[:, i]].T
    q, r = np.linalg.qr(columns)
    diagonal = np.abs(np.diag(r))
    if diagonal.min() <= ROUNDING * diagonal.max():
        return None
    coefficients = np.linalg.solve(r, q.T @ values)
    leverage = (q**2).sum(axis=1)
    if leverage.max() >= 1.0 - ROUNDING:
        return None
    left_out = (values - columns @ coefficients) / (1.0 - leverage)
    q2 = 1.0 - float((left_out**2).sum() / ((values - values.mean()) ** 2).sum())
    return q2, degree, coefficients, powers


def _powers(keys: int, degree: int) -> Any:
    """Return the degrees in each key of all terms up to a degree; the constant term first."""
    rows = []
    for total in range(degree + 1):
        for chosen in combinations_with_replacement(range(keys), total):
            rows.append(np.bincount(np.array(chosen, dtype=np.int64), minlength=keys))
    return np.array(rows)


def _score(distribution: Distribution, values: "Array") -> "Array":
    """Return values of a key on the scale of its polynomials: -1 to 1, or standard normal."""
    if distribution.name == "normal":
        mean, deviation = distribution.arguments
        return (values - mean) / deviation
    if distribution.name == "lognormal":
        mean, deviation = distribution.arguments
        return (np.log(values) - mean) / deviation
    low, high = distribution.arguments[0], distribution.arguments[-1]
    return (2.0 * values - low - high) / (high - low)


def _orthonormal(distribution: Distribution, scores: "Array", degree: int) -> "Array":
    """Return the orthonormal polynomials of a distribution at scores, (degree + 1, n).

    1, t, t², ... are made orthonormal by the Cholesky factor of their moments.
    """
    moments = [_moment(distribution, k) for k in range(2 * degree + 1)]
    size = degree + 1
    gram = np.array([[moments[i + j] for j in range(size)] for i in range(size)])
    powers = np.vander(scores, size, increasing=True).T
    return np.asarray(np.linalg.solve(np.linalg.cholesky(gram), powers), dtype=np.float64)


def _moment(distribution: Distribution, order: int) -> float:
    """Return the mean of the power of a score."""
    if distribution.name in ("normal", "lognormal"):
        # (order - 1)!! of the standard normal distribution
        return float(order % 2 == 0) * float(np.prod(np.arange(order - 1, 0, -2)))
    if distribution.name == "uniform":
        return float(order % 2 == 0) / (order + 1)
    low, peak, high = distribution.arguments
    mode = (2.0 * peak - low - high) / (high - low)
    # The density rises from 0 at -1 to 1 at the mode and falls to 0 at 1; the quadrature is exact.
    nodes, weights = np.polynomial.legendre.leggauss(order // 2 + 2)
    total = 0.0
    for a, b, slope in ((-1.0, mode, 1.0), (mode, 1.0, -1.0)):
        if b > a:
            t = 0.5 * (a + b) + 0.5 * (b - a) * nodes
            density = (t - a) / (b - a) if slope > 0.0 else (b - t) / (b - a)
            total += float(0.5 * (b - a) * (weights * density * t**order).sum())
    return total
