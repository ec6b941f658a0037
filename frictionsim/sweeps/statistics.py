"""Summaries of the runs of a sweep: statistics of a sample, extremes of a grid, groups of reasons.

Only completed runs that passed their audit count: the quantities of a failed run are those up to
its end. In a sample with Sobol indices only the runs of its two samples A and B count; the others
repeat their values and are not independent.
"""

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.sweep_table import DONE, SweepTable
from frictionsim.scenario.toml_data import toml_tables
from frictionsim.sweeps.design import SAMPLE, Sampling
from frictionsim.sweeps.study_file import options_of
from frictionsim.sweeps.values import Distribution

if TYPE_CHECKING:
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


def is_constant(values: "Array") -> bool:
    """Return whether the finite values do not vary, or there are none."""
    defined = values[np.isfinite(values)]
    return not defined.size or bool(np.ptp(defined) <= FLAT * np.abs(defined).max())


def telling(table: SweepTable, runs: Any = slice(None)) -> list[str]:
    """Return the quantities that vary in some runs, those first that a picture should show first.

    Without those that equal a varied key or a quantity before them, if there are others.
    """
    sound = {name: sound_values(table, name)[runs] for name in table.values}
    varying = [name for name, values in sound.items() if not is_constant(values)]
    varying.sort(key=lambda name: LEADING.index(name) if name in LEADING else len(LEADING))
    # Unit and values of keys, and then of quantities that are told.
    known = [(each.unit, of_key(table, key)[runs]) for key, each in _numbers(table).items()]
    told = []
    for name in varying:
        unit, values = table.units[name], sound[name]
        at = np.isfinite(values)
        if not any(u == unit and np.allclose(v[at], values[at], FLAT, 0.0) for u, v in known):
            told.append(name)
            known.append((unit, np.where(at, values, np.inf)))
    return told or varying


def _numbers(table: SweepTable) -> dict[str, Any]:
    keys = table.coordinates.items()
    return {k: c for k, c in keys if not isinstance(c.values, list) and c.values.dtype.kind in "fi"}


def of_key(table: SweepTable, key: str) -> "Array":
    """Return the values of a varied key of numbers in all runs."""
    values = np.asarray(table.coordinates[key].values, dtype=float)
    if key not in table.dimensions:
        return values
    return values[np.indices(table.shape)[list(table.dimensions).index(key)].ravel()]


def is_defined(table: SweepTable, name: str) -> bool:
    """Return whether a quantity is defined in a run that counts."""
    return bool(np.isfinite(sound_values(table, name)).any())


def variation(table: SweepTable) -> tuple[Mapping[str, Distribution], Sampling | None]:
    """Return the distributions and the sampling of a sweep; none if it is no sample."""
    if table.attributes["design"] != SAMPLE:
        return {}, None
    try:
        options = options_of(toml_tables(table.attributes["study"]))
    except ValueError as error:
        raise InputError(f"cannot read the study in this sweep: {error}") from None
    sampling = options.sampling
    if sampling is None or list(options.vary) != list(table.coordinates):
        raise InputError("the study in this sweep does not describe its runs")
    runs = sampling.total(len(options.vary))
    if runs != table.runs:
        raise InputError(
            f"the study in this sweep describes {runs} runs, but it has {table.runs}; expected all"
            " runs of a sample"
        )
    return options.vary, sampling


def independent_runs(table: SweepTable, sampling: Sampling | None) -> slice:
    """Return the runs of an independent sample: A and B if there are Sobol indices."""
    if sampling is None or not sampling.indices:
        return slice(0, table.runs)
    return slice(0, 2 * sampling.runs)


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
