"""Sweeps from Python: a scenario at many combinations of values, in workers and files."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from os import PathLike
from pathlib import Path
from signal import SIGINT, Signals
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from frictionsim.api.scenarios import with_overrides
from frictionsim.api.sweep_result import RUNNING, Sweep, open_sweep
from frictionsim.errors import (
    EXIT_BUDGET_EXCEEDED,
    ArgumentError,
    InputError,
    Interrupted,
    OutputError,
    SolverError,
)
from frictionsim.io.names import partial_name, resumable_name, unfinished_beside, whole_name
from frictionsim.io.sweep_table import SweepTable
from frictionsim.parameter_study.block import FAILED
from frictionsim.parameter_study.design import METHODS as METHODS
from frictionsim.parameter_study.design import SAMPLE, Design, check_sampling, design_of
from frictionsim.parameter_study.dispatch import Executor, check_combinations, run_blocks
from frictionsim.parameter_study.executors import available_cores, local_executor
from frictionsim.parameter_study.journal import journal_name, remove_left_over
from frictionsim.parameter_study.study_file import SweepOptions as SweepOptions
from frictionsim.parameter_study.study_file import (
    SweepStudy,
    check_not_fixed,
    is_study,
    study_of,
    study_toml,
)
from frictionsim.parameter_study.sweep import Assembly, SweepPlan, coordinates_of
from frictionsim.parameter_study.sweep_files import (
    SweepFiles,
    check_is_series_folder,
    check_series_folder,
    make_series_folder,
    series_folder,
)
from frictionsim.parameter_study.values import Levels, VariedValues
from frictionsim.scenario.loading import ScenarioSource, read_toml
from frictionsim.scenario.options import Options, as_path, function_of
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.shipped import scenario_file
from frictionsim.scenario.toml_data import toml_tables
from frictionsim.simulation.monitor import (
    Monitor,
    RunMonitor,
    StopSignals,
    SweepProgress,
    monitor_of,
)
from frictionsim.version import __version__

if TYPE_CHECKING:
    from frictionsim.scenario.overrides import Overrides


OnProgress = Callable[[SweepProgress], Any]


class SweepInterrupted(Interrupted):
    """A sweep was stopped by a signal; the message names the files kept."""

    def __init__(self, signal_number: int, text: str = "") -> None:
        super().__init__(signal_number, 0.0)
        self.signal_number, self._text = signal_number, text
        self._arguments = signal_number, text  # type: ignore[assignment]

    def __str__(self) -> str:
        return self._text


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

    def executor(self, runs: int) -> Executor:
        """Return the executor for a number of runs."""
        if self.dask is not None:
            from frictionsim.parameter_study.dask_cluster import DaskCluster

            return DaskCluster(self.dask)
        return local_executor(self.workers or available_cores(), runs)


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
        File to write to, NAME.h5. Until the sweep is done it is in NAME.partial.h5; Ctrl-C keeps
        what is done there, for `resume_sweep`.
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
        The incomplete file of the sweep.
    output : path, optional
        File to write to, NAME.h5; by default that of the NAME.partial.h5 that is resumed.
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
    study: SweepStudy,
    target: Path | None = None,
    execution: ExecutionOptions = LOCAL,
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
    InputError, OutputError
        Before the first run; OutputError also later, with the completed runs saved.
    SweepInterrupted, KeyboardInterrupt
        With the completed runs saved, if there is a target.
    """
    text = study_toml(study)
    files, series = None, None
    options = study.options
    if options.keep_series and target is None:
        raise ArgumentError(
            "keep_series", "the results of runs are saved beside an output; give one"
        )
    if target is not None:
        files = SweepFiles(target)
        files.check(execution.no_clobber)
        if options.keep_series:
            series = series_folder(target)
            check_series_folder(series, text)
    design = design_of(options.vary, options.zip, options.sampling)
    plan = SweepPlan(study.scenario, design, series)
    return _SweepRun(plan, text, Assembly(plan.design.runs, target is not None), files).run(
        execution
    )


