"""Segments of long runs that are changed, under a new checksum."""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zlib import compress

import h5py
import numpy as np
from frictionsim.io.segments import SegmentFiles, combined
from frictionsim.io.unfinished import whole_name

from frictionsim.io.checksum import SEGMENT, append_trailer
from tests.support import crafted_checkpoints


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
    _relist(result)


def _relist(result: Path) -> None:
    """Have a result list its segments as they are."""
    segments = SegmentFiles(whole_name(result))
    with h5py.File(result, "r+") as file:
        lines = file.attrs["segments"].split("\n")
        checksums = [segments.checksum_of(number) for number in range(len(lines))]
        lines = [f"{line[:-8]}{of:08x}" for line, of in zip(lines, checksums, strict=True)]
        file.attrs["segments"] = "\n".join(lines)

    def restate(state: dict[str, Any]) -> None:
        state["stored"] = np.array([*state["stored"][:3], combined(checksums)])

    crafted_checkpoints.craft(result, restate)
