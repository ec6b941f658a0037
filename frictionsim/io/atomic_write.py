"""Atomic writing of files, and checks that one can be written before a run starts.

New content goes to a part in the folder of its target, .NAME.part, which is flushed and renamed
when it is complete. The writer of a part holds a lock on it. The part of a killed process has none:
the next writer of the same target empties it.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EPERM, EROFS
from itertools import count
from pathlib import Path
from stat import S_IMODE, S_ISREG, S_ISVTX
from typing import IO

from frictionsim.errors import OutputError
from frictionsim.io.regular_file import descriptor_of

try:
    import fcntl
except ImportError:  # Windows
    HAS_LOCKS = False
else:
    HAS_LOCKS = True

SUFFIXES = (".h5", ".hdf5", ".nc")
END = ".part"
EXISTS = "the file exists and is not replaced; give another name"
NEW, PRIVATE = 0o666, 0o600  # modes of a new file, and of one whose mode is set later
PERMISSIONS, GROUP_PERMISSIONS = 0o777, 0o070
PROBE = bytes(4096)
MAX_NAME_LENGTH = 255  # bytes
OPENED = Path("/proc/self/fd")  # of Linux
LOCKING_OF_HDF5 = "HDF5_USE_FILE_LOCKING"  # in the environment, which h5py's `locking` is not above
LOCKED_BY_HDF5 = ("TRUE", "1", "BEST_EFFORT")


class NotReplaced(OutputError):
    """A file could not be replaced; its new content is in `kept`."""

    def __init__(self, text: str, kept: Path) -> None:
        super().__init__(text)
        self.kept = kept


class PartFile:
    """The part of a target, locked by this process; a symbolic link is followed."""

    def __init__(self, path: Path, what: str = "result") -> None:
        self._path, self._what = path, what
        self._descriptor: int | None = None
        with self._reported():
            if reason := _target_problem(path):
                raise OSError(reason)
            self._target = Path(os.path.realpath(path))
            self._name = self._target.with_name(f".{self._target.name}{END}")
            is_new = not self._target.exists()
            self._descriptor = _locked(self._name, NEW if is_new else PRIVATE)
            _parts.append(self)

    @contextmanager
    def _reported(self) -> Iterator[None]:
        """Remove the part on any error, and raise OSError as OutputError of the target."""
        try:
            yield
        except BaseException as error:
            self.discard()
            if not isinstance(error, OSError):
                raise
            reason = error.strerror or str(error)
            text = f"{self._path}: cannot write the {self._what}: {reason}"
            raise OutputError(text) from None

    def probe(self) -> None:
        """Check that the disk is not full, by writing some bytes."""
        with self._reported(), self.opened() as file:
            file.write(PROBE)
            file.truncate(0)

    @contextmanager
    def opened(self) -> Iterator[IO[bytes]]:
        """Return the context of the part as an empty file."""
        assert self._descriptor is not None, "the part is locked"
        os.ftruncate(self._descriptor, 0)
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        with self._reported(), open(self._descriptor, "r+b", closefd=False) as file:
            yield file

    @property
    def content(self) -> Path:
        """The path to open the part: in a folder of others a link may have replaced its name."""
        opened = OPENED / str(self._descriptor)
        return opened if opened.exists() else self._name

    @contextmanager
    def unlocked(self) -> Iterator[None]:
        """Return the context in which HDF5 locks the part itself, if the environment has it so."""
        assert self._descriptor is not None, "the part is locked"
        if HAS_LOCKS and os.environ.get(LOCKING_OF_HDF5) in LOCKED_BY_HDF5:
            with suppress(OSError):
                fcntl.flock(self._descriptor, fcntl.LOCK_UN)
        yield
        if HAS_LOCKS:
            _lock(self._descriptor)

    def rename(self) -> None:
        """Flush the part and rename it to its target, or to an unused name in the same folder."""
        assert self._descriptor is not None, "the part is locked"
        with self._reported():
            if not self._is_in_place():
                raise OSError("another process has replaced the new content; write it again")
            _take_over_mode(self._descriptor, self._target)
            os.fsync(self._descriptor)
            if HAS_LOCKS:  # a shared lock lets HDF5 read
                with suppress(OSError):
                    fcntl.flock(self._descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
            if os.name == "nt":  # an open file cannot be renamed
                self._release()
            try:
                self._name.replace(self._target)
            except OSError as error:
                kept = unused_name(self._target)
                with suppress(OSError):
                    self._name.replace(kept)
                    self._release()
                    raise self._kept(error, kept) from None
                raise
            self._release()
            _sync_folder(self._target.parent)

    def link(self) -> None:
        """Flush the part and give it the name of its target, which must be new."""
        assert self._descriptor is not None, "the part is locked"
        with self._reported():
            os.fsync(self._descriptor)
            try:
                os.link(self._name, self._target)
            except OSError as error:
                if isinstance(error, FileExistsError) or os.path.lexists(self._target):
                    raise OSError(EXISTS) from None
                self.rename()  # a file system without links
            else:
                self.discard()
                _sync_folder(self._target.parent)

    def _kept(self, error: OSError, kept: Path) -> NotReplaced:
        shown = kept if self._path.is_symlink() else self._path.with_name(kept.name)
        return NotReplaced(
            f"{self._path}: cannot replace the file: {error.strerror or error}. The new"
            f" {self._what} is in {shown}: rename it, after closing programs that have the file"
            " open",
            shown,
        )

    def discard(self) -> None:
        """Remove the part, unless it was renamed."""
        if self._descriptor is None:
            return
        is_in_place = self._is_in_place()
        if os.name == "nt":
            self._release()
        if is_in_place:
            with suppress(OSError):
                self._name.unlink()
        self._release()

    def _is_in_place(self) -> bool:
        """Return whether the name is still that of this part: where there are no locks, it may not.

        Another process may have renamed or removed it, and have another part of this name.
        """
        assert self._descriptor is not None, "the part is locked"
        try:
            return os.path.samestat(self._name.lstat(), os.fstat(self._descriptor))
        except OSError:
            return False

    def _release(self) -> None:
        # Forgotten first: a signal may have the part discarded once more at any step.
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            _parts.remove(self)
            os.close(descriptor)


_parts: list[PartFile] = []  # those that this process has locked


def discard_parts() -> None:
    """Remove all parts, before the process ends at once."""
    for part in [*_parts]:
        part.discard()


def _locked(path: Path, mode: int) -> int:
    """Open an empty part and lock it.

    Other users may write to the folder: their links and files are neither followed nor written to.
    """
    while True:
        if path.is_symlink():
            raise OSError(f"'{path.name}' beside it is a link; remove it")
        descriptor = descriptor_of(path, os.O_RDWR | os.O_CREAT, mode)
        try:
            if HAS_LOCKS:
                _lock(descriptor)
            status = os.fstat(descriptor)
            is_own = not hasattr(os, "geteuid") or status.st_uid == os.geteuid()
            if not S_ISREG(status.st_mode) or status.st_nlink > 1 or not is_own:
                raise OSError(f"'{path.name}' beside it is not of this program; remove it")
            with suppress(FileNotFoundError):
                if os.path.samestat(path.lstat(), status):
                    if mode == PRIVATE and hasattr(os, "fchmod"):
                        os.fchmod(descriptor, mode)
                    os.ftruncate(descriptor, 0)
                    return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # its writer has renamed it since


def _lock(descriptor: int) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OSError(
            "another process is writing it now; wait for its end, or give another name"
        ) from None
    except OSError:  # a file system without locks
        pass


def check_place(path: Path, what: str = "result") -> None:
    """Check that a file can be written to a path, by writing its part."""
    part = PartFile(path, what)
    part.probe()
    part.discard()


def check_no_clobber(path: Path) -> None:
    """Check that there is no file at a path."""
    if os.path.lexists(path):
        raise OutputError(
            f"{path}: the file exists and no-clobber forbids to replace it; give another name"
        )


def check_new(path: Path, what: str) -> None:
    """Check that a new file can be written to a path, before its content is computed."""
    # Path.exists fails for a name that is too long.
    if os.path.exists(path) and not os.path.isdir(path):
        raise OutputError(f"{path}: cannot write the {what}: {EXISTS}")
    check_place(path, what)


def write_new(path: Path, text: str, what: str) -> None:
    """Write a new file atomically; no file that appears meanwhile is replaced."""
    check_new(path, what)
    part = PartFile(path, what)
    with part.opened() as file:
        file.write(text.encode())
    part.link()


def write_atomically(image: bytes, path: Path, what: str = "result") -> None:
    """Write a file atomically: on any error the existing file is kept.

    The bytes are written to a part in the same folder, flushed to the disk and renamed. The file
    keeps mode and owner of the one it replaces, as far as the system permits.
    If the existing file cannot be replaced, for example because a program has it open, they are
    kept in the same folder as a.new.h5 for a.h5.
    """
    with replaced_atomically(path, what) as file:
        file.write(image)


@contextmanager
def replaced_atomically(path: Path, what: str = "result") -> Iterator[IO[bytes]]:
    """Open a file that replaces another at the end of the context, as `write_atomically`."""
    part = PartFile(path, what)
    with part.opened() as file:
        yield file
    part.rename()


def _target_problem(path: Path) -> str:
    """Return the reason not to write a file to a path; empty if it may be written."""
    if os.path.isdir(path):
        return "this is a folder; give a file name"
    target = Path(os.path.realpath(path))
    folder = target.parent
    if not folder.is_dir():
        return f"there is no folder '{folder if path.is_symlink() else path.parent}'"
    with suppress(FileNotFoundError):
        if reason := _replacement_problem(target, target.lstat()):
            return reason
    return "" if os.access(folder, os.W_OK) else f"no permission to write in '{path.parent}'"


def _replacement_problem(target: Path, status: os.stat_result) -> str:
    """Return the reason not to replace an existing file; empty if it may be replaced."""
    if target.is_symlink():
        return "this is a link that leads to itself; give a file name"
    if not S_ISREG(status.st_mode):
        return "this is a device; give a file name"
    if not status.st_mode & 0o222:
        return "the existing file is read-only"
    if not hasattr(os, "geteuid"):
        return ""
    folder, user = target.parent.stat(), os.geteuid()
    if folder.st_mode & S_ISVTX and user not in (0, status.st_uid, folder.st_uid):
        return (
            "the existing file belongs to another user, and its folder lets nobody else replace"
            " it (it is sticky); give another name"
        )
    try:
        os.close(os.open(target, os.O_WRONLY))
    except OSError as error:
        # An immutable file cannot be replaced; one of another owner can be.
        return (error.strerror or str(error)) if error.errno in (EPERM, EROFS) else ""
    return ""


def _take_over_mode(descriptor: int, target: Path) -> None:
    """Give a new file the mode and the owner of the one it replaces.

    If the group cannot be kept, the permissions of the group are dropped: it is another group.
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
                mode &= ~GROUP_PERMISSIONS
    with suppress(OSError):  # a file system without modes
        os.fchmod(descriptor, mode)


def unused_name(target: Path) -> Path:
    """Return an unused name: a.new.h5 for a.h5, or a.new2.h5; a long one is cut."""
    for number in count(1):
        mark = ".new" if number == 1 else f".new{number}"
        longest = MAX_NAME_LENGTH - len(os.fsencode(mark + target.suffix))
        stem = os.fsencode(target.stem)[:longest].decode(errors="ignore")
        kept = target.with_name(f"{stem}{mark}{target.suffix}")
        if not os.path.lexists(kept):
            return kept
    raise AssertionError("there is always another number")


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry; not every file system supports this."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
