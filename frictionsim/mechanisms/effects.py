"""Effects of several kinds of mechanism, except dry friction."""

from frictionsim.scenario.schema import Params, unit_field

RENAMED_AIR_DRAG = "renamed to viscous_damping: write [effects.viscous_damping]"


class Gravity(Params):
    """Weight of all masses."""

    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)


class ViscousDamping(Params):
    """Viscous damping: a torque -b w."""

    coefficient: float = unit_field(
        "N m s", "Torque per angular velocity, against the motion.", ge=0
    )
