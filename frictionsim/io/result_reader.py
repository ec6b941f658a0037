"""Read result files; `result_writer` and docs/result-files.md say what they hold.

The checksum at the end of a file tells damage before HDF5 sees it. What HDF5 would do beyond
reading data is refused: links, data in other files, filters that load code, and more data than the
file can hold.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from math import isnan
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionsim.errors import InputError, near_files
from frictionsim.io.checksum import is_damaged
from frictionsim.io.names import PARTIAL, RUNS, unfinished_beside
from frictionsim.io.output_file import SUFFIXES, UNFINISHED_SWEEP
from frictionsim.io.result_format import (
    COUNTS,
    FORMAT_VERSION,
    STATUSES,
    Checkpoint,
    numbered_members,
    state_digest,
)
from frictionsim.results import (
    HDF5_SIGNATURE,
    Check,
    Quantity,
    Record,
    SolverStatistics,
)
from frictionsim.simulation.sample_store import SAMPLES
from frictionsim.version import __version__

ATTRIBUTES = ("backend", "frictionsim_version", "kind", "reason", "scenario", "status", "title")
GROUPS = ("events", "quantities", "audit", "solver", "checkpoint")
VERSION, SWEEP_VERSION = "format_version", "sweep_version"
WHOLE = 64 * 2**20  # bytes of a file that is read whole when it is opened
MAX_RATIO = 1032  # of DEFLATE; a larger claim is none of a file that is whole
BUILT_IN = (h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE)
NUMBERS_AND_TEXTS = "fiubOS"  # kinds of the types that our files have


class FileChannels(Mapping[str, Any]):
    """The channels of a large file: each is read when it is wanted, and kept.

    InputError is raised if the file has changed since it was opened.
    """

    def __init__(self, path: Path, names: list[str]) -> None:
        self._path, self._status = path.absolute(), _identity(os.stat(path))
        self._names, self._read = names, dict[str, Any]()

    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            raise KeyError(name)
        if name not in self._read:
            try:
                with h5py.File(self._path, "r", locking=False) as file:
                    values = values_of(file[name])
                is_same = _identity(os.stat(self._path)) == self._status
            except (OSError, KeyError):
                is_same = False
            if not is_same:
                raise InputError(f"{self._path}: it has changed since it was opened; open it again")
            self._read[name] = values
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _identity(status: os.stat_result) -> tuple[int, ...]:
    """Return what changes when a file is replaced or written to."""
    return status.st_ino, status.st_size, status.st_mtime_ns


def read(path: Path) -> Record:
    """Read a result file.

    Raises
    ------
    InputError
        If there is none, it is not readable, damaged or of another program, or it is a sweep.
    """
    is_sweep = InputError(
        f"{path}: this is a sweep, not the result of a run; 'frictionsim plot {path}' draws it, and"
        " fs.open_sweep reads it"
    )
    if is_unfinished_sweep(path):
        raise is_sweep
    with opened(path) as file:
        if SWEEP_VERSION in file.attrs:
            raise is_sweep
        return record_in(file, path)


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the state to resume a run from.

    Raises
    ------
    InputError
        If the run cannot be resumed.
    """
    with opened(path) as file:
        attributes = _attributes(file, path)
        if reason := _resume_obstacle(path, attributes, "checkpoint" in file):
            raise InputError(f"{path}: cannot resume this run: {reason}")
        group = file["checkpoint"]
        state = {
            name: item[...].view(item.dtype.str)  # without notes of HDF5
            for name, item in group.items()
            if not item.is_scale
        }
        if group.attrs["digest"] != state_digest(attributes, state):
            raise InputError(f"{path}: cannot resume this run: its checkpoint is damaged")
        if any(name.startswith(SAMPLES) for name in state):
            channels = {name: item for name, item in _datasets(file).items() if not _is_axis(item)}
            for name, item in channels.items():
                state.setdefault(SAMPLES + name, item[...].astype(np.float64))
    return Checkpoint(attributes, state)


def _resume_obstacle(path: Path, attributes: dict[str, str], has_checkpoint: bool) -> str:
    if attributes["status"] == "done":
        return f"it is done{unfinished_beside(path)}"
    if attributes["frictionsim_version"] != __version__:
        return (
            f"it was written by version {attributes['frictionsim_version']}, this is {__version__};"
            " solve its scenario again"
        )
    if not has_checkpoint:
        return f"it has no checkpoint ({attributes['status']}: {attributes['reason']})"
    return ""


