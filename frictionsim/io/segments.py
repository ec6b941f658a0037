"""Segments: the samples of a long run in progress, in files next to its result.

A segment is an ordinary result file, NAME.000007.h5, of some samples: their channels, and the data
for summary, audit, events and warnings in channels whose names begin with _. It ends in the mark of
a segment. NAME.partial.h5 lists names, samples and checksums, and has the samples after the last
segment.

A result may come from anyone. Only files named after it are read that are no links, end in the mark
of a segment and have the listed checksum.
"""

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.checksum import SEGMENT, is_damaged, mark_of, stated_checksum
from frictionsim.io.child_process import ChildFailed, answer_of
from frictionsim.io.regular_file import open_regular
from frictionsim.io.result_format import ANSWER_BYTES
from frictionsim.io.unfinished import whole_name
from frictionsim.results import Record
from frictionsim.simulation.stored_channel import StoredChannel

MAX_SEGMENTS = 10**6
FILES_AT_ONCE = 64
LINE = re.compile(r"[^/\\\0]+ (\d{1,9}) ([0-9a-f]{8})")  # name, samples, checksum


class SegmentFiles:
    """The segments of a complete result, which need not exist; numbered from 0.

    The checksums are those of the segments to be read.
    """

    # The least size, in bytes, from which `answer_of` derives the time limit of an answer.
    patience = 0

    def __init__(self, whole: Path, checksums: Sequence[int] = ()) -> None:
        self._whole = Path(os.path.realpath(whole))
        self._checksums = list(checksums)
        self._latest: dict[int, dict[str, Any]] = {}  # all channels of some consecutive segments

    def path(self, number: int) -> Path:
        """Return the file of a segment."""
        return self._whole.with_name(f"{self._whole.stem}.{number:06d}{self._whole.suffix}")

    def checksum_of(self, number: int) -> int:
        """Return the checksum of a segment; raise InputError if it is missing or damaged."""
        try:
            with open_regular(self.path(number)) as file:
                if mark_of(file) == SEGMENT and not is_damaged(file):
                    return stated_checksum(file)
        except OSError:
            pass
        raise self.missing(number)

    def check(self, number: int) -> None:
        """Check that a segment has its listed checksum."""
        if self.checksum_of(number) != self._checksums[number]:
            raise self.missing(number)

    def rows(self, number: int, name: str, start: int, stop: int) -> Any:
        """Return rows of a channel of a segment."""
        if number not in self._latest:
            self._latest = dict(enumerate(self._channels("", self._read_ahead(number)), number))
        values = self._latest[number].get(name)
        if values is None or values.shape[:1] < (stop,):
            raise self.missing(number)
        return values[start:stop]

    def _read_ahead(self, first: int) -> range:
        """Check a segment and the next ones, which are read with it; return their numbers."""
        stop, size = first, 0
        while stop == first or (stop < len(self._checksums) and size < ANSWER_BYTES):
            self.check(stop)
            size += self.path(stop).stat().st_size
            stop += 1
        return range(first, stop)

    def channels(self, names: list[str], count: int) -> list[dict[str, Any]]:
        """Return some channels of each of the first segments, already checked."""
        parts: list[dict[str, Any]] = []
        while (first := len(parts)) < count:
            numbers = range(first, min(first + FILES_AT_ONCE, count))
            parts += self._channels(",".join(names), numbers)
        return parts

    def _channels(self, names: str, numbers: range) -> list[dict[str, Any]]:
        """Return channels of as many of the segments as an answer holds."""
        first, paths = numbers[0], [str(self.path(number)) for number in numbers]
        try:
            size = sum(map(os.path.getsize, paths))
            channels: list[dict[str, Any]] = answer_of(
                "channels", names, *paths, size=max(size, self.patience)
            )
            return channels
        except (InputError, OSError):
            raise self.missing(first) from None
        except ChildFailed as failed:
            raise InputError(f"{self.path(first)}: cannot read these samples: {failed}") from None

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
    before = segments.channels(flat, number)
    if any(part[name].shape != (size,) for part in before for name in flat):
        raise damaged
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
            if parts[-1].shape[1:] != self._tail[name].shape[1:]:
                raise self._segments.missing(number)
        before = self._count * size
        if stop > before:
            parts.append(self._tail[name][max(start - before, 0) : stop - before])
        return np.concatenate(parts)
