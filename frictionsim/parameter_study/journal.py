"""The journal of a sweep: the outcomes of its runs, appended as they come.

    frictionsim runs 1\\n       then 32 bytes: the SHA-256 digest of the study
    length, CRC-32, block       again and again; two numbers of 4 bytes, then `Block.to_bytes`

It stands beside the file of the sweep, as FILE.h5.runs, while that is not whole. A process that is
killed leaves it; its last block may be torn. Whoever writes the sweep holds a lock on it.
"""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from stat import S_ISREG
from struct import Struct
from time import monotonic
from zlib import crc32

from frictionsim.errors import OutputError
from frictionsim.parameter_study.block import Block

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

SUFFIX = ".runs"
MARK = b"frictionsim runs 1\n"
DIGEST_LENGTH = 32
LENGTH_OF_START = len(MARK) + DIGEST_LENGTH
HEAD = Struct("<II")
MAX_BLOCK = 64 * 2**20  # bytes; one of 4096 runs has less than 1 MB
SECONDS_BETWEEN_SYNCS = 1.0
PLACE_OF_LOCK = 2**30  # on Windows what is locked cannot be read


def journal_name(path: Path) -> Path:
    """Return the name of the journal of a file: a.h5.runs for a.h5."""
    return path.with_name(path.name + SUFFIX)


def remove_left_over(path: Path) -> None:
    """Remove the journal of a complete file, whose process was killed before it did so."""
    if journal_name(path).is_file():
        with suppress(OutputError):  # it is no journal, or another process has it
            Journal(path).close(remove=True)


class Journal:
    """The open journal of a file, which this process has locked.

    Parameters
    ----------
    path : Path
        Of the file of the sweep.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._of = journal_name(path), path
        self._synced = monotonic()
        try:
            self._descriptor = self._locked()
        except OSError as error:
            raise self._failed(error) from None

    def _locked(self) -> int:
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
        while True:
            descriptor = os.open(self.path, flags | getattr(os, "O_NONBLOCK", 0), 0o666)
            try:
                if not S_ISREG(os.fstat(descriptor).st_mode):
                    raise OutputError(
                        f"{self.path}: the sweep needs this name, and it is no file; remove it"
                    )
                _lock(descriptor)
                self._check_ours(descriptor)
            except BlockingIOError:
                os.close(descriptor)
                raise OutputError(
                    f"{self._of}: another process is running this sweep now; wait for its end, or"
                    " stop it"
                ) from None
            except BaseException:
                os.close(descriptor)
                raise
            if os.fstat(descriptor).st_nlink:
                return descriptor
            os.close(descriptor)  # the other process has finished and removed it

    def _check_ours(self, descriptor: int) -> None:
        start = os.read(descriptor, len(MARK))
        if start and start != MARK[: len(start)]:
            raise OutputError(
                f"{self.path}: the sweep needs this name, and the file is not one of a sweep; move"
                " it"
            )

    def start(self, digest: bytes) -> None:
        """Begin anew, for a study."""
        try:
            os.ftruncate(self._descriptor, 0)
            os.lseek(self._descriptor, 0, os.SEEK_SET)
            self._write(MARK + digest)
            os.fsync(self._descriptor)
        except OSError as error:
            raise self._failed(error) from None

    def append(self, image: bytes) -> None:
        """Append a block; it is kept when this process is killed, some seconds later always."""
        try:
            self._write(HEAD.pack(len(image), crc32(image)) + image)
            if monotonic() - self._synced > SECONDS_BETWEEN_SYNCS:
                os.fsync(self._descriptor)
                self._synced = monotonic()
        except OSError as error:
            raise self._failed(error) from None

    def _write(self, content: bytes) -> None:
        left = memoryview(content)
        while left:
            left = left[os.write(self._descriptor, left) :]

    def blocks(self, digest: bytes) -> Iterator[Block]:
        """Yield the blocks of a study, up to the first that is not whole; none of another study."""
        with open(os.dup(self._descriptor), "rb") as file:
            size = os.fstat(file.fileno()).st_size
            file.seek(0)
            if file.read(LENGTH_OF_START) != MARK + digest:
                return
            while len(head := file.read(HEAD.size)) == HEAD.size:
                length, checksum = HEAD.unpack(head)
                if length > min(MAX_BLOCK, size - file.tell()):
                    return
                image = file.read(length)
                if len(image) < length or crc32(image) != checksum:
                    return
                try:
                    block = Block.from_bytes(image)
                except ValueError:
                    return
                yield block

    def close(self, remove: bool) -> None:
        """Give the lock up, and remove the file if it is not needed any more, or empty."""
        if self._descriptor < 0:
            return
        remove = remove or not os.fstat(self._descriptor).st_size
        if remove and fcntl is not None:
            with suppress(OSError):
                self.path.unlink()
        os.close(self._descriptor)
        self._descriptor = -1
        if remove and fcntl is None:  # Windows does not remove what is open
            with suppress(OSError):
                self.path.unlink()

    def _failed(self, error: OSError) -> OutputError:
        return OutputError(
            f"{self._of}: cannot write the sweep: {self.path.name}: {error.strerror or error}"
        )


def _lock(descriptor: int) -> None:
    """Lock a file for this process, where the system can.

    Raises
    ------
    BlockingIOError
        If another process has locked it.
    """
    if fcntl is None:
        _lock_on_windows(descriptor)
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:  # a file system without locks
        pass


def _lock_on_windows(descriptor: int) -> None:
    try:
        import msvcrt
    except ImportError:
        return
    try:
        os.lseek(descriptor, PLACE_OF_LOCK, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
    except OSError:
        raise BlockingIOError from None
    finally:
        os.lseek(descriptor, 0, os.SEEK_SET)
