"""Read files in HDF5 and check them; `hdf5_writer` and `sweep_file` document the formats.

A file may come from anyone, and its checksum is no proof: whoever changes a file can recompute it.
One changed byte can make HDF5 crash or hang. Therefore HDF5 reads in a child process
(`child_process`), and this process neither calls nor imports it to read.
"""

import os
from pathlib import Path
from stat import S_ISREG
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError, near_files
from frictionsim.io import child_process
from frictionsim.io.atomic_write import SUFFIXES
from frictionsim.io.checksum import is_damaged
from frictionsim.io.child_answer import Checkpoint, LongChannel
from frictionsim.io.child_process import ChildFailed, EndedFromOutside, Parts
from frictionsim.io.cost_table import CostTable
from frictionsim.io.result_format import SEGMENTS
from frictionsim.io.segments import with_segments
from frictionsim.io.sweep_table import SweepTable
from frictionsim.results import HDF5_SIGNATURE, Record
from frictionsim.simulation.stored_channel import StoredChannel

if TYPE_CHECKING:
    Content = Record | SweepTable | CostTable
    Stamp = tuple[int, ...]

A_TABLE = "this is a table of `frictionsim cost`"
# Failures to read files, by name and stamp, as each further try takes as long.
_failures: "dict[tuple[str, Stamp], ChildFailed]" = {}


def read_any(path: Path) -> "Content":
    """Read a result file, the file of a sweep, or a table of costs."""
    content = _answer("content", path)
    if not isinstance(content, Record):
        return content
    source = RowsOfFile(path)
    channels = {
        name: StoredChannel(source, name, values.shape, values.dtype)
        if isinstance(values, LongChannel)
        else values
        for name, values in content.channels.items()
    }
    listing = content.attributes.pop(SEGMENTS, None)
    content = content._replace(channels=channels)
    return content if listing is None else with_segments(content, path, listing)


def read(path: Path) -> Record:
    """Read a result file."""
    return result_of(read_any(path), path)


def result_of(content: "Content", path: Path) -> Record:
    """Return the content of a file if it is the result of a run; else raise InputError."""
    if isinstance(content, SweepTable):
        raise InputError(
            f"{path}: this is a sweep, not the result of a run; 'frictionsim plot {path}' draws it,"
            " and fs.open_sweep reads it"
        )
    if isinstance(content, CostTable):
        raise InputError(
            f"{path}: {A_TABLE}, not the result of a run; 'frictionsim report {path}' shows it"
        )
    return content


def read_sweep(path: Path) -> SweepTable:
    """Read the file of a sweep."""
    content = read_any(path)
    if isinstance(content, SweepTable):
        return content
    if isinstance(content, CostTable):
        raise InputError(f"{path}: {A_TABLE}, not a sweep; 'frictionsim report {path}' shows it")
    raise InputError(f"{path}: this is the result of a run, not a sweep; fs.open reads it")


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the checkpoint of a result file."""
    checkpoint: Checkpoint = _answer("checkpoint", path)
    return checkpoint


class RowsOfFile:
    """The long channels of a file, whose rows are read on demand."""

    def __init__(self, path: Path) -> None:
        self._path, self._stamp = Path(os.path.abspath(path)), _stamp_of(path)
        self._parts = Parts(self._stamp[1])

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return samples start to stop - 1 of a channel."""
        return self._answer(name, "rows", str(self._path), name, start, stop)

    def samples(self, name: str, numbers: Any) -> Any:
        """Return the samples of some numbers of a channel."""
        places = str(self._path), ",".join(map(str, numbers.tolist()))
        return self._answer(name, "samples", name, *places)[0]

    def _answer(self, name: str, question: str, *arguments: str | int) -> Any:
        reason = "it has changed since it was opened; open it again"
        try:
            if _stamp_of(self._path) == self._stamp:
                samples = self._parts.answer_of(question, *arguments, size=self._stamp[1])
                if _stamp_of(self._path) == self._stamp:
                    return samples
        except OSError as error:
            reason = f"it could be opened before, and cannot be now ({error.strerror or error})"
        except ChildFailed as failed:
            reason = str(failed)
        raise InputError(f"{self._path}: cannot read the channel '{name}': {reason}")


def _stamp_of(path: Path) -> "Stamp":
    """Return the fields of a file's status that change when it is replaced."""
    status = os.stat(path)
    return status.st_ino, status.st_size, status.st_mtime_ns


def _answer(question: str, path: Path) -> Any:
    """Ask the child process about a file."""
    try:
        _check_is_hdf5(path)
        key = os.path.realpath(path), _stamp_of(path)
        if key not in _failures:
            try:
                return child_process.answer_of(question, str(path), size=os.path.getsize(path))
            except EndedFromOutside:
                raise
            except ChildFailed as failed:
                _failures[key] = failed
        raise _failures[key]
    except OSError:
        raise InputError(f"{path}: cannot read this result: {_open_problem(path)}") from None
    except ChildFailed as failed:
        raise InputError(f"{path}: cannot read this result: {failed}") from None


def _check_is_hdf5(path: Path) -> None:
    """Raise OSError if a file is not HDF5, InputError if it is damaged.

    Only a regular file is opened: opening a pipe would wait for its writer.
    """
    if not S_ISREG(os.stat(path).st_mode):
        raise OSError("not a regular file")
    with open(path, "rb") as file:
        if is_damaged(file):
            raise InputError(
                f"{path}: cannot read this result: it is damaged (its checksum does not match)"
            )
        file.seek(0)
        if file.read(len(HDF5_SIGNATURE)) != HDF5_SIGNATURE:
            raise OSError("not HDF5")


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
