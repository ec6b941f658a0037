"""Results of runs and sweeps as xarray.Dataset."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from frictionsim.errors import InputError
from frictionsim.io.result_format import is_numbered
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL_NAMES,
    STATUS,
    STATUSES,
    TEXTS,
    Coordinate,
    SweepTable,
)
from frictionsim.results import Channel
from frictionsim.simulation.averages import WEIGHTED

if TYPE_CHECKING:
    from frictionsim.results import Record


FORMAT_ATTRIBUTES = ("format_version", "Conventions")


def channels_dataset(record: "Record") -> xarray.Dataset:
    """Return the channels over time, with the axes of their columns as coordinates.

    Data and attributes are those of the file, without the version of its format.
    """
    time = _fixed(record.channels["time"])
    coordinates: dict[str, Any] = {"time": ("time", time, _of(record, "time"))}
    for axis, members in record.members.items():
        numbered = is_numbered(axis, members)
        values = np.arange(len(members), dtype=np.int32) if numbered else np.array(members)
        coordinates[axis] = (axis, values, _axis_attributes(axis, numbered))
    variables = {
        name: (
            ("time", record.axes[name]) if record.axes[name] else ("time",),
            _fixed(values),
            _of(record, name),
        )
        for name, values in record.channels.items()
        if name != "time"
    }
    attributes = {k: text for k, text in record.attributes.items() if k not in FORMAT_ATTRIBUTES}
    return xarray.Dataset(variables, coordinates, attributes)


def events_dataset(record: "Record") -> xarray.Dataset:
    """Return the events along the dimension `event`, with the names of the contacts."""
    variables: dict[str, Any] = {
        name: (("event",), _fixed(values), _attributes(record.of_event(name)))
        for name, values in record.events.items()
        if name not in ("time", "contact")
    }
    if not len(record.events["time"]):
        variables |= _empty(record)
    names = [record.contacts[int(index)] for index in record.events["contact"]]
    contacts = np.array(names, dtype=str)
    variables["contact"] = (("event",), contacts, {"long_name": "contact that changes its mode"})
    time = (("event",), _fixed(record.events["time"]), _attributes(record.of_event("time")))
    numbers = np.arange(len(names), dtype=np.int32)
    event = ("event", numbers, {"units": "1", "long_name": "number of the event, from 0"})
    return xarray.Dataset(variables, {"event": event, "time": time})


def _empty(record: "Record") -> dict[str, Any]:
    """Return the variables that the events would have, if there were any; belts have no others."""
    if record.members:
        return {}
    names = [
        name
        for name in record.channels
        if name not in ("time", "angle", "mode") and not name.startswith("energy_")
    ]
    sides = [f"{name}_{side}" for name in names for side in ("before", "after")]
    return {
        name: (("event",), np.zeros(0), _attributes(record.of_event(name)))
        for name in ("angle", *sides)
    }


def _fixed(values: Any) -> Any:
    """Return a view of an array that cannot be changed: results are not changed."""
    view = values.view()
    view.flags.writeable = False
    return view


def _axis_attributes(axis: str, numbered: bool) -> dict[str, Any]:
    """Return the attributes of an axis, as in a file."""
    words = axis.replace("_", " ")
    if numbered:
        return {"units": "1", "long_name": f"number of the {words}, from 0"}
    return {"long_name": f"name of the {words}"}


def _of(record: "Record", name: str) -> dict[str, Any]:
    channel = Channel(record.units[name], record.long_names[name], flags=record.flags.get(name, ()))
    return _attributes(channel)


def _attributes(channel: Channel) -> dict[str, Any]:
    """Return the attributes of a channel, as in a file."""
    attributes: dict[str, Any] = {"units": channel.unit, "long_name": channel.long_name}
    if channel.flags:
        attributes["flag_values"] = [value for value, _ in channel.flags]
        attributes["flag_meanings"] = " ".join(meaning for _, meaning in channel.flags)
    return attributes


SWEEP_ATTRIBUTES = ("study", "scenario", "source", "kind", "title", "design", "status", "reason")


def _words_of(quantity: str) -> str:
    """Return the long name of a quantity of a sweep."""
    mean = ", weighted mean or mean over whole periods" if quantity in WEIGHTED else ""
    return quantity.replace("_", " ") + mean


def sweep_dataset(table: SweepTable) -> xarray.Dataset:
    """Return a sweep as a dataset, with the data and attributes of its file."""
    dimensions, shape = tuple(table.dimensions), table.shape
    coordinates: dict[str, Any] = {
        key: (coordinate.dimension, _key_values(coordinate), _key_attributes(coordinate))
        for key, coordinate in table.coordinates.items()
    }
    if RUN in table.dimensions:
        run_attributes = {"units": "1", "long_name": "number of the run, from 0"}
        coordinates[RUN] = (RUN, np.arange(table.runs), run_attributes)
    variables: dict[str, Any] = {
        name: (
            dimensions,
            values.reshape(shape),
            {"units": table.units[name], "long_name": _words_of(name)},
        )
        for name, values in table.values.items()
    }
    numbers, meanings = zip(*STATUSES, strict=True)
    variables[STATUS] = (
        dimensions,
        table.status.reshape(shape),
        {
            "units": "1",
            "long_name": "outcome of the run",
            "flag_values": list(numbers),
            "flag_meanings": " ".join(meanings),
        },
    )
    for name, words in TEXTS.items():
        variables[name] = (dimensions, table.text_array(name), {"long_name": words})
    for name, (along, values, words) in table.sobol_datasets.items():
        attributes = {"long_name": words} | ({} if isinstance(values, list) else {"units": "1"})
        (coordinates if name in along else variables)[name] = (along, values, attributes)
    return xarray.Dataset(variables, coordinates, dict(table.attributes))


def _key_values(coordinate: Coordinate) -> Any:
    values = coordinate.values
    return np.array(values, dtype=str) if isinstance(values, list) else values


def _key_attributes(coordinate: Coordinate) -> dict[str, str]:
    words = {"long_name": coordinate.long_name}
    return (
        words if isinstance(coordinate.values, list) else words | {"units": coordinate.unit or "1"}
    )


def sweep_table(dataset: Any) -> SweepTable:
    """Return the table of a dataset of `sweep` or `open_sweep`, or of a part of one.

    Parameters
    ----------
    dataset : xarray.Dataset
        Keys of a grid to which one value was given (`sel`, `isel`) are no longer varied.

    Raises
    ------
    InputError
        If it is no dataset of a sweep.
    """
    attributes = {str(name): str(text) for name, text in dataset.attrs.items()}
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
    return Coordinate(dimension, values, str(variable.attrs.get("units", "1")), words)
