"""Write result files in HDF5, in the format that docs/result-files.md specifies.

The group /checkpoint holds the state of the solver to resume from: arrays of float64 or bytes whose
names and meaning are internal to the solver, and the run time so far in s, clock.solving and
clock.compiling; its attribute `digest` is the SHA-256 of these, the scenario and the version, and
is checked on resuming. Empty groups are omitted.

The unfinished result of a long run, see `segments`, has format_version 3: its channels begin with
the samples after the last segment. A checkpoint of such a run omits quantities, events and audit.
Its complete result is written segment by segment, and is one ordinary file.

A complete file does not depend on time, place or interruptions of the run. Therefore it has no wall
times. The table of `frictionsim cost` has another layout: see `write_table`.

Format version 1 is still read. There all numbers are float64, /events/time is the dimension scale
of the events, an axis has the names of its members as the attribute `names`, separated by blanks,
and overrides, command, law, effects, quantities, audit and solver are missing.
"""

import os
import re
from contextlib import contextmanager
from errno import ENOSPC
from os import strerror
from pathlib import Path
from shutil import disk_usage
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from frictionsim.errors import OutputError
from frictionsim.io.atomic_write import PartFile, write_atomically
from frictionsim.io.checksum import LENGTH, append_trailer, checksum_trailer
from frictionsim.io.replaceable import (
    COSTS_IN_HDF5,
    RESULT,
    SEGMENT,
    Kind,
    check_replaceable,
    check_segment,
)
from frictionsim.io.result_format import (
    CONVENTIONS,
    COUNTS,
    FORMAT_VERSION,
    SEGMENTED_VERSION,
    SEGMENTS,
    is_numbered,
    state_digest,
)
from frictionsim.results import Channel, Record
from frictionsim.simulation.record import scenario_attributes
from frictionsim.simulation.sample_store import power_of_two, rows_per_segment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from frictionsim.io.cost_table import CostTable
    from frictionsim.results import Flags
    from frictionsim.scenario.settings import Scenario

CHUNK_BYTES = 128 * 1024
LEVEL, QUICK_LEVEL = 4, 1  # of compression; the latter for segments, which are merged later
REASON = re.compile(r"error message = '([^']*)'")  # in a message of HDF5 of many lines
WITHOUT_COORDINATES = "This is a netCDF dimension but not a netCDF variable."  # of netCDF-4
TEXT = h5py.string_dtype()
TEXT_TYPE, SCALAR = h5py.h5t.py_create(TEXT, logical=True), h5py.h5s.create(h5py.h5s.SCALAR)
OK: "Flags" = ((0, "failed"), (1, "ok"))


def write(run: "Record", path: Path, part: PartFile | None = None) -> None:
    """Write the result file of a run as `write_record`.

    If the run can be resumed, samples in segments stay there, and the file lists them.
    """
    stored = run.stored
    if stored is None or run.checkpoint is None:
        write_record(run, path, run.checkpoint, part)
        return
    before = stored.number * stored.rows
    tail = {name: values[before:] for name, values in run.channels.items()}
    listing = {SEGMENTS: stored.segments.listing(stored.rows)}
    rest = run._replace(channels=tail, attributes=run.attributes | listing)
    write_record(rest, path, run.checkpoint, part)


def write_record(
    record: Record,
    path: Path,
    checkpoint: dict[str, Any] | None = None,
    part: PartFile | None = None,
) -> None:
    """Write a result file, with the state to resume from if there is one.

    It is written atomically: on any error the existing file is kept. Its part may be locked
    already.
    """
    part = part or PartFile(path)
    try:
        check_replaceable(path, RESULT)
        with part.opened() as opened:
            if _is_long(record, checkpoint):
                with _reported(path), part.unlocked():
                    _write_on_disk(part.content, record, checkpoint)
                append_trailer(part.content)
            else:
                opened.write(_image(lambda file: _fill(file, record, checkpoint), RESULT))
        part.rename()
    except BaseException:
        part.discard()
        raise


def write_segment(record: Record, path: Path) -> int:
    """Write a segment of a long run; return its checksum."""
    check_segment(path)
    return write_from_memory(lambda file: _fill(file, record, None, QUICK_LEVEL), path, SEGMENT)


def _write_on_disk(part: Path, record: Record, checkpoint: dict[str, Any] | None) -> None:
    """Write the file of a long run, which need not fit into memory.

    HDF5 keeps data that it could not write, tries again when the file or a dataset in it is closed,
    and then crashes. A file that could not be written therefore stays open until the process ends.
    """
    least = sum(values.nbytes for values in record.channels.values() if values.ndim < 2)
    if disk_usage(part).free < least:
        raise OSError(ENOSPC, strerror(ENOSPC))
    file = h5py.File(part, "w", track_order=True, locking=False)  # this process has locked it
    try:
        _fill(file, record, checkpoint, rows=segment_rows(record.channels))
        file.flush()
    except (OSError, RuntimeError) as error:
        _keep_open(file, error)  # the frames of the error hold the datasets
        raise
    file.close()


def _keep_open(*parts: Any) -> None:
    """Keep objects alive until the process ends, even while Python unloads its modules."""
    import ctypes

    ctypes.pythonapi.Py_IncRef(ctypes.py_object(parts))


