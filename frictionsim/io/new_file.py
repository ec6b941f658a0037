"""Text files that never replace an existing file."""

from contextlib import suppress
from os.path import exists, isdir
from pathlib import Path

from frictionsim.errors import OutputError

EXISTS = "the file exists and is not replaced; give another name"


def check_new(path: Path, what: str) -> None:
    """Check that a new file can be written to a path, before its content is computed."""
    from frictionsim.io.atomic_write import check_place

    if exists(path) and not isdir(path):  # Path.exists fails for a name that is too long
        raise _not_written(path, what, EXISTS)
    check_place(path, what)


def write_new(path: Path, text: str, what: str) -> None:
    """Write a new file atomically.

    An empty file reserves the name first, so that no file that appears meanwhile is replaced.
    """
    from frictionsim.io.atomic_write import write_atomically

    check_new(path, what)
    try:
        path.open("xb").close()
    except OSError as error:
        why = EXISTS if isinstance(error, FileExistsError) else str(error.strerror)
        raise _not_written(path, what, why) from None
    try:
        write_atomically(text.encode(), path, what)
    except BaseException:
        with suppress(OSError):
            path.unlink()
        raise


def _not_written(path: Path, what: str, why: str) -> OutputError:
    return OutputError(f"{path}: cannot write the {what}: {why}")
