"""Sweeps from Python: a scenario at many combinations of values, in workers and files."""

import logging
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, closing, nullcontext, suppress
from os import PathLike
from pathlib import Path
from shutil import copytree
from signal import SIGINT, Signals
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, model_validator

from frictionsim.api.scenarios import with_overrides
from frictionsim.api.sweep_result import Sweep, open_sweep
from frictionsim.errors import (
    ArgumentError,
    FrictionsimError,
    InputError,
    Interrupted,
    OutputError,
    WorkerDied,
)
from frictionsim.io.names import (
    check_names,
    is_same_file,
    resumable_name,
    unfinished_beside,
    unfinished_sweep_name,
    warn_of_name,
    whole_name,
)
from frictionsim.io.output_file import SWEEP, UNFINISHED_SWEEP, check_output
from frictionsim.io.result_reader import is_unfinished_sweep, opened
from frictionsim.io.sweep_file import write_sweep
from frictionsim.io.sweep_journal import SweepJournal, read_unfinished
from frictionsim.io.sweep_table import FAILED, RunBlock, SweepHeader
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import ScenarioSource, read_toml
from frictionsim.scenario.options import Options, function_of
from frictionsim.scenario.origin import scenario_file
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import changes, toml_tables
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import (
    Monitor,
    RunMonitor,
    StopSignals,
    SweepProgress,
    monitor_of,
)
from frictionsim.sweeps.design import SAMPLE, Design, design_of
from frictionsim.sweeps.outcomes import completed, header_of
from frictionsim.sweeps.runs import Work, check_combinations, remaining_runs, run_blocks
from frictionsim.sweeps.study_file import (
    SweepOptions,
    SweepStudy,
    check_not_fixed,
    is_study,
    study_of,
    study_toml,
)
from frictionsim.sweeps.workers import (
    ProcessPool,
    available_cores,
    dask_cluster,
    process_pool,
)
from frictionsim.version import __version__

if TYPE_CHECKING:
    from frictionsim.scenario.overrides import Overrides

LOG = logging.getLogger(__name__)


OnProgress = bool | Callable[[SweepProgress], Any]
SERIES, STUDY = ".series", "study.toml"


class WorkerOptions(Options):
    """The arguments of `sweep` and `resume_sweep` beside the study and its file."""

    no_clobber: bool = False
    progress: Annotated[Any, function_of("a SweepProgress", switch=True)] = False
    dask: str | None = None
    workers: int | None = Field(None, gt=0)

    @model_validator(mode="after")
    def _workers_of_one_kind(self) -> Self:
        if self.workers is not None and self.dask is not None:
            fault = "it excludes 'dask': the cluster has the workers; leave one out"
            raise inconsistent(("workers",), fault)
        return self


def sweep(
    scenario: Scenario | ScenarioSource | SweepStudy,
    vary: Mapping[str, Any] | Iterable[str] | None = None,
    overrides: "Overrides | None" = None,
    *,
    zip: bool = False,
    sample: int | None = None,
    method: str | None = None,
    seed: int | None = None,
    indices: bool = False,
    keep_series: bool = False,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    progress: OnProgress = False,
) -> Sweep:
    """Run a scenario for many combinations of values.

    Parameters
    ----------
    scenario : Scenario, path or mapping
        As for `solve`; or a study with the tables [study], [set] and [vary].
    vary : mapping of str
        Values by key: a list or array, or a text such as
        ``"lin(0.1, 0.4, 4)"``, ``"log(1, 100, 5)"``; with `sample` distributions, e.g.
        ``"uniform(0.1, 0.4)"``, ``"normal(2224, 50)"``. Several keys with commas between them
        have one value; None, or "none", takes a key out. Without `zip` and `sample`, all
        combinations are run.
    overrides : mapping or iterable of str, optional
        Overrides of all runs, as for `solve`.
    zip : bool
        Vary the keys together: the first values of all, then the second ones.
    sample : int, optional
        Number of runs of a sample.
    method : str, optional
        Sampling method: sobol (default), lhs or random.
    seed : int, optional
        Random seed, by default 0.
    indices : bool
        Run the combinations that Sobol indices need, sample (keys + 2) runs.
    keep_series : bool
        Keep the result of each run in the folder NAME.series beside the output.
    output : path, optional
        File to write to, NAME.h5. Until the sweep is done it is in NAME.partial.runs, for
        `resume_sweep` and `open_sweep`.
    no_clobber : bool
        Do not replace an existing file.
    workers : int, optional
        Number of processes, by default as many as there are cores.
    dask : str, optional
        Address of a Dask scheduler, e.g. ``"tcp://host:8786"``, or ``"local:4"``.
    progress : bool or callable
        True shows a bar on a terminal; a callable is called several times per second with
        a `SweepProgress`.

    Returns
    -------
    Sweep
        Its table; `dataset` has the varied keys and the quantities.

    Raises
    ------
    InputError, ScenarioError
        If an argument or a combination is not valid; before anything is run.
    OutputError
        If the file cannot be written.
    SolverError
        If a worker was killed; with an output, what is done is kept for `resume_sweep`.
    """
    given = {name: value for name, value in locals().items() if name in SweepOptions.model_fields}
    options = WorkerOptions.among(locals())
    study = study_from(scenario, overrides, given)
    varied, text, path = study.options, study_toml(study), None
    if output is not None:
        path = as_path("output", output)
        _check_files(path, None, options.no_clobber, text)
        if varied.keep_series:
            _check_series(_series_of(path), text)
    elif varied.keep_series:
        raise ArgumentError(
            "keep_series", "the results of runs are saved beside an output; give one"
        )
    with study.placed():
        design = design_of(varied)
    run = _SweepRun(study, design, header_of(study.scenario, design, text), path)
    return run.run(options)


