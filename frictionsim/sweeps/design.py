"""The design of a sweep: the combinations of values and their order."""

import sys
from collections.abc import Sequence
from math import prod
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.sweep_table import RUN
from frictionsim.scenario.toml_data import toml_value
from frictionsim.sweeps.values import MAX_RUNS, Distribution, Levels

if TYPE_CHECKING:
    from frictionsim.results import Array
    from frictionsim.sweeps.study_file import SweepOptions

GRID, ZIP, SAMPLE = "grid", "zip", "sample"
MAX_FLOAT = sys.float_info.max  # of integers that have a float


class Design(NamedTuple):
    """The combinations of values of a sweep; a run is one of them, counted from 0."""

    kind: str  # GRID, ZIP or SAMPLE
    keys: tuple[str, ...]
    levels: tuple[Any, ...]  # of a grid the values of each key, else its value in each run

    @property
    def shape(self) -> tuple[int, ...]:
        """The numbers of values of the keys of a grid; else the number of runs."""
        if self.kind == GRID:
            return tuple(map(len, self.levels))
        return (len(self.levels[0]),)

    @property
    def dimensions(self) -> tuple[str, ...]:
        """The names of the dimensions of the results."""
        return self.keys if self.kind == GRID else (RUN,)

    @property
    def runs(self) -> int:
        """The number of runs."""
        return prod(self.shape)

    def combinations(self, start: int, stop: int) -> list[tuple[Any, ...]]:
        """Return the values of the keys in the runs from `start` up to `stop`; the last key of a
        grid varies fastest.
        """
        if self.kind != GRID:
            return list(zip(*(_plain(values[start:stop]) for values in self.levels), strict=True))
        import numpy as np

        indices = np.unravel_index(np.arange(start, stop), self.shape)
        columns = [
            [values[i] for i in key_indices.tolist()]
            for values, key_indices in zip(self.levels, indices, strict=True)
        ]
        return list(zip(*columns, strict=True))


def _plain(values: Any) -> Any:
    """Return numbers of numpy as those of Python."""
    return values.tolist() if hasattr(values, "tolist") else values


def design_of(options: "SweepOptions") -> Design:
    """Return the design of a sweep: a grid of all combinations, keys together, or a sample.

    Of keys together the first values are one run, the second ones the next, and so on.
    """
    vary, together = options.vary, options.zip
    if not vary:
        raise ArgumentError("vary", "expected at least one key with its values, got none")
    keys, levels = tuple(vary), list[Levels]()
    if options.sample is not None:
        if together:
            fault = "zip and sample exclude each other: leave out one of them"
            raise InputError(fault, key="study.zip")
        drawn = _sample(_distributions(options, options.sample), options, options.sample)
        return Design(SAMPLE, keys, tuple(drawn))
    for key, values in vary.items():
        if isinstance(values, Distribution):
            raise InputError(
                f"vary {key}: {values.text} is a distribution; give the number of runs of a"
                " sample, --sample N or 'sample'",
                key=f"vary.{key}",
            )
        levels.append(values)
    sizes = [of_key.size for of_key in levels]
    if together:
        if len(set(sizes)) > 1:
            counts = ", ".join(f"{key} has {n}" for key, n in zip(keys, sizes, strict=True))
            fault = f"zip: expected the same number of values for each key: {counts}"
            raise InputError(fault, key="study.zip")
        _check_total("zip", len(vary), sizes[0], fewer="values")
        return Design(ZIP, keys, tuple(of_key.values for of_key in levels))
    if prod(sizes) > MAX_RUNS:
        raise InputError(
            f"{' x '.join(map(str, sizes))} = {prod(sizes):.3g} combinations are more than the"
            f" limit of {MAX_RUNS}; give fewer values, or draw a sample of distributions",
            key="vary",
        )
    design = Design(GRID, keys, tuple(of_key.values for of_key in levels))
    for key, key_levels in zip(keys, design.levels, strict=True):
        twice = _first_repeated(key_levels)
        if twice is not None:
            raise InputError(
                f"vary {key}: {toml_value(twice)} is given twice, and a grid has a run for each"
                " value; give it once",
                key=f"vary.{key}",
            )
    return design


def _first_repeated(values: Sequence[Any]) -> Any:
    """Return the first repeated value; None if there is none."""
    if {*map(type, values)} == {float} and len({*values}) == len(values):
        return None
    seen = set()
    for value in values:
        is_number = type(value) in (int, float) and abs(value) <= MAX_FLOAT
        text = repr(float(value)) if is_number else toml_value(value)
        if text in seen:
            return value
        seen.add(text)
    return None


def _distributions(options: "SweepOptions", rows: int) -> list[Distribution]:
    """Return the distributions of a sample whose settings are usable."""
    found = list[Distribution]()
    for key, values in options.vary.items():
        if isinstance(values, Levels):
            raise InputError(
                f"vary {key}: a sample needs a distribution, e.g. uniform(0.1, 0.2), got"
                f" {values.text}; a key of one value is an override",
                key=f"vary.{key}",
            )
        found.append(values)
    _check_total("sample", len(found), options.sampled_runs, fewer="runs")
    if options.indices and rows & (rows - 1):
        below = 1 << (rows.bit_length() - 1)
        fault = f"sample: Sobol indices need a power of 2, e.g. {below}, got {rows}"
        raise InputError(fault, key="study.sample")
    return found


def _check_total(what: str, keys: int, runs: int, fewer: str) -> None:
    """Check the number of values of a design that has one of each key in each run."""
    if keys * runs > MAX_RUNS:
        product = f"{keys} key{'s' * (keys > 1)} x {runs} runs = {keys * runs:.3g} values"
        raise InputError(
            f"{what}: {product} are more than the limit of {MAX_RUNS}; give fewer {fewer}",
            key=f"study.{what}",
        )


def _sample(distributions: list[Distribution], options: "SweepOptions", rows: int) -> "list[Array]":
    """Return the values of each key in each run.

    With indices these are two samples A and B, and for each key A with its column of B.
    """
    import numpy as np

    width = len(distributions)
    points = _points((rows, 2 * width if options.indices else width), options)
    if options.indices:
        a, b = points[:, :width], points[:, width:]
        mixed = [np.where(np.arange(width) == i, b, a) for i in range(width)]
        points = np.concatenate([a, b, *mixed])
    return [d.quantiles(points[:, i]) for i, d in enumerate(distributions)]


def _points(shape: tuple[int, int], options: "SweepOptions") -> "Array":
    """Return points in the unit cube, (rows, width)."""
    import warnings

    import numpy as np
    from scipy.stats import qmc

    (rows, width), generator = shape, np.random.default_rng(options.seed)
    if options.method == "random":
        return generator.random(shape)
    if options.method == "lhs":
        return qmc.LatinHypercube(width, seed=generator).random(rows)
    with warnings.catch_warnings():
        # The documentation, not a warning, is about numbers of points that are no power of two.
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(width, seed=generator).random(rows)
