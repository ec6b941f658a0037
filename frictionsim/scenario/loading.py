"""Loading of scenarios: from TOML or a dict, and overrides, to a validated model."""

from collections.abc import Iterator, Mapping
from os import PathLike
from os.path import isdir
from pathlib import Path
from re import search
from typing import Any

from frictionsim.errors import InputError, ScenarioError, near_files
from frictionsim.results import HDF5_SIGNATURE
from frictionsim.scenario.kinds import kind_names, mechanism_module
from frictionsim.scenario.origin import Origin, origin_of
from frictionsim.scenario.overrides import Overrides, apply_overrides, override_text
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.shipped import near_shipped, scenario_file
from frictionsim.scenario.toml_data import (
    KeyPath,
    NoUsableText,
    key_lines,
    plain,
    read_text,
    toml_tables,
)
from frictionsim.scenario.validation import (
    MAX_KEY_LENGTH,
    ValidationFailure,
    key_text,
    validate_model,
)

# What is meant by lines that TOML does not take.
NUMBER_HINTS = {
    r"=\s*[+-]?\d+,\d+\s*(#|$)": "; the decimal mark of TOML is a point, as in 450.0",
    r"[=\[,]\s*[+-]?0\d": "; a number of TOML has no zero in front, as in 8.0",
}

ScenarioSource = str | PathLike[str] | Mapping[str, Any]


def load(
    source: ScenarioSource,
    overrides: Overrides | None = None,
    backend: str | None = None,
    *,
    folder: str | PathLike[str] = ".",
) -> Scenario:
    """Read and validate a scenario.

    Parameters
    ----------
    source : path or mapping
        A TOML file; if there is none, the name of a shipped scenario, such as ``pulley``; or the
        tables of a scenario as dicts. File names in a file are relative to its folder.
    overrides : mapping or iterable of str, optional
        Values by key, as ``{"effects.shaft_friction.mu_s": 0.3}``, or texts ``a.b=VALUE`` with
        VALUE in TOML; they override the source.
    backend : str, optional
        Overrides source and `overrides`.
    folder : path, optional
        The folder of the file names in a mapping; the current one by default.

    Returns
    -------
    Scenario
        An instance of the model of its kind.

    Raises
    ------
    ScenarioError
        With all errors in the source as `faults`, each with its line and key.
    InputError
        If an argument is of another type.
    """
    if isinstance(source, Mapping):
        return load_tables(source, Path(folder), overrides, backend)
    if not isinstance(source, str | PathLike):
        raise InputError(
            "expected a scenario: its path, a dict of its tables or a Scenario, got"
            f" {type(source).__name__}{_way_out(source)}"
        )
    path = scenario_file(source)
    if "\n" in str(path):
        raise InputError("load: load() expects a path; use loads() for TOML text")
    text = _read(path)
    return _validated(_parse(str(path), text), str(path), text, overrides, backend, path.parent)


def load_tables(
    source: Mapping[str, Any],
    folder: Path | None,
    overrides: Overrides | None = None,
    backend: str | None = None,
) -> Scenario:
    """Validate the tables of a scenario.

    `folder` is that of the file names in it; None for tables out of a file that anyone may have
    made, which must not name other files.
    """
    return _validated(plain(source), None, "", overrides, backend, folder)


def _way_out(source: object) -> str:
    """Return the loader for a path, a dict or a `Scenario`."""
    if isinstance(source, Scenario):
        return "; its method replace changes keys"
    return "; its scenario is result.scenario" if hasattr(source, "scenario") else ""


def loads(
    text: str,
    overrides: Overrides | None = None,
    backend: str | None = None,
    name: str = "scenario",
) -> Scenario:
    """Validate a scenario that is given as TOML text.

    Parameters
    ----------
    text : str
        File names in it are relative to the current folder.
    overrides, backend
        As of `load`.
    name : str
        For messages.

    Raises
    ------
    ScenarioError
        As `load`.
    InputError
        If `text` is no text.
    """
    if not isinstance(text, str):
        raise InputError(f"loads: expected a scenario as TOML text, got {type(text).__name__}")
    return _validated(_parse(name, text), name, text, overrides, backend, Path())


