"""Messages on stderr and JSON on stdout."""

import sys
from collections.abc import Iterable
from typing import Any


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


def print_json(data: dict[str, Any]) -> None:
    """Print an object on stdout; it must not contain non-finite numbers."""
    from json import dumps

    print(dumps(data, indent=2, allow_nan=False))
