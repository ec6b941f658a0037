"""The equation of an epicyclic gear, `consistent` or `published`, and the terms that it is of."""

from array import array
from math import asin, pi, sqrt
from sys import float_info
from typing import Any, NamedTuple

from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.mechanisms.epicyclic.tracer_point import (
    count_cusps,
    longest_dwell,
    tracer_position,
)
from frictionsim.mechanisms.single_dof import (
    MultiplesOf,
    cos,
    kinetic_energy_of,
    set_up,
    sin,
)
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.scenario.signals import Curve, Signal, curve_of
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.mechanism import Mechanism, Trajectory, Value, equation_of, friction_of

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
        lever = self.arm * self.planet_speed_ratio
        self.mesh: Any = (
            MeshUnderRadialLoad(lever, self.planet_weight, self.planet_mass, self.length)
            if self.radial
            else MeshUnderWeight(lever, self.planet_weight)
        )


def build(scenario: EpicyclicScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    terms, geometry = EquationTerms(scenario), scenario.mechanism
    prescribed = scenario.drive.speed is not None
    table = scenario.drive.speed if prescribed else scenario.drive.torque
    signal = signal_from(table)  # type: ignore[arg-type]
    stored = ("energy_kinetic", "energy_potential")[: 2 if scenario.effects.gravity else 1]
    gear: Any
    if geometry.formulation == "published":
        gear, contact = published_gear_of(terms, scenario), None
        flows = ("energy_input", "energy_friction")[: 2 if gear.is_dissipative else 1]
        equation = equation_of(gear, flows, stored, is_compiled=False)
    else:
        gear = gear_of(terms, scenario, signal)
        equation = equation_of(gear, ("energy_input",), stored)
        contact = contact_of(terms, gear, scenario.law_of_contact.law_of_contact())

    def uniform_torque(angle: Value, velocity: Value) -> Value:
        opposed = contact.kinetic_limit(0.0, angle, velocity, 1) if contact else 0.0
        return opposed - gear.applied_torque(0.0, angle, velocity)

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        angle, velocity = trajectory.position, trajectory.velocity
        values = {
            "drive_torque": trajectory.drive,
            "uniform_torque": uniform_torque(angle, velocity),
        }
        if terms.rolling is not None:
            values["normal_load"] = terms.mesh.normal_load(angle, velocity)
        if isinstance(gear, PublishedGear) and gear.is_dissipative:
            values["friction_torque"] = -gear.resistance(angle)
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
            radii = geometry.sun_radius, geometry.planet_radius
            cusps = count_cusps(*radii, point, trajectory.position)
            motion = trajectory.time, trajectory.position, trajectory.velocity
            dwell = longest_dwell(*radii, point, motion)
            values["tracer_cusps"] = Quantity(cusps, "1")
            values["tracer_dwell_time"] = Quantity(dwell and dwell.time, "s")
        return values

    def run_warnings(trajectory: Trajectory) -> list[str]:
        from frictionsim.simulation.run_warnings import (  # imports numpy, not needed by `check`
            against_drive,
            hidden_turns,
        )

        back = (
            ""
            if prescribed
            else against_drive(trajectory.time, trajectory.drive, trajectory.position)
        )
        warnings = [f"the crank {back}: weight or initial velocity prevailed"] if back else []
        duration, interval = scenario.solver.duration, scenario.interval
        return warnings + hidden_turns(trajectory.position, trajectory.velocity, interval, duration)

    return Mechanism(
        drive=signal,
        contact=contact,
        **equation,
        channels=channels,
        quantities=quantities,
        run_warnings=run_warnings,
        prescribed=prescribed,
        **set_up(scenario) | ({"velocity": signal(0.0)} if prescribed else {}),
    )


class Weight(NamedTuple):
    """The weights of crank and planet: their largest moment k, N m."""

    k: float


class Hinge(NamedTuple):
    """The couples of the hinge, on the crank, N m."""

    static: float
    kinetic: float


class MeshUnderWeight(NamedTuple):
    """The rolling friction at the mesh under the weight G_2, with the lever f lambda."""

    lever: float
    weight: float

    def limit_at_rest(self, angle: Value) -> Value:
        """Return f lambda N at rest, N m."""
        return self.lever * abs(self.weight * sin(angle))

    def limit(self, angle: Value, velocity: Value) -> Value:
        """Return f lambda N, N m."""
        return self.lever * self.normal_load(angle, velocity)

    def normal_load(self, angle: Value, velocity: Value) -> Value:
        """Return N, in N."""
        return abs(self.weight * sin(angle))


class MeshUnderRadialLoad(NamedTuple):
    """The rolling friction at the mesh under weight and centripetal force, m_2 L = inertia."""

    lever: float
    weight: float
    mass: float
    length: float

    def limit_at_rest(self, angle: Value) -> Value:
        """Return f lambda N at rest, N m."""
        return self.lever * abs(self.weight * sin(angle))

    def limit(self, angle: Value, velocity: Value) -> Value:
        """Return f lambda N, N m."""
        return self.lever * self.normal_load(angle, velocity)

    def normal_load(self, angle: Value, velocity: Value) -> Value:
        """Return N, in N."""
        return abs(self.balance(angle, velocity))

    def balance(self, angle: Value, velocity: Value) -> Value:
        """Return G_2 sin phi - m_2 L phi'^2, N."""
        return self.weight * sin(angle) - self.mass * self.length * velocity * velocity


class RadialBalance(NamedTuple):
    """The switching surface on which the radial load is zero."""

    mesh: MeshUnderRadialLoad
    event: str = ""
    is_event: bool = False
    is_of_table: bool = False

    def beyond(self, q0: float, v0: float, q1: float, q: float, v: float) -> float:
        """Return a number that is positive beyond the surface, in a step from (q0, v0)."""
        return -self.mesh.balance(q0, v0) * self.mesh.balance(q, v)


class EpicyclicGear(NamedTuple):
    """The consistent equation: I phi'' = torque - k cos phi + T, T of hinge and mesh."""

    drive: Curve
    inertia: float
    scale: float
    gravity: tuple[Weight, ...]
    hinge: tuple[Hinge, ...]
    mesh: tuple[MeshUnderWeight, ...] | tuple[MeshUnderRadialLoad, ...]
    breaks: "array[float]"
    surfaces: tuple[MultiplesOf, ...] | tuple[RadialBalance, ...]
    stops: tuple[Any, ...] = ()
    reversing_load: tuple[Any, ...] = ()

    def applied_torque(self, torque: Value, angle: Value, velocity: Value) -> Value:
        """Return the torque on the crank less the moment of the weights, N m."""
        return _less_weight(self.gravity, torque, angle)

    def static_limit(self, torque: Value, angle: Value) -> Value:
        """Return the limit of hinge and mesh at rest, N m."""
        return _static_mesh(self.mesh, self.hinge, angle)

    def kinetic_limit(self, torque: Value, angle: Value, velocity: Value, s: Value) -> Value:
        """Return the friction of hinge and mesh in motion, N m."""
        return _kinetic_mesh(self.mesh, self.hinge, angle, velocity)

    def roundoff(self, torque: Value, angle: Value) -> Value:
        """Return the roundoff of the torque and its limit, N m."""
        return ROUNDING * (abs(torque) + self.scale)

    def powers(self, torque: Value, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the power of the torque, W."""
        return (torque * velocity,)

    def torques_and_powers(
        self, u: Value, angle: Value, velocity: Value, s: Value
    ) -> tuple[Value, Value, tuple[Value, ...]]:
        """Return the applied torque, its kinetic limit and the powers."""
        return (
            self.applied_torque(u, angle, velocity),
            self.kinetic_limit(u, angle, velocity, s),
            self.powers(u, angle, velocity),
        )

    def stored_energies(self, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the kinetic energy, and the potential one with gravity, J."""
        kinetic = kinetic_energy_of(self.inertia, velocity)
        energies: tuple[Value, ...] = _with_weight(self.gravity, (kinetic,), angle)
        return energies

    def first_excess(self, angle: float, a: float, b: float) -> float:
        """Return b: at rest the limits are constant."""
        return b


@compilable
def _less_weight(gravity: tuple[Weight, ...], torque: Value, angle: Value) -> Value:
    if len(gravity) == 0:
        return torque
    return torque - gravity[0].k * cos(angle)


@compilable
def _with_weight(gravity: tuple[Weight, ...], energies: Any, angle: Value) -> Any:
    if len(gravity) == 0:
        return energies
    return (*energies, gravity[0].k * sin(angle))


@compilable
def _static_mesh(mesh: Any, hinge: tuple[Hinge, ...], angle: Value) -> Value:
    if len(mesh) == 0:
        return hinge[0].static
    return _plus_static(hinge, mesh[0].limit_at_rest(angle))


@compilable
def _plus_static(hinge: tuple[Hinge, ...], limit: Value) -> Value:
    if len(hinge) == 0:
        return limit
    return hinge[0].static + limit


@compilable
def _kinetic_mesh(mesh: Any, hinge: tuple[Hinge, ...], angle: Value, velocity: Value) -> Value:
    if len(mesh) == 0:
        return hinge[0].kinetic
    return _plus_kinetic(hinge, mesh[0].limit(angle, velocity))


@compilable
def _plus_kinetic(hinge: tuple[Hinge, ...], limit: Value) -> Value:
    if len(hinge) == 0:
        return limit
    return hinge[0].kinetic + limit


def gear_of(terms: EquationTerms, scenario: EpicyclicScenario, signal: Signal) -> EpicyclicGear:
    """Return the consistent equation with the terms of the effects."""
    static_hinge = terms.static_couple * terms.sun_planet_ratio
    mesh: tuple[Any, ...] = ()
    surfaces: tuple[Any, ...] = ()
    if terms.rolls and terms.radial:
        mesh, surfaces = (terms.mesh,), (RadialBalance(terms.mesh),)
    elif terms.rolls:
        mesh, surfaces = (terms.mesh,), (MultiplesOf(pi, is_event=False),)
    return EpicyclicGear(
        curve_of(signal),
        scenario.mechanism.inertia,
        terms.gravity_moment + static_hinge + terms.mesh.lever * terms.planet_weight,
        gravity=(Weight(terms.gravity_moment),) if scenario.effects.gravity else (),
        hinge=(Hinge(static_hinge, terms.kinetic_couple * terms.sun_planet_ratio),)
        if terms.hinge
        else (),
        mesh=mesh,
        breaks=array("d"),
        surfaces=surfaces,
    )


class ConstantCouple(NamedTuple):
    """M_A lambda, N m."""

    couple: float

    def at(self, angle: Value) -> Value:
        """Return it."""
        return self.couple


class PublishedRolling(NamedTuple):
    """f G_2 sin phi lambda, N m, with the largest one."""

    largest: float

    def at(self, angle: Value) -> Value:
        """Return it at an angle."""
        return self.largest * sin(angle)


class PublishedGear(NamedTuple):
    """Eq 26: I phi'' = torque - k cos phi - M_A lambda - f G_2 sin phi lambda, in any direction."""

    inertia: float
    gravity: tuple[Weight, ...]
    resistances: tuple[ConstantCouple | PublishedRolling, ...]
    is_dissipative: bool
    surfaces: tuple[Any, ...] = ()

    def resistance(self, angle: Value) -> Value:
        """Return M_A lambda + f G_2 sin phi lambda, as far as they are there, N m."""
        first, *others = [part.at(angle) for part in self.resistances]
        return first + others[0] if others else first

    def applied_torque(self, torque: Value, angle: Value, velocity: Value) -> Value:
        """Return the torque on the crank, N m."""
        driving: Value = _less_weight(self.gravity, torque, angle)
        return driving - self.resistance(angle)

    def powers(self, torque: Value, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the power of the torque and, with friction, of the resistance, W."""
        if not self.is_dissipative:
            return (torque * velocity,)
        return torque * velocity, self.resistance(angle) * velocity

    def stored_energies(self, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the kinetic energy, and the potential one with gravity, J."""
        kinetic = kinetic_energy_of(self.inertia, velocity)
        energies: tuple[Value, ...] = _with_weight(self.gravity, (kinetic,), angle)
        return energies


def published_gravity_moment(terms: EquationTerms) -> float:
    """Return the moment of the weights of eq 26, (G_OA/2 + 2 G_2) L, N m: the planet's twice."""
    return terms.gravity_moment + terms.planet_weight * terms.length


def published_gear_of(terms: EquationTerms, scenario: EpicyclicScenario) -> PublishedGear:
    """Return the equation as published with the terms of the effects."""
    couple = terms.kinetic_couple * terms.planet_speed_ratio
    rolling = terms.arm * terms.planet_weight * terms.planet_speed_ratio
    k = published_gravity_moment(terms)
    constant = (ConstantCouple(couple),) if terms.hinge or not terms.rolls else ()
    return PublishedGear(
        scenario.mechanism.inertia,
        gravity=(Weight(k),) if scenario.effects.gravity else (),
        resistances=(*constant, *((PublishedRolling(rolling),) if terms.rolls else ())),
        is_dissipative=terms.hinge is not None or terms.rolls,
    )


def contact_of(terms: EquationTerms, gear: EpicyclicGear, law: dict[str, Any]) -> Any:
    """Return the dry friction of hinge and mesh, as far as they are in the scenario."""
    parts = {"hinge": terms.hinge is not None, "mesh": terms.rolls}
    name = "+".join(name for name, is_there in parts.items() if is_there)
    return friction_of(gear, name, law) if name else None


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
