"""Segments: the samples of a long run in progress, in files next to its result.

A segment is an ordinary result file, NAME.000007.h5, of some samples: their channels, and the data
for summary, audit, events and warnings in channels whose names begin with _. It ends in the mark of
a segment. NAME.partial.h5 lists names, samples and checksums, and has the samples after the last
segment.

A result may come from anyone. Only files named after it are read that are no links, end in the mark
of a segment and have the listed checksum.

Segments survive a kill: one is written to a part, flushed to the disk and renamed, and is never
opened for writing again; so is the unfinished result. At any instant the disk therefore has a
complete unfinished result and at least the segments that it lists. Later segments are computed
again when the run is resumed. No file is open for writing during the run, so none can be damaged.
"""

import logging
import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.checksum import SEGMENT, is_damaged, mark_of, stated_checksum
from frictionsim.io.regular_file import open_regular
from frictionsim.io.replaceable import check_segment
from frictionsim.io.result_format import ANSWER_BYTES
from frictionsim.io.unfinished import whole_name
from frictionsim.results import Record
from frictionsim.simulation.stored_channel import StoredChannel

LOG = logging.getLogger(__name__)

MAX_SEGMENTS = 10**6
FILES_AT_ONCE = 64
# Name, samples, checksum. The name is for other readers: renamed together, all files stay readable.
LINE = re.compile(r"[^/\\\0]+ (\d{1,9}) ([0-9a-f]{8})")


class SegmentFiles:
    """The segments of a complete result, which need not exist; numbered from 0.

    The checksums are those of the segments to be read.
    """

    def __init__(self, whole: Path, checksums: Sequence[int] = ()) -> None:
        self._whole = Path(os.path.realpath(whole))
        self._checksums = list(checksums)
        self._latest: dict[int, dict[str, Any]] = {}  # all channels of some consecutive segments
        self._checked: dict[int, Any] = {}  # status of the files, by number

    def path(self, number: int) -> Path:
        """Return the file of a segment."""
        return self._whole.with_name(f"{self._whole.stem}.{number:06d}{self._whole.suffix}")

    def checksum_of(self, number: int) -> int:
        """Return the checksum of a segment; raise InputError if it is missing or damaged."""
        with suppress(OSError), open_regular(self.path(number)) as file:
            if mark_of(file) == SEGMENT and not is_damaged(file):
                return stated_checksum(file)
        raise self.missing(number)

    def check(self, number: int) -> None:
        """Check that a segment has its listed checksum; again only if the file has changed."""
        stamp = None
        with suppress(OSError):
            status = self.path(number).lstat()
            # Whoever sets the time of writing changes that of the last change.
            stamp = status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
        if stamp is None or self._checked.get(number) != stamp:
            if self.checksum_of(number) != self._checksums[number]:
                raise self.missing(number)
            self._checked[number] = stamp

    def rows(self, number: int, name: str, start: int, stop: int) -> Any:
        """Return rows of a channel of a segment."""
        if number not in self._latest:
            self._latest = dict(enumerate(self._channels([], self._read_ahead(number)), number))
        values = self._latest[number].get(name)
        if values is None or values.shape[:1] < (stop,):
            raise self.missing(number)
        return values[start:stop]

    def samples(self, name: str, places: Mapping[int, Any]) -> list[Any]:
        """Return some rows of a channel of each of some segments."""
        for number in places:
            self.check(number)
        from frictionsim.io import hdf5_content  # imports HDF5

        found = [(str(self.path(number)), rows.tolist()) for number, rows in places.items()]
        with self._read([*places]):
            return hdf5_content.samples(name, found)

    def _read_ahead(self, first: int) -> range:
        """Check a segment and the next ones, which are read with it; return their numbers."""
        stop, size = first, 0
        while stop == first or (stop < len(self._checksums) and size < ANSWER_BYTES):
            self.check(stop)
            size += self.path(stop).stat().st_size
            stop += 1
        return range(first, stop)

    def channels(self, names: list[str], count: int) -> Iterator[dict[str, Any]]:
        """Yield some channels of each of the first segments, already checked.

        The next ones are read when they are wanted: not if these have another shape than they must.
        """
        first = 0
        while first < count:
            numbers = range(first, min(first + FILES_AT_ONCE, count))
            parts = self._channels(names, numbers)
            yield from parts
            first += len(parts)

    def _channels(self, names: list[str], numbers: range) -> list[dict[str, Any]]:
        """Return channels of as many of the segments as are read together."""
        from frictionsim.io import hdf5_content  # imports HDF5

        with self._read(numbers):
            return hdf5_content.channels(names, [str(self.path(number)) for number in numbers])

    @contextmanager
    def _read(self, numbers: Sequence[int]) -> Iterator[None]:
        """Say which segments cannot be read."""
        try:
            yield
        except (InputError, OSError):
            raise self.missing(numbers[0]) from None

    def listing(self, rows: int) -> str:
        """Return the list of segments in a result; `rows` are the samples of each."""
        numbered = enumerate(self._checksums)
        return "\n".join(f"{self.path(n).name} {rows} {checksum:08x}" for n, checksum in numbered)

    def missing(self, number: int) -> InputError:
        """Return the error of a segment that is missing or damaged."""
        path = self.path(number)
        return InputError(
            f"{path}: cannot read these samples of an unfinished result: the file is missing or"
            f" damaged; keep {path.name} and the other segments beside the result, and their names"
        )


