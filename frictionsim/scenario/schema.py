"""Base class and fields of the tables of a scenario: strict, frozen, finite, with units."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError


class Params(BaseModel):
    """A table of a scenario. Unknown keys, wrong types, inf and nan are refused."""

    # Messages for retired keys, by name.
    RETIRED: ClassVar[Mapping[str, str]] = MappingProxyType({})

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        defer_build=True,  # build the model of the loaded scenario only, for a fast start
    )


def unit_field(unit: str, description: str, default: Any = ..., **bounds: Any) -> Any:
    """Declare a field with SI unit and description, for messages and documentation.

    Parameters
    ----------
    unit : str
        SI unit, or ``"1"`` for a pure number.
    description : str
        A sentence for the reference of scenarios.
    default : optional
        Without a default, the key is required.
    **bounds
        Arguments of pydantic's ``Field``: ``gt``, ``ge``, ``lt``, ``le``, ``min_length``, ...
    """
    return Field(default, description=description, json_schema_extra={"unit": unit}, **bounds)


def inconsistent(where: tuple[str | int, ...], message: str) -> PydanticCustomError:
    """Return the error for values that are valid individually but inconsistent.

    Parameters
    ----------
    where : tuple of str or int
        The key to report, relative to the table whose validator raises this.
    message : str
    """
    return PydanticCustomError("inconsistent", "{message}", {"message": message, "where": where})
