"""Effects of several kinds of mechanism: gravity, viscous damping, friction of a journal."""

from collections.abc import Callable
from math import hypot
from sys import float_info
from typing import Any, Self

from pydantic import model_validator

from frictionsim.scenario.kinetic_friction import (
    KineticCoefficient,
    OverSpeed,
    check_kinetic_friction,
    over_speed,
)
from frictionsim.scenario.schema import FrictionLaw, Params, unit_field
from frictionsim.solvers.system import Friction, Term

CONTACT_NAME = "shaft"
# Torque and limit are sums of three products: a few roundings of each.
ROUNDING = 16 * float_info.epsilon


def friction_radius(shaft_radius: float, mu: float) -> float:
    """Return the friction radius of a dry journal: the distance of the reaction from its axis [1]_.

    r_f = r sin(atan mu) = r mu / sqrt(1 + mu^2); the friction torque is r_f R.
    Valid while the shaft itself does not accelerate.

    Parameters
    ----------
    shaft_radius : float, m
    mu : float, dimensionless, not negative

    Returns
    -------
    float, m

    References
    ----------
    .. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering
       Research 13(11), 2018, 8871-8881, eqs 5-6 and 50-51.
    """
    return shaft_radius * mu / hypot(1.0, mu)


class ShaftFriction(FrictionLaw):
    """Dry friction of a journal on a fixed shaft.

    Sticking holds while |M| <= r_s R; sliding gives a torque r_k R against the motion, with
    the friction radii r_s, r_k of `mu_s`, `mu_k` and the reaction R of the shaft, or a constant
    normal load in its place. The speed of a `mu_k` over speed is shaft_radius |w|.
    """

    shaft_radius: float = unit_field("m", "Radius of the shaft, where the journal slides.", gt=0)
    mu_s: float = unit_field("1", "Static coefficient of friction, not below mu_k.", ge=0)
    mu_k: KineticCoefficient = unit_field("1", "Kinetic coefficient of friction.")
    normal_load: float | None = unit_field(
        "N",
        "Normal load of the friction, whatever forces act; the reaction of the shaft if left out.",
        None,
        ge=0,
    )

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic_friction("mu_k", self.mu_k, "mu_s", self.mu_s)
        return self

    @property
    def static_radius(self) -> float:
        """r_s, m."""
        return friction_radius(self.shaft_radius, self.mu_s)

    @property
    def kinetic_radius(self) -> float:
        """r_k, m; at the speed zero."""
        return self.radius_over_speed.at_rest

    @property
    def radius_over_speed(self) -> OverSpeed:
        """r_k, m, over w, rad/s."""
        radius = self.shaft_radius
        return over_speed(self.mu_k, self.mu_s).of(radius, lambda mu: friction_radius(radius, mu))

    def load_of(self, reaction: Any) -> Any:
        """Return the load of the friction, N: the reaction, or the constant normal load."""
        return reaction if self.normal_load is None else self.normal_load


def radii_of(effect: ShaftFriction | None) -> tuple[float, float]:
    """Return r_s and r_k at the speed zero, m; zeros without friction."""
    return (effect.static_radius, effect.kinetic_radius) if effect else (0.0, 0.0)


def journal_friction(
    effect: ShaftFriction | None,
    reaction: Callable[[Any, float], float],
    roundoff: Callable[[Any, float], float],
) -> Friction | None:
    """Return the dry friction of a journal whose reaction R does not depend on the motion.

    Parameters
    ----------
    effect : ShaftFriction or None
        Without the effect there is no friction.
    reaction, roundoff : callable
        R, N, not negative, and the roundoff of torque and limit, N m, of (u, q).
    """
    if effect is None:
        return None
    r_s, r_k, radius = effect.static_radius, effect.kinetic_radius, effect.radius_over_speed
    if (load := effect.normal_load) is not None:
        reaction = lambda u, q: load  # noqa: E731
    friction = Friction(
        CONTACT_NAME,
        static=lambda u, q: r_s * reaction(u, q),
        kinetic=lambda u, q, w, s, applied: r_k * reaction(u, q),
        roundoff=roundoff,
        surfaces=radius.surfaces(1),
        **effect.law_of_contact(),
    )
    if not radius.varies:
        return friction
    return friction._replace(kinetic=lambda u, q, w, s, applied: radius.at(w) * reaction(u, q))


class Gravity(Params):
    """Weight of all masses."""

    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)


class ViscousDamping(Params):
    """Viscous damping: a torque -b w."""

    coefficient: float = unit_field(
        "N m s", "Torque per angular velocity, against the motion.", ge=0
    )


def viscous_damping(effect: ViscousDamping | None) -> list[Term]:
    """Return the term -b w; none without the effect."""
    if effect is None:
        return []
    b = effect.coefficient
    return [Term(lambda u, q, w: -b * w, "energy_damping")]
