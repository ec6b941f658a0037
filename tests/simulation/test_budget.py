"""A budget is a budget: it is not recorded, and a run that it stopped comes to the same bytes."""

from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
STRING = {"solver.duration": 4e-3, "output.interval": 2e-4, "solver.backend": "moreau"}


def tried(result: fs.Result) -> int:
    counts = result.statistics
    assert counts is not None
    return counts.steps + counts.rejected


@pytest.mark.parametrize(
    ("name", "changes"),
    [("pulley_return", {}), ("hoist_drum", {"solver.backend": "rkf45"}), ("belt_string", STRING)],
)
def test_a_run_in_parts_of_few_steps_gives_the_bytes_of_a_whole_one(
    name: str, changes: dict[str, Any], tmp_path: Path
) -> None:
    whole, part = tmp_path / "whole.h5", tmp_path / "part.h5"
    most = tried(fs.solve(name, changes, output=whole)) // 3 + 1
    result, parts = fs.solve(name, changes, output=part, max_steps=most), 1
    while result.status != "done":
        assert result.failure == "budget_exceeded"
        assert result.reason.startswith(f"limit of {most} steps reached at t = ")
        assert "; resume the run, raise the limit or " in result.reason
        assert result.scenario == fs.open(whole).scenario
        result, parts = fs.resume(part, max_steps=most), parts + 1
    assert 3 <= parts <= 4
    assert part.read_bytes() == whole.read_bytes()


def test_a_budget_is_that_of_each_part(tmp_path: Path) -> None:
    """Also of one that a signal ended before its steps were spent."""
    path = tmp_path / "a.h5"
    fs.solve(PULLEY, output=path, max_steps=40)
    assert fs.resume(path, max_wall=1e-9).failure == "budget_exceeded"
    before = tried(fs.open(path))
    assert tried(fs.resume(path, max_steps=40)) == before + 40


def test_the_limit_of_a_scenario_stays_and_gives_way_to_the_option(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fs.solve(PULLEY, {"solver.max_steps": 10}, output=path)
    for part in (2, 3):  # of as many steps each
        result = fs.resume(path)
        assert result.reason.startswith("limit of 10 steps reached")
        assert tried(result) == 10 * part
    done = fs.resume(path, max_steps=10**6)
    assert (done.status, done.scenario.solver.max_steps) == ("done", 10)


def test_the_second_run_of_an_error_estimate_has_the_limit_too() -> None:
    result = fs.solve(PULLEY, max_steps=tried(fs.solve(PULLEY)), estimate_error=True)
    assert result.status == "done"
    assert "limit of " in result.error_estimate
