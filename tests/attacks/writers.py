"""Two processes that write one file: the second is told, and the file of the first is whole."""

import os
import random
import time
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from tests.attacks.promise import BrokenPromise
from tests.support.sweep_files import PULLEY, started

LOADS = (2000.0, 2100.0)
SECONDS = 60.0


# A run takes several times as long as two processes may start apart: they overlap.
LONG = ("--backend", "rkf45", "--set", "solver.max_step=2e-4")


def _command(load: float, checkpoints: bool) -> list[str]:
    often = ["--set", "output.checkpoint=0.1"] if checkpoints else []
    changed = ["--set", f"mechanism.load={load}", *often]
    return ["solve", str(PULLEY), "-q", "-o", "a.h5", *LONG, *changed]


@cache
def originals() -> tuple[bytes, ...]:
    """Return the files that the commands write alone, without and with checkpoints."""
    folder, contents = Path(mkdtemp(prefix="attack-")), []
    for checkpoints in (False, True):
        for load in LOADS:
            started(_command(load, checkpoints), folder).communicate(timeout=SECONDS)
            contents.append((folder / "a.h5").read_bytes())
    return tuple(contents)


def attack(rng: random.Random, folder: Path) -> str:
    """Have two processes write one file at about the same time."""
    commands = [_command(load, rng.random() < 0.5) for load in LOADS]
    processes = []
    for command in commands:
        processes.append(started(command, folder))
        time.sleep(rng.choice((0.0, 0.0, rng.uniform(0.0, 0.5))))
    said = [process.communicate(timeout=SECONDS)[1].decode() for process in processes]
    codes = sorted(process.returncode for process in processes)
    case = f"{commands}: {codes}, {said}"
    if codes != [0, 4] or any("Traceback" in text for text in said):
        raise BrokenPromise(case)
    if (folder / "a.h5").read_bytes() not in originals():
        raise BrokenPromise(f"a.h5 is not whole: {case}")
    left = set(os.listdir(folder)) - {"a.h5", "a.new.h5"}
    if left:
        raise BrokenPromise(f"{left} are left over: {case}")
    return f"exit {codes[1]}"


warm_up = originals
