"""A pulley on a dry fixed shaft: a force P on the cord lifts, holds or lowers a load W.

    I dw/dt = (P - W) r_e - b w + T,    |T| <= r_s R sticking,    T = -s r_k R sliding [1]_

theta > 0 lifts the load. The reaction of the shaft is R = |P + W| with P vertical and
sqrt(P^2 + W^2) with P horizontal. W and P are forces: as in the paper, the equation neglects the
inertia of the load, its effect on the cord tension, and the weight of the pulley. A torque on the
pulley may take the place of the force P. Masses on the cord, which may then fall slack or slip,
are in `masses`.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 24 and 49-52.
"""

from collections.abc import Callable
from functools import partial
from math import hypot, sqrt
from typing import Any

from frictionsim.mechanisms.effects import ROUNDING, journal_friction, radii_of, viscous_damping
from frictionsim.mechanisms.journal import journal_channels
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion
from frictionsim.mechanisms.single_dof import one_coordinate, start_of
from frictionsim.scenario.kinetic_friction import Corners
from frictionsim.scenario.signal_tables import signal_and_curve
from frictionsim.solvers.prescribed import OneAtSpeed
from frictionsim.solvers.system import INPUT, OneCoordinate, Term


def build(scenario: PulleyScenario) -> Any:
    """Return the mechanism, composed of the effects in the scenario."""
    if scenario.effects.hanging_masses is not None:
        from frictionsim.mechanisms.pulley.masses import mechanism_with_masses

        return mechanism_with_masses(scenario)
    r_e, W, effects = scenario.mechanism.cord_radius, scenario.mechanism.load, scenario.effects
    by_torque, vertical = scenario.drive.force is None, scenario.drive.direction == "vertical"
    drive, curve = signal_and_curve(scenario.drive.given or 0.0)
    speed = scenario.given_speed
    system_of: Any = OneCoordinate if speed is None else partial(OneAtSpeed, speed)
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
    r_s, _ = radii_of(effects.shaft_friction)
    system = system_of(
        drive,
        None if curve is None else lambda t, q, w: drive(t) + curve(w),
        scenario.mechanism.inertia,
        terms,
        friction,
        start=start_of(scenario),
        breaks=() if by_torque else _critical_forces(r_e, r_s, W, vertical),
        surfaces=() if curve is None else (Corners(1, curve.corners()),),
        channels=("drive_torque" if by_torque else "drive_force", "shaft_reaction"),
        recorded=lambda u, q, w, a: [u, reaction(u, q)],
    )

    return one_coordinate(
        scenario,
        system,
        lambda samples: impending_motion(scenario),
        prescribed=speed is not None,
        derived=journal_channels(effects.shaft_friction, scenario.mechanism.inertia),
    )


def _reaction(load: float, by_torque: bool, vertical: bool) -> Callable[[float, float], float]:
    """Return R, N, as a function of (u, q)."""
    if by_torque:
        return lambda u, q: load
    return (lambda u, q: abs(u + load)) if vertical else lambda u, q: hypot(u, load)


def _critical_forces(arm: float, r_s: float, load: float, vertical: bool) -> tuple[float, ...]:
    """Return the extrema of +-(P - W) r_e - r_s R over P, N; 0 where there are none."""
    if vertical:
        return (-load,)
    if r_s <= arm:
        return (0.0,)
    extremum = load * arm / sqrt(r_s * r_s - arm * arm)
    return (-extremum, extremum)
