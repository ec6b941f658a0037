"""Atomic writing of result files, and checks that a file can be written before a run starts."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic, sleep

from frictionsim.errors import OutputError

SUFFIXES = (".h5", ".hdf5", ".nc")
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"

# On Windows a file cannot be replaced while a program has it open: a reader is waited for.
SECONDS_FOR_READERS = 5.0
SECONDS_BETWEEN_TRIES = 0.05

# By target that a reader has not let go of: where its new content is.
_kept: dict[Path, Path] = {}


def check_writable(path: Path) -> None:
    """Check that a result can be written to a path.

    Raises
    ------
    OutputError
        If it cannot, with the reason.
    """
    try:
        reason = _target_problem(path)
    except OSError as error:  # name too long, or no permission to enter the folder
        reason = error.strerror or str(error)
    if reason:
        raise _not_written(path, reason)


def check_no_clobber(path: Path) -> None:
    """Check that there is no file at a path.

    Raises
    ------
    OutputError
        If there is one.
    """
    if os.path.lexists(path):
        raise OutputError(
            f"{path}: the file exists and --no-clobber forbids to replace it; give another name"
        )


def check_replaceable(path: Path, beginnings: tuple[bytes, ...], what: str) -> None:
    """Check that an existing file is of the kind that will replace it, as tables replace tables.

    Parameters
    ----------
    path : Path
    beginnings : tuple of bytes
        That a file of this kind begins with one of; an empty file is of every kind.
    what : str
        The kind, for the message.

    Raises
    ------
    OutputError
        If it is another file.
    """
    try:
        with path.open("rb") as file:
            found = file.read(max(map(len, beginnings)))
    except OSError:
        return  # there is none, or writing will say what is wrong
    if found and not found.startswith(beginnings):
        raise OutputError(
            f"{path}: the existing file is not {what} and is not overwritten; give another name"
        )


def _target_problem(path: Path) -> str:
    """Return why a result must not be written to a path; empty if it may be."""
    folder = path.parent
    if path.is_dir():
        return "this is a folder; give a file name"
    if path.exists():
        if not path.is_file():
            return "this is a device; give a file name"
        if not path.stat().st_mode & 0o222:
            return "the existing file is read-only"
        if path.suffix not in SUFFIXES and not _has_hdf5_signature(path):
            return "the existing file is not a result and is not overwritten; give another name"
    if not folder.is_dir():
        return f"there is no folder '{folder}'"
    return "" if os.access(folder, os.W_OK) else f"no permission to write in '{folder}'"


def _has_hdf5_signature(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(HDF5_SIGNATURE)) == HDF5_SIGNATURE


def _not_written(path: Path, reason: str) -> OutputError:
    return OutputError(f"{path}: cannot write the result: {reason}")


def write_atomically(image: bytes, path: Path) -> None:
    """Write a file atomically: on any error the existing file is kept.

    The bytes are written to a temporary file in the same folder, flushed to the disk and renamed.
    If the existing file cannot be replaced because a program has it open, they are kept beside it
    as a.new.h5 for a.h5. The next content of a.h5 that this process writes, as at a checkpoint,
    replaces that file, without waiting for the reader again.

    Parameters
    ----------
    image : bytes
        The content.
    path : Path
        The target; a symbolic link is followed.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with replaced_atomically(path) as part, part.open("xb") as file:
        file.write(image)


@contextmanager
def replaced_atomically(path: Path) -> Iterator[Path]:
    """Return the context that gives a name for a new file, which then replaces another.

    Parameters
    ----------
    path : Path
        The target, as of `write_atomically`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    check_writable(path)
    target = Path(os.path.realpath(path))
    # PIDs are reused, so a part file of a killed process may exist: add random digits.
    part = target.with_name(f".{target.name}.{os.getpid()}.{os.urandom(4).hex()}.part")
    try:
        yield part
        with part.open("r+b") as file:
            os.fsync(file.fileno())
        held = _replace(part, target)
        if held is not None:
            raise _held(path, held, _keep(part, target))
    except OSError as error:
        raise _not_written(path, error.strerror or str(error)) from None
    finally:
        with suppress(OSError):
            part.unlink()  # it exists only after an error
    _sync_folder(target.parent)


def _replace(part: Path, target: Path) -> PermissionError | None:
    """Rename a file to its target, waiting for programs that have the target open.

    Returns
    -------
    PermissionError or None
        The last error if they did not close it.
    """
    latest = monotonic() + (0.0 if target in _kept else SECONDS_FOR_READERS)
    while True:
        try:
            part.replace(target)
        except PermissionError as error:
            if monotonic() >= latest:
                return error
            sleep(SECONDS_BETWEEN_TRIES)
        else:
            _kept.pop(target, None)
            return None


def _keep(part: Path, target: Path) -> Path:
    """Rename a file to a visible name beside its target, and return that name."""
    if target in _kept:
        with suppress(PermissionError):  # that file is open as well
            part.replace(_kept[target])
            return _kept[target]
    kept, number = target.with_name(f"{target.stem}.new{target.suffix}"), 2
    while os.path.lexists(kept):
        kept = target.with_name(f"{target.stem}.new{number}{target.suffix}")
        number += 1
    part.replace(kept)
    _kept[target] = kept
    return kept


def _held(path: Path, held: PermissionError, kept: Path) -> OutputError:
    shown = kept if path.is_symlink() else path.with_name(kept.name)
    return OutputError(
        f"{path}: cannot replace the file: {held.strerror or held}; another program may have it"
        f" open. The new result is in {shown}: close the other program, then rename it"
    )


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry; not every file system supports this."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
