"""Overrides of single keys of a scenario: texts as for --set, or a mapping of keys to values."""

from collections.abc import Iterable, Mapping
from typing import Any

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.toml_data import (
    KeyPath,
    parsed_value,
    plain,
    toml_value,
)

Overrides = Mapping[str, Any] | Iterable[str]
"""Values by key, as {"solver.rtol": 1e-9}; or texts KEY=VALUE with VALUE in TOML."""

REMOVED = None  # the value of a key to take out, as of an effect that is not to be simulated
REMOVED_TEXT = "none"

BY_TEXT, BY_MAPPING = "--set", "overrides"


def apply_overrides(
    data: dict[str, Any], overrides: Overrides
) -> tuple[dict[KeyPath, str], tuple[str, ...]]:
    """Set keys of the data of a scenario, in place.

    Returns, for messages, where each override came from by the path of its key; and the overrides
    as texts KEY=VALUE.
    """
    if isinstance(overrides, Mapping):
        paths = {
            _set(data, str(key), _given(value, f"{BY_MAPPING}: {key}"), f"{BY_MAPPING}: {key}"): (
                BY_MAPPING
            )
            for key, value in overrides.items()
        }
        return paths, tuple(f"{key}={override_text(_given(v))}" for key, v in overrides.items())
    texts = _texts(overrides)
    return {apply_override(data, text): BY_TEXT for text in texts}, tuple(map(_normalised, texts))


def _texts(overrides: Iterable[str]) -> tuple[str, ...]:
    several = isinstance(overrides, Iterable) and not isinstance(overrides, str)
    texts: tuple[Any, ...] = tuple(overrides) if several else (overrides,)
    wrong = [text for text in texts if not several or not isinstance(text, str)]
    if wrong:
        raise InputError(
            'overrides: expected a mapping as {"solver.rtol": 1e-9}, or texts KEY=VALUE, got'
            f" {wrong[0]!r}"
        )
    return texts


def _normalised(override: str) -> str:
    """Return an override as the same one in a mapping is written: in one line, equal if equal."""
    key, _, value = override.partition("=")
    return f"{key.strip()}={override_text(_parsed(override, value.strip()))}"


def _given(value: Any, where: str = "scenario") -> Any:
    """Return a value of a mapping as TOML has it; None, which TOML has not, takes out the key."""
    return REMOVED if value is REMOVED else plain(value, where)


def override_text(value: Any) -> str:
    """Return the VALUE of --set for a value; words that need no quotes have none."""
    if value is REMOVED:
        return REMOVED_TEXT
    if isinstance(value, str) and _is_bare_word(value):
        return value
    return toml_value(value)


def _is_bare_word(text: str) -> bool:
    """Return whether a text is read as itself without quotes: a word, or a key with dots."""
    parts = text.replace("-", "").replace("_", "").split(".")
    if not all(part.isalnum() for part in parts) or text[0].isdecimal():
        return False
    return text not in (REMOVED_TEXT, "true", "false", "inf", "nan")


def apply_override(data: dict[str, Any], override: str) -> KeyPath:
    """Set one key of the data, in place, from ``a.b=VALUE``; return the path of the key.

    A bare word, or several with dots, is accepted as a string: no nested quotes in shells.
    """
    key, equals, text = override.partition("=")
    where = f"{BY_TEXT} {override}"
    if not equals or not all(part.strip() for part in key.split(".")):
        raise ScenarioError([f"{where}: expected KEY=VALUE, as in solver.rtol=1e-9"])
    return _set(data, key, _parsed(where, text.strip()), where)


def values_by_key(overrides: Iterable[str]) -> dict[str, Any]:
    """Return overrides KEY=VALUE as data for JSON; None for a key that is taken out.

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
    for part in parts[:-1]:
        name = _key_in(table, part, path, where)
        path = (*path, name)
        table = table[name] if isinstance(table, list) else table.setdefault(name, {})
    name = _key_in(table, parts[-1], path, where)
    if value is not REMOVED:
        table[name] = value
    elif isinstance(table, dict):
        table.pop(name, None)
    else:
        raise ScenarioError([f"{where}: an entry of a list cannot be removed; give the list"])
    return (*path, name)


def _key_in(table: Any, part: str, path: KeyPath, where: str) -> Any:
    """Return a part of a key: a key of a table, or an index into a list, also by name."""
    if isinstance(table, dict):
        return part
    above = ".".join(map(str, path))
    if not isinstance(table, list):
        raise ScenarioError([f"{where}: '{above}' is a value and has no keys"])
    named = [i for i, row in enumerate(table) if isinstance(row, dict) and row.get("name") == part]
    if named:
        return named[0]
    if not part.isdecimal() or int(part) >= len(table):
        names = [str(row["name"]) for row in table if isinstance(row, dict) and "name" in row]
        way = f" or a name: {', '.join(names)}" if names else ""
        raise ScenarioError(
            [f"{where}: '{above}' is a list of {len(table)}; give an index from 0{way}"]
        )
    return int(part)


def _parsed(where: str, text: str) -> Any:
    try:
        return parsed_value(text)
    except ValueError:
        if text == REMOVED_TEXT:
            return REMOVED
        if _is_bare_word(text):
            return text
        raise ScenarioError(
            [f"{where}: '{text}' is not a TOML value (number, true, [1, 2], \"text\")"]
        ) from None
