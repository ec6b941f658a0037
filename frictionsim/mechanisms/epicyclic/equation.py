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
    static, kinetic : float, N m
        Couple of the hinge on the crank: M_A r1/r2, `published` M_A lambda; 0 without it.
    static_lever, lever : float, m
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
    kinetic: float
    static_lever: float
    lever: float
    is_radial: bool
    parts: tuple[str, ...]


def constants_of(scenario: EpicyclicScenario) -> Constants:
    """Return the constants of the equation of a scenario, those of motion at the speed zero."""
    geometry, effects = scenario.mechanism, scenario.effects
    hinge, rolling = effects.hinge_friction, effects.rolling_friction
    L, turns = geometry.length, abs(geometry.planet_speed_ratio)
    g = effects.gravity.g if effects.gravity else 0.0
    G_2, is_published = geometry.planet_mass * g, geometry.formulation == "published"
    K = (0.5 * geometry.crank_mass * g + G_2) * L
    ratio = turns if is_published else geometry.sun_radius / geometry.planet_radius
    is_radial = rolling is not None and rolling.normal_load == "radial"
    parts = {"hinge": hinge is not None, "mesh": rolling is not None and (is_radial or G_2 > 0.0)}
    return Constants(
        K + G_2 * L if is_published else K,
        G_2,
        geometry.planet_mass * L,
        hinge.torque_static * ratio if hinge else 0.0,
        over_speed(hinge.torque_kinetic, hinge.torque_static).at_rest * ratio if hinge else 0.0,
        rolling.arm * turns if rolling else 0.0,
        over_speed(rolling.rolling_arm, rolling.arm).at_rest * turns if rolling else 0.0,
        is_radial,
        tuple(name for name, is_there in parts.items() if is_there),
    )


def curves_of(scenario: EpicyclicScenario) -> tuple[OverSpeed, OverSpeed]:
    """Return `kinetic` and `lever` of the consistent equation over phi', rad/s."""
    geometry, effects = scenario.mechanism, scenario.effects
    hinge, rolling = effects.hinge_friction, effects.rolling_friction
    turns, ratio = abs(geometry.planet_speed_ratio), geometry.sun_radius / geometry.planet_radius
    couple = over_speed(
        hinge.torque_kinetic if hinge else 0.0, hinge.torque_static if hinge else 0.0
    )
    arm = over_speed(rolling.rolling_arm if rolling else 0.0, rolling.arm if rolling else 0.0)
    return couple.of(ratio, lambda x: x * ratio), arm.of(turns, lambda x: x * turns)


def build(scenario: EpicyclicScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    geometry, effects, drive = scenario.mechanism, scenario.effects, scenario.drive
    constants = constants_of(scenario)
    speed = scenario.given_speed
    system_of: Any = OneCoordinate if speed is None else partial(OneAtSpeed, speed)
    K, load = constants.K, _load(constants)
    terms = [Term(lambda M_O, q, v: M_O, INPUT)]
    if effects.gravity:
        terms.append(Term(lambda M_O, q, v: -K * cos(q), potential=lambda q: K * sin(q)))
    friction, surfaces = None, ()
    following: dict[str, Callable[[float, float], float]] = {}
    if constants.parts and geometry.formulation == "consistent":
        friction, surfaces = _friction(scenario, constants, load)
    elif constants.parts:
        couple, rolling = constants.kinetic, constants.lever * constants.G_2

        def resistance(q: float, v: float) -> float:
            return -couple - rolling * sin(q)

        terms.append(Term(lambda M_O, q, v: resistance(q, v), "energy_friction"))
        following["friction_torque"] = resistance

    def uniform_torque(q: float, v: float) -> float:
        opposed = friction.kinetic(0.0, q, v, 1, 0.0) if friction else 0.0
        return opposed - system.torque(0.0, q, v)

    following["uniform_torque"] = uniform_torque
    planet = geometry.planet_speed_ratio
    following["planet_velocity"] = lambda q, v: planet * v
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
    """The surface on which a radial load of (phi, phi') changes its sign."""

    load: Callable[[float, float], float]
    event: str = ""

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return a number that is positive beyond the surface, in a step."""
        return -self.load(*step.y_old[:2]) * self.load(y[0], y[1])


def _friction(
    scenario: EpicyclicScenario, constants: Constants, load: Callable[[float, float], float]
) -> tuple[Friction, tuple[Any, ...]]:
    """Return the dry friction of hinge and mesh, as far as they are there, and its surfaces."""
    static, kinetic = constants.static, constants.kinetic
    static_lever, lever = constants.static_lever, constants.lever
    largest = constants.K + static + static_lever * constants.G_2
    surfaces: tuple[Any, ...] = (MultiplesOf(pi),)
    if constants.is_radial:
        surfaces = (Unloading(load),)
    friction = Friction(
        "+".join(constants.parts),
        static=lambda M_O, q: static + static_lever * abs(load(q, 0.0)),
        kinetic=lambda M_O, q, v, s, M: kinetic + lever * abs(load(q, v)),
        roundoff=lambda M_O, q: ROUNDING * (abs(M_O) + largest),
        **scenario.law_of_contact.law_of_contact(),
    )
    if "mesh" not in constants.parts:
        surfaces = ()
        friction = friction._replace(
            static=lambda M_O, q: static, kinetic=lambda M_O, q, v, s, M: kinetic
        )
    couple, arm = curves_of(scenario)
    if couple.varies or arm.varies:
        friction = friction._replace(
            kinetic=lambda M_O, q, v, s, M: couple.at(v) + arm.at(v) * abs(load(q, v)),
            surfaces=couple.surfaces(1) + arm.surfaces(1),
        )
    return friction, surfaces


def path_of(scenario: EpicyclicScenario) -> TracerPath:
    """Return the path of the tracer point of a scenario that has one."""
    geometry, point = scenario.mechanism, scenario.effects.tracer_point
    assert point is not None
    return TracerPath(geometry, point)


def _quantities(scenario: EpicyclicScenario, samples: Samples) -> Quantities:
    """Return the torques of uniform rotation, cusps, dwell and swing."""
    values = uniform_torques(scenario)
    depends = constants_of(scenario).is_radial or any(c.varies for c in curves_of(scenario))
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
    C, K, F = constants.kinetic, constants.K, constants.lever * constants.G_2
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

    speed = 0 is the limit of slow rotation; the torque depends on the speed with `radial`, and with
    friction over the speed. Gravity has no mean. Eq 28 as published: M_A lambda. Consistent:
    M_A r1/r2 + f <N> lambda, with <|a sin phi - b|> = b for b >= a, else
    2/pi (sqrt(a^2 - b^2) + b asin(b/a)), where a = G_2 and b = m_2 L phi'^2 (`radial`, at the given
    speed) or 0 (`weight`).

    Parameters
    ----------
    scenario : EpicyclicScenario
    speed : float, rad/s
    """
    constants = constants_of(scenario)
    if scenario.mechanism.formulation == "published":
        return constants.kinetic
    a, b = constants.G_2, constants.mass_length * speed * speed if constants.is_radial else 0.0
    load = b if b >= a else 2.0 / pi * (sqrt(a * a - b * b) + b * asin(b / a))
    couple, lever = curves_of(scenario)
    return couple.at(speed) + lever.at(speed) * load
