"""Files in folders that others may write to: neither links nor pipes are opened."""

import os
from pathlib import Path
from stat import S_ISREG
from typing import IO


def descriptor_of(path: Path, flags: int, mode: int = 0) -> int:
    """Open a file without waiting; raise OSError if it is a link."""
    if path.is_symlink():  # for systems without O_NOFOLLOW
        raise OSError("a link")
    for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY", "O_CLOEXEC"):
        flags |= getattr(os, name, 0)
    return os.open(path, flags, mode)


def open_regular(path: Path) -> IO[bytes]:
    """Open a regular file for reading bytes; raise OSError if it is a link or a pipe."""
    descriptor = descriptor_of(path, os.O_RDONLY)
    if S_ISREG(os.fstat(descriptor).st_mode):
        return os.fdopen(descriptor, "rb")
    os.close(descriptor)
    raise OSError("not a regular file")
