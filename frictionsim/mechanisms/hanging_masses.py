"""The numbers of a pulley with masses on its cord, and its statics.

At rest the tensions are T1 = m1 g on the side of the car and T2 = P + m2 g on the other, and

    |(T2 - T1) r + tau| <= r_s (T1 + T2)                    the shaft sticks
    exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi)                the cord sticks (Euler, Eytelwein)
"""

from math import exp, inf, radians
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_checks import extremes
from frictionsim.scenario.signal_tables import signal_from

if TYPE_CHECKING:
    from frictionsim.mechanisms.pulley import PulleyScenario
    from frictionsim.scenario.signals import Signal

Fault = tuple[tuple[str, ...], str]
"""A key and what is wrong with it."""


def limiting_ratio(mu: float, wrap_deg: float) -> float:
    """Return exp(mu phi), the ratio of the tensions of a cord that slips or is about to."""
    return exp(mu * radians(wrap_deg))


class Numbers(NamedTuple):
    """The numbers of a scenario with hanging masses.

    Attributes
    ----------
    r, inertia : float, m and kg m^2
    m1, m2 : float, kg
        Of car and counterweight, each with half of the rope.
    g : float, m/s^2
    damping : float, N m s
        b.
    r_s, r_k : float, m
        Friction radii of the shaft; zero without its friction.
    static_ratio, kinetic_ratio : float
        exp(mu phi) of the cord; inf where it cannot slip.
    by_torque : bool
        The drive is a torque on the pulley, not a force on the cord.
    """

    r: float
    inertia: float
    m1: float
    m2: float
    g: float
    damping: float
    r_s: float
    r_k: float
    static_ratio: float
    kinetic_ratio: float
    by_torque: bool

    @property
    def weight_1(self) -> float:
        """m1 g, N."""
        return self.m1 * self.g

    @property
    def weight_2(self) -> float:
        """m2 g, N."""
        return self.m2 * self.g


def numbers_of(scenario: "PulleyScenario") -> Numbers:
    """Return the numbers of a scenario with hanging masses."""
    geometry, effects = scenario.mechanism, scenario.effects
    masses, journal, cord = effects.hanging_masses, effects.shaft_friction, effects.cord_friction
    assert masses is not None
    return Numbers(
        geometry.cord_radius,
        geometry.inertia,
        masses.car_side,
        masses.other_side,
        masses.g,
        effects.viscous_damping.coefficient if effects.viscous_damping else 0.0,
        journal.static_radius if journal else 0.0,
        journal.kinetic_radius if journal else 0.0,
        limiting_ratio(cord.mu_s, cord.wrap_deg) if cord else inf,
        limiting_ratio(cord.mu_k, cord.wrap_deg) if cord else inf,
        scenario.drive.force is None,
    )


def drive_of(scenario: "PulleyScenario") -> "Signal":
    """Return the force or the torque of the drive over time."""
    force, torque = scenario.drive.force, scenario.drive.torque
    found = torque if force is None else force
    assert found is not None  # checked by the model of the drive
    return signal_from(found)


def fault_of(scenario: "PulleyScenario") -> Fault | None:
    """Return what is inconsistent in a scenario with hanging masses; None if nothing is."""
    n, force = numbers_of(scenario), scenario.drive.force
    if force is not None:
        minimum, _ = extremes(force, scenario.solver.duration)
        if minimum < 0.0 and scenario.effects.cord_friction is not None:
            return ("drive", "force"), (
                f"it has a minimum of {minimum:.6g} N, and a cord that may slip cannot push: give a"
                " force that is not negative, or leave cord_friction out"
            )
        if minimum < 0.0 and n.m2 == 0.0:
            return ("drive", "force"), (
                f"it has a minimum of {minimum:.6g} N, and the end of a cord without mass cannot"
                " push: give a force that is not negative, or a counterweight"
            )
    for name, mass in (("car", n.m1), ("counterweight", n.m2)):
        if n.inertia + mass * n.r * (n.r - n.r_k) <= 0.0:
            return ("effects", "shaft_friction", "shaft_radius"), (
                f"the kinetic friction radius {n.r_k:.6g} m is so far above cord_radius = {n.r} m"
                f" that the {name} of {mass:.6g} kg would turn the pulley backward by accelerating"
                " it: the equations have no unique solution; give a thinner shaft"
            )
    return None


def statics(scenario: "PulleyScenario") -> Quantities:
    """Return the forces or torques of impending motion, and the safety against slip of the cord.

    A force to lift or to hold that is negative: the counterweight alone does so.
    """
    n = numbers_of(scenario)
    found = impending_motion(scenario)
    name, unit = _drive(n)
    lifting, lowering = _limits(n, n.r_k, n.kinetic_ratio)
    found[f"{name}_to_keep_lifting"] = Quantity(lifting, unit)
    found[f"{name}_to_keep_lowering"] = Quantity(lowering, unit)
    found["friction_radius_static"] = Quantity(n.r_s, "m")
    found["friction_radius_kinetic"] = Quantity(n.r_k, "m")
    return found


def impending_motion(scenario: "PulleyScenario") -> Quantities:
    """Return the force or torque of impending motion, and the traction of a cord that may slip."""
    n = numbers_of(scenario)
    name, unit = _drive(n)
    lift, hold = _limits(n, n.r_s, n.static_ratio)
    found = {f"{name}_to_lift": Quantity(lift, unit), f"{name}_to_hold": Quantity(hold, unit)}
    if scenario.effects.cord_friction is not None:
        force = 0.0 if n.by_torque else drive_of(scenario)(0.0)
        tensions = sorted((n.weight_1, n.weight_2 + force))
        ratio = tensions[1] / tensions[0] if tensions[0] > 0.0 else None
        margin = None if ratio is None else n.static_ratio / ratio
        found["tension_ratio_at_rest"] = Quantity(ratio, "1")
        found["tension_ratio_allowed"] = Quantity(n.static_ratio, "1")
        found["traction_margin"] = Quantity(margin, "1")
    return found


def _drive(n: Numbers) -> tuple[str, str]:
    """Return what the drive is, and its unit."""
    return ("torque", "N m") if n.by_torque else ("force", "N")


def _limits(n: Numbers, radius: float, ratio: float) -> tuple[float | None, float]:
    """Return the forces or torques that lift and that hold, at a friction radius and a ratio."""
    return _limit_torques(n, radius) if n.by_torque else _limit_forces(n, radius, ratio)


def _limit_forces(n: Numbers, radius: float, ratio: float) -> tuple[float | None, float]:
    """Return the forces P that lift and that hold, N: the first None if no force lifts.

    The tension of the force's side is T1 times the smaller of the ratios at which the shaft and
    the cord give way, or T1 over it.
    """
    if radius < n.r:
        ratio = min(ratio, (n.r + radius) / (n.r - radius))
    lift = None if ratio == inf else n.weight_1 * ratio - n.weight_2
    return lift, n.weight_1 / ratio - n.weight_2


def _limit_torques(n: Numbers, radius: float) -> tuple[float, float]:
    """Return the torques that lift and that hold, N m."""
    unbalance, reaction = n.weight_1 - n.weight_2, n.weight_1 + n.weight_2
    return n.r * unbalance + radius * reaction, n.r * unbalance - radius * reaction
