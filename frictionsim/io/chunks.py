"""Chunks of compressed rows, as result files hold them.

They are compressed once, when a segment is written, and copied into the result as they are.
"""

from collections.abc import Iterator
from typing import Any
from zlib import compress

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
    yield from compressed_chunks(values[start:stop], rows)


def compressed_chunks(values: Any, rows: int) -> Iterator[bytes]:
    """Yield values as chunks of so many rows."""
    for first in range(0, len(values), rows):
        yield _compressed(values[first : first + rows], rows)


def _compressed(values: Any, rows: int) -> bytes:
    """Return rows as the filters of HDF5, shuffle and gzip, leave them; the rest are zeros."""
    full = np.zeros((rows, *values.shape[1:]), values.dtype)
    full[: len(values)] = values
    return compress(full.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes(), LEVEL)
