"""The file of one segment: arrays in parts, and a description in JSON; see `sample_segments`.

    frictionsim samples 1\\n
    length of the description as 8 hexadecimal digits, and \\n
    description: {"after": CHECKSUM, "arrays": {NAME: {"dtype", "shape", "rows", "parts", ...}}}
    the parts, as `stored_array` has them; they are counted from the end of the description
    the line with the checksum of all before it

It is not of HDF5, as this process reads it itself: HDF5 may crash on a damaged file.
"""

import json
import os
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any

import numpy as np

from frictionsim.io.checksum import checksum_of, checksum_trailer, mismatch_within
from frictionsim.io.chunks import chunk_rows, compressed_chunks
from frictionsim.io.stored_array import StoredArray
from frictionsim.scenario.toml_data import json_value

BEGINNING = b"frictionsim samples 1\n"
DIGITS = 8
MAX_DESCRIPTION = 16 * 2**20


def segment_image(after: int, recorded: dict[str, Any], kept: dict[str, Any]) -> bytes:
    """Return the bytes of a segment.

    Parameters
    ----------
    after : int
        The checksum of the segment before it.
    recorded : dict of arrays
        Those with columns are compressed, as in a result.
    kept : dict of arrays
    """
    arrays: dict[str, Any] = {}
    parts: list[bytes] = []
    end = 0
    for name, values in (recorded | kept).items():
        is_chunked = name in recorded and values.ndim > 1
        rows = chunk_rows(values, len(values)) if is_chunked else max(len(values), 1)
        chunks = list(compressed_chunks(values, rows)) if is_chunked else [values.tobytes()]
        sizes = np.array([len(chunk) for chunk in chunks], dtype=np.int64)
        first = end + np.cumsum(sizes) - sizes
        arrays[name] = {
            "dtype": values.dtype.str,
            "shape": values.shape,
            "rows": rows,
            "parts": np.stack([first, sizes], axis=1).tolist(),
            "filtered": is_chunked,
        }
        parts += chunks
        end += int(sizes.sum())
    description = json.dumps({"after": after, "arrays": arrays}).encode()
    start = BEGINNING + b"%0*x\n" % (DIGITS, len(description)) + description
    image = b"".join([start, *parts])
    return image + checksum_trailer(image)


def is_folder(path: Path) -> bool:
    """Return whether a path is a folder and no link to one, which may be anywhere."""
    try:
        return S_ISDIR(path.lstat().st_mode)
    except OSError:
        return False


def open_regular(path: Path) -> Any:
    """Open a regular file for reading bytes; raise OSError if it is a link or a pipe.

    The folder may be of anyone: a link in it may lead to any file, and a pipe is waited for.
    """
    if path.is_symlink():  # where there is no O_NOFOLLOW
        raise OSError("a link")
    flags = os.O_RDONLY
    for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY", "O_CLOEXEC"):
        flags |= getattr(os, name, 0)
    descriptor = os.open(path, flags)
    if S_ISREG(os.fstat(descriptor).st_mode):
        return os.fdopen(descriptor, "rb")
    os.close(descriptor)
    raise OSError("not a regular file")


class SegmentFile:
    """A segment that is open for reading.

    Raises
    ------
    OSError, ValueError
        If it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._file: Any = open_regular(path)
        try:
            self._read_description(os.fstat(self._file.fileno()).st_size)
        except BaseException:
            self._file.close()
            raise

    def checksum(self) -> int:
        """Return the checksum of the file; raise ValueError if it does not match or is missing."""
        if mismatch_within(self._file):
            raise ValueError("the checksum does not match")
        self._file.seek(-len(checksum_trailer(b"")), os.SEEK_END)
        return checksum_of(self._file.read())

    def _read_description(self, size: int) -> None:
        start = self._file.read(len(BEGINNING) + DIGITS + 1)
        if not start.startswith(BEGINNING):
            raise ValueError("no segment")
        length = int(start[len(BEGINNING) :], 16)
        if not 0 < length <= min(size, MAX_DESCRIPTION):
            raise ValueError("no description")
        try:
            found = json_value(self._file.read(length))
            self.after = int(found["after"])
            self._arrays = {
                str(name): _array(described, len(start) + length)
                for name, described in found["arrays"].items()
            }
            for array in self._arrays.values():
                array.check(size)
        except (KeyError, TypeError, AttributeError, OverflowError) as error:
            raise ValueError("no description") from error

    def array(self, name: str) -> StoredArray:
        """Return where an array is.

        Raises
        ------
        ValueError
            If there is none of this name.
        """
        if name not in self._arrays:
            raise ValueError(f"no '{name}'")
        return self._arrays[name]

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return rows of an array; raise ValueError if they are damaged."""
        return self.array(name).read(self._file, start, stop)

    def compressed(self, name: str) -> list[bytes] | None:
        """Return the chunks of an array; None if it is not compressed."""
        array = self.array(name)
        return array.stored_parts(self._file) if array.compressed else None

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _array(described: dict[str, Any], start: int) -> StoredArray:
    parts = np.array(described["parts"], dtype=np.int64).reshape(-1, 2)
    filtered = bool(described["filtered"])
    return StoredArray(
        str(described["dtype"]),
        tuple(int(n) for n in described["shape"]),
        int(described["rows"]),
        np.array((start, 0)) + parts,
        shuffled=filtered,
        compressed=filtered,
    )
