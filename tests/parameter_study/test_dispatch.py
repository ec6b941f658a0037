"""Blocks of runs: their sizes, and what becomes of those whose worker dies."""

from collections.abc import Callable
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any, cast

import pytest

from frictionsim.parameter_study.block import DONE, FAILED, Outcome, block_of
from frictionsim.parameter_study.dispatch import BlockSizes, Done, run_blocks
from frictionsim.parameter_study.single_run import Task
from frictionsim.parameter_study.sweep import SweepPlan

pytestmark = pytest.mark.quick


def sizes_of(runs: int, seconds: object, together: int, workers: int = 2) -> list[int]:
    """Return the sizes of the blocks of a sweep whose blocks take `seconds(size)`."""
    sizes, left, found = BlockSizes(0.3, runs, together), runs, []
    assert callable(seconds)
    while left:
        size = min(sizes.next(workers), left)
        sizes.took(size)
        sizes.learn(size, seconds(size))
        left -= size
        found.append(size)
    return found


def in_one_go(alone: float) -> object:
    """Return the time of blocks whose passes take as long as ten runs alone, and little more."""
    return lambda size: size * alone if size < 50 else 10 * alone + size * alone / 20


def test_runs_alone_take_blocks_of_time() -> None:
    found = sizes_of(10_000, lambda size: 0.01 * size, 1)
    assert found[:3] == [1, 30, 30]
    assert max(found) == 30
    assert sizes_of(5, lambda size: 60.0 * size, 1) == [1] * 5


@pytest.mark.parametrize("alone", [1e-3, 3e-3, 0.01, 0.03])
def test_runs_go_together_however_slow_the_machine_is(alone: float) -> None:
    found = sizes_of(20_000, in_one_go(alone), 50)
    # The last block may have what is too little for one of its own.
    assert min(found[1:]) >= 50
    # What a block costs however many runs it has is shared by several times the fewest.
    assert sum(found[1:]) / len(found[1:]) > 100
    assert max(found) <= 2000


def test_long_runs_go_alone() -> None:
    assert set(sizes_of(300, in_one_go(1.0), 50)) == {1}


def test_a_block_that_is_long_is_not_followed_by_longer_ones() -> None:
    found = sizes_of(20_000, lambda size: 0.02 * size, 50)
    assert max(found[:-1]) == 50


def test_small_blocks_at_the_end_teach_nothing() -> None:
    sizes = BlockSizes(0.3, 100_000, 50)
    sizes.learn(1000, 0.2)
    before = sizes.next(2)
    sizes.learn(50, 0.2)
    assert sizes.next(2) == before


class BreakingPool:
    """An executor of two workers in which one run kills its worker some times.

    All jobs in progress are lost with it, and that of the run is the last to be ended.
    """

    seconds_of_a_block, ahead, deaths, count = 0.3, 1, 1, 2

    def __init__(self, run: int, times: int) -> None:
        self._run, self._times = run, times
        self._jobs: list[tuple[Task, Future[Done]]] = []
        self._lost: list[Future[Done]] = []

    def start(self, plan: SweepPlan, on_tick: Callable[[], Any]) -> None:
        """Have nothing to prepare."""

    def submit(self, kind: str, task: Task) -> Future[Done]:
        """Take a job; all are ended when two are in progress, or none comes any more."""
        future: Future[Done] = Future()
        self._jobs.append((task, future))
        if len(self._jobs) == self.count:
            self.watch()
        return future

    def watch(self) -> None:
        """End all jobs in progress."""
        jobs, self._jobs = self._jobs, []
        killers = [future for task, future in jobs if self._kills(task)]
        self._times -= len(killers)
        others = [(task, future) for task, future in jobs if future not in killers]
        for task, future in others:
            if killers:
                future.set_exception(RuntimeError("lost"))
            else:
                outcomes = [Outcome(DONE, {})] * len(task.values)
                future.set_result((0.01 * len(outcomes), block_of(task.first, outcomes)))
        self._lost += killers
        if not others:
            self._end_the_killer()

    def _kills(self, task: Task) -> bool:
        return self._times > 0 and 0 <= self._run - task.first < len(task.values)

    def _end_the_killer(self) -> None:
        while self._lost:
            self._lost.pop().set_exception(RuntimeError("lost"))

    def crash(self, error: Exception) -> str:
        """Return how the worker died, after which that of the run is seen to have ended too."""
        self._end_the_killer()
        return "SIGKILL"

    def close(self) -> None:
        """Have no workers to end."""


@pytest.mark.parametrize(("times", "status"), [(3, DONE), (4, FAILED)])
def test_a_run_fails_by_the_death_of_its_worker_if_it_was_alone(times: int, status: int) -> None:
    design = SimpleNamespace(combinations=lambda first, stop: [{}] * (stop - first))
    plan = cast(SweepPlan, SimpleNamespace(design=design, together=1))
    blocks = list(run_blocks(BreakingPool(17, times), plan, [range(40)], lambda: None))
    found = {block.first + n: one for block in blocks for n, one in enumerate(block.status)}
    assert found == {run: status if run == 17 else DONE for run in range(40)}
