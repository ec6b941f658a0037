"""Sweeps from Python: a scenario at many combinations of values, in workers and files."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import cached_property
from os import PathLike
from pathlib import Path
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
from frictionsim.io.result_reader import is_unfinished_sweep
from frictionsim.io.sweep_file import write_sweep
from frictionsim.io.sweep_journal import SweepJournal, UnfinishedSweep, read_unfinished
from frictionsim.io.sweep_table import FAILED, RunBlock, SweepTable, with_blocks
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import ScenarioSource, read_toml
from frictionsim.scenario.options import Options, as_path, function_of
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.shipped import scenario_file
from frictionsim.scenario.toml_data import toml_tables
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import (
    Monitor,
    RunMonitor,
    StopSignals,
    SweepProgress,
    monitor_of,
)
from frictionsim.sweeps.design import METHODS as METHODS
from frictionsim.sweeps.design import SAMPLE, Design, design_of
from frictionsim.sweeps.outcomes import SweepPlan, completed, remaining_runs
from frictionsim.sweeps.run_blocks import Work, check_combinations, run_blocks
from frictionsim.sweeps.study_file import SweepOptions as SweepOptions
from frictionsim.sweeps.study_file import (
    SweepStudy,
    check_not_fixed,
    is_study,
    study_of,
    study_toml,
)
from frictionsim.sweeps.workers import (
    ProcessPool,
    Workers,
    available_cores,
    dask_cluster,
    process_pool,
)
from frictionsim.version import __version__

if TYPE_CHECKING:
    from frictionsim.scenario.overrides import Overrides


OnProgress = Callable[[SweepProgress], Any]
SERIES, STUDY = ".series", "study.toml"


class SweepInterrupted(Interrupted):
    """A sweep was stopped by a signal; the message names the file that is kept."""

    def __init__(self, signal_number: int, text: str = "") -> None:
        super().__init__(signal_number, 0.0)
        self.args = (text,)
        self._arguments = signal_number, text


class ExecutionOptions(Options):
    """Worker processes or Dask cluster of a sweep, its progress and its file."""

    workers: int | None = Field(None, gt=0)
    dask: str | None = None
    progress: Annotated[Any, function_of("a SweepProgress", "True, False or ")] = False
    no_clobber: bool = False

    @model_validator(mode="after")
    def _exclude_each_other(self) -> Self:
        if self.workers is not None and self.dask is not None:
            raise InputError(
                "workers and dask exclude each other: with dask the cluster has the workers"
            )
        return self

    def of_runs(self, runs: int) -> AbstractContextManager[Workers]:
        """Return the context of the workers for a number of runs."""
        if self.dask is not None:
            return dask_cluster(self.dask)
        return process_pool(min(self.workers or available_cores(), runs))


def sweep(
    scenario: Scenario | ScenarioSource,
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
    progress: OnProgress | bool = False,
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
        have one value. Without `zip` and `sample`, all combinations are run.
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
    path = None if output is None else as_path("output", output)
    options = SweepOptions.among(locals())
    execution = ExecutionOptions.among(locals())
    return run_study(study_from(scenario, overrides, options), path, execution)


def resume_sweep(
    path: str | PathLike[str],
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    progress: OnProgress | bool = False,
) -> Sweep:
    """Resume an interrupted sweep; the file is bit-identical to that of an uninterrupted one.

    Parameters
    ----------
    path : path
        The unfinished sweep, NAME.partial.runs.
    output : path, optional
        File to write to, by default NAME.h5. With another name the unfinished sweep stays.
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
    """
    target = None if output is None else as_path("output", output)
    execution = ExecutionOptions.among(locals())
    return resume_study(open_sweep(resumable_name(as_path("path", path))), target, execution)


@contextmanager
def shown(progress: OnProgress | bool) -> Iterator[Monitor[SweepProgress]]:
    """Return the context with the monitor that shows the progress of a sweep, or does nothing."""
    if callable(progress):
        yield monitor_of(progress)
    elif progress:
        from frictionsim.api.progress import SweepBar

        with SweepBar() as bar:
            yield bar
    else:
        yield Monitor()


def study_from(
    scenario: Scenario | ScenarioSource, overrides: "Overrides | None", options: SweepOptions
) -> SweepStudy:
    """Return the study given by the arguments of `sweep`."""
    written = _written_study(scenario)
    if written is not None:
        for name in [*(["set"] if overrides else []), *options.given_names]:
            raise ArgumentError(
                name, "the study file already defines the varied keys; change it there"
            )
        return written
    loaded = with_overrides(scenario, overrides)
    check_not_fixed(_keys(overrides), options.vary)
    return SweepStudy(loaded, options)


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
    data = read_toml(path)
    return study_of(data, path.parent, str(path)) if is_study(data) else None


LOCAL = ExecutionOptions()


def run_study(
    study: SweepStudy, target: Path | None = None, execution: ExecutionOptions = LOCAL
) -> Sweep:
    """Run a study.

    Parameters
    ----------
    study : SweepStudy
    target : Path, optional
        The file to write, in an existing folder.
    execution : ExecutionOptions
        Its `progress` may raise `SweepInterrupted`.

    Raises
    ------
    InputError
        Before the first run.
    OutputError, WorkerDied, SweepInterrupted, KeyboardInterrupt
        With a target, the runs that are done are kept.
    """
    options, text, series = study.options, study_toml(study), None
    if target is None:
        if options.keep_series:
            raise ArgumentError(
                "keep_series", "the results of runs are saved beside an output; give one"
            )
    else:
        _check_files(target, None, execution.no_clobber)
        series = _series_folder(target, text) if options.keep_series else None
    plan = SweepPlan(study.scenario, design_of(options.vary, options.zip, options.sampling), series)
    return _SweepRun(plan, plan.table(text), [], target).run(execution)


def resume_study(
    incomplete: Sweep, output: Path | None = None, execution: ExecutionOptions = LOCAL
) -> Sweep:
    """Resume an interrupted sweep.

    Parameters
    ----------
    incomplete : Sweep
        That of a file.
    output : Path, optional
        The file for the complete sweep.
    execution
        As for `run_study`.

    Raises
    ------
    InputError
        If it cannot be resumed.
    OutputError, WorkerDied, SweepInterrupted, KeyboardInterrupt
        As for `run_study`.
    """
    path = incomplete.path
    assert path is not None, "it is of a file"
    if not is_unfinished_sweep(path):
        beside = unfinished_beside(whole_name(path)) or "; there is nothing to resume"
        is_done = incomplete.status == "done"
        what = "this sweep is done" if is_done else "this is a copy of a sweep that is not done"
        raise InputError(f"{path}: {what}{beside}")
    with SweepJournal(path, is_new=False) as journal:
        found = read_unfinished(path)
        whole = found.whole(path) if output is None else output
        _check_files(whole, path, execution.no_clobber)
        plan = _resumed_plan(path, found, whole)
        is_own = is_same_file(unfinished_sweep_name(whole), path)
        if plan.series is not None and not is_own:
            raise InputError(
                f"{path}: cannot resume this sweep into another file: the results of its runs are"
                " in a folder beside it; resume it without another name"
            )
        run = _SweepRun(plan, found.planned, found.blocks, whole, journal if is_own else None)
        return run.run(execution)


def _check_files(whole: Path, resumed: Path | None, no_clobber: bool) -> None:
    """Check, before any run, that the files of a sweep can be written."""
    unfinished = unfinished_sweep_name(whole)
    check_names(whole, unfinished, resumed, SWEEP, no_clobber)
    check_output(whole, SWEEP)
    check_output(unfinished, UNFINISHED_SWEEP)
    if not is_same_file(unfinished, resumed) and unfinished.is_file():
        SweepJournal(unfinished).close()  # raises unless it is empty
    warn_of_name(whole)


def _resumed_plan(path: Path, found: UnfinishedSweep, whole: Path) -> SweepPlan:
    """Return the plan of an unfinished sweep; a sample is not drawn again."""
    attributes, coordinates = found.planned.attributes, found.planned.coordinates
    version, text = attributes["frictionsim_version"], attributes["study"]
    if version != __version__:
        raise InputError(
            f"{path}: cannot resume this sweep: it was started with frictionsim {version}, this is"
            f" {__version__}; install that version, or run the study again"
        )
    study = study_of(toml_tables(text), None, str(path))
    options = study.options
    if options.sampling is None:
        design = design_of(options.vary, options.zip)
    else:
        design = Design(SAMPLE, tuple(options.vary), tuple(c.values for c in coordinates.values()))
    series = _series_folder(whole, text) if options.keep_series else None
    return SweepPlan(study.scenario, design, series)


def _series_folder(whole: Path, study: str) -> Path:
    """Return the folder for the results of the runs, a.series for a.h5.

    OutputError is raised if it exists and is not one of the same study.
    """
    folder = whole.with_name(whole.stem + SERIES)
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
    return folder


def _make_series_folder(folder: Path | None, study: str) -> None:
    """Make the folder for the results of the runs, and write the study into it."""
    if folder is None:
        return
    try:
        folder.mkdir(exist_ok=True)
        (folder / STUDY).write_bytes(study.encode())
    except OSError as error:
        raise OutputError(f"{folder}: cannot make this folder: {error.strerror}") from None


class _SweepRun:
    """A running or resumed sweep: the blocks that are done, and the files for them.

    A new journal is begun unless that of a resumed sweep is given.
    """

    def __init__(
        self,
        plan: SweepPlan,
        planned: SweepTable,
        blocks: list[RunBlock],
        whole: Path | None,
        journal: SweepJournal | None = None,
    ) -> None:
        self._plan, self._planned, self._blocks = plan, planned, blocks
        self._whole, self._journal = whole, journal
        self._done = self._checked = sum(block.runs for block in blocks)
        self._failed = sum(block.count(FAILED) for block in blocks)
        self._combinations = Combinations(plan.scenario, plan.design.keys)
        self._remaining = remaining_runs(with_blocks(planned, blocks))

    def run(self, execution: ExecutionOptions) -> Sweep:
        """Run the remaining combinations and write the files."""
        handled = nullcontext() if self._whole is None else StopSignals()
        with (
            shown(execution.progress) as progress,
            execution.of_runs(self._planned.runs) as workers,
            handled as stop,
        ):
            monitor = _SweepMonitor(stop, progress, self._progress)
            self._check(monitor)
            if self._whole is None:
                self._blocks += self._new_blocks(workers, monitor)
            else:
                self._run_with_journal(self._whole, workers, monitor)
        return Sweep(self._table, self._whole)

    def _check(self, monitor: RunMonitor) -> None:
        def on_checked(count: int) -> None:
            self._checked += count
            monitor(0.0)

        check_combinations(self._combinations, self._plan.design, self._remaining, on_checked)

    def _progress(self) -> SweepProgress:
        return SweepProgress(self._done, self._planned.runs, self._failed, self._checked)

    @cached_property
    def _table(self) -> SweepTable:
        return completed(with_blocks(self._planned, self._blocks))

    def _new_blocks(self, workers: Workers, monitor: RunMonitor) -> Iterator[RunBlock]:
        if isinstance(workers, ProcessPool):
            self._compile(monitor)
        work = Work(self._combinations, self._plan.series)
        for block in run_blocks(workers, work, self._plan.design, self._remaining, monitor):
            yield block
            self._done += block.runs
            self._failed += block.count(FAILED)

    def _compile(self, monitor: RunMonitor) -> None:
        """Compile the kernels of a run once, before there are workers."""
        (values,) = self._plan.design.combinations(0, 1)
        with suppress(FrictionsimError, ArithmeticError):  # the run will raise it again
            scenario = self._combinations.scenario(values)
            mechanism_module(scenario.kind).simulation(scenario).prepare(monitor)

    def _run_with_journal(self, whole: Path, workers: Workers, monitor: RunMonitor) -> None:
        """Run what remains, and write the file; what is done is kept whatever ends the sweep."""
        is_new = not self._blocks
        with self._open_journal(whole) as journal:
            try:
                for block in self._new_blocks(workers, monitor):
                    journal.append(block)
                    self._blocks.append(block)
                write_sweep(self._table, whole)
            except InputError:
                if is_new and not self._done:
                    journal.remove()
                raise
            except (Interrupted, KeyboardInterrupt) as error:
                number = error.signal_number if isinstance(error, Interrupted) else SIGINT
                self._stop(journal, f"interrupted by {Signals(number).name}")
                kept = self._kept(journal)
                is_signal = isinstance(error, Interrupted)
                raise (
                    SweepInterrupted(number, kept) if is_signal else KeyboardInterrupt(kept)
                ) from None
            except (OutputError, WorkerDied) as error:
                self._stop(journal, "stopped by an error")
                raise type(error)(f"{error}. {self._kept(journal)}") from None
            except BaseException as error:
                self._stop(journal, f"stopped by an error ({type(error).__name__})")
                raise
            journal.remove()

    def _open_journal(self, whole: Path) -> SweepJournal:
        if self._journal is not None:
            _make_series_folder(self._plan.series, self._planned.attributes["study"])
            return self._journal
        journal = SweepJournal(unfinished_sweep_name(whole))
        try:
            _make_series_folder(self._plan.series, self._planned.attributes["study"])
            journal.begin(self._planned, whole.name)
            for block in self._blocks:  # of a sweep that goes on under another name
                journal.append(block)
        except BaseException:
            journal.remove()
            raise
        return journal

    def _stop(self, journal: SweepJournal, how: str) -> None:
        with suppress(OutputError):  # the disk is full
            journal.stop(f"{how} after {self._done} of {self._planned.runs} runs")

    def _kept(self, journal: SweepJournal) -> str:
        return (
            f"sweep interrupted: {self._done} of {self._planned.runs} runs are saved in"
            f" {journal.path}; 'frictionsim resume {journal.path}' continues the sweep"
        )


class _SweepMonitor(RunMonitor):
    """Ends a sweep at Ctrl-C; shows its progress."""

    def __init__(
        self,
        stop: StopSignals | None,
        shown: Monitor[SweepProgress],
        progress: Callable[[], SweepProgress],
    ) -> None:
        self._stop, self._shown, self._progress = stop, shown, progress

    def __call__(self, t: float, /) -> None:
        if self._stop is not None and self._stop.received:
            raise KeyboardInterrupt
        self._shown(self._progress())

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        return self._shown.compiling(expected)
