"""The equation of motion of a body on a shaft, as data with the terms of its effects."""

from array import array
from collections.abc import Sequence
from math import radians
from sys import float_info
from typing import Any, NamedTuple

from frictionsim.mechanisms.effects import (
    Damping,
    Journal,
    damping_of,
    journal_of,
    with_damping,
    with_damping_power,
)
from frictionsim.mechanisms.shaft.loads import (
    COUPLE,
    OVER,
    ROW,
    TIME,
    Arms,
    Load,
    Loads,
    TableKnots,
    Triple,
    arms_in,
    arms_of_weight,
    knots_of,
    largest_curvature,
    loads_in,
    middle_and_range,
    size_of,
)
from frictionsim.mechanisms.shaft.schema import Couple, Force, ShaftScenario
from frictionsim.mechanisms.single_dof import cos, kinetic_energy_of, sin, sqrt
from frictionsim.scenario.signal_tables import AngleTable, SpeedTable, signal_from
from frictionsim.scenario.signals import Constant, PiecewiseLinear, Signal
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.mechanism import EndStops, Value, stop_torque
from frictionsim.solvers.root_finding import time_of_excess

# Torque and limit are sums of products: a few roundings of each, and of numbers below the smallest
# normal one all digits.
ROUNDING = 16 * float_info.epsilon
SMALLEST = float_info.min


class LoadAndTurn(NamedTuple):
    """Torque, N m, components of the force, N, cosine and sine of the angle."""

    torque: Value
    x: Value
    y: Value
    cosine: Value
    sine: Value


class Spring(NamedTuple):
    """A torsion spring: a torque -k (q - q_0)."""

    k: float
    q_0: float


class EccentricMass(NamedTuple):
    """The load of the shaft while a body with an eccentric mass slides on it.

    With p = m e, it has the components A_t - p dw/dt along the path of the mass and A_n across it,
    A_n with the centrifugal force. From I dw/dt = M - s K and K = r_k R follows

        K = r_k (I S + s r_k p D)/(I^2 - r_k^2 p^2),   D = I A_t - p M,
        S^2 = D^2 + (I^2 - r_k^2 p^2) A_n^2

    Attributes
    ----------
    p : float, kg m
        First moment of the eccentric mass.
    x, y : float
        Its direction from the axis at q = 0, a unit vector.
    determinant : float, kg^2 m^4
        I^2 - r_k^2 p^2.
    """

    p: float
    x: float
    y: float
    determinant: float

    def direction(self, c: Value, s: Value) -> tuple[Value, Value]:
        """Return the unit vector from the axis to the mass, by cosine and sine of the angle."""
        return self.x * c - self.y * s, self.x * s + self.y * c


class EccentricWeight(NamedTuple):
    """The moment of an eccentric mass under gravity: cosine cos q + sine sin q, N m."""

    cosine: float
    sine: float


