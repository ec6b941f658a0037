"""Writing and resuming the segments of a long run.

They survive a kill: a segment is written to a part, flushed to the disk and renamed, and is never
opened for writing again; so is the unfinished result, which lists its segments. At any instant the
disk therefore has a complete unfinished result and at least the segments that it lists. Later
segments are computed again when the run is resumed. No file is open for writing during the run, so
none can be damaged.
"""

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from frictionsim.errors import OutputError
from frictionsim.io import hdf5_writer
from frictionsim.io.checksum import SEGMENT, mark_of
from frictionsim.io.regular_file import open_regular
from frictionsim.io.segments import SegmentFiles, combined
from frictionsim.results import Record


class SampleSegments(SegmentFiles):
    """The segments of a run.

    `on_begin` is called before the first is written. A run that is resumed into another file has
    inherited segments.
    """

    patience = 2**31  # the run has written them itself, so a slow answer means a busy machine

    def __init__(
        self,
        whole: Path,
        on_begin: Callable[[], object],
        inherited: SegmentFiles | None = None,
    ) -> None:
        super().__init__(whole)
        self._on_begin, self._inherited = on_begin, inherited

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

    def write(self, number: int, record: Record) -> None:
        """Write a segment."""
        self._on_begin()
        try:
            checksum = hdf5_writer.write_segment(record, self.path(number))
        except OutputError as error:
            raise OutputError(
                f"{error}. The samples before these are kept: make space, or give another place"
                " with -o, and resume the run if there is an unfinished result"
            ) from None
        self._latest = {}
        self._checksums = [*self._checksums[:number], checksum]

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
                hdf5_writer.check_segment(target)
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
