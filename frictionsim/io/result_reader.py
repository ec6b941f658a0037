"""Read result files; `result_writer` and docs/result-files.md say what they hold.

The checksum at the end of a file tells damage before HDF5 sees it. What HDF5 would do beyond
reading data is refused: links, data in other files, filters that load code, and more data than the
file can hold.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from math import isnan, prod
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionsim.errors import InputError, near_files
from frictionsim.io.names import PARTIAL, RUNS, unfinished_beside
from frictionsim.io.output_file import COSTS, SUFFIXES, UNFINISHED_SWEEP, is_damaged
from frictionsim.io.result_writer import (
    COUNTS,
    FORMAT_VERSION,
    STATUSES,
    VERSION_NAME,
    Checkpoint,
    numbered_members,
    state_digest,
)
from frictionsim.results import (
    HDF5_SIGNATURE,
    MODES,
    Check,
    Quantity,
    Record,
    SolverStatistics,
)
from frictionsim.simulation.sample_store import SAMPLES
from frictionsim.version import __version__

ATTRIBUTES = ("backend", "frictionsim_version", "kind", "reason", "scenario", "status", "title")
GROUPS = (b"events", b"quantities", b"audit", b"solver", b"checkpoint")
WHOLE = 64 * 2**20  # bytes of a file that is read whole when it is opened
SMALL = 2**16  # bytes of a channel that is read at once
MAX_RATIO = 1032  # of DEFLATE; a larger claim is none of a file that is whole
BUILT_IN = (h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE)
TEXT = h5py.h5t.py_create(h5py.string_dtype())


class ResultFile(h5py.File):  # type: ignore[misc]
    """An open HDF5 file.

    Its datasets and attributes are found by the functions of HDF5, at a fifth of the time that
    h5py's mappings take.

    Attributes
    ----------
    datasets : dict of h5py.Dataset
        By name, as `events/time`, in the order of the file.
    sizes : dict of int
        Their bytes.
    image : bytes
        The file, if it is in memory.
    """

    def check(self, image: bytes, claimed: int) -> None:
        """Check all objects before any data are read; these claim at most so many bytes."""
        self.image, self.datasets, self.sizes = image, dict[str, Any](), dict[str, int]()
        links: list[tuple[bytes, Any]] = []
        self.id.links.visit(
            lambda name, info: links.append((name, info.type)),
            idx_type=h5py.h5.INDEX_CRT_ORDER,
            info=True,
        )
        for name, kind in links:
            if kind != h5py.h5l.TYPE_HARD:
                raise ValueError(f"{name!r} is a link to elsewhere")
            item = h5py.h5o.open(self.id, name)
            if name in GROUPS:
                continue
            storage, size = item.get_create_plist(), item.get_storage_size()
            layout = storage.get_layout()
            is_ours = layout != h5py.h5d.VIRTUAL
            if layout == h5py.h5d.CHUNKED:
                size = size and prod(item.shape) * item.dtype.itemsize
                filters = (storage.get_filter(i)[0] for i in range(storage.get_nfilters()))
                is_ours = all(number in BUILT_IN for number in filters)
            elif layout == h5py.h5d.CONTIGUOUS:
                is_ours = not storage.get_external_count()
            claimed -= size
            if claimed < 0 or not is_ours:
                raise ValueError(f"{name!r} is not part of a result")
            self.sizes[name.decode()] = size
            self.datasets[name.decode()] = h5py.Dataset(item)

    def group(self, name: str) -> dict[str, Any]:
        """Return the datasets of a group by their names in it; those of the root group for ""."""
        parts = [(*item.rpartition("/"), dataset) for item, dataset in self.datasets.items()]
        return {last: dataset for group, _, last, dataset in parts if group == name}


class FileChannels(Mapping[str, Any]):
    """The channels of a file; a large one is read when it is wanted, and kept.

    InputError is raised if it cannot be read, or a file that is not in memory has changed since it
    was opened.
    """

    def __init__(self, file: ResultFile, path: Path, channels: dict[str, Any]) -> None:
        self._names, self._image, self._path = list(channels), file.image, path.absolute()
        self._status = _identity(path)
        small = (name for name in channels if file.sizes[name] <= SMALL)
        self._read = {name: values_of(channels[name]) for name in small}
        if len(self._read) == len(channels):
            self._image = b""

    def __getitem__(self, name: str) -> Any:
        if name not in self._names:
            raise KeyError(name)
        if name not in self._read:
            self._read[name] = self._values(name)
        return self._read[name]

    def _values(self, name: str) -> Any:
        with suppress(OSError, KeyError, ValueError):
            place = BytesIO(self._image) if self._image else self._path
            with h5py.File(place, "r", locking=False) as file:
                values = values_of(file[name])
            if self._image or _identity(self._path) == self._status:
                return values
        reason = "it has changed since it was opened; open it again"
        raise InputError(f"{self._path}: {f'its {name} is damaged' if self._image else reason}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _identity(path: Path) -> tuple[int, ...]:
    """Return what changes when a file is replaced or written to."""
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the state to resume a run from.

    Raises
    ------
    InputError
        If the run cannot be resumed.
    """
    with opened(path) as file:
        attributes, group = _attributes(file, path), file.group("checkpoint")
        if reason := _resume_obstacle(path, attributes, bool(group)):
            raise InputError(f"{path}: cannot resume this run: {reason}")
        state = {
            name: item[...].view(item.dtype.str)  # without notes of HDF5
            for name, item in group.items()
            if not item.is_scale
        }
        if text_of(file["checkpoint"], "digest") != state_digest(attributes, state):
            raise InputError(f"{path}: cannot resume this run: its checkpoint is damaged")
        if f"{SAMPLES}time" in state:
            channels = {n: i for n, i in file.group("").items() if not _is_axis(n, i)}
            for name in text_of(file["checkpoint"], "in_channels").split():
                state[SAMPLES + name] = channels[name][...].astype(np.float64)
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
def opened(
    path: Path, what: str = "result", *, only_attributes: bool = False
) -> Iterator[ResultFile]:
    """Return the context of a checked HDF5 file; what goes wrong within becomes an InputError.

    A file of at most `WHOLE` bytes is read into memory first. The objects of one of which only the
    attributes are read need no check.
    """
    reason = ""
    try:
        if not os.path.isfile(path):  # a pipe, if opened, would wait for its writer
            raise InputError(f"{path}: cannot read this {what}: {_open_problem(path)}")
        with path.open("rb") as disk:
            size = os.fstat(disk.fileno()).st_size
            image = disk.read() if size <= WHOLE else b""
            source = BytesIO(image) if image else disk
            problem = "it is damaged (its checksum does not match)" if is_damaged(source) else ""
            source.seek(0)
            if not problem and source.read(len(HDF5_SIGNATURE)) != HDF5_SIGNATURE:
                problem = _open_problem(path)
            if problem:
                raise InputError(f"{path}: cannot read this {what}: {problem}")
            # Without locks: files are replaced as a whole, and some systems do not grant one.
            with ResultFile(source if image else path, "r", locking=False) as file:
                if not only_attributes:
                    file.check(image, MAX_RATIO * size)
                yield file
        return
    except InputError:
        raise
    except MemoryError:
        reason = "it does not fit into memory"
    except OSError as error:
        reason = error.strerror or "it is not a readable HDF5 file"
    except Exception:  # whatever h5py says of bits that are none of a file of ours
        reason = f"it is HDF5, but not a frictionsim {what}"
    raise InputError(f"{path}: cannot read this {what}: {reason}")


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
    if COSTS.recognises(path):
        return f"this is a table of costs; 'frictionsim report {path}' shows it"
    return "it is not a readable HDF5 file"


