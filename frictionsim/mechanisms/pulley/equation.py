"""The equation of motion of a pulley without masses on its cord."""

from collections.abc import Callable
from math import hypot, sqrt
from typing import Any

from frictionsim.mechanisms.effects import ROUNDING, journal_friction, viscous_damping
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion_forces, limit_torques
from frictionsim.mechanisms.single_dof import one_coordinate, start_of
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.simulation.mechanism import Mechanism, Samples
from frictionsim.solvers.system import INPUT, OneCoordinate, Term


def build(scenario: PulleyScenario) -> Any:
    """Return the mechanism, composed of the effects in the scenario.

    A force P on the cord, which carries the load W, or a torque tau on the pulley, where P is zero:

        I w' = P r_e - W r_e - b w + T,    R = |P + W|, or sqrt(P^2 + W^2) of a horizontal P
    """
    if scenario.effects.hanging_masses is not None:
        from frictionsim.mechanisms.pulley.masses import mechanism_with_masses

        return mechanism_with_masses(scenario)
    r_e, W, effects = scenario.mechanism.cord_radius, scenario.mechanism.load, scenario.effects
    by_torque = scenario.drive.force is None
    table = scenario.drive.torque if by_torque else scenario.drive.force
    assert table is not None  # checked by the model of the drive
    drive, vertical = signal_from(table), scenario.drive.direction == "vertical"
    lever = 1.0 if by_torque else r_e
    reaction = _reaction(W, by_torque, vertical)
    terms = [
        Term(lambda u, q, w: u * lever, INPUT),
        Term(-W * r_e, potential=lambda q: W * r_e * q),
        *viscous_damping(effects.viscous_damping),
    ]
    friction = journal_friction(
        effects.shaft_friction,
        reaction,
        roundoff=lambda u, q: ROUNDING * (lever * abs(u) + r_e * W),
    )
    r_s = effects.shaft_friction.static_radius if effects.shaft_friction else 0.0
    system = OneCoordinate(
        drive,
        None,
        scenario.mechanism.inertia,
        terms,
        friction,
        start=start_of(scenario),
        breaks=() if by_torque else _critical_forces(r_e, r_s, W, vertical),
        channels=("drive_torque" if by_torque else "drive_force", "shaft_reaction"),
        recorded=lambda u, q, w, a: [u, reaction(u, q)],
    )

    def quantities(samples: Samples) -> Any:
        return limit_torques(scenario) if by_torque else impending_motion_forces(scenario)

    mechanism: Mechanism = one_coordinate(scenario, system, quantities)
    return mechanism


def _reaction(load: float, by_torque: bool, vertical: bool) -> Callable[[float, float], float]:
    """Return R, N, as a function of (u, q)."""
    if by_torque:
        return lambda u, q: load
    return (lambda u, q: abs(u + load)) if vertical else lambda u, q: hypot(u, load)


def _critical_forces(arm: float, r_s: float, load: float, vertical: bool) -> tuple[float, ...]:
    """Return the extrema of +-(P - W) r_e - r_s R over P, N."""
    if vertical:
        return (-load,)
    if r_s <= arm:
        return (0.0,)
    extremum = load * arm / sqrt(r_s * r_s - arm * arm)
    return (-extremum, extremum)
