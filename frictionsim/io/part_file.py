"""Part files: new content beside its target, until it is whole and is renamed to it.

The name of a part is short, whatever that of the target: a digest of it, and random digits, so that
nobody can put a file or a link there beforehand. Whoever writes a part holds a shared lock on it.
A part without a lock is left over from a process that was killed; the next process that writes
the same target removes it. On Windows a file that is open cannot be removed, which does the same.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from stat import S_ISREG

try:
    import fcntl
except ImportError:  # Windows
    HAS_LOCKS = False
else:
    HAS_LOCKS = True

OPENED = Path("/proc/self/fd")  # of Linux
START, END, END_UNLOCKED = ".frictionsim-", ".part", ".unlocked-part"
# With one of these HDF5 locks each file that it writes, and cannot where there is a lock already.
HDF5_LOCKS = "HDF5_USE_FILE_LOCKING"
ALWAYS = ("1", "TRUE", "BEST_EFFORT")


class PartFile:
    """A part that is being written.

    Attributes
    ----------
    path : Path
        For renaming it.
    content : Path
        For opening it: that of the open file where the system has such names. In a folder that
        others may write to, somebody may have put a link in the place of `path`.
    """

    def __init__(self, path: Path, descriptor: int) -> None:
        self.path = path
        opened = OPENED / str(descriptor)
        self.content = opened if opened.exists() else path
        self._descriptor: int | None = descriptor

    @property
    def descriptor(self) -> int:
        """Of the open file."""
        assert self._descriptor is not None, "the part was released"
        return self._descriptor

    def release(self) -> None:
        """Give the lock up."""
        if self._descriptor is not None:
            os.close(self._descriptor)
        self._descriptor = None


@contextmanager
def part_of(target: Path, mode: int) -> Iterator[PartFile]:
    """Return the context of a new part; it is removed in the end if it was not renamed.

    Parameters
    ----------
    target : Path
        A file, no link.
    mode : int
        Of the part, less the bits of the umask.

    Raises
    ------
    OSError
    """
    remove_left_over(target)
    part = _created(target, mode)
    try:
        yield part
    finally:
        if not HAS_LOCKS:
            part.release()
        with suppress(OSError):
            part.path.unlink()
        part.release()


def remove_left_over(target: Path) -> None:
    """Remove the parts of a target that killed processes of the same user have left."""
    start = _start(target)
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if entry.name.startswith(start) and entry.name.endswith(END):
                _remove_unlocked(Path(entry))


def _start(target: Path) -> str:
    return f"{START}{sha256(os.fsencode(target.name)).hexdigest()[:16]}-"


def _created(target: Path, mode: int) -> PartFile:
    end = END if os.environ.get(HDF5_LOCKS, "").upper() not in ALWAYS else END_UNLOCKED
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    while True:
        path = target.with_name(f"{_start(target)}{os.urandom(8).hex()}{end}")
        descriptor = os.open(path, flags, mode)
        if end == END_UNLOCKED or _is_locked(descriptor):
            return PartFile(path, descriptor)
        os.close(descriptor)  # another process took it for one that is left over


def _is_locked(descriptor: int) -> bool:
    """Lock a new part, and return whether it is still there."""
    if not HAS_LOCKS:
        return True
    try:
        # Shared: of what a part is renamed to, HDF5 locks readers out while there is another lock.
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks: nobody can tell that the part is left over
        return True
    return os.fstat(descriptor).st_nlink > 0


def _remove_unlocked(path: Path) -> None:
    if not HAS_LOCKS:
        with suppress(OSError):
            path.unlink()
        return
    try:
        found = path.lstat()
        if not S_ISREG(found.st_mode) or found.st_uid != os.geteuid():
            return
        descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        path.unlink()
    except OSError:  # it is being written, or there are no locks
        pass
    finally:
        os.close(descriptor)
