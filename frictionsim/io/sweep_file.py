"""The file of a sweep in HDF5, which is also one of netCDF-4 and opens in xarray.

    /                    attributes of text, but the first:
                         sweep_version       1
                         Conventions         CF-1.11
                         frictionsim_version
                         study               the study in TOML, with the scenario in it: `sweep`
                                             runs it again
                         scenario            the varied scenario, TOML with defaults and overrides
                         source, overrides   of that scenario, as in a result file
                         kind, title
                         design              grid, zip or sample
                         status              done; interrupted if an unfinished one was saved
                         reason              of the interruption; empty if done
    /<key>               the values of a varied key: of a grid the dimension scale of that name,
                         else along `run`. Numbers, or text in TOML
    /run                 the number of the run, from 0; not of a grid
    /<quantity>          (key, key, ...) or (run): the quantities of the summary, NaN where one is
                         not defined
    /status              0 not run, 1 done, 2 failed, 3 done, but its audit failed
    /failure, /reason, /warnings    text; empty if there is none
    /sobol_first, /sobol_total      (sobol_quantity, sobol_key): Sobol indices, only of a completed
                         sample with `indices`; NaN where there are none
    /sobol_first_low, /sobol_first_high, /sobol_total_low, /sobol_total_high
                         the ends of their 95 % intervals
    /sobol_basis         (sobol_quantity): what they are computed from, or why there are none
    /sobol_quantity, /sobol_key     the names of the quantities and of the varied keys

The runs of a grid are numbered with the last key varying fastest. All datasets have the attributes
`units` and `long_name`, except texts, which have no unit. The file does not depend on the number of
processes, the order of the runs or interruptions, and ends with the line of a checksum, as a result
file.
"""

from math import prod
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.output_file import SWEEP
from frictionsim.io.result_format import CONVENTIONS
from frictionsim.io.result_reader import (
    ResultFile,
    flags_of,
    names_of,
    opened,
    text_of,
    values_of,
)
from frictionsim.io.result_writer import TEXT, describe, write_from_memory
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL,
    SOBOL_BASIS,
    SOBOL_KEY,
    SOBOL_QUANTITY,
    STATUS,
    TEXTS,
    VERSION,
    VERSION_NAME,
    Coordinate,
    SobolIndices,
    SweepTable,
)
from frictionsim.results import Channel

ATTRIBUTES = (
    *("frictionsim_version", "study", "scenario", "source", "overrides"),
    *("kind", "title", "design", "status", "reason"),
)
COMPRESSED_FROM = 10_000  # runs


def write_sweep(table: SweepTable, path: Path) -> None:
    """Write the file of a sweep atomically: on any error the existing file is kept."""
    write_from_memory(lambda file: _fill(file, table), path, SWEEP)


def _fill(file: Any, table: SweepTable) -> None:
    file.attrs[VERSION_NAME] = VERSION
    for name, text in ({"Conventions": CONVENTIONS} | table.attributes).items():
        file.attrs[name] = text
    scales = {}
    if RUN in table.dimensions:
        scales[RUN] = _add(file, RUN, np.arange(table.runs), "1", "number of the run, from 0")
        scales[RUN].make_scale(RUN)
    for key, coordinate in table.coordinates.items():
        dataset = _add_coordinate(file, key, coordinate)
        if coordinate.dimension == key:
            dataset.make_scale(key)
            scales[key] = dataset
    dimensions = [scales[name] for name in table.dimensions]
    if RUN in scales:
        for key in table.coordinates:
            file[key].dims[0].attach_scale(scales[RUN])
    for name, values in table.values.items():
        words = name.replace("_", " ")
        _add(file, name, values.reshape(table.shape), table.units[name], words, dimensions)
    status = file.create_dataset(STATUS, data=table.status.reshape(table.shape))
    describe(status, Channel("1", "outcome of the run", flags=table.statuses), *dimensions)
    for name, words in TEXTS.items():
        _add_texts(file, name, table.text_array(name), words, dimensions)
    if RUN in scales:
        named = " ".join(table.coordinates)
        for name in (*table.values, STATUS, *TEXTS):
            file[name].attrs["coordinates"] = named
    if table.sobol is not None:
        _add_indices(file, table.sobol)


def _add_indices(file: Any, indices: SobolIndices) -> None:
    scales: dict[str, Any] = {}
    for name, (dimensions, values, words) in indices.datasets.items():
        along = [scales[dimension] for dimension in dimensions if dimension != name]
        if not isinstance(values, list):
            _add(file, name, values, "1", words, along)
            continue
        dataset = _add_texts(file, name, np.array(values, object), words, along)
        if name in dimensions:
            dataset.make_scale(name)
            scales[name] = dataset


def _add(file: Any, name: str, values: Any, unit: str, long_name: str, dimensions: Any = ()) -> Any:
    dataset = file.create_dataset(name, data=values)
    describe(dataset, Channel(unit, long_name), *dimensions)
    return dataset


