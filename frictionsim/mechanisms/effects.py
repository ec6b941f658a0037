"""Effects that several kinds of mechanism can have, dry friction apart."""

from frictionsim.scenario.schema import Params, unit_field

RENAMED_AIR_DRAG = "the effect is called viscous_damping now: write [effects.viscous_damping]"


class Gravity(Params):
    """Weight of all that has a mass."""

    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)


class ViscousDamping(Params):
    """Viscous damping: a torque -b w."""

    coefficient: float = unit_field(
        "N m s", "Torque per angular velocity, against the motion.", ge=0
    )
