"""Executors of a sweep on this machine: this process alone, or a pool of others.

A worker is a copy of this process (`fork`, some ms) if that is safe, else a new interpreter. It
ends with this process, however that ends.
"""

import gc
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cache
from multiprocessing import current_process, get_context, parent_process
from pathlib import Path
from time import monotonic
from typing import Any, NoReturn

from frictionsim.errors import FrictionsimError, InputError
from frictionsim.parameter_study.dispatch import Executor, JobResult, Ticker, do_job
from frictionsim.parameter_study.single_run import Task
from frictionsim.parameter_study.sweep import SweepPlan
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor

SECONDS_OF_A_BLOCK = 0.3  # work that a kill may lose
STEPS_BETWEEN_TICKS = 256  # reading the clock costs a tenth of a step
MAX_STILLBORN = 3  # pools whose workers end before their first job; one may be killed from outside
SECONDS_TO_BREAK = 1.0  # after the death of a worker
ENDED_LATER = (-9, -15, 0)  # exit codes of workers that were ended with another one
# A terminal sends these to all of its processes; the parent handles them.
PARENT_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)]


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def local_executor(workers: int, runs: int) -> Executor:
    """Return the executor of a sweep on this machine; one worker is this process."""
    # A daemon of `multiprocessing` may not have children.
    if min(workers, runs) < 2 or current_process().daemon:
        return InProcess()
    return ProcessPool(min(workers, runs))


class InProcess:
    """An `Executor` without other processes: a job is done when it is submitted."""

    count, ahead = 1, 1

    def __init__(self) -> None:
        self.seconds_of_a_block = 0.0

    def start(self, plan: SweepPlan, monitor: RunMonitor) -> None:
        """Prepare for the runs of a sweep."""
        self.seconds_of_a_block = SECONDS_OF_A_BLOCK if plan.together > 1 else 0.0
        self._combinations, self._series = plan.combinations, plan.series
        self._monitor = _RunsMonitor(monitor)

    def submit(self, kind: str, task: Task) -> "Future[JobResult]":
        """Do a job."""
        future: Future[JobResult] = Future()
        try:
            future.set_result(do_job(self._combinations, kind, task, self._series, self._monitor))
        except _SweepStopped as stopped:
            raise stopped.reason from None
        except Exception as error:
            future.set_exception(error)
        return future

    def watch(self) -> None:
        """Do nothing."""

    def crash(self, error: Exception) -> str:
        """Return that no worker has died."""
        return ""

    def close(self) -> None:
        """Do nothing."""


class _SweepStopped(BaseException):
    """The end of the sweep within a run, distinct from a failure of the run."""

    def __init__(self, reason: BaseException) -> None:
        super().__init__()
        self.reason = reason


class _RunsMonitor(RunMonitor):
    """The monitor of all runs of a sweep, which calls that of the sweep."""

    def __init__(self, monitor: RunMonitor) -> None:
        self._ticker, self._calls = Ticker(monitor), 0
        self._sweep = monitor

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        return self._sweep.compiling(expected)

    def __call__(self, t: float, /) -> None:
        self._calls += 1
        if self._calls % STEPS_BETWEEN_TICKS:
            return
        try:
            self._ticker()
        except BaseException as error:
            raise _SweepStopped(error) from None


