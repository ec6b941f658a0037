"""The equation of motion of a body on a shaft: its terms, dry friction, energies, end stops."""

from collections.abc import Callable, Sequence
from math import hypot, radians
from sys import float_info
from typing import Any, NamedTuple

from frictionsim.mechanisms.shaft.loads import (
    COUPLE,
    Arms,
    Load,
    Loads,
    Size,
    arms_of_weight,
    largest_curvature,
    middle_and_range,
)
from frictionsim.mechanisms.shaft.schema import Couple, Force, ShaftScenario
from frictionsim.mechanisms.single_dof import cos, sin, total
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_tables import AngleTable, SpeedTable, signal_from
from frictionsim.scenario.signals import Constant, PiecewiseLinear, Signal
from frictionsim.solvers.end_stops import EVENT
from frictionsim.solvers.first_excess import time_of_excess
from frictionsim.solvers.mechanism import DryFriction, EndStops, Trajectory, Value

CONTACT_NAME = "shaft"

# Torque and limit are sums of products: a few roundings of each, and of numbers below the smallest
# normal one all digits.
ROUNDING = 16 * float_info.epsilon
SMALLEST = float_info.min

# A run with more impacts has a capture speed that is far below the speeds of its motion.
MANY_IMPACTS = 1000


def loads_of(scenario: ShaftScenario) -> list[Load]:
    """Return all forces and couples, weights included."""
    loads = [load_of(force, force.arms) for force in scenario.forces]
    loads += [load_of(couple, COUPLE) for couple in scenario.couples]
    return loads + weights_of(scenario)


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


class EquationTerms(NamedTuple):
    """The terms of the equation of motion.

    Attributes
    ----------
    loads : Loads
    moment : callable, N m
        Of forces and couples.
    applied_torque : callable, N m
        Of all but dry friction.
    across, up : callable, N
        Components of the resultant of all forces.
    """

    loads: Loads
    moment: Size
    applied_torque: Size
    across: Size
    up: Size


def terms_of(scenario: ShaftScenario) -> EquationTerms:
    """Return the terms of the effects in the scenario."""
    journal = scenario.effects.shaft_friction
    loads = Loads(loads_of(scenario), journal.static_radius if journal else 0.0)
    moment = loads.component(0)
    applied = total(moment, spring_of(scenario), damping_of(scenario))
    return EquationTerms(loads, moment, applied, loads.component(1), loads.component(2))


def spring_of(scenario: ShaftScenario) -> Size | None:
    """Return the torque of the torsion spring, N m; None without one."""
    spring = scenario.effects.torsion_spring
    if spring is None:
        return None
    k, free = spring.stiffness, radians(spring.free_angle_deg)
    return lambda time, angle, velocity: -k * (angle - free)


def damping_of(scenario: ShaftScenario) -> Size | None:
    """Return the torque of viscous damping, N m; None without it."""
    damping = scenario.effects.viscous_damping
    if damping is None:
        return None
    b = damping.coefficient
    return lambda time, angle, velocity: -b * velocity


def load_on_shaft(
    scenario: ShaftScenario, terms: EquationTerms, trajectory: Trajectory
) -> tuple[Value, Value]:
    """Return the force of the body on the shaft, components to the right and upwards, N."""
    time, angle, velocity = trajectory.drive, trajectory.position, trajectory.velocity
    x, y = terms.across(time, angle, velocity), terms.up(time, angle, velocity)
    eccentric = scenario.effects.eccentric_mass
    if eccentric is None:
        return x, y
    azimuth, p = angle + radians(eccentric.azimuth_deg), eccentric.first_moment
    outward, along = p * velocity * velocity, -p * trajectory.acceleration
    return (
        x + outward * cos(azimuth) - along * sin(azimuth),
        y + outward * sin(azimuth) + along * cos(azimuth),
    )


