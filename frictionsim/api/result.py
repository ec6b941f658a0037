"""The result of a run, whether it was just solved or read from a file; the base of all results."""

import logging
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property, partial
from io import StringIO
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from frictionsim.display import set_line, short_text
from frictionsim.document import Data, Document, Table, as_json, as_text
from frictionsim.errors import (
    EXIT_AUDIT_FAILED,
    EXIT_DONE,
    AuditError,
    BudgetExceeded,
    InputError,
    SolverError,
    counted,
    failure_class,
)
from frictionsim.results import (
    Check,
    NamedQuantities,
    Record,
    SolverStatistics,
    Transition,
    failures,
    finite,
    quantities_json,
)
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.origin import heading_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import xarray
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.costs.error_estimate import Estimate, OtherMesh
    from frictionsim.scenario.origin import Origin
    from frictionsim.scenario.settings import Scenario

    Writers = Mapping[str, Callable[[Path], Path]]  # by the suffix of a path

LOG = logging.getLogger(__name__)
# Of more events, the table shows the first ones and the last.
MAX_EVENTS = 20
PICTURES = (".png", ".pdf", ".svg")


class Outcome(NamedTuple):
    """How a run, a sweep, a cost study or a fit ended."""

    status: str
    reason: str
    exit_code: int


class ResultBase(ABC):
    """A result with a status, a summary, a picture and a file."""

    @property
    @abstractmethod
    def _outcome(self) -> Outcome: ...

    @property
    def status(self) -> str:
        """`done`, or the way it ended early: `failed`, `stopped` or `interrupted`."""
        return self._outcome.status

    @property
    def reason(self) -> str:
        """Why it ended early or cannot be trusted; else empty."""
        return self._outcome.reason

    @property
    def exit_code(self) -> int:
        """The exit code of the command line for this result."""
        return self._outcome.exit_code

    @abstractmethod
    def _parts(self) -> Document:
        """Yield the lines and tables of the summary, and its data."""

    @abstractmethod
    def plot(self) -> "Figure":
        """Draw the result."""

    @property
    @abstractmethod
    def _writers(self) -> "Writers":
        """What writes the result to a file, by the suffix of its path."""

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the result, or its picture, by the suffix of the path; return the file.

        Raises
        ------
        InputError
            If the suffix is another one.
        OutputError
            If the file cannot be written, or would replace one of another kind.
        """
        from frictionsim.io.names import whole_name

        target = as_path("path", path)
        writers = {**self._writers, **dict.fromkeys(PICTURES, self.save_picture)}
        suffix = whole_name(target).suffix.lower()
        if suffix[1:].isdecimal():  # run_0.3 has no ending
            suffix = ""
        if suffix not in writers:
            *ends, last = filter(None, writers)
            raise InputError(f"{target}: expected a name that ends in {', '.join(ends)} or {last}")
        return writers[suffix](target)

    def check(self) -> Self:
        """Return the result itself if its exit code is 0.

        Raises
        ------
        SolverError
            With its exit code, if it failed or ended early.
        AuditError
            If all runs that are done failed their audits.
        """
        if self.exit_code:
            kind = AuditError if self.exit_code == EXIT_AUDIT_FAILED else SolverError
            error = kind(self._fault if self.status == "done" else f"{self.status}: {self._fault}")
            error.exit_code = self.exit_code
            raise error
        return self

    @property
    def _fault(self) -> str:
        return self.reason

    def save_picture(self, path: str | PathLike[str]) -> Path:
        """Write the picture, by the suffix of the path: .png, .pdf or .svg."""
        from frictionsim.plots.style import save

        target = as_path("path", path)
        save(self.plot(), target)
        return target

    def summary(self) -> str:
        """Return the summary as text."""
        return as_text(self._parts())

    def to_json(self) -> dict[str, Any]:
        """Return the summary as plain data, as the command line prints it with --json."""
        return as_json(self._parts())

    def _repr_html_(self) -> str:
        from frictionsim.reports.html import notebook

        return notebook(self._parts())


class Result(ResultBase):
    """The result of a run: its channels, events, quantities and audit.

    Made by `solve`, `resume` and `open`. Results are not changed; they can be pickled and used by
    several threads.

    Attributes
    ----------
    path : Path or None
        The file that holds it; `save` makes one.
    record : Record
        The contents of its file, see `frictionsim.io.result_writer`.
    """

    def __init__(
        self,
        record: Record,
        path: Path | None = None,
        scenario: "Scenario | None" = None,
        estimate: "Estimate | None" = None,
    ) -> None:
        self.record, self.path, self._scenario = record, path, scenario
        self._estimate = estimate

    @property
    def _outcome(self) -> Outcome:
        code = self.record.exit_code or (self._estimate.exit_code if self._estimate else EXIT_DONE)
        return Outcome(self.record.status, self.record.reason, code)

    @property
    def failure(self) -> str:
        """The kind of failure, e.g. `chattering`; empty if not failed."""
        return self.record.failure

    @property
    def kind(self) -> str:
        """The kind of mechanism."""
        return self.record.attributes["kind"]

    @property
    def title(self) -> str:
        """The title of the scenario; empty if it has none."""
        return self.record.attributes["title"]

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that were simulated."""
        return tuple(self.record.attributes.get("effects", "").split())

    @property
    def quantities(self) -> NamedQuantities:
        """The quantities of the summary by name, each with `value` and `unit`."""
        return NamedQuantities(self.record.quantities)

    @property
    def errors(self) -> dict[str, float | None]:
        """The estimated errors of the quantities; empty without `estimate_error`."""
        return self._estimate.errors if self._estimate else {}

    @property
    def error_estimate(self) -> str:
        """How the errors were estimated, or why not; empty without `estimate_error`."""
        return self._estimate.method if self._estimate else ""

    @property
    def _other(self) -> "OtherMesh | None":
        return self._estimate.other_mesh if self._estimate else None

    @property
    def other_mesh(self) -> dict[str, float | None]:
        """The quantities on the mesh that `error_estimate` names; empty where it names none."""
        return self._other.values if self._other else {}

    @property
    def audit(self) -> dict[str, Check]:
        """The checks of the self-audit by name, each with `value`, `limit` and `ok`."""
        return self.record.checks

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the quantities."""
        return self.record.warnings

    @property
    def statistics(self) -> SolverStatistics | None:
        """Counts of the solver and wall times; a file does not have these."""
        return self.record.statistics

    @cached_property
    def scenario(self) -> "Scenario":
        """The scenario that was solved.

        Raises
        ------
        InputError
            If the scenario of a file of another version is not valid any more.
        """
        if self._scenario is not None:
            return self._scenario
        from frictionsim.scenario.loading import scenario_from_result

        return scenario_from_result(self.path or Path("result"), self.record.attributes)

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
    def transitions(self) -> tuple[Transition, ...]:
        """The events, each with `time`, `contact`, numbers and `words` of its modes."""
        return tuple(self.record.transitions)

    @property
    def origin(self) -> "Origin":
        """The file and the overrides of the scenario."""
        if self._scenario is not None:
            return self._scenario.origin
        from frictionsim.scenario.origin import origin_of

        return origin_of(self.record.attributes)

    def to_toml(self, name: str = "scenario") -> str:
        """Return the `scenario` in TOML, with its overrides."""
        return self.record.attributes[name].rstrip("\n")

    @property
    def _writers(self) -> "Writers":
        from frictionsim.io.output_file import SUFFIXES

        return {**dict.fromkeys((*SUFFIXES, ""), self._save_hdf5), ".csv": self.save_csv}

    def _save_hdf5(self, path: Path) -> Path:
        from frictionsim.io.result_writer import write

        target = self._file_of(path)
        write(self.record._replace(checkpoint=self._checkpoint_to_save()), target)
        self.path = self.path or target
        return target

    def _file_of(self, path: Path) -> Path:
        """Return the name of the file of this result: of one that is not done NAME.partial.h5."""
        from frictionsim.io.names import partial_name, whole_name

        whole = whole_name(path)
        return whole if self.status == "done" else partial_name(whole)

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

        That of a run that is not done is NAME.partial.h5, and can be resumed as before. Sets
        `path` of a result that was in no file.

        Parameters
        ----------
        path : path
            NAME.h5, .hdf5, .nc or without an ending; NAME.csv of the channels, and .png, .pdf or
            .svg of the picture. A result there is replaced; any other file is not.
        no_clobber : bool
            Do not replace an existing file.

        Raises
        ------
        InputError
            If the path has another ending.
        OutputError
            If it cannot be written.
        """
        from frictionsim.io.output_file import CHANNELS_IN_CSV, PICTURE, RESULT, check_free

        target = as_path("path", path)
        if no_clobber:
            kinds = dict.fromkeys(PICTURES, PICTURE) | {".csv": CHANNELS_IN_CSV}
            kind = kinds.get(target.suffix.lower(), RESULT)
            check_free(self._file_of(target) if kind is RESULT else target, kind)
        return super().save(target)

    def save_csv(
        self,
        path: str | PathLike[str],
        channels: str | Sequence[str] | None = None,
        *,
        start: float | None = None,
        stop: float | None = None,
        no_clobber: bool = False,
    ) -> Path:
        """Write one line for each sample; the first line has the names with their units.

        A channel with columns has one for each member of its axis:
        ``pulley_speed.driver [rad/s]``. Numbers have as many digits as they need to be read back
        exactly.

        Parameters
        ----------
        path : path
            Written whole or not at all.
        channels : str or sequence of str, optional
            By default all; the time is the first column.
        start, stop : float, optional, s
            Only the samples between these times, both included.
        no_clobber : bool
            Do not replace an existing file.

        Raises
        ------
        InputError
            If the result has no channel of a name, or no sample between the times.
        OutputError
            If the file cannot be written.
        """
        from frictionsim.io.output_file import CHANNELS_IN_CSV, check_free, write_file
        from frictionsim.io.result_csv import write_lines

        target = as_path("path", path)
        if no_clobber:
            check_free(target, CHANNELS_IN_CSV)
        text = StringIO()
        write_lines(self.record, text, channels, start, stop)
        write_file(target, text.getvalue().encode("utf-8"), CHANNELS_IN_CSV)
        return target

    def _checkpoint_to_save(self) -> dict[str, Any] | None:
        resumable = self.status == "interrupted" or self.failure == BudgetExceeded.failure
        if self.record.checkpoint or self._scenario is not None or not resumable:
            return self.record.checkpoint
        try:
            return checkpoint_of(self)
        except InputError as error:
            LOG.warning("saved without the state to resume from: %s", error)
            return None

    def plot(
        self,
        view: str | None = None,
        *,
        body: int | None = None,
        figure: "Figure | SubFigure | None" = None,
    ) -> "Figure":
        """Draw a view; `frictionsim.plot` has further options.

        Parameters
        ----------
        view : str, optional
            By default the first of the kind.
        body : int, optional
            Number of the body of a belt, for the view `body`.
        figure : Figure or SubFigure, optional
            An empty one that is drawn into.
        """
        from frictionsim.plots import draw
        from frictionsim.plots.style import drawn

        given: dict[str, Any] = {} if body is None else {"body": body}
        return drawn(partial(draw, self.record, view, **given), figure)

    def _parts(self) -> Document:
        """Yield the lines and tables of the summary, and its data."""
        # Imported here because a comparison has no summary.
        from frictionsim.reports.run_tables import Column, audit_table, quantities_table

        attributes = self.record.attributes
        effects = ", ".join(self.effects) or "none"
        law = f"law {attributes['law']}, " if attributes.get("law") else ""
        yield f"{heading_of(attributes)}: {self.status}"
        yield f"kind {self.kind}, effects {effects}, {law}backend {attributes['backend']}"
        if overrides := set_line(attributes):
            yield overrides
        if self.quantities:
            yield quantities_table([Column.of(self)])
        if self.errors:
            yield self.error_estimate
        if transitions := self.record.transitions:
            yield from _events_parts(transitions)
        if self.audit:
            yield audit_table([self.audit])
        if self.statistics is not None:
            yield _statistics(self.statistics)
        if self.path is not None:
            yield f"result: {self.path}"
        yield Data(self._json())

    def _json(self) -> dict[str, Any]:
        """Return the JSON of the command line.

        With estimated errors each quantity has an `error`, and there is an `error_estimate`; where
        another mesh was solved, it has its value `on_other_mesh`.
        """
        attributes = self.record.attributes
        statistics = self.statistics
        data: dict[str, Any] = {
            "scenario": self.origin.source or None,
            "overrides": self.origin.values,
            "kind": self.kind,
            "law": attributes.get("law") or None,
            "backend": attributes["backend"],
            "status": self.status,
            "reason": self.reason,
            "failure": self.failure,
            "quantities": quantities_json(self.quantities),
            "events": [_event_json(e) for e in self.record.transitions],
            "solver": {} if statistics is None else statistics._asdict(),
            "effects": list(self.effects),
            "audit": {
                name: {"value": finite(check.value), "limit": finite(check.limit), "ok": check.ok}
                for name, check in self.audit.items()
            },
            "warnings": list(self.warnings),
            "output": None if self.path is None else str(self.path),
        }
        if self.error_estimate:
            for name, quantity in data["quantities"].items():
                quantity["error"] = finite(self.errors.get(name))
                if self.other_mesh:
                    quantity["on_other_mesh"] = finite(self.other_mesh.get(name))
            data["error_estimate"] = self.error_estimate
        return data

    def __repr__(self) -> str:
        n, events = len(self.record.channels["time"]), len(self.record.events["time"])
        title = f" '{self.title}'" if self.title else ""
        counts = f"{counted(n, 'sample')}, {counted(events, 'event')}"
        return f"<frictionsim.Result {self.kind}{title}: {self.status}, {counts}>"

    def __getstate__(self) -> dict[str, Any]:
        """Return the pickled data, without the scenario, which has functions."""
        kept = {name: self.__dict__[name] for name in ("record", "path", "_estimate")}
        return kept | {"_scenario": None}


