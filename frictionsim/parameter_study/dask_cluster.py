"""Runs the parts of a sweep on a cluster of Dask, which has its own scheduler.

Blocks are tasks, and their outcomes come back as bytes: nothing is read from or written to the
disks of the workers, but the results of the runs where these are wanted. Dask gives the blocks of a
worker that died to others; those that have killed several are taken one run at a time (`dispatch`).
"""

import logging
import pickle
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from time import monotonic
from typing import Any

from frictionsim.errors import InputError, SolverError
from frictionsim.parameter_study import dispatch
from frictionsim.parameter_study.combinations import Combinations
from frictionsim.parameter_study.dispatch import CHECK, RUN, Answer, Job
from frictionsim.parameter_study.single_run import Task, run_task
from frictionsim.parameter_study.sweep import SweepPlan
from frictionsim.version import __version__

LOCAL = "local:"
SECONDS_TO_ANSWER = 10.0  # of a scheduler
SECONDS_TO_END = 5.0
SECONDS_BETWEEN_COUNTS = 2.0
LOUD = ("distributed", "tornado", "asyncio")  # loggers; what matters is said by us


class DaskCluster:
    """An `Execution` on a cluster of Dask.

    Parameters
    ----------
    address : str
        Of a scheduler, as tcp://host:8786; or local:N for one of N workers on this machine.
    """

    seconds_of_a_block = 0.8  # the scheduler takes some hundredths for each

    def __init__(self, address: str) -> None:
        self._address = address
        wanted = _count_of(address)
        distributed = _distributed()
        self._levels = _silence()
        self._client: Any = None
        self._cluster: Any = None
        self._done: SimpleQueue[Any] = SimpleQueue()
        self._jobs: dict[str, Job] = {}
        self._futures: dict[str, Any] = {}
        self._plan: SweepPlan | None = None
        self._combinations: Any = None
        self._count, self._counted = 0, 0.0
        try:
            self._connect(distributed, wanted)
            if self._cluster is not None:
                self._client.register_plugin(_deaf_to_ctrl_c(distributed))
            self._check_workers()
        except BaseException:
            self.close()
            raise

    @property
    def count(self) -> int:
        """How many runs the workers do at the same time; workers may come and go."""
        if monotonic() - self._counted > SECONDS_BETWEEN_COUNTS:
            with suppress(Exception):  # the scheduler is busy, or has gone: `answers` says so
                self._count = sum(self._client.nthreads().values())
            self._counted = monotonic()
        return max(self._count, 1)

    def check(
        self,
        plan: SweepPlan,
        left: Iterable[range],
        on_checked: Callable[[int], Any],
        beat: Callable[[], Any],
    ) -> None:
        """Check the combinations of runs."""
        self._start(plan)
        dispatch.check_all(self, list(left), on_checked, beat)

    def blocks(
        self, plan: SweepPlan, left: Iterable[range], beat: Callable[[], Any]
    ) -> Iterator[bytes]:
        """Yield the outcomes of runs."""
        self._start(plan)
        yield from dispatch.run_blocks(self, left, beat, plan.together)

    def submit(self, job: Job) -> None:
        """Have the scheduler give a job to a worker."""
        assert self._plan is not None
        values = self._plan.design.combinations(job.first, job.stop)
        task = Task(job.first, values)
        series = None if self._plan.series is None else str(self._plan.series.absolute())
        future = self._client.submit(
            answer_to, job.kind, self._combinations, task, series, pure=False
        )
        self._jobs[future.key], self._futures[future.key] = job, future
        future.add_done_callback(self._done.put)

    def answers(self, seconds: float) -> list[Answer]:
        """Return answers as soon as there are some, at the latest after some seconds."""
        found: list[Answer] = []
        try:
            while True:
                found.append(self._answer(self._done.get(timeout=0.0 if found else seconds)))
        except Empty:
            if not found and self._client.status in ("closed", "closing"):
                raise self._gone() from None
            return found

    def close(self) -> None:
        """Leave the cluster; end one that was started for this sweep."""
        futures = list(self._futures.values())
        self._futures, self._jobs, self._plan, self._combinations = {}, {}, None, None
        client, cluster = self._client, self._cluster
        self._client = self._cluster = None
        with suppress(Exception):  # a scheduler that has gone
            if client is not None and futures:
                client.cancel(futures, force=True)
        for end in (client, cluster):
            with suppress(Exception):
                if end is not None:
                    end.close(SECONDS_TO_END)
        for name, level in self._levels.items():
            logging.getLogger(name).setLevel(level)

    def _start(self, plan: SweepPlan) -> None:
        if self._plan is plan:
            return
        self._plan = plan
        # A task, not data sent beforehand: if its worker dies, the scheduler has it done again.
        image = pickle.dumps((plan.scenario, plan.design.keys))
        self._combinations = self._client.submit(_combinations, image, pure=False)

    def _answer(self, future: Any) -> Answer:
        job = self._jobs.pop(future.key)
        del self._futures[future.key]
        if future.status == "finished":
            version, seconds, image, error = future.result()
            if version != __version__:
                raise InputError(_other_version(self._address, version))
            return Answer(job, seconds, image, error)
        if future.status != "error":  # cancelled, or lost with its scheduler
            raise self._gone()
        error = future.exception()
        if type(error).__name__ == "KilledWorker":
            return Answer(job, lost="as the scheduler of Dask reports")
        return Answer(job, error=error)

    def _gone(self) -> SolverError:
        return SolverError(f"dask {self._address}: lost the connection to the scheduler")

    def _connect(self, distributed: Any, workers: int | None) -> None:
        """Connect to the scheduler."""

        def connect() -> None:
            try:
                if workers is not None:
                    self._cluster = distributed.LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        dashboard_address=":0",  # any port: the usual one may be taken
                        silence_logs=logging.CRITICAL,
                    )
                place = self._address if self._cluster is None else self._cluster
                self._client = distributed.Client(
                    place, timeout=SECONDS_TO_ANSWER, set_as_default=False
                )
            except Exception as error:
                failed.append(error)

        failed: list[Exception] = []
        # What listens but never answers has no limit of time in Dask.
        connecting = Thread(target=connect, daemon=True)
        connecting.start()
        connecting.join(None if workers is not None else SECONDS_TO_ANSWER)
        if connecting.is_alive() or failed:
            why = f" ({type(failed[0]).__name__})" if failed and workers is not None else ""
            waited = "" if failed else f" within {SECONDS_TO_ANSWER:.0f} s"
            raise InputError(
                f"dask {self._address}: no scheduler answers there{waited}{why}; give the address"
                " that it printed when it started"
            )

    def _check_workers(self) -> None:
        """Check that there are workers, and that they have this version."""
        try:
            self._client.wait_for_workers(1, timeout=SECONDS_TO_ANSWER)
        except Exception:
            raise InputError(
                f"dask {self._address}: the scheduler has no workers; start some with"
                f" 'dask worker {self._address}'"
            ) from None
        found = self._client.run(_probe(), on_error="return")
        for worker, version in found.items():
            if version != __version__:
                raise InputError(_other_version(f"{self._address}, worker {worker}", version))


