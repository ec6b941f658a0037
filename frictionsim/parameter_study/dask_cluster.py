"""Runs the parts of a sweep on a cluster of Dask, which has its own scheduler.

The disks of the workers are not used, except for the results of the runs if these are requested.
Dask gives the blocks of a worker that died to others; those that have killed several are run one at
a time (`dispatch`).
"""

import logging
import signal
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

from frictionsim.errors import InputError, SolverError
from frictionsim.parameter_study.dispatch import JobResult, do_job
from frictionsim.parameter_study.executors import use_one_thread_of_linear_algebra
from frictionsim.parameter_study.single_run import Task
from frictionsim.parameter_study.sweep import SweepPlan
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.version import __version__

LOCAL = "local:"
SECONDS_TO_ANSWER = 10.0  # of a scheduler
SECONDS_TO_END = 5.0
SECONDS_BETWEEN_COUNTS = 2.0
LOGGERS = ("distributed", "tornado", "asyncio")  # silenced: errors are reported by this program


class DaskCluster:
    """An `Executor` on a cluster of Dask.

    The address is that of a scheduler, such as tcp://host:8786, or local:N for N workers on this
    machine.
    """

    seconds_of_a_block, ahead = 0.8, 2  # the scheduler needs some hundredths for each

    def __init__(self, address: str) -> None:
        self._address = address
        wanted = _count_of(address)
        distributed = _distributed()
        self._levels = _silence()
        self._client: Any = None
        self._cluster: Any = None
        self._executor: Any = None
        self._plan: SweepPlan | None = None
        self._combinations: Any = None
        self._count, self._counted = 0, 0.0
        try:
            self._connect(distributed, wanted)
            if self._cluster is not None:
                self._client.register_plugin(_plugin_ignoring_ctrl_c(distributed))
            self._check_workers()
        except BaseException:
            self.close()
            raise

    @property
    def count(self) -> int:
        """The number of simultaneous runs; the number of workers may change."""
        if monotonic() - self._counted > SECONDS_BETWEEN_COUNTS:
            with suppress(Exception):  # the scheduler is busy, or lost, which `watch` reports
                self._count = sum(self._client.nthreads().values())
            self._counted = monotonic()
        return max(self._count, 1)

    def start(self, plan: SweepPlan, monitor: RunMonitor) -> None:
        """Prepare for the runs of a sweep."""
        if self._plan is plan:
            return
        self._plan = plan
        # A task, not data sent in advance: if its worker dies, the scheduler repeats it.
        self._combinations = self._client.submit(
            Combinations, plan.scenario, plan.design.keys, plan.design.runs, pure=False
        )

    def submit(self, kind: str, task: Task) -> "Future[JobResult]":
        """Submit a job to the scheduler."""
        assert self._plan is not None
        series = None if self._plan.series is None else self._plan.series.absolute()
        future: Future[JobResult] = self._executor.submit(
            do_job_on_worker, __version__, self._combinations, kind, task, series
        )
        return future

    def watch(self) -> None:
        """Check that the scheduler is connected."""
        if self._client.status in ("closed", "closing"):
            raise self._lost()

    def crash(self, error: Exception) -> str:
        """Return how a worker died, as far as the scheduler reports it."""
        if isinstance(error, CancelledError):  # the scheduler is lost
            raise self._lost() from None
        return "reported by the Dask scheduler" if type(error).__name__ == "KilledWorker" else ""

    def close(self) -> None:
        """Disconnect from the cluster; end it if it was started for this sweep."""
        executor, client, cluster = self._executor, self._client, self._cluster
        self._executor = self._client = self._cluster = self._plan = self._combinations = None
        with suppress(Exception):  # the scheduler is lost
            if executor is not None:
                executor.shutdown(wait=False)
        for end in (client, cluster):
            with suppress(Exception):
                if end is not None:
                    end.close(SECONDS_TO_END)
        for name, level in self._levels.items():
            logging.getLogger(name).setLevel(level)

    def _lost(self) -> SolverError:
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
        # Dask has no time limit for a server that accepts the connection but never answers.
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
        self._executor = self._client.get_executor(pure=False)
        versions = self._client.run(_probe(), on_error="return")
        for worker, version in versions.items():
            if version != __version__:
                where = f"{self._address}, worker {worker}"
                raise InputError(_other_version(where, version, __version__))


def do_job_on_worker(
    version: str, combinations: Combinations, kind: str, task: Task, series: Path | None
) -> JobResult:
    """Do a job on a worker, which must have the version of the submitting program."""
    if version != __version__:  # the worker joined after the check
        raise InputError(_other_version("worker", __version__, version))
    use_one_thread_of_linear_algebra()
    return do_job(combinations, kind, task, series)


def _probe() -> Callable[[], str]:
    """Return a function for the version of a worker, which may lack frictionsim.

    A nested function is sent as code, others are sent by name.
    """

    def version() -> str:
        try:
            from frictionsim.version import __version__
        except ImportError:
            return ""
        return __version__

    return version


def _plugin_ignoring_ctrl_c(distributed: Any) -> Any:
    """Return a plugin that makes each local worker ignore Ctrl-C, also those started later.

    A terminal sends it to all processes; workers would print tracebacks.
    """

    class Deaf(distributed.WorkerPlugin):  # type: ignore[misc]
        def setup(self, worker: Any) -> None:
            with suppress(ValueError):  # not in the main thread
                signal.signal(signal.SIGINT, signal.SIG_IGN)

    return Deaf()


def _other_version(where: str, version: Any, here: str) -> str:
    has = f"has frictionsim {version}" if isinstance(version, str) and version else "has none"
    return f"dask {where}: {has}; this is frictionsim {here}: install the same there"


def _count_of(address: str) -> int | None:
    """Return the number of workers of local:N; None of an address."""
    if not isinstance(address, str):
        raise InputError(f"dask: expected an address, e.g. tcp://host:8786, got {address!r}")
    if address.startswith(LOCAL):
        count = address.removeprefix(LOCAL)
        if not (count.isdecimal() and 0 < int(count) < 10_000):
            raise InputError(
                f"dask: expected local:N with N workers, e.g. local:4, got '{address}'"
            )
        return int(count)
    scheme, sign, place = address.partition("://")
    host, _, port = place.rpartition(":")
    if not (scheme and sign and host and port.isdecimal() and int(port) < 2**16):
        raise InputError(
            "dask: expected the address of a scheduler, e.g. tcp://host:8786, or local:N, got"
            f" '{address}'"
        )
    return None


def _distributed() -> Any:
    """Return the package distributed."""
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
        if name.split(".")[0] in LOGGERS and isinstance(logging.getLogger(name), logging.Logger)
    ]
    levels = {name: logging.getLogger(name).level for name in {*names, *LOGGERS}}
    for name in levels:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    return levels
