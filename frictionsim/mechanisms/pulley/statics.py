"""Impending motion of a pulley on a dry shaft, eq 24, and of one with masses on its cord.

At rest with masses the tensions are T1 = m1 g on the side of the car and T2 = P + m2 g on the
other, and

    |(T2 - T1) r + tau| <= r_s (T1 + T2)                    the shaft sticks
    exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi)                the cord sticks (Euler, Eytelwein)

A torque tau changes neither tension, so that beyond the second limit the cord slips whatever it is:
no torque lifts or holds the car, or moves it at a constant speed, where the cord sticks to the rim.
"""

from math import inf, sqrt
from typing import NamedTuple

from frictionsim.mechanisms.pulley.schema import LiftParameters, PulleyScenario
from frictionsim.results import Quantities, Quantity, StaticQuantities
from frictionsim.scenario.signal_tables import signal_from


class LimitForces(NamedTuple):
    """The limits of the force at rest, N; `lift` is None if no force lifts."""

    lift: float | None
    hold: float


def limit_forces(arm: float, radius: float, load: float, vertical: bool) -> LimitForces:
    """Solve |(P - W) r_e| = r_f R for the force P, eq 24.

        vertical     P = W (r_e +- r_f)/(r_e -+ r_f)
        horizontal   (1 - q) P^2 - 2 W P + (1 - q) W^2 = 0,  q = (r_f/r_e)^2

    The paper solves it in this closed form. `shaft.balance.roots_of` solves eq 24 for any loads;
    its roots differ in the last digits.

    Parameters
    ----------
    arm : float, m
        Cord radius r_e.
    radius : float, m
        Friction radius r_f: r_s for impending motion, r_k for steady motion.
    load : float, N
        W.
    vertical : bool

    Returns
    -------
    LimitForces, N
        If r_f >= r_e, no force lifts the load, and none is needed to hold it.
    """
    if radius >= arm:
        return LimitForces(None, 0.0)
    if vertical:
        ratio = (arm + radius) / (arm - radius)
        return LimitForces(load * ratio, load / ratio)
    q = (radius / arm) ** 2
    root = sqrt(q * (2.0 - q))
    return LimitForces(load * (1.0 + root) / (1.0 - q), load * (1.0 - q) / (1.0 + root))


def _forces(scenario: PulleyScenario, radius: float, direction: str) -> LimitForces:
    """Return the limit forces of a scenario; of a constant normal load N, P = W +- r_f N/r_e."""
    journal, arm = scenario.effects.shaft_friction, scenario.mechanism.cord_radius
    load = scenario.mechanism.load
    if journal is None or journal.normal_load is None:
        return limit_forces(arm, radius, load, direction == "vertical")
    friction = radius * journal.normal_load / arm
    return LimitForces(load + friction, max(load - friction, 0.0))


def impending_motion_forces(scenario: PulleyScenario) -> Quantities:
    """Return the forces of impending motion, in the direction of the scenario."""
    journal = scenario.effects.shaft_friction
    r_s = journal.static_radius if journal else 0.0
    forces = _forces(scenario, r_s, scenario.drive.direction)
    return {
        "force_to_lift": Quantity(forces.lift, "N"),
        "force_to_hold": Quantity(forces.hold, "N"),
    }


def statics(scenario: PulleyScenario) -> Quantities:
    """Return the limit forces of eq 24: vertical and horizontal, static and kinetic."""
    if scenario.effects.hanging_masses is not None:
        return _statics_of_lift(scenario)
    if scenario.drive.force is None:
        return _statics_of_torque(scenario)
    journal = scenario.effects.shaft_friction
    r_s = journal.static_radius if journal else 0.0
    r_k = journal.kinetic_radius if journal else 0.0
    quantities = impending_motion_forces(scenario)
    steady = _forces(scenario, r_k, scenario.drive.direction)
    quantities["force_to_keep_lifting"] = Quantity(steady.lift, "N")
    quantities["force_to_keep_lowering"] = Quantity(steady.hold, "N")
    for direction in ("vertical", "horizontal"):
        forces = _forces(scenario, r_s, direction)
        quantities[f"force_to_lift_{direction}"] = Quantity(forces.lift, "N")
        quantities[f"force_to_hold_{direction}"] = Quantity(forces.hold, "N")
    quantities["friction_radius_static"] = Quantity(r_s, "m")
    quantities["friction_radius_kinetic"] = Quantity(r_k, "m")
    return quantities


def limit_torques(scenario: PulleyScenario) -> Quantities:
    """Return the torques of impending motion, W r_e +- r_s R."""
    journal = scenario.effects.shaft_friction
    return _torques(scenario, journal.static_radius if journal else 0.0, "lift", "hold")