def record_in(file: ResultFile, path: Path) -> Record:
    """Return the content of an open result file."""
    attributes, datasets = _attributes(file, path), file.group("")
    channels = {name: item for name, item in datasets.items() if not _is_axis(name, item)}
    events = file.group("events")
    contacts = text_of(events["contact"], "flag_meanings").split() if events else []
    audit, counts = file.group("audit"), file.group("solver")
    columns = [values_of(audit[name]).tolist() for name in ("value", "limit")] if audit else []
    checks = map(Check, *columns) if audit else ()
    record = Record(
        attributes=attributes,
        channels=FileChannels(file, path, channels),
        units={name: text_of(item, "units") for name, item in channels.items()},
        long_names={name: text_of(item, "long_name") for name, item in channels.items()},
        axes={name: _axis_of(item) for name, item in channels.items()},
        members={n: _members(datasets[n]) for n in sorted(datasets.keys() - channels.keys())},
        events={n: values_of(item) for n, item in events.items() if n != "event"} or NO_EVENTS,
        contacts=contacts,
        flags={name: flags_of(item) for name, item in channels.items() if _has_flags(item)},
        quantities={name: _quantity(item) for name, item in file.group("quantities").items()},
        checks=dict(zip(names_of(audit["check"]), checks, strict=True)) if audit else {},
        statistics=_statistics(counts) if counts else None,
    )
    _check(record, channels)
    return record


