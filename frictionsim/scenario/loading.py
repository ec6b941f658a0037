"""From a TOML file and overrides to a validated, frozen scenario, and back."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from frictionsim.errors import InputError, ScenarioError, unknown
from frictionsim.scenario.kinds import KINDS, mechanism_module
from frictionsim.scenario.settings import Scenario

KeyPath = tuple[str | int, ...]

# A scenario is written by hand; long signals belong into a CSV file.
MAX_FILE_SIZE = 16 * 1024 * 1024
# Products of a few of these, and their squares, are still numbers.
MAX_NUMBER = 1e50
MAX_KEY_LENGTH = 60  # characters of a key that a message shows


def load(path: Path, overrides: list[str] | None = None, backend: str | None = None) -> Scenario:
    """Read and validate a scenario.

    Parameters
    ----------
    path : Path
    overrides : list of str, optional
        ``a.b=VALUE`` each, VALUE as TOML has it; they go over what the file says.
    backend : str, optional
        Goes over both.

    Returns
    -------
    Scenario
        Of the model of its kind.

    Raises
    ------
    ScenarioError
        With all faults of the file, each with its line and key.
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
    """What is wrong with the data of a scenario, before it is known where that stands."""

    def __init__(self, faults: list[tuple[KeyPath, str]]) -> None:
        super().__init__(faults)
        self.faults = faults


def validate(data: dict[str, Any], folder: Path) -> Scenario:
    """Return the scenario that the data of a TOML file describes.

    Parameters
    ----------
    data : dict
    folder : Path
        Where the files that it names are looked for.

    Raises
    ------
    ValidationFailure
    """
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ValidationFailure([(("kind",), _kind_fault(data))])
    model: type[Scenario] = mechanism_module(kind).SCENARIO
    try:
        scenario = model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        from frictionsim.scenario.messages import error_message

        raise ValidationFailure([error_message(e, model) for e in _root_errors(error)]) from None
    beyond = [
        (path, f"{value:.3g} is beyond any use; numbers go up to {MAX_NUMBER:g}")
        for path, value in _numbers(scenario.model_dump(by_alias=True))
        if abs(value) > MAX_NUMBER
    ]
    if beyond:
        raise ValidationFailure(beyond)
    return scenario


def scenario_from_result(path: Path, text: str) -> Scenario:
    """Return the scenario that a result file has recorded.

    Raises
    ------
    InputError
        If it is none that can be simulated.
    """
    try:
        return validate(_parse(path, text), path.parent)
    except ValidationFailure as found:
        faults = "; ".join(f"{'.'.join(map(_key_text, key))}: {said}" for key, said in found.faults)
        raise InputError(f"{path}: its scenario is not valid: {faults}") from None


def _root_errors(error: ValidationError) -> list[Any]:
    """Return the errors without those of lists that are short only for what is wrong in them."""
    errors = error.errors()
    places = [e["loc"] for e in errors]
    return [
        e
        for e in errors
        if e["type"] != "too_short"
        or not any(len(p) > len(e["loc"]) and p[: len(e["loc"])] == e["loc"] for p in places)
    ]


def _numbers(tables: dict[str, Any]) -> Iterator[tuple[KeyPath, float]]:
    """Yield all numbers of a scenario with their keys; a list of numbers under its key."""
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
    """Return the data of a scenario with overrides, defaults and CSV signals filled in."""
    tables = scenario.model_dump(by_alias=True, exclude_none=True)
    tables["output"] = {"interval": scenario.interval} | tables["output"]
    for section in ("solver", "output"):  # what is simulated comes before how
        tables[section] = tables.pop(section)
    return tables


def resolved_toml(scenario: Scenario) -> str:
    """Return the scenario as TOML with overrides, defaults and CSV signals filled in."""
    import tomli_w

    return tomli_w.dumps(resolved_tables(scenario))


