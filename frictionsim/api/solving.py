"""Simulation of scenarios from Python: solve and resume."""

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager
from os import PathLike
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from frictionsim.api.result import Result, checkpoint_of
from frictionsim.api.scenarios import with_overrides
from frictionsim.errors import InputError, OutputError, SolverError
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.options import Options, function_of
from frictionsim.scenario.schema import unit_field
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation.monitor import (
    Monitors,
    RunMonitor,
    StopSignals,
    WallTimeLimit,
    monitor_of,
)
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from frictionsim.io.run_files import RunFiles
    from frictionsim.results import Record
    from frictionsim.scenario.overrides import Overrides

LOG = logging.getLogger(__name__)

OnTime = bool | Callable[[float], Any]


class RunOptions(Options):
    """The arguments of `solve` and `resume` beside the run and its file."""

    no_clobber: bool = False
    max_wall: float | None = unit_field("s", "Wall time.", None, gt=0, allow_inf_nan=True)
    max_steps: int | None = Field(None, gt=0)
    estimate_error: bool = False
    progress: Annotated[Any, function_of("the time", switch=True)] = False
    check: bool = False
    since: float = Field(default_factory=perf_counter)  # what `max_wall` counts from


def solve(
    scenario: Scenario | ScenarioSource,
    overrides: "Overrides | None" = None,
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    max_wall: float | None = None,
    max_steps: int | None = None,
    estimate_error: bool = False,
    progress: OnTime = False,
    check: bool = False,
) -> Result:
    """Simulate a scenario.

    Parameters
    ----------
    scenario : Scenario, path or mapping
        As for `load`.
    overrides : mapping or iterable of str, optional
        As for `load`: ``{"effects.shaft_friction.mu_s": 0.3}``.
    output : path, optional
        File to write the result to, NAME.h5. Until the run is done, and if it fails or is
        interrupted, it is in NAME.partial.h5: `Result.path` says where it is. A logged warning
        tells of a result of other values that it replaces. Ctrl-C stops a run with an output
        after its step, writes the samples so far and raises KeyboardInterrupt.
    no_clobber : bool
        Do not replace an existing file.
    max_wall : float, optional, s
        Limit of the wall time, from the call on. A run that reaches it is `failed` and can be
        resumed, except with SciPy's methods. It is checked before the first step and between
        steps, but does not interrupt the assembly of a large belt, a compilation of kernels or the
        writing of the result.
    max_steps : int, optional
        Limit of steps, instead of `solver.max_steps`. It is not recorded: the run can be resumed
        as after `max_wall`, and its file is that of an unlimited run.
    estimate_error : bool
        Solve a second time, more accurately, for `Result.errors`; a belt of a short run once more,
        on a finer mesh.
    progress : bool or callable
        True shows a progress bar on a terminal, after a second. A callable is called with the
        simulated time, s, after each step; if it raises `frictionsim.Interrupted()`, the run stops
        and can be resumed.
    check : bool
        Raise the error of a run that failed or whose self-audit failed, as `Result.check` does.

    Returns
    -------
    Result
        A failed run has a result, too, with the samples up to the failure.

    Raises
    ------
    InputError, ScenarioError
        If the scenario or an argument is not valid.
    OutputError
        If the result cannot be written.
    SolverError, AuditError
        Only with `check`.
    """
    options = RunOptions.among(locals())
    loaded = with_overrides(scenario, overrides)
    files = _files(output, None, options.no_clobber)
    result = _simulate(loaded, files, options)
    return result.check() if options.check else result


