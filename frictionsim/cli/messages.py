"""Messages on stderr; text and JSON on stdout."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from frictionsim.errors import OutputError
from frictionsim.io.terminal import ReaderGone, Stdout, print_on_stderr


def print_error(message: str) -> None:
    """Print a message on stderr, after the name of the program."""
    print_on_stderr(f"frictionsim: {message}")


def warn(warnings: Iterable[str], source: str = "") -> None:
    """Print warnings on stderr.

    Parameters
    ----------
    warnings : iterable of str
    source : str
        Prefix of each warning, such as "file: ".
    """
    for warning in warnings:
        print_error(f"warning: {source}{warning}")


def warn_of_name(written: Path | None) -> None:
    """Warn of an HDF5 file without a suffix of HDF5."""
    from frictionsim.io.atomic_write import SUFFIXES

    if written is not None and written.suffix.lower() not in SUFFIXES:
        ends = " or ".join((", ".join(SUFFIXES[:-1]), SUFFIXES[-1]))
        warn([f"{written}: the file is HDF5 whatever its name; names of HDF5 end in {ends}"])


def print_text(text: str) -> None:
    """Print text on stdout; it is discarded after the reader of a pipe has gone."""
    stdout = Stdout()
    with suppress(ReaderGone):
        stdout.write(f"{text}\n")
        stdout.flush()


def print_json(data: Any) -> None:
    """Print data on stdout; they must not contain non-finite numbers."""
    from json import dumps

    print_text(dumps(data, indent=2, allow_nan=False))


def print_data(data: Any) -> None:
    """Print text as it is, and other data as JSON."""
    if isinstance(data, str):
        print_text(data)
    else:
        print_json(data)


def print_beside_files(data: Any) -> None:
    """Print the summary of a command that writes files, as `print_data`.

    If stdout cannot be written, e.g. on a full disk, a warning on stderr says so, and the exit code
    stays that of the run.
    """
    try:
        print_data(data)
    except OutputError as error:
        print_error(f"warning: {error}; the files of this command are not affected")


def log_on_stderr(verbose: int) -> None:
    """Print logged warnings; with -v also information, with -vv also details.

    Parameters
    ----------
    verbose : int
        How often -v was given.
    """
    import logging  # imported here: --help does without, which it would slow down by a tenth

    class Lines(logging.Handler):
        """Prints records as messages; an unprintable one does not end the run."""

        def emit(self, record: logging.LogRecord) -> None:
            level = "" if record.levelno <= logging.INFO else f"{record.levelname.lower()}: "
            print_error(f"{level}{record.getMessage()}")

    logger = logging.getLogger("frictionsim")
    logger.handlers = [Lines()]
    logger.setLevel((logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)])
