"""What the models of a scenario say of their keys, for messages, templates and the reference."""

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo


def key_names(model: type[BaseModel] | None) -> list[str]:
    """Return the keys of a table as in TOML; none without a model."""
    if model is None:
        return []
    return [field.alias or name for name, field in model.model_fields.items()]


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models of tables in an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models_in(argument)


def table_model(annotation: Any) -> type[BaseModel] | None:
    """Return the model of the table that a key holds; None where it holds a value or signal."""
    models = list(models_in(annotation))
    return models[0] if len(models) == 1 else None  # a signal has several forms


def holds(annotation: Any, container: type) -> bool:
    """Return whether an annotation is, or contains, a container such as dict or tuple."""
    return get_origin(annotation) is container or any(
        holds(argument, container) for argument in get_args(annotation)
    )


def fields_along(model: type[BaseModel], key: str) -> list[list[FieldInfo]]:
    """Return the fields that the parts of a key may be of, as of `forces.load.size`.

    An index or the name of an entry of a list, and a name of the user's choice, have none.

    Parameters
    ----------
    model : type
    key : str
        With dots, as of --set.

    Returns
    -------
    list of list of FieldInfo
        Several fields where a value has several forms, as a signal; none if there is no such key.
    """
    models, found, of_list = [model], list[list[FieldInfo]](), False
    for part in map(str.strip, key.split(".")):
        if of_list or part.isdecimal():
            of_list = False
            continue
        fields = [
            field
            for one in models
            for name, field in one.model_fields.items()
            if part in (name, field.alias)
        ]
        if not fields and found and any(holds(field.annotation, dict) for field in found[-1]):
            continue
        found.append(fields)
        models = [inner for field in fields for inner in models_in(field.annotation)]
        of_list = any(
            table_model(field.annotation) is not None and holds(field.annotation, tuple)
            for field in fields
        )
    return found


def fields_of_key(model: type[BaseModel], key: str) -> list[FieldInfo]:
    """Return the fields that a key with dots may be of; see `fields_along`."""
    found = fields_along(model, key)
    return found[-1] if found else []


def unit_of_key(model: type[BaseModel], key: str) -> str:
    """Return the unit of the value of a key with dots; empty if it is not known."""
    found = ""
    for fields in fields_along(model, key):
        for field in fields:
            extra = field.json_schema_extra
            if isinstance(extra, dict) and extra.get("unit"):
                found = str(extra["unit"])
    return found
