"""What goes to the streams beside tables: sentences to stderr, one JSON object to stdout."""

import sys
from collections.abc import Iterable
from typing import Any


def print_error(message: str) -> None:
    """Say something on stderr, with the name of the program."""
    print(f"frictionsim: {message}", file=sys.stderr)


def warn(warnings: Iterable[str], source: str = "") -> None:
    """Say each warning on stderr; `source` is what it is of, as "file: "."""
    for warning in warnings:
        print_error(f"warning: {source}{warning}")


def print_json(data: dict[str, Any]) -> None:
    """Print an object on stdout; what is not finite must have become null before."""
    from json import dumps

    print(dumps(data, indent=2, allow_nan=False))
