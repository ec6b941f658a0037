"""Runs the parts of a sweep in processes of this machine."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from multiprocessing import connection, current_process
from time import monotonic
from typing import Any

from frictionsim.errors import FrictionsimError, InputError
from frictionsim.parameter_study import dispatch
from frictionsim.parameter_study.dispatch import Answer, Job
from frictionsim.parameter_study.in_process import RUNS_AT_ONCE, InProcess, parts
from frictionsim.parameter_study.sweep import Execution, SweepPlan, check_combinations
from frictionsim.parameter_study.worker_process import Worker
from frictionsim.scenario.kinds import mechanism_module

SECONDS_HERE = 0.1  # some times what it takes to start workers
MAX_STILLBORN = 3  # workers that end before they begin; one may be killed from outside


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def local_execution(workers: int, runs: int) -> Execution:
    """Return the executor of a sweep on this machine.

    Parameters
    ----------
    workers : int
        Number of processes; 1 runs everything in this one.
    runs : int
    """
    # A daemon of `multiprocessing` may not have children.
    if min(workers, runs) < 2 or current_process().daemon:
        return InProcess()
    return ProcessPool(min(workers, runs))


class ProcessPool:
    """An `Execution` with worker processes, which are started when they are needed."""

    seconds_of_a_block = 0.3

    def __init__(self, count: int) -> None:
        self.count = count
        self._plan: SweepPlan | None = None
        self._workers: list[Worker] = []
        self._stillborn = 0

    def check(
        self,
        plan: SweepPlan,
        left: Iterable[range],
        on_checked: Callable[[int], Any],
        beat: Callable[[], Any],
    ) -> None:
        """Check the combinations of runs; the first ones here, as most sweeps are small."""
        latest = monotonic() + SECONDS_HERE
        ranges = list(left)
        for runs in parts(ranges, RUNS_AT_ONCE):
            check_combinations(plan, runs)
            on_checked(len(runs))
            if monotonic() > latest:
                self._start(plan)
                dispatch.check_all(self, _after(ranges, runs.stop), on_checked, beat)
                return

    def blocks(
        self, plan: SweepPlan, left: Iterable[range], beat: Callable[[], Any]
    ) -> Iterator[bytes]:
        """Yield the outcomes of runs."""
        self._start(plan)
        yield from dispatch.run_blocks(self, left, beat, plan.together)

    def submit(self, job: Job) -> None:
        """Give a job to the worker with the fewest."""
        min(self._workers, key=lambda worker: len(worker.jobs)).submit(job)

    def answers(self, seconds: float) -> list[Answer]:
        """Return answers as soon as there are some, at the latest after some seconds."""
        by_connection = {worker.connection: worker for worker in self._workers}
        found = []
        for ready in connection.wait(list(by_connection), seconds):
            worker = by_connection[ready]
            try:
                answer = worker.answer()
            except (EOFError, OSError):
                answer = self._replaced(worker)
            if answer is not None:
                found.append(answer)
        return found

    def close(self) -> None:
        """End the workers, whatever they do."""
        for worker in self._workers:
            worker.kill()
        self._workers.clear()

    def _start(self, plan: SweepPlan) -> None:
        if self._plan is plan and self._workers:
            return
        self.close()
        self._plan = plan
        prepare(plan)
        self._workers += [Worker(plan) for _ in range(self.count)]

    def _replaced(self, worker: Worker) -> Answer | None:
        """Put another worker in the place of one that died; return which job it was at."""
        assert self._plan is not None
        how = worker.ended()
        self._workers.remove(worker)
        self._stillborn = 0 if worker.has_begun else self._stillborn + 1
        if self._stillborn >= MAX_STILLBORN:
            raise InputError(
                f"no worker process can be started (it ended {how}); a script of Python needs"
                " \"if __name__ == '__main__':\" around what it does, or workers=1"
            )
        fresh = Worker(self._plan)
        self._workers.append(fresh)
        if not worker.jobs:
            return None
        lost = worker.jobs.popleft()
        for job in worker.jobs:
            fresh.submit(job)
        return Answer(lost, lost=how)


def _after(ranges: list[range], start: int) -> list[range]:
    """Return the remainder of ascending ranges from a number on."""
    return [range(max(each.start, start), each.stop) for each in ranges if each.stop > start]


def prepare(plan: SweepPlan) -> None:
    """Compile the kernels of a sweep, so that not each worker does it."""
    scenario = plan.combinations.scenario(plan.design.combinations(0, 1)[0])
    with suppress(FrictionsimError, ArithmeticError):  # which the run will say as well
        mechanism_module(scenario.kind).simulation(scenario).prepare(_nothing)


def _nothing(t: float) -> None:
    pass