def open(path: str | PathLike[str]) -> Result:
    """Read a result file; NAME.partial.h5 with a warning where there is no NAME.h5.

    Returns
    -------
    Result
        The file is closed. One of more than 64 MB is read channel by channel, when they are
        wanted; InputError is raised then if it has changed since.

    Raises
    ------
    InputError
        If it does not exist or is not a result.
    """
    from frictionsim.io.names import existing_name
    from frictionsim.io.sweep_file import read_any

    file = existing_name(as_path("path", path))
    content = read_any(file)
    if isinstance(content, Record):
        return Result(content, file)
    raise InputError(
        f"{file}: this is a sweep, not the result of a run; 'frictionsim plot {file}' draws it, and"
        " fs.open_sweep reads it"
    )


def checkpoint_of(result: Result) -> dict[str, Any]:
    """Return the state to resume from; of a result from a file it is read and verified.

    InputError is raised if the run cannot be resumed.
    """
    record, path = result.record, result.path
    if record.checkpoint is not None:
        return dict(record.checkpoint)
    if path is None or result._scenario is not None:
        raise InputError(f"cannot resume this run: it has no checkpoint ({result.status})")
    from frictionsim.io.result_reader import read_checkpoint

    stored = read_checkpoint(path)
    if stored.attributes != record.attributes:
        raise InputError(f"{path}: it has changed since it was opened; open it again")
    return stored.state


