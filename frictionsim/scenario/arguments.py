"""Checks of the arguments of functions; each raises an ArgumentError that names the argument."""

from os import PathLike, fsdecode
from pathlib import Path
from typing import Any

from frictionsim.display import cut_text
from frictionsim.errors import ArgumentError

ColumnKey = str | int  # the name of a column, or its number from 1
MAX_VALUE_LENGTH = 40  # characters of an invalid value in a message


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


def toml_text(value: Any) -> str:
    """Return a value as TOML, shortened, for a message."""
    if isinstance(value, dict):
        return "a table" if value else "an empty table"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return cut_text(f"'{text}'" if isinstance(value, str) else text, MAX_VALUE_LENGTH)


def plain_number(value: Any) -> Any:
    """Return numbers of NumPy as those of Python, and whole floats as whole numbers."""
    if hasattr(value, "item") and getattr(value, "ndim", 1) == 0:
        value = value.item()
    return int(value) if isinstance(value, float) and value.is_integer() else value
