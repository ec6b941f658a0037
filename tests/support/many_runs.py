"""Runs together against the same runs alone."""

import copy
import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from frictionsim.parameter_study.block import RunBlock, block_of
from frictionsim.parameter_study.single_run import Task, outcome_of, run_task
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation import combinations
from frictionsim.simulation.combinations import Combinations
from frictionsim.solvers.compilation import Kernel

FACTORS = (1.0, 1.0 + 1e-9, 0.9, 1.1, 0.5, 2.0)
FIRST = 7  # number of the first run of a block


def interpret(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Python run what is compiled elsewhere: compiling each form takes ten seconds."""
    monkeypatch.setattr(Kernel, "compiled", lambda self, call: _interpreted(self._function))


def _interpreted(function: Callable[..., int]) -> Callable[..., int]:
    """Return the function for arrays whose parts share their memory, as in compiled code."""

    def call(
        template: Any, numbers: Any, states: Any, rows: Any, events: Any, progress: Any, steps: Any
    ) -> int:
        views = [memoryview(state) for state in states]
        buffers = memoryview(rows), memoryview(events)
        return function(template, numbers, views, *buffers, progress, steps)

    return call


def together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the runs of every sweep go together, however few they are."""
    interpret(monkeypatch)
    for name in ("RUNS_THAT_PAY", "RUNS_THAT_PAY_COMPILING"):
        monkeypatch.setattr(combinations, name, 1)


def block_together(scenario: Scenario, vary: dict[str, Sequence[Any]]) -> RunBlock:
    """Return the outcomes of runs that go together as far as they can."""
    return run_task(*_sweep(scenario, vary))


def block_alone(scenario: Scenario, vary: dict[str, Sequence[Any]]) -> RunBlock:
    """Return the outcomes of the same runs one by one."""
    of_sweep, task = _sweep(scenario, vary)
    return block_of(FIRST, [(i, outcome_of(of_sweep, v)) for i, v in enumerate(task.values)])


def _sweep(scenario: Scenario, vary: dict[str, Sequence[Any]]) -> tuple[Combinations, Task]:
    values = list(zip(*vary.values(), strict=True))
    return Combinations(scenario, list(vary), len(values)), Task(FIRST, values)


def content(block: RunBlock) -> Any:
    """Return all of a block, to the last bit and in its order."""
    status, values = block.status.tolist(), np.asarray(block.values).tobytes()
    return block.first, status, list(block.units.items()), values, block.texts


def numbers_in(tables: Any, above: str = "") -> Iterator[tuple[str, float]]:
    """Yield the keys of all numbers of double precision in the data of a scenario."""
    items: Sequence[tuple[Any, Any]] = (
        list(tables.items()) if isinstance(tables, dict) else list(enumerate(tables))
    )
    for key, value in items:
        path = f"{above}.{key}" if above else str(key)
        if isinstance(value, dict | list):
            yield from numbers_in(value, path)
        elif isinstance(value, float):
            yield path, value


def varied(data: dict[str, Any], rng: random.Random, count: int) -> dict[str, list[float]]:
    """Return values of some keys, of which some are out of bounds, equal, or in another order."""
    known = dict(numbers_in(copy.deepcopy(data)))
    keys = rng.sample(sorted(known), min(len(known), rng.randint(1, 3)))
    return {
        key: [
            known[key] * rng.choice((*FACTORS, rng.uniform(0.3, 3.0), rng.choice((0.0, -1.0))))
            for _ in range(count)
        ]
        for key in keys
    }
