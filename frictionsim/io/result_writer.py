"""Write result files in HDF5, in the format that docs/result-files.md specifies.

The group /checkpoint holds the state of the solver to resume from: arrays of float64 or bytes whose
names and meaning are internal to the solver, and the run time so far in s, clock.solving and
clock.compiling; its attribute `digest` is the SHA-256 of these, the scenario and the version, and
is checked on resuming. What the state has of each sample, `samples.NAME`, is left out where the
channel NAME has the same numbers, with more at events or not: the attribute `in_channels` has these
names. Empty groups are omitted.

A complete file does not depend on time, place or interruptions of the run. Therefore it has no wall
times.
"""

import os
from io import BytesIO
from itertools import chain
from typing import IO, TYPE_CHECKING, Any, NamedTuple, Self

import h5py
import numpy as np

from frictionsim.io.output_file import RESULT, Kind, append_trailer, replacing
from frictionsim.results import Channel, Record
from frictionsim.simulation.sample_store import SAMPLES

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from frictionsim.results import Flags

VERSION_NAME, FORMAT_VERSION = "format_version", 2
STATUSES = ("done", "failed", "interrupted")
CONVENTIONS = "CF-1.11"
# The datasets of /solver.
COUNTS = {
    "steps": "accepted steps",
    "rejected": "rejected steps",
    "rhs_evaluations": "evaluations of the right-hand side",
    "states": "length of the state vector",
}
CHUNK_BYTES = 128 * 1024
LEVEL = 4  # of compression
LARGE = 64 * 2**20  # bytes of a result that is not made in memory
OVERHEAD = 2**20  # bytes of a result beside its arrays
WITHOUT_COORDINATES = "This is a netCDF dimension but not a netCDF variable."  # of netCDF-4
TEXT = h5py.string_dtype()
TEXT_TYPE, SCALAR = h5py.h5t.py_create(TEXT, logical=True), h5py.h5s.create(h5py.h5s.SCALAR)
NAMES, PLAIN = map(h5py.h5p.create, (h5py.h5p.LINK_CREATE, h5py.h5p.DATASET_CREATE))
NAMES.set_char_encoding(h5py.h5t.CSET_UTF8)
PLAIN.set_obj_track_times(False)  # the file does not depend on the time at which it is written
OK: "Flags" = ((0, "failed"), (1, "ok"))


class Checkpoint(NamedTuple):
    """The data to resume a run: the attributes of its file and the state of its solver."""

    attributes: dict[str, str]
    state: dict[str, Any]


def state_digest(attributes: dict[str, Any], state: dict[str, Any]) -> str:
    """Return the SHA-256 of the arrays of a checkpoint and of the attributes that it depends on.

    These are the root attributes `scenario`, `kind` and `frictionsim_version`.
    """
    from hashlib import sha256

    digest = sha256()
    for key in ("scenario", "kind", "frictionsim_version"):
        digest.update(repr(str(attributes[key])).encode())
    for name in sorted(state):
        values = state[name]
        digest.update(repr((name, values.dtype.str, values.shape)).encode())
        digest.update(values.data if values.flags.c_contiguous else values.tobytes())
    return digest.hexdigest()


def write(record: Record, path: "Path") -> None:
    """Write the result file of a run, whole or not at all.

    A small one is made in memory. A large one, and a checkpoint, which is not compressed, go
    straight to the disk, where their room is reserved first: HDF5 never meets a full one.

    Raises
    ------
    OutputError
        If it cannot be written, or would replace another file than a result.
    """
    state, in_channels = record.checkpoint, list[str]()
    if state is not None:
        in_channels = _names_in_channels(record, state)
        left_out = {SAMPLES + name for name in in_channels}
        state = {name: values for name, values in state.items() if name not in left_out}
    arrays = chain(record.channels.values(), record.events.values(), (state or {}).values())
    texts = sum(len(text) for text in record.attributes.values())
    size = sum(values.nbytes for values in arrays) + 4 * texts + OVERHEAD
    if state is None and size < LARGE:
        write_from_memory(lambda file: _fill(file, record), path, RESULT)
        return
    with replacing(path, RESULT) as part:
        with _Reserved(part, size) as room, h5py.File(room, "w", track_order=True) as file:
            _fill(file, record, state)
            if state is not None:
                _set_text(file["checkpoint"], "in_channels", " ".join(in_channels))
        append_trailer(part, RESULT.mark)


