"""The line of each key in a TOML text, which tomllib does not report."""

import tomllib
from typing import Any

KeyPath = tuple[str | int, ...]

# A longer statement is a signal of many points. Parsing it again with each added line would be
# slow, so it is parsed only after lines that may end it.
LONG_STATEMENT = 100
# Text that is parsed in all; keys further down have the line of a table around them.
MAX_PARSED = 4_000_000
CLOSINGS = ("]", "}", '"', "'")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Return the line of each table and key of a valid TOML text.

    Lines are added to a statement until tomllib can parse it.

    Returns
    -------
    dict
        Line, counted from 1, by path of the key; the path includes indices of arrays of tables.
    """
    lines: dict[KeyPath, int] = {}
    arrays: dict[KeyPath, int] = {}
    header: KeyPath = ()
    statement: list[str] = []
    parsed_so_far = 0
    for number, line in enumerate(text.split("\n"), start=1):
        statement.append(line)
        if len(statement) > LONG_STATEMENT and not line.rstrip().endswith(CLOSINGS):
            continue
        source = "\n".join(statement)
        parsed_so_far += len(source)
        if parsed_so_far > MAX_PARSED:
            break
        try:
            parsed = tomllib.loads(source)
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
    """Return the path of a table header, with the indices of arrays of tables."""
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
    """Record the line of all keys of a statement, including those of inline tables."""
    left = [(parent, table)]
    while left:
        around, inner = left.pop()
        for key, value in inner.items():
            path = (*around, key)
            lines.setdefault(path, line)
            if isinstance(value, dict):
                left.append((path, value))
