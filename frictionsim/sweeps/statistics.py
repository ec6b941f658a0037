"""Summaries of the runs of a sweep: statistics, extremes, groups of reasons, Sobol indices.

Only completed runs that passed their audit count: the quantities of a failed run are those up to
its end. In a sample with Sobol indices only the runs of its two samples A and B count; the others
repeat their values and are not independent.

The first-order Sobol index of a key is the part of a quantity's variance that it causes alone, the
total index its part with all interactions. They are computed from the samples A, B and A with one
column of B that a sweep runs with `indices`: the estimators of Saltelli et al. 2010 as in SciPy,
with 95 % intervals from its bootstrap over the rows. The bootstrap assumes independent rows. Those
of a Sobol sequence are spread more evenly, so that the intervals are too wide. A row counts if the
quantity is defined in all its runs; SciPy requires a power of two of them. Any other sample has no
indices.

Reference
---------
A. Saltelli et al., Variance based sensitivity analysis of model output, Computer Physics
Communications 181, 2010.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import short_names
from frictionsim.errors import InputError
from frictionsim.io.sweep_table import DONE, SOBOL, SobolIndices, SweepTable
from frictionsim.scenario.model_fields import names_in
from frictionsim.scenario.toml_data import toml_tables
from frictionsim.sweeps.design import SAMPLE
from frictionsim.sweeps.study_file import SweepOptions, options_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Array

LEADING = ("slip_percent", "efficiency")  # of belts what a sweep is about
FLAT = 1e-6  # relative variation below which a quantity is constant
NUMBER = re.compile(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?")


class Statistics(NamedTuple):
    """The statistics of a quantity; undefined ones are NaN."""

    runs: int  # in which the quantity is defined
    mean: float = np.nan
    standard_deviation: float = np.nan  # of a sample: divided by runs - 1
    quantile_5: float = np.nan  # interpolated linearly
    quantile_50: float = np.nan
    quantile_95: float = np.nan


class Group(NamedTuple):
    """Texts that differ in numbers only: their count, the run of the first one, and its text."""

    runs: int
    first_run: int
    text: str


def sound_values(table: SweepTable, name: str) -> "Array":
    """Return a quantity of all runs; NaN if a run is not done, or its audit failed."""
    return np.where(table.status == DONE, table.values[name], np.nan)


def is_constant(values: "Array", tolerance: float = FLAT) -> bool:
    """Return whether the finite values do not vary, or there are none."""
    defined = values[np.isfinite(values)]
    return not defined.size or bool(np.ptp(defined) <= tolerance * np.abs(defined).max())


def varying_quantities(table: SweepTable, runs: Any = slice(None)) -> list[str]:
    """Return the quantities that vary in some runs, those first that a picture should show first.

    Without those that equal a varied key or a quantity before them, if there are others.
    """
    sound = {name: sound_values(table, name)[runs] for name in table.values}
    varying = [name for name, values in sound.items() if not is_constant(values)]
    varying.sort(key=lambda name: LEADING.index(name) if name in LEADING else len(LEADING))
    # Unit and values of keys, and then of the chosen quantities.
    known = [
        (each.unit, of_key(table, key)[runs])
        for key, each in table.coordinates.items()
        if each.is_number
    ]
    chosen = []
    for name in varying:
        unit, values = table.units[name], sound[name]
        at = np.isfinite(values)
        if not any(u == unit and np.allclose(v[at], values[at], FLAT, 0.0) for u, v in known):
            chosen.append(name)
            known.append((unit, np.where(at, values, np.inf)))
    return chosen or varying


def of_key(table: SweepTable, key: str) -> "Array":
    """Return the values of a varied key of numbers in all runs."""
    values = np.asarray(table.coordinates[key].values, dtype=float)
    if key not in table.dimensions:
        return values
    return values[np.indices(table.shape)[list(table.dimensions).index(key)].ravel()]


def is_defined(table: SweepTable, name: str) -> bool:
    """Return whether a quantity is defined in a run that counts."""
    return bool(np.isfinite(sound_values(table, name)).any())


def sampling_of(table: SweepTable) -> SweepOptions | None:
    """Return how a sample was drawn; None if a sweep is none."""
    if table.attributes["design"] != SAMPLE:
        return None
    try:
        options = options_of(toml_tables(table.attributes["study"]))
    except ValueError as error:
        raise InputError(f"cannot read the study in this sweep: {error}") from None
    if options.sample is None or list(options.vary) != list(table.coordinates):
        raise InputError("the study in this sweep does not describe its runs")
    if options.sampled_runs != table.runs:
        raise InputError(
            f"the study in this sweep describes {options.sampled_runs} runs, but it has"
            f" {table.runs}; expected all runs of a sample"
        )
    return options


def independent_runs(table: SweepTable, sampling: SweepOptions | None) -> slice:
    """Return the runs of an independent sample: A and B if there are Sobol indices."""
    if sampling is None or sampling.sample is None or not sampling.indices:
        return slice(0, table.runs)
    return slice(0, 2 * sampling.sample)


def statistics_of(values: "Array") -> Statistics:
    """Return the statistics of the values that are not NaN."""
    defined = values[~np.isnan(values)]
    if not defined.size:
        return Statistics(0)
    quantiles = np.quantile(defined, (0.05, 0.5, 0.95)).tolist()
    deviation = float(defined.std(ddof=1)) if defined.size > 1 else np.nan
    return Statistics(defined.size, float(defined.mean()), deviation, *quantiles)


JUMP = 6.0  # times the changes beside it and JUMP_RANGE of all values: a change that is a jump
JUMP_RANGE = 0.1


def jumps_between(x: "Array", y: "Array") -> Any:
    """Return between which neighbours there is a jump, (n - 1,): the slope is of another size.

    A false one costs a piece of a line, a missed one would show values that no run has.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = np.abs(np.diff(y) / np.diff(x))
        beside = np.fmax(np.append(slope[1:], np.nan), np.insert(slope[:-1], 0, np.nan))
        least = JUMP_RANGE * (np.nanmax(y, initial=-np.inf) - np.nanmin(y, initial=np.inf))
        return (slope > JUMP * beside) & (np.abs(np.diff(y)) > least)