class SampleSegments(SegmentFiles):
    """The segments of a run, as it writes and resumes them.

    `on_begin` is called before the first is written. A run that is resumed into another file has
    inherited segments. `failure` is the error of a segment that could not be written, the last one.
    """

    def __init__(
        self, whole: Path, on_begin: Callable[[], object], inherited: SegmentFiles | None = None
    ) -> None:
        super().__init__(whole)
        self._on_begin, self._inherited = on_begin, inherited
        self.failure: OutputError | None = None

    @property
    def checksum(self) -> int:
        """The checksum of all segments."""
        return combined(self._checksums)

    @property
    def place(self) -> Path:
        """The file of the first segment."""
        return self.path(0)

    def free_bytes(self) -> int:
        """Return the free space of the disk plus the size of existing segments."""
        number, size = 0, 0
        while self._is_segment(number):
            size += self.path(number).stat().st_size
            number += 1
        return shutil.disk_usage(self._whole.parent).free + size

    def check_places(self, count: int) -> None:
        """Check that the first segments can be written, before the run."""
        for number in range(count):
            check_segment(self.path(number))

    def write(self, number: int, record: Record) -> None:
        """Write a segment; if that fails, the error becomes `failure`."""
        self._on_begin()
        from frictionsim.io.hdf5_writer import write_segment  # imports HDF5

        try:
            checksum = write_segment(record, self.path(number))
        except OutputError as error:
            self.failure = error
            return
        self._latest = {}
        self._checksums = [*self._checksums[:number], checksum]
        if number == 0:
            LOG.info("samples are stored in %s, ... during the run", self.place)

    def restore(self, count: int, checksum: int) -> bool:
        """Restore the first segments and remove later ones; return whether the checksum matches.

        InputError is raised if one is missing or damaged, OutputError if they cannot be copied.
        """
        source = self._inherited or self
        checksums = [source.checksum_of(number) for number in range(count)]
        if combined(checksums) != checksum:
            return False
        self._on_begin()
        if self._inherited is not None:
            for number in range(count):
                self._copy(self._inherited.path(number), self.path(number))
        self._checksums = checksums
        self.remove(count)
        return True

    def _copy(self, source: Path, target: Path) -> None:
        try:
            if os.path.lexists(target):
                check_segment(target)
                target.unlink()
            try:
                os.link(source, target, follow_symlinks=False)
            except (OSError, NotImplementedError):  # another file system, or one without links
                with open_regular(source) as file, target.open("xb") as copy:
                    shutil.copyfileobj(file, copy)
        except OSError as error:
            raise OutputError(
                f"{target}: cannot copy the samples so far: {error.strerror or error}"
            ) from None

    def remove(self, first: int = 0) -> None:
        """Remove the segments from a number on."""
        self._latest = {}
        while self._is_segment(first):
            with suppress(OSError):
                self.path(first).unlink()
            first += 1

    def _is_segment(self, number: int) -> bool:
        try:
            with open_regular(self.path(number)) as file:
                return mark_of(file) == SEGMENT
        except OSError:
            return False

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_latest": {}, "_on_begin": None}


