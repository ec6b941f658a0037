"""Tables as data: TOML with the line of each key, keys and values, the scenario in a result."""

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from os import PathLike, fsdecode
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

from frictionsim.display import NO_VALUE, cut_text
from frictionsim.errors import InputError, ScenarioError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pydantic import BaseModel

    from frictionsim.results import Record

KeyPath = tuple[str | int, ...]

MAX_VALUE = 60  # characters of a value in a message
# Scenarios are written by hand; long signals belong in a CSV file.
MAX_BYTES = 1024 * 1024
# tomllib takes 20 GB for a key of 100 000 parts. The first part begins where a word begins: else a
# long word would be searched again from each of its letters.
MAX_PARTS = 32
_PART = r"""(?:(?<![\w-])[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_LONG_KEY = re.compile(rf"(?:{_PART}){{{MAX_PARTS}}}")
# A longer statement is a signal of many points. Parsing it again with each added line would be
# slow, so it is parsed only after lines that may end it.
LONG_STATEMENT = 100
CLOSINGS = ("]", "}", '"', "'")

# What is meant by lines that TOML does not take.
NUMBER_HINTS = {
    r"(^|=)\s*[+-]?\d+,\d+\s*(#|$)": "; the decimal mark of TOML is a point, as in 450.0",
    r"(^|[=\[,])\s*[+-]?0\d": "; a number of TOML has no zero in front, as in 8.0",
}


class NoUsableText(ValueError):
    """A text that is too large or too deep, or has a number out of range."""


class KeyPlaces:
    """Where keys stand, for messages: the name of a file and its lines by path, 0 if in no file.

    `above` stands before each key of tables in another file; `start` is the line of what is not
    there.
    """

    def __init__(
        self, name: str, lines: Callable[[], dict[KeyPath, int]], above: str = "", start: int = 1
    ) -> None:
        self.name, self._lines, self.above, self.start = name, lines, above, start

    @cached_property
    def lines(self) -> dict[str, int]:
        """The lines by keys with dots."""
        return {dotted(path): line for path, line in self._lines().items()}

    def line(self, key: str) -> int:
        """Return the line of a key with dots, or of the innermost table around it."""
        while key and key not in self.lines:
            key = key.rpartition(".")[0]
        return self.lines.get(key, self.start)

    def where(self, key: str) -> str:
        """Return file and line of a key; the file alone of one that is in no file."""
        line = self.line(key)
        return f"{self.name}:{line}" if line else self.name


def dotted(path: KeyPath) -> str:
    return ".".join(map(str, path))


def read_text(file: BinaryIO) -> str:
    """Return the text of a file, of which no more than MAX_BYTES are read.

    Raises NoUsableText if it has more, and UnicodeDecodeError if it is not UTF-8.
    """
    content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise NoUsableText(
            f"the file is larger than {MAX_BYTES >> 20} MiB; use CSV files for signals"
        )
    return content.decode("utf-8-sig")


def toml_tables(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises a TOMLDecodeError if it is not valid, and NoUsableText if it is nested too deeply or a
    value cannot be held: an integer of thousands of digits, a date that does not exist.
    """
    if _LONG_KEY.search(text):
        raise NoUsableText(f"a key has more than {MAX_PARTS} parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise NoUsableText("tables or lists are nested too deeply") from None
    except ValueError as error:
        raise NoUsableText(f"not a usable TOML value: {error}") from None


def parsed_value(text: str) -> Any:
    """Return the value that a TOML text gives, as 0.3 or [1, 2]; raise a ValueError if not one."""
    data = toml_tables(f"value = {text}")
    if len(data) != 1:  # the text has further lines with keys
        raise ValueError("more than one value")
    return data["value"]


def number_hint(text: str) -> str:
    """Return what is meant by a line, or a value, that TOML does not take; empty if unknown."""
    return next((hint for form, hint in NUMBER_HINTS.items() if re.search(form, text)), "")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Return the line, from 1, of each table and key of a valid TOML text, by its path.

    Lines are added to a statement until tomllib can parse it. Paths include indices of arrays of
    tables.
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
        if statement[0].lstrip().startswith("["):
            header = _header(parsed, arrays)
            for depth in range(1, len(header) + 1):
                lines.setdefault(header[:depth], first)
        else:
            for path in tables_and_keys(parsed, header):
                lines.setdefault(path, first)
        statement = []
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


def tables_and_keys(table: Mapping[str, Any], parent: KeyPath = ()) -> Iterator[KeyPath]:
    """Yield the paths of all tables and keys in a table."""
    for key, value in table.items():
        yield (*parent, key)
        if isinstance(value, Mapping):
            yield from tables_and_keys(value, (*parent, key))


def keys_and_values(
    value: Any, path: str = "", lists: Literal["whole", "tables", "all"] = "tables"
) -> Iterator[tuple[str, Any]]:
    """Yield the keys of nested tables with dots, as of --set, with their values.

    `lists` are those that are entered: none; those of tables, which have their name in the key
    where each has its own, else their number; all, by number.
    """
    entries: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, Mapping):
        entries = value.items()
    elif isinstance(value, list | tuple) and lists == "all":
        entries = enumerate(value)
    elif lists == "tables" and isinstance(value, list | tuple) and _are_tables(value):
        names = [str(row.get("name", "")) for row in value]
        named = all(names) and len(set(names)) == len(names)
        entries = zip(names if named else range(len(value)), value, strict=True)
    if not entries or not value:
        yield path, value
        return
    for key, inner in entries:
        yield from keys_and_values(inner, f"{path}.{key}" if path else str(key), lists)


