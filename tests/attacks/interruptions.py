"""Signals at random times to random commands: files stay whole, old or resumable."""

import os
import random
import signal
import subprocess
from pathlib import Path

import frictionsim as fs
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import FrictionsimError
from frictionsim.io import hdf5_reader
from tests.attacks import kills, sweep_kills
from tests.attacks.disturbed import COMMANDS, SECONDS, originals, prepare, undisturbed
from tests.attacks.kills import wait
from tests.attacks.promise import BrokenPromise
from tests.support.sweep_files import started

NUMBERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LINES = tuple(line for line, _ in COMMANDS if " - " not in line)
LATEST = 4.0  # s
# Some seconds each, the second compiled.
LONG = (
    "solve pulley.toml -o a.h5 --json --backend rkf45 --set solver.max_step=5e-5",
    "solve pulley.toml -o a.h5 --json --backend events --set solver.max_step=4e-7",
)


def attack(rng: random.Random, folder: Path) -> str:
    """Signal a command up to three times, in a sweep also its resumptions; check what remains."""
    kind = rng.choice(("sweep", "study or belt", "study or belt", "command"))
    if kind == "sweep":
        kept = sweep_kills.trial(rng, folder, *sweep_kills.warm_up(), interrupted)
        return f"sweep with {sum(0 < runs < sweep_kills.RUNS for runs in kept.values())} parts"
    if kind == "study or belt":
        return kills.trial(rng, folder, interrupted)
    line, code = rng.choice(LONG), 0
    if rng.random() < 0.5:
        line = rng.choice(LINES)
        code = undisturbed(line).code
    prepare(folder)
    before = {name: (folder / name).read_bytes() for name in os.listdir(originals())}
    old = rng.random() < 0.3 and "a.h5" in line
    if old:
        (folder / "a.h5").write_bytes(before["p.h5"])
    case = f"{line}: {interrupted(rng, line.split(), folder, code)}"
    for name, content in before.items():
        if (folder / name).read_bytes() != content:
            raise BrokenPromise(f"{case}: {name} was changed")
    return _left(case, folder, before["p.h5"] if old else None)


def interrupted(rng: random.Random, arguments: list[str], folder: Path, code: int = 0) -> str:
    """Start a command and signal it, or all of its processes as a terminal; return when.

    Its exit code must be that of a signal, or of the undisturbed command.
    """
    numbers = rng.choices(NUMBERS, k=rng.choice((1, 1, 1, 2, 3)))
    group, case = rng.random() < 0.5, ""
    process = started(arguments, folder)
    for number in numbers:
        case += f"{wait(rng, process, folder, 0.5, LATEST / len(numbers))} {number.name}, "
        if group and process.poll() is None:
            os.killpg(process.pid, number)
        process.send_signal(number)
    try:
        err = process.communicate(timeout=SECONDS)[1].decode()
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise BrokenPromise(f"{arguments}: {case}deaf") from None
    case = f"{case}of {'all' if group else 'one'}: exit {process.returncode}"
    # Python itself, before the program is reached, reports Ctrl-C by a traceback and with 1.
    early = "Traceback" in err and "in main" not in err and "multiprocessing" not in err
    allowed = {code, *(sign for n in numbers for sign in (-n, 128 + n))} | ({1} if early else set())
    if process.returncode not in allowed or ("Traceback" in err and not early):
        raise BrokenPromise(f"{arguments}: {case}\n{err}")
    if process.returncode == 0 and [*folder.glob("[as].partial.h5")]:
        raise BrokenPromise(f"{arguments}: {case}, unfinished")
    return case


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


def warm_up() -> None:
    """Make the input files; restore the signals that children of `nohup` or `&` would ignore."""
    for number in NUMBERS:
        signal.signal(number, signal.SIG_DFL)
    originals()
    fs.warm_up("pulley")
