"""Read result files in HDF5 and check them; `hdf5_writer` documents the format.

A file may come from anyone, and its checksum is no proof: whoever changes a file can make it anew.
One changed byte is enough to have HDF5 crash or never return. Therefore HDF5 reads in a child
process with limits on time and memory (`child_process`, `hdf5_content`), and this process never
calls it to read. Long channels, and those with columns, are read here, without HDF5
(`stored_array`).
"""

import os
from collections.abc import Callable
from os.path import isdir, isfile
from pathlib import Path
from stat import S_ISREG
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from frictionsim.errors import InputError, near_files
from frictionsim.io import hdf5_content
from frictionsim.io.atomic_write import SUFFIXES
from frictionsim.io.checksum import checksum_mismatch
from frictionsim.io.child_process import (
    ChildFailed,
    ChildLimits,
    EndedFromOutside,
    OutOfTime,
    run_in_child,
)
from frictionsim.io.chunks import is_long
from frictionsim.io.hdf5_content import NOT_HDF5, NOT_OURS, Checkpoint, Identity
from frictionsim.io.hdf5_structure import data_limit
from frictionsim.io.result_format import SEGMENTS
from frictionsim.io.sample_segments import SegmentsAndTail, segments_of
from frictionsim.io.stored_array import FileChanged, FileSource, stamp_of
from frictionsim.results import HDF5_SIGNATURE, Record
from frictionsim.simulation.stored_channel import StoredChannel

if TYPE_CHECKING:
    from frictionsim.io.cost_table import CostTable
    from frictionsim.io.sweep_table import SweepTable

SECONDS, CPU_SECONDS = 8.0, 2.0  # of a small file, which takes some hundredths
BYTES_PER_SECOND = 20e6  # of a slow disk
WORKING_MEMORY = 512 * 2**20
TRIES = 3  # a run may replace its result at each checkpoint

# Files on which HDF5 did not come to an end, by name and stamp: each further try takes seconds.
_out_of_time: dict[tuple[str, tuple[int, ...]], OutOfTime] = {}
# What files of this process said of themselves, by name and stamp; a run asks at each checkpoint.
_identities: dict[tuple[str, tuple[int, ...]], Identity] = {}
MAX_IDENTITIES = 64


def read(path: Path) -> Record:
    """Read a result file."""
    for _ in range(TRIES):
        found: Record = _in_child(hdf5_content.record, path)
        try:
            found = _with_values(found, path)
            break
        except (FileChanged, OSError):
            continue
        except (ValueError, MemoryError):
            raise InputError(f"{path}: cannot read this result: {NOT_OURS}") from None
    else:
        raise InputError(f"{path}: cannot read this result: the file is being modified; try again")
    reference = found.attributes.pop(SEGMENTS, None)
    return found if reference is None else _with_segments(found, path, reference)


def may_be_done(path: Path) -> bool:
    """Return whether a file holds a complete result or cannot be read; false for an empty file."""
    try:
        found = os.stat(path)
    except OSError:  # no such file
        return False
    if S_ISREG(found.st_mode) and not found.st_size:
        return False
    return _identity(path).status not in ("interrupted", "failed")


def is_table(path: Path) -> bool:
    """Return whether a file holds a table of costs; false if it cannot be read."""
    return _identity(path).is_table


def is_sweep(path: Path) -> bool:
    """Return whether a file holds a sweep; false if it cannot be read."""
    return _identity(path).is_sweep


def identity_of(path: Path) -> Identity:
    """Return the identity of a file; empty if HDF5 finds it damaged."""
    found: Identity = _in_child(hdf5_content.identity, path)
    return found


def read_sweep(path: Path) -> "SweepTable":
    """Read the file of a sweep."""
    from frictionsim.io import sweep_content  # rarely needed

    found: SweepTable = _in_child(sweep_content.sweep, path)
    return found


def read_costs(path: Path) -> "CostTable":
    """Read a table of costs."""
    from frictionsim.io import cost_content  # rarely needed

    found: CostTable = _in_child(cost_content.costs, path)
    return found


