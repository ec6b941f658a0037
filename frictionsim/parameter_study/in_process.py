"""Runs the parts of a sweep one after the other in this process."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from frictionsim.parameter_study.single_run import Task, run_task
from frictionsim.parameter_study.sweep import SweepPlan, check_combinations

RUNS_AT_ONCE = 64


def parts(runs: Iterable[range], size: int) -> Iterator[range]:
    """Yield ranges of at most `size` runs."""
    for found in runs:
        for start in range(found.start, found.stop, size):
            yield range(start, min(start + size, found.stop))


class InProcess:
    """An `Execution` without other processes."""

    def check(self, plan: SweepPlan, on_checked: Callable[[int], Any]) -> None:
        """Check every combination."""
        for runs in parts([range(plan.design.runs)], RUNS_AT_ONCE):
            check_combinations(plan, runs)
            on_checked(len(runs))

    def blocks(self, plan: SweepPlan, left: Iterable[range]) -> Iterator[bytes]:
        """Yield the outcomes of one run after the other."""
        combinations = plan.combinations
        for runs in parts(left, 1):
            values = plan.design.combinations(runs.start, runs.stop)
            yield run_task(combinations, Task(runs.start, values), plan.series).to_bytes()
