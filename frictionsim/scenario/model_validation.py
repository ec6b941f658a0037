"""Validation of the data of a scenario by a given model."""

from collections.abc import Iterator
from pathlib import Path
from sys import float_info
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from frictionsim.errors import OUT_OF_RANGE
from frictionsim.scenario.toml_data import KeyPath

TableModel = TypeVar("TableModel", bound=BaseModel)

# Products and quotients of several such numbers do not overflow.
MAX_NUMBER = 1e50
MIN_NUMBER = 1e-50
MAX_KEY_LENGTH = 60  # characters of a key in a message


class _NamedIndex(int):
    """The index of a table in a list, which a message gives by the name in the table."""

    def __new__(cls, index: int, name: str) -> "_NamedIndex":
        number = super().__new__(cls, index)
        number.name = name
        return number

    name: str


class ValidationFailure(Exception):
    """Errors in the data of a scenario, by key path, without positions in the file."""

    def __init__(self, faults: list[tuple[KeyPath, str]]) -> None:
        super().__init__(faults)
        self.faults = faults

    def lines(self) -> list[str]:
        """Return the faults as text: key and message."""
        return [f"{key_text(key)}: {message}" for key, message in self.faults]


def validate_model(
    model: type[TableModel], data: dict[str, Any], folder: Path | None
) -> TableModel:
    """Return the instance of a model for the data of a TOML file.

    `folder` is the base of relative file names in the data; None if they may not refer to files.
    Raises a ValidationFailure if the data is invalid.
    """
    try:
        return _validated(model, data, folder)
    except ValidationFailure as failure:
        faults = [(_with_names(path, data), message) for path, message in failure.faults]
        raise ValidationFailure(faults) from None


def _validated(model: type[TableModel], data: dict[str, Any], folder: Path | None) -> TableModel:
    _refuse(_too_large(data))  # before the validators, which compute with them
    try:
        scenario = model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        from frictionsim.scenario.messages import error_messages

        raise ValidationFailure(error_messages(_root_errors(error), model)) from None
    except OverflowError:
        raise ValidationFailure([((), OUT_OF_RANGE)]) from None
    # Of points, those in CSV files were read by now.
    _refuse([*_too_large(scenario.model_dump(by_alias=True)), *_too_small(scenario)])
    return scenario


def validate_table(model: "type[TableModel]", data: dict[str, Any]) -> "TableModel":
    """Return a table that is no scenario, of the data of a TOML file.

    Raises
    ------
    ValidationFailure
        If the data is invalid.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        from frictionsim.scenario.messages import error_messages

        raise ValidationFailure(error_messages(_root_errors(error), model)) from None


def _refuse(faults: list[tuple[KeyPath, str]]) -> None:
    if faults:
        raise ValidationFailure(faults)


def _too_large(tables: dict[str, Any]) -> list[tuple[KeyPath, str]]:
    """Return the faults of numbers whose products may overflow."""
    return [
        (path, f"{value:.3g} is too large; the magnitude must not exceed {MAX_NUMBER:g}")
        for path, value in _numbers(tables)
        if MAX_NUMBER < abs(value) <= float_info.max  # the model refuses larger ones
    ]


def _too_small(table: BaseModel, above: KeyPath = ()) -> Iterator[tuple[KeyPath, str]]:
    """Yield the faults of numbers that must not be zero and are next to it: divisors may be."""
    for name, field in type(table).model_fields.items():
        value, path = getattr(table, name), (*above, field.alias or name)
        if isinstance(value, BaseModel):
            yield from _too_small(value, path)
        elif isinstance(value, dict | tuple):
            items = value.items() if isinstance(value, dict) else enumerate(value)
            for key, item in items:
                if isinstance(item, BaseModel):
                    yield from _too_small(item, (*path, key))
        elif isinstance(value, float) and 0.0 < value < MIN_NUMBER and _is_positive(field):
            yield path, f"expected at least {MIN_NUMBER:g}, got {value:.3g}"


def _is_positive(field: FieldInfo) -> bool:
    """Return whether the model refuses zero."""
    return any(getattr(bound, "gt", None) == 0 for bound in field.metadata)


def key_text(key: KeyPath) -> str:
    """Return a key for a message: its parts quoted if necessary, shortened, on one line."""
    return ".".join(map(_part_text, key)) or "scenario"


def _with_names(path: KeyPath, data: Any) -> KeyPath:
    """Return a path with the names of tables in lists, where `--set` takes them, too.

    An index remains where the name is at fault, or is not the only one.
    """
    parts: list[str | int] = []
    for i, part in enumerate(path):
        if isinstance(part, str) or not isinstance(data, list | tuple) or part >= len(data):
            parts.append(part)
            data = data.get(part) if isinstance(data, dict) else None
            continue
        name = _name_of(data[part])
        is_its_own = path[i + 1 :] != ("name",) and [*map(_name_of, data)].count(name) == 1
        parts.append(_NamedIndex(part, name) if name and is_its_own else part)
        data = data[part]
    return tuple(parts)


def _name_of(row: Any) -> str:
    """Return the name of a table in a list; empty without one that `--set` takes."""
    name = row.get("name") if isinstance(row, dict) else None
    return name if isinstance(name, str) and name.replace("-", "_").isidentifier() else ""


def _part_text(part: str | int) -> str:
    text = part.name if isinstance(part, _NamedIndex) else str(part)
    if not text.replace("-", "_").isidentifier() and not text.isdecimal():
        text = repr(text)
    return text if len(text) <= MAX_KEY_LENGTH else text[:MAX_KEY_LENGTH] + "..."


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
    pending: list[tuple[KeyPath, Any]] = [((key,), value) for key, value in tables.items()]
    while pending:
        path, value = pending.pop()
        if isinstance(value, dict):
            pending.extend(((*path, key), inner) for key, inner in value.items())
        elif isinstance(value, list | tuple) and all(map(_is_number, value)):
            yield path, max(value, key=abs, default=0.0)
        elif isinstance(value, list | tuple):
            pending.extend(((*path, i), inner) for i, inner in enumerate(value))
        elif _is_number(value):
            yield path, value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)
