"""Read result files in HDF5 and check them; `hdf5_writer` documents the format."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import isnan
from os.path import isdir, isfile
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from frictionsim import __version__
from frictionsim.errors import InputError, near_files
from frictionsim.io.atomic_write import SUFFIXES
from frictionsim.io.checksum import checksum_mismatch
from frictionsim.io.chunks import FileSource, is_long, stamp_of
from frictionsim.io.result_format import (
    COUNTS,
    READABLE_VERSIONS,
    SEGMENTS,
    numbered_members,
    state_digest,
)
from frictionsim.io.sample_segments import SegmentsAndTail, segments_of
from frictionsim.results import Check, Flags, Quantities, Quantity, Record, SolverStatistics
from frictionsim.simulation.stored_channel import StoredChannel

ATTRIBUTES = (
    "backend",
    "frictionsim_version",
    "kind",
    "reason",
    "scenario",
    "status",
    "title",
)
GROUPS = ("events", "quantities", "audit", "solver", "checkpoint")
# DEFLATE's maximum ratio is 1032:1; a larger claim means a damaged file.
MAX_GZIP_RATIO = 1032


def read(path: Path) -> Record:
    """Read a result file.

    Raises
    ------
    InputError
        If it does not exist, is not HDF5, not a frictionsim result, or of another format version.
    """
    with _opened(path) as file:
        return _read(file)


def may_be_done(path: Path) -> bool:
    """Return whether a file holds a complete result or cannot be read; false for an empty file."""
    try:
        empty = path.stat().st_size == 0
    except OSError:  # no such file
        return False
    try:
        if empty or checksum_mismatch(path):
            return not empty
        with h5py.File(path, "r") as file:
            return _text(file.attrs["status"]) not in ("interrupted", "failed")
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError):
        return True


def is_ours(path: Path) -> bool:
    """Return whether a file is a result or a table of costs of this program."""
    try:
        if checksum_mismatch(path):
            return False
        with h5py.File(path, "r") as file:
            return "frictionsim_version" in file.attrs
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError):
        return False


class Checkpoint(NamedTuple):
    """The data to resume a run: the attributes of its file and the state of its solver."""

    attributes: dict[str, str]
    state: dict[str, Any]


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the checkpoint of a result file.

    Raises
    ------
    InputError
        As `read`; or if the run is done, has no checkpoint, or was written by another version.
    """
    with _opened(path) as file:
        attributes = _attributes(file)
        reason = _resume_obstacle(file, attributes)
        if reason:
            raise InputError(f"{path}: cannot resume this run: {reason}")
        stored = {name: _check_size(item) for name, item in file["checkpoint"].items()}
        state = {name: item[...] for name, item in stored.items() if not item.is_scale}
        if file["checkpoint"].attrs["digest"] != state_digest(attributes, state):
            raise InputError(f"{path}: cannot resume this run: its checkpoint is damaged")
    return Checkpoint(attributes, state)


def _resume_obstacle(file: Any, attributes: dict[str, str]) -> str:
    if attributes["status"] == "done":
        return "it is done"
    if attributes["frictionsim_version"] != __version__:
        return (
            f"it was written by version {attributes['frictionsim_version']}, this is {__version__};"
            " solve its scenario again"
        )
    if "checkpoint" not in file:
        return f"it has no checkpoint ({attributes['status']}: {attributes['reason']})"
    return ""


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a result file; errors within the context become InputError with the file's name."""
    try:
        if checksum_mismatch(path):
            raise InputError(
                f"{path}: cannot read this result: it is damaged (its checksum does not match)"
            )
        with h5py.File(path, "r") as file:
            version = file.attrs["format_version"]
            if version not in READABLE_VERSIONS:
                raise InputError(
                    f"{path}: cannot read this result: its format version is {version}, this"
                    f" program reads versions {min(READABLE_VERSIONS)} to {max(READABLE_VERSIONS)}"
                )
            if "cost" in file:
                raise InputError(
                    f"{path}: this is a table of `frictionsim cost`, not the result of a run"
                )
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot read this result: {_why_not_open(path)}") from error
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
        raise InputError(
            f"{path}: cannot read this result: it is HDF5, but not a frictionsim result"
        ) from error


