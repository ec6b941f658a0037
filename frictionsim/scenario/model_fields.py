"""The keys of a scenario as its models declare them, for messages, templates and the reference."""

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from frictionsim.errors import unknown

# Described last: how a scenario is solved comes after what it is.
LAST = ("solver", "output")
# The key that stands for a name which the scenario is free to choose.
FREE_NAME = "NAME"


class TableKey(NamedTuple):
    """A key of a table, by its name in TOML; with the model of the table that it holds, if any."""

    name: str
    field: FieldInfo
    table: type[BaseModel] | None

    @property
    def has_names(self) -> bool:
        """Whether it holds tables by names of the user's choice."""
        return self.table is not None and holds(self.field.annotation, dict)

    @property
    def is_list(self) -> bool:
        """Whether it holds a list, of tables nothing else."""
        may_be_one = self.table is not None and len([*models_in(self.field.annotation)]) > 1
        return holds(self.field.annotation, tuple) and not may_be_one


def table_keys(model: type[BaseModel]) -> Iterator[TableKey]:
    """Yield the keys of a table in the order of their description.

    Keys that take nothing are left out: they are there only to be refused with a reason.
    """
    for name, field in sorted(model.model_fields.items(), key=lambda item: item[0] in LAST):
        if field.annotation is not type(None):
            yield TableKey(field.alias or name, field, table_model(field.annotation))


def unit_of(field: FieldInfo) -> str:
    """Return the unit of a key, "1" of a pure number; empty of text."""
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def types_and_choices(annotation: Any) -> Iterator[Any]:
    """Yield the types and the literal values of an annotation."""
    arguments = [argument for argument in get_args(annotation) if argument is not type(None)]
    if get_origin(annotation) is Literal:
        yield from arguments
    elif not arguments:
        yield annotation
    else:
        for argument in arguments:
            yield from types_and_choices(argument)


def key_names(model: type[BaseModel] | None) -> list[str]:
    """Return the keys of a table as in TOML; none without a model."""
    if model is None:
        return []
    return [field.alias or name for name, field in model.model_fields.items()]


def keys_that_end_with(name: str, model: type[BaseModel]) -> list[str]:
    """Return the keys in inner tables, not in their lists, whose last part is a name."""
    found = []
    for key in table_keys(model):
        if key.table is not None and not (key.is_list or key.has_names):
            inner = [name] * (name in key_names(key.table)) + keys_that_end_with(name, key.table)
            found += [f"{key.name}.{one}" for one in inner]
    return found


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models of tables in an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models_in(argument)


def table_model(annotation: Any) -> type[BaseModel] | None:
    """Return the model of the table that a key holds; None where it holds a value or signal."""
    models = {*models_in(annotation)}
    return models.pop() if len(models) == 1 else None  # a signal has several forms


def holds(annotation: Any, container: type) -> bool:
    """Return whether an annotation is, or contains, a container such as dict or tuple."""
    return get_origin(annotation) is container or any(
        holds(argument, container) for argument in get_args(annotation)
    )


def fields_along(model: type[BaseModel], key: str) -> list[list[FieldInfo]]:
    """Return the fields that the parts of a key may be of, as of `forces.load.size`.

    An index or the name of an entry of a list, and a name of the user's choice, have none. A value
    of several forms, such as a signal, has several fields; an unknown key has an empty list.
    """
    models, levels, is_entry, may_be_entry = [model], list[list[FieldInfo]](), False, False
    for part in map(str.strip, key.split(".")):
        named = (item for one in models for item in one.model_fields.items())
        fields = [field for name, field in named if part in (name, field.alias)]
        has_names = bool(levels) and any(holds(field.annotation, dict) for field in levels[-1])
        if is_entry or part.isdecimal() or ((has_names or may_be_entry) and not fields):
            is_entry = may_be_entry = False
            continue
        levels.append(fields)
        models = [inner for field in fields for inner in models_in(field.annotation)]
        lists = [
            len([*models_in(field.annotation)])
            for field in fields
            if table_model(field.annotation) is not None and holds(field.annotation, tuple)
        ]
        is_entry, may_be_entry = 1 in lists, bool(lists)  # a table, too, may be one or a list
    return levels


def fields_of_key(model: type[BaseModel], key: str) -> list[FieldInfo]:
    """Return the fields that a key with dots may be of; see `fields_along`."""
    levels = fields_along(model, key)
    return levels[-1] if levels else []


def unknown_key(model: type[BaseModel], key: str) -> str:
    """Return what is wrong with a key with dots that a model does not have; empty if it has it."""
    parts = key.split(".")
    for count in range(1, len(parts) + 1):
        levels = fields_along(model, ".".join(parts[:count]))
        if levels and not levels[-1]:
            fields = levels[-2] if len(levels) > 1 else []
            above = [m for f in fields for m in models_in(f.annotation)] or [model]
            known = [*dict.fromkeys(name for one in above for name in key_names(one))]
            listed = "" if known else "this table has no keys"
            return unknown("key", parts[count - 1], known, listed)
    return ""


def names_in(key: str) -> list[str]:
    """Return the single keys of a text that has one, or several with commas between them."""
    return key.split(",")


def expanded(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by single key, for values of which some are of several keys."""
    return {name: value for key, value in values.items() for name in names_in(key)}


def description_of(model: type[BaseModel], key: str) -> tuple[str, str]:
    """Return unit and description of a key as of --set; no unit if it is no number with one.

    An entry of a list has the unit of the list. Several keys have the unit that all of them have,
    if there is one, and the description of the first.
    """
    described = [_description_of_one(model, name) for name in names_in(key)]
    unit, words = described[0]
    return unit if all(other == unit for other, _ in described) else "", words


def _description_of_one(model: type[BaseModel], key: str) -> tuple[str, str]:
    unit, words = "", ""
    for fields in fields_along(model, key):
        if not fields:
            break
        field = fields[0]
        words = field.description or words
        if field.annotation is int or int in get_args(field.annotation):
            unit = "1"  # a pure number
        unit = unit_of(field) or unit
    return unit, words or key