def resume_sweep(
    path: str | PathLike[str],
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    progress: OnProgress = False,
) -> Sweep:
    """Resume an interrupted sweep; the file is bit-identical to that of an uninterrupted one.

    Parameters
    ----------
    path : path
        The unfinished sweep, NAME.partial.runs.
    output : path, optional
        File to write to, by default NAME.h5. With another name the unfinished sweep stays, and
        the results of its runs (`keep_series`) are copied.
    no_clobber, workers, dask, progress
        As for `sweep`.

    Returns
    -------
    Sweep
        The complete sweep, as returned by `sweep`.

    Raises
    ------
    InputError
        If the sweep cannot be resumed.
    OutputError
        If another process is running it, or the file cannot be written.
    SolverError
        If a worker was killed; what is done is kept for `resume_sweep`.
    """
    options = WorkerOptions.among(locals())
    file = resumable_name(as_path("path", path))
    if not is_unfinished_sweep(file):
        is_done = open_sweep(file).status == "done"
        what = "this sweep is done" if is_done else "this is a copy of a sweep that is not done"
        beside = unfinished_beside(whole_name(file)) or "; there is nothing to resume"
        raise InputError(f"{file}: {what}{beside}")
    with closing(SweepJournal(file, is_new=False)) as journal:
        found = read_unfinished(file)
        attributes, own = found.header.attributes, found.whole(file)
        if attributes["frictionsim_version"] != __version__:
            raise InputError(
                f"{file}: cannot resume this sweep: it was started with frictionsim"
                f" {attributes['frictionsim_version']}, this is {__version__}; install that"
                " version, or run the study again"
            )
        target = own if output is None else as_path("output", output)
        _check_files(target, file, options.no_clobber, attributes["study"])
        study = study_of(toml_tables(attributes["study"]), None, str(file))
        varied = study.options
        if varied.keep_series:
            for whole in (own, target):
                _check_series(_series_of(whole), attributes["study"])
        if varied.sample is None:
            design = design_of(varied)
        else:  # not drawn again
            levels = tuple(c.values for c in found.header.coordinates.values())
            design = Design(SAMPLE, tuple(varied.vary), levels)
        run = _SweepRun(study._replace(folder=found.folder), design, found.header, target)
        is_own = is_same_file(unfinished_sweep_name(target), file)
        run.go_on(found.blocks, journal if is_own else None, _series_of(own))
        return run.run(options)


def _shown(progress: OnProgress) -> AbstractContextManager[Monitor[SweepProgress]]:
    """Return the context with the monitor that shows the progress of a sweep, or does nothing."""
    if callable(progress):
        return nullcontext(monitor_of(progress))  # a monitor is entered by who gives it
    if not progress:
        return Monitor()
    from frictionsim.api.progress import SweepBar

    return SweepBar()


