"""A CRC-32 trailer after the HDF5 data, to detect damaged files before they are opened.

HDF5 has no checksum of its metadata, and its library may crash or hang on a damaged file. It
ignores data after its end of file and drops them when another program changes the file. Therefore
a trailer must match, but a missing one is accepted.
"""

import os
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

MARK = b"\nfrictionsim crc32 "
LENGTH = len(MARK) + len(b"01234567\n")
BLOCK = 1 << 20


def checksum_trailer(image: bytes) -> bytes:
    """Return the trailer of a file with the given content."""
    return MARK + b"%08x\n" % crc32(image)


def checksum_mismatch(path: Path) -> bool:
    """Return whether a file has a trailer that does not match its content."""
    with path.open("rb") as file:
        return mismatch_within(file)


def mismatch_within(file: BinaryIO) -> bool:
    """Return `checksum_mismatch` of an open file."""
    left = file.seek(0, os.SEEK_END) - LENGTH
    file.seek(max(left, 0))
    trailer = file.read(LENGTH)
    if not trailer.startswith(MARK):
        return False
    file.seek(0)
    checksum = 0
    while left > 0:
        block = file.read(min(left, BLOCK))
        if not block:  # it was cut meanwhile
            return True
        checksum = crc32(block, checksum)
        left -= len(block)
    return trailer != MARK + b"%08x\n" % checksum


def checksum_of(trailer: bytes) -> int:
    """Return the checksum that a trailer states."""
    return int(trailer[len(MARK) :], 16)


def append_trailer(path: Path) -> None:
    """Append the trailer to a file that is too large to be in memory."""
    checksum = 0
    with path.open("r+b") as file:
        while block := file.read(BLOCK):
            checksum = crc32(block, checksum)
        file.write(MARK + b"%08x\n" % checksum)
