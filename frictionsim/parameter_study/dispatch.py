"""Gives the runs of a sweep to an executor in blocks, and repeats those whose worker died.

Blocks take some tenths of a second. When a worker dies, the block that caused it is unknown: all
blocks in progress are run again at the end, each without other jobs. One that is lost then, too, is
halved, down to the run that kills its workers, which has failed.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from math import ceil
from pathlib import Path
from time import monotonic, perf_counter
from typing import Any, NamedTuple, Protocol

from frictionsim.errors import InputError, Interrupted
from frictionsim.parameter_study.block import FAILED, RunBlock, RunOutcome, block_of
from frictionsim.parameter_study.single_run import NO_MONITOR, Task, run_task
from frictionsim.parameter_study.sweep import SweepPlan
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor

CHECK, RUN = "check", "run"
MIN_CHECKED = 64  # combinations, which take some milliseconds
SECONDS_OF_LOCAL_CHECKS = 0.1  # in this process, before workers are started
SECONDS_BETWEEN_TICKS = 0.1
SECONDS_FOR_THE_LAST = 1.0  # for blocks in progress when a sweep is interrupted
WORKER_DIED = "worker_died"

MAX_RUNS_OF_A_BLOCK = 4096
MAX_TOGETHER = 2000  # runs in a block that are observed together
GROWTH = 4
# Of a run: longer runs are run alone, so that the smallest block takes no more than seconds.
MAX_SECONDS_TOGETHER = 0.06

JobResult = tuple[float, RunBlock | None]
"""The seconds that a job took, and the outcomes of its runs; None of a check."""


class Executor(Protocol):
    """Does jobs in this process or in others: `concurrent.futures` with the needs of a sweep."""

    seconds_of_a_block: float  # target length; 0 for single runs
    ahead: int  # jobs for each worker while blocks are short: one in progress, the others queued

    @property
    def count(self) -> int:
        """The number of simultaneous jobs."""

    def start(self, plan: SweepPlan, monitor: RunMonitor) -> None:
        """Prepare for the jobs of a sweep; the monitor is called during jobs done in `submit`."""

    def submit(self, kind: str, task: Task) -> "Future[JobResult]":
        """Queue a job, which is a call of `do_job`."""

    def watch(self) -> None:
        """Check that the workers are alive; called some times each second."""

    def crash(self, error: Exception) -> str:
        """Return how a worker died if its death caused this error; else an empty text."""

    def close(self) -> None:
        """End the workers, even during a job."""


def do_job(
    combinations: Combinations,
    kind: str,
    task: Task,
    series: Path | None,
    monitor: RunMonitor = NO_MONITOR,
) -> JobResult:
    """Check the combinations of a task, or run them."""
    started, block = perf_counter(), None
    if kind == CHECK:
        combinations.check(task.values)
    else:
        block = run_task(combinations, task, series, monitor)
    return perf_counter() - started, block


class BlockSizes:
    """The size of the next block of the remaining runs, from the durations of earlier ones.

    A block should take `seconds`: long enough that sending it costs little, short against a sweep.
    From `together` runs on, a block is faster than single runs; 1 if none is.
    """

    def __init__(self, seconds: float, remaining: int, together: int = 1) -> None:
        self._block, self._remaining, self._together = seconds, remaining, together
        self._runs, self._seconds = 0, 0.0  # size of the last representative block, time of a run

    def learn(self, runs: int, seconds: float) -> None:
        """Record the duration of a block."""
        if self._together > 1 and 2 * runs < self._runs:
            return  # runs in small blocks cost more
        self._runs, self._seconds = runs, max(seconds / runs, 1e-7)

    def next(self, workers: int) -> int:
        """Return the size of the next block; 1 until a duration is known."""
        if not self._seconds:
            return 1
        wanted = int(self._block / self._seconds)
        if self._together > 1 and self._seconds <= MAX_SECONDS_TOGETHER:
            return self._next_together(wanted, workers)
        return max(1, min(wanted, self._fair(workers), MAX_RUNS_OF_A_BLOCK))

    def _next_together(self, wanted: int, workers: int) -> int:
        # Four times as many runs together take less than four times as long.
        if self._runs * self._seconds < 2.0 * self._block:
            wanted = max(wanted, GROWTH * self._runs)
        fair = max(self._fair(workers), GROWTH * self._together)  # small ones do not pay
        size = max(self._together, min(wanted, fair, MAX_TOGETHER))
        return size if self._remaining - size >= self._together else max(self._remaining, 1)

    def _fair(self, workers: int) -> int:
        """Return a decreasing size, so that all workers finish at the same time."""
        return ceil(self._remaining / (2 * workers)) if workers > 1 else self._remaining

    def dispatch(self, runs: int) -> None:
        """Take note of runs that go out."""
        self._remaining -= runs

    @property
    def are_short(self) -> bool:
        """Whether blocks run close to the target time, so that one may be queued ahead."""
        return 0.0 < self._seconds < 2.0 * self._block


class Ticker:
    """Calls a monitor at most every `SECONDS_BETWEEN_TICKS`."""

    def __init__(self, monitor: RunMonitor) -> None:
        self._monitor, self._last = monitor, monotonic()

    def __call__(self) -> None:
        now = monotonic()
        if now - self._last >= SECONDS_BETWEEN_TICKS:
            self._last = now
            self._monitor(0.0)


class _RunRange(NamedTuple):
    """Runs from `first` up to `stop`."""

    first: int
    stop: int
    alone: bool = False
    """Whether no other job is in progress that could have killed its worker."""


class _Answer(NamedTuple):
    """The outcomes of a job, the error that ended it, or how its worker died each time."""

    job: _RunRange
    block: RunBlock | None = None
    error: Exception | None = None
    crash: str = ""


class _Dispatch:
    """The jobs of a sweep: the remaining ones, and those in progress."""

    def __init__(
        self,
        executor: Executor,
        plan: SweepPlan,
        kind: str,
        remaining: Iterable[range],
        together: int,
    ) -> None:
        self._executor, self._plan, self._kind = executor, plan, kind
        self._ranges = deque(remaining)
        self._sizes = BlockSizes(executor.seconds_of_a_block, sum(map(len, self._ranges)), together)
        self._lost: deque[_RunRange] = deque()  # whose workers died
        self._pending: dict[Future[JobResult], _RunRange] = {}

    def stop(self) -> None:
        """Give out no more jobs."""
        self._ranges.clear()
        self._lost.clear()

    def answers(self, ticker: Ticker) -> Iterator[_Answer]:
        """Yield the answers to all jobs, in any order."""
        while self._fill():
            wait(self._pending, SECONDS_BETWEEN_TICKS, FIRST_COMPLETED)
            yield from self._collected()
            self._executor.watch()
            ticker()

    def drain(self, seconds: float) -> Iterator[_Answer]:
        """Yield the answers to the jobs in progress that come within some seconds."""
        self.stop()
        latest = monotonic() + seconds
        while self._pending and monotonic() < latest:
            wait(self._pending, max(latest - monotonic(), 0.0), FIRST_COMPLETED)
            yield from self._collected()

    def _fill(self) -> bool:
        """Submit jobs while workers are free; return whether any are in progress."""
        # A long block should not queue behind another long one.
        ahead = self._executor.ahead if self._sizes.are_short else 1
        while len(self._pending) < self._executor.count * ahead:
            job = self._next()
            if job is None:
                break
            values = self._plan.design.combinations(job.first, job.stop)
            self._pending[self._executor.submit(self._kind, Task(job.first, values))] = job
        return bool(self._pending)

    def _next(self) -> _RunRange | None:
        """Return the next job; None if there is none now. Those lost run last, one at a time."""
        if self._ranges:
            runs = self._ranges.popleft()
            stop = min(runs.start + self._sizes.next(self._executor.count), runs.stop)
            if stop < runs.stop:
                self._ranges.appendleft(range(stop, runs.stop))
            self._sizes.dispatch(stop - runs.start)
            return _RunRange(runs.start, stop)
        if self._lost and not self._pending:
            return self._lost.popleft()._replace(alone=True)
        return None

    def _collected(self) -> Iterator[_Answer]:
        # Until none is done, to collect all jobs of a broken pool before the next one is opened.
        while done := [future for future in self._pending if future.done()]:
            for future in done:
                job = self._pending.pop(future)
                try:
                    seconds, block = future.result()
                except Exception as error:
                    crash = self._executor.crash(error)
                    if not crash:
                        yield _Answer(job, error=error)
                    elif job.alone and job.stop - job.first == 1:
                        yield _Answer(job, crash=crash)
                    else:
                        self._run_again(job)
                else:
                    self._sizes.learn(job.stop - job.first, seconds)
                    yield _Answer(job, block)

    def _run_again(self, job: _RunRange) -> None:
        """Queue a job whose worker died; one that killed it is halved."""
        middle = (job.first + job.stop) // 2 if job.alone else job.stop
        parts = (job.first, middle), (middle, job.stop)
        self._lost += [_RunRange(first, stop) for first, stop in parts if first < stop]


def run_blocks(
    executor: Executor, plan: SweepPlan, remaining: Iterable[range], monitor: RunMonitor
) -> Iterator[RunBlock]:
    """Yield the outcomes of the remaining runs, given in ascending order, in any order.

    The monitor is called some times each second, with 0 s. If it raises `Interrupted` or
    KeyboardInterrupt, the blocks that end within a second are yielded before it is raised again.
    """
    executor.start(plan, monitor)
    dispatch = _Dispatch(executor, plan, RUN, remaining, plan.together)
    try:
        for answer in dispatch.answers(Ticker(monitor)):
            yield _block(answer)
    except (Interrupted, KeyboardInterrupt):
        yield from map(_block, dispatch.drain(SECONDS_FOR_THE_LAST))
        raise


def _block(answer: _Answer) -> RunBlock:
    if answer.error is not None:
        raise answer.error from None
    if answer.block is not None:
        return answer.block
    reason = f"the worker process crashed in this run every time ({answer.crash})"
    return block_of(answer.job.first, [(0, RunOutcome(FAILED, {}, WORKER_DIED, reason))])


def check_combinations(
    executor: Executor,
    plan: SweepPlan,
    remaining: Iterable[range],
    on_checked: Callable[[int], Any],
    monitor: RunMonitor,
) -> None:
    """Check the combinations of runs, the first ones in this process, as most sweeps are small.

    `on_checked` is called with the number of newly checked combinations; the other parameters are
    those of `run_blocks`.
    """
    ranges, combinations, ticker = deque(remaining), plan.combinations, Ticker(monitor)
    latest, size = monotonic() + SECONDS_OF_LOCAL_CHECKS, MIN_CHECKED
    while ranges and monotonic() < latest:
        ticker()
        runs = ranges.popleft()
        if len(runs) > size:
            ranges.appendleft(runs[size:])
            runs = runs[:size]
        combinations.check(plan.design.combinations(runs.start, runs.stop))
        on_checked(len(runs))
        size = min(2 * size, MAX_RUNS_OF_A_BLOCK)
    if ranges:
        executor.start(plan, monitor)
        _check_the_rest(_Dispatch(executor, plan, CHECK, ranges, MIN_CHECKED), on_checked, ticker)


def _check_the_rest(dispatch: _Dispatch, on_checked: Callable[[int], Any], ticker: Ticker) -> None:
    faults: dict[int, Exception] = {}
    for answer in dispatch.answers(ticker):
        if answer.crash:
            raise InputError(
                f"run {answer.job.first}: the worker process crashed while its values were checked"
                f" ({answer.crash})"
            )
        if answer.error is not None:
            # Earlier jobs are in progress already, so the first fault is among their answers.
            faults[answer.job.first] = answer.error
            dispatch.stop()
        else:
            on_checked(answer.job.stop - answer.job.first)
    if faults:
        raise faults[min(faults)] from None
