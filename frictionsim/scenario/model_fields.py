"""What the models of a scenario say of their keys, for messages, templates and the reference."""

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from pydantic import BaseModel


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
