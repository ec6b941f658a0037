"""Effects that several kinds of mechanism can have, dry friction apart."""

from frictionsim.scenario.schema import Params, unit_field


class Gravity(Params):
    """Weight of all that has a mass."""

    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)


class AirDrag(Params):
    """Viscous resistance of the air: a torque -b w."""

    coefficient: float = unit_field(
        "N m s", "Torque per angular velocity, against the motion.", ge=0
    )
