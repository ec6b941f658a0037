"""The runs of a sweep: one with only the samples that its quantities need, and all by workers.

A worker makes as many of the runs that it is given as fit into a third of a second, and returns
the outcomes of these: no duration of a run has to be known, and no block of short runs is long.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager
from math import ceil
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from frictionsim.errors import FrictionsimError, OutputError, WorkerDied
from frictionsim.io.names import partial_name
from frictionsim.io.result_writer import write
from frictionsim.io.sweep_table import RunBlock
from frictionsim.results import failures
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.simulate import RunSummary, run, summary_of_run
from frictionsim.sweeps.design import Design
from frictionsim.sweeps.outcomes import block_of
from frictionsim.sweeps.workers import SECONDS_BETWEEN_TICKS, InProcess, Workers

SECONDS = 0.3  # of a block, which a kill may lose
MOST = 1000  # runs that a worker is given at once
PIECES = 8  # of the runs that are left for each worker, so that all end at about the same time
CHECKED = 64  # combinations between two ticks, which take some milliseconds
NO_MONITOR = RunMonitor()


class Work(NamedTuple):
    """What a worker needs to know of a sweep."""

    combinations: Combinations
    series: Path | None = None  # the folder for the result of each run


def run_some(
    work: Work, first: int, values: Sequence[tuple[Any, ...]], monitor: RunMonitor = NO_MONITOR
) -> RunBlock:
    """Make consecutive runs, of which the first number and the values are given, for some time."""
    until, done = monotonic() + SECONDS, list[RunSummary]()
    for number, of_run in enumerate(values, first):
        done.append(_summary(work, number, of_run, monitor))
        if monotonic() >= until:
            break
    return block_of(first, done)


def _summary(work: Work, number: int, values: tuple[Any, ...], monitor: RunMonitor) -> RunSummary:
    """Run one combination; one that is not valid, or an error of the program, is a failed run."""
    try:
        scenario = work.combinations.scenario(values)
        if work.series is not None:
            return _summary_with_result(scenario, work.series / f"run-{number:07d}.h5", monitor)
        reduced = _without_samples(scenario)
        done = summary_of_run(reduced, monitor)
        if done.status == "failed" and reduced is not scenario:
            done = summary_of_run(scenario, monitor)  # with the samples up to the failure
        return done
    except OutputError:
        raise
    except FrictionsimError as error:
        reason, failure = str(error), getattr(error, "failure", "")
    except Exception as error:  # the study continues, and reports the error of this run
        reason = f"internal error: {type(error).__name__}: {error}".replace("\n", " ")
        failure = "internal_error"
    return RunSummary("failed", reason, failure, (), {}, is_sound=False)


def _summary_with_result(scenario: Scenario, target: Path, monitor: RunMonitor) -> RunSummary:
    """Run a scenario with all its samples, and write its result."""
    done = run(scenario, monitor)
    write(done, target if done.status == "done" else partial_name(target))
    is_sound = not failures(done.checks)
    ended = done.status, done.reason, done.failure
    return RunSummary(*ended, done.warnings, done.quantities, is_sound)


def _without_samples(scenario: Scenario) -> Scenario:
    """Return the scenario that samples start, events and end only, unless it needs samples."""
    if scenario.needs_samples:
        return scenario
    changed = {"interval": scenario.solver.duration, "at_events": True, "checkpoint": None}
    return scenario.model_copy(update={"output": scenario.output.model_copy(update=changed)})


def run_blocks(
    workers: Workers, work: Work, design: Design, remaining: Iterable[range], monitor: RunMonitor
) -> Iterator[RunBlock]:
    """Yield the outcomes of the remaining runs, in any order.

    The monitor is called some times each second, with 0 s; what it raises ends the sweep.

    Raises
    ------
    WorkerDied
        If a worker was killed.
    """
    queue, pending = deque(remaining), dict[Future[RunBlock], range]()
    is_here = isinstance(workers, InProcess)
    steps = (_StepMonitor(monitor),) if is_here else ()
    monitor(0.0)
    try:
        while queue or pending:
            while queue and len(pending) < (1 if is_here else 2 * workers.count):
                runs = _next(queue, workers.count)
                values = design.combinations(runs.start, runs.stop)
                with workers.reporting_deaths():
                    pending[workers.submit(run_some, work, runs.start, values, *steps)] = runs
            for future in wait(pending, SECONDS_BETWEEN_TICKS, FIRST_COMPLETED).done:
                with workers.reporting_deaths():
                    block = future.result()
                if rest := pending.pop(future)[block.runs :]:
                    queue.appendleft(rest)
                yield block
            with workers.reporting_deaths():
                workers.watch()
            monitor(0.0)
    except _SweepStopped as stopped:
        raise stopped.reason from None
    except WorkerDied:
        monitor(0.0)  # a signal to all processes of a group is one to this sweep
        raise


def _next(queue: deque[range], workers: int) -> range:
    """Take the next runs for a worker from those that are left."""
    size = min(ceil(sum(map(len, queue)) / (PIECES * workers)), MOST)
    runs = queue.popleft()
    if rest := runs[size:]:
        queue.appendleft(rest)
    return runs[:size]


class _SweepStopped(BaseException):
    """The end of the sweep within a run, distinct from a failure of the run."""

    def __init__(self, reason: BaseException) -> None:
        super().__init__()
        self.reason = reason


class _StepMonitor(RunMonitor):
    """The monitor of the runs in this process, which calls that of the sweep."""

    def __init__(self, sweep: RunMonitor) -> None:
        self._sweep, self._last = sweep, monotonic()

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        return self._sweep.compiling(expected)

    def __call__(self, t: float, /) -> None:
        if monotonic() - self._last < SECONDS_BETWEEN_TICKS:
            return
        self._last = monotonic()
        try:
            self._sweep(0.0)
        except BaseException as error:
            raise _SweepStopped(error) from None


def check_combinations(
    combinations: Combinations, design: Design, remaining: Iterable[range]
) -> Iterator[int]:
    """Check the combinations of runs; yield the numbers of those checked since the last one.

    Raises
    ------
    InputError
        For the first one that is not valid.
    """
    for runs in remaining:
        for first in range(runs.start, runs.stop, CHECKED):
            values = design.combinations(first, min(first + CHECKED, runs.stop))
            for of_run in values:
                combinations.scenario(of_run)
            yield len(values)


def remaining_runs(total: int, done: Iterable[RunBlock]) -> list[range]:
    """Return the runs that have no outcome yet, in ascending order."""
    ranges = sorted((block.first, block.first + block.runs) for block in done)
    starts = [0, *(stop for _, stop in ranges)]
    stops = [*(start for start, _ in ranges), total]
    return [range(a, b) for a, b in zip(starts, stops, strict=True) if a < b]
