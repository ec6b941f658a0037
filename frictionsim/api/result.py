"""The result of a run, whether it was just solved or read from a file."""

import logging
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from frictionsim.api.arguments import as_path
from frictionsim.errors import (
    EXIT_DONE,
    AuditError,
    BudgetExceeded,
    InputError,
    failure_class,
)
from frictionsim.results import Check, Quantities, Record, SolverStatistics, failures

if TYPE_CHECKING:
    import xarray

    from frictionsim.scenario.settings import Origin, Scenario
    from frictionsim.work_precision.error_estimate import Estimate

LOG = logging.getLogger(__name__)


class Result:
    """The result of a run: its channels, events, quantities and audit.

    Made by `solve`, `resume` and `open`. Results are not changed; they can be pickled and used by
    several threads.

    Attributes
    ----------
    path : Path or None
        The file that holds it.
    record : Record
        What the file holds, see `frictionsim.io.hdf5_writer`.
    """

    def __init__(
        self,
        record: Record,
        path: Path | None = None,
        scenario: "Scenario | None" = None,
        estimate: "Estimate | None" = None,
    ) -> None:
        self._record, self.path, self._scenario = record, path, scenario
        self._estimate = estimate

    @cached_property
    def record(self) -> Record:
        if self._record.stored is not None and self.path is not None:
            from frictionsim.io.hdf5_reader import read

            return read(self.path)  # the segments of the run are gone
        return self._record

    @property
    def checkpoint(self) -> dict[str, Any] | None:
        """The state of a run that was just solved and can be resumed.

        `load_checkpoint` also reads that of a file.
        """
        return self._record.checkpoint

    @property
    def status(self) -> str:
        """`done`, `failed` or `interrupted`."""
        return self._record.status

    @property
    def reason(self) -> str:
        """Why the run stopped, or which checks of its audit failed; empty if done and sound."""
        return self._record.reason

    @property
    def failure(self) -> str:
        """The kind of failure, as `chattering`; empty if not failed."""
        return self._record.failure

    @property
    def kind(self) -> str:
        """The kind of mechanism."""
        return self._record.attributes["kind"]

    @property
    def title(self) -> str:
        """The title of the scenario; empty if it has none."""
        return self._record.attributes["title"]

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that were simulated."""
        found = self._record.attributes.get("effects")
        if found is None:  # of a file of format version 1
            return self.scenario.effect_names
        return tuple(found.split())

    @property
    def quantities(self) -> Quantities:
        """The quantities of the summary by name, each with `value` and `unit`."""
        return self._record.quantities

    @property
    def errors(self) -> dict[str, float | None]:
        """The estimated errors of the quantities; empty without `estimate_error`."""
        return self._estimate.errors if self._estimate else {}

    @property
    def error_estimate(self) -> str:
        """How the errors were estimated, or why not; empty without `estimate_error`."""
        return self._estimate.method if self._estimate else ""

    @property
    def audit(self) -> dict[str, Check]:
        """The checks of the self-audit by name, each with `value`, `limit` and `ok`."""
        return self._record.checks

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the quantities."""
        return self._record.warnings

    @property
    def statistics(self) -> SolverStatistics | None:
        """Counts of the solver and wall times; None of a file of format version 1."""
        return self._record.statistics

    @cached_property
    def scenario(self) -> "Scenario":
        """The scenario that was solved.

        Raises
        ------
        InputError
            If another version wrote the file, whose scenario is not valid any more.
        """
        if self._scenario is not None:
            return self._scenario
        from frictionsim.scenario.loading import scenario_from_result

        return scenario_from_result(self.path or Path("result"), self._record.attributes)

    @cached_property
    def dataset(self) -> "xarray.Dataset":
        """The channels over time, with units and descriptions as attributes.

        The columns of a belt's channels have the coordinates `pulley`, `body` and `joint`:
        ``result.dataset["pulley_speed"].sel(pulley="driven")``. Its data cannot be changed in
        place; ``dataset.copy(deep=True)`` can.
        """
        from frictionsim.api.dataset import channels_dataset

        return channels_dataset(self.record)

    @cached_property
    def events(self) -> "xarray.Dataset":
        """The events, along the dimension `event`.

        `contact` has the names of the contacts; `mode_from` and `mode_to` have `flag_values` and
        `flag_meanings`.
        """
        from frictionsim.api.dataset import events_dataset

        return events_dataset(self.record)

    @property
    def origin(self) -> "Origin":
        """Where the scenario came from: its file and overrides."""
        if self._scenario is not None:
            return self._scenario.origin
        from frictionsim.scenario.loading import origin_of

        return origin_of(self._record.attributes)

    def load_checkpoint(self) -> dict[str, Any]:
        """Return the state to resume from; of a result from a file it is read and verified.

        Raises
        ------
        InputError
            If the run cannot be resumed.
        """
        if self.checkpoint is not None:
            return self.checkpoint
        if self.path is None or self._scenario is not None:
            raise InputError(f"cannot resume this run: it has no checkpoint ({self.status})")
        from frictionsim.io.hdf5_reader import read_checkpoint

        return read_checkpoint(self.path).state

    @property
    def exit_code(self) -> int:
        """The exit code of the command line for this result."""
        return self._record.exit_code or (self._estimate.exit_code if self._estimate else EXIT_DONE)

    def check(self) -> Self:
        """Return the result itself if the run is done and passed its audit.

        Raises
        ------
        SolverError
            Of the class of its failure and with its exit code, if the run failed or was
            interrupted.
        AuditError
            If a check of its audit failed.
        """
        if self.status != "done":
            where = "" if self.path is None else f" (samples up to this time are in {self.path})"
            error = failure_class(self.failure)(f"run {self.status}: {self.reason}{where}")
            error.exit_code = self.exit_code
            raise error
        if failed := failures(self.audit):
            raise AuditError(f"self-audit failed: {failed}")
        return self

    def save(self, path: str | PathLike[str], *, no_clobber: bool = False) -> Path:
        """Write the result file, whole or not at all; it holds no wall times.

        What can be resumed can be resumed from the new file as well.

        Parameters
        ----------
        path : path
            A result there is replaced; any other file is not.
        no_clobber : bool
            Do not replace an existing file.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from frictionsim.io.atomic_write import check_no_clobber
        from frictionsim.io.hdf5_writer import write_record

        target = as_path("path", path)
        if no_clobber:
            check_no_clobber(target)
        write_record(self.record, target, self._checkpoint_to_save())
        return target

    def _checkpoint_to_save(self) -> dict[str, Any] | None:
        resumable = self.status == "interrupted" or self.failure == BudgetExceeded.failure
        if self.checkpoint is not None or self._scenario is not None or not resumable:
            return self.checkpoint
        try:
            return self.load_checkpoint()
        except InputError as error:
            LOG.warning("saved without the state to resume from: %s", error)
            return None

    def summary(self) -> str:
        """Return the summary as text, as the command line prints it."""
        from frictionsim.api.tables import as_text, summary

        return as_text(summary(self))

    def to_json(self) -> dict[str, Any]:
        """Return the summary as plain data, as the command line prints it with --json."""
        from frictionsim.api.json_data import result_json

        return result_json(self)

    def _repr_html_(self) -> str:
        from frictionsim.api.tables import as_html, summary

        return as_html(summary(self))

    def __repr__(self) -> str:
        n, events = len(self.record.channels["time"]), len(self.record.events["time"])
        title = f" '{self.title}'" if self.title else ""
        counts = f"{n} samples, {events} event{'' if events == 1 else 's'}"
        return f"<frictionsim.Result {self.kind}{title}: {self.status}, {counts}>"

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: the data, without the scenario, which has functions."""
        return {
            "_record": self.record,
            "path": self.path,
            "_scenario": None,
            "_estimate": self._estimate,
        }


def open(path: str | PathLike[str]) -> Result:
    """Read a result file.

    Returns
    -------
    Result
        The data are read at once; the file is closed.

    Raises
    ------
    InputError
        If it does not exist or is not a result.
    """
    from frictionsim.io.hdf5_reader import read

    found = as_path("path", path)
    return Result(read(found), found)
