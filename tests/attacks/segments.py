"""Long runs on a full disk: the samples before are kept, and the run can be resumed."""

import os
import random
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import tomli_w

from frictionsim.io import hdf5_writer
from frictionsim.results import Record
from tests.attacks.checkpoints import belt, small_segments
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.belt_scenarios import pair

NAME = "run in segments"
MAX_SEGMENTS = 12  # of this run


def solve(folder: Path) -> str:
    """Solve the run in a folder."""
    (folder / "a.toml").write_text(tomli_w.dumps(belt(pair(), "moreau", output__interval=2e-5)))
    return outcome(["solve", str(folder / "a.toml"), "-q", "-o", str(folder / "a.h5")], NAME)


@cache
def whole() -> bytes:
    """Return the result of the run where there is room."""
    with TemporaryDirectory() as folder, small_segments(NAME):
        solve(Path(folder))
        return (Path(folder) / "a.h5").read_bytes()


@contextmanager
def room_for(segments: int, left: int) -> Iterator[None]:
    """Have files of few bytes only be written after some segments."""
    limits, write = resource.getrlimit(resource.RLIMIT_FSIZE), hdf5_writer.write_segment
    written: list[Path] = []

    def write_segment(record: Record, path: Path) -> int:
        if len(written) == segments:
            resource.setrlimit(resource.RLIMIT_FSIZE, (left, limits[1]))
        written.append(path)
        return write(record, path)

    hdf5_writer.write_segment = write_segment
    try:
        yield
    finally:
        hdf5_writer.write_segment = write
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def attack(rng: random.Random, folder: Path) -> str:
    """Fill the disk during a long run, free it, and resume the kept part."""
    segments, left = rng.randrange(1, MAX_SEGMENTS), rng.choice((0, 1000, 5000, 12_000, 30_000))
    case = f"room for {segments} segments and {left} bytes"
    with small_segments(NAME):
        with room_for(segments, left):
            code = solve(folder)
        kept = sorted(set(os.listdir(folder)) - {"a.toml"})
        expected = [f"a.{number:06d}.h5" for number in range(segments)] + ["a.partial.h5"]
        if (code, kept) != ("exit 4", expected):
            raise BrokenPromise(f"{case}: {code}, {kept} are left")
        if outcome(["resume", "a.partial.h5", "-q"], case) != "exit 0":
            raise BrokenPromise(f"{case}: it cannot be resumed")
    if sorted(os.listdir(folder)) != ["a.h5", "a.toml"] or Path("a.h5").read_bytes() != whole():
        raise BrokenPromise(f"{case}: the resumed run is not that of one with room")
    return code


warm_up = whole
