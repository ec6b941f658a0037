"""The tables of a scenario that have to do with the friction of a belt."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.scenario.friction_law import check_kinetic
from frictionsim.scenario.schema import Params, inconsistent, unit_field

UNITS = {"transition_speed": "m/s", "maximum_creep": "m"}


class CoefficientsTable(Params):
    """Friction of one pulley, or of a part of the belt."""

    mu_s: float = unit_field("1", "Static coefficient of friction, not below mu_k.", ge=0)
    mu_k: float = unit_field("1", "Kinetic coefficient of friction.", ge=0)

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic("mu_k", self.mu_k, "mu_s", self.mu_s)
        return self


class BeltFrictionTable(CoefficientsTable):
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
    pulleys: dict[str, CoefficientsTable] = Field(
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
