"""Atomic writing of files, and checks that one can be written before a run starts."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EPERM, EROFS
from itertools import count
from pathlib import Path
from stat import S_IMODE, S_ISREG, S_ISVTX
from time import monotonic, sleep

from frictionsim.errors import OutputError
from frictionsim.io.part_file import part_of

SUFFIXES = (".h5", ".hdf5", ".nc")
NEW, PRIVATE = 0o666, 0o600  # modes of a file that is new, and of one whose mode is still to be set
PERMISSIONS, OF_GROUP = 0o777, 0o070
PROBE = bytes(4096)
MAX_NAME_LENGTH = 255  # bytes

# On Windows a file cannot be replaced while a program has it open: a reader is waited for.
SECONDS_FOR_READERS = 5.0
SECONDS_BETWEEN_TRIES = 0.05

# By target that a reader has not let go of: where its new content is.
_kept: dict[Path, Path] = {}


class KeptBeside(OutputError):
    """A file could not be replaced, and its new content is beside it."""


def check_place(path: Path, what: str = "result") -> None:
    """Check that a file can be written to a path, by writing a part of one beside it.

    Parts of the same file that killed processes have left are removed.

    Parameters
    ----------
    path : Path
    what : str
        What it will be, for the message.
    """
    try:
        reason = _target_problem(path)
        if not reason:
            with part_of(_place(path), PRIVATE) as part:
                part.path.write_bytes(PROBE)
    except OSError as error:  # name too long, no permission to enter the folder, disk full
        reason = error.strerror or str(error)
    if reason:
        raise _not_written(path, what, reason)


def check_no_clobber(path: Path) -> None:
    """Check that there is no file at a path."""
    if os.path.lexists(path):
        raise OutputError(
            f"{path}: the file exists and no_clobber forbids to replace it; give another name"
        )


def _place(path: Path) -> Path:
    """Return the file that a path leads to."""
    return Path(os.path.realpath(path))


def _target_problem(path: Path) -> str:
    """Return why a file must not be written to a path; empty if it may be."""
    if os.path.isdir(path):
        return "this is a folder; give a file name"
    target = _place(path)
    folder = target.parent
    if not folder.is_dir():
        return f"there is no folder '{folder if path.is_symlink() else path.parent}'"
    try:
        found = target.lstat()
    except FileNotFoundError:
        found = None
    if found is not None:
        reason = _replacement_problem(target, found)
        if reason:
            return reason
    return "" if os.access(folder, os.W_OK) else f"no permission to write in '{path.parent}'"


def _replacement_problem(target: Path, found: os.stat_result) -> str:
    """Return why an existing file must not or cannot be replaced; empty if it may be."""
    if target.is_symlink():
        return "this is a link that leads to itself; give a file name"
    if not S_ISREG(found.st_mode):
        return "this is a device; give a file name"
    if not found.st_mode & 0o222:
        return "the existing file is read-only"
    if not hasattr(os, "geteuid"):
        return ""
    folder, user = target.parent.stat(), os.geteuid()
    if folder.st_mode & S_ISVTX and user not in (0, found.st_uid, folder.st_uid):
        return (
            "the existing file belongs to another user, and its folder lets nobody else replace"
            " it (it is sticky); give another name"
        )
    try:
        os.close(os.open(target, os.O_WRONLY))
    except OSError as error:
        # A file that was made immutable cannot be replaced; one that others own can be.
        return (error.strerror or str(error)) if error.errno in (EPERM, EROFS) else ""
    return ""


def _not_written(path: Path, what: str, reason: str) -> OutputError:
    return OutputError(f"{path}: cannot write the {what}: {reason}")


def write_atomically(image: bytes, path: Path, what: str = "result") -> None:
    """Write a file atomically: on any error the existing file is kept.

    The bytes are written to a part file in the same folder, flushed to the disk and renamed. The
    file keeps mode and owner of the one it replaces, as far as the system lets the user.
    If the existing file cannot be replaced, as because a program has it open, they are kept
    beside it as a.new.h5 for a.h5. The next content of a.h5 that this process writes, as at a
    checkpoint, replaces that file, without waiting for the reader again.

    Parameters
    ----------
    image : bytes
        The content.
    path : Path
        The target; a symbolic link is followed.
    what : str
        What it is, for messages.
    """
    with replaced_atomically(path, what) as part, part.open("r+b") as file:
        file.write(image)


@contextmanager
def replaced_atomically(path: Path, what: str = "result") -> Iterator[Path]:
    """Return the context that gives the name of an empty file, which then replaces another.

    Parameters
    ----------
    path : Path
        The target, as of `write_atomically`.
    what : str
        What it is, for messages.
    """
    try:
        reason = _target_problem(path)
        if reason:
            raise _not_written(path, what, reason)
        target = _place(path)
        with part_of(target, PRIVATE if target.exists() else NEW) as part:
            yield part.content
            _take_over_mode(part.descriptor, target)
            os.fsync(part.descriptor)
            if os.name == "nt":
                part.release()  # what is open cannot be renamed
            _replace_or_keep(part.path, target, path, what)
    except OSError as error:
        raise _not_written(path, what, error.strerror or str(error)) from None
    _sync_folder(target.parent)


def _take_over_mode(descriptor: int, target: Path) -> None:
    """Give a new file the mode and the owner of the one it replaces.

    Where the group cannot be kept, the new file has none of its rights: they are of another group.
    """
    if not hasattr(os, "fchown"):
        return
    try:
        old, new = target.stat(), os.fstat(descriptor)
    except FileNotFoundError:
        return
    mode = S_IMODE(old.st_mode) & PERMISSIONS
    if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
        try:
            os.fchown(descriptor, old.st_uid, old.st_gid)
        except OSError:
            try:
                os.fchown(descriptor, -1, old.st_gid)
            except OSError:
                mode &= ~OF_GROUP
    with suppress(OSError):  # a file system without modes
        os.fchmod(descriptor, mode)


def _replace_or_keep(part: Path, target: Path, path: Path, what: str) -> None:
    """Rename a part to its target, or else to a name beside it.

    Raises
    ------
    OutputError
        If it is beside it.
    OSError
        If it cannot be renamed at all.
    """
    try:
        error: OSError | None = _replace(part, target)
    except OSError as other:
        error = other
    if error is None:
        return
    try:
        kept = _keep(part, target)
    except OSError:
        raise error from None
    raise _held(path, what, error, kept)


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
    kept = name_beside(target)
    part.replace(kept)
    _kept[target] = kept
    return kept


def name_beside(target: Path) -> Path:
    """Return a name that no file has yet: a.new.h5 for a.h5, or a.new2.h5; a long one is cut."""
    for number in count(1):
        mark = ".new" if number == 1 else f".new{number}"
        longest = MAX_NAME_LENGTH - len(os.fsencode(mark + target.suffix))
        stem = os.fsencode(target.stem)[:longest].decode(errors="ignore")
        kept = target.with_name(f"{stem}{mark}{target.suffix}")
        if not os.path.lexists(kept):
            return kept
    raise AssertionError("there is always another number")


def _held(path: Path, what: str, error: OSError, kept: Path) -> KeptBeside:
    shown = kept if path.is_symlink() else path.with_name(kept.name)
    why = error.strerror or error
    if isinstance(error, PermissionError):
        return KeptBeside(
            f"{path}: cannot replace the file: {why}; another program may have it open."
            f" The new {what} is in {shown}: close the other program, then rename it"
        )
    return KeptBeside(
        f"{path}: cannot replace the file: {why}. The new {what} is in {shown}: rename it"
    )


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry; not every file system supports this."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