def _add_coordinate(file: Any, key: str, coordinate: Coordinate) -> Any:
    if isinstance(coordinate.values, list):
        return _add_texts(file, key, np.array(coordinate.values, object), coordinate.long_name)
    values = coordinate.values
    if values.dtype == np.bool_:
        values = values.astype(np.int8)
    return _add(file, key, values, coordinate.unit or "1", coordinate.long_name)


def _add_texts(file: Any, name: str, texts: Any, long_name: str, dimensions: Any = ()) -> Any:
    storage = {"chunks": True, "compression": "gzip"} if texts.size >= COMPRESSED_FROM else {}
    dataset = file.create_dataset(name, data=texts, dtype=TEXT, **storage)
    describe(dataset, Channel("", long_name), *dimensions)
    return dataset


def read_sweep(path: Path) -> SweepTable:
    """Read the file of a sweep.

    Raises
    ------
    InputError
        If there is none, it is not readable or damaged, or it is the result of a run.
    """
    with opened(path, "sweep") as file:
        if VERSION_NAME not in file.attrs:
            raise InputError(f"{path}: this is the result of a run, not a sweep; fs.open reads it")
        return table_of(file, path)


def table_of(file: ResultFile, path: Path) -> SweepTable:
    """Return the content of an open file of a sweep."""
    version = int(file.attrs[VERSION_NAME])
    if version != VERSION:
        raise InputError(
            f"{path}: cannot read this sweep: its format version is {version}, this program"
            f" reads version {VERSION}"
        )
    attributes = {name: str(file.attrs[name]) for name in ATTRIBUTES}
    datasets = file.group("")
    status = datasets.pop(STATUS)
    statuses, shape = flags_of(status), status.shape
    texts = {name: _texts(datasets.pop(name), shape) for name in TEXTS}
    coordinates, dimensions = _coordinates(datasets, status)
    sobol = _indices(datasets, list(coordinates)) if SOBOL_BASIS in datasets else None
    columns = {n: d for n, d in datasets.items() if n != RUN and n not in coordinates}
    outcome = values_of(status).astype(np.int8).reshape(-1)
    if any(dataset.shape != shape for dataset in columns.values()):
        raise ValueError("a quantity is not of the shape of the sweep")
    if not np.isin(outcome, [number for number, _ in statuses]).all():
        raise ValueError("a run has a status that there is not")
    if sobol is not None and sobol.quantities != list(columns):
        raise ValueError("its Sobol indices are of other quantities")
    return SweepTable(
        attributes=attributes,
        dimensions=dimensions,
        coordinates=coordinates,
        units={name: text_of(dataset, "units") for name, dataset in columns.items()},
        values={name: values_of(dataset).reshape(-1) for name, dataset in columns.items()},
        status=outcome,
        statuses=statuses,
        texts=texts,
        sobol=sobol,
    )


def _indices(datasets: dict[str, Any], keys: list[str]) -> SobolIndices:
    """Return the Sobol indices; remove their datasets from `datasets`."""
    names, stored_keys, basis = (
        list(names_of(datasets.pop(name))) for name in (SOBOL_QUANTITY, SOBOL_KEY, SOBOL_BASIS)
    )
    columns = {name: values_of(datasets.pop(name)) for name in SOBOL}
    shape = (len(names), len(keys))
    if (
        stored_keys != keys
        or len(basis) != len(names)
        or any(c.shape != shape for c in columns.values())
    ):
        raise ValueError("its Sobol indices are not those of its keys")
    return SobolIndices(names, keys, basis, columns)


def _coordinates(
    datasets: dict[str, Any], status: Any
) -> tuple[dict[str, Coordinate], dict[str, int]]:
    """Return the varied keys, and the lengths of the dimensions by name."""
    if RUN in datasets:
        names, runs = str(status.attrs["coordinates"]).split(), int(datasets[RUN].shape[0])
        dimensions = {RUN: runs}
    else:
        names = [str(next(iter(dimension.keys()))) for dimension in status.dims]
        dimensions = {key: int(datasets[key].shape[0]) for key in names}
    if status.shape != tuple(dimensions.values()) or prod(status.shape) < 1:
        raise ValueError("the sweep has another shape")
    coordinates = {}
    for key in names:
        dataset = datasets[key]
        dimension = RUN if RUN in datasets else key
        if dataset.shape != (dimensions[dimension],):
            raise ValueError(f"{key} does not have a value for each run")
        is_text = h5py.check_string_dtype(dataset.dtype) is not None
        coordinates[key] = Coordinate(
            dimension,
            list(names_of(dataset)) if is_text else values_of(dataset),
            "" if is_text else text_of(dataset, "units"),
            text_of(dataset, "long_name"),
        )
    return coordinates, dimensions


def _texts(dataset: Any, shape: tuple[int, ...]) -> dict[int, str]:
    """Return the nonempty texts of a dataset by the number of the run."""
    if dataset.shape != shape:
        raise ValueError(f"{dataset.name} is not of the shape of the sweep")
    texts = dataset.asstr()[...].reshape(-1).tolist()
    return {number: text for number, text in enumerate(texts) if text}
