"""Segments: the samples of a run that is not over, in files beside its result.

Why they survive a kill. A segment is written to a temporary file, flushed to the disk and renamed,
and is never opened for writing again; so is the incomplete result, which says how many segments
belong to it. At any instant there are therefore whole segments, at least as many as the incomplete
result on the disk counts, and that result itself, whole. Segments beyond its count are of the time
after it; when the run is resumed they are computed again. The file of HDF5 that a kill could
leave damaged, one that is open for writing while the run goes on, does not exist; nor are journals
needed, or its mode for one writer and many readers (SWMR), which protects readers but promises
nothing about a crash.

A segment of the number 7 is NAME.samples-<random digits>/000007.h5 and holds

    /time, /<channel>    samples of the recorded channels, as a result holds them
    /kept/<name>         of what only summary, audit, events and warnings need
    attribute `after`    the checksum of the segment before it; 0 of the first

and the line with its checksum. That of the last segment therefore depends on all of them.
"""

import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.checksum import checksum_mismatch, checksum_of, checksum_trailer
from frictionsim.io.chunks import add_in_chunks, stored_chunks

MARK = ".samples-"
OWNER = "run"


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
        self._opened: tuple[int, Any] | None = None

    @classmethod
    def beside(cls, result: Path) -> "SampleSegments":
        """Return new segments beside a result file."""
        name = f"{result.name.removesuffix(result.suffix)}{MARK}{os.urandom(4).hex()}"
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
        own = sum(file.stat().st_size for file in self.folder.glob("*.h5"))
        return shutil.disk_usage(self.folder.parent).free + own

    def path(self, number: int) -> Path:
        """Return the file of a segment."""
        return self.folder / f"{number:06d}.h5"

    def write(self, number: int, recorded: dict[str, Any], kept: dict[str, Any]) -> None:
        """Write a segment.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        self._make_folder()
        name = f"{os.urandom(8).hex()}.h5"
        with h5py.File(name, "w", driver="core", backing_store=False) as file:
            file.attrs["after"] = self.checksum
            for channel, values in recorded.items():
                add_in_chunks(file, channel, values, len(values))
            group = file.create_group("kept")
            for channel, values in kept.items():
                group.create_dataset(channel, data=values)
            file.flush()
            image = bytes(file.id.get_file_image())
        trailer = checksum_trailer(image)
        try:
            write_atomically(image + trailer, self.path(number))
        except OutputError as error:
            raise OutputError(
                f"{error}. The samples before these are kept: make space, or give another place"
                " with -o, and resume the run if there is an incomplete result"
            ) from None
        self.checksum = checksum_of(trailer)

    def _make_folder(self) -> None:
        if self.folder.is_dir():
            return
        try:
            self.folder.mkdir()
            (self.folder / OWNER).write_text(str(os.getpid()))
        except OSError as error:
            raise OutputError(
                f"{self.folder}: cannot create the folder for samples: {error.strerror or error}"
            ) from None

    def rows(self, number: int, name: str, start: int, stop: int) -> Any:
        """Return rows of an array of a segment.

        Raises
        ------
        InputError
            If the segment is missing or damaged.
        """
        return self._dataset(number, name)[start:stop]

    def compressed(self, number: int, name: str) -> list[bytes] | None:
        """Return the chunks of a channel of a segment; None if it is not stored in chunks."""
        return stored_chunks(self._dataset(number, name))

    def _dataset(self, number: int, name: str) -> Any:
        if self._opened is None or self._opened[0] != number:
            self.close()
            self._opened = number, self._open(number)
        file = self._opened[1]
        return file[name] if name in file else file["kept"][name]

    def _open(self, number: int) -> Any:
        try:
            return h5py.File(self.path(number), "r")
        except OSError:
            raise self._missing(number) from None

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
        """Check that the first segments are there, and that they are those of a result.

        Raises
        ------
        InputError
            If they are not.
        """
        before = 0
        for number in range(count):
            path = self.path(number)
            if not path.is_file() or checksum_mismatch(path):
                raise self._missing(number)
            with self._open(number) as file:
                after = int(file.attrs["after"])
            with path.open("rb") as raw:
                raw.seek(-len(checksum_trailer(b"")), os.SEEK_END)
                found = checksum_of(raw.read())
            if after != before:
                raise self._missing(number)
            before = found
        if before != checksum:
            raise self._missing(count - 1)

    def restore(self, count: int, checksum: int) -> None:
        """Take over the first segments; later ones are removed.

        Raises
        ------
        InputError
            If they are missing or damaged.
        OutputError
            If they cannot be linked or copied to where the run is written now.
        """
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
            with suppress(OSError):
                (self.folder / OWNER).write_text(str(os.getpid()))
        self.checksum, number = checksum, count
        while self.path(number).exists():
            self.path(number).unlink()
            number += 1

    def inherit(self, folder: Path) -> None:
        """Have `restore` take the segments from another folder, which stays as it is."""
        self._inherited = folder

    def _take(self, number: int) -> None:
        assert self._inherited is not None
        source, target = self._inherited / self.path(number).name, self.path(number)
        try:
            os.link(source, target)
        except OSError:  # another file system, or one without links
            shutil.copyfile(source, target)

    def remove(self) -> None:
        """Remove the folder."""
        self.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def segment_folders(result: Path) -> list[Path]:
    """Return the folders of segments beside a result file."""
    start = f"{result.name.removesuffix(result.suffix)}{MARK}"
    parent = Path(os.path.realpath(result)).parent
    return [folder for folder in parent.iterdir() if folder.name.startswith(start)]


def in_use(folder: Path) -> bool:
    """Return whether the run that writes segments may still go on."""
    try:
        owner = int((folder / OWNER).read_text())
    except (OSError, ValueError):
        return False
    if os.name != "posix":  # there is no harmless way to ask
        return True
    try:
        os.kill(owner, 0)
    except ProcessLookupError:
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
    """
    name, count, rows, checksum = reference.split()
    if Path(name).name != name:
        raise ValueError("segments are beside their result")
    folder = Path(os.path.realpath(path)).with_name(name)
    return SampleSegments(folder, int(checksum)), int(count), int(rows)


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
        """Return samples start to stop - 1 of a channel.

        Raises
        ------
        InputError
            If a segment is missing.
        """
        size, parts = self._size, []
        for number in range(start // size, min(self._count, (stop - 1) // size + 1)):
            a, b = max(start - number * size, 0), min(stop - number * size, size)
            parts.append(self._segments.rows(number, name, a, b))
        self._segments.close()
        before = self._count * size
        if stop > before:
            parts.append(self._tail[name][max(start - before, 0) : stop - before])
        return np.concatenate(parts)

    def compressed(self, name: str, start: int, stop: int) -> list[bytes] | None:
        """Return None: the samples of an incomplete result are compressed anew."""
        return None