def apply_override(data: dict[str, Any], override: str) -> KeyPath:
    """Set one key of the data from ``a.b=VALUE`` and return its path.

    A bare word stands for a string, so that no shell needs two layers of quotes.

    Raises
    ------
    ScenarioError
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
        raise ScenarioError([f"{option}: '{name}' of the scenario is no table"])
    return table


def _key_in(table: Any, part: str, path: KeyPath, override: str) -> Any:
    """Return a part of an override's key as what it is in a table or a list."""
    if isinstance(table, dict):
        return part
    where = ".".join(map(str, path))
    if not isinstance(table, list):
        raise ScenarioError([f"--set {override}: '{where}' is a value and has no keys"])
    if not part.isdecimal() or int(part) >= len(table):
        raise ScenarioError([f"--set {override}: '{where}' is a list of {len(table)}, from 0"])
    return int(part)


def _override_value(override: str, text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
        if len(parsed) == 1:  # not several lines
            return parsed["value"]
        raise ValueError
    except (ValueError, RecursionError):
        if text.replace("-", "").replace("_", "").isalnum() and not text[0].isdecimal():
            return text
        raise ScenarioError(
            [f"--set {override}: '{text}' is no TOML value (a number, true, [1, 2], \"text\")"]
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
            [f"{path}: larger than {MAX_FILE_SIZE >> 20} MiB; put long signals into CSV files"]
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError([f"{path}: not a text in UTF-8, at byte {error.start}"]) from None


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
    """Return faults with the place that each key has, in the file or on the command line."""
    from frictionsim.scenario.toml_positions import key_lines

    lines = key_lines(text)
    placed = []
    for key, sentence in faults:
        option = _option_of(key, overridden, lines)
        line = 0 if option else _nearest_line(lines, key)
        name = ".".join(map(_key_text, key)) or "scenario"
        placed.append((line, f"{option or f'{path}:{line}'}: {name}: {sentence}"))
    return [text for _, text in sorted(placed, key=lambda fault: fault[0])]


def _syntax_fault(text: str, error: str) -> str:
    """Return where a TOML text is wrong and why, with the line that is."""
    message, _, place = error.rpartition(" (at line ")
    number = place.partition(",")[0]
    if not message or not number.isdecimal():
        return f": not valid TOML: {error}"
    line = text.split("\n")[int(number) - 1].strip()
    return f":{number}: not valid TOML: {message}, in '{line[:MAX_KEY_LENGTH]}'"


def _option_of(
    key: KeyPath, overridden: dict[KeyPath, str], lines: dict[KeyPath, int]
) -> str | None:
    """Return the option that a key comes from; None if it is the file's."""
    for over, option in overridden.items():
        made_by_it = over[: len(key)] == key and key not in lines
        if key[: len(over)] == over or made_by_it:
            return option
    return None


def _key_text(part: str | int) -> str:
    """Return a part of a key as it may stand in TOML, shortened and on one line."""
    text = str(part)
    if not text.replace("-", "_").isidentifier() and not text.isdecimal():
        text = repr(text)
    return text if len(text) <= MAX_KEY_LENGTH else text[:MAX_KEY_LENGTH] + "..."


def _nearest_line(lines: dict[KeyPath, int], key: KeyPath) -> int:
    """Return the line of a key, or of the nearest table around it that the file has."""
    while key and key not in lines:
        key = key[:-1]
    return lines.get(key, 1)


def _kind_fault(data: dict[str, Any]) -> str:
    from frictionsim.scenario.messages import toml_text

    kinds = ", ".join(f"'{kind}'" for kind in KINDS)
    if not data:
        return f"the file is empty; a scenario starts with kind, one of {kinds}"
    if "kind" not in data:
        return f"missing; expected one of {kinds}"
    if not isinstance(data["kind"], str):
        return f"expected one of {kinds}, got {toml_text(data['kind'])}"
    return unknown("kind", data["kind"], list(KINDS))
