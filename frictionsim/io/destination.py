"""The files that a run writes to: NAME.h5 when it is done, and NAME.partial.h5 until then."""

import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py

from frictionsim.display import NO_VALUE, cut_text
from frictionsim.errors import InputError, OutputError
from frictionsim.io import checksum, hdf5_writer
from frictionsim.io.atomic_write import NotReplaced, PartFile, unused_name
from frictionsim.io.hdf5_reader import read
from frictionsim.io.replaceable import RESULT, check_replaceable, check_target
from frictionsim.io.segments import SampleSegments, SegmentFiles
from frictionsim.io.unfinished import check_names, partial_name, warn_of_name, whole_name
from frictionsim.scenario.toml_data import differing_keys, toml_value

if TYPE_CHECKING:
    from frictionsim.results import Record

LOG = logging.getLogger(__name__)

MAX_KEYS, MAX_VALUE = 3, 40  # of a note on other values, and characters of one


class Destination:
    """The files for the complete and the unfinished result of a run.

    The resumed result is replaced if it is one of these two.
    """

    def __init__(self, whole: Path, resumed: Path | None = None) -> None:
        self.whole, self.partial = whole, partial_name(whole)
        self._resumed = resumed
        self._is_resumed = resumed in (self.whole, self.partial)
        self._segments: SampleSegments | None = None
        self._has_written = False
        self._part: PartFile | None = None
        self._scenario_before = ""

    def check(self, no_clobber: bool = False) -> None:
        """Check that results can be written, and that no other process is writing them.

        With `no_clobber` only the resumed file is replaced.
        """
        check_names(self.whole, self._resumed, no_clobber)
        if self._resumed == self.whole and os.path.lexists(self.partial):
            raise OutputError(
                f"{self.whole}: this unfinished result is of an earlier version, and {self.partial}"
                " is one too; resume that, or move one of them"
            )
        for path in (self.whole, self.partial):
            check_target(path, RESULT)
        warn_of_name(self.whole)
        self._scenario_before = _scenario_in(self.whole)
        if not self._is_resumed and os.path.lexists(self.partial):
            self._check_unfinished()
            LOG.warning(
                "%s, the unfinished result of an earlier run, is replaced by this run, at the"
                " latest at its end; 'frictionsim resume %s' would continue it",
                *(self.partial, self.partial),
            )

    def lock(self) -> None:
        """Lock these files against other processes until `close`, if they are not locked yet.

        Not before the first step: a run that a signal ends before leaves no file. One that is
        killed later leaves the empty part of the complete result, which the next writer takes.
        """
        self._part = self._part or PartFile(self.whole)

    def _check_unfinished(self) -> None:
        """Check that the result with the name of the unfinished one is not that of a done run.

        A file that cannot be read is of no use: it may be replaced.
        """
        with suppress(InputError):
            if read(self.partial).attributes["status"] == "done":
                raise OutputError(
                    f"{self.partial}: cannot write the result: this file has the name of an"
                    " unfinished result, but its run is done; rename it, or give another name"
                )

    def write(self, run: "Record") -> Path | None:
        """Write a result and return its file.

        None is returned, and nothing written, if a run without samples beyond the start would
        replace an earlier unfinished result.
        """
        if run.status == "done":
            hdf5_writer.write(run, self.whole, self._part)
            LOG.info("result written: %s", self.whole)
            self._note_other_values(run)
            with suppress(OSError, OutputError):
                check_replaceable(self.partial, RESULT)  # it may be another file by now
                if self.partial.exists() and not (self._is_resumed or self._has_written):
                    self._check_unfinished()
                self.partial.unlink()
                LOG.info("unfinished result removed: %s", self.partial)
            self.segments().remove()
            return self.whole
        nothing = run.time.size <= 1 and not run.transitions
        if nothing and self.partial.exists() and self.partial != self._resumed:
            return None
        self.lock()
        hdf5_writer.write(run, self.partial)
        self.segments().remove(run.stored.number if run.stored else 0)
        LOG.info("unfinished result written: %s (%s)", self.partial, run.reason)
        self._has_written = True
        if self._resumed == self.whole:  # an unfinished result of an earlier version
            self._resumed = self.partial
            self.whole.unlink(missing_ok=True)
        return self.partial

    def _note_other_values(self, run: "Record") -> None:
        """Say that the result which was replaced is one of other values."""
        if not self._scenario_before:
            return
        before = run._replace(attributes={"scenario": self._scenario_before})
        with suppress(InputError):  # the earlier file may hold anything
            if texts := _changes(differing_keys([before, run])):
                LOG.warning(
                    "%s replaces a result of other values (%s)",
                    *(self.whole, texts),
                    extra={"note": True},
                )

    def write_checkpoint(self, run: "Record") -> None:
        """Write an unfinished result; if it cannot be renamed, keep its new name from then on."""
        try:
            self.write(run)
        except NotReplaced as error:
            self.partial, self._has_written = error.kept, True
            raise

    def write_last(self, run: "Record") -> Path | None:
        """Write the result of a stopped run as `write`; if that fails, somewhere else.

        OutputError is raised, too, if the run has stopped because a segment could not be written.
        """
        try:
            path = self.write(run)
        except NotReplaced:
            raise
        except InputError as error:  # of a segment
            text = f"{self.whole}: cannot write the result: {error}{self._resumable()}"
            raise OutputError(text) from None
        except OutputError as error:
            raise OutputError(f"{error}{self._rescued(run)}{self._resumable()}") from None
        failure = self.segments().failure
        if failure is not None and run.reason == str(failure):
            raise OutputError(f"{failure}{self._resumable()}")
        return path

    def _rescued(self, run: "Record") -> str:
        """Write a result that could not be written elsewhere, and return its place as a sentence.

        It is in the folder of the target or, if that is not writable, in a private temporary
        folder. An unfinished result whose samples are in segments is not moved away from them.
        """
        if run.stored is not None and run.checkpoint is not None:
            return ""
        from tempfile import mkdtemp  # rarely needed

        target = self.whole if run.status == "done" else self.partial
        place = unused_name(target)
        with suppress(OutputError):
            hdf5_writer.write(run, place)
            return f". The new result is in {place}: rename it"
        with suppress(OSError):
            folder = Path(mkdtemp(prefix="frictionsim-"))
            place = folder / target.name
            try:
                hdf5_writer.write(run, place)
            except OutputError:
                folder.rmdir()
            else:
                return f". The new result is in {place}: move it from there"
        return ". It could not be written anywhere else and is lost: make space, and run it again"

    def _resumable(self) -> str:
        """Return the sentence about a checkpoint in the message; empty if there is none."""
        if not (self._has_written or self._is_resumed):
            return ""
        place = self.partial if self.partial.exists() else self.whole
        return (
            f". The last checkpoint is in {place}: 'frictionsim resume {place}' continues the run"
        )

    def segments(self) -> SampleSegments:
        """Return the files for segments of the run.

        Segments of a run that is resumed into another file are linked or copied.
        """
        if self._segments is None:
            inherited = None
            if self._resumed is not None and not self._is_resumed:
                inherited = SegmentFiles(whole_name(self._resumed))
            self._segments = SampleSegments(self.whole, self._begin_segments, inherited)
        return self._segments

    def _begin_segments(self) -> None:
        """Lock the files, and remove an earlier unfinished result, which has other segments."""
        self.lock()
        if not (self._is_resumed or self._has_written):
            self.partial.unlink(missing_ok=True)

    def close(self) -> None:
        """Release the lock."""
        if self._part is not None:
            self._part.discard()
        self._part = None
        if self._segments is not None and not os.path.lexists(self.partial):
            self._segments.remove()  # the run failed before its first checkpoint


def _scenario_in(path: Path) -> str:
    """Return the scenario of a result that will be replaced, as TOML; empty if it has none.

    Only its checksum vouches for the file, which is opened in this process, as a child would take
    longer than a short run. A damaged file, or one of others, tells nothing.
    """
    with suppress(OSError, RuntimeError, TypeError, ValueError, KeyError):
        if path.is_file():
            with path.open("rb") as file:
                if checksum.mark_of(file) != checksum.RESULT or checksum.is_damaged(file):
                    return ""
            with h5py.File(path, "r") as content:
                return str(content.attrs["scenario"])
    return ""


def _changes(differing: Mapping[str, list[Any]]) -> str:
    """Return the values before and now by key, the first ones: `solver.rtol: 1e-06, now 1e-09`."""
    texts = [f"{key}: {_text(old)}, now {_text(new)}" for key, (old, new) in differing.items()]
    more = len(texts) - MAX_KEYS
    return "; ".join([*texts[:MAX_KEYS], f"{more} more"] if more > 0 else texts)


def _text(value: Any) -> str:
    return NO_VALUE if value is None else cut_text(toml_value(value), MAX_VALUE)