def _are_tables(rows: Iterable[Any]) -> bool:
    return all(isinstance(row, Mapping) for row in rows)


def plain(value: Any, where: str = "scenario") -> Any:
    """Return a value as TOML has it: numbers of numpy, arrays, tuples and paths are converted.

    `where` begins the message of a value of another type.
    """
    if isinstance(value, Mapping):
        below = "." if ": " in where else ": "  # `scenario: solver.rtol`
        return {str(key): plain(inner, f"{where}{below}{key}") for key, inner in value.items()}
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(inner, where) for inner in value]
    if isinstance(value, PathLike):
        return fsdecode(value)
    if isinstance(value, bool | int | float | str):
        return value
    raise ScenarioError(
        [f"{where}: expected a number, text, boolean, list or table, got {type(value).__name__}"]
    )


def tables_of(scenario: "BaseModel") -> Any:
    """Return the tables of a scenario without defaults: some depend on other keys.

    As output.interval does on the duration.
    """
    return plain(scenario.model_dump(by_alias=True, exclude_none=True, exclude_unset=True))


def toml_value(value: Any) -> str:
    """Return a plain value as TOML in one line."""
    if isinstance(value, dict):
        pairs = (f"{_key(key)} = {toml_value(inner)}" for key, inner in value.items())
        return f"{{ {', '.join(pairs)} }}" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, str):
        return _quoted(value)
    return repr(value).lower() if isinstance(value, bool) else repr(value)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[\w-]+", name, re.ASCII) else _quoted(name)


def _quoted(text: str) -> str:
    """Return a text as TOML; unlike JSON it has no surrogate pairs and no DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def value_text(value: Any, length: int = MAX_VALUE) -> str:
    """Return the value of a key in TOML with at most so many characters; None is `none`.

    A list that is longer ends after a whole value, with the number of all.
    """
    text = NO_VALUE if value is None else toml_value(value)
    if len(text) <= length or not isinstance(value, list):
        return cut_text(text, length)
    end = f"... {len(value)} in all]"
    return f"{text[: length - len(end)].rpartition(' ')[0] or '['} {end}"


def scenario_of(result: "Record") -> dict[str, Any]:
    """Return the scenario of a result as data."""
    return _stored(result.attributes["scenario"])


def _stored(text: str) -> dict[str, Any]:
    try:
        return toml_tables(text)
    except ValueError as error:
        raise InputError(f"cannot read the scenario in this result: {error}") from None


def differing_keys(texts: "Sequence[str]") -> dict[str, list[Any]]:
    """Return the keys, as of --set, in which scenarios or studies in TOML differ.

    Each has the values of all; None where there is no such key.
    """
    tables = [dict(keys_and_values(_stored(text))) for text in texts]
    names = dict.fromkeys(name for values in tables for name in values)
    compared = {name: [values.get(name) for values in tables] for name in names}
    return {name: values for name, values in compared.items() if values != values[:1] * len(tables)}


def changes(first: str, second: str, between: str = ", now ", most: int = 3) -> list[str]:
    """Return keys in which two texts differ with their values: `solver.rtol: 1e-06, now 1e-09`.

    `between` stands between the two values. Of more keys than `most` the others are counted.
    """
    texts = [
        f"{key}: {between.join(value_text(value) for value in values)}"
        for key, values in differing_keys([first, second]).items()
    ]
    more = len(texts) - most
    return [*texts[:most], f"{more} more keys differ"] if more > 0 else texts
