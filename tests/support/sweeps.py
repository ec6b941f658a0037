"""Sweeps made of closed forms, without runs: written as their file, and read again."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import h5py
import numpy as np
from scipy import stats
from scipy.stats import qmc

import frictionsim as fs

Function = Callable[..., Any]
# The values of `status` in a file.
STATUSES = {"not_run": 0, "done": 1, "failed": 2, "audit_failed": 3}
NOT_RUN, DONE, FAILED, AUDIT_FAILED = STATUSES.values()


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
    blocks = [a, b]
    for column in range(width):
        blocks.append(a.copy())
        blocks[-1][:, column] = b[:, column]
    return np.concatenate(blocks)


def sample_of(vary: Mapping[str, str], functions: Mapping[str, Function], sampling: Any) -> Any:
    """Return a sample of which each quantity is a function of the varied keys in their order."""
    points = points_of(len(vary), sampling)
    columns = [distribution_of(text).ppf(points[:, i]) for i, text in enumerate(vary.values())]
    lines = [f'"{key}" = "{text}"' for key, text in vary.items()]
    study = (
        f'[study]\nscenario = "none.toml"\nsample = {sampling.runs}\nmethod = "{sampling.method}"\n'
        f"seed = {sampling.seed}\nindices = {str(sampling.indices).lower()}\n[vary]\n"
    )
    outputs = {name: function(*columns) for name, function in functions.items()}
    varied = dict(zip(vary, columns, strict=True))
    return _table("sample", study + "\n".join(lines), {"run": len(points)}, varied, outputs)


def grid_of(
    vary: Mapping[str, Sequence[Any]], functions: Mapping[str, Function], design: str = "grid"
) -> Any:
    """Return all combinations of values, or with the design "zip" the values together."""
    varied = {key: _array(values) for key, values in vary.items()}
    if design == "grid":
        dimensions = {key: len(values) for key, values in varied.items()}
        columns = [c.ravel() for c in np.meshgrid(*varied.values(), indexing="ij")]
    else:
        columns = list(varied.values())
        dimensions = {"run": len(columns[0])}
    outputs = {name: function(*columns) for name, function in functions.items()}
    return _table(design, "", dimensions, varied, outputs)


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
    values: dict[str, Any],
) -> Any:
    """Return the table of a sweep in which all runs are done."""
    attributes = {"study": study, "source": "a.toml", "kind": "pulley", "title": "A sweep"}
    attributes |= {"design": design, "status": "done"}
    attributes |= dict.fromkeys(("frictionsim_version", "scenario", "overrides", "reason"), "")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "s.h5"
        with h5py.File(path, "w", track_order=True) as file:
            file.attrs["sweep_version"] = 1
            for name, text in attributes.items():
                file.attrs[name] = text
            _fill(file, dimensions, varied, values)
        table = fs.open_sweep(path).table
    # In memory truth values are kept; their file has 0 and 1.
    truths = {key: column for key, column in varied.items() if column.dtype == np.bool_}
    made = {key: table.coordinates[key]._replace(values=column) for key, column in truths.items()}
    return table._replace(coordinates=table.coordinates | made)


def _fill(
    file: h5py.File, dimensions: dict[str, int], varied: dict[str, Any], values: dict[str, Any]
) -> None:
    shape = tuple(dimensions.values())
    if "run" in dimensions:
        file["run"] = np.arange(*shape)
    for key, column in varied.items():
        numbers = column.dtype != object
        stored = column.astype(np.int8) if column.dtype == np.bool_ else column
        file.create_dataset(key, data=stored, dtype=None if numbers else h5py.string_dtype())
        file[key].attrs["long_name"] = key
        if numbers:
            file[key].attrs["units"] = "m"
    for name in dimensions:
        file[name].make_scale(name)
    for name, column in values.items():
        file[name] = np.broadcast_to(column, np.prod(shape)).astype(float).reshape(shape)
        file[name].attrs["units"] = "N m"
    file["status"] = np.full(shape, DONE, dtype=np.int8)
    file["status"].attrs["flag_values"] = np.array(list(STATUSES.values()), dtype=np.int8)
    file["status"].attrs["flag_meanings"] = " ".join(STATUSES)
    file["status"].attrs["coordinates"] = " ".join(varied)
    for name in ("failure", "reason", "warnings"):
        file.create_dataset(name, data=np.full(shape, "", object), dtype=h5py.string_dtype())
    for name in ("status", *values):
        for axis, dimension in enumerate(dimensions):
            file[name].dims[axis].attach_scale(file[dimension])
