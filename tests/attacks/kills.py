"""Attacks by SIGKILL: at the moment that a file appears, a little later, or at any time."""

import os
import random
import signal
import subprocess
import time
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.attacks.promise import BrokenPromise, outcome
from tests.support.old_results import old_result
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import started

# Hundreds of cycles of stick and slip, with checkpoints all the time.
RUN = (
    *("solve", str(SCENARIOS / "pulley.toml"), "-q", "--set", "solver.duration=4"),
    *("--set", "output.interval=5e-3", "--set", "output.checkpoint=5e-3"),
)
COST = ("cost", str(SCENARIOS / "pulley.toml"), "--backends", "events", "--tolerances", "1e-3")
OLD = {"a.h5": old_result(), "a.png": b"\x89PNG\r\n\x1a\nold", "a.csv": b"law,backend,setting,old"}
MAX_START = 20.0  # s
SEEDED = "source.h5"


@cache
def _whole() -> dict[str, bytes]:
    """Return the bytes of the whole files that can be foretold; made once."""
    with TemporaryDirectory() as name:
        result, picture = f"{name}/a.h5", f"{name}/a.png"
        outcome([*RUN, "-o", result], "original")
        outcome(["plot", result, "-o", picture], "original")
        return {"a.h5": Path(result).read_bytes(), "a.png": Path(picture).read_bytes()}


def attack(rng: random.Random, folder: Path) -> str:
    """Kill a command; the file is old or whole, and the next command leaves nothing else."""
    target = rng.choice(("a.h5", "a.h5", "a.png", "a.csv"))
    arguments = {
        "a.h5": [*RUN, "-o", target],
        "a.png": ["plot", SEEDED, "-o", target],
        "a.csv": [*COST, "--repeats", "1", "--csv", target],
    }[target]
    (folder / SEEDED).write_bytes(_whole()["a.h5"])
    old = OLD[target] if rng.random() < 0.5 else None
    if old is not None:
        (folder / target).write_bytes(old)
    when = _killed(rng, arguments, folder)
    state = _state(folder, target, old, f"{arguments}, killed {when}")
    if (folder / "a.partial.h5").exists() and rng.random() < 0.7:
        state, arguments = "interrupted", ["resume", "a.partial.h5", "-q"]
    outcome(arguments, f"again after a kill {when}, {state}")
    (folder / SEEDED).unlink()
    left = [name for name in os.listdir(folder) if name != target]
    if left or not (folder / target).exists():
        raise BrokenPromise(f"{left} are left over after a kill {when}, {state}: {arguments}")
    if target in _whole() and (folder / target).read_bytes() != _whole()[target]:
        raise BrokenPromise(f"{target} has other bytes after a kill {when}, {state}: {arguments}")
    return f"{target} {state}"


def _killed(rng: random.Random, arguments: list[str], folder: Path) -> str:
    """Start a command, kill it, and return when."""
    at_file = rng.random() < 0.8
    count, pause = rng.choice((1, 1, 2, 3, 5)), rng.choice((0.0, 1e-4, 1e-3, 1e-2)) * rng.random()
    late = rng.uniform(0.0, 1.5)
    with started(arguments, folder) as process:
        if at_file:
            _wait_for_files(process, folder, count)
            time.sleep(pause)
        else:
            time.sleep(late)
        process.send_signal(signal.SIGKILL)
    return f"{pause:.2g} s after {count} new names" if at_file else f"after {late:.3g} s"


def _wait_for_files(process: "subprocess.Popen[bytes]", folder: Path, count: int) -> None:
    """Wait until that many new names have appeared, or the end."""
    seen, latest = set(os.listdir(folder)), time.monotonic() + MAX_START
    wanted = len(seen) + count
    while len(seen) < wanted and process.poll() is None and time.monotonic() < latest:
        seen.update(os.listdir(folder))


def _state(folder: Path, target: str, old: bytes | None, described: str) -> str:
    """Return the state of the files after a kill."""
    path = folder / target
    if not path.exists():
        if old is None:
            return "absent"
        raise BrokenPromise(f"{target} is lost: {described}")
    content = path.read_bytes()
    if content == old:
        return "old"
    if target == "a.csv":
        if content.startswith(b"law,backend,setting,") and content.endswith(b"\r\n"):
            return "done"
    elif content == _whole()[target]:
        return "done"
    raise BrokenPromise(f"{target} is neither old nor whole: {described}")


warm_up = _whole