@contextmanager
def opened(path: Path, what: str = "result") -> Iterator[h5py.File]:
    """Return the context of a checked HDF5 file; what goes wrong within becomes an InputError.

    A file of at most `WHOLE` bytes is read into memory first.
    """
    try:
        if not os.path.isfile(path):  # a pipe, if opened, would wait for its writer
            raise InputError(f"{path}: cannot read this {what}: {_open_problem(path)}")
        with path.open("rb") as disk:
            size = os.fstat(disk.fileno()).st_size
            source = BytesIO(disk.read()) if size <= WHOLE else disk
            problem = "it is damaged (its checksum does not match)" if is_damaged(source) else ""
            source.seek(0)
            if not problem and source.read(len(HDF5_SIGNATURE)) != HDF5_SIGNATURE:
                problem = _open_problem(path)
            if problem:
                raise InputError(f"{path}: cannot read this {what}: {problem}")
            # Without locks: files are replaced as a whole, and some systems do not grant one.
            place = path if source is disk else source
            with h5py.File(place, "r", locking=False) as file:
                _check_structure(file, MAX_RATIO * size)
                yield file
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"{path}: cannot read this {what}: it does not fit into memory") from None
    except OSError as error:
        reason = error.strerror or "it is not a readable HDF5 file"
        raise InputError(f"{path}: cannot read this {what}: {reason}") from None
    except Exception:  # whatever h5py says of bits that are none of a file of ours
        raise InputError(
            f"{path}: cannot read this {what}: it is HDF5, but not a frictionsim {what}"
        ) from None


def is_unfinished_sweep(path: Path) -> bool:
    """Return whether a file is an unfinished sweep, which is no HDF5; not if there is none.

    It may be empty, or end within its first line.
    """
    with suppress(OSError):
        is_named = path.name.endswith(PARTIAL + RUNS)
        return path.is_file() and (is_named or UNFINISHED_SWEEP.recognises(path))
    return False


def _open_problem(path: Path) -> str:
    if os.path.isdir(path):  # false for a name that is too long, where Path.is_dir fails
        return "this is a folder; give the name of a result file"
    if not os.path.exists(path):
        return "there is no such file" + near_files(path, SUFFIXES)
    if not os.path.isfile(path):
        return "this is a device or a pipe; give the name of a result file"
    if path.suffix == ".toml":
        return f"this is a scenario; 'frictionsim solve {path}' makes a result of it"
    return "it is not a readable HDF5 file"


def _check_structure(group: Any, free: int) -> int:
    """Check the objects of a group before any data are read; return the bytes left to claim."""
    for name in group:
        if group.id.links.get_info(name.encode()).type != h5py.h5l.TYPE_HARD:
            raise ValueError(f"{name} is a link to elsewhere")
        item = group[name]
        if isinstance(item, h5py.Group):
            free = _check_structure(item, free)
            continue
        storage = item.id.get_create_plist()
        filters = (storage.get_filter(i)[0] for i in range(storage.get_nfilters()))
        if item.id.get_storage_size():  # a dimension without coordinates has none
            free -= item.nbytes
        if (
            free < 0
            or item.dtype.kind not in NUMBERS_AND_TEXTS
            or storage.get_layout() == h5py.h5d.VIRTUAL
            or storage.get_external_count()
            or not all(number in BUILT_IN for number in filters)
        ):
            raise ValueError(f"{name} is none of a result")
    return free


def record_in(file: h5py.File, path: Path) -> Record:
    """Return the content of an open result file; the path is for messages."""
    attributes = _attributes(file, path)
    datasets = _datasets(file)
    scales = {name: item for name, item in datasets.items() if _is_axis(item)}
    channels = {name: item for name, item in datasets.items() if name not in scales}
    events, contacts = _events(file)
    is_whole = file.id.get_filesize() <= WHOLE
    record = Record(
        attributes=attributes,
        channels={name: values_of(item) for name, item in channels.items()}
        if is_whole
        else FileChannels(path, list(channels)),
        units={name: text_of(item, "units") for name, item in channels.items()},
        long_names={name: text_of(item, "long_name") for name, item in channels.items()},
        axes={name: _axis_of(item) for name, item in channels.items()},
        members={name: _members(item) for name, item in sorted(scales.items())},
        events=events,
        contacts=contacts,
        flags={name: flags_of(item) for name, item in channels.items() if _has_flags(item)},
        quantities={name: _quantity(item) for name, item in file.get("quantities", {}).items()},
        checks=_checks(file.get("audit")),
        statistics=_statistics(file.get("solver")),
    )
    _check(record, channels)
    return record


