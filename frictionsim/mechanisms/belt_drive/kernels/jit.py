"""Compiled kernels: the only module that imports numba.

Kernels are plain loops over contiguous arrays. They are compiled once for each combination of
effects that a scenario calls for, and kept on the disk for later runs. numba looks at the time
stamp of one file only to tell whether a kernel is still the same, but kernels call kernels of other
files: the folder of the cache therefore carries a digest of the source of all of them.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import gettempdir
from time import perf_counter
from typing import Any

import numba
from numba.core import event

# All that lets sums be reordered into vectors; but a state that is not finite stays noticed.
FASTMATH_FLAGS = {"reassoc", "contract", "arcp", "nsz", "afn"}


@cache
def kernel_sources() -> tuple[Path, ...]:
    """Return the files whose code goes into kernels: this one, and those that compile with it.

    The integrator does not: it is plain Python for one coordinate, and compiled for belts.
    """
    package = Path(__file__).parents[3]
    others = [
        path
        for path in sorted(package.rglob("*.py"))
        if b"frictionsim.mechanisms.belt_drive.kernels.jit" in path.read_bytes()
    ]
    return Path(__file__), package / "solvers" / "runge_kutta_fehlberg.py", *others


@cache
def cache_folder() -> Path:
    """Return the folder of this build's compiled kernels; it need not exist."""
    digest = sha256()
    for path in kernel_sources():
        digest.update(path.read_bytes())
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "frictionsim" / f"kernels-{digest.hexdigest()[:16]}"


def _usable(folder: Path) -> Path:
    """Return the folder if it can be written to, else one that can."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        usable = os.access(folder, os.W_OK)
    except OSError:
        usable = False
    return folder if usable else Path(gettempdir()) / f"frictionsim-{os.getuid()}" / folder.name


FOLDER = _usable(cache_folder())
numba.config.CACHE_DIR = str(FOLDER)  # type: ignore[attr-defined]


def inline_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function as a part of each kernel that calls it: the call costs nothing."""
    return numba.njit(
        function, cache=True, fastmath=FASTMATH_FLAGS, error_model="numpy", forceinline=True
    )


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, or that is too large to be repeated."""
    return numba.njit(function, cache=True, fastmath=FASTMATH_FLAGS, error_model="numpy")


class Compilation(event.Listener):
    """Notices when a kernel is compiled that is not on the disk.

    Attributes
    ----------
    seconds : float
        How long it took; 0 where every kernel was there.
    """

    def __init__(self, first: Callable[[], Any]) -> None:
        self.seconds = 0.0
        self.noticed = False
        self._first = first

    def on_start(self, event: Any) -> None:
        """Call `first`, once."""
        if not self.noticed:
            self.noticed = True
            self._first()

    def on_end(self, event: Any) -> None:
        """Do nothing: there may be more."""


@contextmanager
def announce_compilation(expected: float, on_step: Any) -> Iterator[Compilation]:
    """Have a block, in which kernels are called first, tell when it compiles, and how long.

    Parameters
    ----------
    expected : float
        Seconds that it should take.
    on_step : object
        Its method `compiling`, if it has one, is entered with them when something is compiled.
    """
    with ExitStack() as stack:
        compiling = getattr(on_step, "compiling", None)
        found = Compilation(
            lambda: compiling and stack.enter_context(compiling(expected)),
        )
        started = perf_counter()
        with event.install_listener("numba:compile", found):
            yield found
        if found.noticed:
            found.seconds = perf_counter() - started
