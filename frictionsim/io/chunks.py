"""Chunks of compressed rows, as result files hold them.

They are compressed once, when a segment is written, and copied into the result as they are.
"""

from collections.abc import Iterator
from typing import Any
from zlib import compress

import h5py
import numpy as np

from frictionsim.simulation.sample_store import power_of_two, rows_per_segment
from frictionsim.simulation.stored_channel import StoredChannel

CHUNK_BYTES = 128 * 1024
LEVEL = 4
COMPRESSION = {"compression": "gzip", "compression_opts": LEVEL}


def is_long(channels: dict[str, Any]) -> bool:
    """Return whether channels fill more than one segment: their file is written in chunks."""
    return len(channels["time"]) > segment_rows(channels)


def segment_rows(channels: dict[str, Any]) -> int:
    """Return how many samples of these channels are one segment."""
    row = (v.dtype.itemsize * int(np.prod(v.shape[1:])) for n, v in channels.items() if n != "time")
    return rows_per_segment(sum(row))


def chunk_rows(values: Any, segment: int) -> int:
    """Return how many samples of a channel are one chunk, of those that a segment has."""
    row_bytes = values.dtype.itemsize * int(np.prod(values.shape[1:]))
    return min(segment, power_of_two(CHUNK_BYTES // max(row_bytes, 1)))


def add_in_chunks(group: Any, name: str, values: Any, segment: int) -> Any:
    """Add a dataset whose values are written part by part, whether in memory or stored.

    Parameters
    ----------
    group : h5py.Group
    name : str
    values : array or StoredChannel, (n, ...)
    segment : int
        How many samples are one segment.

    Returns
    -------
    h5py.Dataset
    """
    if values.ndim < 2:
        dataset = group.create_dataset(name, shape=values.shape, dtype=values.dtype)
        for start in range(0, len(values), segment):
            dataset[start : start + segment] = values[start : start + segment]
        return dataset
    rows = chunk_rows(values, segment)
    shape = (rows, *values.shape[1:])
    dataset = group.create_dataset(
        name, shape=values.shape, dtype=values.dtype, chunks=shape, shuffle=True, **COMPRESSION
    )
    for start in range(0, len(values), segment):
        for number, chunk in enumerate(_chunks(values, start, segment, rows)):
            offset = (start + number * rows, *(0 for _ in shape[1:]))
            dataset.id.write_direct_chunk(offset, chunk)
    return dataset


def _chunks(values: Any, start: int, segment: int, rows: int) -> Iterator[bytes]:
    """Yield the chunks of one segment, or of what there is of it."""
    stop = min(start + segment, len(values))
    if isinstance(values, StoredChannel):
        stored = values.compressed(start, stop)
        if stored is not None:
            yield from stored
            return
    part = values[start:stop]
    for first in range(0, len(part), rows):
        yield _compressed(part[first : first + rows], rows)


def _compressed(values: Any, rows: int) -> bytes:
    """Return rows as the filters of HDF5, shuffle and gzip, leave them; the rest are zeros."""
    full = np.zeros((rows, *values.shape[1:]), values.dtype)
    full[: len(values)] = values
    return compress(full.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes(), LEVEL)


def stored_chunks(dataset: Any) -> list[bytes] | None:
    """Return the chunks of a dataset from the first; None if it has none."""
    if dataset.chunks is None:
        return None
    starts = range(0, len(dataset), dataset.chunks[0])
    return [dataset.id.read_direct_chunk((start, 0))[1] for start in starts]


class FileSource:
    """The channels of a result file, which is opened whenever some are read.

    Parameters
    ----------
    path : str
    stamp : tuple
        Of the file when it was opened first, see `stamp_of`.
    """

    def __init__(self, path: str, stamp: tuple[int, ...]) -> None:
        self._path, self._stamp = path, stamp

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return samples start to stop - 1 of a channel.

        Raises
        ------
        InputError
            If the file is not the same any more.
        """
        from frictionsim.errors import InputError

        try:
            with h5py.File(self._path, "r") as file:
                if stamp_of(self._path) == self._stamp:
                    return file[name][start:stop]
                reason = "it has changed since it was opened; open it again"
        except OSError as error:
            reason = f"it could be opened before, and cannot be now ({error.strerror or 'HDF5'})"
        raise InputError(f"{self._path}: cannot read the channel '{name}': {reason}")

    def compressed(self, name: str, start: int, stop: int) -> list[bytes] | None:
        """Return None: chunks of a file need not begin where those of another one do."""
        return None


def stamp_of(path: str) -> tuple[int, ...]:
    """Return what changes when a file is replaced."""
    from os import stat

    found = stat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns
