"""Files in folders that others may write to: neither links nor pipes are opened."""

import os
from pathlib import Path
from stat import S_ISREG
from typing import IO


def open_regular(path: Path) -> IO[bytes]:
    """Open a regular file for reading bytes; raise OSError if it is a link or a pipe."""
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
