"""Bytes of result files changed, overwritten, moved, cut off; the checksum renewed or not.

One changed byte is enough to have HDF5 crash or never return, so that the program must not notice.
"""

import random
import tempfile
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import frictionsim as fs
from frictionsim.io.checksum import LENGTH, checksum_trailer
from frictionsim.simulation import sample_store
from tests.attacks.promise import outcome
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS, changed, pulley
from tests.support.stopped_runs import interrupted_at

TARGET, SOUND = "a.h5", "sound.h5"
SMALL_SEGMENT = 50_000  # bytes, so that a short run of a belt is a long one
Files = dict[str, bytes]


@cache
def originals() -> list[Files]:
    """Return results with the files next to them: whole and interrupted ones of two kinds."""
    short = changed(pulley(), output__interval=0.1)
    belt = pair(solver__backend="moreau", solver__duration=0.15)
    runs: list[tuple[Any, Any, int]] = [
        (short, False, 0),
        (short, interrupted_at(0.6), 0),
        (belt, False, 0),
        (belt, interrupted_at(0.1), 0),
        (belt, False, SMALL_SEGMENT),
        (belt, interrupted_at(0.1), SMALL_SEGMENT),
    ]
    return [_files_of(*run) for run in runs]


def _files_of(scenario: dict[str, Any], progress: Any, segment: int) -> Files:
    size = segment or sample_store.SEGMENT_BYTES
    with (
        tempfile.TemporaryDirectory() as name,
        mock.patch.object(sample_store, "SEGMENT_BYTES", size),
    ):
        folder = Path(name)
        fs.solve(scenario, output=folder / TARGET, progress=progress)
        # An unfinished one has the name that earlier versions gave it.
        return {path.name.replace(".partial", ""): path.read_bytes() for path in folder.iterdir()}


def damaged(rng: random.Random, raw: bytearray) -> str:
    """Change some bytes in place; return a description of the change."""
    way = rng.choice(["byte", "byte", "byte", "bits", "run", "moved", "cut", "other"])
    if not raw:
        return "empty"
    if way == "byte":
        for _ in range(rng.choice([1, 1, 1, 2, 4])):
            place = rng.randrange(len(raw))
            old = raw[place]
            raw[place] = rng.choice([0, 1, 3, 255, rng.randrange(256), (old + 1) % 256])
    elif way == "bits":
        for _ in range(rng.choice([1, 2, 8, 100])):
            raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
    elif way == "run":
        a, length = rng.randrange(len(raw)), rng.choice([1, 8, 64, 4096])
        raw[a : a + length] = rng.choice([b"\x00", b"\xff", rng.randbytes(1)]) * length
    elif way == "moved":
        a, b = rng.randrange(len(raw)), rng.randrange(len(raw))
        raw[a : a + 512] = raw[b : b + 512]
    elif way == "cut":
        del raw[rng.randrange(len(raw)) :]
    else:
        raw[:] = rng.choice([b"", b"\x89HDF\r\n\x1a\n" + rng.randbytes(2000), b"x" * 100])
    return way


def damaged_file(rng: random.Random, whole: bytes) -> tuple[bytes, str]:
    """Return a file with changed bytes, and a description of the change.

    Its checksum is new, missing, or the old one.
    """
    content = bytearray(whole[:-LENGTH])
    way, seal = damaged(rng, content), rng.choice(["anew", "anew", "none", "none", "kept"])
    end = {"anew": checksum_trailer(bytes(content)), "none": b"", "kept": whole[-LENGTH:]}
    return bytes(content) + end[seal], f"{way}, checksum {seal}"


def use(rng: random.Random, folder: Path, description: str) -> str:
    """Have a command read the file TARGET in a folder, next to the result SOUND."""
    commands = [
        *4 * [["compare", TARGET, SOUND], ["compare", SOUND, TARGET, "--rtol", "0.1"]],
        *3 * [["show", TARGET], ["show", TARGET, "--json"], ["show", TARGET, "--csv"]],
        *4 * [["resume", TARGET, "-q", "-o", "b.h5", "--max-wall", "0.5"]],
        *2 * [["solve", "s.toml", "-q", "-o", TARGET, "--max-wall", "0.5"]],
        ["show", TARGET, "--scenario"],
        ["plot", TARGET, "-o", "a.svg"],
    ]
    arguments = rng.choice(commands)
    if arguments[0] == "solve":
        text = (SCENARIOS / "pulley.toml").read_text()
        (folder / "s.toml").write_text(text)
    return outcome(arguments, description)


def place(folder: Path, files: Files) -> None:
    """Write files into a folder."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)


def attack(rng: random.Random, folder: Path) -> str:
    """Damage a result, or a segment of one, and use it."""
    files = dict(rng.choice(originals()))
    name = TARGET if rng.random() < 0.8 else rng.choice(sorted(files))
    place(folder, {**files, SOUND: files[TARGET]})
    raw, way = damaged_file(rng, files[name])
    (folder / name).write_bytes(raw)
    return use(rng, folder, f"{name}: {way}")


warm_up = originals
