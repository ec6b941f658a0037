"""Impending motion of a pulley on a dry shaft, eq 24, and of one with masses on its cord.

At rest with masses the tensions are T1 = m1 g on the side of the car and T2 = P + m2 g on the
other, and

    |(T2 - T1) r + tau| <= r_s (T1 + T2)                    the shaft sticks
    exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi)                the cord sticks (Euler, Eytelwein)

A torque tau changes neither tension, so that beyond the second limit the cord slips whatever it is:
no torque lifts or holds the car, or moves it at a constant speed, where the cord sticks to the rim.
"""

from math import inf, sqrt

from frictionsim.mechanisms.effects import radii_of
from frictionsim.mechanisms.pulley.schema import LiftParameters, PulleyScenario
from frictionsim.results import Quantities, Quantity, StaticQuantities
from frictionsim.scenario.signal_tables import signal_from

# Of what lifts and what holds, N or N m: None if nothing does.
Limits = tuple[float | None, float | None]


def limit_forces(arm: float, radius: float, load: float, vertical: bool) -> Limits:
    """Solve |(P - W) r_e| = r_f R for the force P, eq 24: that which lifts, and that which holds.

        vertical     P = W (r_e +- r_f)/(r_e -+ r_f)
        horizontal   (1 - q) P^2 - 2 W P + (1 - q) W^2 = 0,  q = (r_f/r_e)^2

    If r_f >= r_e, no force lifts the load, and none is needed to hold it.

    Parameters
    ----------
    arm, radius : float, m
        r_e, and r_f: r_s for impending motion, r_k for steady motion.
    load : float, N
        W.
    vertical : bool
    """
    if radius >= arm:
        return None, 0.0
    if vertical:
        ratio = (arm + radius) / (arm - radius)
        return load * ratio, load / ratio
    q = (radius / arm) ** 2
    root = sqrt(q * (2.0 - q))
    return load * (1.0 + root) / (1.0 - q), load * (1.0 - q) / (1.0 + root)


def _limits(scenario: PulleyScenario, at_rest: bool, direction: str) -> Limits:
    """Return the limits of rest, or of steady motion, of a force in a direction or of a torque.

    Of a constant normal load N, P = W +- r_f N/r_e.
    """
    journal, arm = scenario.effects.shaft_friction, scenario.mechanism.cord_radius
    radius, load = radii_of(journal)[0 if at_rest else 1], scenario.mechanism.load
    if scenario.effects.hanging_masses is not None:
        n = scenario.lift_parameters
        if n.by_torque:
            return _torques_of_lift(n, radius)
        return _forces_of_lift(n, radius, n.static_ratio if at_rest else n.kinetic_ratio)
    normal_load = None if journal is None else journal.normal_load
    if scenario.drive.force is not None:
        if normal_load is None:
            return limit_forces(arm, radius, load, direction == "vertical")
        friction = radius * normal_load / arm
        return load + friction, max(load - friction, 0.0)
    if normal_load is None:
        return load * (arm + radius), load * (arm - radius)
    return load * arm + radius * normal_load, load * arm - radius * normal_load


def _forces_of_lift(n: LiftParameters, radius: float, ratio: float) -> Limits:
    """Return the forces P that lift and that hold.

    The tension of the force's side is T1 times the smaller of the ratios at which the shaft breaks
    away and the cord begins to slip, or T1 over it.
    """
    if radius < n.r:
        ratio = min(ratio, (n.r + radius) / (n.r - radius))
    lift = None if ratio == inf else n.weight_1 * ratio - n.weight_2
    return lift, n.weight_1 / ratio - n.weight_2


def _torques_of_lift(n: LiftParameters, radius: float) -> Limits:
    """Return the torques that lift and that hold; None where the cord slips at any torque."""
    less, more = sorted((n.weight_1, n.weight_2))
    if more > less * n.static_ratio:
        return None, None
    unbalance, reaction = n.weight_1 - n.weight_2, n.weight_1 + n.weight_2
    return n.r * unbalance + radius * reaction, n.r * unbalance - radius * reaction


def _named(
    scenario: PulleyScenario, up: str, down: str, at_rest: bool = True, direction: str = ""
) -> Quantities:
    drive, unit = ("torque", "N m") if scenario.drive.force is None else ("force", "N")
    limits = _limits(scenario, at_rest, direction or scenario.drive.direction)
    return {
        f"{drive}_to_{way}": Quantity(limit, unit)
        for way, limit in zip((up, down), limits, strict=True)
    }


def impending_motion(scenario: PulleyScenario) -> Quantities:
    """Return the force or torque of impending motion, and the traction of a cord that may slip.

    A force of a lift that is negative: the counterweight alone lifts or holds.
    """
    quantities = _named(scenario, "lift", "hold")
    if scenario.effects.cord_friction is not None:
        n = scenario.lift_parameters
        force = 0.0 if n.by_torque else signal_from(scenario.drive.force)(0.0)
        less, more = sorted((n.weight_1, n.weight_2 + force))
        ratio = more / less if less > 0.0 else None
        margin = None if ratio is None else n.static_ratio / ratio
        quantities["tension_ratio_at_rest"] = Quantity(ratio, "1")
        quantities["tension_ratio_allowed"] = Quantity(n.static_ratio, "1")
        quantities["traction_margin"] = Quantity(margin, "1")
    return quantities


def statics(scenario: PulleyScenario) -> StaticQuantities:
    """Return the limits of eq 24, static and kinetic; of a force, vertical and horizontal."""
    quantities = StaticQuantities(impending_motion(scenario))
    quantities |= _named(scenario, "keep_lifting", "keep_lowering", at_rest=False)
    has_masses = scenario.effects.hanging_masses is not None
    if has_masses and quantities.get("torque_to_hold", Quantity(0.0, "N m")).value is None:
        quantities.notes = (
            "no torque lifts or holds: the weights differ by more than the friction of the cord"
            " holds (traction_margin is below 1), so that it slips at any torque",
        )
    if scenario.drive.force is not None and not has_masses:
        for way in ("vertical", "horizontal"):
            quantities |= _named(scenario, f"lift_{way}", f"hold_{way}", direction=way)
    r_s, r_k = radii_of(scenario.effects.shaft_friction)
    quantities["friction_radius_static"] = Quantity(r_s, "m")
    quantities["friction_radius_kinetic"] = Quantity(r_k, "m")
    return quantities
