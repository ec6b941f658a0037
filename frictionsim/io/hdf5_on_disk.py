"""Writing files of HDF5 to a disk that may be full.

HDF5 keeps what it could not write and tries again where the file, or a dataset in it, is closed.
Then it crashes. A file that could not be written therefore stays open until the process ends.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import ENOSPC
from os import strerror
from pathlib import Path
from shutil import disk_usage
from typing import Any

import h5py

from frictionsim.errors import OutputError

REASON = re.compile(r"error message = '([^']*)'")  # in a message of HDF5 of many lines


def write_on_disk(part: Path, least: int, fill: Callable[[Any], None]) -> None:
    """Write a file of HDF5.

    Parameters
    ----------
    part : Path
        An empty file.
    least : int
        Bytes that the file will have at least.
    fill : callable
        Called with the open file, to write all that is in it.

    Raises
    ------
    OSError, RuntimeError
        If it cannot be written.
    """
    if disk_usage(part).free < least:
        raise OSError(ENOSPC, strerror(ENOSPC))
    file = h5py.File(part, "w", track_order=True)
    try:
        fill(file)
        file.flush()
    except (OSError, RuntimeError) as error:
        _keep_open(file, error)  # whose frames hold the datasets
        raise
    file.close()


def _keep_open(*parts: Any) -> None:
    """Have objects live as long as the process, also while Python takes its modules down."""
    import ctypes

    ctypes.pythonapi.Py_IncRef(ctypes.py_object(parts))


@contextmanager
def reported(path: Path) -> Iterator[None]:
    """Return the context that reports an error of HDF5 in one line: the reason, if it tells one."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        found = REASON.search(str(error))
        known = found[1] if found else getattr(error, "strerror", None)
        reason = known or str(error).split("\n", 1)[0]
        raise OutputError(f"{path}: cannot write the result: {reason}") from None
