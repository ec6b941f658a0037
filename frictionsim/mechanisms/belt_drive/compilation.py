"""The compilation of belt kernels: decorators for them, and the folder that keeps compiled ones.

Kernels are plain loops over contiguous rows; they make no arrays and return none. `loop` is for a
loop of vectors: its array arguments do not overlap, but for those it only reads. `part` is copied
into what calls it, `shared` is called, `kernel` is what Python calls, kept on the disk.

numba compares the time stamp of one file only, so the folder of a build, in the user's cache,
carries a digest of all sources that go into kernels. What is in it is run with the user's rights:
it is taken only if nobody else can write to it. Without such a folder each process compiles its
kernels. The folder that `NUMBA_CACHE_DIR` names may hold those of other programs.

Importing this imports numba, for half a second.
"""

import gc
import logging
import os
import re
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from stat import S_ISDIR
from tempfile import NamedTemporaryFile
from time import perf_counter, time
from typing import TYPE_CHECKING, Any

from platformdirs import user_cache_path

from frictionsim.errors import InputError

try:
    import numba
except ImportError as error:
    raise InputError(
        "belts are integrated by compiled code, for which the package numba cannot be imported"
        f" ({error}); install it with pip install numba"
    ) from None

if TYPE_CHECKING:
    from frictionsim.simulation.monitor import RunMonitor

LOG = logging.getLogger(__name__)

# Modules whose functions and constants go into compiled code, in the package.
SOURCES = (
    *(f"mechanisms/belt_drive/{name}.py" for name in ("belt", "compilation", "kernels")),
    *(f"mechanisms/belt_drive/{name}.py" for name in ("dampers", "moreau", "rkf45")),
    *(f"solvers/{name}.py" for name in ("friction_curve", "rkf45")),
)
IMPORTED = time()  # s
PROGRAM = "frictionsim"
BUILD = re.compile(r"kernels-[0-9a-f]{16}")  # the folder of a build, as `build_name` has it
UNUSED_LIFETIME = 7 * 24 * 3600.0  # s; several versions may be in use side by side
PRIVATE, OTHERS_WRITE = 0o700, 0o022

# Called where a kernel begins to be compiled.
_listeners: list[Callable[[], None]] = []

# All that lets sums be reordered into vectors; but a state that is not finite stays noticed.
OPTIONS: dict[str, Any] = {
    "fastmath": {"reassoc", "contract", "arcp", "nsz", "afn"},
    "error_model": "numpy",
    "no_cfunc_wrapper": True,  # C calls no kernel
}
PART: dict[str, Any] = {"no_cpython_wrapper": True}  # nor does Python call a part
DISJOINT: dict[str, Any] = {}
ANNOUNCED: dict[str, Any] = {}

# What numba has no public option for. Without it a step takes some 17 % longer, and no compilation
# is announced.
try:
    from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
    from numba.core.options import DefaultOptions

    _passes: Any = DefaultPassBuilder

    if not hasattr(DefaultOptions, "_nrt") or not hasattr(Flags, "noalias"):
        raise AttributeError("no flag _nrt or noalias")

    class _Disjoint(CompilerBase):
        """Numba's compiler for a function whose array arguments do not overlap."""

        def define_pipelines(self) -> list[Any]:
            """Return the passes, as numba asks for them."""
            self.state.flags.noalias = True
            return [_passes.define_nopython_pipeline(self.state)]

    class _Announced(CompilerBase):
        """Numba's compiler, which announces that it begins."""

        def define_pipelines(self) -> list[Any]:
            """Return the passes, as numba asks for them."""
            for tell in _listeners:
                tell()
            return [_passes.define_nopython_pipeline(self.state)]

    OPTIONS["_nrt"] = False  # do not count references to arrays
    DISJOINT["pipeline_class"] = _Disjoint
    ANNOUNCED["pipeline_class"] = _Announced
except (ImportError, AttributeError) as error:
    LOG.info("kernels of belts will be slower: numba has no such insides (%s)", error)


# --- decorators ---------------------------------------------------------------------------------


def part(function: Callable[..., Any]) -> Any:
    """Compile a function as a part of each kernel that calls it."""
    return numba.njit(function, **OPTIONS, **PART, forceinline=True)


def loop(function: Callable[..., Any]) -> Any:
    """Compile a part whose array arguments have no element in common, but for those it reads.

    A loop that writes several arrays becomes vector instructions without a look at overlaps.
    """
    return numba.njit(function, **OPTIONS, **PART, **DISJOINT, forceinline=True)


