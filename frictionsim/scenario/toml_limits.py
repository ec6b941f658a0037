"""Limits of a TOML text, so that reading one that no scenario needs does not take minutes.

tomllib takes a time that grows with the square of the parts of a dotted key, and a millisecond for
some ten tables; the search for the lines of keys takes as long again.
"""

import re
from typing import Any

# Scenarios are written by hand; long signals belong in a CSV file.
MAX_BYTES = 1024 * 1024
MAX_TABLES = 2000  # a belt has one for each pulley
MAX_KEYS = 10_000
MAX_DEPTH = 32  # scenarios are six deep

_HEADER = re.compile(r"^[ \t]*\[", re.MULTILINE)
_STATEMENT = re.compile(r"^[ \t]*[^#\s][^\n]*=", re.MULTILINE)
# Begins where a word begins: else a long word would be searched again from each of its letters.
_PART = r"""(?:(?<![\w-])[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_DEEP_KEY = re.compile(rf"(?:{_PART}){{{MAX_DEPTH}}}")


def excess_of_text(text: str) -> str:
    """Return what a text has too much of, before it is parsed; empty if nothing."""
    if _DEEP_KEY.search(text):
        return f"a key has more than {MAX_DEPTH} parts"
    tables = sum(1 for _ in _HEADER.finditer(text))
    if tables > MAX_TABLES:
        return f"it has {tables} tables; the limit is {MAX_TABLES}"
    keys = sum(1 for _ in _STATEMENT.finditer(text))
    return f"it has {keys} keys; the limit is {MAX_KEYS}" if keys > MAX_KEYS else ""


def excess_of_data(data: dict[str, Any]) -> str:
    """Return what the data of a text have too much of; empty if nothing."""
    level: list[Any] = [data]
    keys = 0
    for _ in range(MAX_DEPTH):
        level = [inner for table in level for inner in _inner(table)]
        keys += len(level)
        if keys > MAX_KEYS:
            return f"it has more than {MAX_KEYS} keys"
        level = [inner for inner in level if isinstance(inner, dict | list)]
        if not level:
            return ""
    return f"its tables are nested more than {MAX_DEPTH} deep"


def _inner(table: Any) -> Any:
    """Return what is in a table, or the tables in a list; a list of numbers is one value."""
    if isinstance(table, dict):
        return table.values()
    return [item for item in table if isinstance(item, dict | list)]