def potential_of(scenario: ShaftScenario) -> Any:
    """Return the potential energy of angle and velocity, J; None without weight and spring."""
    gravity, eccentric = scenario.effects.gravity, scenario.effects.eccentric_mass
    spring, terms = scenario.effects.torsion_spring, []
    if gravity is not None and eccentric is not None:
        lift, azimuth = eccentric.first_moment * gravity.g, radians(eccentric.azimuth_deg)
        terms.append(lambda angle, velocity: lift * sin(angle + azimuth))
    if spring is not None:
        k, free = spring.stiffness, radians(spring.free_angle_deg)
        terms.append(lambda angle, velocity: 0.5 * k * (angle - free) * (angle - free))
    return total(*terms) if terms else None


def contact_of(
    scenario: ShaftScenario, terms: EquationTerms, stops: EndStops | None = None
) -> DryFriction:
    """Return the dry friction of the journal; from an end stop it breaks away in one direction."""
    journal = scenario.effects.shaft_friction
    assert journal is not None  # checked by the caller
    r_s, across, up = journal.static_radius, terms.across, terms.up

    def static_limit(time: Value, angle: Value) -> Value:
        x, y = across(time, angle, 0.0), up(time, angle, 0.0)
        return r_s * (x * x + y * y) ** 0.5

    def directions(angle: float) -> tuple[int, ...]:
        closed = 0 if stops is None else stops.side(angle)
        return tuple(s for s in (1, -1) if s != closed)

    return DryFriction(
        name=CONTACT_NAME,
        static_limit=static_limit,
        kinetic_limit=_kinetic_limit(scenario, terms, journal.kinetic_radius),
        roundoff=_roundoff(scenario, terms),
        first_excess=first_excess_of(scenario, terms, r_s, directions),
        load=_load_that_may_reverse(scenario, terms, journal.kinetic_radius),
        **journal.law_of_contact(),
    )


def scale_of(scenario: ShaftScenario, terms: EquationTerms) -> Any:
    """Return the sum of the terms of the applied torque and its limit at rest, N m."""
    loads, spring = terms.loads, scenario.effects.torsion_spring
    k = 0.0 if spring is None else spring.stiffness
    free = 0.0 if spring is None else radians(spring.free_angle_deg)

    def scale(time: Value, angle: Value) -> Value:
        return loads.scale(time, angle) + k * abs(angle - free)

    return scale


def _roundoff(scenario: ShaftScenario, terms: EquationTerms) -> Any:
    """Return the roundoff of the applied torque and its limit at rest, N m."""
    scale = scale_of(scenario, terms)

    def roundoff(time: Value, angle: Value) -> Value:
        return ROUNDING * scale(time, angle) + SMALLEST

    return roundoff


def first_excess_of(
    scenario: ShaftScenario,
    terms: EquationTerms,
    r_s: float,
    directions: Callable[[float], tuple[int, ...]],
) -> Callable[[float, float, float], float]:
    """Return first_excess(q, a, b): until when the torque at rest exceeds its limit at most once.

    r_s is the friction radius, m, 0 without dry friction; `directions` gives the directions in
    which the body can move at an angle.
    """
    loads, across, up, roundoff = terms.loads, terms.across, terms.up, _roundoff(scenario, terms)
    curvatures = [(load, largest_curvature(load.size)) for load in loads.over_time]
    largest_excess = _largest_excess_of(terms, r_s)

    def first_excess(angle: float, begin: float, end: float) -> float:
        moving = [s for s in directions(angle) if largest_excess(s, angle, begin, end) >= 0.0]
        if not moving:
            return end  # at once, however many periods the loads have until then
        curvature = 0.0
        for load, bound in curvatures:
            moment, x, y = load.arms.at(angle)
            curvature += bound(begin, end) * (abs(moment) + r_s * hypot(x, y))
        tie = roundoff(begin, angle)

        for s in moving:

            def value(t: float, s: int = s) -> float:
                applied = s * terms.applied_torque(t, angle, 0.0)
                x, y = across(t, angle, 0.0), up(t, angle, 0.0)
                return applied - r_s * (x * x + y * y) ** 0.5 - roundoff(t, angle)

            def slope(t: float, s: int = s) -> float:
                moment, dx, dy = loads.rates(t, angle)
                x, y = across(t, angle, 0.0), up(t, angle, 0.0)
                size = hypot(x, y)
                growth = (x * dx + y * dy) / size if size > 0.0 else hypot(dx, dy)
                return s * moment - r_s * growth

            end = time_of_excess(value, slope, curvature, (begin, end), tie)
        return end

    return first_excess


