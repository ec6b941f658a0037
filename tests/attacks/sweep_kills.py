"""Kill a sweep with SIGKILL at random times, resume it, and check that no file ever lies.

Each trial starts a sweep, kills it at a random time, with or without its workers, up to three times
in a row, and lets the last resumption end. After each kill the file must open, and each run that it
or its journal calls done must have the bits of an uninterrupted sweep; in the end the bytes are
those of that sweep, and no other file is left.
"""

import os
import random
import signal
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from frictionsim.io.hdf5_reader import read_sweep
from frictionsim.parameter_study.journal import SweepJournal, journal_name
from frictionsim.parameter_study.sweep import Assembly
from frictionsim.parameter_study.sweep_files import digest_of
from tests.support.sweep_files import command, started

RUNS = 1200
# Runs that go together would all be done before most kills.
ALONE = ("--set", "output.channels=['angle']")
MAX_WAIT = 4.0  # s, until a kill


@cache
def warm_up() -> tuple[bytes, Any]:
    """Return the file of an uninterrupted sweep and its table; made once."""
    with TemporaryDirectory() as name:
        return whole_sweep(Path(name))


def attack(rng: random.Random, folder: Path) -> str:
    """Kill a sweep; return how many times."""
    return f"{len(trial(rng, folder, *warm_up()))} kills"


def _killed(rng: random.Random, arguments: list[str], folder: Path) -> str:
    """Start a sweep, and kill it with or without its workers."""
    process = started(arguments, folder)
    time.sleep(rng.uniform(0.3, MAX_WAIT))
    if rng.random() < 0.5 and process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)  # and its workers
    else:
        process.kill()
    process.communicate()
    return "by SIGKILL"


def trial(
    rng: random.Random,
    folder: Path,
    whole: bytes,
    table: Any,
    stop: Callable[[random.Random, list[str], Path], str] = _killed,
) -> dict[str, int]:
    """Stop and resume a sweep; return how many runs were there after each stop."""
    path, part = folder / "s.h5", folder / "s.partial.h5"
    arguments, kept = [*command(RUNS, "s.h5", "-q", "-j", rng.choice("12"), *ALONE)], {}
    for number in range(rng.choice((1, 1, 2, 3))):
        stopped = f"{number}: {stop(rng, arguments, folder)}"
        time.sleep(0.2)  # for workers to see that they are alone
        if not part.exists():
            kept[stopped] = RUNS if path.exists() else 0
            break
        kept[stopped] = check(part, table)
        arguments = ["resume", part.name, "-q"]
    if not path.exists() or part.exists():
        process = started(arguments, folder)
        said = process.communicate()
        assert process.returncode == 0, said
    assert path.read_bytes() == whole, kept
    if journal_name(part).exists():  # killed just before it was removed; the next command does it
        started(["resume", "s.h5"], folder).communicate()
    left = set(os.listdir(folder)) - {"s.h5"}
    assert not left, left
    return kept


def check(path: Path, whole: Any) -> int:
    """Check the file and journal of a killed sweep; return how many runs are done."""
    table = read_sweep(path)
    assert table.attributes["status"] == "interrupted"
    assembly = Assembly(RUNS)
    assembly.restore(table)
    journal = SweepJournal(path)  # also: nobody else has it
    for block in journal.blocks(digest_of(table), table.runs):
        assembly.add(block)
    journal.close(remove=False)
    done = assembly.status != 0
    assert np.array_equal(assembly.status[done], whole.status[done])
    for name, values in assembly._columns.items():
        assert values[done].tobytes() == whole.values[name][done].tobytes(), name
        assert np.isnan(values[~done]).all()
    return int(done.sum())


def whole_sweep(folder: Path) -> tuple[bytes, Any]:
    """Return the file of an uninterrupted sweep and its table."""
    path = folder / "whole.h5"
    process = started(command(RUNS, path.name, "-q", *ALONE), folder)
    said = process.communicate()
    assert process.returncode == 0, said
    whole = path.read_bytes(), read_sweep(path)
    path.unlink()
    return whole