def _why_not_open(path: Path) -> str:
    if isdir(path):  # false for a name that is too long, where Path.is_dir fails
        return "this is a folder; give the name of a result file"
    if not isfile(path):
        return "there is no such file" + near_files(path, SUFFIXES)
    if path.suffix == ".toml":
        return f"this is a scenario; 'frictionsim solve {path}' makes a result of it"
    return "it is not a readable HDF5 file"


def _attributes(file: Any) -> dict[str, str]:
    """Return the root attributes; raise KeyError if a required one is missing."""
    missing = [name for name in ATTRIBUTES if name not in file.attrs]
    if missing:
        raise KeyError(*missing)
    return {key: _text(value) for key, value in file.attrs.items()}


def _read(file: Any) -> Record:
    attributes = _attributes(file)
    every = {name: _check_size(item) for name, item in file.items() if name not in GROUPS}
    scales = {name for name, item in every.items() if item.is_scale and name != "time"}
    datasets = {name: item for name, item in every.items() if name not in scales}
    events, contacts = _events(file)
    record = Record(
        attributes=attributes,
        channels=_channels(file, datasets),
        units={name: _text(item.attrs["units"]) for name, item in datasets.items()},
        long_names={name: _text(item.attrs["long_name"]) for name, item in datasets.items()},
        axes={name: _axis_of(item) for name, item in datasets.items()},
        members={name: _members(every[name]) for name in sorted(scales)},
        events=events,
        contacts=contacts,
        flags={name: _flags(item) for name, item in datasets.items() if _has_flags(item)},
        quantities=_quantities(file),
        checks=_checks(file),
        statistics=_statistics(file),
    )
    _check_shapes(record)
    reference = attributes.pop(SEGMENTS, None)
    return record if reference is None else _with_segments(record, Path(file.filename), reference)


def _channels(file: Any, datasets: dict[str, Any]) -> dict[str, Any]:
    """Return the channels; those of several columns of a long run are read when needed."""
    if not is_long(datasets):
        return {name: _values(item) for name, item in datasets.items()}
    source = FileSource(str(Path(file.filename).resolve()), stamp_of(file.filename))
    return {
        name: _values(item)
        if item.ndim < 2
        else StoredChannel(source, name, item.shape, _type_of(item))
        for name, item in datasets.items()
    }


def _with_segments(record: Record, path: Path, reference: str) -> Record:
    """Return a record with the samples of its segments before its own.

    Raises
    ------
    InputError
        If segments are missing.
    """
    segments, count, rows = segments_of(path, reference)
    for number in (0, count - 1):
        segments.rows(number, "time", 0, 1)
    source = SegmentsAndTail(segments, count, rows, record.channels)
    before = count * rows
    channels: dict[str, Any] = {
        name: StoredChannel(source, name, (before + len(tail), *tail.shape[1:]), tail.dtype)
        for name, tail in record.channels.items()
    }
    return record._replace(channels=channels | {"time": np.asarray(channels["time"])})


def folder_of_segments(path: Path) -> Path | None:
    """Return the folder with the segments of an incomplete result; None if it has none."""
    try:
        with h5py.File(path, "r") as file:
            reference = file.attrs.get(SEGMENTS)
            return None if reference is None else segments_of(path, _text(reference))[0].folder
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError):
        return None


def _events(file: Any) -> tuple[dict[str, Any], list[str]]:
    """Return the events as arrays and the names of their contacts; empty arrays without events."""
    if "events" not in file and file.attrs["format_version"] > 1:
        types = {"time": "f8", "contact": "i4", "mode_from": "i1", "mode_to": "i1"}
        return {name: np.zeros(0, dtype) for name, dtype in types.items()}, []
    group = file["events"]
    events = {name: _values(_check_size(item)) for name, item in group.items() if name != "event"}
    return events, _text(group["contact"].attrs["flag_meanings"]).split()