def study_from(
    scenario: Scenario | ScenarioSource | SweepStudy,
    overrides: "Overrides | None",
    given: Mapping[str, Any],
) -> SweepStudy:
    """Return the study given by the arguments of `sweep`, of which `given` are its options."""
    if isinstance(scenario, SweepStudy):
        return scenario
    written = _written_study(scenario)
    if written is not None:
        # Before they are checked: an option may be wrong only beside those that are in the file.
        on = [name for name, value in given.items() if value is not None and value is not False]
        for name in [*(["set"] if overrides else []), *on]:
            raise ArgumentError(name, "the study file already defines the sweep; change it there")
        return written
    options = SweepOptions.of(**given)
    loaded = with_overrides(scenario, overrides)
    check_not_fixed(_keys(overrides), options.vary)
    return SweepStudy(loaded, options, Path(loaded.origin.source).parent)


def _keys(overrides: "Overrides | None") -> list[str]:
    """Return the keys of overrides."""
    if isinstance(overrides, Mapping):
        return list(map(str, overrides))
    return [text.partition("=")[0] for text in overrides or () if isinstance(text, str)]


def _written_study(source: Scenario | ScenarioSource) -> SweepStudy | None:
    """Return the study of a file or of tables; None if they are a scenario."""
    if isinstance(source, Mapping):
        return study_of(source, Path(), "study") if is_study(source) else None
    if isinstance(source, Scenario):
        return None
    path = scenario_file(as_path("scenario", source))
    text, data = read_toml(path)
    return study_of(data, path.parent, str(path), text) if is_study(data) else None


def _check_files(whole: Path, resumed: Path | None, no_clobber: bool, study: str) -> None:
    """Check, before any run, that the files of a sweep can be written."""
    unfinished = unfinished_sweep_name(whole)
    check_names(whole, unfinished, resumed, SWEEP, no_clobber)
    check_output(whole, SWEEP)
    check_output(unfinished, UNFINISHED_SWEEP)
    if not is_same_file(unfinished, resumed) and unfinished.is_file():
        try:
            SweepJournal(unfinished).close()  # raises unless it holds none
        except OutputError as error:
            raise OutputError(f"{error}{_difference(unfinished, study)}") from None
    warn_of_name(whole)
    with suppress(InputError, KeyError):  # the earlier file may be anything
        if resumed is None and whole.is_file():
            with opened(whole) as file:
                text = _changes(str(file.attrs["study"]), study)
            if text:
                note = {"note": True}
                LOG.warning("%s replaces a sweep of other values (%s)", whole, text, extra=note)


def _difference(unfinished: Path, study: str) -> str:
    """Return the end of a message: the keys in which an unfinished sweep differs from a study."""
    try:
        text = _changes(read_unfinished(unfinished).header.attributes["study"], study)
    except InputError:  # damaged, or another process is at its beginning
        return ""
    return f". It is of other values ({text})" if text else ""


def _changes(before: str, study: str) -> str:
    texts = changes(before, study)
    return "; ".join(one.removeprefix("vary.").removeprefix("study.scenario.") for one in texts)


def _series_of(whole: Path) -> Path:
    """Return the folder for the results of the runs, a.series for a.h5."""
    return whole.with_name(whole.stem + SERIES)


def _check_series(folder: Path, study: str) -> None:
    """Raise OutputError if a folder exists and is not that of the runs of a study."""
    if os.path.lexists(folder):
        try:
            is_ours = (folder / STUDY).read_bytes() == study.encode()
        except OSError:
            is_ours = False
        if not is_ours:
            raise OutputError(
                f"{folder}: the results of the runs would be written here, and it is not a folder"
                " of the same study; move it, or give another name with -o"
            )


