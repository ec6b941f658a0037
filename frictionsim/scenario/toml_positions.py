"""On which line of a TOML text each key stands; tomllib keeps no positions."""

import tomllib
from typing import Any

KeyPath = tuple[str | int, ...]

# A statement longer than this is data, a signal of many points; parsing it anew with each of its
# lines would take long, so only those are tried that it may end with.
LONG_STATEMENT = 100
CLOSINGS = ("]", "}", '"', "'")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Return the line of each table and key of a valid TOML text.

    A statement is what tomllib can parse by itself: one line, or as many as its brackets and
    quotes need.

    Parameters
    ----------
    text : str

    Returns
    -------
    dict
        From the path of a key, with the index of a table in an array of tables, to its line,
        counted from 1.
    """
    lines: dict[KeyPath, int] = {}
    arrays: dict[KeyPath, int] = {}
    header: KeyPath = ()
    statement: list[str] = []
    for number, line in enumerate(text.split("\n"), start=1):
        statement.append(line)
        if len(statement) > LONG_STATEMENT and not line.rstrip().endswith(CLOSINGS):
            continue
        try:
            parsed = tomllib.loads("\n".join(statement))
        except tomllib.TOMLDecodeError:
            continue
        first = number - len(statement) + 1
        is_header = statement[0].lstrip().startswith("[")
        statement = []
        if is_header:
            header = _header(parsed, arrays)
            for depth in range(1, len(header) + 1):
                lines.setdefault(header[:depth], first)
        else:
            _add(parsed, header, first, lines)
    return lines


def _header(parsed: dict[str, Any], arrays: dict[KeyPath, int]) -> KeyPath:
    """Return the path of a table header, counting the tables of each array of tables."""
    path: KeyPath = ()
    table: Any = parsed
    while isinstance(table, dict) and table:
        name, table = next(iter(table.items()))
        path = (*path, name)
        if isinstance(table, list):
            arrays[path] = arrays.get(path, -1) + 1
            table = table[0]
        if path in arrays:
            path = (*path, arrays[path])
    return path


def _add(table: dict[str, Any], parent: KeyPath, line: int, lines: dict[KeyPath, int]) -> None:
    """Note the line of all keys of a statement, those of its inline tables, too."""
    left = [(parent, table)]
    while left:
        around, inner = left.pop()
        for key, value in inner.items():
            path = (*around, key)
            lines.setdefault(path, line)
            if isinstance(value, dict):
                left.append((path, value))
