"""Segments: the samples of a run that is not over, in files beside its result.

Why they survive a kill. A segment is written to a temporary file, flushed to the disk and renamed,
and is never opened for writing again; so is the incomplete result, which says how many segments
belong to it. At any instant there are therefore whole segments, at least as many as the incomplete
result on the disk counts, and that result itself, whole. Segments beyond its count are of the time
after it; when the run is resumed they are computed again. A file that a kill could leave damaged,
one that is open for writing during the run, does not exist; nor are journals needed.

A segment of the number 7 is NAME.samples-<random digits>/000007.segment and holds (`segment_file`)

    time, the channels   samples of the recorded channels, as a result holds them
    other arrays         of what only summary, audit, events and warnings need
    `after`              the checksum of the segment before it; 0 of the first

and the line with its checksum. That of the last segment therefore depends on all of them.

A result that refers to segments may be of anyone. Only a folder that has such a name is looked at,
only files with the names of segments are read or removed in it, and what they hold is checked.
"""

import os
import re
import shutil
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.checksum import checksum_of, checksum_trailer
from frictionsim.io.segment_file import SegmentFile, is_folder, open_regular, segment_image

MARK = ".samples-"
DIGITS = 8  # hexadecimal, after the mark
FOLDER_NAME = re.compile(rf".+{re.escape(MARK)}[0-9a-f]{{{DIGITS}}}", re.DOTALL)
SUFFIX = ".segment"
FILE_NAME = re.compile(rf"[0-9]{{6,}}{re.escape(SUFFIX)}")
PART = ".frictionsim-"
MAX_STEM_LENGTH = 200  # bytes
OWNER = "run"
MAX_SEGMENTS = 10**9  # segments, and samples of each