def _largest_excess_of(
    terms: EquationTerms, r_s: float
) -> Callable[[int, float, float, float], float]:
    """Return a bound of the excess of torque over limit at rest: of direction, angle, two times.

    The signals are smooth between the times.
    """
    ranges = [(load, middle_and_range(load.size)) for load in terms.loads.over_time]

    def largest_excess(s: int, angle: float, begin: float, end: float) -> float:
        applied, slack = terms.applied_torque(begin, angle, 0.0), 0.0
        x, y = terms.across(begin, angle, 0.0), terms.up(begin, angle, 0.0)
        for load, middle_and_bound in ranges:
            moment, dx, dy = load.arms.at(angle)
            middle, bound = middle_and_bound(begin, end)
            change = middle - load.size(begin)
            applied, x, y = applied + change * moment, x + change * dx, y + change * dy
            slack += bound * (abs(moment) + r_s * hypot(dx, dy))
        excess: float = s * applied - r_s * hypot(x, y) + slack
        return excess

    return largest_excess


class SlidingLoad(NamedTuple):
    """The load of the shaft while a body with an eccentric mass slides on it.

    With p = m e, it has the components A_t - p dw/dt along the path of the mass and A_n across it,
    A_n with the centrifugal force. From I dw/dt = M - s K and K = r_k R follows

        K = r_k (I S + s r_k p D)/(I^2 - r_k^2 p^2),   D = I A_t - p M,
        S^2 = D^2 + (I^2 - r_k^2 p^2) A_n^2

    Attributes
    ----------
    terms : EquationTerms
    r_k : float, m
    p, azimuth : float, kg m, rad
        First moment of the eccentric mass, and its azimuth at q = 0.
    inertia, determinant : float, kg m^2, kg^2 m^4
        I and I^2 - r_k^2 p^2.
    """

    terms: EquationTerms
    r_k: float
    p: float
    azimuth: float
    inertia: float
    determinant: float

    def components(
        self, time: Value, angle: Value, velocity: Value
    ) -> tuple[Value, Value, Value, Value]:
        """Return D and A_n, and cosine and sine of the azimuth of the mass."""
        x, y = self.terms.across(time, angle, velocity), self.terms.up(time, angle, velocity)
        c, d = cos(angle + self.azimuth), sin(angle + self.azimuth)
        torque = self.terms.applied_torque(time, angle, velocity)
        normal = x * c + y * d + self.p * velocity * velocity
        return self.inertia * (y * c - x * d) - self.p * torque, normal, c, d

    def limit(self, time: Value, angle: Value, velocity: Value, s: Value) -> Value:
        """Return K in direction s, N m."""
        difference, normal, _, _ = self.components(time, angle, velocity)
        root = (difference * difference + self.determinant * normal * normal) ** 0.5
        r_k, p = self.r_k, self.p
        return r_k * (self.inertia * root + s * r_k * p * difference) / self.determinant

    def in_fixed_directions(
        self, time: float, angle: float, velocity: float
    ) -> tuple[float, float]:
        """Return a vector of the size S, I times the load where p is 0."""
        along, normal, c, d = self.components(time, angle, velocity)
        across: float = self.determinant**0.5 * normal
        return across * c - along * d, across * d + along * c