class Shaft(NamedTuple):
    """I dw/dt = M - k (q - q_0) - b w + T; u is the time, and M the moment of loads and weights.

    Attributes
    ----------
    reversing_load : tuple of bool
        Not empty if the load of the shaft may reverse.
    """

    drive: Loads
    inertia: float
    journal: tuple[Journal, ...]
    weight: tuple[EccentricWeight, ...]
    eccentric: tuple[EccentricMass, ...]
    spring: tuple[Spring, ...]
    damping: tuple[Damping, ...]
    stops: tuple[EndStops, ...]
    surfaces: tuple[TableKnots, ...]
    reversing_load: tuple[bool, ...]
    breaks: "array[float]"

    def torque_and_force(
        self, time: Value, angle: Value, velocity: Value
    ) -> tuple[Value, Value, Value]:
        """Return the torque of all but friction and stops, N m, and the resultant of forces, N."""
        moment, x, y, c, s = self.drive.resultant(time, angle, velocity)
        return _with_effects(self, moment, (angle, c, s), velocity), x, y

    def applied_torque(self, time: Value, angle: Value, velocity: Value) -> Value:
        """Return the torque of all but dry friction, N m."""
        torque, _, _ = self.torque_and_force(time, angle, velocity)
        return _with_stop(self.stops, torque, angle, velocity)

    def static_limit(self, time: Value, angle: Value) -> Value:
        """Return r_s R, N m."""
        _, x, y, _, _ = self.drive.resultant(time, angle, 0.0)
        return self.journal[0].r_s * sqrt(x * x + y * y)

    def kinetic_limit(self, time: Value, angle: Value, velocity: Value, s: Value) -> Value:
        """Return r_k R while sliding in direction s, N m."""
        _, limit, _ = self.torques_and_powers(time, angle, velocity, s)
        return limit

    def torques_and_powers(
        self, time: Value, angle: Value, velocity: Value, s: Value
    ) -> tuple[Value, Value, tuple[Value, ...]]:
        """Return the applied torque, its kinetic limit, N m, and the powers, W."""
        moment, x, y, cosine, sine = self.drive.resultant(time, angle, velocity)
        torque = _with_effects(self, moment, (angle, cosine, sine), velocity)
        load = LoadAndTurn(torque, x, y, cosine, sine)
        limit = _kinetic_limit(self.eccentric, self, load, velocity, s)
        applied = _with_stop(self.stops, torque, angle, velocity)
        return applied, limit, _powers(self, moment, velocity)

    def powers(self, time: Value, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the powers of the loads, of damping and of the stops, W."""
        moment, _, _, _, _ = self.drive.resultant(time, angle, velocity)
        powers: tuple[Value, ...] = _powers(self, moment, velocity)
        return powers

    def contact_load(self, time: float, angle: float, velocity: float) -> tuple[float, float]:
        """Return a vector in proportion to the load of the shaft while it slides.

        That of an eccentric mass passes zero in no more than single points of a run, but it passes
        close to it, and friction has then all but a corner.
        """
        moment, x, y, c, s = self.drive.resultant(time, angle, velocity)
        torque = _with_effects(self, moment, (angle, c, s), velocity)
        load = LoadAndTurn(torque, x, y, c, s)
        sliding: tuple[float, float] = _sliding_load(self.eccentric, self, load, velocity)
        return sliding

    def roundoff(self, time: Value, angle: Value) -> Value:
        """Return the roundoff of the torque and its limit at rest, N m."""
        return ROUNDING * self.terms(time, angle) + SMALLEST

    def terms(self, time: Value, angle: Value) -> Value:
        """Return the sum of the terms of torque and limit at rest, N m."""
        return _with_spring_size(self.spring, self.drive.sizes(time, angle), angle)

    def stored_energies(self, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the kinetic energy, and the potential one of eccentric mass and spring, J."""
        kinetic = kinetic_energy_of(self.inertia, velocity)
        energies: tuple[Value, ...] = _with_potential(self.weight, self.spring, kinetic, angle)
        return energies

    def first_excess(self, angle: float, begin: float, end: float) -> float:
        """Return a time up to which the torque at rest exceeds its limit at most once, s."""
        r_s, closed = self.journal[0].r_s, _closed_direction(self.stops, angle)
        # At once, however many periods the loads have until then.
        forward = closed != 1.0 and largest_excess(self, r_s, 1.0, angle, begin, end) >= 0.0
        backward = closed != -1.0 and largest_excess(self, r_s, -1.0, angle, begin, end) >= 0.0
        if forward:
            end = _first_excess(self, r_s, 1.0, angle, begin, end)
        if backward:
            end = _first_excess(self, r_s, -1.0, angle, begin, end)
        return end

    def first_departure(self, angle: float, begin: float, end: float) -> float:
        """Return a time up to which the torque on a body on a stop turns away at most once, s."""
        s = -_closed_direction(self.stops, angle)
        if largest_excess(self, 0.0, s, angle, begin, end) < 0.0:
            return end
        return _first_excess(self, 0.0, s, angle, begin, end)


@compilable
def _with_effects(shaft: Shaft, moment: Value, turned: Triple, velocity: Value) -> Value:
    """Return the moment of the loads with the torques of weight, spring and damping, N m.

    `turned` are the angle, its cosine and its sine.
    """
    angle, c, s = turned
    torque = _with_spring(shaft.spring, _with_weight(shaft.weight, moment, c, s), angle)
    return with_damping(torque, shaft.damping, velocity)


@compilable
def _powers(shaft: Shaft, moment: Value, velocity: Value) -> Any:
    powers = with_damping_power((moment * velocity,), shaft.damping, velocity)
    return _with_impacts(shaft.stops, powers)


@compilable
def _with_weight(weight: tuple[EccentricWeight, ...], moment: Value, c: Value, s: Value) -> Value:
    if len(weight) == 0:
        return moment
    return moment + (weight[0].cosine * c + weight[0].sine * s)


@compilable
def _with_spring(spring: tuple[Spring, ...], moment: Value, angle: Value) -> Value:
    if len(spring) == 0:
        return moment
    return moment - spring[0].k * (angle - spring[0].q_0)


@compilable
def _with_spring_size(spring: tuple[Spring, ...], terms: Value, angle: Value) -> Value:
    if len(spring) == 0:
        return terms
    return terms + spring[0].k * abs(angle - spring[0].q_0)


@compilable
def _with_stop(stops: tuple[EndStops, ...], torque: Value, angle: Value, velocity: Value) -> Value:
    if len(stops) == 0:
        return torque
    return torque + stop_torque(stops[0], torque, angle, velocity)


@compilable
def _with_impacts(stops: tuple[EndStops, ...], powers: Any) -> Any:
    if len(stops) == 0:
        return powers
    return (*powers, 0.0)


@compilable
def _with_potential(
    weight: tuple[EccentricWeight, ...], spring: tuple[Spring, ...], kinetic: Value, angle: Value
) -> Any:
    if len(weight) == 0:
        if len(spring) == 0:
            return (kinetic,)
        return kinetic, _energy_of(spring[0], angle)
    raised = weight[0].sine * cos(angle) - weight[0].cosine * sin(angle)
    if len(spring) == 0:
        return kinetic, raised
    return kinetic, raised + _energy_of(spring[0], angle)


@compilable
def _energy_of(spring: Spring, angle: Value) -> Value:
    turned = angle - spring.q_0
    return 0.5 * spring.k * turned * turned


@compilable
def _closed_direction(stops: tuple[EndStops, ...], angle: float) -> float:
    """Return the direction in which a stop keeps the body from turning; 0 for none."""
    if len(stops) == 0:
        return 0.0
    return 1.0 if angle >= stops[0].highest else -1.0 if angle <= stops[0].lowest else 0.0


@compilable
def _kinetic_limit(
    eccentric: tuple[EccentricMass, ...],
    shaft: Shaft,
    load: LoadAndTurn,
    velocity: Value,
    s: Value,
) -> Value:
    r_k = shaft.journal[0].r_k
    if len(eccentric) == 0:
        return r_k * sqrt(load.x * load.x + load.y * load.y)
    p, determinant = eccentric[0].p, eccentric[0].determinant
    difference, normal, _, _ = _along_and_across(eccentric[0], shaft, load, velocity)
    root = sqrt(difference * difference + determinant * normal * normal)
    return r_k * (shaft.inertia * root + s * r_k * p * difference) / determinant


@compilable
def _along_and_across(
    eccentric: EccentricMass, shaft: Shaft, load: LoadAndTurn, velocity: Value
) -> tuple[Value, Value, Value, Value]:
    """Return D and A_n, and cosine and sine of the azimuth of the mass."""
    torque, x, y, cosine, sine = load
    c, d = eccentric.direction(cosine, sine)
    normal = x * c + y * d + eccentric.p * velocity * velocity
    return shaft.inertia * (y * c - x * d) - eccentric.p * torque, normal, c, d


@compilable
def _sliding_load(
    eccentric: tuple[EccentricMass, ...],
    shaft: Shaft,
    load: LoadAndTurn,
    velocity: float,
) -> tuple[float, float]:
    if len(eccentric) == 0:
        return load.x, load.y
    along, normal, c, d = _along_and_across(eccentric[0], shaft, load, velocity)
    across = sqrt(eccentric[0].determinant) * normal
    return across * c - along * d, across * d + along * c


@compilable
class Excess(NamedTuple):
    """The torque at rest beyond its limit and its roundoff, as a function of time, N m."""

    shaft: Shaft
    r_s: float
    s: float
    angle: float

    def at(self, t: float) -> float:
        """Return the excess at a time, s."""
        torque, x, y = self.shaft.torque_and_force(t, self.angle, 0.0)
        limit = self.r_s * sqrt(x * x + y * y) + self.shaft.roundoff(t, self.angle)
        return self.s * torque - limit

    def slope(self, t: float) -> float:
        """Return the derivative after a time, N m/s; the roundoff counts as constant."""
        moment, dx, dy = self.shaft.drive.rates(t, self.angle)
        _, x, y, _, _ = self.shaft.drive.resultant(t, self.angle, 0.0)
        size = sqrt(x * x + y * y)
        growth = (x * dx + y * dy) / size if size > 0.0 else sqrt(dx * dx + dy * dy)
        return self.s * moment - self.r_s * growth


@compilable
def _first_excess(
    shaft: Shaft, r_s: float, s: float, angle: float, begin: float, end: float
) -> float:
    loads, curvature = shaft.drive, 0.0
    for k in range(0, len(loads.rows), ROW):
        if loads.rows[k + OVER] == TIME:
            moment, x, y = arms_in(loads.rows, k).at(angle)
            arm = abs(moment) + r_s * sqrt(x * x + y * y)
            curvature += largest_curvature(loads, k, begin, end) * arm
    excess, tie = Excess(shaft, r_s, s, angle), shaft.roundoff(begin, angle)
    return time_of_excess(excess, curvature, begin, end, tie)


@compilable
def largest_excess(
    shaft: Shaft, r_s: float, s: float, angle: float, begin: float, end: float
) -> float:
    """Return a bound of the excess of torque over limit at rest between two times, N m.

    The signals are smooth between the times.
    """
    loads, slack = shaft.drive, 0.0
    applied, x, y = shaft.torque_and_force(begin, angle, 0.0)
    for k in range(0, len(loads.rows), ROW):
        if loads.rows[k + OVER] == TIME:
            moment, dx, dy = arms_in(loads.rows, k).at(angle)
            middle, bound = middle_and_range(loads, k, begin, end)
            change = middle - size_of(loads.rows, loads.pieces, k, begin, angle, 0.0)
            applied, x, y = applied + change * moment, x + change * dx, y + change * dy
            slack += bound * (abs(moment) + r_s * sqrt(dx * dx + dy * dy))
    return s * applied - r_s * sqrt(x * x + y * y) + slack


def loads_of(scenario: ShaftScenario) -> list[Load]:
    """Return all forces and couples but the weights."""
    loads = [load_of(force, force.arms) for force in scenario.forces]
    return loads + [load_of(couple, COUPLE) for couple in scenario.couples]


def load_of(part: Force | Couple, arms: Arms) -> Load:
    """Return the load of a table of the scenario."""
    size = part.size
    if isinstance(size, SpeedTable):
        return Load(arms, _points(size.speed, size.value), "speed")
    if isinstance(size, AngleTable):
        return Load(arms, _points([radians(x) for x in size.angle_deg], size.value), "angle")
    return Load(arms, signal_from(size))


def _points(x: Sequence[float], values: Sequence[float]) -> Signal:
    return Constant(values[0]) if len(set(values)) == 1 else PiecewiseLinear(x, values)


def weights_of(scenario: ShaftScenario) -> list[Load]:
    """Return the weights of the body and of its eccentric mass."""
    gravity, eccentric = scenario.effects.gravity, scenario.effects.eccentric_mass
    if gravity is None:
        return []
    loads = [Load(arms_of_weight(0.0, 0.0), Constant(scenario.mechanism.mass * gravity.g))]
    if eccentric is not None:
        arms = arms_of_weight(eccentric.radius, radians(eccentric.azimuth_deg))
        loads.append(Load(arms, Constant(eccentric.mass * gravity.g)))
    return loads


def shaft_of(scenario: ShaftScenario) -> Shaft:
    """Return the equation with the terms of the effects in the scenario."""
    effects, loads, weights = scenario.effects, loads_of(scenario), weights_of(scenario)
    spring, stops, eccentric = effects.torsion_spring, effects.end_stops, effects.eccentric_mass
    journal, inertia = journal_of(effects.shaft_friction), scenario.inertia
    r_s, r_k = journal[0] if journal else Journal(0.0, 0.0)
    driving, weight = loads_in(loads, r_s), loads_in(weights, r_s)
    (_, x, y), (cosine, *_), (sine, *_) = weight.constant
    all_loads = driving._replace(
        constant=driving.constant.plus(Arms((0.0, x, y))), scale=driving.scale + weight.scale
    )
    p = eccentric.first_moment if eccentric else 0.0
    azimuth = radians(eccentric.azimuth_deg) if eccentric else 0.0
    mass = EccentricMass(p, cos(azimuth), sin(azimuth), (inertia - r_k * p) * (inertia + r_k * p))
    fixed, turning, _ = all_loads.constant
    varies = any(any(triple[1:]) for load in loads if not load.is_constant for triple in load.arms)
    reverses = journal and (p or varies or (any(fixed[1:]) and any(turning[1:])))
    return Shaft(
        all_loads,
        inertia,
        journal,
        weight=(EccentricWeight(cosine, sine),) if effects.gravity and eccentric else (),
        eccentric=(mass,) if p else (),
        spring=(Spring(spring.stiffness, radians(spring.free_angle_deg)),) if spring else (),
        damping=damping_of(effects.viscous_damping),
        stops=(EndStops(stops.lowest, stops.highest, stops.restitution, stops.capture_speed),)
        if stops
        else (),
        surfaces=knots_of(loads),
        reversing_load=(True,) if reverses else (),
        breaks=array("d"),
    )


def load_on_shaft(
    shaft: Shaft, time: Value, angle: Value, velocity: Value, acceleration: Value
) -> tuple[Value, Value]:
    """Return the force of the body on the shaft, components to the right and upwards, N."""
    _, x, y, cosine, sine = shaft.drive.resultant(time, angle, velocity)
    if not shaft.eccentric:
        return x, y
    p, (c, s) = shaft.eccentric[0].p, shaft.eccentric[0].direction(cosine, sine)
    outward, along = p * velocity * velocity, -p * acceleration
    return (
        x + outward * c - along * s,
        y + outward * s + along * c,
    )


def turns_with_body(scenario: ShaftScenario, shaft: Shaft) -> bool:
    """Return whether a moment or a component of a force depends on the angle of the body."""
    variable = [load for load in loads_of(scenario) if not load.is_constant]
    return (
        bool(shaft.eccentric)
        or shaft.drive.constant.turn
        or any(any(weight) for weight in shaft.weight)
        or any(load.arms.turn or load.over == "angle" for load in variable)
    )
