"""The equation of an epicyclic gear, `consistent` or `published`, and the terms that it is of."""

from math import asin, pi, sqrt
from sys import float_info
from typing import Any

from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.mechanisms.epicyclic.tracer_point import (
    count_cusps,
    longest_dwell,
    pace,
    tracer_position,
)
from frictionsim.mechanisms.single_dof import (
    cos,
    kinetic_energy,
    set_up,
    sin,
    total,
)
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.solvers.mechanism import (
    DryFriction,
    Mechanism,
    SwitchingSurface,
    Trajectory,
    Value,
)

# The applied torque is a sum of torques: a few roundings of each.
ROUNDING = 16 * float_info.epsilon


class EquationTerms:
    """The constants of the equation and the terms of the effects."""

    def __init__(self, scenario: EpicyclicScenario) -> None:
        geometry, effects = scenario.mechanism, scenario.effects
        self.length, self.planet_speed_ratio = geometry.length, geometry.planet_speed_ratio
        self.sun_planet_ratio = geometry.sun_radius / geometry.planet_radius
        g = effects.gravity.g if effects.gravity else 0.0
        self.planet_mass, self.planet_weight = geometry.planet_mass, geometry.planet_mass * g
        self.gravity_moment = (0.5 * geometry.crank_mass * g + self.planet_weight) * self.length
        self.hinge, self.rolling = effects.hinge_friction, effects.rolling_friction
        self.static_couple = self.hinge.torque_static if self.hinge else 0.0
        self.kinetic_couple = self.hinge.torque_kinetic if self.hinge else 0.0
        self.arm = self.rolling.arm if self.rolling else 0.0
        self.radial = self.rolling is not None and self.rolling.normal_load == "radial"
        # Without weight and radial load, the mesh carries no load.
        self.rolls = self.rolling is not None and (self.radial or self.planet_weight > 0.0)

    def mesh_load(self, angle: Value, velocity: Value) -> Value:
        """Return N, in N."""
        if self.radial:
            return abs(self.radial_balance(angle, velocity))
        return abs(self.planet_weight * sin(angle))

    def radial_balance(self, angle: Value, velocity: Value) -> Value:
        """Return G_2 sin phi - m_2 L phi'^2, N."""
        centripetal = self.planet_mass * self.length * velocity * velocity
        return self.planet_weight * sin(angle) - centripetal


