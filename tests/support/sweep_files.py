"""Small sweeps for tests, and changes to them."""

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
MU_S, LOAD = "effects.shaft_friction.mu_s", "mechanism.load"
LOOSE = {"solver.rtol": 1e-4}


def command(runs: int, target: str, *more: str) -> list[str]:
    vary = f"{LOAD}=lin(2000, 2400, {runs})"
    return [
        *("sweep", str(PULLEY), "--vary", vary, "--set", "solver.rtol=1e-4"),
        *("-o", target, *more),
    ]


def planned(vary: Any, overrides: Any, scenario: Any = PULLEY, **options: Any) -> fs.Sweep:
    """Return a sweep that was interrupted after its first runs."""

    def stop(progress: Any) -> None:
        if progress.done:
            raise KeyboardInterrupt

    with TemporaryDirectory() as folder:
        file = Path(folder) / "s.h5"
        try:
            return fs.sweep(
                scenario, vary, overrides, output=file, workers=1, progress=stop, **options
            )
        except KeyboardInterrupt:
            return fs.open_sweep(file)  # where all were done at once, it is whole


def started(arguments: list[str], folder: Path) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, "-m", "frictionsim", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=hasattr(os, "setsid"),
    )


def wait_for_runs(path: Path, process: "subprocess.Popen[bytes]", most: float = 60.0) -> None:
    """Wait until some runs are in an unfinished sweep."""
    latest = time.monotonic() + most
    while time.monotonic() < latest and process.poll() is None:
        if path.exists() and b"final_angle" in path.read_bytes():
            return
        time.sleep(0.005)
    raise AssertionError(f"{path} did not grow: {process.stderr and process.stderr.read()!r}")
