"""The file that a run writes to: an incomplete result never replaces a complete one."""

import logging
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.io.atomic_write import check_no_clobber, check_writable
from frictionsim.io.sample_segments import SampleSegments, in_use, segment_folders

if TYPE_CHECKING:
    from frictionsim.simulation.simulate import RunResult

LOG = logging.getLogger(__name__)

PARTIAL = ".partial"


def partial_name(path: Path) -> Path:
    """Return the name of the incomplete result of a file: a.partial.h5 for a.h5."""
    return path.with_name(f"{path.stem}{PARTIAL}{path.suffix}")


def whole_name(path: Path) -> Path:
    """Return the name of the complete result: a.h5 for a.partial.h5; other names are unchanged."""
    name = path.name.removesuffix(path.suffix)
    if path.suffix == PARTIAL:  # the complete file has no suffix
        return path.with_name(name)
    if name.endswith(PARTIAL) and name != PARTIAL:
        return path.with_name(name.removesuffix(PARTIAL) + path.suffix)
    return path


class Destination:
    """The files for the complete and the incomplete result of a run.

    A complete result is written to `whole`. An incomplete one is written there too, unless there
    is a complete or unreadable file already; then it is written to `partial_name(whole)`.

    Parameters
    ----------
    whole : Path
    resumed : Path, optional
        The result that is resumed. If it is the incomplete result of `whole`, incomplete results
        are written to it, and it is removed when `whole` is written.
    """

    def __init__(self, whole: Path, resumed: Path | None = None) -> None:
        self.whole = whole
        self._resumed = resumed
        self._segments: SampleSegments | None = None
        own = resumed is not None and resumed != whole and whole_name(resumed) == whole
        self._part = resumed if own else None
        self._written = {resumed} if resumed is not None and own else set()

    def check(self, no_clobber: bool = False) -> None:
        """Check that results can be written.

        Parameters
        ----------
        no_clobber : bool
            Do not replace an existing file, except the one that is resumed.

        Raises
        ------
        OutputError
            If they cannot.
        """
        if no_clobber and self.whole != self._resumed:
            check_no_clobber(self.whole)
        check_writable(self.whole)
        part = self._place_of_part()
        if part != self.whole:
            check_writable(part)

    def write(self, run: "RunResult") -> Path | None:
        """Write a result.

        Returns
        -------
        Path or None
            The file written; None if the run has no samples beyond the start and would replace
            an earlier incomplete result.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        if run.status == "done":
            replaced = hdf5_reader.folder_of_segments(self.whole)
            hdf5_writer.write(run, self.whole)
            self._drop_segments(replaced)
            LOG.info("result written: %s", self.whole)
            for part in self._written - {self.whole}:
                with suppress(OSError):
                    part.unlink()
                    LOG.info("incomplete result removed: %s", part)
            return self.whole
        place = self._place_of_part()
        nothing = run.time.size <= 1 and not run.transitions
        if nothing and place.exists() and place != self._resumed:
            return None
        replaced = hdf5_reader.folder_of_segments(place)
        hdf5_writer.write(run, place)
        self._drop_segments(replaced)
        LOG.info("incomplete result written: %s (%s)", place, run.reason)
        self._written.add(place)
        return place

    def segments(self) -> SampleSegments:
        """Return where the run may put samples; those of the run that is resumed if it is its own.

        A run that is resumed into another file has its segments linked or copied to there.
        """
        if self._segments is None:
            self._segments = SampleSegments.beside(self.whole)
            resumed = self._resumed
            before = None if resumed is None else hdf5_reader.folder_of_segments(resumed)
            if before is not None and resumed in (self.whole, self._part):
                self._segments = SampleSegments(before)
            elif before is not None:
                self._segments.inherit(before)
        return self._segments

    def close(self) -> None:
        """Remove the segments of a run that is over, unless a file refers to them."""
        if self._segments is None:
            return
        self._segments.close()
        folder = self._segments.folder
        if not folder.exists():
            return
        files = {self.whole, partial_name(self.whole), *self._written}
        kept = set(map(hdf5_reader.folder_of_segments, files))
        # Also those of runs that were killed before their first checkpoint.
        for found in segment_folders(self.whole):
            if found not in kept and (found == folder or not in_use(found)):
                SampleSegments(found).remove()

    def _drop_segments(self, replaced: Path | None) -> None:
        """Remove the segments of the result that was replaced, unless its run goes on."""
        own = None if self._segments is None else self._segments.folder
        if replaced is not None and replaced != own and not in_use(replaced):
            SampleSegments(replaced).remove()

    def _place_of_part(self) -> Path:
        """Return the file for an incomplete result; another run may have written `whole` since."""
        if self._part is not None:
            return self._part
        place = self.whole
        while hdf5_reader.may_be_done(place):
            place = partial_name(place)
        return place
