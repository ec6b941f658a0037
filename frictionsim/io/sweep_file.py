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

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.output_file import SWEEP
from frictionsim.io.result_reader import (
    ResultFile,
    is_unfinished_sweep,
    names_of,
    opened,
    record_in,
    text_of,
    values_of,
)
from frictionsim.io.result_writer import CONVENTIONS, TEXT, describe, write_from_memory
from frictionsim.io.sweep_journal import read_unfinished
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL,
    SOBOL_BASIS,
    SOBOL_NAMES,
    STATUS,
    STATUSES,
    TEXTS,
    VERSION,
    VERSION_NAME,
    Coordinate,
    SobolIndices,
    SweepTable,
    from_stored,
)
from frictionsim.results import Channel, Record
from frictionsim.simulation.averages import words_of

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
    if is_list := RUN in table.dimensions:
        numbers = Channel("1", "number of the run, from 0")
        scales[RUN] = _add(file, RUN, np.arange(table.runs), numbers)
        scales[RUN].make_scale(RUN)
    for key, coordinate in table.coordinates.items():
        unit = "" if isinstance(coordinate.values, list) else coordinate.unit or "1"
        dataset = _add(file, key, coordinate.stored, Channel(unit, coordinate.long_name))
        if not is_list:
            dataset.make_scale(key)
            scales[key] = dataset
    dimensions = [scales[name] for name in table.dimensions]
    if is_list:
        for key in table.coordinates:
            file[key].dims[0].attach_scale(scales[RUN])
    for name, values in table.values.items():
        channel = Channel(table.units[name], words_of(name))
        _add(file, name, values.reshape(table.shape), channel, dimensions)
    outcome = Channel("1", "outcome of the run", flags=STATUSES)
    _add(file, STATUS, table.status.reshape(table.shape), outcome, dimensions)
    for name, words in TEXTS.items():
        _add(file, name, table.text_array(name), Channel("", words), dimensions)
    if is_list:
        for name in (*table.values, STATUS, *TEXTS):
            file[name].attrs["coordinates"] = " ".join(table.coordinates)
    for name, (along, values, words) in table.sobol_datasets.items():
        unit = "" if isinstance(values, list) else "1"
        others = [scales[dimension] for dimension in along if dimension != name]
        dataset = _add(file, name, values, Channel(unit, words), others)
        if name in along:
            dataset.make_scale(name)
            scales[name] = dataset


def _add(file: Any, name: str, values: Any, channel: Channel, scales: Sequence[Any] = ()) -> Any:
    """Add numbers, or a list or an array of texts."""
    options: dict[str, Any] = {}
    if isinstance(values, list) or values.dtype == object:
        values, options["dtype"] = np.array(values, object), TEXT
        if values.size >= COMPRESSED_FROM:
            options |= {"chunks": True, "compression": "gzip"}
    dataset = file.create_dataset(name, data=values, **options)
    describe(dataset, channel, *scales)
    return dataset


def read_any(path: Path, what: str = "result") -> Record | SweepTable:
    """Read a result file, the file of a sweep or an unfinished sweep; `what` is for messages.

    Raises
    ------
    InputError
        If there is none, or it is neither.
    """
    if is_unfinished_sweep(path):
        return read_unfinished(path).table
    with opened(path, what) as file:
        return sweep_in(file, path) if VERSION_NAME in file.attrs else record_in(file, path)


def sweep_in(file: ResultFile, path: Path) -> SweepTable:
    """Return the sweep in an open file; the path is for messages."""
    version = int(file.attrs[VERSION_NAME])
    if version != VERSION:
        raise InputError(
            f"{path}: cannot read this sweep: its format version is {version}, this program reads"
            f" version {VERSION}"
        )
    datasets = file.group("")
    status, is_list = datasets[STATUS], RUN in datasets
    outcomes = values_of(status).astype(np.int8).reshape(-1)
    if not {*outcomes.tolist()} <= dict(STATUSES).keys():
        raise ValueError("a run has an unknown status")
    if is_list:
        keys, dimensions = str(status.attrs["coordinates"]).split(), {RUN: status.size}
    else:
        keys = [str(next(iter(dimension.keys()))) for dimension in status.dims]
        dimensions = dict(zip(keys, status.shape, strict=True))
    others = {RUN, STATUS, *TEXTS, *SOBOL_NAMES, *keys}
    columns = {name: dataset for name, dataset in datasets.items() if name not in others}
    table = SweepTable(
        attributes={name: str(file.attrs[name]) for name in ATTRIBUTES},
        dimensions=dimensions,
        coordinates={key: _coordinate(datasets[key], RUN if is_list else key) for key in keys},
        units={name: text_of(dataset, "units") for name, dataset in columns.items()},
        values={n: values_of(dataset).reshape(status.size) for n, dataset in columns.items()},
        status=outcomes,
        texts={name: _texts(datasets[name].asstr()[...].reshape(status.size)) for name in TEXTS},
    )
    if SOBOL_BASIS not in datasets:
        return table
    basis, numbers = (
        names_of(datasets[SOBOL_BASIS]),
        np.array([datasets[name][...] for name in SOBOL]),
    )
    indices = (SobolIndices(text, numbers[:, i]) for i, text in enumerate(basis))
    return table._replace(sobol=dict(zip(columns, indices, strict=True)))


def _coordinate(dataset: Any, dimension: str) -> Coordinate:
    words = text_of(dataset, "long_name")
    if h5py.check_string_dtype(dataset.dtype) is not None:
        return Coordinate(dimension, list(names_of(dataset)), "", words)
    values = from_stored(values_of(dataset))
    return Coordinate(dimension, values, text_of(dataset, "units"), words)


def _texts(texts: Any) -> dict[int, str]:
    """Return the texts that are not empty, by the number of the run."""
    return {number: text for number, text in enumerate(texts.tolist()) if text}
