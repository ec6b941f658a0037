"""Results as xarray.Dataset."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from xarray.backends import BackendArray
from xarray.core import indexing

from frictionsim.io.result_format import is_numbered
from frictionsim.results import Channel
from frictionsim.simulation.stored_channel import StoredChannel

if TYPE_CHECKING:
    from frictionsim.results import Record


class _LazyArray(BackendArray):
    """A stored channel as xarray wants what a file holds."""

    def __init__(self, channel: StoredChannel) -> None:
        self.shape, self.dtype, self._channel = channel.shape, channel.dtype, channel

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> Any:
        rows, *columns = key
        # One axis after the other: numpy takes lists of both for pairs.
        found = self._channel[rows]
        return found[(*(() if isinstance(rows, int) else (slice(None),)), *columns)]


def lazy_array(channel: StoredChannel) -> Any:
    """Return a channel as data of an `xarray.Variable`; only what is selected is read."""
    return indexing.LazilyIndexedArray(_LazyArray(channel))


OF_THE_FORMAT = ("format_version", "Conventions")


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
    attributes = {k: text for k, text in record.attributes.items() if k not in OF_THE_FORMAT}
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
    if isinstance(values, StoredChannel):
        return lazy_array(values)
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
    found: dict[str, Any] = {"units": channel.unit, "long_name": channel.long_name}
    if channel.flags:
        found["flag_values"] = [value for value, _ in channel.flags]
        found["flag_meanings"] = " ".join(meaning for _, meaning in channel.flags)
    return found
