"""Overrides of single keys of a scenario: texts as for --set, or a mapping of keys to values."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.toml_data import KeyPath, number_hint, parsed_value, plain, toml_value

Overrides = Mapping[str, Any] | Iterable[str]
"""Values by key, as {"solver.rtol": 1e-9}; or texts KEY=VALUE with VALUE in TOML."""

REMOVED = None  # the value of a key to take out, as of an effect that is not to be simulated
REMOVED_TEXT = "none"

BY_TEXT = "--set"
Place = Callable[[str], str]
"""Of a key of a mapping: what stands before it in a message."""


def by_argument(key: str) -> str:
    """Return what stands before a key of the argument `overrides`."""
    return "overrides: "


def apply_overrides(
    data: dict[str, Any], overrides: Overrides, place: Place = by_argument
) -> tuple[dict[KeyPath, str], tuple[str, ...]]:
    """Set keys of the data of a scenario, in place.

    Returns what stands before each override in a message, by the path of its key, and the overrides
    as texts KEY=VALUE.
    """
    paths, texts, faults = {}, [], list[str]()
    for entry in _texts_or_items(overrides):
        try:
            key, value, option, where = _entry(entry, place)
            paths[_set(data, key, value, where)] = option
            texts.append(f"{key.strip()}={override_text(value)}")
        except ScenarioError as error:
            faults += error.faults
    if faults:
        raise ScenarioError(faults)
    return paths, tuple(texts)


def _texts_or_items(overrides: Overrides) -> list[Any]:
    """Return the items of a mapping, or the texts."""
    if isinstance(overrides, Mapping):
        return list(overrides.items())
    is_one = isinstance(overrides, str) or not isinstance(overrides, Iterable)
    texts: list[Any] = [overrides] if is_one else list(overrides)
    for text in texts:
        if is_one or not isinstance(text, str):
            wanted = 'expected a mapping as {"solver.rtol": 1e-9}, or texts KEY=VALUE'
            raise InputError(f"overrides: {wanted}, got {text!r}")
    return texts


def _entry(entry: Any, place: Place) -> tuple[str, Any, str, str]:
    """Return key and value of an override, what stands before it and what names it in a message."""
    if not isinstance(entry, str):
        key, value = entry
        before = place(key)
        where = f"{before}{key}"
        return str(key), value if value is REMOVED else plain(value, where), before, where
    key, equals, value = entry.partition("=")
    where = f"{BY_TEXT} {entry}"
    if not equals or not all(part.strip() for part in key.split(".")):
        raise ScenarioError([f"{where}: expected KEY=VALUE, as in solver.rtol=1e-9"])
    return key, _parsed(where, value.strip()), f"{BY_TEXT}: ", where


def override_text(value: Any) -> str:
    """Return the VALUE of --set for a value; words that need no quotes have none."""
    if value is REMOVED:
        return REMOVED_TEXT
    return value if isinstance(value, str) and _is_bare_word(value) else toml_value(value)


def _is_bare_word(text: str) -> bool:
    """Return whether a text is read as itself without quotes: a word, or a key with dots."""
    parts = text.replace("-", "").replace("_", "").split(".")
    words = all(part.isalnum() for part in parts) and not text[0].isdecimal()
    return words and text not in (REMOVED_TEXT, "true", "false", "inf", "nan")


def values_by_key(overrides: Iterable[str]) -> dict[str, Any]:
    """Return overrides KEY=VALUE of a result as data; None for a key that is taken out.

    In a file that others have changed a value may be none of TOML or of JSON; it stays text.
    """
    from json import dumps

    values: dict[str, Any] = {}
    for override in overrides:
        key, _, text = override.partition("=")
        try:
            values[key] = _parsed(override, text)
            dumps(values[key], allow_nan=False)
        except (InputError, TypeError, ValueError):
            values[key] = text
    return values


def _set(data: dict[str, Any], key: str, value: Any, where: str) -> KeyPath:
    """Set a key such as a.b.0 of the data, and return its path."""
    parts = [part.strip() for part in key.split(".")]
    if not all(parts):
        raise ScenarioError([f"{where}: expected a key with dots, e.g. solver.rtol"])
    path: KeyPath = ()
    table: Any = data
    for place, part in enumerate(parts, 1):
        name = _key_in(table, part, path, where)
        path = (*path, name)
        if place < len(parts):
            table = table[name] if isinstance(table, list) else table.setdefault(name, {})
    if value is not REMOVED:
        table[path[-1]] = value
    elif isinstance(table, dict):
        table.pop(path[-1], None)
    else:
        raise ScenarioError([f"{where}: an entry of a list cannot be removed; give the list"])
    return path


def _key_in(table: Any, part: str, path: KeyPath, where: str) -> Any:
    """Return a part of a key: a key of a table, or an index into a list, also by name."""
    above = ".".join(map(str, path))
    if isinstance(table, dict):
        return part
    if not isinstance(table, list):
        raise ScenarioError([f"{where}: '{above}' is a value and has no keys"])
    names = [str(row.get("name", "")) if isinstance(row, dict) else "" for row in table]
    if part in names:
        return names.index(part)
    if part.isdecimal() and int(part) < len(table):
        return int(part)
    way = f" or a name: {', '.join(filter(None, names))}" if any(names) else ""
    fault = f"'{above}' is a list of {len(table)}; give an index from 0{way}"
    raise ScenarioError([f"{where}: {fault}"])


def _parsed(where: str, text: str) -> Any:
    try:
        return parsed_value(text)
    except ValueError:
        if text == REMOVED_TEXT:
            return REMOVED
        if _is_bare_word(text):
            return text
        hint = number_hint(text)
        raise ScenarioError(
            [f"{where}: '{text}' is not a TOML value (number, true, [1, 2], \"text\"){hint}"]
        ) from None
