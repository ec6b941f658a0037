"""A checksum behind the end of a file, so that a damaged one is told before it is read.

HDF5 itself has none over its metadata, and its library may crash or never return on a file in
which bits have changed. It does not look behind its own end, and drops what is there when another
program changes the file: a seal that is there has to fit, and one that is not there is not missed.
"""

import os
from pathlib import Path
from zlib import crc32

MARK = b"\nfrictionsim crc32 "
LENGTH = len(MARK) + len(b"01234567\n")
BLOCK = 1 << 20


def checksum_trailer(image: bytes) -> bytes:
    """Return the bytes to put behind an image."""
    return MARK + b"%08x\n" % crc32(image)


def checksum_mismatch(path: Path) -> bool:
    """Return whether a file has a seal that does not fit."""
    with path.open("rb") as file:
        left = file.seek(0, os.SEEK_END) - LENGTH
        file.seek(max(left, 0))
        found = file.read(LENGTH)
        if not found.startswith(MARK):
            return False
        file.seek(0)
        checksum = 0
        while left > 0:
            block = file.read(min(left, BLOCK))
            checksum = crc32(block, checksum)
            left -= len(block)
    return found != MARK + b"%08x\n" % checksum
