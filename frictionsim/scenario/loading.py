"""Loading of scenarios: from a TOML file and overrides to a validated model, and back to TOML."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.kinds import kind_names, mechanism_module
from frictionsim.scenario.settings import Scenario

KeyPath = tuple[str | int, ...]

# Scenarios are written by hand; long signals belong in a CSV file.
MAX_FILE_SIZE = 16 * 1024 * 1024
# Products of several such numbers do not overflow.
MAX_NUMBER = 1e50
MAX_KEY_LENGTH = 60  # characters of a key in a message


def load(path: Path, overrides: list[str] | None = None, backend: str | None = None) -> Scenario:
    """Read and validate a scenario.

    Parameters
    ----------
    path : Path
    overrides : list of str, optional
        Each ``a.b=VALUE`` with VALUE in TOML; they override the file.
    backend : str, optional
        Overrides file and `overrides`.

    Returns
    -------
    Scenario
        An instance of the model of its kind.

    Raises
    ------
    ScenarioError
        With all errors in the file, each with its line and key.
    """
    text = _read(path)
    data = _parse(path, text)
    overridden = {apply_override(data, override): "--set" for override in overrides or []}
    if backend is not None:
        _table_of(data, "solver", "--backend")["backend"] = backend
        overridden["solver", "backend"] = "--backend"
    try:
        return validate(data, path.parent)
    except ValidationFailure as found:
        raise ScenarioError(_with_positions(found.faults, path, text, overridden)) from None


class ValidationFailure(Exception):
    """Errors in the data of a scenario, by key path, without positions in the file."""

    def __init__(self, faults: list[tuple[KeyPath, str]]) -> None:
        super().__init__(faults)
        self.faults = faults


def validate(data: dict[str, Any], folder: Path) -> Scenario:
    """Return the scenario for the data of a TOML file.

    Parameters
    ----------
    data : dict
    folder : Path
        Base of relative file names in the data.

    Returns
    -------
    Scenario

    Raises
    ------
    ValidationFailure
        If the data is invalid.
    """
    try:
        model = _model_of(data)
    except InputError as error:
        raise ValidationFailure([(("kind",), str(error))]) from None
    try:
        scenario = model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        from frictionsim.scenario.messages import error_message

        raise ValidationFailure([error_message(e, model) for e in _root_errors(error)]) from None
    beyond = [
        (path, f"{value:.3g} is too large; the magnitude must not exceed {MAX_NUMBER:g}")
        for path, value in _numbers(scenario.model_dump(by_alias=True))
        if abs(value) > MAX_NUMBER
    ]
    if beyond:
        raise ValidationFailure(beyond)
    return scenario


def scenario_from_result(path: Path, text: str) -> Scenario:
    """Return the scenario stored in a result file.

    Parameters
    ----------
    path : Path
        The result file, for messages.
    text : str
        The stored scenario as TOML.

    Returns
    -------
    Scenario

    Raises
    ------
    InputError
        If it is invalid.
    """
    try:
        return validate(_parse(path, text), path.parent)
    except ValidationFailure as failure:
        faults = "; ".join(
            f"{'.'.join(map(_key_text, key))}: {text}" for key, text in failure.faults
        )
        raise InputError(f"{path}: its scenario is not valid: {faults}") from None


def _root_errors(error: ValidationError) -> list[Any]:
    """Return the errors, without lists reported as too short because an item is invalid."""
    errors = error.errors()
    locations = [e["loc"] for e in errors]
    return [
        e
        for e in errors
        if e["type"] != "too_short"
        or not any(len(p) > len(e["loc"]) and p[: len(e["loc"])] == e["loc"] for p in locations)
    ]


def _numbers(tables: dict[str, Any]) -> Iterator[tuple[KeyPath, float]]:
    """Yield all numbers of a scenario with their keys; of a list the largest magnitude."""
    left: list[tuple[KeyPath, Any]] = [((key,), value) for key, value in tables.items()]
    while left:
        path, value = left.pop()
        if isinstance(value, dict):
            left.extend(((*path, key), inner) for key, inner in value.items())
        elif isinstance(value, tuple) and value and isinstance(value[0], int | float):
            yield path, max(value, key=abs)
        elif isinstance(value, tuple):
            left.extend(((*path, i), inner) for i, inner in enumerate(value))
        elif isinstance(value, int | float):
            yield path, value


def resolved_tables(scenario: Scenario) -> dict[str, Any]:
    """Return the data of a scenario, including overrides, defaults and the data of CSV files."""
    tables = scenario.model_dump(by_alias=True, exclude_none=True)
    tables["output"] = {"interval": scenario.interval} | tables["output"]
    for section in ("solver", "output"):  # move these sections to the end
        tables[section] = tables.pop(section)
    return tables


def resolved_toml(scenario: Scenario) -> str:
    """Return the scenario as TOML, including overrides, defaults and the data of CSV files."""
    import tomli_w

    return tomli_w.dumps(resolved_tables(scenario))


def apply_override(data: dict[str, Any], override: str) -> KeyPath:
    """Set one key of the data from ``a.b=VALUE``.

    A bare word is accepted as a string, to avoid nested quotes in shells.

    Parameters
    ----------
    data : dict
        Changed in place.
    override : str

    Returns
    -------
    tuple of str or int
        The path of the key.

    Raises
    ------
    ScenarioError
        If the override is not valid or its key does not fit the data.
    """
    key, equals, text = override.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        raise ScenarioError([f"--set {override}: expected KEY=VALUE, as in solver.rtol=1e-9"])
    value = _override_value(override, text.strip())
    path: KeyPath = ()
    table: Any = data
    for part in parts[:-1]:
        name = _key_in(table, part, path, override)
        path = (*path, name)
        table = table[name] if isinstance(table, list) else table.setdefault(name, {})
    name = _key_in(table, parts[-1], path, override)
    table[name] = value
    return (*path, name)


def _table_of(data: dict[str, Any], name: str, option: str) -> dict[str, Any]:
    table = data.setdefault(name, {})
    if not isinstance(table, dict):
        raise ScenarioError([f"{option}: '{name}' of the scenario is not a table"])
    return table


def _key_in(table: Any, part: str, path: KeyPath, override: str) -> Any:
    """Return a part of an override's key: a key of a table, or an index into a list."""
    if isinstance(table, dict):
        return part
    where = ".".join(map(str, path))
    if not isinstance(table, list):
        raise ScenarioError([f"--set {override}: '{where}' is a value and has no keys"])
    if not part.isdecimal() or int(part) >= len(table):
        raise ScenarioError(
            [f"--set {override}: '{where}' is a list of {len(table)}; give an index from 0"]
        )
    return int(part)


def _override_value(override: str, text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
        if len(parsed) == 1:  # the text has no further lines with keys
            return parsed["value"]
        raise ValueError
    except (ValueError, RecursionError):
        if text.replace("-", "").replace("_", "").isalnum() and not text[0].isdecimal():
            return text
        raise ScenarioError(
            [f"--set {override}: '{text}' is not a TOML value (number, true, [1, 2], \"text\")"]
        ) from None


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_FILE_SIZE + 1)
    except OSError as error:
        raise ScenarioError([f"{path}: cannot read this scenario: {error.strerror}"]) from None
    except ValueError as error:  # a NUL in the name
        raise ScenarioError([f"{path!r}: cannot read this scenario: {error}"]) from None
    if len(content) > MAX_FILE_SIZE:
        raise ScenarioError(
            [f"{path}: file is larger than {MAX_FILE_SIZE >> 20} MiB; use CSV files for signals"]
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError([f"{path}: invalid UTF-8 at byte {error.start}"]) from None


def _parse(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError([f"{path}{_syntax_fault(text, str(error))}"]) from None
    except RecursionError:
        raise ScenarioError([f"{path}: tables or lists are nested too deeply"]) from None
    except ValueError as error:  # an integer of thousands of digits, an impossible date
        raise ScenarioError([f"{path}: not a usable TOML value: {error}"]) from None


def _with_positions(
    faults: list[tuple[KeyPath, str]], path: Path, text: str, overridden: dict[KeyPath, str]
) -> list[str]:
    """Return the faults as text, with the line or the option that each key comes from."""
    from frictionsim.scenario.toml_positions import key_lines

    lines = key_lines(text)
    positioned = []
    for key, message in faults:
        option = _option_of(key, overridden, lines)
        line = 0 if option else _nearest_line(lines, key)
        name = ".".join(map(_key_text, key)) or "scenario"
        positioned.append((line, f"{option or f'{path}:{line}'}: {name}: {message}"))
    return [text for _, text in sorted(positioned, key=lambda fault: fault[0])]


def _syntax_fault(text: str, error: str) -> str:
    """Return the message for a TOML syntax error, with the number and text of the line."""
    message, _, position = error.rpartition(" (at line ")
    number = position.partition(",")[0]
    if not message or not number.isdecimal():
        return f": not valid TOML: {error}"
    line = text.split("\n")[int(number) - 1].strip()
    return f":{number}: not valid TOML: {message}, in '{line[:MAX_KEY_LENGTH]}'"


def _option_of(
    key: KeyPath, overridden: dict[KeyPath, str], lines: dict[KeyPath, int]
) -> str | None:
    """Return the command-line option that a key comes from; None if it is from the file."""
    for path, option in overridden.items():
        created = path[: len(key)] == key and key not in lines
        if key[: len(path)] == path or created:
            return option
    return None


def _key_text(part: str | int) -> str:
    """Return a part of a key for a message: quoted if necessary, shortened, on one line."""
    text = str(part)
    if not text.replace("-", "_").isidentifier() and not text.isdecimal():
        text = repr(text)
    return text if len(text) <= MAX_KEY_LENGTH else text[:MAX_KEY_LENGTH] + "..."


def _nearest_line(lines: dict[KeyPath, int], key: KeyPath) -> int:
    """Return the line of a key, or of the innermost enclosing table in the file."""
    while key and key not in lines:
        key = key[:-1]
    return lines.get(key, 1)


def _model_of(data: dict[str, Any]) -> type[Scenario]:
    """Return the model of the kind of a scenario.

    Raises
    ------
    InputError
        If there is no such kind, or if its plug-in is faulty.
    """
    kind = data.get("kind")
    if isinstance(kind, str):
        return mechanism_module(kind).SCENARIO

    from frictionsim.scenario.messages import toml_text

    kinds = ", ".join(f"'{kind}'" for kind in kind_names())
    if not data:
        raise InputError(f"the file is empty; a scenario starts with kind, one of {kinds}")
    if "kind" not in data:
        raise InputError(f"missing; expected one of {kinds}")
    raise InputError(f"expected one of {kinds}, got {toml_text(kind)}")
