"""How belts compile their kernels, and where these are kept; numba is imported here, when needed.

numba compares the time stamp of one file only, so the folder of a build carries a digest of all
sources that go into kernels. Kernels with functions from elsewhere are not kept.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from time import time
from typing import Any

# Modules whose functions and constants go into compiled code.
SHARED = ("mechanisms/belt_drive/**/*.py", "solvers/*.py", "results.py")
IMPORTED = time()  # s


def build_name() -> str:
    """Return the name of the build: another one when a source changes.

    It is empty if a source was edited since this process began: its code may not be that of its
    source.
    """
    package, digest, now = Path(__file__).parents[1], sha256(), time()
    for path in sorted({file for pattern in SHARED for file in package.glob(pattern)}):
        if IMPORTED < path.stat().st_mtime < now:
            return ""
        digest.update(str(path).encode() + path.read_bytes())
    return f"kernels-{digest.hexdigest()[:16]}"


@cache
def folder_of_build() -> Path | None:
    """Return the folder that keeps the kernels of this build; None if they cannot be kept."""
    from frictionsim.solvers.kernel_folder import usable_folder

    name = build_name()
    return usable_folder(name) if name else None


def kept_in(folder: Path | None) -> dict[str, Any]:
    """Return the options of numba for code that is kept in a folder.

    Each time anew: numba takes the folder from the environment again when that changes, or from a
    file `.numba_config.yaml` where the user is.
    """
    if folder is None:
        return {}
    config: Any = import_module("numba").config
    config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), ""
    return {"cache": True}


@contextmanager
def without_collection() -> Iterator[None]:
    """Search for no garbage in a block that compiles: all the while that would find nothing."""
    is_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_enabled:
            gc.enable()