def answer_to(
    kind: str, combinations: Combinations, task: Task, series: str | None
) -> tuple[str, float, bytes, Exception | None]:
    """Do a job on a worker.

    Returns
    -------
    str
        The version of the worker.
    float, s
        The time it took.
    bytes
        The outcomes.
    Exception or None
        What ended it.
    """
    from time import perf_counter

    from frictionsim.parameter_study.worker_process import use_one_thread_of_linear_algebra

    started = perf_counter()
    image, error = b"", None
    try:
        use_one_thread_of_linear_algebra()
        if kind == CHECK:
            for values in task.values:
                combinations.scenario(values)
        elif kind == RUN:
            folder = None if series is None else Path(series)
            image = run_task(combinations, task, folder).to_bytes()
    except Exception as found:
        error = found
    return __version__, perf_counter() - started, image, error


def _combinations(image: bytes) -> Combinations:
    return Combinations(*pickle.loads(image))


def _probe() -> Callable[[], str]:
    """Return a function that tells the version of a worker, also of one without frictionsim.

    A function within a function is sent as it is, others by their name.
    """

    def version() -> str:
        try:
            from frictionsim.version import __version__
        except ImportError:
            return ""
        return __version__

    return version


def _deaf_to_ctrl_c(distributed: Any) -> Any:
    """Return a plugin that has each worker here ignore Ctrl-C, also one that starts later.

    A terminal sends it to all processes; workers would print how it ended them.
    """

    class Deaf(distributed.WorkerPlugin):  # type: ignore[misc]
        def setup(self, worker: Any) -> None:
            with suppress(ValueError):  # not in the main thread
                signal.signal(signal.SIGINT, signal.SIG_IGN)

    return Deaf()


def _other_version(where: str, version: Any) -> str:
    has = f"has frictionsim {version}" if isinstance(version, str) and version else "has none"
    return f"dask {where}: {has}; this is frictionsim {__version__}: install the same there"


def _count_of(address: str) -> int | None:
    """Return the number of workers of local:N; None of an address."""
    if not isinstance(address, str):
        raise InputError(f"dask: expected an address, as tcp://host:8786, got {address!r}")
    if address.startswith(LOCAL):
        count = address.removeprefix(LOCAL)
        if not (count.isdecimal() and 0 < int(count) < 10_000):
            raise InputError(f"dask: expected local:N with N workers, as local:4, got '{address}'")
        return int(count)
    scheme, sign, place = address.partition("://")
    host, _, port = place.rpartition(":")
    if not (scheme and sign and host and port.isdecimal() and int(port) < 2**16):
        raise InputError(
            "dask: expected the address of a scheduler, as tcp://host:8786, or local:N, got"
            f" '{address}'"
        )
    return None


def _distributed() -> Any:
    """Return the library."""
    try:
        import distributed
    except ImportError:
        raise InputError(
            "dask: the package distributed is not installed; install it with"
            " pip install 'frictionsim[dask]'"
        ) from None
    return distributed


def _silence() -> dict[str, int]:
    """Silence the loggers of other packages; return their previous levels."""
    names = [
        name
        for name in logging.root.manager.loggerDict
        if name.split(".")[0] in LOUD and isinstance(logging.getLogger(name), logging.Logger)
    ]
    levels = {name: logging.getLogger(name).level for name in {*names, *LOUD}}
    for name in levels:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    return levels
