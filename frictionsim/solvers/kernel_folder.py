"""The folder of compiled kernels, in the user's cache.

What is in it is loaded as machine code (numba's .nbc) or unpickled (.nbi), both of which run with
the user's rights. So a folder is taken only if nobody else can have put anything into it:

- The folder and the one it is in belong to the user, are folders and no links. They are closed to
  others (mode 0700) if they were not. If others could write to the folder of a build, its content
  is removed and compiled again: its author is unknown.
- All in it belongs to the user, and is a file or a folder; else the content is removed as well.
- Nobody but the user and root can exchange these folders for others: each folder on the way to
  them belongs to one of these two, and is not writable for all others unless it is sticky, as /tmp
  is. A group that may write to the user's own cache is the user's decision.

Without such a folder the kernels are compiled for each process anew, and never read from a disk.
The folder that `NUMBA_CACHE_DIR` names is not used: it may hold kernels of other programs.
Windows has no such owners and modes; there it is in the user's profile.
"""

import logging
import os
import re
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from stat import S_IMODE, S_ISDIR, S_ISREG, S_ISVTX
from tempfile import NamedTemporaryFile
from time import time

from platformdirs import user_cache_path

LOG = logging.getLogger(__name__)

PROGRAM = "frictionsim"
BUILD = re.compile(r"kernels-[0-9a-f]{16}")  # the folder of a build, as `build_name` has it
UNUSED_LIFETIME = 7 * 24 * 3600.0  # s; several versions may be in use side by side
PRIVATE, ROOT = 0o700, 0
OTHERS_WRITE, OTHERS_ENTER = 0o022, 0o011


class _NotPrivate(Exception):
    """Others could have put something into a folder; the message says how."""


def usable_folder(name: str) -> Path | None:
    """Return a folder for compiled kernels that the user alone can write to.

    When a folder is made, those of other builds that nobody has used for a week are removed.

    Parameters
    ----------
    name : str
        Of the build.

    Returns
    -------
    Path or None
        None if there is none: then nothing is kept, which a warning says.
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
    _close_to_others(base)
    folder = base / name
    is_new = not os.path.lexists(folder)
    before = _close_to_others(folder)
    if before & OTHERS_WRITE or not _is_all_ours(folder, bool(before & OTHERS_ENTER)):
        LOG.info("others could write to %s: its content is removed", folder)
        rmtree(folder)
        _close_to_others(folder)
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
    trusted = {ROOT, os.geteuid()}
    for folder in {*base.parents, *base.parent.resolve().parents, base.parent.resolve()}:
        status = folder.stat()
        if status.st_uid not in trusted:
            raise _NotPrivate(f"'{folder}' belongs to another user")
        if status.st_mode & 0o002 and not status.st_mode & S_ISVTX:
            raise _NotPrivate(f"anyone can write to '{folder}'")


def _close_to_others(folder: Path) -> int:
    """Make a folder, or take the user's own one, and have the user alone enter it.

    Returns
    -------
    int
        Its mode before.

    Raises
    ------
    _NotPrivate
        If it belongs to another user, or is something else.
    """
    with suppress(FileExistsError):
        folder.mkdir(mode=PRIVATE)
    status = folder.lstat()
    if not S_ISDIR(status.st_mode):
        raise _NotPrivate(f"'{folder}' is a link or a file, not a folder")
    if not hasattr(os, "geteuid"):
        return PRIVATE
    # By a descriptor: what was a folder just now may be a link by the time its mode is set.
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        status = os.fstat(descriptor)
        if status.st_uid != os.geteuid():
            raise _NotPrivate(f"'{folder}' belongs to another user")
        if S_IMODE(status.st_mode) & 0o077:
            os.fchmod(descriptor, PRIVATE)
        return S_IMODE(status.st_mode)
    finally:
        os.close(descriptor)


def _is_all_ours(folder: Path, was_open: bool) -> bool:
    """Return whether all that is in a folder is the user's own.

    Parameters
    ----------
    folder : Path
    was_open : bool
        Others could enter it, so its files must not be writable for them.
    """
    if not hasattr(os, "geteuid"):
        return True
    user = os.geteuid()
    with os.scandir(folder) as entries:
        for entry in entries:
            status = entry.stat(follow_symlinks=False)
            mode = status.st_mode
            if status.st_uid != user or (was_open and mode & OTHERS_WRITE):
                return False
            is_fit = _is_all_ours(Path(entry), was_open) if S_ISDIR(mode) else S_ISREG(mode)
            if not is_fit:
                return False
    return True


def _remove_unused(new: Path, owner: int) -> None:
    """Remove the folders of other builds beside a new one that were not used for a week."""
    others = [path for path in new.parent.iterdir() if BUILD.fullmatch(path.name)]
    for path in others:
        try:
            status = path.lstat()  # of a link, not of what it leads to
        except OSError:  # another process was faster
            continue
        is_ours = S_ISDIR(status.st_mode) and status.st_uid == owner
        if path != new and is_ours and time() - status.st_mtime > UNUSED_LIFETIME:
            rmtree(path, ignore_errors=True)
