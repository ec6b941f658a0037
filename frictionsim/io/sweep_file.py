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
                         status              done, or interrupted
                         reason              of the interruption; empty if done
                         order               only if interrupted: for `resume`, the first
                                             appearance of each quantity, in JSON
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

from pathlib import Path
from typing import Any

import numpy as np

from frictionsim.io.hdf5_writer import TEXT, describe, write_from_memory
from frictionsim.io.replaceable import SWEEP
from frictionsim.io.result_format import CONVENTIONS
from frictionsim.io.sweep_table import (
    RUN,
    STATUS,
    TEXTS,
    VERSION,
    VERSION_NAME,
    Coordinate,
    SobolIndices,
    SweepTable,
)
from frictionsim.results import Channel

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
