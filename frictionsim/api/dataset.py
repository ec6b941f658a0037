"""Results of runs and sweeps as xarray.Dataset: what `xarray.open_dataset` reads of their files.

It takes xarray and h5netcdf some 50 to 140 ms to read a file, and these functions one of them.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from frictionsim.errors import InputError
from frictionsim.io.result_writer import CONVENTIONS, FORMAT_VERSION, is_numbered
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL_NAMES,
    STATUS,
    STATUSES,
    TEXTS,
    VERSION,
    VERSION_NAME,
    Coordinate,
    SweepTable,
    from_stored,
)
from frictionsim.results import Channel
from frictionsim.simulation.averages import words_of

if TYPE_CHECKING:
    from frictionsim.results import Record


def channels_dataset(record: "Record") -> xarray.Dataset:
    """Return the channels over time, with the axes of their columns as coordinates."""
    variables: dict[str, Any] = {}
    for name, values in record.channels.items():
        dimensions = ("time", *filter(None, [record.axes[name]]))
        flags = record.flags.get(name, ())
        channel = Channel(record.units[name], record.long_names[name], flags=flags)
        variables[name] = _variable(dimensions, values, channel)
    coordinates: dict[str, Any] = {"time": variables.pop("time")}
    for axis, members in record.members.items():
        words = axis.replace("_", " ")
        if is_numbered(axis, members):
            coordinates[axis] = _numbers(axis, len(members), words)
        else:
            coordinates[axis] = (axis, np.array(members), {"long_name": f"name of the {words}"})
    versions = {"format_version": np.int64(FORMAT_VERSION), "Conventions": CONVENTIONS}
    return xarray.Dataset(variables, coordinates, record.attributes | versions)


def events_dataset(record: "Record") -> xarray.Dataset:
    """Return the events along the dimension `event`, with the names of the contacts."""
    arrays = dict(record.events)
    contacts = [record.contacts[index] for index in arrays.pop("contact").tolist()]
    # What they would have; those of belts have no more.
    if not contacts and record.attributes["kind"] != "belt_drive":
        for name in record.channels:
            if name not in ("time", "angle", "mode") and not name.startswith("energy_"):
                arrays |= {f"{name}_{side}": np.zeros(0) for side in ("before", "after")}
        arrays["angle"] = np.zeros(0)
    variables: dict[str, Any] = {
        name: _variable(("event",), values, record.of_event(name))
        for name, values in arrays.items()
    }
    words = {"long_name": record.of_event("contact").long_name}
    variables["contact"] = (("event",), np.array(contacts, dtype=str), words)
    coordinates = {
        "event": _numbers("event", len(contacts), "event"),
        "time": variables.pop("time"),
    }
    return xarray.Dataset(variables, coordinates)


def _variable(dimensions: tuple[str, ...], values: Any, channel: Channel) -> Any:
    """Return a variable with the attributes of the file, which is not changed, as results are."""
    view = values.view()
    view.flags.writeable = False
    attributes: dict[str, Any] = {"units": channel.unit, "long_name": channel.long_name}
    return dimensions, view, attributes | _meanings(channel.flags, values.dtype)


def _numbers(dimension: str, count: int, words: str) -> Any:
    attributes = {"units": "1", "long_name": f"number of the {words}, from 0"}
    return dimension, np.arange(count, dtype=np.int32), attributes


def _meanings(flags: Any, dtype: Any) -> dict[str, Any]:
    if not flags:
        return {}
    numbers, meanings = zip(*flags, strict=True)
    return {"flag_values": np.array(numbers, dtype), "flag_meanings": " ".join(meanings)}


SWEEP_ATTRIBUTES = ("study", "scenario", "source", "kind", "title", "design", "status", "reason")


def sweep_dataset(table: SweepTable) -> xarray.Dataset:
    """Return the quantities of a sweep over its keys, or over its runs."""
    dimensions, shape = tuple(table.dimensions), table.shape
    coordinates: dict[str, Any] = {}
    for key, coordinate in table.coordinates.items():
        values, words = coordinate.stored, {"long_name": coordinate.long_name}
        if isinstance(values, list):
            values = np.array(values, dtype=str)
        else:
            words["units"] = coordinate.unit or "1"
        coordinates[key] = (coordinate.dimension, values, words)
    if RUN in table.dimensions:
        words = {"units": "1", "long_name": "number of the run, from 0"}
        coordinates[RUN] = (RUN, np.arange(table.runs), words)
    variables: dict[str, Any] = {}
    for name, values in table.values.items():
        words = {"units": table.units[name], "long_name": words_of(name)}
        variables[name] = (dimensions, values.reshape(shape), words)
    words = {"units": "1", "long_name": "outcome of the run"}
    status = table.status.reshape(shape)
    variables[STATUS] = (dimensions, status, words | _meanings(STATUSES, status.dtype))
    for name, text in TEXTS.items():
        values = np.array(table.text_array(name).tolist(), dtype=str)
        variables[name] = (dimensions, values, {"long_name": text})
    for name, (along, values, text) in table.sobol_datasets.items():
        words = {"long_name": text} | ({} if isinstance(values, list) else {"units": "1"})
        (coordinates if name in along else variables)[name] = (along, values, words)
    versions = {VERSION_NAME: np.int64(VERSION), "Conventions": CONVENTIONS}
    return xarray.Dataset(variables, coordinates, table.attributes | versions)


def sweep_table(dataset: Any) -> SweepTable:
    """Return the table of a dataset of `sweep` or `open_sweep`, or of a part of one.

    Keys of a grid to which one value was given (`sel`, `isel`) are no longer varied. InputError is
    raised if it is no dataset of a sweep.
    """
    attributes = {
        str(name): str(text)
        for name, text in dataset.attrs.items()
        if name not in (VERSION_NAME, "Conventions")
    }
    missing = [name for name in SWEEP_ATTRIBUTES if name not in attributes]
    missing += [name for name in (STATUS, *TEXTS) if name not in dataset.data_vars]
    if missing:
        raise InputError(
            "expected a dataset as fs.sweep and fs.open_sweep return it; this one has no"
            f" '{missing[0]}', which a reduction as mean() leaves out"
        )
    status = dataset[STATUS]
    dimensions = {
        str(name): int(size) for name, size in zip(status.dims, status.shape, strict=True)
    }
    if not dimensions or status.size == 0:
        raise InputError("expected a dataset of several runs, got one run or none of a sweep")
    coordinates = {
        str(key): _coordinate(str(key), values)
        for key, values in dataset.coords.items()
        if key not in (RUN, *SOBOL_NAMES) and values.ndim == 1
    }
    others = {STATUS, *TEXTS, *SOBOL_NAMES}
    names = [str(n) for n in dataset.data_vars if n not in others]
    for name in (*names, *TEXTS):
        if dataset[name].dims != status.dims:
            raise InputError(f"'{name}' of this dataset does not have a value for each run")
    texts = {name: dataset[name].values.reshape(-1).tolist() for name in TEXTS}
    return SweepTable(
        attributes=attributes,
        dimensions=dimensions,
        coordinates=coordinates,
        units={name: str(dataset[name].attrs.get("units", "1")) for name in names},
        values={n: np.asarray(dataset[n].values, dtype=np.float64).reshape(-1) for n in names},
        status=np.asarray(status.values, dtype=np.int8).reshape(-1),
        texts={name: {i: t for i, t in enumerate(column) if t} for name, column in texts.items()},
    )


def _coordinate(key: str, variable: Any) -> Coordinate:
    values, words = variable.values, str(variable.attrs.get("long_name", key))
    dimension = str(variable.dims[0])
    if values.dtype.kind in "OUST":
        return Coordinate(dimension, [str(value) for value in values], "", words)
    return Coordinate(dimension, from_stored(values), str(variable.attrs.get("units", "1")), words)
