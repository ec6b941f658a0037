"""Attacks on output targets: foreign files, links, devices, modes, long names, full disks."""

import os
import random
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py

from tests.attacks.promise import BrokenPromise, outcome
from tests.support.file_sizes import limited_files
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
COST = ("--backends", "events", "--tolerances", "1e-3", "--repeats", "1")
SWEEP = ("--vary", "mechanism.load=[2000.0, 2100.0]", "-j", "1", "-q")
RESUMED = "source.partial.h5"
DERIVED = "source.h5"  # where the resumed run is written if no other name is given
NAMES = (
    DERIVED,
    "a.h5",
    "a.nc",
    "a",
    "a.png",
    "a.svg",
    "a.csv",
    "s.toml",
    "a.partial.h5",
    "a.html",
)
KINDS = (
    *("none", "empty", "text", "foreign", "scenario", "result", "damaged", "incomplete"),
    *("picture", "table", "report", "folder", "dangling", "loop", "fifo", "device"),
)
OURS = {"empty", "result", "damaged", "incomplete", "picture", "table", "report"}


@cache
def _originals() -> dict[str, bytes]:
    """Return possible contents of a target, by kind; made once."""
    contents = {"empty": b"", "text": b"precious\n", "scenario": PULLEY.read_bytes()}
    with TemporaryDirectory() as name:
        folder = Path(name)
        with h5py.File(folder / "foreign.h5", "w") as file:
            file["measured"] = [1.0, 2.0]
        run = ["solve", str(PULLEY), "-q", "-o"]
        outcome([*run, str(folder / "result.h5")], "original")
        outcome([*run, str(folder / "incomplete.h5"), "--max-steps", "60"], "original")
        outcome(["plot", f"{folder}/result.h5", "-o", f"{folder}/picture.png"], "original")
        outcome(["report", f"{folder}/result.h5", "-o", f"{folder}/report.html"], "original")
        outcome(["cost", str(PULLEY), *COST, "--csv", str(folder / "table.csv")], "original")
        for path in folder.iterdir():
            contents[path.name.partition(".")[0]] = path.read_bytes()
    result = bytearray(contents["result"])
    result[len(result) // 2] ^= 1
    return contents | {"damaged": bytes(result)}


def _place(rng: random.Random, path: Path, kind: str) -> None:
    """Put something of a kind at a path."""
    if kind == "folder":
        path.mkdir()
    elif kind == "dangling":
        path.symlink_to("none/a.h5" if rng.random() < 0.5 else "nothing.h5")
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/null")
    elif kind != "none":
        place = path
        if rng.random() < 0.3:
            place = Path(f"there{path.suffix}")
            path.symlink_to(place)
        place.write_bytes(_originals()[kind])
        place.chmod(rng.choice((0o644, 0o600, 0o640, 0o664, 0o777, 0o444, 0o000)))


def _command(rng: random.Random, target: str) -> list[str]:
    if target == DERIVED:
        return ["resume", RESUMED, "-q"]
    whole = ["solve", str(PULLEY), "-q", "-o", target]
    return rng.choice(
        [
            whole,
            [*whole, "--set", "output.checkpoint=1e-3"],
            [*whole, "--max-steps", "60"],
            ["resume", RESUMED, "-q", "-o", target],
            ["plot", "source.h5", "-o", target],
            ["report", "source.h5", "-o", target],
            ["sweep", str(PULLEY), *SWEEP, "-o", target],
            *(["cost", str(PULLEY), *COST, option, target] for option in ("-o", "--csv", "--plot")),
        ]
    )


def _state(path: Path) -> tuple[str, int, bytes]:
    """Return the type, the mode and the content of a path."""
    if path.is_symlink():
        return os.readlink(path), 0, b""
    if path.is_file():
        mode = path.stat().st_mode & 0o777
        path.chmod(mode | 0o400)  # what its owner may not read, only root reads
        content = path.read_bytes()
        path.chmod(mode)
        return "file", mode, content
    return "other" if os.path.lexists(path) else "none", 0, b""


def attack(rng: random.Random, folder: Path) -> str:
    """Write to a target where something lies already; nothing of others may be lost."""
    originals = _originals()
    name = rng.choice(NAMES)
    if name != DERIVED:
        Path(DERIVED).write_bytes(originals["result"])
    Path(RESUMED).write_bytes(originals["incomplete"])
    if name != DERIVED and rng.random() < 0.2:
        length = rng.choice((200, 230, 247, 248, 254, 255, 256, 300)) - len(Path(name).suffix)
        name = rng.choice(("a" * length, "ä" * (length // 2))) + Path(name).suffix
    kind = rng.choice(KINDS)
    try:
        _place(rng, Path(name), kind)
    except (OSError, UnicodeEncodeError):  # a name that nothing can have
        kind = "none"
    before = {path.name: _state(path) for path in folder.iterdir()}
    arguments, is_full = _command(rng, name), rng.random() < 0.2
    described = f"{kind} at {name}, disk {'full' if is_full else 'free'}"
    with limited_files(rng.choice((0, 1000, 5000, 30_000))) if is_full else nullcontext():
        code = outcome(arguments, described)
    if name == DERIVED and Path(name).is_symlink() and code != "exit 4":
        raise BrokenPromise(f"{code} at a link that nobody named: {described}")
    _check(before, folder, kind, code, f"{arguments}: {code}, {described}")
    return f"{arguments[0]} {code}"


def _check(
    before: dict[str, tuple[str, int, bytes]], folder: Path, kind: str, code: str, described: str
) -> None:
    """Check the present content of the folder."""
    for name, (state, mode, content) in before.items():
        now = _state(folder / name)
        if now == (state, mode, content):
            continue
        may_go = name.endswith(".partial.h5")
        if not may_go and (now[:2] != (state, mode) or kind not in OURS):
            raise BrokenPromise(f"{name} was {state} {mode:o}, is {now[0]} {now[1]:o}: {described}")
        if code == "exit 4" and kind not in ("incomplete", "empty"):
            raise BrokenPromise(f"{name} was replaced: {described}")
    left = [path.name for path in folder.iterdir() if path.name.startswith(".")]
    if left:
        raise BrokenPromise(f"{left} are left over: {described}")
    for path in folder.iterdir():
        is_result = path.name not in before and described.startswith(
            ("['solve'", "['resume'", "['sweep'")
        )
        if is_result and outcome(["show", str(path)], described) != "exit 0":
            raise BrokenPromise(f"{path.name} cannot be read: {described}")


warm_up = _originals
