"""A worker: a process of this machine that runs parts of a sweep.

It is a copy of this process (`fork`, some ms) where that is sound, else a new interpreter. It ends
when this process does, however that ends.
"""

import gc
import os
import signal
import sys
import warnings
from collections import deque
from contextlib import suppress
from functools import cache
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from threading import Thread
from time import perf_counter
from typing import Any, NoReturn

from frictionsim.io.child_process import may_fork, signals_wait
from frictionsim.parameter_study.dispatch import CHECK, Answer, Job
from frictionsim.parameter_study.single_run import Task, run_task
from frictionsim.parameter_study.sweep import SweepPlan, check_combinations

READY = b"ready"
SECONDS_TO_END = 5.0
# A terminal sends these to all of its processes; the one that started the sweep decides.
TO_PARENT = ("SIGINT", "SIGHUP")


class Worker:
    """A process that does jobs one after the other.

    Attributes
    ----------
    jobs : deque of Job
        Those that it has not answered; it is at the first.
    """

    def __init__(self, plan: SweepPlan) -> None:
        context: Any = get_context("fork" if may_fork() else "spawn")
        self.connection, theirs = context.Pipe()
        self.jobs: deque[Job] = deque()
        self.has_begun = False
        self._process = context.Process(target=_serve, args=(theirs, plan), daemon=True)
        with warnings.catch_warnings(), signals_wait():
            # Python 3.12 warns of threads, also of those of numpy's linear algebra.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._process.start()
        theirs.close()

    def submit(self, job: Job) -> None:
        """Give it a job."""
        self.jobs.append(job)
        with suppress(OSError):  # it is dead: `answer` says so
            self.connection.send(job)

    def answer(self) -> Answer | None:
        """Return its next answer; None if it has said that it is ready.

        Raises
        ------
        EOFError, OSError
            If it is dead.
        """
        found = self.connection.recv()
        self.has_begun = True
        if found == READY:
            return None
        seconds, image, error = found
        return Answer(self.jobs.popleft(), seconds, image, error)

    def kill(self) -> None:
        """End the process."""
        with suppress(OSError, ValueError):
            self._process.kill()
        self.ended()

    def ended(self) -> str:
        """Wait for the end of the process, and return how it ended."""
        self._process.join(SECONDS_TO_END)
        self.connection.close()
        code = self._process.exitcode
        if code is not None and code < 0:
            with suppress(ValueError):
                return f"of {signal.Signals(-code).name}"
        return f"with exit code {code}"


def _serve(connection: "Connection[Any, Any]", plan: SweepPlan) -> None:
    """Do the jobs of a sweep until the connection ends."""
    _isolate()
    with suppress(EOFError, OSError):
        use_one_thread_of_linear_algebra()
        combinations = plan.combinations
        connection.send(READY)
        while True:
            job = connection.recv()
            connection.send(answer_to(job, plan, combinations))


def answer_to(job: Job, plan: SweepPlan, combinations: Any) -> tuple[float, bytes, Any]:
    """Return the seconds that a job took, its outcomes as bytes, and the error that ended it."""
    started = perf_counter()
    image, error = b"", None
    try:
        if job.kind == CHECK:
            check_combinations(plan, job.runs)
        else:
            values = plan.design.combinations(job.first, job.stop)
            image = run_task(combinations, Task(job.first, values), plan.series).to_bytes()
    except Exception as found:
        error = found
    return perf_counter() - started, image, error


@cache
def use_one_thread_of_linear_algebra() -> None:
    """Have libraries of linear algebra use one thread each; the workers share the cores."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)


def _isolate() -> None:
    """Have nothing of the parent react to signals, and this process end with it."""
    # The command line collects no garbage, as it ends soon; a worker may run for days.
    gc.freeze()
    gc.enable()
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        signal.signal(number, signal.SIG_DFL)
    for name in TO_PARENT:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
    with suppress(OSError, ValueError):  # what libraries print is not for the terminal
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
    sys.stdin = None
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> NoReturn:
    parent = parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)