class SampleSegments:
    """The segments in one folder, which is made when the first is written.

    Parameters
    ----------
    folder : Path
    checksum : int
        Of the last segment.
    """

    def __init__(self, folder: Path, checksum: int = 0) -> None:
        self.folder, self.checksum = folder, checksum
        self._inherited: Path | None = None
        self._opened: tuple[int, SegmentFile] | None = None

    @classmethod
    def beside(cls, result: Path) -> "SampleSegments":
        """Return new segments beside a result file."""
        name = f"{_start_of_names(result)}{os.urandom(DIGITS // 2).hex()}"
        return cls(Path(os.path.realpath(result)).with_name(name))

    @property
    def name(self) -> str:
        """The name of the folder."""
        return self.folder.name

    @property
    def place(self) -> Path:
        """The folder."""
        return self.folder

    def free_bytes(self) -> int:
        """Return how much space the disk has, and what is in the folder already."""
        own = sum(file.lstat().st_size for file in self.folder.glob(f"*{SUFFIX}"))
        return shutil.disk_usage(self.folder.parent).free + own

    def path(self, number: int) -> Path:
        """Return the file of a segment."""
        return self.folder / f"{number:06d}{SUFFIX}"

    def write(self, number: int, recorded: dict[str, Any], kept: dict[str, Any]) -> None:
        """Write a segment."""
        self._make_folder()
        image = segment_image(self.checksum, recorded, kept)
        path = self.path(number)
        try:
            if path.is_symlink():  # it would be written to where that leads
                path.unlink(missing_ok=True)
            write_atomically(image, path)
        except OutputError as error:
            raise OutputError(
                f"{error}. The samples before these are kept: make space, or give another place"
                " with -o, and resume the run if there is an incomplete result"
            ) from None
        self.checksum = checksum_of(image[-len(checksum_trailer(b"")) :])

    def _make_folder(self) -> None:
        if is_folder(self.folder):
            return
        try:
            if self.folder.is_symlink():
                raise OSError("there is a link of that name")
            # Another process that finds it without an owner takes it for left over: try again.
            for _ in range(9):
                with suppress(FileNotFoundError):
                    self.folder.mkdir(exist_ok=True)
                    _write_owner(self.folder)
                if in_use(self.folder):
                    return
            self.folder.mkdir()
        except OSError as error:
            raise OutputError(
                f"{self.folder}: cannot create the folder for samples: {error.strerror or error}"
            ) from None

    def rows(self, number: int, name: str, start: int, stop: int) -> Any:
        """Return rows of an array of a segment."""
        try:
            return self._file(number).rows(name, start, stop)
        except (OSError, ValueError):
            raise self._missing(number) from None

    def length(self, number: int) -> int:
        """Return the number of samples of a segment; raise InputError if it is damaged."""
        try:
            return self._file(number).array("time").shape[0]
        except (OSError, ValueError):
            raise self._missing(number) from None

    def rows_like(self, tail: Any, number: int, name: str, start: int, stop: int) -> Any:
        """Return rows of a channel as `rows` does, with the columns of those that follow."""
        found = self.rows(number, name, start, stop)
        if found.shape != (stop - start, *tail.shape[1:]):
            raise self._missing(number)
        return found

    def compressed(self, number: int, name: str) -> list[bytes] | None:
        """Return the chunks of a channel of a segment; None if it is not stored in chunks."""
        try:
            return self._file(number).compressed(name)
        except (OSError, ValueError):
            raise self._missing(number) from None

    def _file(self, number: int) -> SegmentFile:
        if self._opened is None or self._opened[0] != number:
            self.close()
            if not is_folder(self.folder):
                raise OSError("no folder, or a link to one")
            self._opened = number, SegmentFile(self.path(number))
        return self._opened[1]

    def _missing(self, number: int) -> InputError:
        return InputError(
            f"{self.path(number)}: cannot read these samples of an incomplete result: the file is"
            f" missing or damaged; keep the folder '{self.name}' and the result together"
        )

    def close(self) -> None:
        """Close the file that is open."""
        if self._opened is not None:
            self._opened[1].close()
            self._opened = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_opened": None}

    def check(self, count: int, checksum: int) -> None:
        """Check that the first segments are there, and that they are those of a result."""
        before = 0
        for number in range(count):
            self.close()
            try:
                file = self._file(number)
                found = file.checksum()
            except (OSError, ValueError):
                raise self._missing(number) from None
            if file.after != before:
                raise self._missing(number)
            before = found
        self.close()
        if before != checksum:
            raise self._missing(count - 1)

    def restore(self, count: int, checksum: int) -> None:
        """Take over the first segments; later ones are removed."""
        if self._inherited is not None:
            SampleSegments(self._inherited).check(count, checksum)
            self._make_folder()
            try:
                for number in range(count):
                    self._take(number)
            except OSError as error:
                raise OutputError(
                    f"{self.folder}: cannot copy the samples so far: {error.strerror or error}"
                ) from None
        else:
            self.check(count, checksum)
            self._take_possession()
        self.checksum, number = checksum, count
        while os.path.lexists(self.path(number)):
            self.path(number).unlink()
            number += 1

    def _take_possession(self) -> None:
        """State that this process writes in the folder now."""
        if hasattr(os, "geteuid") and self.folder.lstat().st_uid != os.geteuid():
            raise InputError(
                f"{self.folder}: cannot resume from these sample segments: the"
                " folder belongs to another user; resume into another file with -o"
            )
        with suppress(OSError):
            _write_owner(self.folder)

    def inherit(self, folder: Path) -> None:
        """Have `restore` take the segments from another folder, which stays as it is."""
        self._inherited = folder

    def _take(self, number: int) -> None:
        assert self._inherited is not None
        source, target = self._inherited / self.path(number).name, self.path(number)
        with suppress(FileNotFoundError):
            target.unlink()
        try:
            os.link(source, target, follow_symlinks=False)
        except (OSError, NotImplementedError):  # another file system, or one without links
            with open_regular(source) as file, target.open("xb") as copy:
                shutil.copyfileobj(file, copy)

    def remove(self) -> None:
        """Remove the segments, and the folder if nothing else is in it."""
        self.close()
        if not is_folder(self.folder):
            return
        with suppress(OSError):
            for file in self.folder.iterdir():
                if _is_ours(file.name):
                    file.unlink()
            self.folder.rmdir()