def resume(
    result: Result | str | PathLike[str],
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    max_wall: float | None = None,
    max_steps: int | None = None,
    progress: OnTime = False,
    check: bool = False,
) -> Result:
    """Resume an interrupted run; the result is bit-identical to that of an uninterrupted run.

    Parameters
    ----------
    result : Result or path
        An incomplete result.
    output : path, optional
        File to write to, NAME.h5; by default that of the NAME.partial.h5 that is resumed, which is
        removed when the run is done. A `Result` that is in no file is not written.
    no_clobber, max_wall, max_steps, progress, check
        As for `solve`, for this part of the run; the resumed file is always replaced.

    Raises
    ------
    InputError
        If the run cannot be resumed.
    OutputError
        If the result cannot be written.
    SolverError, AuditError
        Only with `check`.
    """
    from frictionsim.api.opening import file_to_resume
    from frictionsim.io.names import whole_name

    options = RunOptions.among(locals())
    incomplete: Result | None
    if isinstance(result, Result):
        incomplete = result
    else:
        incomplete = file_to_resume(as_path("result", result))[1]
    if incomplete is None:
        raise InputError(f"{result}: this is a sweep; frictionsim.resume_sweep continues it")
    state = checkpoint_of(incomplete)
    scenario, path = incomplete.scenario, incomplete.path
    if output is None and path is not None:
        output = whole_name(path)
    files = _files(output, path, options.no_clobber)
    resumed = "this result" if path is None else str(path)
    done = _simulate(scenario, files, options, state, resumed)
    return done.check() if options.check else done


def _files(
    output: str | PathLike[str] | None, resumed: Path | None, no_clobber: bool
) -> "RunFiles | None":
    if output is None:
        return None
    # Imported here because a run without a file does not need h5py.
    from frictionsim.io.run_files import RunFiles

    files = RunFiles(as_path("output", output), resumed)
    files.check(no_clobber)
    return files


def _simulate(
    scenario: Scenario,
    files: "RunFiles | None",
    options: RunOptions,
    state: dict[str, Any] | None = None,
    resumed: str = "",
) -> Result:
    # Without a file an interrupted run cannot be saved: Ctrl-C raises at once.
    stop = None if files is None else StopSignals()
    estimate = None
    try:
        with _monitor(stop, options, scenario) as monitor:
            done = run(scenario, monitor, _checkpoint_writer(files), state, options.max_steps)
            path = None if files is None else files.write_last(done)
            if options.estimate_error and done.status == "done":
                from frictionsim.costs.error_estimate import estimate as estimate_errors

                estimate = estimate_errors(scenario, done, monitor, options.max_steps)
    except _ProgressFailed as failed:
        raise failed.__cause__ or failed from None
    except InputError as error:
        if resumed:
            raise InputError(f"{resumed}: cannot resume this run: {error}") from None
        raise
    if stop is not None and stop.received:
        raise KeyboardInterrupt(f"run {done.status}; its samples are in {path}")
    return Result(done, path, scenario, estimate)


def _monitor(stop: StopSignals | None, options: RunOptions, scenario: Scenario) -> Monitors[float]:
    """Return the monitor of a run: interruption, progress and limit of the wall time."""
    parts: list[RunMonitor] = [] if stop is None else [stop]
    duration = scenario.solver.duration
    if callable(options.progress):
        parts.append(_ProgressFunction(options.progress))
    elif options.progress:
        from frictionsim.api.progress import RunProgress

        parts.append(RunProgress(duration))
    if (most := options.max_wall) is not None:
        parts.append(WallTimeLimit(most, duration, scenario.budget_advice, options.since))
    return Monitors(*parts)


class _ProgressFailed(Exception):
    """An error of the user's function, not of the run."""


class _ProgressFunction(RunMonitor):
    """A function of the user, or a monitor, whose errors differ in class from those of the run.

    But SolverError, which ends a run that is kept.
    """

    def __init__(self, progress: Callable[[float], Any]) -> None:
        self._progress = monitor_of(progress)

    def __call__(self, t: float, /) -> None:
        try:
            self._progress(t)
        except SolverError:
            raise
        except Exception as error:
            raise _ProgressFailed from error

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        return self._progress.compiling(expected)


def _checkpoint_writer(files: "RunFiles | None") -> "Callable[[Record], bool] | None":
    """Return the callback that writes checkpoints; a failed write only warns, once."""
    if files is None:
        return None
    reported: set[str] = set()

    def write(part: "Record") -> bool:
        try:
            files.write(part)
        except (OutputError, MemoryError) as error:
            text = str(error) or "there is not enough memory"
            if text not in reported:
                LOG.warning("checkpoint not written: %s", text)
            reported.add(text)
            return False
        return True

    return write
