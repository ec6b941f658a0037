"""Long runs on a full disk, whose samples before are kept and can be resumed, and crafted segments.

Segments and their list may come from anyone: their checksums are those of what they hold.
"""

import os
import random
import resource
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zlib import compress

import h5py
import numpy as np
import tomli_w

from frictionsim.io import hdf5_writer
from frictionsim.io.checksum import SEGMENT, append_trailer
from frictionsim.io.segments import SegmentFiles, combined
from frictionsim.io.unfinished import whole_name
from frictionsim.results import Record
from tests.attacks import checkpoints
from tests.attacks.checkpoints import belt, small_segments
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.belt_scenarios import pair

NAME = "belt in segments"
MAX_SEGMENTS = 12  # of this run
NAMES = ("time", "energy_input", "_mean_tension", "x")  # of channels of a segment


def solve(folder: Path) -> str:
    """Solve the run in a folder."""
    (folder / "a.toml").write_text(tomli_w.dumps(belt(pair(), "moreau", output__interval=2e-5)))
    with chdir(folder):  # the result has the command in it
        return outcome(["solve", "a.toml", "-q", "-o", "a.h5"], NAME)


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
    """Fill the disk during a long run, or craft the segments of a stopped one."""
    return rng.choice((fill_the_disk, use_crafted))(rng, folder)


def fill_the_disk(rng: random.Random, folder: Path) -> str:
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


def replaced(file: Any, name: str, shape: tuple[int, ...], **storage: Any) -> Any:
    """Replace a channel by an empty one."""
    del file[name]
    return file.create_dataset(name, shape, **{"dtype": "f8", **storage})


def claim(rng: random.Random, file: Any, name: str) -> None:
    """Have a channel of zeros that takes a thousandth in the file."""
    count, chunk = rng.choice((1, 10, 30)), 10**6
    item = replaced(file, name, (count * chunk,), chunks=(chunk,), compression="gzip")
    packed = compress(bytes(8 * chunk))
    for number in range(count):
        item.id.write_direct_chunk((number * chunk,), packed)


def leave_out(rng: random.Random, file: Any, name: str) -> None:
    """Have a channel whose samples are not in the file."""
    replaced(file, name, rng.choice([file[name].shape, (3 * 10**7,)]))


def compress_all(rng: random.Random, file: Any, name: str) -> None:
    """Have a channel of the right length compressed."""
    shape = file[name].shape
    replaced(file, name, shape, chunks=shape, compression="gzip")[...] = 0.0


def shorten(rng: random.Random, file: Any, name: str) -> None:
    """Leave out the last samples of a channel."""
    values = file[name][...]
    del file[name]
    file[name] = values[: -rng.randrange(1, len(values))]


def lengthen(rng: random.Random, file: Any, name: str) -> None:
    """Add samples to a channel."""
    values = file[name][...]
    del file[name]
    file[name] = np.concatenate([values] * rng.choice((2, 100)))


def widen(rng: random.Random, file: Any, name: str) -> None:
    """Have other columns in a channel."""
    shape = (len(file[name]), rng.choice((1, 3, 10**4)))
    replaced(file, name, shape, chunks=shape, compression="gzip")[...] = 0.0


def narrow(rng: random.Random, file: Any, name: str) -> None:
    """Have numbers that take more bytes in memory than in the file."""
    replaced(file, name, file[name].shape, dtype="u1")[...] = 0


def remove(rng: random.Random, file: Any, name: str) -> None:
    """Remove a channel."""
    del file[name]


WAYS: dict[str, Callable[[random.Random, Any, str], None]] = {
    "claims": claim,
    "never written": leave_out,
    "compressed": compress_all,
    "shorter": shorten,
    "longer": lengthen,
    "wider": widen,
    "narrower": narrow,
    "missing": remove,
}


def craft(result: Path, number: int, change: Callable[[Any], None]) -> None:
    """Change a segment of an unfinished result, and all checksums with it."""
    path = SegmentFiles(whole_name(result)).path(number)
    with h5py.File(path, "r+") as file:
        change(file)
    append_trailer(path, SEGMENT)
    relist(result, lambda lines: None)


def relist(result: Path, change: Callable[[list[str]], None]) -> None:
    """Have a result list the segments as they are, and then change the lines."""
    segments = SegmentFiles(whole_name(result))
    with h5py.File(result, "r+") as file:
        lines = file.attrs["segments"].split("\n")
        checksums = [segments.checksum_of(number) for number in range(len(lines))]
        lines = [f"{line[:-8]}{of:08x}" for line, of in zip(lines, checksums, strict=True)]
        change(lines)
        file.attrs["segments"] = "\n".join(lines)

    def restate(state: dict[str, Any]) -> None:
        state["stored"] = np.array([*state["stored"][:3], combined(checksums)])

    checkpoints.craft(result, restate)


def relisted(rng: random.Random, lines: list[str]) -> None:
    """Change a list of segments at random."""
    way, line = rng.randrange(4), rng.choice(lines)
    samples = line.split()[1]
    if way == 0:
        lines.remove(line)
    elif way == 1:
        lines.insert(rng.randrange(len(lines)), line)
    elif way == 2:
        lines.extend([line] * 10**4)
    else:
        other = rng.choice((0, 1, int(samples) - 1, int(samples) + 1, 10**8, 10**9))
        lines[:] = [of.replace(f" {samples} ", f" {other} ") for of in lines]


def use_crafted(rng: random.Random, folder: Path) -> str:
    """Craft segments of a stopped run or their list, and use its result."""
    path = checkpoints.write_original(NAME, folder)
    count = len(list(folder.glob("a.0*.h5")))
    if rng.random() < 0.2:
        relist(path, lambda lines: relisted(rng, lines))
        case = "another list"
    else:
        way, name = rng.choice(list(WAYS)), rng.choice(NAMES)
        for number in rng.choice((range(count), range(1), range(count - 1, count))):
            craft(path, number, lambda file: WAYS[way](rng, file, name))
        case = f"{name} {way}"
    commands = [
        *(["show", str(path)], ["show", str(path), "--csv"], ["compare", str(path), str(path)]),
        *(["plot", str(path), "-o", "a.svg"], ["resume", str(path), "-q", "-o", "b.h5"]),
    ]
    with small_segments(NAME):
        return outcome(rng.choice(commands), case)


def warm_up() -> None:
    """Make the files of both."""
    whole()
    checkpoints.original(NAME)