def _write_owner(folder: Path) -> None:
    """Write the number of this process into a folder, anew: what is there may be a link."""
    part = folder / f"{PART}{os.urandom(8).hex()}"
    with part.open("x") as file:
        file.write(str(os.getpid()))
    try:
        part.replace(folder / OWNER)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def _is_ours(name: str) -> bool:
    """Return whether a file of a folder with segments has a name that this program gives there."""
    return bool(FILE_NAME.fullmatch(name)) or name == OWNER or name.startswith(PART)


def segment_folders(result: Path) -> list[Path]:
    """Return the folders of segments beside a result file."""
    start = _start_of_names(result)
    parent = Path(os.path.realpath(result)).parent
    return [
        folder
        for folder in parent.iterdir()
        if folder.name.startswith(start) and FOLDER_NAME.fullmatch(folder.name)
    ]


def _start_of_names(result: Path) -> str:
    """Return the prefix of the segment folders of a result, not too long for a file system.

    A long name of a result is replaced by a digest of it.
    """
    stem = result.name.removesuffix(result.suffix)
    if len(os.fsencode(stem)) > MAX_STEM_LENGTH:
        stem = sha256(os.fsencode(stem)).hexdigest()[:16]
    return f"{stem}{MARK}"


def in_use(folder: Path) -> bool:
    """Return whether the run that writes segments may still go on."""
    try:
        with open_regular(folder / OWNER) as opened:
            owner = int(opened.read(20))
    except (OSError, ValueError):
        return False
    if os.name != "posix":  # there is no harmless way to ask
        return True
    try:
        os.kill(owner, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


def segments_of(path: Path, reference: str) -> tuple[SampleSegments, int, int]:
    """Return the segments that a result refers to, how many they are, and the samples of each.

    Parameters
    ----------
    path : Path
        The result.
    reference : str
        Its attribute `segments`.

    Raises
    ------
    ValueError
        If it is not one that a run has written.
    """
    name, *numbers = reference.rsplit(" ", 3)
    count, rows, checksum = map(int, numbers)
    if Path(name).name != name or not FOLDER_NAME.fullmatch(name):
        raise ValueError("segments are in a folder beside their result")
    if not (0 < count <= MAX_SEGMENTS and 0 < rows <= MAX_SEGMENTS):
        raise ValueError("there are segments, and samples in each")
    folder = Path(os.path.realpath(path)).with_name(name)
    return SampleSegments(folder, checksum), count, rows


class SegmentsAndTail:
    """The channels of an incomplete result: samples in segments, then those in its file.

    Parameters
    ----------
    segments : SampleSegments
    count, size : int
        How many there are, and the samples of each.
    tail : dict of arrays
    """

    def __init__(
        self, segments: SampleSegments, count: int, size: int, tail: dict[str, Any]
    ) -> None:
        self._segments, self._count, self._size, self._tail = segments, count, size, tail

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return samples start to stop - 1 of a channel."""
        size, parts = self._size, []
        for number in range(start // size, min(self._count, (stop - 1) // size + 1)):
            a, b = max(start - number * size, 0), min(stop - number * size, size)
            parts.append(self._segments.rows_like(self._tail[name], number, name, a, b))
        self._segments.close()
        before = self._count * size
        if stop > before:
            parts.append(self._tail[name][max(start - before, 0) : stop - before])
        return np.concatenate(parts)

    def compressed(self, name: str, start: int, stop: int) -> list[bytes] | None:
        """Return None: the samples of an incomplete result are compressed anew."""
        return None
