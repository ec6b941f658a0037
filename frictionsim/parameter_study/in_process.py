"""Runs the parts of a sweep one after the other in this process."""

from collections.abc import Callable, Iterable, Iterator
from time import monotonic
from typing import Any

from frictionsim.parameter_study.block_sizes import BlockSizes
from frictionsim.parameter_study.single_run import Task, run_task
from frictionsim.parameter_study.sweep import SweepPlan, check_combinations

RUNS_AT_ONCE = 64
SECONDS_OF_A_BLOCK = 0.3  # which a kill may cost
SECONDS_BETWEEN_BEATS = 0.1
STEPS_BETWEEN_BEATS = 256  # reading the clock costs a tenth of a step


def parts(runs: Iterable[range], size: int) -> Iterator[range]:
    """Yield ranges of at most `size` runs."""
    for found in runs:
        for start in range(found.start, found.stop, size):
            yield range(start, min(start + size, found.stop))


class InProcess:
    """An `Execution` without other processes."""

    def check(
        self,
        plan: SweepPlan,
        left: Iterable[range],
        on_checked: Callable[[int], Any],
        beat: Callable[[], Any],
    ) -> None:
        """Check the combinations of runs."""
        for runs in parts(left, RUNS_AT_ONCE):
            check_combinations(plan, runs)
            on_checked(len(runs))
            beat()

    def blocks(
        self, plan: SweepPlan, left: Iterable[range], beat: Callable[[], Any]
    ) -> Iterator[bytes]:
        """Yield the outcomes of one run after the other, or of many in lockstep."""
        combinations, on_step = plan.combinations, _OnStep(beat)
        ranges, together = list(left), plan.together
        sizes = BlockSizes(SECONDS_OF_A_BLOCK, sum(map(len, ranges)), together)
        for found in ranges:
            start = found.start
            while start < found.stop:
                size = sizes.next(workers=1) if together > 1 else 1
                stop = min(start + size, found.stop)
                sizes.took(stop - start)
                values, began = plan.design.combinations(start, stop), monotonic()
                try:
                    block = run_task(combinations, Task(start, values), plan.series, on_step)
                except _Stopped as stopped:
                    raise stopped.reason from None
                sizes.learn(stop - start, monotonic() - began)
                yield block.to_bytes()
                on_step.beat_in_time()
                start = stop

    def close(self) -> None:
        """Do nothing."""


class _Stopped(BaseException):
    """What ends the sweep within a run, and must not be taken for a failure of the run."""

    def __init__(self, reason: BaseException) -> None:
        super().__init__()
        self.reason = reason


class _OnStep:
    """The `on_step` of all runs, which keeps `beat` going."""

    def __init__(self, beat: Callable[[], Any]) -> None:
        self._beat, self._calls, self._last = beat, 0, monotonic()

    def __call__(self, t: float) -> None:
        self._calls += 1
        if self._calls % STEPS_BETWEEN_BEATS:
            return
        try:
            self.beat_in_time()
        except BaseException as error:
            raise _Stopped(error) from None

    def beat_in_time(self) -> None:
        """Call `beat` if it is time."""
        now = monotonic()
        if now - self._last >= SECONDS_BETWEEN_BEATS:
            self._last = now
            self._beat()