def resume_study(
    incomplete: Sweep,
    output: Path | None = None,
    execution: ExecutionOptions = LOCAL,
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
    OutputError, SweepInterrupted, KeyboardInterrupt
        As for `run_study`.
    """
    from frictionsim.io.sweep_file import read_sweep

    path = incomplete.path
    assert path is not None, "it is of a file"
    _check_unfinished(path, incomplete.table)
    files = SweepFiles(whole_name(path) if output is None else output, path)
    files.check(execution.no_clobber)
    files.lock()
    try:
        # Once more: another process may have finished it since.
        table = read_sweep(path)
        _check_unfinished(path, table)
        plan = _plan_of_file(path, table, files.whole)
        if plan.series is not None:
            check_series_folder(plan.series, table.attributes["study"])
        assembly = Assembly(plan.design.runs, filed=True)
        files.restore(assembly, table)
    except BaseException:
        files.close()
        raise
    text, attributes = table.attributes["study"], table.attributes
    return _SweepRun(plan, text, assembly, files, attributes).run(execution)


def _check_unfinished(path: Path, table: SweepTable) -> None:
    if table.attributes["status"] != "interrupted":
        if not partial_name(path).exists():
            remove_left_over(partial_name(path))
        beside = unfinished_beside(path) or "; there is nothing to resume"
        raise InputError(f"{path}: this sweep is done{beside}")
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
    series, vary = None, study.options.vary
    if study.options.keep_series:
        series = series_folder(whole)
        check_is_series_folder(series_folder(whole_name(path)), table.attributes["study"])
    if not vary or vary.keys() != table.coordinates.keys():
        raise damaged
    levels = tuple(table.coordinates[key].values for key in vary)
    sampling = study.options.sampling
    if sampling is None:
        # Before the values exist, as a crafted study may give any number of them.
        if [_size_of(values) for values in vary.values()] != list(map(len, levels)):
            raise damaged
        design = design_of(vary, study.options.zip)
    else:
        try:
            check_sampling(vary, sampling)
        except InputError:
            raise damaged from None
        if sampling.total(len(vary)) != table.runs or not all(map(_are_numbers, levels)):
            raise damaged
        design = Design(SAMPLE, tuple(vary), levels)
    plan = SweepPlan(study.scenario, design, series)
    made = coordinates_of(plan)
    same = all(np.array_equal(made[key].values, table.coordinates[key].values) for key in made)
    if not same or (design.kind, design.runs) != (table.attributes["design"], table.runs):
        raise damaged
    return plan


def _size_of(values: VariedValues) -> int | None:
    """Return the number of values; a distribution has none."""
    return values.size if isinstance(values, Levels) else None


def _are_numbers(values: Any) -> bool:
    return isinstance(values, np.ndarray) and values.dtype == np.float64


class _InterruptibleProgress(RunMonitor):
    """Ends a sweep at Ctrl-C; shows its progress, as returned by a function."""

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


class _SweepRun:
    """A running or resumed sweep."""

    def __init__(
        self,
        plan: SweepPlan,
        study: str,
        assembly: Assembly,
        files: SweepFiles | None,
        attributes: dict[str, str] | None = None,
    ) -> None:
        self._plan, self._study, self._assembly = plan, study, assembly
        self._files, self._attributes = files, attributes
        self._done = assembly.runs_done
        self._failed = int(np.count_nonzero(assembly.status == FAILED))
        self._checked = self._done

    def run(self, options: ExecutionOptions) -> Sweep:
        """Run the remaining combinations and write the files."""
        files = self._files
        try:
            executor = options.executor(self._plan.design.runs)
            with (
                shown(options.progress) as progress,
                closing(executor),
                self._interruptible(progress) as monitor,
            ):
                check_combinations(
                    executor, self._plan, self._assembly.remaining, self._on_checked, monitor
                )
                if files is None:
                    self._run_remaining(executor, monitor)
                    return Sweep(self._table(), None)
                if self._plan.series is not None:
                    make_series_folder(self._plan.series, self._study)
                files.begin(
                    self._table(
                        f"{RUNNING}; 'frictionsim resume' continues it, including the runs"
                        f" journalled in {journal_name(files.partial).name}"
                    )
                )
                self._run_and_keep(executor, files, monitor)
            return Sweep(self._table(), files.whole)
        finally:
            if files is not None:
                files.close()

    def _run_and_keep(self, executor: Executor, files: SweepFiles, monitor: RunMonitor) -> None:
        """Run the remaining combinations; completed rows are saved on any exit."""
        try:
            self._run_remaining(executor, monitor)
        except BaseException as error:
            executor.close()
            if isinstance(error, InputError) and not self._done and self._attributes is None:
                files.discard()
                raise
            with files.resumable():
                if not self._assembly.remaining:  # the last ones came after the signal
                    files.write_whole(self._table())
                else:
                    self._write_unfinished(files, error)
            if isinstance(error, Interrupted | KeyboardInterrupt):
                number = getattr(error, "signal_number", SIGINT)
                interrupted = SweepInterrupted(number, self._kept(files, error))
                if isinstance(error, Interrupted):
                    raise interrupted from None
                raise KeyboardInterrupt(str(interrupted)) from None
            if isinstance(error, OutputError):
                raise OutputError(f"{error}. {self._kept(files, error)}") from None
            if isinstance(error, SolverError):  # the scheduler of Dask is lost
                lost = SolverError(f"{error}. {self._kept(files, error)}")
                lost.exit_code = EXIT_BUDGET_EXCEEDED
                raise lost from None
            raise
        with files.resumable():
            files.write_whole(self._table())

    def _run_remaining(self, executor: Executor, monitor: RunMonitor) -> None:
        monitor(0.0)
        for block in run_blocks(executor, self._plan, self._assembly.remaining, monitor):
            self._assembly.add(block)
            self._done += block.runs
            self._failed += int(np.count_nonzero(block.status == FAILED))
            if self._files is not None:
                self._files.keep(block)

    def _write_unfinished(self, files: SweepFiles, error: BaseException) -> None:
        how = f"stopped by an error ({type(error).__name__})"
        if isinstance(error, Interrupted | KeyboardInterrupt):
            how = f"interrupted by {Signals(getattr(error, 'signal_number', SIGINT)).name}"
        total = self._plan.design.runs
        files.write_unfinished(self._table(f"{how} after {self._done} of {total} runs"))

    def _kept(self, files: SweepFiles, error: BaseException) -> str:
        total, done = self._plan.design.runs, self._done
        if done == total:
            return f"interrupted, but all {total} runs were done; they are in {files.whole}"
        return (
            f"sweep interrupted: {done} of {total} runs are saved in {files.partial};"
            f" 'frictionsim resume {files.partial}' continues the sweep"
        )

    @contextmanager
    def _interruptible(self, shown: Monitor[SweepProgress]) -> Iterator[RunMonitor]:
        """Return the monitor in whose context Ctrl-C waits for a call, if there is a file."""
        with nullcontext() if self._files is None else StopSignals() as stop:
            yield _InterruptibleProgress(stop, shown, self._progress)

    def _progress(self) -> SweepProgress:
        return SweepProgress(self._done, self._plan.design.runs, self._failed, self._checked)

    def _on_checked(self, count: int) -> None:
        self._checked += count

    def _table(self, reason: str = "") -> SweepTable:
        return self._assembly.table(self._plan, self._study, reason, self._attributes)
