"""Effects of several kinds of mechanism, except dry friction, and of masses on a cord."""

from math import radians
from typing import Self

from pydantic import model_validator

from frictionsim.scenario.friction_law import CoefficientsOfFriction
from frictionsim.scenario.schema import Params, inconsistent, unit_field

MAX_EXPONENT = 100.0  # of exp(mu_s wrap), the ratio of tensions at which a cord slips
RENAMED_AIR_DRAG = "renamed to viscous_damping: write [effects.viscous_damping]"


class Gravity(Params):
    """Weight of all masses."""

    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)


class ViscousDamping(Params):
    """Viscous damping: a torque -b w."""

    coefficient: float = unit_field(
        "N m s", "Torque per angular velocity, against the motion.", ge=0
    )


class HangingMasses(Params):
    """Masses on the cord: a car in place of the load, a counterweight on the side of the force.

    The tensions depend on the acceleration, and the load of the shaft with them. A side whose
    tension would be negative falls slack, and is taken up with an impact. Half of the rope hangs on
    each side, and its weight is compensated: it does not shift with the travel.
    """

    car: float = unit_field(
        "kg", "Mass of the car with all that hangs from it, on the side of the load.", gt=0
    )
    counterweight: float = unit_field(
        "kg", "Mass of the counterweight, on the side of the force.", ge=0
    )
    rope: float = unit_field("kg", "Mass of the rope, half of it on each side.", 0.0, ge=0)
    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)
    restitution: float = unit_field(
        "1",
        "Restitution of a slack rope that is taken up: speed after over before. The part e^2 of"
        " the work that takes it up is given back.",
        0.0,
        ge=0,
        lt=1,
    )
    capture_speed: float = unit_field(
        "m/s", "A rope that is taken up more slowly does not bounce.", 1e-3, gt=0
    )

    @property
    def car_side(self) -> float:
        """m1, kg."""
        return self.car + 0.5 * self.rope

    @property
    def other_side(self) -> float:
        """m2, kg."""
        return self.counterweight + 0.5 * self.rope


class CordFriction(CoefficientsOfFriction):
    """Dry friction of the cord on the pulley, of Euler and Eytelwein: the cord may slip.

    It sticks while the ratio of the tensions is at most exp(mu_s wrap); slipping, the ratio is
    exp(mu_k wrap).
    """

    wrap_deg: float = unit_field("deg", "Angle of wrap, of all turns together.", 180.0, gt=0)

    @model_validator(mode="after")
    def _cord_can_slip(self) -> Self:
        if self.mu_s * radians(self.wrap_deg) > MAX_EXPONENT:
            raise inconsistent(
                ("wrap_deg",),
                f"the ratio of tensions exp(mu_s wrap) exceeds exp({MAX_EXPONENT:g}): such a cord"
                " never slips; leave cord_friction out",
            )
        return self
