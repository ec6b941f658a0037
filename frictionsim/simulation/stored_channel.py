"""Channels whose values stay in a file until they are needed."""

from collections.abc import Iterator
from typing import Any, Protocol, runtime_checkable

import numpy as np

BLOCK_BYTES = 64 * 2**20  # of values that are worked on at once
SPARSE = 16  # samples, of which at most one is wanted, are not worth reading in full


class ChannelSource(Protocol):
    """Where the values of channels are."""

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return the values of samples start to stop - 1."""


@runtime_checkable
class SampledSource(Protocol):
    """A source that returns scattered samples without all those between them."""

    def samples(self, name: str, numbers: Any) -> Any:
        """Return the samples of some numbers."""


class StoredChannel(np.lib.mixins.NDArrayOperatorsMixin):
    """A channel that is read when it is indexed, and only there.

    Where an array is needed, as in arithmetic, it is read as a whole; `blocks` tells how to go
    through it in bounded memory.

    Parameters
    ----------
    source : ChannelSource
    name : str
        Of the channel in its source.
    shape : tuple of int
        Samples first.
    dtype : numpy dtype
        Of the values that are given; the source may hold others.
    """

    def __init__(self, source: ChannelSource, name: str, shape: tuple[int, ...], dtype: Any):
        self.source, self.name, self.shape = source, name, shape
        self.dtype = np.dtype(dtype)

    @property
    def ndim(self) -> int:
        """The number of dimensions."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """The number of values."""
        return int(np.prod(self.shape))

    @property
    def nbytes(self) -> int:
        """The bytes that all values take in memory."""
        return self.size * self.dtype.itemsize

    def __len__(self) -> int:
        return self.shape[0]

    def __iter__(self) -> Iterator[Any]:
        for start, stop in self.blocks():
            yield from self[start:stop]

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Yield first sample and end of consecutive parts that fit into memory."""
        yield from blocks_of(len(self), self.nbytes // max(len(self), 1))

    def first(self, count: int) -> "StoredChannel":
        """Return the channel of the first samples."""
        return StoredChannel(self.source, self.name, (count, *self.shape[1:]), self.dtype)

    def __getitem__(self, key: Any) -> Any:
        rows, *columns = key if isinstance(key, tuple) else (key,)
        if isinstance(rows, (int, np.integer)):
            row = range(len(self))[rows]  # raises IndexError
            return self._rows(row, row + 1)[(0, *columns)]
        if rows is Ellipsis:
            rows = slice(None)
        if isinstance(rows, slice):
            chosen = range(len(self))[rows]
            if len(chosen) and chosen.step == 1:
                return self._contiguous(chosen.start, chosen.stop, tuple(columns))
            places = np.array(chosen, dtype=np.intp)
        else:
            rows = np.asarray(rows)
            places = np.flatnonzero(rows) if rows.dtype == bool else rows % max(len(self), 1)
        return self._at(places, tuple(columns))

    def _rows(self, start: int, stop: int) -> Any:
        return self.source.rows(self.name, start, stop).astype(self.dtype, copy=False)

    def _contiguous(self, start: int, stop: int, columns: tuple[Any, ...]) -> Any:
        """Return consecutive samples, reading no more at once than there may be in memory."""
        parts = [
            self._rows(start + a, start + b)[(slice(None), *columns)]
            for a, b in blocks_of(stop - start, self.nbytes // len(self))
        ]
        # A copy, so that a column does not keep the others in memory.
        return np.concatenate(parts) if len(parts) > 1 else np.array(parts[0])

    def _at(self, places: Any, columns: tuple[Any, ...]) -> Any:
        """Return the samples of given numbers, in their order."""
        order = np.argsort(places, kind="stable")
        placed, parts = places[order], []
        is_sparse = len(placed) > 1 and placed[-1] - placed[0] >= SPARSE * len(placed)
        if is_sparse and isinstance(self.source, SampledSource):
            for a, b in blocks_of(len(placed), self.nbytes // len(self)):
                values = self.source.samples(self.name, placed[a:b])
                parts.append(values.astype(self.dtype, copy=False)[(slice(None), *columns)])
        for start, stop in self.blocks() if not parts else ():
            a, b = np.searchsorted(placed, (start, stop))
            if b > a:
                low, high = int(placed[a]), int(placed[b - 1]) + 1
                parts.append(self._rows(low, high)[placed[a:b] - low][(slice(None), *columns)])
        if not parts:
            return np.zeros((0, *self.shape[1:]), self.dtype)[(slice(None), *columns)]
        values = np.concatenate(parts)
        inverse = np.empty_like(order)
        inverse[order] = np.arange(len(order))
        return values[inverse]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        if not len(self):
            return np.zeros(self.shape, dtype or self.dtype)
        values = self._contiguous(0, len(self), ())
        return values if dtype is None else values.astype(dtype, copy=False)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        arrays = [np.asarray(x) if isinstance(x, StoredChannel) else x for x in inputs]
        return getattr(ufunc, method)(*arrays, **options)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the whole array, as its `max`."""
        if name.startswith("_") or name in ("source", "shape", "dtype"):
            raise AttributeError(name)
        return getattr(np.asarray(self), name)


def blocks_of(count: int, row_bytes: int) -> Iterator[tuple[int, int]]:
    """Yield start and end of consecutive parts of the rows that fit into memory."""
    rows = max(1, BLOCK_BYTES // max(row_bytes, 1))
    for start in range(0, count, rows):
        yield start, min(start + rows, count)
