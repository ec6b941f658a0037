"""Signals at random times to random commands: files stay whole, old or resumable."""

import os
import random
import signal
import subprocess
import time
from pathlib import Path

from frictionsim.cli.commands import run_command_line
from frictionsim.errors import FrictionsimError
from frictionsim.io import hdf5_reader
from tests.attacks.disturbed import COMMANDS, SECONDS, originals, prepare, undisturbed
from tests.attacks.promise import BrokenPromise
from tests.support.sweep_files import started

NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LINES = tuple(line for line, _ in COMMANDS if " - " not in line)
LATEST = 2.5  # s
LONG = (
    "solve pulley.toml -o a.h5 -q --backend rkf45 --set solver.max_step=2e-5",
    "solve pulley.toml -o a.h5 --json --backend rkf45 --set solver.max_step=2e-5"
    " --set output.checkpoint=0.05",
)


def attack(rng: random.Random, folder: Path) -> str:
    """Signal a command once or twice and check the remaining files."""
    line = rng.choice(LONG if rng.random() < 0.5 else LINES)
    number, times = rng.choice(NUMBERS), rng.choice((1, 1, 1, 2, 3))
    prepare(folder)
    before = {name: (folder / name).read_bytes() for name in os.listdir(originals())}
    old = rng.random() < 0.3 and "a.h5" in line
    if old:
        (folder / "a.h5").write_bytes(before["p.h5"])
    process = started(line.split(), folder)
    for _ in range(times):
        time.sleep(rng.uniform(0.0, LATEST / times))
        process.send_signal(number)
    case = f"{line}: {times} times {number.name}"
    try:
        err = process.communicate(timeout=SECONDS)[1].decode()
    except subprocess.TimeoutExpired:
        process.kill()
        raise BrokenPromise(f"{case}: deaf") from None
    allowed = {-number, 128 + number, undisturbed(line).code}
    # Python itself, before the package is reached, tells of Ctrl-C with a traceback.
    early = process.returncode in (-signal.SIGINT, 1) and "frictionsim/cli" not in err
    if process.returncode not in allowed and not early:
        raise BrokenPromise(f"{case}: exit {process.returncode}\n{err}")
    for name, content in before.items():
        if (folder / name).read_bytes() != content:
            raise BrokenPromise(f"{case}: {name} was changed")
    return _left(case, folder, before["p.h5"] if old else None)


def _left(case: str, folder: Path, old: bytes | None) -> str:
    for name, statuses in (("a.h5", {"done"}), ("a.partial.h5", {"interrupted", "failed"})):
        path = folder / name
        if not path.exists() or path.read_bytes() == old:
            continue
        try:
            status = str(hdf5_reader.read(path).attributes["status"])
        except FrictionsimError as error:
            raise BrokenPromise(f"{case}: {name} is not sound: {error}") from None
        if status not in statuses:
            raise BrokenPromise(f"{case}: {name} is {status}")
        if status == "interrupted" and run_command_line(["resume", str(path), "-q"]) != 0:
            raise BrokenPromise(f"{case}: cannot be resumed")
        return status
    return "absent" if old is None else "old"


warm_up = originals