def folder_of_segments(path: Path) -> Path | None:
    """Return the folder with the segments of an incomplete result; None if it has none."""
    reference = _identity(path).segments
    try:
        return None if reference is None else segments_of(path, reference)[0].folder
    except ValueError:
        return None


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the checkpoint of a result file."""
    found: Checkpoint = _in_child(hdf5_content.checkpoint, path)
    return found


def _identity(path: Path) -> Identity:
    """Return the identity of a file; empty if there is none or it cannot be read."""
    try:
        key = os.path.realpath(path), stamp_of(str(path))
    except (OSError, ValueError):
        return Identity()
    if key not in _identities:
        try:
            found = _answer(hdf5_content.identity, path)
        except InputError:
            found = Identity()
        except (ChildFailed, OSError):  # another time it may be read: nothing is known of it
            return Identity()
        if len(_identities) >= MAX_IDENTITIES:
            _identities.clear()
        _identities[key] = found
    return _identities[key]


def _in_child(work: Callable[[str], Any], path: Path) -> Any:
    """Call a reader of `hdf5_content` in the child process."""
    try:
        return _answer(work, path)
    except OSError:
        raise InputError(f"{path}: cannot read this result: {_why_not_open(path)}") from None
    except ChildFailed as failed:
        raise InputError(f"{path}: cannot read this result: {failed}") from None


def _answer(work: Callable[[str], Any], path: Path) -> Any:
    """Call a reader of `hdf5_content` in the child process.

    Raises
    ------
    ChildFailed, OSError
        If there is no answer.
    InputError
        If the file is damaged.
    """
    limits = _limits(_size_of_hdf5(path))
    key = os.path.realpath(path), stamp_of(str(path))
    if key in _out_of_time:
        raise _out_of_time[key]
    try:
        return run_in_child(work, (str(path),), limits)
    except EndedFromOutside:
        return run_in_child(work, (str(path),), limits)
    except OutOfTime as failed:
        _out_of_time[key] = failed
        raise


def _limits(size: int) -> ChildLimits:
    # The values as they are read, and once more in the type that they are sent in.
    more = size / BYTES_PER_SECOND
    return ChildLimits(SECONDS + more, CPU_SECONDS + more, WORKING_MEMORY + 2 * data_limit(size))


def _size_of_hdf5(path: Path) -> int:
    """Return the size of a file of HDF5; raise OSError if it is none, InputError if damaged.

    What is no regular file is not opened: to open a pipe waits for who writes to it.
    """
    found = os.stat(path)
    if not S_ISREG(found.st_mode):
        raise OSError("not a regular file")
    if checksum_mismatch(path):
        raise InputError(
            f"{path}: cannot read this result: it is damaged (its checksum does not match)"
        )
    with open(path, "rb") as file:
        if file.read(len(HDF5_SIGNATURE)) != HDF5_SIGNATURE:
            raise OSError("not HDF5")
    return found.st_size


def _why_not_open(path: Path) -> str:
    if isdir(path):  # false for a name that is too long, where Path.is_dir fails
        return "this is a folder; give the name of a result file"
    if not os.path.exists(path):
        return "there is no such file" + near_files(path, SUFFIXES)
    if not isfile(path):
        return "this is a device or a pipe; give the name of a result file"
    if path.suffix == ".toml":
        return f"this is a scenario; 'frictionsim solve {path}' makes a result of it"
    return NOT_HDF5


def _with_values(found: Record, path: Path) -> Record:
    """Return a record whose channels are in memory, unless it is of a long run.

    Raises
    ------
    FileChanged
        If the file was replaced meanwhile.
    ValueError
        If a channel is damaged, or does not fit into memory.
    """
    stored = {n: v for n, v in found.channels.items() if isinstance(v, StoredChannel)}
    if not stored or is_long(found.channels):
        return found
    if sum(v.nbytes for v in stored.values()) > data_limit(os.stat(path).st_size):
        raise ValueError("more data than the file can hold")
    read_now: dict[str, Any] = {
        name: cast(FileSource, v.source).rows_if_unchanged(name, 0, len(v)).astype(v.dtype)
        for name, v in stored.items()
    }
    return found._replace(channels=found.channels | read_now)


def _with_segments(found: Record, path: Path, reference: str) -> Record:
    """Return a record with the samples of its segments before its own."""
    try:
        segments, count, rows = segments_of(path, reference)
    except ValueError:
        raise InputError(f"{path}: cannot read this result: {NOT_OURS}") from None
    segments.check(count, segments.checksum)
    damaged = InputError(f"{path}: cannot read this result: {NOT_OURS}")
    if any(segments.length(number) != rows for number in range(count)):
        raise damaged
    source = SegmentsAndTail(segments, count, rows, found.channels)
    before = count * rows
    channels: dict[str, Any] = {
        name: StoredChannel(source, name, (before + len(tail), *tail.shape[1:]), tail.dtype)
        for name, tail in found.channels.items()
    }
    time = np.asarray(channels["time"])
    if not np.all(time[1:] > time[:-1]):
        raise damaged
    return found._replace(channels=channels | {"time": time})
