"""Runs together against the same runs alone."""

import copy
import random
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from frictionsim.errors import SolverError
from frictionsim.parameter_study import combinations
from frictionsim.results import SimulationResult
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import validate
from frictionsim.scenario.model_validation import ValidationFailure
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation.single_dof import SingleDofSimulation
from frictionsim.solvers import event_driven
from frictionsim.solvers.compilation import Kernel

FACTORS = (1.0, 1.0 + 1e-9, 0.9, 1.1, 0.5, 2.0)


def interpret(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Python run what is compiled elsewhere: compiling each form takes ten seconds."""
    monkeypatch.setattr(Kernel, "compiled", lambda self, call: self._function)
    monkeypatch.setattr(event_driven, "as_argument", lambda value: value)


def together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the runs of every sweep go together, however few they are."""
    interpret(monkeypatch)
    monkeypatch.setattr(combinations, "RUNS_THAT_PAY", 1)
    monkeypatch.setattr(combinations, "RUNS_THAT_PAY_COMPILING", 1)


def alone(scenario: Scenario) -> SimulationResult | None:
    """Return the result of a run with samples at start, events and end; None if it fails."""
    output = scenario.output.model_copy(update={"interval": scenario.solver.duration})
    sparse = scenario.model_copy(update={"output": output})
    build = mechanism_module(scenario.kind).build  # type: ignore[attr-defined]
    simulation = SingleDofSimulation(sparse, build(sparse))
    try:
        simulation.solve(lambda t: None)
    except (SolverError, ArithmeticError):
        return None
    return simulation.observe()


def content(result: SimulationResult | None) -> Any:
    """Return what is equal to the last bit of a run alone and with others."""
    if result is None:
        return None
    found = (result.quantities, result.checks, result.transitions, result.time.tolist())
    return [list(table.items()) if isinstance(table, dict) else table for table in found]


def varied(data: dict[str, Any], rng: random.Random, count: int) -> list[Scenario]:
    """Return scenarios like one, each with some of its numbers multiplied; valid ones only."""
    found: list[Scenario] = []
    for _ in range(3 * count):
        changed = copy.deepcopy(data)
        for table, key in _numbers(changed):
            if rng.random() < 0.6:
                table[key] *= rng.choice((*FACTORS, rng.uniform(0.3, 3.0)))
        try:
            found.append(validate(changed, Path()))
        except ValidationFailure:
            continue
    return found[:count]


def _numbers(tables: Any) -> Iterator[tuple[Any, Any]]:
    items: Sequence[tuple[Any, Any]] = (
        list(tables.items()) if isinstance(tables, dict) else list(enumerate(tables))
    )
    for key, value in items:
        if isinstance(value, dict | list):
            yield from _numbers(value)
        elif isinstance(value, float):
            yield tables, key
