"""The folder of compiled kernels: in the user's cache, or in a private folder of their own."""

import getpass
import os
import re
from pathlib import Path
from shutil import rmtree
from stat import S_ISDIR
from tempfile import NamedTemporaryFile, gettempdir, mkdtemp
from time import time

from platformdirs import user_cache_path

PROGRAM = "frictionsim"
BUILD = re.compile(r"kernels-[0-9a-f]{16}")  # the folder of a build, as `jit.build_name` has it
KEPT_UNUSED = 7 * 24 * 3600.0  # s; several versions may be in use side by side


def cache_folder(name: str) -> Path:
    """Return the folder of a build's compiled kernels in the user's cache; it need not exist.

    Parameters
    ----------
    name : str
        Of the build.

    Returns
    -------
    Path
    """
    return user_cache_path(PROGRAM, appauthor=False) / name


def usable_folder(name: str) -> Path:
    """Return a folder for compiled kernels that can be written to.

    Where the user's cache cannot be written to, it is in the folder for temporary files. Others
    may write there too, so a folder that does not belong to the user is not taken: kernels are
    machine code that runs with the user's rights. Then the folder is a new one for this process.
    When a folder is made, those of other builds that nobody has used for a week are removed.

    Parameters
    ----------
    name : str
        Of the build.

    Returns
    -------
    Path
    """
    folder = cache_folder(name)
    if _is_usable(folder):
        return folder
    own = Path(gettempdir()) / f"{PROGRAM}-{_user_name()}"
    owner = _owner_of_new_files(own, mode=0o700)
    # Not what a link leads to: whoever made the link can have it lead elsewhere.
    if owner is not None and own.lstat().st_uid == owner:
        folder = own / name
        if _is_usable(folder):
            return folder
    return Path(mkdtemp(prefix=f"{PROGRAM}-"))


def _is_usable(folder: Path) -> bool:
    """Return whether a build's folder can be written to; if it is new, remove old ones beside it.

    To try is to use: it sets the folder's time stamp.
    """
    is_new = not folder.exists()
    owner = _owner_of_new_files(folder)
    if owner is None:
        return False
    if is_new:
        _remove_unused(folder, owner)
    return True


def _remove_unused(new: Path, owner: int) -> None:
    """Remove the folders of other builds beside a new one that were not used for a week."""
    try:
        others = [path for path in new.parent.iterdir() if BUILD.fullmatch(path.name)]
    except OSError:  # whoever may write there need not be allowed to list it
        return
    for path in others:
        try:
            found = path.lstat()  # of a link, not of what it leads to
        except OSError:  # another process was faster
            continue
        is_ours = S_ISDIR(found.st_mode) and found.st_uid == owner
        if path != new and is_ours and time() - found.st_mtime > KEPT_UNUSED:
            rmtree(path, ignore_errors=True)


def _owner_of_new_files(folder: Path, mode: int = 0o777) -> int | None:
    """Return who owns files that this process writes to a folder; None if it cannot.

    The folder is made if there is none, with this mode where the system has modes.

    Writing is tried: on Windows no other question about a folder has a reliable answer.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=mode)
        with NamedTemporaryFile(dir=folder) as file:
            return os.fstat(file.fileno()).st_uid
    except OSError:
        return None


def _user_name() -> str:
    """Return the user's name for a file name; 'user' where the system knows none."""
    try:
        name = getpass.getuser()
    except (ImportError, KeyError, OSError):  # as in a container, for a user that it has no name of
        return "user"
    return "".join(letter if letter.isalnum() else "_" for letter in name)
