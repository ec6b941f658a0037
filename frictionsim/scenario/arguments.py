"""Arguments of functions that are no options."""

from os import PathLike, fsdecode
from pathlib import Path
from typing import Any

from frictionsim.errors import ArgumentError


def text_of(value: Any) -> str:
    """Return a value for a message: text as it is written, of others the type."""
    return repr(value) if isinstance(value, str | int | float) else type(value).__name__


def as_path(argument: str, value: str | PathLike[str]) -> Path:
    """Return a path; raise ArgumentError if the value is of another type."""
    if not isinstance(value, str | PathLike):
        raise ArgumentError(argument, f"expected a path, got {text_of(value)}")
    path = fsdecode(value)
    if "\0" in path:
        raise ArgumentError(argument, f"expected a path, got one with a zero byte: {path!r:.60}")
    return Path(path)
