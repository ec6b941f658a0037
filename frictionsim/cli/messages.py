"""Messages on stderr; text and JSON on stdout."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO


def print_error(message: str) -> None:
    """Print a message on stderr, after the name of the program."""
    print(f"frictionsim: {message}", file=sys.stderr)


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


def print_text(text: str) -> None:
    """Print text on stdout; it is discarded after the reader of a pipe has gone.

    Raises
    ------
    OSError
        If it cannot be printed for another reason.
    """
    with opened_stdout() as stdout:
        print(text, file=stdout)


@contextmanager
def opened_stdout() -> Iterator[TextIO]:
    """Return the context of writing to stdout, which ends after the reader of a pipe has gone.

    What is printed later is discarded, as is everything if stdout is closed.

    Raises
    ------
    OSError
        If something cannot be printed for another reason.
    """
    if sys.stdout is None:
        with open(os.devnull, "w", encoding="utf-8") as null:
            yield null
        return
    try:
        yield sys.stdout
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_json(data: Any) -> None:
    """Print data on stdout; they must not contain non-finite numbers."""
    from json import dumps

    print_text(dumps(data, indent=2, allow_nan=False))
