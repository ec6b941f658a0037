"""Legal types and extreme sizes: numbers of a shipped scenario replaced, for all kinds and methods.

Every run must end, by itself or at its limits, with a documented exit code; one that is done has
finite channels only, and a verdict of its audit.
"""

import random
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.io import hdf5_reader
from frictionsim.scenario.methods import SCIPY
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS

SIZES = (*(0.0, 1e-51, 1e-50, 1e-49, 1e-30, 1e-12, 1e-3, 0.5, 1.0, 2.0, 1e3), 1e12, 1e30, 1e49)
SIZES = (*SIZES, 1e50, 1e51, 1e150, 1e300, 5e-324)
BELT_METHODS = ("moreau", "rkf45")
METHODS = ("events", "rkf45")  # of one coordinate
# Belts take a step for each of their waves' ways through a body, and each has all bodies to move.
MAX_STEPS = {"belt_drive": 200}
TINY = 0.25  # share of tiny belts


@cache
def tiny_belts() -> tuple[dict[str, Any], ...]:
    """Return belts and guided strings of few bodies, for all of which `warm_up` compiles."""
    belts = []
    for backend in BELT_METHODS:
        short = {"solver__duration": 4e-3, "output__interval": 2e-4, "solver__backend": backend}
        for taken in ({}, {"effects__contact": None, "effects__bending": None}):
            belts.append(pair(**short, **taken))
    stiff = {"effects__axial_damping__coefficient": 200.0}  # moreau has steps of its own for it
    return (*belts, pair(**{**short, "solver__backend": "moreau"}, **stiff))


def warm_up() -> None:
    """Compile what steps the tiny belts."""
    for data in tiny_belts() if TINY else ():
        fs.solve(data)


@cache
def scenarios() -> tuple[dict[str, Any], ...]:
    """Return the shipped scenarios as data."""
    tables = [tomllib.loads(path.read_text()) for path in sorted(SCENARIOS.rglob("*.toml"))]
    return tuple(data for data in tables if "csv" not in str(data))


def numbers_of(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all numbers."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    paths = []
    for key, item in items:
        if isinstance(item, dict | list):
            paths += numbers_of(item, (*path, key))
        elif isinstance(item, int | float) and not isinstance(item, bool):
            paths.append((*path, key))
    return paths


def copied(data: Any) -> Any:
    """Return a copy of tables and lists."""
    if isinstance(data, dict):
        return {key: copied(item) for key, item in data.items()}
    return [copied(item) for item in data] if isinstance(data, list) else data


def attack(rng: random.Random, folder: Path) -> str:
    """Check, statically solve or solve a scenario with one to three extreme numbers."""
    tiny = rng.random() < TINY
    data = copied(rng.choice(tiny_belts() if tiny else scenarios()))
    changed = rng.sample(numbers_of(data), k=rng.choice([1, 1, 2, 3]))
    for path in changed:
        table = data
        for key in path[:-1]:
            table = table[key]
        size = rng.choice(SIZES) * rng.choice([1, 1, 1, -1])
        whole = isinstance(table[path[-1]], int) and abs(size) < 1e18
        table[path[-1]] = int(size) if whole else size
    kind = data["kind"]
    solver = data.setdefault("solver", {})
    if kind != "belt_drive":
        solver["backend"] = rng.choice(METHODS)
        if rng.random() < 0.25:
            _take_scipy(rng, data)
    elif not tiny:
        solver["backend"] = rng.choice(BELT_METHODS)
    text = tomli_w.dumps(data)
    (folder / "s.toml").write_text(text)
    command = rng.choice(["check", "static", "solve", "solve"])
    compiled = tiny and not any(_value(data, path) == 0.0 for path in changed)
    if command == "solve" and kind == "belt_drive" and not compiled:
        command = "static"  # kernels would be compiled for each combination of effects
    steps = f"solver.max_steps={MAX_STEPS.get(kind, 3000)}"
    limits = ["--set", steps, "--max-wall", "2", "-q", "-o", "a.h5"]
    ending = outcome([command, "s.toml", *(limits if command == "solve" else [])], text)
    if ending in ("exit 0", "exit 3") and command == "solve":
        _check_result(folder / "a.h5", ending, text)
    return f"{command} {'of belts ' if tiny else ''}{ending}"


def _value(data: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        data = data[key]
    return data


def _take_scipy(rng: random.Random, data: dict[str, Any]) -> None:
    """Have one of SciPy's methods integrate a scenario of one coordinate, with few steps."""
    for name, effect in data.get("effects", {}).items():
        if name.endswith("_friction"):
            effect["law"] = "regularised"
    data["solver"]["backend"] = rng.choice(SCIPY)
    data["solver"].pop("step", None)


def _check_result(path: Path, ending: str, text: str) -> None:
    try:
        record = hdf5_reader.read(path)
    except InputError as error:
        raise BrokenPromise(f"{ending}, but {error}\n{text}") from None
    for name, channel in record.channels.items():
        if not np.isfinite(channel).all():
            raise BrokenPromise(f"{ending}, but {name} is not finite\n{text}")
    if ending == "exit 0" and not all(check.ok for check in record.checks.values()):
        raise BrokenPromise(f"exit 0, but {record.checks}\n{text}")
