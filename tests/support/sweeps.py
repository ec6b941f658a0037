"""Sweeps made of closed forms, without runs."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from frictionsim.io.sweep_table import RUN, Coordinate, SweepTable
from frictionsim.parameter_study.block import DONE, STATUSES
from frictionsim.parameter_study.design import Sampling, design_of
from frictionsim.parameter_study.values import values_of

Function = Callable[..., Any]
NO_TEXTS: dict[str, dict[int, str]] = {"failure": {}, "reason": {}, "warnings": {}}


def sample_of(
    vary: Mapping[str, str], functions: Mapping[str, Function], sampling: Sampling
) -> SweepTable:
    """Return a sample of which each quantity is a function of the varied keys in their order."""
    values = {key: values_of(key, text) for key, text in vary.items()}
    columns = design_of(values, False, sampling).levels
    lines = [f'"{key}" = "{text}"' for key, text in vary.items()]
    study = (
        f'[study]\nscenario = "none.toml"\nsample = {sampling.runs}\nmethod = "{sampling.method}"\n'
        f"seed = {sampling.seed}\nindices = {str(sampling.indices).lower()}\n[vary]\n"
    )
    coordinates = {
        key: Coordinate(RUN, column, "m", key) for key, column in zip(vary, columns, strict=True)
    }
    outputs = {name: function(*columns) for name, function in functions.items()}
    return _table("sample", study + "\n".join(lines), {RUN: len(columns[0])}, coordinates, outputs)


def grid_of(
    vary: Mapping[str, Sequence[Any]], functions: Mapping[str, Function], design: str = "grid"
) -> SweepTable:
    """Return all combinations of values, or with the design "zip" the values together."""
    if design == "grid":
        lengths = {key: len(values) for key, values in vary.items()}
        columns = [
            column.ravel() for column in np.meshgrid(*map(_array, vary.values()), indexing="ij")
        ]
    else:
        columns = [_array(values) for values in vary.values()]
        lengths = {RUN: len(columns[0])}
    coordinates = {}
    for key, values in vary.items():
        text = isinstance(values[0], str)
        kept = list(values) if text else np.asarray(values)
        coordinates[key] = Coordinate(
            key if design == "grid" else RUN, kept, "" if text else "m", key
        )
    outputs = {name: function(*columns) for name, function in functions.items()}
    return _table(design, "", lengths, coordinates, outputs)


def _array(values: Sequence[Any]) -> Any:
    return np.array(values, dtype=object if isinstance(values[0], str) else None)


def _table(
    design: str,
    study: str,
    dimensions: dict[str, int],
    coordinates: dict[str, Coordinate],
    values: dict[str, Any],
) -> SweepTable:
    count = int(np.prod(list(dimensions.values())))
    attributes = dict.fromkeys(("frictionsim_version", "scenario", "overrides", "reason"), "")
    attributes |= {"kind": "pulley", "title": "A sweep", "design": design, "status": "done"}
    return SweepTable(
        attributes | {"study": study, "source": "a.toml"},
        dimensions,
        coordinates,
        dict.fromkeys(values, "N m"),
        {name: np.array(np.broadcast_to(v, count), dtype=np.float64) for name, v in values.items()},
        np.full(count, DONE, dtype=np.int8),
        STATUSES,
        {name: dict(texts) for name, texts in NO_TEXTS.items()},
    )


def with_outcomes(table: SweepTable, outcomes: Mapping[int, int]) -> SweepTable:
    """Return a sweep in which some runs have another status, by their numbers."""
    status = table.status.copy()
    for run, outcome in outcomes.items():
        status[run] = outcome
    return table._replace(status=status)
