"""Reading a result file by HDF5; `hdf5_reader` imports it with the first file that is read."""

from collections.abc import Iterator, Set
from contextlib import contextmanager
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.hdf5_structure import (
    MAX_AXIS,
    NOT_HDF5,
    CheckedFile,
    check_version,
    checked_dataset,
    checked_group,
    integers_of,
    opened,
    rows_of,
    type_of,
)
from frictionsim.io.result_format import (
    ANSWER_BYTES,
    COUNTS,
    READABLE_VERSIONS,
    STATUSES,
    Checkpoint,
    LongChannel,
    numbered_members,
    state_digest,
)
from frictionsim.io.unfinished import unfinished_beside
from frictionsim.results import MODES, Check, Quantities, Quantity, Record, SolverStatistics
from frictionsim.version import __version__

ATTRIBUTES = ("backend", "frictionsim_version", "kind", "reason", "scenario", "status", "title")
GROUPS = ("events", "quantities", "audit", "solver", "checkpoint")
LONG_BYTES = 64 * 2**20  # of all channels together
LONG_CHANNEL_BYTES = 4 * 2**20  # of a channel of a long result that is read by rows
NOT_OURS = "it is HDF5, but not a frictionsim result"
KNOWN_MODES = [value for value, _ in MODES]


def record(path: str) -> Record:
    """Return the content of a result file; long channels as shapes."""
    with _opened(path) as file:
        attributes = _attributes(file)
        datasets, scales, groups = _top_level(file)
        events, contacts = _events(file, groups.get("events"))
        result = Record(
            attributes=attributes,
            channels=_channels(file, datasets),
            units={n: file.text_of(item, "units") for n, item in datasets.items()},
            long_names={n: file.text_of(item, "long_name") for n, item in datasets.items()},
            axes={name: _axis_of(item, scales.keys()) for name, item in datasets.items()},
            members={name: _members(file, scales[name]) for name in sorted(scales)},
            events=events,
            contacts=contacts,
            flags={n: file.flags_of(item) for n, item in datasets.items() if _has_flags(item)},
            quantities=_quantities(file, groups.get("quantities")),
            checks=_checks(file, groups.get("audit")),
            statistics=_statistics(file, groups.get("solver")),
        )
        _check_shapes(result)
        return result


def rows(path: str, name: str, start: int, stop: int) -> Any:
    """Return samples start to stop - 1 of a channel."""
    with _opened(path) as file:
        datasets, _, _ = _top_level(file)
        return rows_of(datasets[name], slice(start, stop))


