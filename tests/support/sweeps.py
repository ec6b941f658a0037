"""Sweeps made of closed forms, without runs."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats
from scipy.stats import qmc

from frictionsim.io.sweep_table import TEXTS, Coordinate, SweepTable

Function = Callable[..., Any]
NOT_RUN, DONE, FAILED, AUDIT_FAILED = range(4)  # the values of `status` in a file


class Sampling(NamedTuple):
    """The arguments `sample`, `method`, `seed` and `indices` of a sweep."""

    runs: int
    method: str = "sobol"
    seed: int = 0
    indices: bool = False


def distribution_of(text: str) -> Any:
    """Return a distribution of SciPy, of a text as in [vary]."""
    name, arguments = text.rstrip(") ").split("(")
    numbers = [float(part) for part in arguments.split(",")]
    return {
        "uniform": lambda a, b: stats.uniform(a, b - a),
        "normal": stats.norm,
        "lognormal": lambda m, s: stats.lognorm(s, scale=np.exp(m)),
        "triangular": lambda a, c, b: stats.triang((c - a) / (b - a), a, b - a),
    }[name](*numbers)


def points_of(width: int, sampling: Sampling) -> Any:
    """Return points in the unit cube, (runs, keys): with indices A, B, and A with columns of B."""
    generator = np.random.default_rng(sampling.seed)
    columns = 2 * width if sampling.indices else width
    if sampling.method == "random":
        points = generator.random((sampling.runs, columns))
    else:
        draw = qmc.LatinHypercube if sampling.method == "lhs" else qmc.Sobol
        points = draw(columns, rng=generator).random(sampling.runs)
    if not sampling.indices:
        return points
    a, b = points[:, :width], points[:, width:]
    mixed = [np.where(np.arange(width) == column, b, a) for column in range(width)]
    return np.concatenate([a, b, *mixed])


def sample_of(vary: Mapping[str, str], functions: Mapping[str, Function], sampling: Any) -> Any:
    """Return a sample of which each quantity is a function of the varied keys in their order."""
    points = points_of(len(vary), sampling)
    columns = [distribution_of(text).ppf(points[:, i]) for i, text in enumerate(vary.values())]
    lines = [f'"{key}" = "{text}"' for key, text in vary.items()]
    study = (
        f'[study]\nscenario = "none.toml"\nsample = {sampling.runs}\nmethod = "{sampling.method}"\n'
        f"seed = {sampling.seed}\nindices = {str(sampling.indices).lower()}\n[vary]\n"
    )
    varied = dict(zip(vary, columns, strict=True))
    return _table("sample", study + "\n".join(lines), {"run": len(points)}, varied, functions)


def grid_of(
    vary: Mapping[str, Sequence[Any]], functions: Mapping[str, Function], design: str = "grid"
) -> Any:
    """Return all combinations of values, or with the design "zip" the values together."""
    varied = {key: _array(values) for key, values in vary.items()}
    if design == "zip":
        return _table(design, "", {"run": len(next(iter(varied.values())))}, varied, functions)
    sizes = {key: len(values) for key, values in varied.items()}
    return _table(design, "", sizes, varied, functions)


def _array(values: Sequence[Any]) -> Any:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)


def with_outcomes(table: Any, outcomes: Mapping[int, int]) -> Any:
    """Return a sweep in which some runs have another status, by their numbers."""
    status = table.status.copy()
    for run, outcome in outcomes.items():
        status[run] = outcome
    return table._replace(status=status)


def _table(
    design: str,
    study: str,
    dimensions: dict[str, int],
    varied: dict[str, Any],
    functions: Mapping[str, Function],
) -> SweepTable:
    """Return the table of a sweep in which all runs are done."""
    attributes = {"study": study, "source": "a.toml", "kind": "pulley", "title": "A sweep"}
    attributes |= {"design": design, "status": "done"}
    attributes |= dict.fromkeys(("frictionsim_version", "scenario", "overrides", "reason"), "")
    columns, coordinates = list(varied.values()), {}
    if "run" not in dimensions:
        columns = [column.ravel() for column in np.meshgrid(*columns, indexing="ij")]
    for key, column in varied.items():
        is_text = column.dtype == object
        values, unit = (column.tolist(), "") if is_text else (column, "m")
        dimension = "run" if "run" in dimensions else key
        coordinates[key] = Coordinate(dimension, values, unit, key)
    runs = int(np.prod([*dimensions.values()]))
    quantities = {
        name: np.broadcast_to(function(*columns), runs).astype(float)
        for name, function in functions.items()
    }
    units, status = dict.fromkeys(functions, "N m"), np.full(runs, DONE, dtype=np.int8)
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    return SweepTable(attributes, dimensions, coordinates, units, quantities, status, texts)
