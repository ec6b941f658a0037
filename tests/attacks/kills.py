"""Attacks by SIGKILL: at the moment that a file appears, a little later, or at any time."""

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.attacks.promise import BrokenPromise, outcome
from tests.support.old_results import old_result
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import started

SAVING = ("--set", "output.checkpoint=5e-3")  # of wall time: checkpoints all the time
COMMANDS = {
    "run": ("pulley.toml", "--set", "solver.duration=4", "--set", "output.interval=5e-3"),
    "run of a belt": ("belt_drive.toml", "--backend", "moreau", "--set", "solver.duration=0.05"),
    "run of a string": ("belt_string.toml", "--set", "solver.duration=0.05"),
    "run of a lift": ("lift.toml",),
    "picture": ("plot", "source.h5"),
    "fit": (
        *("fit", str(SCENARIOS / "pulley.toml"), "--data", "source.csv", "--starts", "1"),
        *("--channel", "angular_velocity", "--free", "effects.shaft_friction.mu_s=0.05:0.4"),
    ),
    "costs": (
        *("cost", str(SCENARIOS / "pulley.toml"), "--backends", "events", "--tolerances", "1e-3"),
        *("--repeats", "1"),
    ),
}
TARGETS = {"picture": ("-o", "a.png"), "fit": ("-o", "a.toml"), "costs": ("--csv", "a.csv")}
OLD = {"a.h5": old_result(), "a.png": b"\x89PNG\r\n\x1a\nold", "a.csv": b"law,backend,setting,old"}
MAX_START = 20.0  # s
SOURCES = ("source.h5", "source.csv")


def _arguments(name: str) -> list[str]:
    arguments = list(COMMANDS[name])
    if name.startswith("run"):
        arguments = ["solve", str(SCENARIOS / arguments[0]), "-q", *SAVING, *arguments[1:]]
    return arguments + list(_target(name))


def _target(name: str) -> tuple[str, str]:
    return TARGETS.get(name, ("-o", "a.h5"))


@cache
def _whole() -> dict[str, bytes]:
    """Return the whole files that can be foretold, by command, and the sources; made once."""
    whole = {}
    with TemporaryDirectory() as name, chdir(name):
        outcome([*_arguments("run")[:-1], "source.h5"], "original")
        Path("source.csv").write_text(
            "time,angular_velocity\n" + "\n".join(f"{0.3 * i},{0.1 * i}" for i in range(5))
        )
        for command in COMMANDS:
            outcome(_arguments(command), "original")
            path = Path(_target(command)[1])
            whole[command] = path.read_bytes()
            path.unlink()
        return whole | {source: Path(source).read_bytes() for source in SOURCES}


def attack(rng: random.Random, folder: Path) -> str:
    """Kill a command."""
    return trial(rng, folder, _killed)


def trial(
    rng: random.Random, folder: Path, stop: Callable[[random.Random, list[str], Path], str]
) -> str:
    """Stop a command; the file is old or whole, and the next command leaves nothing else.

    The function starts the command, stops it, and returns when.
    """
    name = rng.choice([*COMMANDS])
    target, arguments = _target(name)[1], _arguments(name)
    for source in SOURCES:
        (folder / source).write_bytes(_whole()[source])
    old = OLD.get(target) if rng.random() < 0.5 else None
    if old is not None:
        (folder / target).write_bytes(old)
    when = stop(rng, arguments, folder)
    state = _state(name, folder / target, old, f"{arguments}, stopped {when}")
    if (folder / "a.partial.h5").exists() and rng.random() < 0.7:
        state, arguments = "interrupted", ["resume", "a.partial.h5", "-q"]
    if not (state == "done" and target == "a.toml"):  # which is not replaced
        outcome(arguments, f"again, stopped {when}, {state}")
    if any((folder / source).read_bytes() != _whole()[source] for source in SOURCES):
        raise BrokenPromise(f"an input was changed, stopped {when}, {state}: {arguments}")
    left = {*os.listdir(folder)} - {target, *SOURCES}
    if left or not (folder / target).exists():
        raise BrokenPromise(f"{left} are left over, stopped {when}, {state}: {arguments}")
    if name != "costs" and (folder / target).read_bytes() != _whole()[name]:
        raise BrokenPromise(f"{target} has other bytes, stopped {when}, {state}: {arguments}")
    return f"{name} {state}"


def _killed(rng: random.Random, arguments: list[str], folder: Path) -> str:
    """Start a command, kill it, and return when."""
    with started(arguments, folder) as process:
        when = wait(rng, process, folder, 0.8, 1.5)
        process.send_signal(signal.SIGKILL)
    return when


def wait(
    rng: random.Random,
    process: "subprocess.Popen[bytes]",
    folder: Path,
    at_file: float,
    latest: float,
) -> str:
    """Wait until files appear, with a probability, or for a time, s; return how long."""
    waits_for_files = rng.random() < at_file
    count = rng.choice((1, 1, 2, 3, 5))
    pause = rng.choice((0.0, 1e-4, 1e-3, 1e-2, 2.0)) * rng.random()
    late = rng.uniform(0.0, latest)
    if not waits_for_files:
        time.sleep(late)
        return f"after {late:.3g} s"
    _wait_for_files(process, folder, count)
    time.sleep(pause)
    return f"{pause:.2g} s after {count} new names"


def _wait_for_files(process: "subprocess.Popen[bytes]", folder: Path, count: int) -> None:
    """Wait until that many new names have appeared, or the end."""
    seen, latest = set(os.listdir(folder)), time.monotonic() + MAX_START
    wanted = len(seen) + count
    while len(seen) < wanted and process.poll() is None and time.monotonic() < latest:
        seen.update(os.listdir(folder))


def _state(name: str, path: Path, old: bytes | None, described: str) -> str:
    """Return the state of a file after a kill."""
    if not path.exists():
        if old is None:
            return "absent"
        raise BrokenPromise(f"{path.name} is lost: {described}")
    content = path.read_bytes()
    if content == old:
        return "old"
    times_differ = content.startswith(b"law,backend,setting,") and content.endswith(b"\r\n")
    if content == _whole()[name] or (name == "costs" and times_differ):
        return "done"
    raise BrokenPromise(f"{path.name} is neither old nor whole: {described}")


warm_up = _whole