def combined(checksums: list[int]) -> int:
    """Return a checksum of all segments."""
    return crc32(b"".join(b"%08x" % checksum for checksum in checksums))


def _parsed_listing(listing: str) -> tuple[int, list[int]]:
    """Return the samples per segment that a result lists, and the checksums of all.

    ValueError is raised if it is no list, or if the segments differ in length.
    """
    lines = [LINE.fullmatch(line) for line in listing.split("\n", MAX_SEGMENTS)]
    entries = [(int(line[1]), int(line[2], 16)) for line in lines if line]
    rows = {size for size, _ in entries}
    if len(entries) != len(lines) or len(rows) != 1 or 0 in rows:
        raise ValueError("no list of segments")
    return rows.pop(), [checksum for _, checksum in entries]


def with_segments(tail: Record, path: Path, listing: str) -> Record:
    """Return the record of a result with the samples of its segments prepended.

    InputError is raised if the segments are not the listed ones.
    """
    damaged = InputError(
        f"{path}: cannot read this result: its segments are not those of this version; solve its"
        " scenario again"
    )
    try:
        size, checksums = _parsed_listing(listing)
    except ValueError:
        raise damaged from None
    segments, number = SegmentFiles(whole_name(path), checksums), len(checksums)
    for index in range(number):
        segments.check(index)
    flat = [name for name, values in tail.channels.items() if len(values.shape) == 1]
    before: list[dict[str, Any]] = []
    for part in segments.channels(flat, number):
        if any(part[name].shape != (size,) for name in flat):
            raise damaged
        before.append(part)
    source = _SegmentsAndTail(segments, number, size, tail.channels)
    count = number * size
    channels = {
        name: np.concatenate([*(part[name] for part in before), values])
        if name in flat
        else StoredChannel(source, name, (count + len(values), *values.shape[1:]), values.dtype)
        for name, values in tail.channels.items()
    }
    if not np.all(np.diff(channels["time"]) > 0.0):
        raise damaged
    return tail._replace(channels=channels)


class _SegmentsAndTail:
    """Channels with columns of an unfinished result: samples in segments, then in its file."""

    def __init__(self, segments: SegmentFiles, count: int, size: int, tail: dict[str, Any]) -> None:
        self._segments, self._count, self._size, self._tail = segments, count, size, tail

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return samples start to stop - 1 of a channel."""
        size, parts = self._size, []
        for number in range(start // size, min(self._count, (stop - 1) // size + 1)):
            a, b = max(start - number * size, 0), min(stop - number * size, size)
            parts.append(self._segments.rows(number, name, a, b))
            self._check_columns(number, name, parts[-1])
        before = self._count * size
        if stop > before:
            parts.append(self._tail[name][max(start - before, 0) : stop - before])
        return np.concatenate(parts)

    def samples(self, name: str, numbers: Any) -> Any:
        """Return the samples of some ascending numbers of a channel."""
        size, before = self._size, self._count * self._size
        owners = numbers[numbers < before] // size
        places = {
            number: numbers[: len(owners)][owners == number] - number * size
            for number in np.unique(owners).tolist()
        }
        parts = self._segments.samples(name, places) if places else []
        for number, part in zip(places, parts, strict=True):
            self._check_columns(number, name, part)
        if len(owners) < len(numbers):
            parts.append(self._tail[name][numbers[len(owners) :] - before])
        return np.concatenate(parts)

    def _check_columns(self, number: int, name: str, samples: Any) -> None:
        if samples.shape[1:] != self._tail[name].shape[1:]:
            raise self._segments.missing(number)