class ProcessPool:
    """An `Executor` with worker processes, started on demand."""

    seconds_of_a_block, ahead = SECONDS_OF_A_BLOCK, 2

    def __init__(self, count: int) -> None:
        self.count = count
        self._plan: SweepPlan | None = None
        self._pool: ProcessPoolExecutor | None = None
        self._ready: Future[None] = Future()
        self._stillborn, self._cause, self._died = 0, "", 0.0

    def start(self, plan: SweepPlan, monitor: RunMonitor) -> None:
        """Prepare for the runs of a sweep: compile its kernels once, before the workers start."""
        if self._plan is plan:
            return
        self.close()
        self._plan = plan
        combinations, (first,) = plan.combinations, plan.design.combinations(0, 1)
        with suppress(FrictionsimError, ArithmeticError):  # the run will raise it again
            form = combinations.form(first) if plan.together > 1 else None
            if form is not None:
                form.compiled(monitor)
                return
            scenario = combinations.scenario(first)
            mechanism_module(scenario.kind).simulation(scenario).prepare(monitor)

    def submit(self, kind: str, task: Task) -> "Future[JobResult]":
        """Submit a job to the pool."""
        if self._pool is None:
            self._open()
        return self._submitted(_do_job, kind, task)

    def _open(self) -> None:
        assert self._plan is not None
        context = get_context("fork" if may_fork() else "spawn")
        work = self._plan.combinations, self._plan.series
        self._pool = ProcessPoolExecutor(self.count, context, _begin, work)
        self._died = 0.0
        self._ready = self._submitted(_say_ready)

    def _submitted(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        assert self._pool is not None
        try:
            with warnings.catch_warnings(), signals_blocked():
                # Python 3.12 warns of any threads, even those of numpy's linear algebra.
                warnings.simplefilter("ignore", DeprecationWarning)
                return self._pool.submit(function, *arguments)
        except BrokenProcessPool as error:
            broken: Future[Any] = Future()
            broken.set_exception(error)
            return broken

    def watch(self) -> None:
        """End a pool that does not break although a worker is dead.

        A pool of `concurrent.futures` waits for the rest of the answer of a worker that died while
        sending it.
        """
        if all(process.is_alive() for process in self._processes()):
            self._died = 0.0
        elif not self._died:
            self._died = monotonic()
        elif monotonic() - self._died > SECONDS_TO_BREAK:
            self._end()

    def crash(self, error: Exception) -> str:
        """Return how a worker died, if one did; another pool is opened for the next job."""
        if not isinstance(error, BrokenProcessPool):
            return ""
        if self._pool is not None:
            self._cause = self._end()
            begun = self._ready.done() and self._ready.exception() is None
            self._stillborn = 0 if begun else self._stillborn + 1
            if self._stillborn >= MAX_STILLBORN:
                raise InputError(
                    f"no worker process can be started (it ended with {self._cause}); a script of"
                    " Python needs \"if __name__ == '__main__':\" around what it does, or workers=1"
                )
        return self._cause

    def close(self) -> None:
        """End the workers, whatever they do."""
        self._end()
        self._plan = None

    def _processes(self) -> list[Any]:
        # Python 3.14 has `kill_workers`, but no exit codes of workers.
        return list((getattr(self._pool, "_processes", None) or {}).values())

    def _end(self) -> str:
        """Kill the workers; return how the first one ended, unless it ended with the others."""
        pool, processes, self._pool = self._pool, self._processes(), None
        if pool is None:
            return ""
        for process in processes:
            process.kill()
        # The pool waits for the rest of an answer while its queue has a writer.
        with suppress(AttributeError, OSError):
            pool._result_queue._writer.close()  # type: ignore[attr-defined]
        pool.shutdown(cancel_futures=True)
        codes = [process.exitcode for process in processes if process.exitcode is not None]
        # The pool has sent SIGTERM to the others, and this SIGKILL.
        code = min(codes, key=lambda one: ENDED_LATER.index(one) if one in ENDED_LATER else -1)
        if code < 0:
            with suppress(ValueError):
                return signal.Signals(-code).name
        return f"exit code {code}"


def may_fork() -> bool:
    """Return whether a copy of this process is safe: another thread may hold a lock."""
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return False
    return threading.active_count() == 1 or not sys.executable


@contextmanager
def signals_blocked() -> Iterator[None]:
    """Block signals while workers start: `_isolate` makes them ignore `PARENT_SIGNALS`.

    Until then these signals wait, in the worker and in this process.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [*PARENT_SIGNALS, signal.SIGTERM])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_work: list[tuple[Combinations, Path | None]] = []
"""In a worker: the combinations of the sweep, and the folder for the results of the runs."""


def _begin(combinations: Combinations, series: Path | None) -> None:
    """Prepare a worker."""
    _isolate()
    use_one_thread_of_linear_algebra()
    _work[:] = [(combinations, series)]


def _say_ready() -> None:
    """Tell the pool that a worker has begun."""


def _do_job(kind: str, task: Task) -> JobResult:
    ((combinations, series),) = _work
    return do_job(combinations, kind, task, series)


@cache
def use_one_thread_of_linear_algebra() -> None:
    """Limit libraries of linear algebra to one thread each; the workers share the cores."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)


def _isolate() -> None:
    """Detach this process from the parent's signal handlers, and end it with the parent."""
    # Garbage collection is off in the command line, which ends soon; a worker may run for days.
    gc.freeze()
    gc.enable()
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for number in PARENT_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
    with suppress(OSError, ValueError):  # keep the output of libraries off the terminal
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
    sys.stdin = None
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> NoReturn:
    parent = parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)