def build(scenario: EpicyclicScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    terms, geometry = EquationTerms(scenario), scenario.mechanism
    published = geometry.formulation == "published"
    applied_torque, stored = (
        published_equation(terms, scenario) if published else equation(terms, scenario)
    )
    contact = None if published else contact_of(terms, scenario.law_of_contact.law_of_contact())
    power_flows: dict[str, Any] = {
        "energy_input": lambda torque, angle, velocity: torque * velocity
    }
    has_friction = terms.hinge is not None or terms.rolls
    if published and has_friction:
        resistance = published_resistance(terms)
        power_flows["energy_friction"] = lambda torque, angle, velocity: (
            resistance(angle) * velocity
        )
    stored_energies = {"energy_kinetic": kinetic_energy(geometry.inertia)}
    if scenario.effects.gravity is not None:
        stored_energies["energy_potential"] = lambda angle, velocity: stored * sin(angle)
    prescribed = scenario.drive.speed is not None
    drive = signal_from(scenario.drive.speed if prescribed else scenario.drive.torque)  # type: ignore[arg-type]

    def uniform_torque(angle: Value, velocity: Value) -> Value:
        opposed = contact.kinetic_limit(0.0, angle, velocity, 1) if contact else 0.0
        return opposed - applied_torque(0.0, angle, velocity)

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        angle, velocity = trajectory.position, trajectory.velocity
        values = {
            "drive_torque": trajectory.drive,
            "uniform_torque": uniform_torque(angle, velocity),
        }
        if terms.rolling is not None:
            values["normal_load"] = terms.mesh_load(angle, velocity)
        if published and has_friction:
            values["friction_torque"] = -resistance(angle)
        if scenario.effects.tracer_point is not None:
            values["tracer_x"], values["tracer_y"] = tracer_position(
                terms.length, terms.planet_speed_ratio, scenario.effects.tracer_point, angle
            )
        return values

    def quantities(trajectory: Trajectory) -> Quantities:
        values = {"uniform_torque_mean": Quantity(uniform_torque_mean(scenario, 0.0), "N m")}
        if terms.radial and trajectory.velocity.size:
            torque = uniform_torque_mean(scenario, float(trajectory.velocity[-1]))
            values["uniform_torque_mean_at_final_speed"] = Quantity(torque, "N m")
        if scenario.effects.tracer_point is not None:
            point = scenario.effects.tracer_point
            x, y = tracer_position(
                terms.length, terms.planet_speed_ratio, point, trajectory.position
            )
            paces = pace(
                terms.length,
                terms.planet_speed_ratio,
                point,
                trajectory.position,
                trajectory.velocity,
            )
            values["tracer_cusps"] = Quantity(
                count_cusps(
                    geometry.sun_radius, geometry.planet_radius, point, trajectory.position
                ),
                "1",
            )
            values["tracer_dwell_time"] = Quantity(
                longest_dwell(trajectory.time, paces, x, y, point.dwell_distance), "s"
            )
        return values

    def run_warnings(trajectory: Trajectory) -> list[str]:
        from frictionsim.simulation.run_warnings import (
            against_drive,  # imports numpy, not needed by `check`
        )

        back = (
            ""
            if prescribed
            else against_drive(trajectory.time, trajectory.drive, trajectory.position)
        )
        return [f"the crank {back}: weight or initial velocity prevailed"] if back else []

    return Mechanism(
        drive=drive,
        inertia=geometry.inertia,
        applied_torque=applied_torque,
        contact=contact,
        power_flows=power_flows,
        stored_energies=stored_energies,
        channels=channels,
        quantities=quantities,
        run_warnings=run_warnings,
        switching_surfaces=() if published else switching_surfaces(terms),
        prescribed=prescribed,
        **set_up(scenario) | ({"velocity": drive(0.0)} if prescribed else {}),
    )


def equation(terms: EquationTerms, scenario: EpicyclicScenario) -> tuple[Any, float]:
    """Return the consistent applied torque, and the factor of sin phi in its potential."""
    k = terms.gravity_moment if scenario.effects.gravity else 0.0
    weight = (lambda torque, angle, velocity: -k * cos(angle)) if scenario.effects.gravity else None
    return total(_drive_torque, weight), k


def published_equation(terms: EquationTerms, scenario: EpicyclicScenario) -> tuple[Any, float]:
    """Return the right-hand side of eq 26, and the factor of sin phi in its potential."""
    resistance, gravity = published_resistance(terms), scenario.effects.gravity
    k = terms.gravity_moment + terms.planet_weight * terms.length if gravity else 0.0
    return total(
        _drive_torque,
        (lambda torque, angle, velocity: -k * cos(angle)) if gravity else None,
        lambda torque, angle, velocity: -resistance(angle),
    ), k


def _drive_torque(torque: Value, angle: Value, velocity: Value) -> Value:
    return torque


def published_resistance(terms: EquationTerms) -> Any:
    """Return M_A lambda + f G_2 sin phi lambda of eq 26, a function of phi, N m."""
    couple = terms.kinetic_couple * terms.planet_speed_ratio
    rolling = terms.arm * terms.planet_weight * terms.planet_speed_ratio
    return total(
        (lambda angle: couple) if terms.hinge or not terms.rolls else None,
        (lambda angle: rolling * sin(angle)) if terms.rolls else None,
    )


def contact_of(terms: EquationTerms, law: dict[str, Any]) -> DryFriction | None:
    """Return the dry friction of hinge and mesh, as far as they are in the scenario."""
    static_hinge = terms.static_couple * terms.sun_planet_ratio
    kinetic_hinge = terms.kinetic_couple * terms.sun_planet_ratio
    lever, weight = terms.arm * terms.planet_speed_ratio, terms.planet_weight
    scale = terms.gravity_moment + static_hinge + lever * weight
    parts = {"hinge": terms.hinge is not None, "mesh": terms.rolls}
    if not any(parts.values()):
        return None
    return DryFriction(
        "+".join(name for name, is_there in parts.items() if is_there),
        static_limit=total(
            (lambda torque, angle: static_hinge) if parts["hinge"] else None,
            (lambda torque, angle: lever * abs(weight * sin(angle))) if parts["mesh"] else None,
        ),
        kinetic_limit=total(
            (lambda torque, angle, velocity, direction: kinetic_hinge) if parts["hinge"] else None,
            (lambda torque, angle, velocity, direction: lever * terms.mesh_load(angle, velocity))
            if parts["mesh"]
            else None,
        ),
        roundoff=lambda torque, angle: ROUNDING * (abs(torque) + scale),
        **law,
    )


def switching_surfaces(terms: EquationTerms) -> tuple[SwitchingSurface, ...]:
    """Return where the load of the rolling friction, an absolute value, is zero."""
    if not terms.rolls:
        return ()
    if terms.radial:
        return (SwitchingSurface(terms.radial_balance),)
    return (SwitchingSurface(every=pi),)


def uniform_torque_mean(scenario: EpicyclicScenario, speed: float) -> float:
    """Return the mean torque over a turn for uniform forward rotation of the crank, N m.

    speed = 0 is the limit of slow rotation; with `radial` the torque depends on the speed.
    Gravity has no mean. Eq 28 as published: M_A lambda. Consistent: M_A r1/r2 + f <N> lambda, with
    <|a sin phi - b|> = b for b >= a, else 2/pi (sqrt(a^2 - b^2) + b asin(b/a)), where a = G_2 and
    b = m_2 L phi'^2 (`radial`, at the given speed) or 0 (`weight`).

    Parameters
    ----------
    scenario : EpicyclicScenario
    speed : float, rad/s
    """
    terms = EquationTerms(scenario)
    if scenario.mechanism.formulation == "published":
        return terms.kinetic_couple * terms.planet_speed_ratio
    a, b = terms.planet_weight, 0.0
    if terms.radial:
        b = terms.planet_mass * terms.length * speed * speed
    load = b if b >= a else 2.0 / pi * (sqrt(a * a - b * b) + b * asin(b / a))
    return (
        terms.kinetic_couple * terms.sun_planet_ratio + terms.arm * load * terms.planet_speed_ratio
    )
