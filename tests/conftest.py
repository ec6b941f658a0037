"""What all tests share: the shipped scenario as data, runs of it, and the command line."""

import copy
import json
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from frictionsim.mechanisms import module_of
from frictionsim.mechanisms.base import Mechanism
from frictionsim.run import Run, run
from frictionsim.scenario import validate

ROOT = Path(__file__).parent.parent
SCENARIOS = ROOT / "scenarios"
GOLDEN = Path(__file__).parent / "golden"

Scenario = dict[str, Any]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write the golden files anew from this run"
    )


def pulley(**changes: Any) -> Scenario:
    """Return the shipped pulley as data; `solver__rtol=1e-6` sets solver.rtol, None removes."""
    data: Scenario = tomllib.loads((SCENARIOS / "pulley.toml").read_text())
    return changed(data, **changes)


def changed(data: Scenario, **changes: Any) -> Scenario:
    """Return a copy of scenario data with keys set, or removed where the value is None."""
    data = copy.deepcopy(data)
    for key, value in changes.items():
        *tables, last = key.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        if value is None:
            table.pop(last, None)
        else:
            table[last] = value
    return data


def simulate(data: Scenario) -> Run:
    """Run scenario data, nobody watching."""
    return run(validate(data, SCENARIOS), lambda t: None)


def mechanism_of(done: Run) -> Mechanism:
    """Return the equations of a run of one coordinate."""
    return module_of(done.scene.kind).build(done.scene)


def frictionsim(*arguments: str | Path, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """Run the command line as a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "frictionsim", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def cli(tmp_path: Path) -> Callable[..., "subprocess.CompletedProcess[str]"]:
    """Run the command line in a folder of its own."""
    return lambda *arguments: frictionsim(*arguments, cwd=tmp_path)


@pytest.fixture(scope="session")
def tally(request: pytest.FixtureRequest) -> Iterator[dict[str, int]]:
    """Count cases by name; a long run writes the counts down."""
    counts: dict[str, int] = {}
    yield counts
    if request.config.option.markexpr == "long":
        path = ROOT / "results" / "hard.json"
        before = json.loads(path.read_text()) if path.exists() else {}
        path.write_text(json.dumps(dict(sorted({**before, **counts}.items())), indent=2) + "\n")
