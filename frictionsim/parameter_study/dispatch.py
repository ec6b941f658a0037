"""Dispatches the runs of a sweep to workers, and survives the crash of a worker.

Runs go out in blocks of some tenths of a second, two for each worker. The runs of a worker that
crashed are repeated one by one, as nobody knows which of them it was. A run that crashes a worker
alone is repeated last, with the machine for itself; if its worker crashes again, it has failed.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from time import monotonic
from typing import Any, NamedTuple, Protocol

from frictionsim.errors import InputError, Interrupted
from frictionsim.parameter_study.block import FAILED, Outcome, block_of
from frictionsim.parameter_study.block_sizes import BlockSizes

CHECK, RUN = "check", "run"
MIN_CHECKED = 64  # combinations, which take some milliseconds
SECONDS_BETWEEN_BEATS = 0.1
SECONDS_FOR_THE_LAST = 1.0  # for blocks in flight when a sweep is interrupted
WORKER_DIED = "worker_died"


class Job(NamedTuple):
    """Runs for a worker: to CHECK or to RUN, from `first` up to `stop`."""

    kind: str
    first: int
    stop: int

    @property
    def runs(self) -> range:
        """Their numbers."""
        return range(self.first, self.stop)


class Answer(NamedTuple):
    """What a worker says of a job.

    Attributes
    ----------
    job : Job
    seconds : float, s
        That it took.
    image : bytes
        Of a block of outcomes.
    error : Exception, optional
        That ended it.
    lost : str
        How the worker died; empty if it did not.
    """

    job: Job
    seconds: float = 0.0
    image: bytes = b""
    error: Exception | None = None
    lost: str = ""


class Workers(Protocol):
    """Processes here or elsewhere that take jobs."""

    @property
    def count(self) -> int:
        """How many work at the same time."""

    @property
    def seconds_of_a_block(self) -> float:
        """Long beside what a block costs to send, short beside what a sweep takes."""

    def submit(self, job: Job) -> None:
        """Give a job to one of them."""

    def answers(self, seconds: float) -> list[Answer]:
        """Return answers as soon as there are some, at the latest after some seconds."""


class _Queue:
    """The jobs that are left, in order."""

    def __init__(
        self, kind: str, left: Iterable[range], sizes: BlockSizes, workers: Workers
    ) -> None:
        self._kind, self._ranges, self._sizes = kind, deque(left), sizes
        self._workers = workers
        self._single: deque[Job] = deque()
        self._last: deque[Job] = deque()

    def next(self, idle: bool) -> Job | None:
        """Return the next job; None if there is none now. The last ones go one at a time."""
        if self._ranges:
            found = self._ranges.popleft()
            stop = min(found.start + self._sizes.next(self._workers.count), found.stop)
            if stop < found.stop:
                self._ranges.appendleft(range(stop, found.stop))
            self._sizes.took(stop - found.start)
            return Job(self._kind, found.start, stop)
        if self._single:
            return self._single.popleft()
        return self._last.popleft() if self._last and idle else None

    def retry(self, job: Job) -> None:
        """Take back the job of a worker that died."""
        if len(job.runs) > 1:
            self._single += [Job(job.kind, n, n + 1) for n in job.runs]
        else:
            self._last.append(job)

    def stop(self) -> None:
        """Give out no more."""
        for jobs in (self._ranges, self._single, self._last):
            jobs.clear()


class _Dispatch:
    """Gives jobs to workers and collects the answers."""

    def __init__(self, workers: Workers, kind: str, left: list[range], together: int) -> None:
        self._workers = workers
        self._sizes = BlockSizes(workers.seconds_of_a_block, sum(map(len, left)), together)
        self._queue = _Queue(kind, left, self._sizes, workers)
        self._out = 0
        self._died: dict[int, int] = {}

    def stop(self) -> None:
        """Give out no more jobs."""
        self._queue.stop()

    def answers(self, beat: Callable[[], Any]) -> Iterator[Answer]:
        """Yield the answers; of a run that has killed its workers, how they died."""
        beaten = monotonic()
        while True:
            self._fill()
            if not self._out:
                return
            yield from self._collected(SECONDS_BETWEEN_BEATS)
            if monotonic() - beaten > SECONDS_BETWEEN_BEATS:
                beat()
                beaten = monotonic()

    def rest(self, seconds: float) -> Iterator[Answer]:
        """Yield the answers of jobs that are out, as far as they come within some seconds."""
        self.stop()
        latest = monotonic() + seconds
        while self._out and monotonic() < latest:
            yield from self._collected(max(latest - monotonic(), 0.0))
            self.stop()

    def _fill(self) -> None:
        # A long one should not wait behind another long one.
        while self._out < self._workers.count * (2 if self._sizes.are_short else 1):
            job = self._queue.next(idle=not self._out)
            if job is None:
                return
            self._workers.submit(job)
            self._out += 1

    def _collected(self, seconds: float) -> Iterator[Answer]:
        for answer in self._workers.answers(seconds):
            self._out -= 1
            if not answer.lost:
                self._sizes.learn(len(answer.job.runs), answer.seconds)
                yield answer
            elif self._is_hopeless(answer.job):
                yield answer
            else:
                self._queue.retry(answer.job)

    def _is_hopeless(self, job: Job) -> bool:
        if len(job.runs) > 1:
            return False
        self._died[job.first] = self._died.get(job.first, 0) + 1
        return self._died[job.first] > 1


def run_blocks(
    workers: Workers, left: Iterable[range], beat: Callable[[], Any], together: int = 1
) -> Iterator[bytes]:
    """Yield the outcomes of runs as `Block.to_bytes`, as they come.

    Parameters
    ----------
    workers : Workers
    left : iterable of range
    beat : callable
        Called some times each second. If it raises `Interrupted` or KeyboardInterrupt, the blocks
        that come within a second are yielded before that goes on.
    together : int
        As of `BlockSizes`.
    """
    dispatch = _Dispatch(workers, RUN, list(left), together)
    try:
        for answer in dispatch.answers(beat):
            yield _image(answer)
    except (Interrupted, KeyboardInterrupt):
        yield from map(_image, dispatch.rest(SECONDS_FOR_THE_LAST))
        raise


def _image(answer: Answer) -> bytes:
    if answer.error is not None:
        raise answer.error
    if not answer.lost:
        return answer.image
    reason = f"the worker process died in this run each time, {answer.lost}"
    return block_of(answer.job.first, [Outcome(FAILED, {}, WORKER_DIED, reason)]).to_bytes()


def check_all(
    workers: Workers, left: list[range], on_checked: Callable[[int], Any], beat: Callable[[], Any]
) -> None:
    """Check combinations."""
    dispatch = _Dispatch(workers, CHECK, left, MIN_CHECKED)
    faults: dict[int, Exception] = {}
    for answer in dispatch.answers(beat):
        if answer.lost:
            raise InputError(
                f"run {answer.job.first}: the worker process died while its values were checked,"
                f" {answer.lost}"
            )
        if answer.error is not None:
            # Those before it are out already: the first of all is among their answers.
            faults[answer.job.first] = answer.error
            dispatch.stop()
        else:
            on_checked(len(answer.job.runs))
    if faults:
        raise faults[min(faults)]
