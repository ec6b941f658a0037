"""A checkpoint whose arrays are not those of its run is refused by name."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

State = dict[str, Any]
OTHER = "is of another type or shape"
SMOOTH = {"effects.shaft_friction.law": "regularised", "solver.backend": "rkf45"}
# Scenarios, changes, and after how many steps they are stopped.
RUNS: dict[str, tuple[str, dict[str, Any], int]] = {
    "events": ("pulley_return", {}, 200),
    "rkf45": ("pulley_return", {"solver.backend": "rkf45"}, 200),
    "smooth": ("pulley_return", {**SMOOTH, "effects.shaft_friction.transition_speed": 0.05}, 60),
    "lift": ("hard/lift_slack_rope", {}, 30),
    "string": ("belt_string", {"solver.duration": 4e-3, "output.interval": 2e-4}, 12),
}


@cache
def stopped(name: str) -> fs.Result:
    scenario, changes, steps = RUNS[name]
    result = fs.solve(SCENARIOS / f"{scenario}.toml", changes, max_steps=steps)
    assert result.failure == "budget_exceeded"
    return result


def written(name: str, folder: Path, change: Callable[[State], object]) -> Path:
    """Write a run that was stopped, with a change to its state; return its file."""
    record = stopped(name).record
    state = dict(record.checkpoint or {})
    change(state)
    return fs.Result(record._replace(checkpoint=state)).save(folder / "a.partial.h5")


def less_one(name: str) -> Callable[[State], None]:
    return lambda state: state.update({name: state[name][:-1].copy()})


def infinite(name: str) -> Callable[[State], None]:
    return lambda state: state.update({name: np.full_like(state[name], np.inf)})


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("rkf45", less_one("step.y"), f"'step.y' {OTHER}"),
        ("events", less_one("state.y"), f"'state.y' {OTHER}"),
        ("lift", less_one("state.modes"), f"'state.modes' {OTHER}"),
        ("rkf45", less_one("samples.angle"), f"'samples.angle' {OTHER}"),
        ("events", less_one("sides"), f"'sides' {OTHER}"),
        ("rkf45", less_one("transitions"), f"'transitions' {OTHER}"),
        ("rkf45", lambda s: s.pop("state.t"), "'state.t' is missing"),
        ("rkf45", lambda s: s.update(a=np.zeros(2)), "'a' is unknown"),
        ("events", infinite("state.t"), "'state.t' is not finite"),
        ("string", less_one("stepping.y"), f"'stepping.y' {OTHER}"),
        ("string", infinite("samples._excess"), "'samples._excess' is not finite"),
    ],
)
def test_arrays_are_those_of_the_run(
    name: str, change: Callable[[State], None], message: str, tmp_path: Path
) -> None:
    path = written(name, tmp_path, change)
    before = path.read_bytes()
    with pytest.raises(fs.InputError) as refused:
        fs.resume(path)
    assert path.read_bytes() == before
    assert str(refused.value) == (
        f"{path}: cannot resume this run: its checkpoint does not belong to this scenario or was"
        f" changed: {message}"
    )


def test_errors_of_a_progress_function_are_its_own() -> None:
    def progress(t: float) -> None:
        raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        fs.resume(stopped("events"), progress=progress)


def test_a_method_without_checkpoints_takes_none() -> None:
    record = stopped("smooth").record
    text = record.attributes["scenario"].replace('"rkf45"', '"radau"')
    record = record._replace(attributes={**record.attributes, "scenario": text})
    with pytest.raises(fs.InputError, match="its backend leaves no state to resume from"):
        fs.resume(fs.Result(record))