class _Reserved:
    """An empty file for HDF5 that has room on the disk already; what is not used is given back.

    OSError is raised if there is not as much room.
    """

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._end = file, 0
        self.tell, self.read, self.flush = file.tell, file.read, file.flush
        self.readinto: Callable[[Any], int] = file.readinto  # type: ignore[attr-defined]
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move, from the end of what is written where this is asked."""
        return self._file.seek(self._end + offset if whence == os.SEEK_END else offset)

    def write(self, content: Any) -> int:
        """Write some bytes."""
        count = self._file.write(content)
        self._end = max(self._end, self._file.tell())
        return count

    def truncate(self, size: int) -> None:
        """Set the end."""
        self._end = size

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.truncate(self._end)


def write_from_memory(fill: "Callable[[Any], None]", path: "Path", kind: Kind) -> None:
    """Fill an HDF5 file in memory, and write it."""
    image = BytesIO()
    with h5py.File(image, "w", track_order=True) as file:
        fill(file)
    append_trailer(image, kind.mark)
    with replacing(path, kind) as part:
        part.write(image.getbuffer())


def _names_in_channels(record: Record, state: dict[str, Any]) -> list[str]:
    """Return the names of the samples of a state, time excepted, that channels have too."""
    there = [name for name in record.channels if name != "time" and SAMPLES + name in state]
    return [n for n in there if np.array_equal(record.channels[n], state[SAMPLES + n])]


def _fill(file: Any, record: Record, state: dict[str, Any] | None = None) -> None:
    """Add the content of a result to a new file; with a state uncompressed."""
    _add_attributes(file, record.attributes)
    time = _add(file, "time", record.channels["time"], Channel("s", "time"))
    time.make_scale("time")
    scales = {"": time}
    for axis, members in record.members.items():
        scales[axis] = _add_axis(file, axis, members)
    for name, values in record.channels.items():
        if name != "time":
            axis = record.axes[name]
            along = (time, scales[axis]) if axis else (time,)
            dataset = _new(file, name, values, **(_storage(values) if state is None else {}))
            flags = record.flags.get(name, ())
            channel = Channel(record.units[name], record.long_names[name], flags=flags)
            describe(dataset, channel, *along)
    _add_events(file, record)
    _add_quantities(file, record)
    _add_audit(file, record)
    _add_counts(file, record)
    if state is not None:
        _add_checkpoint(file, state)


def _add_attributes(file: Any, attributes: dict[str, str]) -> None:
    file.attrs[VERSION_NAME] = FORMAT_VERSION
    # A record from a file has the attributes of the file.
    for name, text in ({"Conventions": CONVENTIONS} | attributes).items():
        if name != VERSION_NAME:
            _set_text(file, name, text)


def _add_events(file: Any, record: Record) -> None:
    count = len(record.events["time"])
    if not count:
        return
    group = file.create_group("events", track_order=True)
    scale = _add_scale(group, "event", np.arange(count), "number of the event, from 0")
    for name, values in record.events.items():
        dataset = _add(group, name, values, record.of_event(name), scale)
        if name != "time":  # CF requires it; else readers use the time of the root group
            _set_text(dataset, "coordinates", "time")


def _add_quantities(file: Any, record: Record) -> None:
    if not record.quantities:
        return
    group = file.create_group("quantities", track_order=True)
    for name, (value, unit) in record.quantities.items():
        number = np.float64(np.nan if value is None else value)
        _add(group, name, number, Channel(unit, name.replace("_", " ")))


def _add_audit(file: Any, record: Record) -> None:
    if not record.checks:
        return
    group, checks = file.create_group("audit"), record.checks.values()
    scale = _add_names(group, "check", list(record.checks), "name of the check")
    for name, values, channel in (
        ("value", [check.value for check in checks], Channel("1", "value")),
        ("limit", [check.limit for check in checks], Channel("1", "limit of the value")),
    ):
        _add(group, name, np.array(values, dtype=np.float64), channel, scale)
    ok = np.array([check.ok for check in checks], dtype=np.int8)
    _add(group, "ok", ok, Channel("1", "verdict", flags=OK), scale)


def _add_counts(file: Any, record: Record) -> None:
    if record.statistics is None:
        return
    group = file.create_group("solver")
    for name, long_name in COUNTS.items():
        value = np.int64(getattr(record.statistics, name))
        _add(group, name, value, Channel("1", long_name))


def _add_checkpoint(file: Any, state: dict[str, Any]) -> None:
    group = file.create_group("checkpoint")
    lengths = {length for values in state.values() for length in np.shape(values)}
    scales = {length: _add_length(group, length) for length in sorted(lengths)}
    # In the order of reading, so that a copy has the same bytes.
    for name, values in sorted(state.items()):
        dataset = _new(group, name, values)
        _attach(dataset, [scales[length] for length in dataset.shape])
    _set_text(group, "digest", state_digest(dict(file.attrs), state))


def _add_length(group: Any, length: int) -> Any:
    """Add a dimension without coordinates, as netCDF-4 stores it; nothing is allocated for it."""
    scale = group.create_dataset(f"length_{length}", shape=(length,), dtype=">f4")
    scale.make_scale(f"{WITHOUT_COORDINATES}{length:10d}")
    return scale


def _add_axis(group: Any, name: str, members: tuple[str, ...]) -> Any:
    words = name.replace("_", " ")
    if is_numbered(name, members):
        return _add_scale(group, name, np.arange(len(members)), f"number of the {words}, from 0")
    return _add_names(group, name, members, f"name of the {words}")


def _add_scale(group: Any, name: str, values: Any, long_name: str) -> Any:
    scale = _add(group, name, values.astype(np.int32), Channel("1", long_name))
    scale.make_scale(name)
    return scale


def _add_names(group: Any, name: str, names: Any, long_name: str) -> Any:
    scale = group.create_dataset(name, data=list(names), dtype=TEXT)
    _set_text(scale, "long_name", long_name)
    scale.make_scale(name)
    return scale


def _add(group: Any, name: str, values: Any, channel: Channel, *scales: Any) -> Any:
    dataset = _new(group, name, values, **_storage(values))
    describe(dataset, channel, *scales)
    return dataset


def _new(group: Any, name: str, values: Any, **storage: Any) -> Any:
    """Create a dataset; without options in a third of the time of h5py's `create_dataset`."""
    if storage:
        return group.create_dataset(name, data=values, **storage)
    values = np.asarray(values, order="C")
    space = h5py.h5s.create_simple(values.shape) if values.ndim else SCALAR
    stored = h5py.h5t.py_create(values.dtype, logical=True)
    made = h5py.h5d.create(group.id, name.encode(), stored, space, PLAIN, NAMES)
    if values.size:
        made.write(h5py.h5s.ALL, h5py.h5s.ALL, values)
    return h5py.Dataset(made)


