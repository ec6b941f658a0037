"""An epicyclic gear: a crank carries a planet that rolls on a fixed sun, or inside a ring.

phi is the angle of the crank from the horizontal, L = r1 + r2 its length, r1 - r2 in a ring,
lambda = L/r2 the rotations of the planet per turn of the crank, backwards in a ring, G the weights.
Formulation `consistent` (derived by both Lagrange and Newton-Euler), the same in a ring:

    J phi'' = M_O - K cos phi + T,   J = (2 m_OA + 9 m_2) L^2/6,   K = (G_OA/2 + G_2) L
    sliding    T = -s (M_A r1/r2 + f N lambda)
    sticking   T holds while |T| <= M_As r1/r2 + f_s |G_2 sin phi| lambda
    N = |G_2 sin phi| (`weight`) or |G_2 sin phi - m_2 L phi'^2| (`radial`)

M_A is the friction couple of the hinge between planet and crank; its power is that of their
relative rotation phi' r1/r2. f is the arm of rolling friction at the mesh, where the planet rotates
by phi' lambda. Both may depend on the speed of that rotation. The distribution of the
planet's radial load between crank and mesh is indeterminate; `normal_load` states an assumption.

Formulation `published` is eq 26 of [1]_ as published, for all directions of motion:

    J phi'' = M_O - (G_OA/2 + 2 G_2) L cos phi - M_A lambda - f G_2 sin phi lambda

It counts the weight of the planet twice, applies the couple of the hinge against the ground, and
its friction has positive power where phi' < 0 or sin phi < 0; it cannot stick. The paper has a sun
("external engagement"), although its conclusion calls the mechanism hypocyclic.

References
----------
.. [1] Z. Mchedlishvili, Z. Tsitskishvili, doi 10.36073/1512-0996-2026-1-143-147.
"""

from collections.abc import Callable
from functools import partial
from math import asin, atan2, cos, hypot, pi, sin, sqrt
from typing import Any, NamedTuple

from frictionsim.mechanisms.effects import ROUNDING
from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.mechanisms.epicyclic.tracer_point import TracerPath
from frictionsim.mechanisms.single_dof import MultiplesOf, one_coordinate, start_of
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.kinetic_friction import OverSpeed, over_speed
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.simulation.mechanism import Mechanism, Samples
from frictionsim.solvers.prescribed import OneAtSpeed
from frictionsim.solvers.system import INPUT, Friction, OneCoordinate, Term


class Constants(NamedTuple):
    """The constants of the equation, which differ by the formulation.

    Attributes
    ----------
    K : float, N m
        The largest moment of the weights; `published` counts the weight of the planet twice.
    G_2, mass_length : float, N and kg m
        Weight of the planet, and its centripetal force over phi'^2.
    static, couple : float and OverSpeed, N m
        Couple of the hinge on the crank: M_A r1/r2, `published` M_A lambda; 0 without it. In
        motion it is over phi', rad/s.
    static_lever, lever : float and OverSpeed, m
        f lambda; 0 without rolling friction.
    is_radial : bool
        The load of the mesh has the centripetal force in it.
    parts : tuple of str
        What has friction. Without weight and centripetal force, the mesh carries no load.
    """

    K: float
    G_2: float
    mass_length: float
    static: float
    couple: OverSpeed
    static_lever: float
    lever: OverSpeed
    is_radial: bool
    parts: tuple[str, ...]


def constants_of(scenario: EpicyclicScenario) -> Constants:
    """Return the constants of the equation of a scenario."""
    geometry, effects = scenario.mechanism, scenario.effects
    hinge, rolling = effects.hinge_friction, effects.rolling_friction
    turns, is_published = abs(geometry.planet_speed_ratio), geometry.formulation == "published"
    ratio = turns if is_published else geometry.sun_radius / geometry.planet_radius
    g = effects.gravity.g if effects.gravity else 0.0
    G_2 = geometry.planet_mass * g
    K = (0.5 * geometry.crank_mass * g + G_2) * geometry.length
    is_radial = rolling is not None and rolling.normal_load == "radial"
    parts = {"hinge": hinge is not None, "mesh": rolling is not None}
    couple = over_speed(*((hinge.torque_kinetic, hinge.torque_static) if hinge else (0.0, 0.0)))
    arm = over_speed(*((rolling.rolling_arm, rolling.arm) if rolling else (0.0, 0.0)))
    return Constants(
        K + G_2 * geometry.length if is_published else K,
        G_2,
        geometry.planet_mass * geometry.length,
        hinge.torque_static * ratio if hinge else 0.0,
        couple.of(ratio, lambda x: x * ratio),
        rolling.arm * turns if rolling else 0.0,
        arm.of(turns, lambda x: x * turns),
        is_radial,
        tuple(name for name, is_there in parts.items() if is_there),
    )


