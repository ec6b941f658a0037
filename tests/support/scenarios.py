"""The shipped scenarios as data, runs of them, and the command line."""

import copy
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record, failures

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"
GOLDEN = ROOT / "tests" / "golden"
Scenario = dict[str, Any]
FRICTION_EFFECTS = {"shaft_friction", "hinge_friction", "rolling_friction", "belt_friction"}


def pulley(**changes: Any) -> Scenario:
    """Return the shipped pulley as data; `solver__rtol=1e-6` sets solver.rtol, None removes."""
    return shipped("pulley", **changes)


def shipped(name: str, **changes: Any) -> Scenario:
    """Return a shipped scenario as data, with changes as in `pulley`."""
    data: Scenario = tomllib.loads((SCENARIOS / f"{name}.toml").read_text())
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


def with_method(data: Scenario, law: str, backend: str) -> Scenario:
    """Return scenario data with a friction law, in its friction effects if any, and a method."""
    data = changed(data, solver__backend=backend)
    for name in (data.get("effects") or {}).keys() & FRICTION_EFFECTS:
        data["effects"][name]["law"] = law
    return data


# Set before each test, as a test that patches the program must not get what the whole one gave.
program_is_patched = False


def simulate(data: Scenario) -> Record:
    """Return the result of scenario data, of an earlier run if there was one; arrays are read-only.

    A test that takes `monkeypatch` always gets a new run, as `run_anew` does.
    """
    try:
        text = json.dumps(data)
    except TypeError:  # not what a file can hold
        text = ""
    if program_is_patched or not text:
        return run_anew(data)
    return _own_containers(_remembered(text))


def sound(data: Scenario) -> Record:
    """Return the result of a run that is done and passes its audit."""
    return _sound(simulate(data))


def sound_file(path: Path, overrides: Sequence[str] = (), backend: str | None = None) -> Record:
    """Return the result of a run of a file that is done and passes its audit."""
    return _sound(fs.solve(fs.load(path, list(overrides), backend)).record)


def _sound(done: Record) -> Record:
    assert (done.status, done.reason) == ("done", "")
    assert failures(done.checks) == ""
    return done


def quantity(done: Record, name: str) -> float:
    """Return a quantity that a run must have."""
    value = done.quantities[name].value
    assert value is not None
    return value


def events(done: Record) -> list[tuple[str, int, int]]:
    """Return the contact and the modes of each change, without its time."""
    return [(e.contact, e.mode_from, e.mode_to) for e in done.transitions]


def times(done: Record) -> list[float]:
    return [e.time for e in done.transitions]


def run_anew(data: Scenario) -> Record:
    return fs.solve(fs.load(data, folder=SCENARIOS)).record


@lru_cache(maxsize=64)
def _remembered(text: str) -> Record:
    done = run_anew(json.loads(text))
    for values in (done.time, *done.channels.values(), *done.events.values()):
        if isinstance(values, np.ndarray):
            values.flags.writeable = False
    return done


def _own_containers(done: Record) -> Record:
    names = ("attributes", "channels", "events", "quantities", "checks")
    copied: dict[str, Any] = {name: copy.copy(getattr(done, name)) for name in names}
    return done._replace(**copied, checkpoint=copy.deepcopy(done.checkpoint))


def scenario_run(done: Record) -> Any:
    return fs.load(tomllib.loads(done.attributes["scenario"]), folder=SCENARIOS)


def in_this_process(
    capsys: pytest.CaptureFixture[str], *arguments: str | Path
) -> "subprocess.CompletedProcess[str]":
    """Run the command line in the working folder, without the start of a process."""
    capsys.readouterr()
    words = [str(argument) for argument in arguments]
    code = fs.run_command_line(words)
    said = capsys.readouterr()
    return subprocess.CompletedProcess(words, code, said.out, said.err)


def frictionsim(*arguments: str | Path, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """Run the command line in a new process."""
    return python("-m", "frictionsim", *arguments, cwd=cwd)


def python(
    *arguments: str | Path, cwd: Path = ROOT, **environment: str
) -> "subprocess.CompletedProcess[str]":
    """Run a new Python that finds this package, with some variables of the environment set."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
