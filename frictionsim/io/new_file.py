"""Text files that are written once: an existing file is never replaced."""

from contextlib import suppress
from os.path import exists, isdir
from pathlib import Path

from frictionsim.errors import OutputError


def check_new(path: Path, what: str) -> None:
    """Check that a new file can be written to a path, before what it will hold is computed."""
    from frictionsim.io.atomic_write import check_place

    if exists(path) and not isdir(path):  # Path.exists fails for a name that is too long
        raise _not_written(path, what, FileExistsError())
    check_place(path, what)


def write_new(path: Path, text: str, what: str) -> None:
    """Write a file that is not there yet, whole or not at all.

    The name is taken by an empty file first, so that no file that appears meanwhile is replaced.
    """
    from frictionsim.io.atomic_write import write_atomically

    try:
        path.open("xb").close()
    except OSError as error:
        raise _not_written(path, what, error) from None
    try:
        write_atomically(text.encode(), path, what)
    except BaseException:
        with suppress(OSError):
            path.unlink()
        raise


def _not_written(path: Path, what: str, error: OSError) -> OutputError:
    if isdir(path):  # false for a name that is too long, where Path.is_dir fails
        why = "this is a folder; give a file name"
    elif isinstance(error, FileExistsError):
        why = "the file exists and is not replaced; give another name"
    elif not isdir(path.parent):
        why = f"there is no folder '{path.parent}'"
    else:
        why = str(error.strerror)
    return OutputError(f"{path}: cannot write the {what}: {why}")