def samples(name: str, places: list[tuple[str, list[int]]]) -> list[Any]:
    """Return some samples of a channel of each of some files.

    A place is the path of a file and the numbers of samples in it.
    """
    contents = []
    for path, numbers in places:
        with _opened(path) as file:
            datasets, _, _ = _top_level(file)
            item = datasets[name]
            file.claim(len(numbers) * item.nbytes // max(len(item), 1), name)
            contents.append(np.stack([rows_of(item, number) for number in numbers]))
    return contents


def channels(names: list[str], paths: list[str]) -> list[dict[str, Any]]:
    """Return channels of as many of the files as are read together, at least of the first.

    Without names, all channels are returned. A channel without columns has as many bytes in a file
    as in memory, so that those of many small files are small.
    """
    contents: list[dict[str, Any]] = []
    free_bytes = ANSWER_BYTES
    for path in paths:
        with _opened(path) as file:
            every, _, _ = _top_level(file)
            wanted = {name: every[name] for name in names} if names else every
            for name, item in wanted.items():
                file.check_stored(item)
                size = item.size * type_of(item).itemsize
                if item.ndim < 2 and size > item.id.get_storage_size():
                    raise ValueError(f"{name}: no segment has its samples compressed")
            free_bytes -= sum(item.nbytes for item in wanted.values())
            if contents and free_bytes < 0:
                break
            contents.append({name: file.values_of(item) for name, item in wanted.items()})
    return contents


def checkpoint(path: str) -> Checkpoint:
    """Return the checkpoint of a result file."""
    with _opened(path) as file:
        attributes = _attributes(file)
        top = dict(file.members(file.root))
        reason = _resume_obstacle(path, attributes, "checkpoint" in top)
        if reason:
            raise InputError(f"{path}: cannot resume this run: {reason}")
        group = checked_group(top["checkpoint"], "checkpoint")
        state = {}
        for name, item in file.datasets(group):
            if not item.is_scale:
                if item.dtype.kind not in "fiubS":
                    raise TypeError(f"{name} does not hold numbers")
                file.claim(item.nbytes, name)
                state[name] = item[...].view(item.dtype.str)  # without notes of HDF5
        if file.text_of(group, "digest") != state_digest(attributes, state):
            raise InputError(f"{path}: cannot resume this run: its checkpoint is damaged")
    return Checkpoint(attributes, state)


def _resume_obstacle(path: str, attributes: dict[str, str], has_checkpoint: bool) -> str:
    if attributes["status"] == "done":
        return f"it is done{unfinished_beside(Path(path))}"
    if attributes["frictionsim_version"] != __version__:
        return (
            f"it was written by version {attributes['frictionsim_version']}, this is {__version__};"
            " solve its scenario again"
        )
    if not has_checkpoint:
        return f"it has no checkpoint ({attributes['status']}: {attributes['reason']})"
    return ""


@contextmanager
def _opened(path: str) -> Iterator[CheckedFile]:
    """Open a result file, as `opened`."""
    with opened(path, "result", _fault) as file:
        check_version(file, path, "result", "format_version", READABLE_VERSIONS)
        yield file


def _fault(error: Exception) -> str:
    return NOT_HDF5 if isinstance(error, OSError) else NOT_OURS


def _attributes(file: CheckedFile) -> dict[str, str]:
    """Return the root attributes; raise KeyError or ValueError if one is missing or wrong."""
    attributes = file.texts_of(file.root)
    missing = [name for name in ATTRIBUTES if name not in attributes]
    if missing:
        raise KeyError(*missing)
    if attributes["status"] not in STATUSES:
        raise ValueError("a status that no run has")
    return attributes


def _top_level(file: CheckedFile) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return the channels, the scales of their columns and the groups of a file, checked."""
    channels: dict[str, Any] = {}
    scales: dict[str, Any] = {}
    groups: dict[str, Any] = {}
    for name, item in file.members(file.root):
        if name in GROUPS:
            groups[name] = checked_group(item, name)
        else:
            is_scale = checked_dataset(item, name).is_scale and name != "time"
            (scales if is_scale else channels)[name] = item
    return channels, scales, groups


def _channels(file: CheckedFile, datasets: dict[str, Any]) -> dict[str, Any]:
    """Return the channels; the large ones of a long result as shapes."""
    is_long = sum(item.nbytes for item in datasets.values()) > LONG_BYTES
    contents: dict[str, Any] = {}
    for name, item in datasets.items():
        if is_long and name != "time" and item.nbytes > LONG_CHANNEL_BYTES:
            file.check_stored(item)
            contents[name] = LongChannel(item.shape, type_of(item).str)
        else:
            contents[name] = file.values_of(item)
    return contents


def _events(file: CheckedFile, group: Any) -> tuple[dict[str, Any], list[str]]:
    """Return the events and the names of their contacts; empty arrays without events."""
    if group is None and integers_of(file.root, "format_version")[0] > 1:
        types = {"time": "f8", "contact": "i4", "mode_from": "i1", "mode_to": "i1"}
        return {name: np.zeros(0, dtype) for name, dtype in types.items()}, []
    datasets = dict(file.datasets(group))
    contacts = file.text_of(datasets["contact"], "flag_meanings").split()
    return {n: file.values_of(item) for n, item in datasets.items() if n != "event"}, contacts


def _quantities(file: CheckedFile, group: Any) -> Quantities:
    quantities: Quantities = {}
    for name, item in file.datasets(group):
        value = float(file.values_of(item))
        quantities[name] = Quantity(None if isnan(value) else value, file.text_of(item, "units"))
    return quantities


def _checks(file: CheckedFile, group: Any) -> dict[str, Check]:
    if group is None:
        return {}
    items = dict(file.datasets(group))
    names = file.names_of(items["check"])
    values, limits = (file.values_of(items[name]) for name in ("value", "limit"))
    return {
        name: Check(float(value), float(limit))
        for name, value, limit in zip(names, values, limits, strict=True)
    }


def _statistics(file: CheckedFile, group: Any) -> SolverStatistics | None:
    if group is None:
        return None
    items = dict(file.datasets(group))
    counts = {name: int(file.values_of(items[name])) for name in COUNTS}
    return SolverStatistics(**counts, wall_seconds=None, compile_seconds=None)


def _members(file: CheckedFile, scale: Any) -> tuple[str, ...]:
    """Return the names of the members of an axis; an attribute in version 1."""
    if scale.dtype.kind == "O":
        return file.names_of(scale)
    if scale.size > MAX_AXIS:
        raise ValueError(f"{scale.name} has too many members")
    if "names" in scale.attrs:
        names = tuple(file.text_of(scale, "names").split())
    else:
        names = numbered_members(scale.size)
    if scale.shape != (len(names),):
        raise ValueError(f"{scale.name} is not an axis")
    return names


def _has_flags(dataset: Any) -> bool:
    return "flag_values" in dataset.attrs and dataset.dtype.kind in "iu"


def _axis_of(dataset: Any, scales: Set[str]) -> str:
    """Return the axis of the columns of a dataset; empty without columns."""
    if dataset.ndim < 2:
        return ""
    axis = str(next(iter(dataset.dims[1].keys()), ""))
    if axis not in scales:
        raise ValueError(f"{dataset.name} has columns without an axis")
    return axis


def _check_shapes(result: Record) -> None:
    """Check the lengths of all channels, and the contacts and modes of the events."""
    for channels, axes in ((result.channels, result.axes), (result.events, {})):
        n = channels["time"].size
        for name, values in channels.items():
            axis = axes.get(name, "")
            if values.shape != ((n, len(result.members[axis])) if axis else (n,)):
                raise ValueError(f"{name} is not a channel over time")
    time = result.channels["time"]
    if not (np.isfinite(time).all() and np.all(time[1:] > time[:-1])):
        raise ValueError("the time does not increase")
    events = result.events
    if not np.isfinite(events["time"]).all():
        raise ValueError("an event has no time")
    if not np.isin(events["contact"], np.arange(len(result.contacts))).all():
        raise ValueError("an event has a contact without a name")
    if not all(np.isin(events[name], KNOWN_MODES).all() for name in ("mode_from", "mode_to")):
        raise ValueError("an event has a mode that there is not")