def _datasets(file: h5py.File) -> dict[str, Any]:
    """Return the channels and the scales of their columns."""
    return {name: item for name, item in file.items() if name not in GROUPS}


def _is_axis(dataset: Any) -> bool:
    return bool(dataset.is_scale) and dataset.name != "/time"


def _attributes(file: h5py.File, path: Path) -> dict[str, str]:
    """Return the root attributes as text."""
    version = int(file.attrs[VERSION])
    if version != FORMAT_VERSION:
        raise InputError(
            f"{path}: cannot read this result: its format version is {version}, this program reads"
            f" version {FORMAT_VERSION}; solve its scenario again"
        )
    texts = {name: str(value) for name, value in file.attrs.items()}
    if texts["status"] not in STATUSES or not texts.keys() >= set(ATTRIBUTES):
        raise KeyError(ATTRIBUTES)
    return texts


def _events(file: h5py.File) -> tuple[dict[str, Any], list[str]]:
    """Return the events and the names of their contacts; empty arrays without events."""
    if "events" not in file:
        types = {"time": "f8", "contact": "i4", "mode_from": "i1", "mode_to": "i1"}
        return {name: np.zeros(0, dtype) for name, dtype in types.items()}, []
    group = file["events"]
    contacts = text_of(group["contact"], "flag_meanings").split()
    return {name: values_of(item) for name, item in group.items() if name != "event"}, contacts


def values_of(dataset: Any) -> Any:
    """Return numbers: integers of their type, all others as float64."""
    return dataset[...].astype(_type_of(dataset), copy=False)


def _type_of(dataset: Any) -> Any:
    return dataset.dtype if dataset.dtype.kind == "i" else np.dtype(np.float64)


def text_of(owner: Any, name: str) -> str:
    """Return an attribute as one line of text."""
    return " ".join(str(owner.attrs[name]).split())


def flags_of(dataset: Any) -> tuple[tuple[int, str], ...]:
    """Return the meanings of the values of a dataset."""
    meanings = text_of(dataset, "flag_meanings").split()
    return tuple(zip(np.atleast_1d(dataset.attrs["flag_values"]).tolist(), meanings, strict=True))


def _has_flags(dataset: Any) -> bool:
    return "flag_values" in dataset.attrs


def _axis_of(dataset: Any) -> str:
    """Return the axis of the columns of a dataset; empty without columns."""
    return str(next(iter(dataset.dims[1].keys()))) if dataset.ndim > 1 else ""


def names_of(dataset: Any) -> tuple[str, ...]:
    """Return the texts of a dataset of one dimension."""
    return tuple(dataset.asstr()[:].tolist())


def _members(scale: Any) -> tuple[str, ...]:
    """Return the names of the members of an axis."""
    return names_of(scale) if scale.dtype.kind == "O" else numbered_members(scale.size)


def _quantity(dataset: Any) -> Quantity:
    value = float(dataset[()])
    return Quantity(None if isnan(value) else value, text_of(dataset, "units"))


def _checks(group: Any) -> dict[str, Check]:
    if group is None:
        return {}
    columns = names_of(group["check"]), group["value"][:].tolist(), group["limit"][:].tolist()
    return {name: Check(value, limit) for name, value, limit in zip(*columns, strict=True)}


def _statistics(group: Any) -> SolverStatistics | None:
    if group is None:
        return None
    counts = {name: int(group[name][()]) for name in COUNTS}
    return SolverStatistics(**counts, wall_seconds=None, compile_seconds=None)


def _check(record: Record, channels: dict[str, Any]) -> None:
    """Check the lengths of channels and events, and that time increases."""
    time, events = record.time, record.events
    for name, dataset in channels.items():
        axis = record.axes[name]
        if dataset.shape != ((len(time), len(record.members[axis])) if axis else (len(time),)):
            raise ValueError(f"{name} is not a channel over time")
    if not np.all(np.diff(time) > 0.0) or len({len(values) for values in events.values()}) > 1:
        raise ValueError("the samples are not over time")
    if len(events["contact"]) and not np.all(events["contact"] < len(record.contacts)):
        raise ValueError("an event has a contact without a name")
