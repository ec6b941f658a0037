"""What every table of a scenario has in common: strict, frozen, finite, with units."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError


class Params(BaseModel):
    """A table of a scenario. Unknown keys, wrong types, inf and nan are refused."""

    # What a message says of keys that have gone, by their names.
    RETIRED: ClassVar[Mapping[str, str]] = MappingProxyType({})

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        defer_build=True,  # only the scenario that is loaded is built, not each of its tables
    )


def unit_field(unit: str, description: str, default: Any = ..., **bounds: Any) -> Any:
    """Declare a field with its SI unit and meaning, which messages and documents read from it.

    Parameters
    ----------
    unit : str
        SI unit, or ``"1"`` for a pure number.
    description : str
        A sentence for the reference of scenarios.
    default : optional
        Left out, the key is required.
    **bounds
        As pydantic's ``Field`` has them: ``gt``, ``ge``, ``lt``, ``le``, ``min_length``, ...
    """
    return Field(default, description=description, json_schema_extra={"unit": unit}, **bounds)


def inconsistent(where: tuple[str | int, ...], message: str) -> PydanticCustomError:
    """Return the error of values that are each right but do not go together.

    Parameters
    ----------
    where : tuple of str or int
        The key to report, relative to the table whose validator raises this.
    message : str
    """
    return PydanticCustomError("inconsistent", "{message}", {"message": message, "where": where})
