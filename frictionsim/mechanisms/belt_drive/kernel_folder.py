"""The folder of compiled kernels in the user's cache, and the compilation of what is not there.

numba compares the time stamp of one file only, so the folder of a build carries a digest of all
sources that go into kernels. Kernels with functions from elsewhere are not kept.

What is in it is loaded as machine code (numba's .nbc) or unpickled (.nbi), both of which run with
the user's rights. So a folder is taken only if nobody else can have put anything into it: it and
the one it is in are the user's own folders, no links, closed to others (mode 0700); a folder of a
build that others could enter is made anew. Nobody but the user and root can exchange them: each
folder on the way belongs to one of these two, and is not writable for all unless it is sticky, as
/tmp is. A group that may write to the user's own cache is the user's decision.

Without such a folder the kernels are compiled for each process anew, and never read from a disk.
The folder that `NUMBA_CACHE_DIR` names is not used: it may hold kernels of other programs.
Windows has no such owners and modes; there it is in the user's profile.
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
from stat import S_ISDIR, S_ISVTX
from tempfile import NamedTemporaryFile
from time import perf_counter, time
from typing import TYPE_CHECKING, Any

from platformdirs import user_cache_path

if TYPE_CHECKING:
    from frictionsim.simulation.monitor import RunMonitor

LOG = logging.getLogger(__name__)

# Modules whose functions and constants go into compiled code, in the package.
SOURCES = (
    *(f"mechanisms/belt_drive/{name}.py" for name in ("belt", "kernels", "moreau", "numba_kinds")),
    "mechanisms/belt_drive/rkf45.py",
    *("solvers/friction_curve.py", "solvers/rkf45.py"),
)
IMPORTED = time()  # s
PROGRAM = "frictionsim"
BUILD = re.compile(r"kernels-[0-9a-f]{16}")  # the folder of a build, as `build_name` has it
UNUSED_LIFETIME = 7 * 24 * 3600.0  # s; several versions may be in use side by side
PRIVATE, OTHERS, ANYONE_WRITES, ROOT = 0o700, 0o077, 0o002, 0

# Called where a kernel begins to be compiled.
listeners: list[Callable[[], None]] = []


class _NotPrivate(Exception):
    """Others could have put something into a folder; the message says how."""


# --- compilation --------------------------------------------------------------------------------


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

    listeners.append(announce)
    with ExitStack() as stack:
        stack.callback(listeners.remove, announce)
        if gc.isenabled():  # a search for garbage would find nothing, time and again
            gc.disable()
            stack.callback(gc.enable)
        work()
    if not started:
        return 0.0
    seconds = perf_counter() - started[0]
    LOG.info("kernels compiled in %.3g s", seconds)
    return seconds


def kept_in(folder: Path | None) -> dict[str, Any]:
    """Return the options of numba for a kernel that is kept in a folder, if there is one.

    Each time anew: numba takes the folder from the environment again when that changes, or from a
    file `.numba_config.yaml` where the user is.
    """
    import numba

    if folder is None:
        return {}
    config: Any = numba.config
    config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), ""
    return {"cache": True}


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
        return _prepared(user_cache_path(PROGRAM, appauthor=False), name)
    except _NotPrivate as error:
        reason = str(error)
    except (OSError, RuntimeError) as error:  # RuntimeError: the user has no home
        what = getattr(error, "strerror", None) or error
        where = getattr(error, "filename", None)
        reason = f"'{where}': {what}" if where else str(what)
    LOG.warning(
        "there is no private folder to keep compiled kernels in (%s); every run that needs them"
        " compiles them anew, in 10 to 30 s: set XDG_CACHE_HOME to a folder of your own",
        reason,
    )
    return None


def _prepared(base: Path, name: str) -> Path:
    """Return the folder of a build in a base folder; both are made if they are not there."""
    if not base.is_absolute():  # it would depend on the folder that the user is in
        raise _NotPrivate(f"'{base}' is no absolute path")
    base.parent.mkdir(parents=True, exist_ok=True)
    _check_way(base)
    if not _is_closed(base):
        base.chmod(PRIVATE)
    folder = base / name
    is_new = not os.path.lexists(folder)
    if not _is_closed(folder):
        LOG.info("others could enter %s: its content is removed", folder)
        rmtree(folder)
        folder.mkdir(mode=PRIVATE)
    # On Windows no other question about a folder has a reliable answer. To try is to use, too: it
    # sets the folder's time stamp.
    with NamedTemporaryFile(dir=folder):
        pass
    if is_new:
        _remove_unused(folder, folder.lstat().st_uid)
    return folder


def _check_way(base: Path) -> None:
    """Check that no other user can put another folder into the place of one."""
    if not hasattr(os, "geteuid"):
        return
    for folder in {*base.parents, *base.parent.resolve().parents, base.parent.resolve()}:
        status = folder.stat()
        if status.st_uid not in {ROOT, os.geteuid()}:
            raise _NotPrivate(f"'{folder}' belongs to another user")
        if status.st_mode & ANYONE_WRITES and not status.st_mode & S_ISVTX:
            raise _NotPrivate(f"anyone can write to '{folder}'")


def _is_closed(folder: Path) -> bool:
    """Make a folder, or take the user's own one; return whether it is closed to others."""
    with suppress(FileExistsError):
        folder.mkdir(mode=PRIVATE)
    status = folder.lstat()
    if not S_ISDIR(status.st_mode):
        raise _NotPrivate(f"'{folder}' is a link or a file, not a folder")
    if hasattr(os, "geteuid") and status.st_uid != os.geteuid():
        raise _NotPrivate(f"'{folder}' belongs to another user")
    return not hasattr(os, "geteuid") or not status.st_mode & OTHERS


def _remove_unused(new: Path, owner: int) -> None:
    """Remove the folders of other builds beside a new one that were not used for a week."""
    for path in [path for path in new.parent.iterdir() if BUILD.fullmatch(path.name)]:
        with suppress(OSError):  # another process was faster
            status = path.lstat()  # of a link, not of what it leads to
            is_ours = S_ISDIR(status.st_mode) and status.st_uid == owner
            if path != new and is_ours and time() - status.st_mtime > UNUSED_LIFETIME:
                rmtree(path, ignore_errors=True)
