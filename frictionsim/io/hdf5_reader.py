"""Read files in HDF5 and check them; `hdf5_writer` and `sweep_file` document the formats.

A damaged file is told by its checksum before HDF5 opens it. HDF5 is imported with the first file
that is read, as it takes some hundredths of a second.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_ISREG
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError, near_files
from frictionsim.io.atomic_write import SUFFIXES
from frictionsim.io.checksum import is_damaged
from frictionsim.io.cost_table import CostTable
from frictionsim.io.result_format import SEGMENTS, Checkpoint, LongChannel
from frictionsim.io.segments import with_segments
from frictionsim.io.sweep_table import VERSION_NAME as SWEEP_VERSION
from frictionsim.io.sweep_table import SweepTable
from frictionsim.results import HDF5_SIGNATURE, Record
from frictionsim.simulation.stored_channel import StoredChannel

if TYPE_CHECKING:
    Content = Record | SweepTable | CostTable
    Stamp = tuple[int, ...]

A_TABLE = "this is a table of `frictionsim cost`"


def read_any(path: Path) -> "Content":
    """Read a result file, the file of a sweep, or a table of costs."""
    content = _content(path)
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
    from frictionsim.io import hdf5_content

    _check_is_hdf5(path)
    return hdf5_content.checkpoint(str(path))


def _content(path: Path) -> "Content":
    """Return the content of a file; long channels of a result as shapes."""
    import h5py

    from frictionsim.io import cost_content, hdf5_content, sweep_content

    _check_is_hdf5(path)
    with suppress(OSError), h5py.File(path, "r", locking=False) as file:
        if SWEEP_VERSION in file.attrs:
            return sweep_content.sweep(str(path))
        if file.get(cost_content.COST, getlink=True) is not None:
            return cost_content.costs(str(path))
    return hdf5_content.record(str(path))  # reports the fault of any other file


class RowsOfFile:
    """The long channels of a file, whose rows are read on demand."""

    def __init__(self, path: Path) -> None:
        self._path, self._stamp = Path(os.path.abspath(path)), _stamp_of(path)

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return samples start to stop - 1 of a channel."""
        from frictionsim.io import hdf5_content

        with self._unchanged(name):
            return hdf5_content.rows(str(self._path), name, start, stop)

    def samples(self, name: str, numbers: Any) -> Any:
        """Return the samples of some numbers of a channel."""
        from frictionsim.io import hdf5_content

        with self._unchanged(name):
            return hdf5_content.samples(name, [(str(self._path), numbers.tolist())])[0]

    @contextmanager
    def _unchanged(self, name: str) -> Iterator[None]:
        """Raise InputError if the file has changed since it was opened."""
        fault = f"{self._path}: cannot read the channel '{name}': it "
        try:
            if _stamp_of(self._path) == self._stamp:
                yield
                if _stamp_of(self._path) == self._stamp:
                    return
        except OSError as error:
            reason = f"could be opened before, and cannot be now ({error.strerror or error})"
            raise InputError(fault + reason) from None
        raise InputError(fault + "has changed since it was opened; open it again")


def _stamp_of(path: Path) -> "Stamp":
    """Return the fields of a file's status that change when it is replaced."""
    status = os.stat(path)
    return status.st_ino, status.st_size, status.st_mtime_ns


def _check_is_hdf5(path: Path) -> None:
    """Raise InputError if a file is not HDF5, or is damaged.

    Only a regular file is opened: opening a pipe would wait for its writer.
    """
    try:
        is_hdf5 = S_ISREG(os.stat(path).st_mode)
        if is_hdf5:
            with open(path, "rb") as file:
                if is_damaged(file):
                    raise InputError(
                        f"{path}: cannot read this result: it is damaged (its checksum does not"
                        " match)"
                    )
                file.seek(0)
                is_hdf5 = file.read(len(HDF5_SIGNATURE)) == HDF5_SIGNATURE
    except OSError:
        is_hdf5 = False
    if not is_hdf5:
        raise InputError(f"{path}: cannot read this result: {_open_problem(path)}")


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
