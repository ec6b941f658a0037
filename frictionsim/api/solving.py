"""Simulation of scenarios from Python: solve and resume."""

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager
from os import PathLike
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from frictionsim.api.result import Result, file_to_resume
from frictionsim.api.scenarios import with_overrides
from frictionsim.errors import FrictionsimError, InputError, OutputError
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.options import Options, as_path, function_of
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

ProgressOption = bool | Callable[[float], Any]
"""Whether to show a progress bar on stderr; or a function that is called with the time."""


def solve(
    scenario: Scenario | ScenarioSource,
    overrides: "Overrides | None" = None,
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    max_wall: float | None = None,
    max_steps: int | None = None,
    estimate_error: bool = False,
    progress: ProgressOption = False,
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
        Solve a second time, more accurately, for `Result.errors`.
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
    since = perf_counter()
    options = RunOptions.of(
        no_clobber=no_clobber,
        max_wall=max_wall,
        max_steps=max_steps,
        estimate_error=estimate_error,
        progress=progress,
        check=check,
    )
    loaded = with_overrides(scenario, overrides)
    return _simulate(loaded, _files(output, None), options, since, None)


def resume(
    result: Result | str | PathLike[str],
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    max_wall: float | None = None,
    max_steps: int | None = None,
    progress: ProgressOption = False,
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
    from frictionsim.io.names import whole_name

    since = perf_counter()
    options = RunOptions.of(
        no_clobber=no_clobber,
        max_wall=max_wall,
        max_steps=max_steps,
        progress=progress,
        check=check,
    )
    incomplete = (
        result if isinstance(result, Result) else file_to_resume(as_path("result", result))[1]
    )
    if incomplete is None:
        raise InputError(f"{result}: this is a sweep; frictionsim.resume_sweep continues it")
    state = incomplete.load_checkpoint()
    scenario, path = incomplete.scenario, incomplete.path
    if output is None and path is not None:
        output = whole_name(path)
    try:
        return _simulate(scenario, _files(output, path), options, since, state)
    except InputError as error:
        name = "this result" if path is None else path
        raise InputError(f"{name}: cannot resume this run: {error}") from None


class RunOptions(Options):
    """The limits and the progress display of a run, and the actions after it."""

    no_clobber: bool = False
    max_wall: float | None = unit_field("s", "Limit of wall time.", None, gt=0, allow_inf_nan=True)
    max_steps: int | None = Field(None, gt=0)
    estimate_error: bool = False
    progress: Annotated[Any, function_of("the time", "True, False or ")] = False
    check: bool = False


def _files(output: str | PathLike[str] | None, resumed: Path | None) -> "RunFiles | None":
    if output is None:
        return None
    # Imported here because a run without a file does not need h5py.
    from frictionsim.io.run_files import RunFiles

    return RunFiles(as_path("output", output), resumed)


def _simulate(
    scenario: Scenario,
    files: "RunFiles | None",
    options: RunOptions,
    since: float,
    state: dict[str, Any] | None,
) -> Result:
    # Without a file an interrupted run cannot be saved: Ctrl-C raises at once.
    stop = None if files is None else StopSignals()
    with _monitor(options, since, scenario, stop) as monitor:
        if files is not None:
            files.check(options.no_clobber)
        try:
            write, steps = _checkpoint_writer(files), options.max_steps
            done = run(scenario, monitor, write, state, steps)
        except _ProgressFailed as failed:
            raise failed.__cause__ or failed from None
        path = None if files is None else files.write_last(done)
        estimate = None
        if options.estimate_error and done.status == "done":
            from frictionsim.costs.error_estimate import estimate as estimate_errors

            estimate = estimate_errors(scenario, done, monitor, steps)
    if stop is not None and stop.received:
        raise KeyboardInterrupt(f"run {done.status}; its samples are in {path}")
    result = Result(done, path, scenario, estimate)
    return result.check() if options.check else result


def _monitor(
    options: RunOptions, since: float, scenario: Scenario, stop: StopSignals | None
) -> Monitors[float]:
    """Return the monitor of a run: interruption, progress and limit of the wall time."""
    parts: list[RunMonitor] = [] if stop is None else [stop]
    duration = scenario.solver.duration
    if callable(options.progress):
        parts.append(_ProgressFunction(options.progress))
    elif options.progress:
        from frictionsim.api.progress import Announcements, RunProgress

        parts += [Announcements(), RunProgress(duration)]
    if options.max_wall is not None:
        parts.append(WallTimeLimit(options.max_wall, duration, scenario.budget_advice, since))
    return Monitors(*parts)


class _ProgressFailed(Exception):
    """An error of the user's function, not of the run."""


class _ProgressFunction(RunMonitor):
    """A function of the user, or a monitor, whose errors differ in class from those of the run."""

    def __init__(self, progress: Callable[[float], Any]) -> None:
        self._progress = monitor_of(progress)

    def __call__(self, t: float, /) -> None:
        try:
            self._progress(t)
        except FrictionsimError:
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