def _statics_of_torque(scenario: PulleyScenario) -> Quantities:
    """Return the limit torques of eq 24, static and kinetic, of a drive by a torque."""
    journal = scenario.effects.shaft_friction
    r_s = journal.static_radius if journal else 0.0
    r_k = journal.kinetic_radius if journal else 0.0
    return {
        **limit_torques(scenario),
        **_torques(scenario, r_k, "keep_lifting", "keep_lowering"),
        "friction_radius_static": Quantity(r_s, "m"),
        "friction_radius_kinetic": Quantity(r_k, "m"),
    }


def _torques(scenario: PulleyScenario, radius: float, up: str, down: str) -> Quantities:
    """Return the torques at the limit of friction for motion up and down."""
    arm, load = scenario.mechanism.cord_radius, scenario.mechanism.load
    journal = scenario.effects.shaft_friction
    if journal is not None and journal.normal_load is not None:
        moment, friction = load * arm, radius * journal.normal_load
        up_and_down = moment + friction, moment - friction
    else:
        up_and_down = load * (arm + radius), load * (arm - radius)
    return {
        f"torque_to_{way}": Quantity(torque, "N m")
        for way, torque in zip((up, down), up_and_down, strict=True)
    }


def _statics_of_lift(scenario: PulleyScenario) -> Quantities:
    """Return the forces or torques of impending motion, and the safety against slip of the cord.

    A force to lift or to hold that is negative: the counterweight alone does so.
    """
    n = scenario.lift_parameters
    quantities = StaticQuantities(impending_motion_of_lift(scenario))
    name, unit = _lift_drive(n)
    if quantities[f"{name}_to_hold"].value is None:
        quantities.notes = (
            "no torque lifts or holds: the weights differ by more than the friction of the cord"
            " holds (traction_margin is below 1), so that it slips at any torque",
        )
    lifting, lowering = _lift_limits(n, n.r_k, n.kinetic_ratio)
    quantities[f"{name}_to_keep_lifting"] = Quantity(lifting, unit)
    quantities[f"{name}_to_keep_lowering"] = Quantity(lowering, unit)
    quantities["friction_radius_static"] = Quantity(n.r_s, "m")
    quantities["friction_radius_kinetic"] = Quantity(n.r_k, "m")
    return quantities


def impending_motion_of_lift(scenario: PulleyScenario) -> Quantities:
    """Return the force or torque of impending motion, and the traction of a cord that may slip."""
    n = scenario.lift_parameters
    name, unit = _lift_drive(n)
    lift, hold = _lift_limits(n, n.r_s, n.static_ratio)
    quantities = {f"{name}_to_lift": Quantity(lift, unit), f"{name}_to_hold": Quantity(hold, unit)}
    if scenario.effects.cord_friction is not None:
        force = 0.0 if n.by_torque else signal_from(scenario.drive.force)(0.0)
        tensions = sorted((n.weight_1, n.weight_2 + force))
        ratio = tensions[1] / tensions[0] if tensions[0] > 0.0 else None
        margin = None if ratio is None else n.static_ratio / ratio
        quantities["tension_ratio_at_rest"] = Quantity(ratio, "1")
        quantities["tension_ratio_allowed"] = Quantity(n.static_ratio, "1")
        quantities["traction_margin"] = Quantity(margin, "1")
    return quantities


def _lift_drive(n: LiftParameters) -> tuple[str, str]:
    """Return the name of the drive, and its unit."""
    return ("torque", "N m") if n.by_torque else ("force", "N")


def _lift_limits(
    n: LiftParameters, radius: float, ratio: float
) -> tuple[float | None, float | None]:
    """Return the forces or torques that lift and that hold, at a friction radius and a ratio."""
    return _lift_torques(n, radius) if n.by_torque else _lift_forces(n, radius, ratio)


def _lift_forces(n: LiftParameters, radius: float, ratio: float) -> tuple[float | None, float]:
    """Return the forces P that lift and that hold, N: the first None if no force lifts.

    The tension of the force's side is T1 times the smaller of the ratios at which the shaft and
    the cord give way, or T1 over it.
    """
    if radius < n.r:
        ratio = min(ratio, (n.r + radius) / (n.r - radius))
    lift = None if ratio == inf else n.weight_1 * ratio - n.weight_2
    return lift, n.weight_1 / ratio - n.weight_2


def _lift_torques(n: LiftParameters, radius: float) -> tuple[float | None, float | None]:
    """Return the torques that lift and that hold, N m; None where the cord slips at any torque."""
    less, more = sorted((n.weight_1, n.weight_2))
    if more > less * n.static_ratio:
        return None, None
    unbalance, reaction = n.weight_1 - n.weight_2, n.weight_1 + n.weight_2
    return n.r * unbalance + radius * reaction, n.r * unbalance - radius * reaction
