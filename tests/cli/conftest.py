"""Fixtures of the tests of the command line."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import tomli_w

from tests.support.scenarios import pulley

Run = Callable[..., tuple[str, str]]


def strict_json(text: str) -> Any:
    """Return JSON; NaN and Infinity are refused."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


# Constant torques, in steps so short that the run never ends; a checkpoint says that it runs.
LONG = pulley(
    drive__force=3000.0,
    effects__viscous_damping=None,
    solver={"backend": "rkf45", "duration": 1000.0, "max_step": 1e-5},
    output={"interval": 0.001, "checkpoint": 0.1},
)


def long_run(folder: Path, *after: str) -> "subprocess.Popen[str]":
    """Start the solution of a scenario that takes for ever, then of others; wait for its steps."""
    (folder / "long.toml").write_text(tomli_w.dumps(LONG), encoding="utf-8")
    command = [sys.executable, "-m", "frictionsim", "solve", "long.toml", *after, "-v"]
    process = subprocess.Popen(
        command, cwd=folder, text=True, encoding="utf-8", stdout=-1, stderr=-1
    )
    assert process.stderr is not None
    assert any("checkpoint at t = " in line for line in process.stderr)
    return process