def shared(function: Callable[..., Any]) -> Any:
    """Compile a function that kernels call in several places, too large to repeat."""
    return numba.njit(function, **OPTIONS, **PART)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, and keep its code on the disk if it is our own."""
    folder = folder_of_build() if function.__module__.startswith("frictionsim.") else None
    if folder is not None:
        # Each time anew: numba takes the folder from the environment again when that changes, or
        # from a file `.numba_config.yaml` where the user is.
        config: Any = numba.config
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), ""
    return numba.njit(function, **OPTIONS, **ANNOUNCED, cache=folder is not None)


def seconds_of_compilation(
    work: Callable[[], None], expected: float, monitor: "RunMonitor"
) -> float:
    """Do work that may compile kernels; return how long it took, s: 0 if all were on the disk.

    Parameters
    ----------
    work : callable
    expected : float
        Seconds that compilation should take.
    monitor : RunMonitor
        Its `compiling` is entered where the first kernel is compiled.
    """
    LOG.info("folder of the compiled kernels: %s", folder_of_build())
    started: list[float] = []

    def announce() -> None:
        if not started:
            started.append(perf_counter())
            LOG.info("compilation of kernels starts")
            stack.enter_context(monitor.compiling(expected))

    _listeners.append(announce)
    with ExitStack() as stack:
        stack.callback(_listeners.remove, announce)
        if gc.isenabled():  # a search for garbage would find nothing, time and again
            gc.disable()
            stack.callback(gc.enable)
        work()
    if not started:
        return 0.0
    seconds = perf_counter() - started[0]
    LOG.info("kernels compiled in %.3g s", seconds)
    return seconds


# --- the folder ---------------------------------------------------------------------------------


@cache
def folder_of_build() -> Path | None:
    """Return the folder that keeps the kernels of this build; None if they cannot be kept."""
    name = build_name()
    return usable_folder(name) if name else None


def build_name() -> str:
    """Return the name of the build: another one when a source changes.

    It is empty if a source was edited since this process began: its code may not be that of its
    source.
    """
    package, digest, now = Path(__file__).parents[2], sha256(), time()
    for path in (package / source for source in SOURCES):
        if IMPORTED < path.stat().st_mtime < now:
            return ""
        digest.update(str(path).encode() + path.read_bytes())
    return f"kernels-{digest.hexdigest()[:16]}"


def usable_folder(name: str) -> Path | None:
    """Return the folder of a build that the user alone can write to; None, with a warning, if none.

    When a folder is made, those of other builds that nobody has used for a week are removed.
    """
    try:
        base = user_cache_path(PROGRAM, appauthor=False)
        if not base.is_absolute():  # it would depend on the folder that the user is in
            raise OSError(f"'{base}' is no absolute path")
        base.parent.mkdir(parents=True, exist_ok=True)
        folder = base / name
        is_new = not folder.exists()
        for own in (base, folder):
            _make_private(own)
        with NamedTemporaryFile(dir=folder):  # to try is to use, too: it sets the time stamp
            pass
        if is_new:
            _remove_unused(folder)
        return folder
    except (OSError, RuntimeError) as error:  # RuntimeError: the user has no home
        what, where = getattr(error, "strerror", None), getattr(error, "filename", None)
        reason = f"'{where}': {what}" if what and where else str(error)
    LOG.warning(
        "there is no private folder to keep compiled kernels in (%s); every run that needs them"
        " compiles them anew, in 6 to 10 s or more: set XDG_CACHE_HOME to a folder of your own",
        reason,
    )
    return None


def _make_private(folder: Path) -> None:
    """Make a folder, or check that the user alone can write to it; Windows has no such modes."""
    with suppress(FileExistsError):
        folder.mkdir(mode=PRIVATE)
    status = folder.lstat()
    if not S_ISDIR(status.st_mode):
        raise OSError(f"'{folder}' is a link or a file, not a folder")
    if not hasattr(os, "geteuid"):
        return
    if status.st_uid != os.geteuid():
        raise OSError(f"'{folder}' belongs to another user")
    if status.st_mode & OTHERS_WRITE:
        raise OSError(f"others can write to '{folder}'")


def _remove_unused(new: Path) -> None:
    """Remove the folders of other builds beside a new one that were not used for a week."""
    for path in [path for path in new.parent.iterdir() if BUILD.fullmatch(path.name)]:
        with suppress(OSError):  # another process was faster
            status = path.lstat()  # of a link, not of what it leads to
            if S_ISDIR(status.st_mode) and time() - status.st_mtime > UNUSED_LIFETIME:
                rmtree(path, ignore_errors=True)
