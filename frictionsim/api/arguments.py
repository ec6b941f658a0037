"""Checks of arguments that have the wrong type or are out of range."""

from collections.abc import Iterable
from os import PathLike, fsdecode
from pathlib import Path
from typing import Any

from frictionsim.errors import ArgumentError


def as_path(argument: str, value: str | PathLike[str]) -> Path:
    """Return a path; raise ArgumentError if the value is of another type."""
    if not isinstance(value, str | PathLike):
        raise ArgumentError(argument, f"expected a path, got {_shown(value)}")
    path = fsdecode(value)
    if "\0" in path:
        raise ArgumentError(argument, f"expected a path, got one with a zero byte: {path!r:.60}")
    return Path(path)


def as_number(argument: str, value: Any, unit: str = "") -> float:
    """Return a number above 0; raise ArgumentError if it is none."""
    wanted = f"a number above 0{unit and f' {unit}'}"
    return _number(argument, value, wanted, lambda number: number > 0.0)


def as_count(argument: str, value: Any) -> int:
    """Return a whole number above 0; raise ArgumentError if it is none."""
    wanted = "a whole number above 0"
    number = _number(argument, value, wanted, lambda number: number >= 1.0 and number % 1.0 == 0.0)
    return int(number)


def as_tolerance(argument: str, value: Any) -> float:
    """Return a number of at least 0; raise ArgumentError if it is none."""
    return _number(argument, value, "a number of at least 0", lambda number: number >= 0.0)


def _number(argument: str, value: Any, wanted: str, fits: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = None
    if number is None or isinstance(value, str):
        raise ArgumentError(argument, f"expected {wanted}, got {_shown(value)}")
    if not fits(number):  # also nan
        raise ArgumentError(argument, f"expected {wanted}, got {number:g}")
    return number


def as_names(argument: str, value: str | Iterable[str]) -> list[str]:
    """Return a list of names; a single text is one name.

    Raises
    ------
    ArgumentError
        If they are not texts.
    """
    if isinstance(value, str):
        return [value]
    names = list(value) if isinstance(value, Iterable) else [value]
    for name in names:
        if not isinstance(name, str):
            raise ArgumentError(argument, f"expected names, got {_shown(name)}")
    return names


def _shown(value: Any) -> str:
    """Return a value for a message: text as it is written, of others the type."""
    return repr(value) if isinstance(value, str | int | float) else type(value).__name__
