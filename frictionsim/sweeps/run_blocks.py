"""Gives the runs of a sweep to workers, and collects their outcomes.

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

from frictionsim.errors import WorkerDied
from frictionsim.io.sweep_table import RunBlock
from frictionsim.simulation.combinations import Combinations, combination_text
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.sweeps.design import Design
from frictionsim.sweeps.outcomes import block_of
from frictionsim.sweeps.single_run import DIGITS, NO_MONITOR, outcome_of
from frictionsim.sweeps.workers import IDLE, InProcess, Workers, note_current

SECONDS = 0.3  # of a block, which a kill may lose
SECONDS_BETWEEN_TICKS = 0.1
MOST = 1000  # runs that a worker is given at once
PIECES = 8  # of the runs that are left for each worker, so that all end at about the same time
CHECKED = 64  # combinations between two ticks, which take some milliseconds


class Work(NamedTuple):
    """What a worker needs to know of a sweep."""

    combinations: Combinations
    series: Path | None = None  # the folder for the result of each run


def run_some(
    work: Work, first: int, values: Sequence[tuple[Any, ...]], monitor: RunMonitor = NO_MONITOR
) -> RunBlock:
    """Make consecutive runs, of which the first number and the values are given, for some time."""
    until, outcomes = monotonic() + SECONDS, []
    for number, of_run in enumerate(values, first):
        note_current(number)
        target = work.series and work.series / f"run-{number:0{DIGITS}d}.h5"
        outcomes.append(outcome_of(work.combinations, of_run, target, monitor))
        if monotonic() >= until:
            break
    note_current(IDLE)
    return block_of(first, outcomes)


def run_blocks(
    workers: Workers, work: Work, design: Design, remaining: Iterable[range], monitor: RunMonitor
) -> Iterator[RunBlock]:
    """Yield the outcomes of the remaining runs, in any order.

    The monitor is called some times each second, with 0 s; what it raises ends the sweep.

    Raises
    ------
    WorkerDied
        If a worker was killed, with the values of the runs that were in progress.
    """
    queue, pending = deque(remaining), dict[Future[RunBlock], range]()
    steps = (_StepMonitor(monitor),) if isinstance(workers, InProcess) else ()
    monitor(0.0)
    try:
        while queue or pending:
            while queue and len(pending) < workers.capacity:
                runs = _next(queue, workers.count)
                values = design.combinations(runs.start, runs.stop)
                pending[workers.submit(run_some, work, runs.start, values, *steps)] = runs
            for future in wait(pending, SECONDS_BETWEEN_TICKS, FIRST_COMPLETED).done:
                block = future.result()
                if rest := pending.pop(future)[block.runs :]:
                    queue.appendleft(rest)
                yield block
            workers.watch()
            monitor(0.0)
    except _SweepStopped as stopped:
        raise stopped.reason from None
    except workers.deaths as error:
        monitor(0.0)  # a signal to all processes of a group is one to this sweep
        named = _in_progress(workers, design, pending.values())
        raise WorkerDied(f"{workers.death(error)}; in progress: {named}") from None


def _next(queue: deque[range], workers: int) -> range:
    """Take the next runs for a worker from those that are left."""
    size = min(ceil(sum(map(len, queue)) / (PIECES * workers)), MOST)
    runs = queue.popleft()
    if rest := runs[size:]:
        queue.appendleft(rest)
    return runs[:size]


def _in_progress(workers: Workers, design: Design, pending: Iterable[range]) -> str:
    """Return the numbers and values of the runs in progress, or of those that were given out."""
    current = workers.current_runs()
    given = pending if current is None else [range(run, run + 1) for run in current]
    texts = []
    for runs in sorted(given, key=lambda runs: runs.start):
        (values,) = design.combinations(runs.start, runs.start + 1)
        named = combination_text(dict(zip(design.keys, values, strict=True)))
        many = f"runs {runs.start} to {runs.stop - 1} (from {named})"
        texts.append(many if len(runs) > 1 else f"run {runs.start} ({named})")
    return ", ".join(texts) or "none"


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
