"""The folder of compiled kernels: in the user's cache, or in a private folder of their own."""

import getpass
import os
from pathlib import Path
from tempfile import NamedTemporaryFile, gettempdir, mkdtemp

from platformdirs import user_cache_path

PROGRAM = "frictionsim"


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

    Parameters
    ----------
    name : str
        Of the build.

    Returns
    -------
    Path
    """
    folder = cache_folder(name)
    if _owner_of_new_files(folder) is not None:
        return folder
    own = Path(gettempdir()) / f"{PROGRAM}-{_user_name()}"
    owner = _owner_of_new_files(own, mode=0o700)
    # Not what a link leads to: whoever made the link can have it lead elsewhere.
    if owner is not None and own.lstat().st_uid == owner:
        folder = own / name
        if _owner_of_new_files(folder) is not None:
            return folder
    return Path(mkdtemp(prefix=f"{PROGRAM}-"))


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
