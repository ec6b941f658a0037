"""The file that a run writes to: an incomplete result never replaces a complete one."""

import logging
import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_writer
from frictionsim.io.atomic_write import (
    SUFFIXES,
    KeptBeside,
    check_no_clobber,
    name_beside,
)
from frictionsim.io.replaceable import RESULT, check_target
from frictionsim.io.sample_segments import SampleSegments, in_use, segment_folders
from frictionsim.scenario.toml_data import toml_tables

if TYPE_CHECKING:
    from frictionsim.results import Record

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


def check_same_scenario(whole: Path, scenario: str, resumed: Path) -> None:
    """Check that an existing result is of the scenario whose run will replace it.

    Parameters
    ----------
    whole : Path
        Its name follows from that of the incomplete result; nobody has asked for it.
    scenario : str
        As the incomplete result has it.
    resumed : Path
        The incomplete result, for the message.
    """
    if whole == resumed or not (whole.is_file() and whole.stat().st_size):
        return
    try:
        from frictionsim.io.hdf5_reader import read

        if _essence(read(whole).attributes["scenario"]) == _essence(scenario):
            return
        found = "is the result of another scenario"
    except (InputError, ValueError):
        found = "cannot be read as a result"
    raise OutputError(
        f"{whole}: the existing file {found} and is not replaced by that of {resumed}; give the"
        f" result another name with -o, or {whole} if it is to be replaced"
    )


def _folder_of_segments(path: Path) -> Path | None:
    """Return the folder of the segments of a result; None without one.

    What reads files is imported where there is one to read: most runs write a new file.
    """
    if not os.path.lexists(path):
        return None
    from frictionsim.io.hdf5_reader import folder_of_segments

    return folder_of_segments(path)


def _essence(scenario: str) -> dict[str, Any]:
    """Return a scenario as plain data, without how long and how safely it is computed."""
    data = toml_tables(scenario)
    for table, key in (("solver", "max_steps"), ("output", "checkpoint")):
        if isinstance(data.get(table), dict):
            data[table].pop(key, None)
    return data


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
        self._replaced_part = False

    def check(self, no_clobber: bool = False) -> None:
        """Check that results can be written.

        Parameters
        ----------
        no_clobber : bool
            Do not replace an existing file, except the one that is resumed.
        """
        if no_clobber and self.whole != self._resumed:
            check_no_clobber(self.whole)
        check_target(self.whole, RESULT)
        part = self._place_of_part()
        if part != self.whole:
            check_target(part, RESULT)

    def write(self, run: "Record") -> Path | None:
        """Write a result.

        Returns
        -------
        Path or None
            The file written; None if the run has no samples beyond the start and would replace
            an earlier incomplete result.
        """
        if run.status == "done":
            replaced = _folder_of_segments(self.whole)
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
        replaced = _folder_of_segments(place)
        if place not in self._written and place.exists() and place.stat().st_size:
            self._replaced_part = True
        hdf5_writer.write(run, place)
        self._drop_segments(replaced)
        LOG.info("incomplete result written: %s (%s)", place, run.reason)
        self._written.add(place)
        return place

    def write_last(self, run: "Record") -> Path | None:
        """Write the result of a run that has stopped; if it cannot be, elsewhere.

        Returns
        -------
        Path or None
            As of `write`.
        """
        before = set(self._written)
        try:
            return self.write(run)
        except KeptBeside:
            raise
        except OutputError as error:
            raise OutputError(f"{error}{self._rescued(run)}{self._resumable(before)}") from None

    def _rescued(self, run: "Record") -> str:
        """Write a result that could not be written, and return where it is for the message.

        It is beside the target or, where the folder takes no file, in a private folder for
        temporary files. A part of a run whose samples are in segments stays with them.
        """
        if run.stored is not None and run.checkpoint is not None:
            return ""
        from tempfile import mkdtemp  # rarely needed

        place = name_beside(self.whole)
        with suppress(OutputError):
            hdf5_writer.write(run, place)
            return f". The new result is in {place}: rename it"
        with suppress(OSError):
            folder = Path(mkdtemp(prefix="frictionsim-"))
            place = folder / (self.whole.name if run.status == "done" else place.name)
            try:
                hdf5_writer.write(run, place)
            except OutputError:
                folder.rmdir()
            else:
                return f". The new result is in {place}: move it from there"
        return ". It could not be written anywhere else and is lost: make space, and run it again"

    def _resumable(self, written: set[Path]) -> str:
        """Return the sentence about a checkpoint in the message; empty if there is none."""
        places = [place for place in written if place.exists()]
        if not places:
            return ""
        unchanged = self.whole not in places and self.whole.exists()
        after = f"; {self.whole} is unchanged" if unchanged else ""
        before = "" if unchanged or not self._replaced_part else ", which replaced an older one,"
        return (
            f". The last checkpoint{before} is in {places[0]}:"
            f" 'frictionsim resume {places[0]}' continues the run{after}"
        )

    def segments(self) -> SampleSegments:
        """Return where the run may put samples; those of the run that is resumed if it is its own.

        A run that is resumed into another file has its segments linked or copied to there.
        """
        if self._segments is None:
            self._segments = SampleSegments.beside(self.whole)
            resumed = self._resumed
            before = None if resumed is None else _folder_of_segments(resumed)
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
        # Also those of runs that were killed before their first checkpoint.
        unused = [
            found for found in segment_folders(self.whole) if found == folder or not in_use(found)
        ]
        if not unused:
            return
        kept = set(map(_folder_of_segments, self._results_beside()))
        for found in unused:
            if found not in kept:
                SampleSegments(found).remove()

    def _results_beside(self) -> set[Path]:
        """Return the files that may refer to segments here, by whatever name they have now."""
        folder = Path(os.path.realpath(self.whole)).parent
        beside = {path for path in folder.iterdir() if path.suffix in SUFFIXES and path.is_file()}
        return {self.whole, partial_name(self.whole), *self._written, *beside}

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
        while os.path.lexists(place):
            from frictionsim.io.hdf5_reader import may_be_done

            if not may_be_done(place):
                break
            place = partial_name(place)
        return place