class _SweepRun(RunMonitor):
    """A new or resumed sweep while it runs; it is the monitor of its runs.

    Parameters
    ----------
    whole : Path or None
        Its file; None if none is written.
    """

    def __init__(
        self, study: SweepStudy, design: Design, header: SweepHeader, whole: Path | None
    ) -> None:
        self._study, self._design, self._header, self._whole = study, design, header, whole
        self._blocks: list[RunBlock] = []
        self._done = self._failed = self._checked = 0
        self._journal: SweepJournal | None = None
        self._earlier_series: Path | None = None

    def go_on(self, blocks: list[RunBlock], journal: SweepJournal | None, series: Path) -> None:
        """Take over the runs that are done.

        Without a journal a new one is begun, and their results are copied from a folder.
        """
        for block in blocks:
            self._add(block)
        self._checked, self._journal, self._earlier_series = self._done, journal, series

    def _add(self, block: RunBlock) -> None:
        self._blocks.append(block)
        self._done += block.runs
        self._failed += int((block.status == FAILED).sum())

    def run(self, options: WorkerOptions) -> Sweep:
        """Run the remaining combinations and write the files."""
        handled = nullcontext() if self._whole is None else StopSignals()
        processes, dask = min(options.workers or available_cores(), self._design.runs), options.dask
        with (
            _shown(options.progress) as self._shown,
            process_pool(processes) if dask is None else dask_cluster(dask) as pool,
            handled as self._stop,
        ):
            keys = self._design.keys
            remaining = remaining_runs(self._design.runs, self._blocks)
            with self._study.placed():
                combinations = Combinations(self._study.scenario, keys, self._study.folder)
                for count in check_combinations(combinations, self._design, remaining):
                    self._checked += count
                    self(0.0)
            if isinstance(pool, ProcessPool):
                self._compile(combinations)
            work = Work(combinations, self._series)
            blocks = run_blocks(pool, work, self._design, remaining, self)
            if self._whole is not None:
                return self._with_files(blocks, self._whole)
            for block in blocks:
                self._add(block)
            return Sweep(completed(self._header, self._blocks))

    def __call__(self, t: float, /) -> None:
        """Show the progress; end the sweep at Ctrl-C."""
        if self._stop is not None and self._stop.received:
            raise KeyboardInterrupt
        total = self._design.runs
        self._shown(SweepProgress(self._done, total, self._failed, self._checked))

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Return the context in which a kernel is compiled."""
        return self._shown.compiling(expected)

    def _compile(self, combinations: Combinations) -> None:
        """Compile the kernels of a run once, before there are workers."""
        (values,) = self._design.combinations(0, 1)
        with suppress(FrictionsimError, ArithmeticError):  # the run will raise it again
            scenario = combinations.scenario(values)
            mechanism_module(scenario.kind).simulation(scenario).prepare(self)

    @property
    def _series(self) -> Path | None:
        """The folder for the results of the runs; None if they are not kept."""
        if self._whole is None or not self._study.options.keep_series:
            return None
        return _series_of(self._whole)

    def _with_files(self, blocks: Iterable[RunBlock], whole: Path) -> Sweep:
        """Run what remains, and write the file; what is done is kept whatever ends the sweep."""
        with closing(self._journal or SweepJournal(unfinished_sweep_name(whole))) as journal:
            try:
                self._make_series()
                if self._journal is None:
                    folder = self._study.folder.absolute()
                    journal.begin(self._header, whole.name, folder)
                    for block in self._blocks:
                        journal.append(block)
            except BaseException:
                if self._journal is None:
                    journal.remove()
                raise
            try:
                for block in blocks:
                    journal.append(block)
                    self._add(block)
                table = completed(self._header, self._blocks)
                write_sweep(table, whole)
            except BaseException as error:
                if isinstance(error, InputError) and not self._done:  # no worker can be started
                    journal.remove()
                else:
                    self._keep(journal, error)
                raise
            journal.remove()
        return Sweep(table, whole)

    def _make_series(self) -> None:
        """Make the folder for the results of the runs, with those that are done already."""
        folder, earlier = self._series, self._earlier_series
        if folder is None:
            return
        try:
            folder.mkdir(exist_ok=True)
            (folder / STUDY).write_bytes(self._header.attributes["study"].encode())
            if earlier is not None and earlier.is_dir() and not folder.samefile(earlier):
                copytree(earlier, folder, dirs_exist_ok=True)
        except OSError as error:
            reason = error.strerror or "the results of the runs that are done cannot be copied"
            raise OutputError(f"{folder}: cannot make this folder: {reason}") from None

    def _keep(self, journal: SweepJournal, error: BaseException) -> None:
        """Note in the journal why the sweep stops, and in the error that it can be resumed."""
        runs = f"{self._done} of {self._design.runs} runs"
        kept = (
            f"sweep interrupted: {runs} are saved in {journal.path};"
            f" 'frictionsim resume {journal.path}' continues the sweep"
        )
        how = f"stopped by an error ({type(error).__name__})"
        if isinstance(error, Interrupted | KeyboardInterrupt):
            number = error.signal_number if isinstance(error, Interrupted) else SIGINT
            how = f"interrupted by {Signals(number).name}"
            error.args = (kept,)
        elif isinstance(error, OutputError | WorkerDied):
            how = "stopped by an error"
            error.args = (f"{error}. {kept}",)
        with suppress(OutputError):  # the disk is full
            journal.stop(f"{how} after {runs}")
