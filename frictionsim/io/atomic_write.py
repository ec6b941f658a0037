"""Where a result may go, and how it gets there whole or not at all."""

import os
from contextlib import suppress
from pathlib import Path

from frictionsim.errors import OutputError

SUFFIXES = (".h5", ".hdf5", ".nc")
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def check_writable(path: Path) -> None:
    """See that a result can be put at a path, before the time to compute it is spent.

    Raises
    ------
    OutputError
    """
    try:
        reason = _target_problem(path)
    except OSError as error:  # a name that is too long, a folder that may not be entered
        reason = error.strerror or str(error)
    if reason:
        raise _not_written(path, reason)


def check_no_clobber(path: Path) -> None:
    """See that there is no file yet.

    Raises
    ------
    OutputError
    """
    if os.path.lexists(path):
        raise OutputError(
            f"{path}: cannot write here: there is a file, which --no-clobber protects; name another"
        )


def _target_problem(path: Path) -> str:
    """Return why a result must not be put at a path; empty if it may."""
    folder = path.parent
    if path.is_dir():
        return "this is a folder; give a file name"
    if path.exists():
        if not path.is_file():
            return "this is a device; give the name of a file"
        if not path.stat().st_mode & 0o222:
            return "the file that is there is read-only"
        if path.suffix not in SUFFIXES and not _starts_as_hdf5(path):
            return "the file that is there is no result; it would be lost"
    if not folder.is_dir():
        return f"there is no folder '{folder}'"
    return "" if os.access(folder, os.W_OK) else f"no permission to write in '{folder}'"


def _starts_as_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(HDF5_SIGNATURE)) == HDF5_SIGNATURE


def _not_written(path: Path, reason: str) -> OutputError:
    return OutputError(f"{path}: cannot write the result: {reason}")


def write_atomically(image: bytes, path: Path) -> None:
    """Have a file consist of these bytes, or be what it was.

    They are written beside the target, flushed to the disk and renamed: at no time is there half
    a result, and whatever goes wrong, an older one stays.

    Raises
    ------
    OutputError
    """
    check_writable(path)
    target = Path(os.path.realpath(path))
    # The number of a process that was killed may come again: its part must not be in the way.
    part = target.with_name(f".{target.name}.{os.getpid()}.{os.urandom(4).hex()}.part")
    try:
        with part.open("xb") as file:
            file.write(image)
            file.flush()
            os.fsync(file.fileno())
        part.replace(target)
    except OSError as error:
        raise _not_written(path, error.strerror or str(error)) from None
    finally:
        with suppress(OSError):
            part.unlink()  # gone already where all went well
    _sync_folder(target.parent)


def _sync_folder(folder: Path) -> None:
    """Have the disk know the new name, too; some file systems have no such thing."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
