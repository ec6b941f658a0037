"""A CRC-32 trailer after the HDF5 data, to detect damaged files before they are opened.

HDF5 has no checksum of its metadata, and its library may crash or hang on a damaged file. It
ignores data after its end of file and drops them when another program changes the file. Therefore
a trailer must match, but a missing one is accepted. Its mark tells what the file holds.
"""

import os
from typing import IO
from zlib import crc32

RESULT, SWEEP = MARKS = b"\nfrictionsim crc32 ", b"\nfrictionsim sweep "
LENGTH = len(RESULT) + len(b"01234567\n")
BLOCK = 1 << 20


def append_trailer(file: IO[bytes], mark: bytes) -> None:
    """Append the trailer to an open file, whose content is read back."""
    file.flush()
    checksum = _crc32_of(file, file.seek(0, os.SEEK_END))
    file.seek(0, os.SEEK_END)
    file.write(mark + b"%08x\n" % checksum)


def mark_of(file: IO[bytes]) -> bytes:
    """Return the mark of the trailer of an open file; empty if it has none."""
    file.seek(max(file.seek(0, os.SEEK_END) - LENGTH, 0))
    mark = file.read(len(RESULT))
    return mark if mark in MARKS else b""


def is_damaged(file: IO[bytes]) -> bool:
    """Return whether an open file has a trailer that does not match its content."""
    if not mark_of(file):
        return False
    stated = file.read()
    return stated != b"%08x\n" % _crc32_of(file, file.seek(0, os.SEEK_END) - LENGTH)


def _crc32_of(file: IO[bytes], length: int) -> int:
    """Return the checksum of the first bytes; of fewer if the file has been truncated."""
    checksum = 0
    file.seek(0)
    while length > 0 and (block := file.read(min(length, BLOCK))):
        checksum = crc32(block, checksum)
        length -= len(block)
    return checksum
