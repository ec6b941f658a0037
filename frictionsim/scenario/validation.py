"""Validation of data by a model: pydantic's faults with key, unit, value and nearest key."""

from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from frictionsim.display import cut_text
from frictionsim.errors import OUT_OF_RANGE, closest, unknown
from frictionsim.scenario.arguments import toml_text
from frictionsim.scenario.kinetic_friction import FORMS_OF_FRICTION, KINETIC_TAGS, NO_FRICTION
from frictionsim.scenario.kinetic_friction import NUMBER as KINETIC_NUMBER
from frictionsim.scenario.model_fields import key_names, keys_that_end_with, models_in, unit_of
from frictionsim.scenario.signal_tables import (
    NO_SIGNAL,
    NUMBER,
    ONE,
    SIGNAL_TAGS,
    SUM,
    AngleTable,
    CsvSpeedTable,
    CsvTable,
    SpeedTable,
    forms_of,
)
from frictionsim.scenario.toml_data import KeyPath

TableModel = TypeVar("TableModel", bound=BaseModel)

MAX_KEY_LENGTH = 60  # characters of a key in a message
MAX_MEANT = 4  # keys that may be meant
# What pydantic says in words of Python.
WORDS = {
    "model_type": "should be a table",
    "model_attributes_type": "should be a table",
    "dict_type": "should be a table",
    "tuple_type": "should be a list",
    "string_type": "should be text in quotes",
    "bool_type": "should be true or false",
    "int_type": "should be a whole number",
    "column": "should be the name of a column in quotes, or its number from 1",
    NO_SIGNAL: "should be a number",
    NO_FRICTION: "should be a number",
}
ALL_TAGS = SIGNAL_TAGS | KINETIC_TAGS
# Pydantic says itself how many items or characters there are.
WITH_COUNT = ("too_short", "too_long")


class ValidationFailure(Exception):
    """Errors in the data of a scenario, by key path, without positions in the file."""

    def __init__(self, faults: list[tuple[KeyPath, str]]) -> None:
        super().__init__(faults)
        self.faults = faults

    def lines(self) -> list[str]:
        """Return the faults as text: key and message."""
        return [f"{key_text(key)}: {message}" for key, message in self.faults]


def validate_model(
    model: type[TableModel], data: dict[str, Any], folder: Path | None = None
) -> TableModel:
    """Return the instance of a model for the data of a TOML file.

    `folder` is the base of relative file names in the data; None if they may not refer to files.
    Raises a ValidationFailure if the data is invalid.
    """
    try:
        return model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        raise ValidationFailure(_faults(error.errors(), model)) from None
    except OverflowError:
        raise ValidationFailure([((), OUT_OF_RANGE)]) from None


def key_text(key: KeyPath) -> str:
    """Return a key for a message: its parts quoted if necessary, shortened, on one line."""
    parts = (
        text if text.replace("-", "_").isidentifier() or text.isdecimal() else repr(text)
        for text in map(str, key)
    )
    return ".".join(cut_text(part, MAX_KEY_LENGTH) for part in parts) or "scenario"


def _faults(errors: list[Any], model: type[BaseModel]) -> list[tuple[KeyPath, str]]:
    """Return key and message of the errors; a misspelt key is not missing as well."""
    locations = [error["loc"] for error in errors]
    missing = [error["loc"] for error in errors if error["type"] == "missing"]
    meant = {}
    for location in (error["loc"] for error in errors if error["type"] == "extra_forbidden"):
        siblings = [str(loc[-1]) for loc in missing if loc[:-1] == location[:-1]]
        if near := closest(str(location[-1]), siblings):
            meant[location] = near
            missing.remove((*location[:-1], near))
    return [
        _fault(error, model, meant.get(error["loc"], ""))
        for error in errors
        if (error["type"] != "missing" or error["loc"] in missing)
        # A list is too short for pydantic where an item of it is invalid.
        and not (error["type"] == "too_short" and _is_within(error["loc"], locations))
    ]


def _is_within(location: KeyPath, others: list[KeyPath]) -> bool:
    return any(len(o) > len(location) and o[: len(location)] == location for o in others)


def _fault(error: Any, model: type[BaseModel], meant: str) -> tuple[KeyPath, str]:
    """Return key and message of one of `ValidationError.errors()`."""
    path, table, unit, forms = _place(model, error["loc"])
    kind, context = error["type"], error.get("ctx", {})
    if kind == "inconsistent":
        return (*path, *context["where"]), context["message"]
    if kind == "extra_forbidden":
        return path, _unknown_key(path, [meant] if meant else key_names(table), table)
    if kind == "missing":
        return path, f"missing; expected a number in {unit}" if unit else "missing"
    if kind in ("value_error", "assertion_error"):  # of a validator
        return path, str(context["error"]) or "invalid"
    # "Input should be greater than 0"
    words = WORDS.get(kind) or error["msg"].partition(" ")[2].replace(" after validation", "")
    if unit and kind in ("float_type", "finite_number"):
        words += f" in {unit}"
    elif unit and kind.startswith(("greater", "less")):
        words += f" {unit}"
    place = error["loc"][-1] if kind == "float_type" else kind
    if place in (NO_SIGNAL, NUMBER):
        words += f", or {forms_of(forms)}"
    elif place in (NO_FRICTION, KINETIC_NUMBER):
        words += f", or {FORMS_OF_FRICTION}"
    words += "" if kind in WITH_COUNT else f", got {toml_text(error['input'])}"
    if kind == NO_SIGNAL and AngleTable not in forms and "angle_deg" in error["input"]:
        words += "; only forces and couples of a shaft depend on an angle"
    return path, words


def _unknown_key(path: KeyPath, known: list[str], table: type[BaseModel] | None) -> str:
    """Return the message for an unknown key; the keys of inner tables that end alike are named."""
    name = str(path[-1])
    inner = [] if table is None or closest(name, known) else keys_that_end_with(name, table)
    if not 0 < len(inner) <= MAX_MEANT:
        return unknown("key", name, known, "" if known else "this table has no keys")
    above = "".join(f"{part}." for part in path[:-1])
    *others, last = (f"'{above}{key}'" for key in inner)
    meant = f"{', '.join(others)} or {last}" if others else last
    return f"unknown key '{name}' (did you mean {meant}?)"


def _place(
    model: type[BaseModel], location: KeyPath
) -> tuple[KeyPath, type[BaseModel] | None, str, list[type[BaseModel]]]:
    """Return the keys of a location as in TOML, the model around the last one, its unit and forms.

    Pydantic's location has the tag of a signal's form in it, which is no key. The forms are the
    models that the last key around it takes.
    """
    path: KeyPath = ()
    here: type[BaseModel] | None = model
    forms: list[type[BaseModel]] = []
    table, unit = here, ""
    for part in location:
        if part in (NUMBER, SUM, ONE, KINETIC_NUMBER):
            continue
        if part in ALL_TAGS:
            here = ALL_TAGS[str(part)]
            if here is CsvTable and SpeedTable in forms:
                here = CsvSpeedTable
            continue
        path = (*path, part)
        fields = {f.alias or name: f for name, f in here.model_fields.items()} if here else {}
        if part in fields:
            table, unit = here, unit_of(fields[str(part)]) or unit
            forms = [*models_in(fields[str(part)].annotation)]
            here = forms[0] if forms else None
        elif isinstance(part, str) and here is not None and path[-1] == location[-1]:
            table, unit = here, ""  # a key that is not known
    return path, table, "" if unit == "1" else unit, forms
