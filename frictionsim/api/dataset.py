"""Results as xarray.Dataset."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from frictionsim.results import Channel

if TYPE_CHECKING:
    from frictionsim.results import Record


def channels_dataset(record: "Record") -> xarray.Dataset:
    """Return the channels over time, with the axes of their columns as coordinates.

    Parameters
    ----------
    record : Record

    Returns
    -------
    xarray.Dataset
        Its attributes are those of the file.
    """
    coordinates: dict[str, Any] = {"time": ("time", record.channels["time"], _of(record, "time"))}
    for axis, members in record.members.items():
        numbered = all(name.isdecimal() for name in members)
        values = np.arange(len(members)) if numbered else np.array(members)
        coordinates[axis] = (axis, values)
    variables = {
        name: (
            ("time", record.axes[name]) if record.axes[name] else ("time",),
            values,
            _of(record, name),
        )
        for name, values in record.channels.items()
        if name != "time"
    }
    return xarray.Dataset(variables, coordinates, dict(record.attributes))


def events_dataset(record: "Record") -> xarray.Dataset:
    """Return the events along the dimension `event`, with the names of the contacts.

    Parameters
    ----------
    record : Record

    Returns
    -------
    xarray.Dataset
    """
    variables: dict[str, Any] = {
        name: (("event",), values, _attributes(record.of_event(name)))
        for name, values in record.events.items()
        if name not in ("time", "contact")
    }
    names = [record.contacts[int(index)] for index in record.events["contact"]]
    contacts = np.array(names, dtype=str)
    variables["contact"] = (("event",), contacts, {"long_name": "contact that changes its mode"})
    time = (("event",), record.events["time"], _attributes(record.of_event("time")))
    event = ("event", np.arange(len(names)))
    return xarray.Dataset(variables, {"event": event, "time": time})


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