def _is_axis(name: str, dataset: Any) -> bool:
    return bool(dataset.is_scale) and name != "time"


def _attributes(file: ResultFile, path: Path) -> dict[str, str]:
    """Return the root attributes as text."""
    version = int(file.attrs[VERSION_NAME])
    if version != FORMAT_VERSION:
        raise InputError(
            f"{path}: cannot read this result: its format version is {version}, this program reads"
            f" version {FORMAT_VERSION}; solve its scenario again"
        )
    texts = {name: _text(file, name) for name in file.attrs}
    if texts["status"] not in STATUSES or not texts.keys() >= set(ATTRIBUTES):
        raise KeyError(ATTRIBUTES)
    return texts


NO_EVENTS = {
    name: np.zeros(0, dtype)
    for name, dtype in {"time": "f8", "contact": "i4", "mode_from": "i1", "mode_to": "i1"}.items()
}


def values_of(dataset: Any) -> Any:
    """Return numbers: integers of their type, all others as float64."""
    item = dataset.id
    kind = item.get_type()
    if not isinstance(kind, h5py.h5t.TypeIntegerID | h5py.h5t.TypeFloatID):
        raise ValueError(f"{dataset.name} has no numbers")
    is_signed = kind.get_class() == h5py.h5t.INTEGER and kind.get_sign() == h5py.h5t.SGN_2
    values = np.empty(item.shape, kind.dtype if is_signed else np.float64)
    item.read(h5py.h5s.ALL, h5py.h5s.ALL, values, kind if is_signed else h5py.h5t.NATIVE_DOUBLE)
    return values


def _text(owner: Any, name: str) -> str:
    """Return an attribute as text."""
    text: Any = np.empty((), object)
    try:
        h5py.h5a.open(owner.id, name.encode()).read(text, TEXT)
    except (OSError, TypeError):  # a number, or a text as others write it
        return str(owner.attrs[name])
    return str(text[()].decode())


def text_of(owner: Any, name: str) -> str:
    """Return an attribute as one line of text."""
    return " ".join(_text(owner, name).split())


def flags_of(dataset: Any) -> tuple[tuple[int, str], ...]:
    """Return the meanings of the values of a dataset."""
    numbers = np.atleast_1d(dataset.attrs["flag_values"]).tolist()
    return tuple(zip(numbers, text_of(dataset, "flag_meanings").split(), strict=True))


def _has_flags(dataset: Any) -> bool:
    return bool(h5py.h5a.exists(dataset.id, b"flag_values"))


def _axis_of(dataset: Any) -> str:
    """Return the axis of the columns of a dataset; empty without columns."""
    return str(next(iter(dataset.dims[1].keys()))) if dataset.id.rank > 1 else ""


def names_of(dataset: Any) -> tuple[str, ...]:
    """Return the texts of a dataset of one dimension."""
    return tuple(dataset.asstr()[:].tolist())


def _members(scale: Any) -> tuple[str, ...]:
    """Return the names of the members of an axis."""
    return names_of(scale) if scale.dtype.kind == "O" else numbered_members(scale.size)


def _quantity(dataset: Any) -> Quantity:
    value = float(values_of(dataset))
    return Quantity(None if isnan(value) else value, text_of(dataset, "units"))


def _statistics(group: dict[str, Any]) -> SolverStatistics:
    counts = {name: int(values_of(group[name])) for name in COUNTS}
    return SolverStatistics(**counts, wall_seconds=None, compile_seconds=None)


def _check(record: Record, channels: dict[str, Any]) -> None:
    """Check the lengths of channels and events, and that time increases."""
    time, events = record.time, record.events
    for name, dataset in channels.items():
        axis = record.axes[name]
        if dataset.id.shape != ((len(time), len(record.members[axis])) if axis else (len(time),)):
            raise ValueError(f"{name} is not a channel over time")
    if not NO_EVENTS.keys() <= events.keys():
        raise ValueError("its events lack times, contacts or modes")
    if not np.all(np.diff(time) > 0.0) or len({len(values) for values in events.values()}) > 1:
        raise ValueError("the samples are not over time")
    if len(events["contact"]) and not np.all(events["contact"] < len(record.contacts)):
        raise ValueError("an event has a contact without a name")
    modes = [events["mode_from"], events["mode_to"]]
    if not np.all(np.isin(modes, list(dict(MODES)))):
        raise ValueError("an event has a mode without a name")
