"""The running of a sweep: its workers, its files, its progress, and its end."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from signal import SIGINT
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from frictionsim.api.sweep_result import Sweep
from frictionsim.errors import InputError, Interrupted, OutputError
from frictionsim.io.destination import whole_name
from frictionsim.io.sweep_table import SweepTable
from frictionsim.parameter_study.block import FAILED, Block
from frictionsim.parameter_study.design import SAMPLE, Design
from frictionsim.parameter_study.dispatch import Executor, check_combinations, run_sweep
from frictionsim.parameter_study.executors import available_cores, local_executor
from frictionsim.parameter_study.journal import remove_left_over
from frictionsim.parameter_study.study_file import SweepStudy, study_of, study_toml
from frictionsim.parameter_study.sweep import (
    Assembly,
    SweepPlan,
    coordinates_of,
    plan_of,
)
from frictionsim.parameter_study.sweep_files import (
    SweepFiles,
    check_is_series_folder,
    check_same_study,
    check_series_folder,
    make_series_folder,
    series_folder,
)
from frictionsim.scenario.options import Options
from frictionsim.scenario.toml_data import toml_tables
from frictionsim.simulation.monitor import StopSignals
from frictionsim.version import __version__

RUNNING = (
    "killed, or still running; 'frictionsim resume' goes on with it, and has what was done"
    " meanwhile from the file .h5.runs beside this one"
)


class SweepProgress(NamedTuple):
    """How far a sweep is.

    Attributes
    ----------
    done : int
        Number of runs that have an outcome, whatever it is.
    total : int
    failed : int
        Of those that are done.
    checked : int
        Number of combinations that were validated; before the runs begin, all are.
    """

    done: int
    total: int
    failed: int
    checked: int


OnProgress = Callable[[SweepProgress], Any]


class SweepInterrupted(Interrupted):
    """A sweep that was stopped by a signal; the message says what is kept, and where."""

    def __init__(self, signal_number: int, text: str = "") -> None:
        super().__init__(signal_number, 0.0)
        self.signal_number, self._text = signal_number, text
        self._arguments = signal_number, text  # type: ignore[assignment]

    def __str__(self) -> str:
        return self._text


class ExecutionOptions(Options):
    """The processes or the cluster of Dask that a sweep runs on."""

    workers: int | None = Field(None, gt=0)
    dask: str | None = None

    @model_validator(mode="after")
    def _exclude_each_other(self) -> Self:
        if self.workers is not None and self.dask is not None:
            raise InputError(
                "workers and dask exclude each other: with dask the cluster has the workers"
            )
        return self

    def executor(self, runs: int) -> Executor:
        """Return the executor of so many runs."""
        if self.dask is not None:
            from frictionsim.parameter_study.dask_cluster import DaskCluster

            return DaskCluster(self.dask)
        return local_executor(self.workers or available_cores(), runs)


LOCAL = ExecutionOptions()


def run_study(
    study: SweepStudy,
    target: Path | None = None,
    no_clobber: bool = False,
    progress: OnProgress | None = None,
    execution: ExecutionOptions = LOCAL,
) -> Sweep:
    """Run a study.

    Parameters
    ----------
    study : SweepStudy
    target : Path, optional
        The file to write; its folder is there.
    no_clobber : bool
        Do not replace an existing file.
    progress : callable, optional
        Called some times each second; it may raise `SweepInterrupted`.
    execution : ExecutionOptions

    Raises
    ------
    InputError, OutputError
        Before anything is run; OutputError also later, with what is done kept.
    SweepInterrupted, KeyboardInterrupt
        With what is done kept, if there is a target.
    """
    text = study_toml(study)
    files, series = None, None
    if study.keep_series and target is None:
        raise InputError("keep_series: the results of the runs are kept beside an output; give one")
    if target is not None:
        files = SweepFiles(target)
        files.check(no_clobber)
        if study.keep_series:
            series = series_folder(target)
            check_series_folder(series, text)
    plan = plan_of(study.scenario, study.vary, study.together, study.sampling, series)
    running = _SweepRun(plan, text, Assembly(plan.design.runs), files, progress)
    return running.run(execution)


def resume_study(
    path: Path,
    output: Path | None = None,
    no_clobber: bool = False,
    progress: OnProgress | None = None,
    execution: ExecutionOptions = LOCAL,
) -> Sweep:
    """Do the runs that are left of an interrupted sweep.

    Parameters
    ----------
    path : Path
        The incomplete file.
    output : Path, optional
        The file to write when the sweep is done.
    no_clobber, progress, execution
        As of `run_study`.

    Raises
    ------
    InputError
        If it cannot be resumed.
    OutputError, SweepInterrupted, KeyboardInterrupt
        As `run_study`.
    """
    from frictionsim.io.hdf5_reader import read_sweep

    _check_unfinished(path, read_sweep(path))
    files = SweepFiles(whole_name(path) if output is None else output, path)
    files.check(no_clobber)
    files.lock()
    try:
        # Once more: another process may have finished it since.
        table = read_sweep(path)
        _check_unfinished(path, table)
        if output is None:
            check_same_study(files.whole, table, path)
        plan = _plan_of_file(path, table, files.whole)
        if plan.series is not None:
            check_series_folder(plan.series, table.attributes["study"])
        assembly = Assembly(plan.design.runs)
        files.take_up(assembly, table)
    except BaseException:
        files.close()
        raise
    running = _SweepRun(
        plan, table.attributes["study"], assembly, files, progress, table.attributes
    )
    return running.run(execution)


def _check_unfinished(path: Path, table: SweepTable) -> None:
    if table.attributes["status"] != "interrupted":
        remove_left_over(path)
        raise InputError(f"{path}: this sweep is done; there is nothing to resume")
    version = table.attributes["frictionsim_version"]
    if version != __version__:
        raise InputError(
            f"{path}: cannot resume this sweep: it was started with frictionsim {version}, this is"
            f" {__version__}; install that version, or run the study again"
        )


def _plan_of_file(path: Path, table: SweepTable, whole: Path) -> SweepPlan:
    """Return the plan of an interrupted sweep; a sample is not drawn again."""
    damaged = InputError(f"{path}: cannot resume this sweep: its study is not that of its values")
    try:
        study = study_of(toml_tables(table.attributes["study"]), None, str(path))
    except ValueError:
        raise damaged from None
    series = None
    if study.keep_series:
        series = series_folder(whole)
        check_is_series_folder(series_folder(whole_name(path)), table.attributes["study"])
    if study.sampling is None:
        plan = plan_of(study.scenario, study.vary, study.together, None, series)
    else:
        given = {key: table.coordinates.get(key) for key in study.vary}
        if any(c is None or not _are_numbers(c.values) for c in given.values()):
            raise damaged
        levels = tuple(c.values for c in given.values() if c is not None)
        design = Design(SAMPLE, tuple(study.vary), levels)
        plan = SweepPlan(study.scenario, study.vary, design, study.sampling, series)
    made = coordinates_of(plan)
    same = made.keys() == table.coordinates.keys() and all(
        np.array_equal(made[key].values, table.coordinates[key].values) for key in made
    )
    if not same or plan.design.runs != len(table.status):
        raise damaged
    return plan


def _are_numbers(values: Any) -> bool:
    return isinstance(values, np.ndarray) and values.dtype == np.float64


class _SweepRun:
    """A running or resumed sweep."""

    def __init__(
        self,
        plan: SweepPlan,
        study: str,
        assembly: Assembly,
        files: SweepFiles | None,
        progress: OnProgress | None,
        attributes: dict[str, str] | None = None,
    ) -> None:
        self._plan, self._study, self._assembly = plan, study, assembly
        self._files, self._progress, self._attributes = files, progress, attributes
        self._done = assembly.done
        self._failed = int(np.count_nonzero(assembly.status == FAILED))
        self._checked = self._done

    def run(self, options: ExecutionOptions) -> Sweep:
        """Run what is left, and write the files."""
        files = self._files
        try:
            executor = options.executor(self._plan.design.runs)
            with _closing(executor), self._interruptible() as on_tick:
                check_combinations(
                    executor, self._plan, self._assembly.left, self._on_checked, on_tick
                )
                if files is None:
                    run_sweep(self._plan, self._assembly, executor, self._on_block, on_tick)
                    return Sweep(self._table(), None)
                if self._plan.series is not None:
                    make_series_folder(self._plan.series, self._study)
                files.begin(self._table(RUNNING))
                self._run_and_keep(executor, files, on_tick)
            return Sweep(self._table(), files.whole)
        finally:
            if files is not None:
                files.close()

    def _run_and_keep(
        self, executor: Executor, files: SweepFiles, on_tick: Callable[[], Any]
    ) -> None:
        """Run the remaining combinations; completed rows are saved on any exit."""
        try:
            run_sweep(self._plan, self._assembly, executor, self._on_block, on_tick)
        except BaseException as error:
            executor.close()
            with files.resumable():
                if not self._assembly.left:  # the last ones came after the signal
                    files.write_whole(self._table())
                else:
                    self._write_incomplete(files, error)
            if isinstance(error, Interrupted | KeyboardInterrupt):
                number = getattr(error, "signal_number", SIGINT)
                told = SweepInterrupted(number, self._kept(files, error))
                if isinstance(error, Interrupted):
                    raise told from None
                raise KeyboardInterrupt(str(told)) from None
            if isinstance(error, OutputError):
                raise OutputError(f"{error}. {self._kept(files, error)}") from None
            raise
        with files.resumable():
            files.write_whole(self._table())

    def _write_incomplete(self, files: SweepFiles, error: BaseException) -> None:
        how = "interrupted"
        if not isinstance(error, Interrupted | KeyboardInterrupt):
            how = f"stopped by an error ({type(error).__name__})"
        total = self._plan.design.runs
        files.write_incomplete(self._table(f"{how} after {self._done} of {total} runs"))

    def _kept(self, files: SweepFiles, error: BaseException) -> str:
        total, done = self._plan.design.runs, self._done
        if done == total:
            return f"interrupted, but all {total} runs were done; they are in {files.whole}"
        return (
            f"sweep interrupted: {done} of {total} runs are done and kept in {files.place};"
            f" 'frictionsim resume {files.place}' goes on"
        )

    @contextmanager
    def _interruptible(self) -> Iterator[Callable[[], Any]]:
        """Return the context in which Ctrl-C waits for a tick, if there is a file."""
        stop: AbstractContextManager[StopSignals | None] = nullcontext(None)
        if self._files is not None:
            stop = StopSignals()
        with stop as interruption:

            def on_tick() -> None:
                if interruption is not None and interruption.received:
                    raise KeyboardInterrupt
                if self._progress is not None:
                    total = self._plan.design.runs
                    self._progress(SweepProgress(self._done, total, self._failed, self._checked))

            yield on_tick

    def _on_checked(self, count: int) -> None:
        self._checked += count

    def _on_block(self, block: Block) -> None:
        if self._files is not None:
            self._files.keep(block)
        self._done += block.runs
        self._failed += int(np.count_nonzero(block.status == FAILED))

    def _table(self, reason: str = "") -> SweepTable:
        return self._assembly.table(self._plan, self._study, reason, self._attributes)


@contextmanager
def _closing(executor: Executor) -> Iterator[None]:
    try:
        yield
    finally:
        executor.close()
