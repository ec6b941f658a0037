"""Files that appear whole or not at all, and replace only files of their own kind.

New content goes to a part in the folder of its target, .NAME.HOST.PROCESS.N.part, which is flushed
to the disk and renamed when it is complete. What a killed process has left is removed by the next
writer of the same name on the same host.

A result replaces a result, a sweep a sweep, a picture a picture, and so on; a file of any other
kind is refused whatever its name is. Kinds are seen by how a file begins, and HDF5 also by the line
with our checksum at its end: without it another program made or changed the file. An empty file may
be replaced by anything: programs that reserve names create such files.

This line, the trailer of the HDF5 data, has their CRC-32, to detect damage before a file is opened:
HDF5 has no checksum of its metadata, and its library may crash or hang on a damaged file. It
ignores data after its end of file and drops them when another program changes the file. Therefore
a trailer must match, but a missing one is accepted.
"""

import logging
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import count
from pathlib import Path
from platform import node
from stat import S_IMODE
from typing import IO, NamedTuple
from zlib import crc32

from frictionsim.errors import InputError, OutputError
from frictionsim.results import HDF5_SIGNATURE

LOG = logging.getLogger(__name__)

HEAD = 2**16  # bytes that tell the kind of a file
PROBE = bytes(4096)
END = ".part"
MAX_STEM = 120  # bytes of a name that its part has
NEW, PRIVATE = 0o666, 0o600  # modes of a new file, less the umask, and of one that gets another
SUFFIXES = (".h5", ".hdf5", ".nc")
MARKS = RESULT_MARK, SWEEP_MARK = b"\nfrictionsim crc32 ", b"\nfrictionsim sweep "
LENGTH = len(RESULT_MARK) + len(b"01234567\n")
BLOCK = 1 << 20


class Kind(NamedTuple):
    """A kind of file that the program writes."""

    word: str
    described: str  # with its article, for messages
    begins: bytes  # a regular expression
    mark: bytes = b""  # start of the line with the checksum

    def recognises(self, path: Path) -> bool:
        """Return whether a file is of this kind."""
        with path.open("rb") as file:
            begins = re.match(self.begins, file.read(HEAD), re.DOTALL) is not None
            return begins and (not self.mark or mark_of(file) == self.mark)


HDF5 = re.escape(HDF5_SIGNATURE)
RESULT = Kind("result", "a result", HDF5, RESULT_MARK)
SWEEP = Kind("sweep", "a sweep", HDF5, SWEEP_MARK)
UNFINISHED_SWEEP = Kind("sweep", "an unfinished sweep", rb'\{"sweep_version": ')
COSTS = Kind("table", "a table of costs", rb"(#[^\n]*\n)*law,backend,setting,")
CHANNELS_IN_CSV = Kind("table", "a table of channels in CSV", rb"time \[s\],")
SWEEP_IN_CSV = Kind(
    "table", "a sweep in CSV", rb"run \[1\],[^\r\n]*,status,failure,reason,warnings\r?\n"
)
SOBOL_IN_CSV = Kind("table", "a table of Sobol indices in CSV", rb"quantity,key,sobol_first ")
PICTURE = Kind("picture", "a picture", rb"\x89PNG|%PDF|<svg|<\?xml.{,4000}<svg")
REPORT = Kind("report", "a report", rb'.{,4000}<meta name="generator" content="frictionsim"')
SCENARIO = Kind("scenario", "a scenario", rb"(?!)")  # never replaced
SCHEMA = Kind("schema", "a schema", rb"(?!)")
ANIMATIONS = {
    ".gif": Kind("animation", "a GIF", rb"GIF8[79]a"),
    ".mp4": Kind("animation", "an MP4", rb".{4}ftyp"),
}
"""By suffix."""

_parts: set[Path] = set()  # those that this process is writing
_numbers = count()  # of them; none is used twice


@contextmanager
def replacing(path: Path, kind: Kind) -> Iterator[IO[bytes]]:
    """Return the context of an empty file that replaces the one at a path at its end.

    On any error the existing file is as it was. A symbolic link is followed; the file has the mode
    of the one that it replaces.

    Raises
    ------
    OutputError
        If it cannot be written, or would replace a file of another kind.
    """
    check_replaceable(path, kind)
    with _part_of(path, kind) as (part, file):
        yield file
        target = Path(os.path.realpath(path))
        file.flush()
        if target.exists():
            with suppress(OSError):  # a file system without modes
                part.chmod(S_IMODE(target.stat().st_mode) & 0o777)
        os.fsync(file.fileno())
        file.close()  # Windows renames no open file
        part.replace(target)
        _sync_folder(target.parent)


@contextmanager
def _part_of(path: Path, kind: Kind) -> Iterator[tuple[Path, IO[bytes]]]:
    """Return the context of a new part of a file; it is removed at the end, if still there."""
    try:
        if reason := _problem(path):
            raise OSError(reason)
        target = Path(os.path.realpath(path))
        remove_parts_of_ended_processes(target)
        part = target.with_name(f"{_start(target)}.{os.getpid()}.{next(_numbers)}{END}")
        mode = PRIVATE if target.exists() else NEW
        _parts.add(part)
        try:
            with open(part, "x+b", opener=partial(os.open, mode=mode)) as file:
                yield part, file
        finally:
            with suppress(OSError):
                part.unlink()
            _parts.discard(part)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"{path}: cannot write the {kind.word}: {reason}") from None