@contextmanager
def _reported(path: Path) -> "Iterator[None]":
    """Raise an error of HDF5 as OutputError in one line: its reason, if it has one."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        match = REASON.search(str(error))
        known = match[1] if match else getattr(error, "strerror", None)
        reason = known or str(error).split("\n", 1)[0]
        raise OutputError(f"{path}: cannot write the result: {reason}") from None


def write_table(scenario: "Scenario", table: "CostTable", path: Path) -> None:
    """Write the table of a work-precision study atomically.

    The file has the attributes of a result and of the study, and

        /cost/row            (k,) the dimension scale of the columns: one row per setting
        /cost/<column>       (k,) law, backend, setting, overrides, status, reason as text; error,
                             wall_seconds, steps, ... as float64, nan if a value is unknown
    """

    def fill(file: Any) -> None:
        _add_attributes(file, scenario_attributes(scenario) | table.attributes)
        group = file.create_group("cost")
        for number, (name, unit, long_name, values) in enumerate(table.columns.values()):
            if number == 0:
                scale = _add_scale(group, "row", np.arange(len(values)), "number of the row")
            if unit:
                data = np.asarray(values, dtype=np.float64)
                _add(group, name, data, Channel(unit, long_name), scale)
                continue
            texts = group.create_dataset(name, data=values, dtype=TEXT)
            describe(texts, Channel("", long_name), scale)

    write_from_memory(fill, path, COSTS_IN_HDF5)


def write_from_memory(fill: "Callable[[Any], None]", path: Path, kind: Kind) -> int:
    """Fill an HDF5 file in memory and write it atomically; return its checksum."""
    check_replaceable(path, kind)
    image = _image(fill, kind)
    write_atomically(image, path, kind.word)
    return int(image[len(kind.mark) - LENGTH :], 16)


def _image(fill: "Callable[[Any], None]", kind: Kind) -> bytes:
    """Return the bytes of a file filled in memory, with the line of its checksum."""
    # Files that threads have open at the same time need different names.
    name = f"{os.urandom(8).hex()}.h5"
    with h5py.File(name, "w", driver="core", backing_store=False, track_order=True) as file:
        fill(file)
        file.flush()
        image = bytes(file.id.get_file_image())
    return image + checksum_trailer(image, kind.mark)


def _fill(
    file: Any,
    record: Record,
    checkpoint: dict[str, Any] | None,
    level: int = LEVEL,
    rows: int | None = None,
) -> None:
    """Add the content of a result to a new file; samples in blocks of `rows`, if given."""
    _add_attributes(file, record.attributes)
    time = _add(file, "time", record.channels["time"], Channel("s", "time"))
    time.make_scale("time")
    scales = {"": time}
    for axis, members in record.members.items():
        scales[axis] = _add_axis(file, axis, members)
    channels = {name: values for name, values in record.channels.items() if name != "time"}
    for name, values in channels.items():
        axis = record.axes[name]
        scale = (scales[""], scales[axis]) if axis else (scales[""],)
        if rows is None:
            dataset = file.create_dataset(name, data=values, **_storage(values, level))
        else:
            storage = _storage(values, level, rows)
            dataset = file.create_dataset(name, values.shape, values.dtype, **storage)
        flags = record.flags.get(name, ())
        describe(dataset, Channel(record.units[name], record.long_names[name], flags=flags), *scale)
    if rows is not None:  # all channels of a segment before the next, so that each is read once
        for start in range(0, len(record.time), rows):
            for name, values in channels.items():
                file[name][start : start + rows] = values[start : start + rows]
    _add_events(file, record)
    _add_quantities(file, record)
    _add_audit(file, record)
    _add_counts(file, record)
    if checkpoint is not None:
        _add_checkpoint(file, checkpoint)


def _add_attributes(file: Any, attributes: dict[str, str]) -> None:
    file.attrs["format_version"] = SEGMENTED_VERSION if SEGMENTS in attributes else FORMAT_VERSION
    # A record from a file has the attributes of the file, which may be of another version.
    texts = {"Conventions": CONVENTIONS} | attributes | {"Conventions": CONVENTIONS}
    for name, text in texts.items():
        if name != "format_version":
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
        dataset = group.create_dataset(name, data=values)
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
    dataset = group.create_dataset(name, data=values, **_storage(values))
    describe(dataset, channel, *scales)
    return dataset


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


def _storage(values: Any, level: int = LEVEL, segment: int | None = None) -> dict[str, Any]:
    """Return the storage options: contiguous for one dimension, else compressed chunks of rows.

    A segment of a long run has whole chunks.
    """
    if values.ndim < 2 or not values.size:
        return {}
    row_bytes = values.dtype.itemsize * values.shape[1]
    rows = max(1, CHUNK_BYTES // row_bytes)
    rows = min(len(values), rows) if segment is None else min(segment, power_of_two(rows))
    chunks = rows, values.shape[1]
    return {"chunks": chunks, "shuffle": True, "compression": "gzip", "compression_opts": level}


def _is_long(record: Record, checkpoint: dict[str, Any] | None) -> bool:
    """Return whether samples fill more than one segment; two if a segment could not be written."""
    return len(record.time) > segment_rows(record.channels) * (1 if checkpoint is None else 2)


def segment_rows(channels: dict[str, Any]) -> int:
    """Return the number of samples per segment of these channels."""
    row = (v.dtype.itemsize * int(np.prod(v.shape[1:])) for n, v in channels.items() if n != "time")
    return rows_per_segment(sum(row))
