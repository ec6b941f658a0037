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
# Runs that are done together are all done before most signals.
ONE_BY_ONE = ("--set", "output.channels=['angle']")


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


def journal_grows(path: Path, process: "subprocess.Popen[bytes]", most: float = 30.0) -> None:
    """Wait until some runs are in a journal."""
    log, latest = path.with_name(f"{path.name}-wal"), time.monotonic() + most
    while time.monotonic() < latest and process.poll() is None:
        if any(b"final_angle" in file.read_bytes() for file in (path, log) if file.exists()):
            return
        time.sleep(0.005)
    raise AssertionError(f"{path} did not grow: {process.stderr and process.stderr.read()!r}")
