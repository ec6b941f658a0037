"""Two processes that write one file: the second is told, and the file of the first is whole."""

import os
import random
import shutil
import time
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from tests.attacks.promise import BrokenPromise
from tests.support.sweep_files import LOAD, PULLEY, started

LOADS = (2000.0, 2100.0)
SECONDS = 60.0
# A run takes several times as long as two processes may start apart: they overlap.
LONG = ("--set", "solver.backend=rkf45", "--set", "solver.max_step=2e-4")
TARGET, PART = "a.h5", "part.partial.h5"
RESUME = ["resume", PART, "-q", "-o", TARGET]


def _solve(load: float, checkpoints: bool, target: str = TARGET) -> list[str]:
    often = ["--set", "output.checkpoint=0.1"] if checkpoints else []
    changed = ["--set", f"{LOAD}={load}", *often]
    return ["solve", str(PULLEY), "-q", "-o", target, *LONG, *changed]


def _sweep(load: float) -> list[str]:
    vary = ["--vary", f"{LOAD}=[{load}]"]
    return ["sweep", str(PULLEY), "-q", "-j", "1", "-o", TARGET, *LONG, *vary]


@cache
def _originals() -> tuple[Path, tuple[bytes, ...]]:
    """Return an unfinished result, and the files that the commands write alone."""
    folder, contents = Path(mkdtemp(prefix="attack-")), []
    part = _solve(LOADS[0], True, "part.h5")
    started([*part, "--max-steps", "100"], folder).communicate(timeout=SECONDS)
    solved = [_solve(load, checkpoints) for checkpoints in (False, True) for load in LOADS]
    for command in (*solved, *map(_sweep, LOADS), RESUME):
        started(command, folder).communicate(timeout=SECONDS)
        contents.append((folder / TARGET).read_bytes())
        (folder / TARGET).unlink()
    return folder / PART, tuple(contents)


def attack(rng: random.Random, folder: Path) -> str:
    """Have two processes write one file at about the same time."""
    part, contents = _originals()
    shutil.copy(part, folder)
    solved = [_solve(load, rng.random() < 0.5) for load in LOADS]
    resumed = rng.sample([RESUME, solved[0]], k=2)
    commands = rng.choice([solved, [*map(_sweep, LOADS)], resumed])
    processes = []
    for command in commands:
        processes.append(started(command, folder))
        time.sleep(rng.choice((0.0, 0.0, rng.uniform(0.0, 0.5))))
    said = [process.communicate(timeout=SECONDS)[1].decode() for process in processes]
    codes = sorted(process.returncode for process in processes)
    case = f"{commands}: {codes}, {said}"
    if codes != [0, 4] or any("Traceback" in text for text in said):
        raise BrokenPromise(case)
    if (folder / TARGET).read_bytes() not in contents:
        raise BrokenPromise(f"{TARGET} is not whole: {case}")
    left = set(os.listdir(folder)) - {TARGET, "a.new.h5", PART}
    if left:
        raise BrokenPromise(f"{left} are left over: {case}")
    return f"exit {codes[1]}"


warm_up = _originals
