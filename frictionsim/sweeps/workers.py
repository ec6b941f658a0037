"""Workers of sweeps and fits: this process, others of this machine, or those of a Dask cluster.

A worker process is a copy of this one (`fork`, some ms) if that is safe, else a new interpreter. It
ends with this process, however that ends.
"""

import logging
import multiprocessing
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from copy import copy
from importlib import import_module
from typing import Any, NoReturn

from frictionsim.errors import InputError, WorkerDied
from frictionsim.simulation import memory
from frictionsim.version import __version__

# Terminals and shells send these to all of a group of processes; the parent handles them.
PARENT_SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
SECONDS_BETWEEN_TICKS = 0.1
SECONDS_TO_END = 1.0  # of a pool
KILLED = -9  # exit code of a process that was killed
LOCAL = "local:"  # what the address of a cluster begins with that is started here
SECONDS_TO_ANSWER = 10.0  # of a scheduler
VERSION = "frictionsim.version"  # the module


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Workers(Executor):
    """An executor of `concurrent.futures` that counts its workers and reports their death."""

    count = 1  # of simultaneous calls
    killed: tuple[type[BaseException], ...] = (BrokenExecutor,)  # raised by calls of dead workers

    def watch(self) -> None:
        """Look after workers whose number may change."""

    @contextmanager
    def reporting_deaths(self) -> Iterator[None]:
        """Raise WorkerDied instead of what calls of a killed worker raise."""
        try:
            yield
        except CancelledError:
            raise WorkerDied("dask: lost the connection to the scheduler") from None
        except self.killed:
            self._check_begun()
            raise WorkerDied("a worker process was killed, perhaps for lack of memory") from None

    def _check_begun(self) -> None:
        """Raise InputError if no worker has ever begun."""


class InProcess(Workers):
    """No other process: a call is made when it is submitted."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Make a call."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class ProcessPool(Workers):
    """Worker processes, which start with the first call."""

    def __init__(self, count: int) -> None:
        self.count, self._workers = count, list[Any]()  # also those that have not begun
        context: Any = copy(multiprocessing.get_context("fork" if may_fork() else "spawn"))
        make = context.Process

        def made(*args: Any, **kwargs: Any) -> Any:
            self._workers.append(make(*args, **kwargs))
            return self._workers[-1]

        context.Process = made
        self._begun = context.SimpleQueue()  # an item for each process
        self._pool = ProcessPoolExecutor(count, context, _begin, (self._begun, count))

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Queue a call."""
        with warnings.catch_warnings():
            # Python 3.12 warns of any threads, even those of numpy's linear algebra.
            warnings.simplefilter("ignore", DeprecationWarning)
            return self._pool.submit(function, *args, **kwargs)

    def _check_begun(self) -> None:
        for process in self._workers:
            process.join(SECONDS_TO_END)
        if self._begun.empty() and KILLED not in (one.exitcode for one in self._workers):
            raise InputError(
                'no worker process can be started; a script of Python needs "if __name__ =='
                " '__main__':\" around what it does (a sweep also runs with workers=1)"
            )

    def close(self) -> None:
        """End the workers, whatever they do."""
        for process in self._workers:
            if process.pid is not None:  # it could be started
                process.kill()
        # It waits for the rest of the answer of a worker that died while sending it.
        shutdown = threading.Thread(target=self._pool.shutdown, daemon=True)
        shutdown.start()
        shutdown.join(SECONDS_TO_END)


@contextmanager
def process_pool(workers: int) -> Iterator[Workers]:
    """Return the context of some worker processes; one worker is this process."""
    # A daemon of `multiprocessing` may not have children.
    if workers < 2 or multiprocessing.current_process().daemon:
        yield InProcess()
        return
    pool = ProcessPool(workers)
    try:
        yield pool
    finally:
        pool.close()


def may_fork() -> bool:
    """Return whether a copy of this process is safe: another thread may hold a lock."""
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return False
    return threading.active_count() == 1 or not sys.executable


def _begin(begun: Any, workers: int) -> None:
    """Prepare a worker: the signals and the end of the parent, and one thread for each core."""
    for number in PARENT_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    begun.put(None)
    memory.processes = workers
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    with suppress(OSError, ValueError):  # keep the output of libraries off the terminal
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> NoReturn:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)


class DaskCluster(Workers):
    """The workers of a cluster of Dask, whose number may change.

    Another worker makes the call of one that dies, up to the limit of the scheduler.
    """

    def __init__(self, client: Any, killed: type[BaseException]) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)
        self.killed = (*Workers.killed, killed)
        self.watch()

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Queue a call."""
        future: Future[Any] = self._executor.submit(function, *args, **kwargs)
        return future

    def watch(self) -> None:
        """Count the workers; raise CancelledError if the scheduler is lost."""
        if self._client.status in ("closed", "closing"):
            raise CancelledError
        with suppress(Exception):  # the scheduler is busy
            self.count = max(1, sum(self._client.nthreads().values()))


@contextmanager
def dask_cluster(address: str) -> Iterator[Workers]:
    """Return the context of a cluster.

    Parameters
    ----------
    address : str
        Of a scheduler, such as tcp://host:8786, or local:N for N workers on this machine.

    Raises
    ------
    InputError
        If it is no address, no scheduler with workers answers, or they have another version.
    """
    number = address.removeprefix(LOCAL)
    is_local = number != address
    if is_local and not (number.isdecimal() and 0 < int(number) < 10_000):
        raise InputError(f"dask: expected local:N with N workers, e.g. local:4, got '{address}'")
    if not is_local and not re.fullmatch(r"\w+://[^/]+:\d+", address):
        raise InputError(
            "dask: expected the address of a scheduler, e.g. tcp://host:8786, or local:N, got"
            f" '{address}'"
        )
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise InputError(
            "dask: the package distributed is not installed; 'pip install distributed' brings it"
        ) from None
    with ExitStack() as stack:
        try:
            place: Any = address
            if is_local:
                place = distributed.LocalCluster(
                    n_workers=int(number),
                    threads_per_worker=1,
                    dashboard_address=":0",  # any port: the usual one may be taken
                    silence_logs=logging.CRITICAL,
                )
                stack.enter_context(place)
            client = distributed.Client(place, timeout=SECONDS_TO_ANSWER, set_as_default=False)
            stack.callback(client.close, SECONDS_TO_ANSWER)
            client.wait_for_workers(1, timeout=SECONDS_TO_ANSWER)
        except Exception as error:
            raise InputError(
                f"dask {address}: no scheduler with workers answers there"
                f" ({type(error).__name__}); give the address that it printed when it started, and"
                f" start workers with 'dask worker {address}'"
            ) from None
        # A nested function is sent as code, not by name; an ImportError is returned.
        installed = client.run(lambda: import_module(VERSION).__version__, on_error="return")
        for worker, version in installed.items():
            if version != __version__:
                has = version if isinstance(version, str) else "none"
                raise InputError(
                    f"dask {address}, worker {worker}: has frictionsim {has}; this is frictionsim"
                    f" {__version__}: install the same there"
                )
        if is_local:
            client.run(_begin_local, int(number))
        yield DaskCluster(client, distributed.KilledWorker)


def _begin_local(workers: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all
    memory.processes = workers
