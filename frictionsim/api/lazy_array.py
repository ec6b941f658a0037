"""Stored channels as arrays of xarray that are read when they are needed."""

from typing import Any

from xarray.backends import BackendArray
from xarray.core import indexing

from frictionsim.simulation.stored_channel import StoredChannel


class _LazyArray(BackendArray):
    """A stored channel as xarray wants what a file holds."""

    def __init__(self, channel: StoredChannel) -> None:
        self.shape, self.dtype, self._channel = channel.shape, channel.dtype, channel

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER_1VECTOR, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> Any:
        rows, *columns = key
        # One axis after the other: numpy takes lists of both for pairs.
        found = self._channel[rows]
        return found[(*(() if isinstance(rows, int) else (slice(None),)), *columns)]


def lazy_array(channel: StoredChannel) -> Any:
    """Return a channel as data of an `xarray.Variable`; only what is selected is read."""
    return indexing.LazilyIndexedArray(_LazyArray(channel))