def _load_that_may_reverse(scenario: ShaftScenario, terms: EquationTerms, r_k: float) -> Any:
    """Return the load of the shaft, a function of time, angle and velocity; None if constant.

    That of an eccentric mass passes zero in no more than single points of a run, but it passes
    close to it, and friction has then all but a corner.
    """
    sliding = _sliding_load(scenario, terms, r_k)
    if sliding is not None:
        return sliding.in_fixed_directions
    if terms.loads.has_constant_resultant:
        return None
    across, up = terms.across, terms.up
    return lambda time, angle, velocity: (across(time, angle, velocity), up(time, angle, velocity))


def _sliding_load(scenario: ShaftScenario, terms: EquationTerms, r_k: float) -> SlidingLoad | None:
    """Return the load with the inertia force of an eccentric mass; None if there is none."""
    eccentric = scenario.effects.eccentric_mass
    if eccentric is None or eccentric.first_moment == 0.0:
        return None
    p, inertia = eccentric.first_moment, scenario.inertia
    determinant = (inertia - r_k * p) * (inertia + r_k * p)
    return SlidingLoad(terms, r_k, p, radians(eccentric.azimuth_deg), inertia, determinant)


def _kinetic_limit(scenario: ShaftScenario, terms: EquationTerms, r_k: float) -> Any:
    """Return the friction torque of sliding in direction s, N m."""
    sliding = _sliding_load(scenario, terms, r_k)
    if sliding is not None:
        return sliding.limit
    across, up = terms.across, terms.up

    def kinetic_limit(time: Value, angle: Value, velocity: Value, s: Value) -> Value:
        x, y = across(time, angle, velocity), up(time, angle, velocity)
        return r_k * (x * x + y * y) ** 0.5

    return kinetic_limit


def stops_of(scenario: ShaftScenario, terms: EquationTerms) -> EndStops | None:
    """Return the end stops of a scenario; None without."""
    given = scenario.effects.end_stops
    if given is None:
        return None
    lowest, highest = given.lowest, given.highest

    def away(angle: float) -> tuple[int, ...]:
        return (-1,) if angle >= highest else (1,)

    return EndStops(
        lowest=lowest,
        highest=highest,
        restitution=given.restitution,
        capture_speed=given.capture_speed,
        first_departure=first_excess_of(scenario, terms, 0.0, away),
    )


def with_stops(applied_torque: Size, stops: EndStops | None) -> Size:
    """Return a torque with that of the stops at rest on them; the same torque without stops."""
    if stops is None:
        return applied_torque

    def with_torque_of_stops(time: Value, angle: Value, velocity: Value) -> Value:
        torque = applied_torque(time, angle, velocity)
        return torque + stops.torque(torque, angle, velocity)

    return with_torque_of_stops


def impact_quantities(trajectory: Trajectory) -> Quantities:
    """Return the number of impacts and the largest speed of one; None if there was none."""
    speeds = impact_speeds(trajectory)
    largest = float(speeds.max()) if speeds.size else None
    return {
        "impacts": Quantity(float(speeds.size), "1"),
        "impact_speed_max": Quantity(largest, "rad/s"),
    }


def impact_speeds(trajectory: Trajectory) -> Any:
    """Return the speeds of the body immediately before its impacts, (m,), rad/s.

    Events after the last sample, which a failed run may have, are ignored.
    """
    import numpy as np  # imported here because `check` does not need it

    if trajectory.velocity_before is None:
        return np.empty(0)
    end = trajectory.time[-1] if trajectory.time.size else -np.inf
    hits = [
        event.contact == EVENT and event.time <= end and speed != 0.0
        for event, speed in zip(trajectory.transitions, trajectory.velocity_before, strict=True)
    ]
    return np.abs(trajectory.velocity_before[np.array(hits, dtype=bool)])


def many_impacts(trajectory: Trajectory) -> list[str]:
    """Warn if the body bounces so often that the capture speed seems far too low."""
    count = impact_speeds(trajectory).size
    if count < MANY_IMPACTS:
        return []
    return [
        f"{count} impacts on the end stops, most of them negligible bounces; increase"
        " effects.end_stops.capture_speed"
    ]
