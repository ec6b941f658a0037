"""Loading of scenarios: from TOML or a dict, and overrides, to a validated model."""

from collections.abc import Iterable, Mapping
from functools import partial
from os import PathLike
from os.path import isdir
from pathlib import Path
from typing import Any

from frictionsim.errors import InputError, ScenarioError, near_files
from frictionsim.results import HDF5_SIGNATURE
from frictionsim.scenario.arguments import as_path, toml_text
from frictionsim.scenario.kinds import kind_names, mechanism_module
from frictionsim.scenario.model_fields import unknown_key
from frictionsim.scenario.origin import Origin, near_shipped, origin_of, scenario_file
from frictionsim.scenario.overrides import (
    REMOVED_TEXT,
    Overrides,
    Place,
    apply_overrides,
    by_argument,
)
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import (
    KeyPath,
    KeyPlaces,
    NoUsableText,
    dotted,
    key_lines,
    number_hint,
    plain,
    read_text,
    tables_and_keys,
    toml_tables,
)
from frictionsim.scenario.validation import (
    MAX_KEY_LENGTH,
    ValidationFailure,
    key_text,
    validate_model,
)

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
        data = plain(source)
        lines = dict.fromkeys(tables_and_keys(data), 0)
        place = KeyPlaces("scenario", lambda: lines, start=0)
        return validated(data, place, Origin(), as_path("folder", folder), overrides, backend)
    if not isinstance(source, str | PathLike):
        raise InputError(
            f"expected a scenario: its path or a dict of its tables, got {type(source).__name__}"
        )
    path = scenario_file(source)
    if "\n" in str(path):
        raise InputError("expected the path of a scenario; frictionsim.loads takes TOML text")
    return load_file(path, overrides, backend)


def load_file(
    path: Path, overrides: Overrides | None, backend: str | None = None, by: Place = by_argument
) -> Scenario:
    """Read and validate a scenario file; `by` is what stands before an override in a message."""
    text, data = read_toml(path)
    place = KeyPlaces(str(path), partial(key_lines, text))
    return validated(data, place, Origin(str(path)), path.parent, overrides, backend, by)


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
    place = KeyPlaces(name, partial(key_lines, text))
    return validated(_parse(name, text), place, Origin(name), Path(), overrides, backend)


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text and the tables of a TOML file, which need not be a scenario."""
    text = _read(path)
    return text, _parse(str(path), text)


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


def validate(data: dict[str, Any], folder: Path | None) -> Scenario:
    """Return the scenario for the data of a TOML file.

    `folder` is the base of relative file names in the data; None if they may not refer to files.
    Raises a ValidationFailure if the data is invalid.
    """
    kind = data.get("kind")
    try:
        if not isinstance(kind, str):
            raise InputError(_no_kind(data))
        model: type[Scenario] = mechanism_module(kind).SCENARIO
    except InputError as error:
        raise ValidationFailure([(("kind",), str(error))]) from None
    return validate_model(model, data, folder)


def _no_kind(data: dict[str, Any]) -> str:
    if "kind" not in data and "study" in data:
        return "missing: this is a study, not a scenario; 'frictionsim sweep' runs it"
    kinds = ", ".join(f"'{kind}'" for kind in kind_names())
    if not data:
        return f"the scenario is empty; it starts with kind, one of {kinds}"
    if "kind" not in data:
        return f"missing; expected one of {kinds}"
    return f"expected one of {kinds}, got {toml_text(data['kind'])}"


def validated(
    data: dict[str, Any],
    place: KeyPlaces,
    origin: Origin,
    folder: Path | None,
    overrides: Overrides | None,
    backend: str | None = None,
    by: Place = by_argument,
) -> Scenario:
    """Return the scenario of the data, which are changed, with its origin and overrides."""
    options, texts = apply_overrides(data, overrides if overrides is not None else (), by)
    if backend is not None:
        more, text = apply_overrides(data, {"solver.backend": backend}, lambda key: "--backend: ")
        options, texts = options | more, texts + text
    try:
        scenario = validate(data, folder).with_origin(origin._replace(overrides=texts))
        _check_removed(type(scenario), next(iter(options.values()), ""), texts)
    except ValidationFailure as failure:
        placed = []
        for key, message in failure.faults:
            option = _option_of(key, options, place)
            before = option or f"{place.where(dotted(key))}: {place.above}"
            line = 0 if option else place.line(dotted(key))
            placed.append((line, f"{before}{key_text(key)}: {message}"))
        faults = [text for _, text in sorted(placed, key=lambda fault: fault[0])]
        raise ScenarioError(faults) from None
    return scenario


def _check_removed(model: type[Scenario], option: str, texts: Iterable[str]) -> None:
    """Check that the keys which are taken out are known: what is not there is not validated."""
    removed = [text.rpartition("=")[0] for text in texts if text.endswith(f"={REMOVED_TEXT}")]
    faults = [f"{option}{key}: {f}" for key in removed if (f := unknown_key(model, key))]
    if faults:
        raise ScenarioError(faults)


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            if file.peek(len(HDF5_SIGNATURE)).startswith(HDF5_SIGNATURE):
                fault = (
                    "this is a result, expected a scenario; 'frictionsim show --scenario"
                    f" {path}' prints the scenario in it, in Python fs.open({str(path)!r}).scenario"
                    " has it"
                )
            else:
                return read_text(file)
    except FileNotFoundError as error:
        near = near_files(path, (".toml",))
        if not near or not (path.suffix or "did you mean" in near):
            near = near_shipped(path) or near
        fault = f"cannot read this scenario: {error.strerror}{near}"
    except OSError as error:
        folder = "this is a folder; 'frictionsim check' takes folders, expected a file"
        fault = f"cannot read this scenario: {folder if isdir(path) else error.strerror}"
    except UnicodeDecodeError as error:
        fault = f"invalid UTF-8 at byte {error.start}"
    except ValueError as error:  # too large, or a NUL in the name
        fault = str(error)
    raise ScenarioError([f"{path}: {fault}"])


def _parse(name: str, text: str) -> dict[str, Any]:
    text = text.replace("\r\n", "\n")
    try:
        return toml_tables(text)
    except NoUsableText as error:
        fault = f": {error}"
    except ValueError as error:
        fault = _syntax_fault(text, str(error))
    raise ScenarioError([f"{name}{fault}"])


def _syntax_fault(text: str, error: str) -> str:
    """Return the message for a TOML syntax error, with the number and text of the line."""
    message, _, position = error.rpartition(" (at line ")
    number = position.partition(",")[0]
    if not message or not number.isdecimal():
        return f": not valid TOML: {error}"
    line = text.split("\n")[int(number) - 1].strip()
    hint = number_hint(line)
    return f":{number}: not valid TOML: {message}, in '{line[:MAX_KEY_LENGTH]}'{hint}"


def _option_of(key: KeyPath, options: dict[KeyPath, str], place: KeyPlaces) -> str:
    """Return the option or argument that a key comes from; empty if it is from the source."""
    for path, option in options.items():
        created = path[: len(key)] == key and dotted(key) not in place.lines
        if key[: len(path)] == path or created:
            return option
    return ""
