"""The files that a run writes to: NAME.h5 when it is done, and NAME.partial.h5 until then."""

import logging
import os
from contextlib import suppress
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING

from frictionsim.errors import InputError, OutputError
from frictionsim.io.names import check_names, is_same_file, partial_name, warn_of_name
from frictionsim.io.output_file import (
    RESULT,
    check_output,
    remove_parts_of_ended_processes,
    remove_unfinished,
)
from frictionsim.io.result_reader import opened
from frictionsim.io.result_writer import write
from frictionsim.scenario.toml_data import changes

if TYPE_CHECKING:
    from frictionsim.results import Record

LOG = logging.getLogger(__name__)


class RunFiles:
    """The files for the complete and the unfinished result of a run.

    Parameters
    ----------
    whole : Path
        Of the complete result.
    resumed : Path, optional
        The unfinished result that is continued, which is replaced if it is of this name.
    """

    def __init__(self, whole: Path, resumed: Path | None = None) -> None:
        self.whole, self.partial = whole, partial_name(whole)
        self._resumed = resumed
        # Whether the unfinished result is of this run, and can be resumed.
        self._is_own = self._is_resumable = is_same_file(resumed, self.partial)
        self._before = ""  # the scenario of the result that will be replaced

    def check(self, no_clobber: bool = False) -> None:
        """Check before the run that results can be written.

        With `no_clobber` only the resumed file is replaced.
        """
        check_names(self.whole, self.partial, self._resumed, RESULT, no_clobber)
        for path in (self.whole, self.partial):
            check_output(path, RESULT)
        warn_of_name(self.whole)
        self._before = _scenario_in(self.whole)
        if not self._is_own and os.path.lexists(self.partial):
            way = f"; 'frictionsim resume {self.partial}' would continue it"
            LOG.warning(
                "%s, the unfinished result of an earlier run, is replaced by this run, at the"
                " latest at its end%s",
                *(self.partial, way if _has_checkpoint(self.partial) else ""),
            )

    def write(self, run: "Record") -> Path | None:
        """Write a result and return its file.

        None is returned, and nothing written, if a run without samples beyond the start would
        replace an earlier unfinished result.
        """
        if run.status == "done":
            write(run, self.whole)
            LOG.info("result written: %s", self.whole)
            self._note_other_values(run)
            remove_unfinished(self.partial, RESULT)
            if self._resumed is not None:
                remove_parts_of_ended_processes(self._resumed)
            return self.whole
        nothing = run.time.size <= 1 and not run.transitions
        if nothing and self.partial.exists() and not self._is_own:
            return None
        write(run, self.partial)
        LOG.info("unfinished result written: %s (%s)", self.partial, run.reason)
        self._is_own, self._is_resumable = True, run.checkpoint is not None
        return self.partial

    def _note_other_values(self, run: "Record") -> None:
        """Say that the result which was replaced is one of other values."""
        if self._before in ("", run.attributes["scenario"]):
            return
        with suppress(InputError):  # the earlier file may hold anything
            if texts := changes(self._before, run.attributes["scenario"]):
                LOG.warning(
                    "%s replaces a result of other values (%s)",
                    *(self.whole, "; ".join(texts)),
                    extra={"note": True},
                )

    def write_last(self, run: "Record") -> Path | None:
        """Write the result of a stopped run as `write`; if that fails, in a temporary folder.

        Raises
        ------
        OutputError
            If it is not at its place; it says where the result is, and the last checkpoint.
        """
        try:
            return self.write(run)
        except OutputError as error:
            raise OutputError(f"{error}{self._rescued(run)}{self._resumable()}") from None

    def _rescued(self, run: "Record") -> str:
        """Write a result to a temporary folder, and return its place as a sentence."""
        with suppress(OSError):
            folder = Path(mkdtemp(prefix="frictionsim-"))
            place = folder / (self.whole if run.status == "done" else self.partial).name
            try:
                write(run, place)
            except OutputError:
                folder.rmdir()
            else:
                return f". The new result is in {place}: move it from there"
        return ". It could not be written anywhere else and is lost: make space, and run it again"

    def _resumable(self) -> str:
        """Return the sentence about a checkpoint in the message; empty if there is none."""
        if not self._is_resumable or not self.partial.exists():
            return ""
        return (
            f". The last checkpoint is in {self.partial}: 'frictionsim resume {self.partial}'"
            " continues the run"
        )


def _scenario_in(path: Path) -> str:
    """Return the scenario of a result that will be replaced; empty of one that tells nothing."""
    with suppress(InputError):
        if path.is_file():
            with opened(path, only_attributes=True) as file:
                return str(file.attrs["scenario"])
    return ""


def _has_checkpoint(path: Path) -> bool:
    """Return whether a result can be resumed, or cannot be read."""
    with suppress(InputError), opened(path) as file:
        return "checkpoint" in file
    return True