def build(scenario: EpicyclicScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    geometry, effects, drive = scenario.mechanism, scenario.effects, scenario.drive
    constants, speed = constants_of(scenario), scenario.given_speed
    system_of: Any = OneCoordinate if speed is None else partial(OneAtSpeed, speed)
    K, load = constants.K, _load(constants)
    terms = [Term(lambda M_O, q, v: M_O, INPUT)]
    if effects.gravity:
        terms.append(Term(lambda M_O, q, v: -K * cos(q), potential=lambda q: K * sin(q)))
    friction, surfaces = None, ()
    following: dict[str, Callable[[float, float], float]] = {}
    if constants.parts and geometry.formulation == "consistent":
        friction, surfaces = _friction(scenario, constants)
    elif constants.parts:
        couple, rolling = constants.couple.at_rest, constants.lever.at_rest * constants.G_2

        def resistance(q: float, v: float) -> float:
            return -couple - rolling * sin(q)

        terms.append(Term(lambda M_O, q, v: resistance(q, v), "energy_friction"))
        following["friction_torque"] = resistance

    def uniform_torque(q: float, v: float) -> float:
        opposed = friction.kinetic(0.0, q, v, 1, 0.0) if friction else 0.0
        return opposed - system.torque(0.0, q, v)

    planet = geometry.planet_speed_ratio
    following |= {"uniform_torque": uniform_torque, "planet_velocity": lambda q, v: planet * v}
    if effects.rolling_friction:
        following["normal_load"] = lambda q, v: abs(load(q, v))
    if effects.tracer_point:
        path = path_of(scenario)
        L, turns, rho, psi_0 = path.length, path.turns, path.rho, path.psi_0
        following["tracer_x"] = lambda q, v: L * cos(q) + rho * cos(psi_0 + turns * q)
        following["tracer_y"] = lambda q, v: L * sin(q) + rho * sin(psi_0 + turns * q)
    system = system_of(
        signal_from(drive.torque or 0.0),
        None,
        geometry.inertia,
        terms,
        friction,
        start=start_of(scenario),
        surfaces=surfaces,
        channels=("drive_torque", *following),
        recorded=lambda M_O, q, v, a: [M_O, *[value(q, v) for value in following.values()]],
    )
    return one_coordinate(
        scenario,
        system,
        lambda samples: _quantities(scenario, samples),
        run_warnings=lambda samples: _run_warnings(scenario, samples),
        prescribed=speed is not None,
    )


def _load(constants: Constants) -> Callable[[float, float], float]:
    """Return the radial load of the mesh, of (phi, phi'), whose size is N."""
    G_2, mass_length = constants.G_2, constants.mass_length
    if constants.is_radial:
        return lambda q, v: G_2 * sin(q) - mass_length * v * v
    return lambda q, v: G_2 * sin(q)


class Unloading(NamedTuple):
    """The surface on which the radial load of the mesh changes its sign."""

    load: Callable[[float, float], float]
    event: str = ""

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return a number that is positive beyond the surface, in a step."""
        return -self.load(*step.y_old[:2]) * self.load(y[0], y[1])


def _friction(
    scenario: EpicyclicScenario, constants: Constants
) -> tuple[Friction, tuple[Any, ...]]:
    """Return the dry friction of hinge and mesh, as far as they are there, and its surfaces."""
    static, couple = constants.static, constants.couple
    static_lever, lever, load = constants.static_lever, constants.lever, _load(constants)
    kinetic, arm = couple.at_rest, lever.at_rest
    largest = constants.K + static + static_lever * constants.G_2
    friction = Friction(
        "+".join(constants.parts),
        static=lambda M_O, q: static + static_lever * abs(load(q, 0.0)),
        kinetic=lambda M_O, q, v, s, M: kinetic + arm * abs(load(q, v)),
        roundoff=lambda M_O, q: ROUNDING * (abs(M_O) + largest),
        surfaces=couple.surfaces(1) + lever.surfaces(1),
        **scenario.law_of_contact.law_of_contact(),
    )
    if friction.surfaces:
        friction = friction._replace(
            kinetic=lambda M_O, q, v, s, M: couple.at(v) + lever.at(v) * abs(load(q, v))
        )
    elif "mesh" not in constants.parts:
        friction = friction._replace(
            static=lambda M_O, q: static, kinetic=lambda M_O, q, v, s, M: kinetic
        )
    if "mesh" not in constants.parts:
        return friction, ()
    return friction, (Unloading(load) if constants.is_radial else MultiplesOf(pi),)


def path_of(scenario: EpicyclicScenario) -> TracerPath:
    """Return the path of the tracer point of a scenario that has one."""
    assert scenario.effects.tracer_point is not None
    return TracerPath(scenario.mechanism, scenario.effects.tracer_point)


def _quantities(scenario: EpicyclicScenario, samples: Samples) -> Quantities:
    """Return the torques of uniform rotation, cusps, dwell and swing."""
    values, constants = uniform_torques(scenario), constants_of(scenario)
    depends = constants.is_radial or constants.couple.varies or constants.lever.varies
    if depends and samples.time.size:
        torque = uniform_torque_mean(scenario, float(samples["angular_velocity"][-1]))
        values["uniform_torque_mean_at_final_speed"] = Quantity(torque, "N m")
    if scenario.effects.tracer_point:
        path, angle = path_of(scenario), samples["angle"]
        cusps = path.cusps(angle)
        dwell = path.longest_dwell((samples.time, angle, samples["angular_velocity"]))
        values["tracer_cusps"] = Quantity(cusps and cusps[1], "1")
        values["tracer_dwell_time"] = Quantity(dwell and dwell.time, "s")
        values |= path.quantities()
    return values


def _run_warnings(scenario: EpicyclicScenario, samples: Samples) -> list[str]:
    """Return warnings if the crank went against its torque, or is sampled coarsely."""
    from frictionsim.simulation.run_warnings import (  # imports numpy, not needed by `check`
        against_drive,
        hidden_turns,
    )

    angle, torque = samples["angle"], samples["drive_torque"]
    back = scenario.drive.torque is not None and against_drive(samples.time, torque, angle)
    warnings = [f"the crank {back}: weight or initial velocity prevailed"] if back else []
    duration, interval = scenario.solver.duration, scenario.interval
    return warnings + hidden_turns(angle, samples["angular_velocity"], interval, duration)


def uniform_torques(scenario: EpicyclicScenario) -> Quantities:
    """Return mean and extremes of the torque of slow uniform forward rotation; at the start.

    M(phi) = C + K cos phi + f N lambda, eq 28, with C = M_A r1/r2 and N = |G_2 sin phi|, published
    M_A lambda and G_2 sin phi. With F = f G_2 lambda its maximum is C + sqrt(K^2 + F^2) at
    atan(F/K), also at the opposite angle if consistent, whose minimum is C - K at pi; the published
    one is C - sqrt(K^2 + F^2) at pi + atan(F/K).
    """
    constants, (angle, _) = constants_of(scenario), start_of(scenario)
    C, K, F = constants.couple.at_rest, constants.K, constants.lever.at_rest * constants.G_2
    least, at, load = C - K, pi, abs(sin(angle))
    if scenario.mechanism.formulation == "published":
        least, at, load = C - hypot(K, F), pi + atan2(F, K), sin(angle)
    return {
        "uniform_torque_mean": Quantity(uniform_torque_mean(scenario, 0.0), "N m"),
        "uniform_torque_max": Quantity(C + hypot(K, F), "N m"),
        "uniform_torque_max_angle": Quantity(atan2(F, K), "rad"),
        "uniform_torque_min": Quantity(least, "N m"),
        "uniform_torque_min_angle": Quantity(at, "rad"),
        "uniform_torque_at_start": Quantity(C + K * cos(angle) + F * load, "N m"),
    }


def uniform_torque_mean(scenario: EpicyclicScenario, speed: float) -> float:
    """Return the mean torque over a turn for uniform forward rotation of the crank, N m.

    Gravity has no mean. Eq 28 as published: M_A lambda. Consistent: M_A r1/r2 + f <N> lambda, with
    <|a sin phi - b|> = b for b >= a, else 2/pi (sqrt(a^2 - b^2) + b asin(b/a)), where a = G_2 and
    b = m_2 L phi'^2 (`radial`, at the given speed, rad/s) or 0 (`weight`).
    """
    constants = constants_of(scenario)
    if scenario.mechanism.formulation == "published":
        return constants.couple.at_rest
    a, b = constants.G_2, constants.mass_length * speed * speed if constants.is_radial else 0.0
    load = b if b >= a else 2.0 / pi * (sqrt(a * a - b * b) + b * asin(b / a))
    return constants.couple.at(speed) + constants.lever.at(speed) * load


def statics(scenario: EpicyclicScenario) -> Quantities:
    """Return the torques of impending motion at the initial angle, and of uniform rotation.

    The published equation has no rest, and so no impending motion.
    """
    system, gear, values = build(scenario).system, scenario.mechanism, dict[str, Quantity]()
    other = "consistent" if gear.formulation == "published" else "published"
    changed = scenario.model_copy(
        update={"mechanism": gear.model_copy(update={"formulation": other})}
    )
    if gear.formulation == "consistent":
        angle, friction = system.start[0], system.friction
        balance = -system.torque(0.0, angle, 0.0)
        limit = friction.static(0.0, angle) if friction else 0.0
        values["torque_to_start_forward"] = Quantity(balance + limit, "N m")
        values["torque_to_start_backward"] = Quantity(balance - limit, "N m")
    return {
        **values,
        **uniform_torques(scenario),
        f"uniform_torque_mean_{other}": Quantity(uniform_torque_mean(changed, 0.0), "N m"),
        "gravity_moment": Quantity(constants_of(scenario).K, "N m"),
        "inertia": Quantity(gear.inertia, "kg m^2"),
        "planet_speed_ratio": Quantity(gear.planet_speed_ratio, "1"),
        **(path_of(scenario).quantities() if scenario.effects.tracer_point else {}),
    }
