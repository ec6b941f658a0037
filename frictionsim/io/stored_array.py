"""Arrays in parts of a file, read by numpy and zlib, which are safe on corrupt bytes.

A part holds consecutive rows as the filters of HDF5 leave them: shuffle (the first bytes of all
values, then the second ones, ...) and gzip. The chunks of a result and the segments of a run that
is not over are such parts.
"""

import os
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

# DEFLATE's maximum ratio is 1032:1; a larger claim means a damaged file.
MAX_GZIP_RATIO = 1032
MAX_PART_BYTES = 256 * 2**20
KINDS = "fiub"


class StoredArray(NamedTuple):
    """Where the values of an array are.

    Attributes
    ----------
    dtype : str
        As numpy has it: `<f8`.
    shape : tuple of int
        Rows first.
    rows : int
        Rows of each part; the last one may have fewer that count.
    parts : int array, (parts, 2)
        First byte and number of bytes of each.
    shuffled, compressed : bool
        The filters that were applied to each part.
    """

    dtype: str
    shape: tuple[int, ...]
    rows: int
    parts: Any
    shuffled: bool = False
    compressed: bool = False

    @property
    def row_bytes(self) -> int:
        """The bytes of a row in memory."""
        return np.dtype(self.dtype).itemsize * _product(self.shape[1:])

    @property
    def nbytes(self) -> int:
        """The bytes of all rows in memory."""
        return self.row_bytes * self.shape[0]

    def check(self, file_bytes: int) -> None:
        """Check that all parts are within a file of so many bytes, and can hold what they claim.

        Raises
        ------
        ValueError
            If not.
        """
        dtype = np.dtype(self.dtype)
        if dtype.kind not in KINDS or dtype.hasobject:
            raise ValueError(f"values of type {dtype}")
        if not self.shape or min(self.shape) < 0 or self.rows < 1:
            raise ValueError("no rows")
        first, sizes = self.parts[:, 0], self.parts[:, 1]
        if len(first) != -(-self.shape[0] // self.rows):
            raise ValueError("a part is missing")
        if not len(first):
            return
        if first.min() < 0 or sizes.min() < 0 or sizes.max() > file_bytes:
            raise ValueError("a part is outside of the file")
        if (first > file_bytes - sizes).any():
            raise ValueError("a part is outside of the file")
        size = self.rows * self.row_bytes
        if not self.compressed:
            if (sizes != size).any():
                raise ValueError("a part has another size than its rows")
        elif size > MAX_PART_BYTES or (size > MAX_GZIP_RATIO * sizes).any():
            raise ValueError("a part claims more than it can hold")

    def read(self, file: Any, start: int, stop: int) -> Any:
        """Return rows start to stop - 1, from a file that is open for reading bytes.

        Raises
        ------
        ValueError
            If a part does not hold its rows.
        """
        found = [
            self._rows_of_part(file, number, max(start - before, 0), min(stop - before, self.rows))
            for number, before in self._numbered(start, stop)
        ]
        if len(found) == 1:
            return found[0]
        return np.concatenate(found) if found else np.zeros((0, *self.shape[1:]), self.dtype)

    def stored_parts(self, file: Any) -> list[bytes]:
        """Return all parts as they are in the file."""
        return [self._stored(file, number) for number in range(len(self.parts))]

    def _numbered(self, start: int, stop: int) -> Iterator[tuple[int, int]]:
        """Yield the number of each part that has some of the rows, and how many rows precede it."""
        stop = min(stop, self.shape[0])
        if stop > start:
            for number in range(start // self.rows, (stop - 1) // self.rows + 1):
                yield number, number * self.rows

    def _rows_of_part(self, file: Any, number: int, start: int, stop: int) -> Any:
        stop = min(stop, self.shape[0] - number * self.rows)
        shape = (stop - start, *self.shape[1:])
        if not (self.compressed or self.shuffled):
            file.seek(int(self.parts[number][0]) + start * self.row_bytes)
            raw = file.read((stop - start) * self.row_bytes)
            if len(raw) != (stop - start) * self.row_bytes:
                raise ValueError("the file ends within a part")
            return np.frombuffer(bytearray(raw), self.dtype).reshape(shape)
        raw, size = self._stored(file, number), self.rows * self.row_bytes
        if self.compressed:
            try:
                # One byte more than wanted shows that there is more than wanted.
                raw = zlib.decompressobj().decompress(raw, size + 1)
            except zlib.error as error:
                raise ValueError(str(error)) from None
        if len(raw) != size:
            raise ValueError("a part does not hold its rows")
        values = np.frombuffer(raw, np.uint8)
        if self.shuffled:
            values = values.reshape(np.dtype(self.dtype).itemsize, -1).T
        width = self.row_bytes
        rows = np.ascontiguousarray(values).reshape(self.rows, width)[start:stop]
        return np.array(rows).view(np.uint8).ravel().view(self.dtype).reshape(shape)

    def _stored(self, file: Any, number: int) -> bytes:
        first, size = (int(n) for n in self.parts[number])
        file.seek(first)
        found: bytes = file.read(size)
        if len(found) != size:
            raise ValueError("the file ends within a part")
        return found


def _product(numbers: tuple[int, ...]) -> int:
    """Return the product of integers of any size."""
    found = 1
    for number in numbers:
        found *= number
    return found


class FileChanged(Exception):
    """A file is not the one any more that was looked at; the message says why."""


class FileSource:
    """The arrays of a file, which is opened whenever some rows are read.

    Parameters
    ----------
    path : str
    stamp : tuple
        Of the file when it was looked at, see `stamp_of`.
    arrays : dict of StoredArray
    """

    def __init__(self, path: str, stamp: tuple[int, ...], arrays: dict[str, StoredArray]) -> None:
        self._path, self._stamp, self._arrays = path, stamp, arrays

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return samples start to stop - 1 of a channel."""
        from frictionsim.errors import InputError

        try:
            return self.rows_if_unchanged(name, start, stop)
        except FileChanged as error:
            reason = str(error)
        except ValueError as error:
            reason = f"it is corrupt or malicious ({error})"
        raise InputError(f"{self._path}: cannot read the channel '{name}': {reason}")

    def rows_if_unchanged(self, name: str, start: int, stop: int) -> Any:
        """Return samples as `rows` does.

        Raises
        ------
        FileChanged
            If the file is not the same any more.
        ValueError
            If it is damaged.
        """
        try:
            with open(self._path, "rb") as file:
                if stamp_of_open(file) == self._stamp:
                    return self._arrays[name].read(file, start, stop)
        except OSError as error:
            raise FileChanged(
                f"it could be opened before, and cannot be now ({error.strerror or error})"
            ) from None
        raise FileChanged("it has changed since it was opened; open it again")

    def compressed(self, name: str, start: int, stop: int) -> list[bytes] | None:
        """Return None: chunks of a file need not begin where those of another one do."""
        return None


def stamp_of(path: str) -> tuple[int, ...]:
    """Return the fields of a file's status that change when it is replaced."""
    return _stamp(os.stat(path))


def stamp_of_open(file: Any) -> tuple[int, ...]:
    """Return these fields of an open file."""
    return _stamp(os.fstat(file.fileno()))


def _stamp(found: os.stat_result) -> tuple[int, ...]:
    return found.st_ino, found.st_size, found.st_mtime_ns
