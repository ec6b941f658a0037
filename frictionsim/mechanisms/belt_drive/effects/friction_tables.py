"""The tables of a scenario that have to do with the friction of a belt."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.scenario.friction_law import CoefficientsOfFriction
from frictionsim.scenario.schema import inconsistent, unit_field

UNITS = {"transition_speed": "m/s", "maximum_creep": "m"}


class BeltFrictionTable(CoefficientsOfFriction):
    """`[effects.belt_friction]`, with `pulleys.NAME` for those that differ."""

    LAW_KEYS: ClassVar[tuple[str, ...]] = ("law", "transition_speed", "maximum_creep")

    law: Literal["set-valued", "regularised", "creep"] = Field(
        "set-valued", description="Friction law."
    )
    transition_speed: float | None = unit_field(
        "m/s",
        "Speed over which `regularised` and `creep` friction rises to its full size; needed by"
        " both.",
        None,
        gt=0,
    )
    maximum_creep: float | None = unit_field(
        "m",
        "Creep at which a contact without slip has its full friction, eq 13; `creep` needs it.",
        None,
        gt=0,
    )
    pulleys: dict[str, CoefficientsOfFriction] = Field(
        default_factory=dict,
        description="Coefficients of a pulley that differs from the others, by its name.",
    )

    @model_validator(mode="after")
    def _law_has_its_parameters(self) -> Self:
        needs = {
            "transition_speed": self.law in ("regularised", "creep"),
            "maximum_creep": self.law == "creep",
        }
        for key, needed in needs.items():
            given = getattr(self, key) is not None
            if needed and not given:
                raise inconsistent(
                    (key,),
                    f"missing; law = '{self.law}' needs it, in {UNITS[key]}"
                    f" (--set effects.belt_friction.{key}=VALUE)",
                )
            if given and not needed:
                raise inconsistent(
                    (key,), f"law = '{self.law}' has no such parameter; leave it out"
                )
        return self