def _start(target: Path) -> str:
    """Return how the names of the parts of a file begin; a long name is cut."""
    stem = os.fsencode(target.name)[:MAX_STEM].decode(errors="ignore")
    host = re.sub(r"[^\w-]", "_", node())[:MAX_STEM]
    return f".{stem}.{host}"


def remove_parts_of_ended_processes(target: Path) -> None:
    """Remove the parts of a file whose writers, on this host, have been killed."""
    start = _start(target) + "."
    with suppress(OSError):
        for name in os.listdir(target.parent):
            if name.startswith(start) and name.endswith(END):
                process = name.removeprefix(start).split(".")[0]
                if process.isdecimal() and not _runs(int(process)):
                    with suppress(OSError):
                        target.with_name(name).unlink()


def _runs(process: int) -> bool:
    """Return whether there is a process of a number; where it is not known, there is one."""
    with suppress(PermissionError):
        try:
            if os.name != "nt":  # there `kill` would end it
                os.kill(process, 0)
        except (ProcessLookupError, OverflowError):
            return False
    return True


def discard_parts() -> None:
    """Remove all parts, before the process ends at once."""
    for part in [*_parts]:
        with suppress(OSError):
            part.unlink()


def write_file(path: Path, content: bytes, kind: Kind) -> None:
    """Write a file as `replacing`."""
    with replacing(path, kind) as file:
        file.write(content)


def write_new(path: Path, text: str, kind: Kind) -> None:
    """Write a new file, whole or not at all."""
    check_free(path, kind)
    write_file(path, text.encode(), kind)


def check_output(path: Path, kind: Kind) -> None:
    """Check that a file can be written, before its content is computed, by writing its part.

    Raises
    ------
    OutputError
        If it cannot be written, or would replace a file of another kind.
    """
    check_replaceable(path, kind)
    with _part_of(path, kind) as (_, file):
        file.write(PROBE)
        file.flush()


def check_free(path: Path, kind: Kind) -> None:
    """Check that there is no file at a path, as `no_clobber` wants; the folder is not looked at."""
    if os.path.lexists(path) and not os.path.isdir(path):
        raise OutputError(
            f"{path}: cannot write the {kind.word}: the file exists and is not replaced; give"
            " another name"
        )


def check_replaceable(path: Path, kind: Kind) -> None:
    """Check that an existing file is of the kind that will replace it."""
    if not os.path.isfile(path) or not os.path.getsize(path):
        return
    try:
        if kind.recognises(path):
            return
        changed = ", or was changed by another program," * bool(kind.mark)
        reason = f"the existing file is not {kind.described}{changed} and is not overwritten"
    except OSError as error:
        reason = f"the existing file cannot be read ({error.strerror}) and is not overwritten"
    raise OutputError(f"{path}: cannot write the {kind.word}: {reason}; give another name")


def remove_unfinished(path: Path, kind: Kind) -> None:
    """Remove the unfinished file of what is done now, unless it is of another kind by now."""
    with suppress(OSError, OutputError):
        check_replaceable(path, kind)
        path.unlink()
        LOG.info("unfinished %s removed: %s", kind.word, path)
    remove_parts_of_ended_processes(path)


def check_apart(paths: dict[str, Path]) -> None:
    """Check that the files of one command, by option, are distinct."""
    options: dict[str, str] = {}
    for option, path in paths.items():
        place = os.path.normcase(os.path.realpath(path))
        if place in options:
            raise InputError(
                f"{options[place]} and {option} would both be written to {path}; give two names"
            )
        options[place] = option


def _problem(path: Path) -> str:
    """Return the reason not to write a file to a path; empty if it may be written."""
    target = Path(os.path.realpath(path))
    folder = target.parent
    if os.path.isdir(path):
        return "this is a folder; give a file name"
    if not folder.is_dir():
        return f"there is no folder '{folder if path.is_symlink() else path.parent}'"
    if os.path.lexists(target) and not os.path.isfile(target):
        return "this is a device, or a link that leads to itself; give a file name"
    if os.path.isfile(target) and not os.stat(target).st_mode & 0o222:
        return "the existing file is read-only"
    return "" if os.access(folder, os.W_OK) else f"no permission to write in '{path.parent}'"


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry; not every file system supports this."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def append_trailer(file: IO[bytes], mark: bytes) -> None:
    """Append the trailer to an open file, whose content is read back."""
    file.flush()
    checksum = _crc32_of(file, file.seek(0, os.SEEK_END))
    file.seek(0, os.SEEK_END)
    file.write(mark + b"%08x\n" % checksum)


def mark_of(file: IO[bytes]) -> bytes:
    """Return the mark of the trailer of an open file; empty if it has none."""
    file.seek(max(file.seek(0, os.SEEK_END) - LENGTH, 0))
    mark = file.read(len(RESULT_MARK))
    return mark if mark in MARKS else b""


def is_damaged(file: IO[bytes]) -> bool:
    """Return whether an open file has a trailer that does not match its content."""
    if not mark_of(file):
        return False
    stated = file.read()
    return stated != b"%08x\n" % _crc32_of(file, file.seek(0, os.SEEK_END) - LENGTH)


def _crc32_of(file: IO[bytes], length: int) -> int:
    """Return the checksum of the first bytes; of fewer if the file has been truncated."""
    checksum = 0
    file.seek(0)
    while length > 0 and (block := file.read(min(length, BLOCK))):
        checksum = crc32(block, checksum)
        length -= len(block)
    return checksum