def extreme_runs(values: "Array") -> list[int]:
    """Return the runs of the least and the largest value; none if none is defined."""
    if np.isnan(values).all():
        return []
    return [int(np.nanargmin(values)), int(np.nanargmax(values))]


def varied_values(table: SweepTable, run: int) -> dict[str, Any]:
    """Return the values of the varied keys in a run, by key."""
    return {key: table.coordinates[key].values[place] for key, place in table.places(run).items()}


def short_keys(keys: Sequence[str]) -> list[str]:
    """Return the shortest ends of keys that tell them apart, for labels in little space."""
    names = [name for key in keys for name in names_in(key)]
    short = dict(zip(names, short_names(names), strict=True))
    return [", ".join(short[name] for name in names_in(key)) for key in keys]


def grouped(texts: Mapping[int, str]) -> list[Group]:
    """Return texts of runs in groups that differ in numbers only, the largest group first.

    Each line of a text counts.
    """
    groups: dict[str, Group] = {}
    for run, text in sorted(texts.items()):
        for line in dict.fromkeys(text.splitlines()):
            pattern = NUMBER.sub("0", line)
            known = groups.get(pattern, Group(0, run, line))
            groups[pattern] = known._replace(runs=known.runs + 1)
    return sorted(groups.values(), key=lambda group: (-group.runs, group.first_run))


MIN_ROWS = 16  # of A and B, below which the estimates are meaningless
ROUNDING = 1e-12  # relative variation below which a quantity is constant
RESAMPLES, CONFIDENCE = 999, 0.95
SEED = 0  # of the bootstrap: the same sample gives the same file and the same picture
BOOTSTRAP_NUMBERS = 10_000_000  # in memory at a time


def indices_of(table: SweepTable, names: Iterable[str]) -> dict[str, SobolIndices]:
    """Return the Sobol indices of some quantities of a sample, by quantity."""
    sampling = sampling_of(table)
    keys, has_rows = len(table.coordinates), sampling is not None and sampling.indices
    return {name: _indices(sound_values(table, name), keys, has_rows) for name in names}


def _indices(values: "Array", keys: int, has_rows: bool) -> SobolIndices:
    if np.isnan(values).all():
        return _none(keys, "the quantity is not defined in any run")
    if is_constant(values, ROUNDING):
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
    if is_constant(blocks[:2], ROUNDING):
        return _none(keys, "the quantity does not vary")
    note = "" if used == rows else f" of {rows}: a power of two of those without undefined runs"
    return SobolIndices(f"from {used} rows{note}; 95 % confidence", _estimated(blocks))


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
        batch=max(1, BOOTSTRAP_NUMBERS // terms.size),
        vectorized=True,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(SEED),
    )
    low, high = (ends.reshape(2, -1) for ends in drawn.confidence_interval)
    first, total = estimate.first_order, estimate.total_order
    return np.array((first, low[0], high[0], total, low[1], high[1]))