def _validated(
    data: dict[str, Any],
    name: str | None,
    text: str,
    overrides: Overrides | None,
    backend: str | None,
    folder: Path | None,
) -> Scenario:
    """Return the scenario of the data, with its origin.

    `name` and `text` are of the TOML that the data were read from; None and empty if of none.
    """
    lines = dict.fromkeys(_keys(data), 0) if name is None else None
    overridden, texts = apply_overrides(data, overrides if overrides is not None else ())
    if backend is not None:
        _table_of(data, "solver", "--backend")["backend"] = backend
        overridden["solver", "backend"] = "--backend"
        texts = (*texts, f"solver.backend={override_text(backend)}")
    try:
        scenario = validate(data, folder)
    except ValidationFailure as failure:
        lines = key_lines(text) if lines is None else lines
        raise ScenarioError(_with_positions(failure.faults, name, lines, overridden)) from None
    return scenario.with_origin(Origin(name or "", texts))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file, which need not be a scenario."""
    return _parse(str(path), _read(path))


def scenario_from_result(path: Path, attributes: Mapping[str, str]) -> Scenario:
    """Return the scenario stored in the attributes of a result file.

    They are the scenario as TOML, its source and overrides; the path is for messages.
    """
    try:
        # What others write into a result is not to have files of the reader's read.
        scenario = validate(_parse(str(path), attributes["scenario"]), None)
    except ValidationFailure as failure:
        faults = "; ".join(failure.lines())
        raise InputError(f"{path}: its scenario is not valid: {faults}") from None
    return scenario.with_origin(origin_of(attributes))


def _table_of(data: dict[str, Any], name: str, option: str) -> dict[str, Any]:
    table = data.setdefault(name, {})
    if not isinstance(table, dict):
        raise ScenarioError([f"{option}: '{name}' of the scenario is not a table"])
    return table


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            if file.peek(len(HDF5_SIGNATURE)).startswith(HDF5_SIGNATURE):
                raise ScenarioError(
                    [
                        f"{path}: this is a result, expected a scenario;"
                        f" 'frictionsim show --scenario {path}' prints the scenario in it"
                    ]
                )
            return read_text(file)
    except FileNotFoundError as error:
        near = near_files(path, (".toml",))
        if not near or not (path.suffix or "did you mean" in near):
            near = near_shipped(path) or near
        raise ScenarioError(
            [f"{path}: cannot read this scenario: {error.strerror}{near}"]
        ) from None
    except OSError as error:
        reason = error.strerror
        if isdir(path):
            reason = "this is a folder; 'frictionsim check' takes folders, expected a file"
        raise ScenarioError([f"{path}: cannot read this scenario: {reason}"]) from None
    except NoUsableText as error:
        raise ScenarioError([f"{path}: {error}"]) from None
    except UnicodeDecodeError as error:
        raise ScenarioError([f"{path}: invalid UTF-8 at byte {error.start}"]) from None
    except ValueError as error:  # a NUL in the name
        raise ScenarioError([f"{path!r}: cannot read this scenario: {error}"]) from None


def _parse(name: str, text: str) -> dict[str, Any]:
    text = text.replace("\r\n", "\n")
    try:
        return toml_tables(text)
    except NoUsableText as error:
        raise ScenarioError([f"{name}: {error}"]) from None
    except ValueError as error:
        raise ScenarioError([f"{name}{_syntax_fault(text, str(error))}"]) from None


def _with_positions(
    faults: list[tuple[KeyPath, str]],
    name: str | None,
    lines: dict[KeyPath, int],
    overridden: dict[KeyPath, str],
) -> list[str]:
    """Return the faults as text, with the line or the option that each key comes from."""
    positioned = []
    for key, message in faults:
        option = _option_of(key, overridden, lines)
        line = 0 if option or name is None else _nearest_line(lines, key)
        where = option or ("scenario" if name is None else f"{name}:{line}")
        positioned.append((line, f"{where}: {key_text(key)}: {message}"))
    return [text for _, text in sorted(positioned, key=lambda fault: fault[0])]


def _syntax_fault(text: str, error: str) -> str:
    """Return the message for a TOML syntax error, with the number and text of the line."""
    message, _, position = error.rpartition(" (at line ")
    number = position.partition(",")[0]
    if not message or not number.isdecimal():
        return f": not valid TOML: {error}"
    line = text.split("\n")[int(number) - 1].strip()
    hint = next((hint for form, hint in NUMBER_HINTS.items() if search(form, line)), "")
    return f":{number}: not valid TOML: {message}, in '{line[:MAX_KEY_LENGTH]}'{hint}"


def _keys(data: Mapping[str, Any]) -> Iterator[KeyPath]:
    """Yield the paths of all tables and keys of a dict."""
    for key, value in data.items():
        yield (key,)
        if isinstance(value, Mapping):
            yield from ((key, *path) for path in _keys(value))


def _option_of(
    key: KeyPath, overridden: dict[KeyPath, str], lines: dict[KeyPath, int]
) -> str | None:
    """Return the option or argument that a key comes from; None if it is from the source."""
    for path, option in overridden.items():
        created = path[: len(key)] == key and key not in lines
        if key[: len(path)] == path or created:
            return option
    return None


def _nearest_line(lines: dict[KeyPath, int], key: KeyPath) -> int:
    """Return the line of a key, or of the innermost enclosing table in the file."""
    while key and key not in lines:
        key = key[:-1]
    return lines.get(key, 1)


__all__ = ["ValidationFailure", "validate"]


def validate(data: dict[str, Any], folder: Path | None) -> Scenario:
    """Return the scenario for the data of a TOML file.

    `folder` is the base of relative file names in the data; None if they may not refer to files.
    Raises a ValidationFailure if the data is invalid.
    """
    try:
        model = _model_of(data)
    except InputError as error:
        raise ValidationFailure([(("kind",), str(error))]) from None
    return validate_model(model, data, folder)


def _model_of(data: dict[str, Any]) -> type[Scenario]:
    """Return the model of the kind of a scenario."""
    kind = data.get("kind")
    if isinstance(kind, str):
        model: type[Scenario] = mechanism_module(kind).SCENARIO
        return model

    from frictionsim.scenario.validation import toml_text

    kinds = ", ".join(f"'{kind}'" for kind in kind_names())
    if not data:
        raise InputError(f"the scenario is empty; it starts with kind, one of {kinds}")
    if "kind" not in data and "study" in data:
        raise InputError("missing: this is a study, not a scenario; 'frictionsim sweep' runs it")
    if "kind" not in data:
        raise InputError(f"missing; expected one of {kinds}")
    raise InputError(f"expected one of {kinds}, got {toml_text(kind)}")
