"""Base of the tables of a scenario, strict and with units, and the friction law of an effect."""

from contextvars import ContextVar
from typing import Any, ClassVar, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from frictionsim.scenario.methods import REGULARISED

TRANSITION_SPEED = 1e-3  # rad/s, default of the regularised law


class Params(BaseModel):
    """A table of a scenario. Unknown keys, wrong types, inf and nan are refused."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        defer_build=True,  # build the model of the loaded scenario only, for a fast start
    )


class UnitOfKey(NamedTuple):
    """The unit of a key, which a signal knows that reads it from a file."""

    name: str

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        token = unit_of_key.set(self.name)
        try:
            return handler(source)
        finally:
            unit_of_key.reset(token)


# While the validators of the value of a key are built.
unit_of_key = ContextVar("unit_of_key", default="")


def unit_field(unit: str, description: str, default: Any = ..., **bounds: Any) -> Any:
    """Declare a field with SI unit and description, for messages and documentation.

    `unit` is "1" for a pure number; without a default the key is required; `bounds` are arguments
    of pydantic's `Field`: `gt`, `ge`, `lt`, `le`, `min_length`, ...
    """
    extra: Any = {"unit": unit}
    field: Any = Field(default, description=description, json_schema_extra=extra, **bounds)
    field.metadata.append(UnitOfKey(unit))
    return field


def inconsistent(where: tuple[str | int, ...], message: str) -> PydanticCustomError:
    """Return the error for values that are valid individually but inconsistent.

    `where` is the key to report, relative to the table whose validator raises this.
    """
    return PydanticCustomError("inconsistent", "{message}", {"message": message, "where": where})


class FrictionLaw(Params):
    """`law` and `transition_speed` of dry friction of one coordinate."""

    # The keys that change with the law.
    LAW_KEYS: ClassVar[tuple[str, ...]] = ("law", "transition_speed")

    law: Literal["set-valued", "regularised", "published"] = Field(
        "set-valued", description="Friction law."
    )
    transition_speed: float | None = unit_field(
        "rad/s",
        "Speed over which a regularised law rises to its full friction; 1e-3 if left out.",
        None,
        gt=0,
    )

    @model_validator(mode="after")
    def _law_has_its_parameters(self) -> Self:
        if self.transition_speed is not None and self.law != REGULARISED:
            raise inconsistent(
                ("transition_speed",),
                f"law = '{self.law}' has no transition speed; remove transition_speed, or use"
                f" law = '{REGULARISED}'",
            )
        return self

    def law_of_contact(self) -> dict[str, Any]:
        """Return law and transition speed, rad/s, as arguments of `Friction`."""
        return {"law": self.law, "transition_speed": self.transition_speed or TRANSITION_SPEED}


class CoefficientsOfFriction(Params):
    """`mu_s` and `mu_k` of dry friction."""

    mu_s: float = unit_field("1", "Static coefficient of friction, not below mu_k.", ge=0)
    mu_k: float = unit_field("1", "Kinetic coefficient of friction.", ge=0)

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic("mu_k", self.mu_k, "mu_s", self.mu_s)
        return self


def check_kinetic(name: str, kinetic: float, static_name: str, static: float, *at: Any) -> None:
    """Raise the error of a key whose kinetic friction, at keys in it, exceeds the static one."""
    if kinetic > static:
        raise inconsistent(
            (name, *at),
            f"{kinetic} is above {static_name} = {static}; kinetic friction must not exceed static"
            f" friction, so give 0 <= {name} <= {static_name}",
        )
