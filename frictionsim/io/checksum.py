"""A CRC-32 trailer after the HDF5 data, to detect damaged files before they are opened.

HDF5 has no checksum of its metadata, and its library may crash or hang on a damaged file. It
ignores data after its end of file and drops them when another program changes the file. Therefore
a trailer must match, but a missing one is accepted. Its mark tells what the file holds.
"""

import os
from pathlib import Path
from typing import IO
from zlib import crc32

RESULT, SWEEP, COSTS, SEGMENT = MARKS = tuple(
    b"\nfrictionsim %s " % word for word in (b"crc32", b"sweep", b"costs", b"segm.")
)
LENGTH = len(RESULT) + len(b"01234567\n")
BLOCK = 1 << 20


def checksum_trailer(image: bytes, mark: bytes = RESULT) -> bytes:
    """Return the trailer of a file with the given content."""
    return mark + b"%08x\n" % crc32(image)


def mark_of(file: IO[bytes]) -> bytes:
    """Return the mark of the trailer of an open file; empty if it has none."""
    file.seek(max(file.seek(0, os.SEEK_END) - LENGTH, 0))
    mark = file.read(len(RESULT))
    return mark if mark in MARKS else b""


def is_damaged(file: IO[bytes]) -> bool:
    """Return whether an open file has a trailer that does not match its content."""
    mark = mark_of(file)
    if not mark:
        return False
    stated = file.read()
    return stated != b"%08x\n" % _crc32_of(file, file.seek(0, os.SEEK_END) - LENGTH)


def append_trailer(path: Path, mark: bytes = RESULT) -> None:
    """Append the trailer to a file that is too large for memory."""
    with path.open("r+b") as file:
        checksum = _crc32_of(file, file.seek(0, os.SEEK_END))
        file.seek(0, os.SEEK_END)
        file.write(mark + b"%08x\n" % checksum)


def stated_checksum(file: IO[bytes]) -> int:
    """Return the checksum that the trailer of an open file states."""
    mark_of(file)
    return int(file.read(), 16)


def _crc32_of(file: IO[bytes], length: int) -> int:
    """Return the checksum of the first bytes; of fewer if the file has been truncated."""
    checksum = 0
    file.seek(0)
    while length > 0 and (block := file.read(min(length, BLOCK))):
        checksum = crc32(block, checksum)
        length -= len(block)
    return checksum