def _quantities(file: Any) -> Quantities:
    found: Quantities = {}
    for name, item in file.get("quantities", {}).items():
        value = float(_values(_check_size(item)))
        found[name] = Quantity(None if isnan(value) else value, _text(item.attrs["units"]))
    return found


def _checks(file: Any) -> dict[str, Check]:
    if "audit" not in file:
        return {}
    group = file["audit"]
    names = _names(_check_size(group["check"]))
    values, limits = (_values(_check_size(group[name])) for name in ("value", "limit"))
    return {
        name: Check(float(value), float(limit))
        for name, value, limit in zip(names, values, limits, strict=True)
    }


def _statistics(file: Any) -> SolverStatistics | None:
    if "solver" not in file:
        return None
    counts = {name: int(_values(_check_size(file["solver"][name]))) for name in COUNTS}
    return SolverStatistics(**counts, wall_seconds=None, compile_seconds=None)


def _has_flags(dataset: Any) -> bool:
    return "flag_values" in dataset.attrs and dataset.dtype.kind in "iu"


def _flags(dataset: Any) -> Flags:
    values = np.asarray(dataset.attrs["flag_values"]).tolist()
    meanings = _text(dataset.attrs["flag_meanings"]).split()
    return tuple(zip(map(int, values), meanings, strict=True))


def _text(value: Any) -> str:
    """Return an attribute as printable text; bytes that are not UTF-8 are replaced."""
    return str(value).encode("utf-8", "replace").decode()


def _axis_of(dataset: Any) -> str:
    """Return the axis of the columns of a dataset; empty if it has no columns."""
    return next(iter(dataset.dims[1].keys()), "") if dataset.ndim > 1 else ""


def _members(scale: Any) -> tuple[str, ...]:
    """Return the names of the members of an axis; format version 1 has them as an attribute."""
    if scale.dtype.kind == "O":
        return _names(scale)
    names = scale.attrs.get("names")
    members = numbered_members(scale.size) if names is None else tuple(_text(names).split())
    if scale.shape != (len(members),):
        raise ValueError(f"{scale.name} is not an axis")
    return members


def _names(dataset: Any) -> tuple[str, ...]:
    if dataset.ndim != 1 or h5py.check_string_dtype(dataset.dtype) is None:
        raise ValueError(f"{dataset.name} does not hold names")
    return tuple(_text(name) for name in dataset.asstr(errors="replace")[...])


def _check_shapes(record: Record) -> None:
    """Check that all channels have the length of the time, and that contacts have names."""
    for channels, axes in ((record.channels, record.axes), (record.events, {})):
        n = channels["time"].size
        for name, values in channels.items():
            axis = axes.get(name, "")
            if values.shape != ((n, len(record.members[axis])) if axis else (n,)):
                raise ValueError(f"{name} is not a channel over time")
    contact, *_ = (record.events[name] for name in ("contact", "mode_from", "mode_to"))
    if not np.all(np.isin(contact, np.arange(len(record.contacts)))):
        raise ValueError("an event has a contact without a name")


def _check_size(dataset: Any) -> Any:
    """Return a dataset; raise ValueError if it claims more data than its file can hold."""
    size = dataset.file.id.get_filesize()
    if not isinstance(dataset, h5py.Dataset) or dataset.nbytes > MAX_GZIP_RATIO * size:
        raise ValueError(f"{dataset.name} is not a channel")
    return dataset


def _values(dataset: Any) -> Any:
    if dataset.dtype.kind not in "fiub":
        raise TypeError(f"{dataset.name} does not hold real numbers")
    return np.asarray(dataset[...]).astype(_type_of(dataset), copy=False)


def _type_of(dataset: Any) -> Any:
    """Return the type of the values of a dataset in memory."""
    return dataset.dtype if dataset.dtype.kind == "i" else np.dtype(np.float64)
