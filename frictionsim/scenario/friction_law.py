"""The friction law that an effect of dry friction names, and what its coefficients must keep."""

from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.scenario.methods import REGULARISED
from frictionsim.scenario.schema import Params, inconsistent, unit_field

TRANSITION_SPEED = 1e-3  # rad/s, where a regularised law is not given one


class FrictionLaw(Params):
    """`law` and `transition_speed` of dry friction about one coordinate."""

    # Those of another law may not fit.
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
                f"law = '{self.law}' does not smooth friction; leave transition_speed out, or give"
                f" law = '{REGULARISED}'",
            )
        return self

    def law_of_contact(self) -> dict[str, Any]:
        """Return the law and its speed as a contact of a mechanism has them."""
        return {"law": self.law, "transition_speed": self.transition_speed or TRANSITION_SPEED}


def check_kinetic(name: str, kinetic: float, static_name: str, static: float) -> None:
    """Refuse kinetic friction above the static limit.

    Raises
    ------
    PydanticCustomError
    """
    if kinetic > static:
        raise inconsistent(
            (name,),
            f"{kinetic} is above {static_name} = {static}; sliding friction does not exceed the"
            f" static limit, so give 0 <= {name} <= {static_name}",
        )
