"""What stands for an older result where nobody reads it."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import frictionsim as fs
from tests.support.scenarios import pulley


@cache
def old_result(title: str = "the result of yesterday") -> bytes:
    """Return the bytes of the file of a short run."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "old.h5"
        fs.solve(pulley(title=title, solver__duration=0.01), output=path)
        return path.read_bytes()