def _statistics(statistics: SolverStatistics) -> str:
    compiled, seconds = statistics.compile_seconds, statistics.wall_seconds
    compilation = f" after {short_text(compiled)} s of compilation" if compiled else ""
    solved = "" if seconds is None else f"solved in {short_text(seconds)} s{compilation}: "
    return (
        f"{solved}{statistics.states} states,"
        f" {statistics.steps} steps, {statistics.rejected} rejected steps,"
        f" {statistics.rhs_evaluations} evaluations of the right-hand side"
    )


def _events_parts(events: Sequence[Transition]) -> Document:
    """Yield the table of the events, of many the first ones and the last."""
    from frictionsim.reports.run_tables import event_cells

    count, first = len(events), MAX_EVENTS - 2
    numbers = [*range(first), count - 1] if count > MAX_EVENTS else range(count)
    rows = [(str(i + 1), f"{events[i].time:.9f}", *event_cells(events[i])) for i in numbers]
    angle = (">angle, rad",) if any(event.position is not None for event in events) else ()
    if count > MAX_EVENTS:
        rows.insert(first, ("...",))
    yield Table((">event", ">time, s", "contact", "from", "to", *angle), rows)
    if count > MAX_EVENTS:
        yield f"events {first + 1} to {count - 1} are in the JSON, and in Result.events"


def _event_json(event: Transition) -> dict[str, Any]:
    names = ("time", "contact", "mode_from", "mode_to")
    angle = {} if event.position is None else {"angle": event.position}
    return {name: getattr(event, name) for name in names} | angle