def describe(dataset: Any, channel: Channel, *scales: Any) -> None:
    """Add unit, description, flags and the scales of its dimensions to a dataset."""
    if channel.unit:  # a text has none
        _set_text(dataset, "units", channel.unit)
    _set_text(dataset, "long_name", channel.long_name)
    if channel.flags:
        numbers, meanings = zip(*channel.flags, strict=True)
        dataset.attrs["flag_values"] = np.array(numbers, dtype=dataset.dtype)
        _set_text(dataset, "flag_meanings", " ".join(meanings))
    _attach(dataset, scales)


def _attach(dataset: Any, scales: "Sequence[Any]") -> None:
    """Attach the scales of the dimensions, faster than the `dims` of h5py."""
    for dimension, scale in enumerate(scales):
        h5py.h5ds.attach_scale(dataset.id, scale.id, dimension)


def _set_text(owner: Any, name: str, text: str) -> None:
    """Set a text attribute in a third of the time of h5py's `attrs`, which can replace one."""
    attribute = h5py.h5a.create(owner.id, name.encode(), TEXT_TYPE, SCALAR)
    attribute.write(np.array(text, dtype=TEXT))


def _storage(values: Any) -> dict[str, Any]:
    """Return the storage options: contiguous for one dimension, else compressed chunks of rows."""
    if values.ndim < 2 or not values.size:
        return {}
    rows = max(1, CHUNK_BYTES // (values.dtype.itemsize * values.shape[1]))
    chunks = min(len(values), rows), values.shape[1]
    return {"chunks": chunks, "shuffle": True, "compression": "gzip", "compression_opts": LEVEL}


def is_numbered(axis: str, members: tuple[str, ...]) -> bool:
    """Return whether the members of an axis are numbered; pulleys always have names."""
    return axis != "pulley" and members == numbered_members(len(members))


def numbered_members(count: int) -> tuple[str, ...]:
    """Return the default names of the members of an axis: their numbers."""
    return tuple(map(str, range(count)))
