"""A rigid body on a dry fixed shaft, under any forces and couples in its plane.

    I dw/dt = M - b w - k (q - q_0) + T,   |T| <= r_s R sticking,   T = -s r_k R sliding [1]_

q is the angle of the body, counter-clockwise, w = dq/dt, and s the sign of w. M is the moment of
all forces and couples about the axis and R the force between shaft and body. At rest, and without
an eccentric mass, it is the resultant F of all forces. The centre of an eccentric mass m at the
radius e accelerates, and the force on the shaft is F - m a, of which

    R^2 = (F_t - m e dw/dt)^2 + (F_n + m e w^2)^2

with the components F_t along and F_n across its path, so that friction and acceleration follow
from one quadratic equation. An end stop is a couple on the body, and no force on the shaft: see
`frictionsim.solvers.events`.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 1-24 and 30.
"""

from collections.abc import Callable
from functools import partial
from math import cos, hypot, radians, sin, sqrt
from sys import float_info
from typing import Any

from frictionsim.mechanisms.effects import CONTACT_NAME, ROUNDING, radii_of, viscous_damping
from frictionsim.mechanisms.shaft.loads import (
    ANGLE,
    COUPLE,
    SPEED,
    TIME,
    Acting,
    Arms,
    Elapsed,
    Load,
    acting_of,
    arms_of_weight,
    carried,
    knots_of,
    sizes_of,
    total_of,
)
from frictionsim.mechanisms.shaft.schema import Couple, Force, ShaftScenario
from frictionsim.mechanisms.single_dof import start_of
from frictionsim.scenario.kinetic_friction import OverSpeed
from frictionsim.scenario.signal_tables import AngleTable, SpeedTable, signal_from
from frictionsim.scenario.signals import Constant, linear
from frictionsim.solvers.prescribed import OneAtSpeed
from frictionsim.solvers.roots import time_of_excess
from frictionsim.solvers.system import INPUT, EndStops, Friction, OneCoordinate, Term

SMALLEST = float_info.min  # numbers below it have no digits left


def load_of(part: Force | Couple) -> Load:
    """Return the load of a table of the scenario."""
    arms, size = part.arms if isinstance(part, Force) else COUPLE, part.size
    if isinstance(size, SpeedTable):
        return Load(arms, linear(size.speed, size.value), SPEED)
    if isinstance(size, AngleTable):
        return Load(arms, linear([radians(x) for x in size.angle_deg], size.value), ANGLE)
    return Load(arms, signal_from(size))


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


class EccentricMass:
    """The load of the shaft with a mass m at the radius e from the axis.

    It has the components A_t - p dw/dt along the path of the mass and A_n across it, A_n with the
    centrifugal force. While the body slides, from I dw/dt = M - s K and K = r_k R follows

        K = r_k (I S + s r_k p D)/(I^2 - r_k^2 p^2),   D = I A_t - p M,
        S^2 = D^2 + (I^2 - r_k^2 p^2) A_n^2

    Parameters
    ----------
    p : float, kg m
        First moment m e.
    azimuth : float, rad
        At q = 0.
    inertia : float, kg m^2
        I, with the mass.
    r_k : float, m
    """

    def __init__(self, p: float, azimuth: float, inertia: float, r_k: float) -> None:
        self.p, self.azimuth, self.x, self.y = p, azimuth, cos(azimuth), sin(azimuth)
        self.inertia, self.r_k = inertia, r_k
        self.determinant = (inertia - r_k * p) * (inertia + r_k * p)

    def direction(self, u: Acting) -> tuple[float, float]:
        """Return the unit vector from the axis to the mass."""
        c, s = u[4:]
        return self.x * c - self.y * s, self.x * s + self.y * c

    def sliding_load(self, u: Acting, v: float, applied: float) -> tuple[float, float]:
        """Return D, and A_n times the root of the determinant."""
        (_, _, x, y, _, _), (c, d) = u, self.direction(u)
        along = self.inertia * (y * c - x * d) - self.p * applied
        return along, sqrt(self.determinant) * (x * c + y * d + self.p * v * v)

    def kinetic_limit(self, u: Acting, q: float, v: float, s: int, applied: float) -> float:
        """Return K, N m."""
        along, across = self.sliding_load(u, v, applied)
        root, r_k = hypot(along, across), self.r_k
        return r_k * (self.inertia * root + s * r_k * self.p * along) / self.determinant

    def limit_at_speed(self, u: Acting, q: float, v: float, s: int, applied: float) -> float:
        """Return r_k R of a given speed, N m; `applied` is the sum of all torques."""
        return self.r_k * hypot(*self.load(u, v, applied / self.inertia))

    def load(self, u: Acting, v: float, a: float) -> tuple[float, float]:
        """Return the force of the body on the shaft at an acceleration, N, right and up."""
        (_, _, x, y, _, _), (c, s) = u, self.direction(u)
        outward, along = self.p * v * v, -self.p * a
        return x + outward * c - along * s, y + outward * s + along * c


class Shaft:
    """What acts on the body.

    Attributes
    ----------
    acting : callable
        Of time, s, angle, rad, and speed, rad/s: `loads.Acting`.
    parts : list of Term
        The torques of loads, eccentric mass, spring and damping.
    inertia : float, kg m^2
    loads, weights : list of Load
    forces : list of Load
        All of them, the weights without their moments, which are stored energies and no input; or
        their moments, and the constant normal load of the friction.
    resultant : callable
        As `acting`, with the force of all forces in any case.
    r_s : float, m
        Static friction radius; zero without dry friction.
    eccentric : EccentricMass or None
    spring : (float, float) or None
        Stiffness k, N m/rad, and the angle q_0 at which it is free, rad.
    stops : EndStops or None
    """

    def __init__(self, scenario: ShaftScenario) -> None:
        effects, self.inertia = scenario.effects, scenario.inertia
        journal, mass, stops = effects.shaft_friction, effects.eccentric_mass, effects.end_stops
        self.r_s, r_k = radii_of(journal)
        given: list[Force | Couple] = [*scenario.forces, *scenario.couples]
        self.loads = [load_of(part) for part in given]
        self.weights = weights_of(scenario)
        (_, x, y), (cosine, *_), (sine, *_) = total_of(self.weights)
        self.normal_load = journal.normal_load if journal else None
        forces = [*self.loads, Load(Arms((0.0, x, y)), Constant(1.0))]
        self.forces = self._carried(forces)
        self.acting, self.resultant = acting_of(self.forces), acting_of(forces)
        self._sizes = sizes_of(self._carried([*self.loads, *self.weights]), self.r_s)
        self.eccentric = None
        if mass is not None and mass.first_moment:
            azimuth = radians(mass.azimuth_deg)
            self.eccentric = EccentricMass(mass.first_moment, azimuth, self.inertia, r_k)
        self.stops = None
        if stops is not None:
            limits = stops.lowest, stops.highest
            self.stops = EndStops(*limits, stops.restitution, stops.capture_speed)
        self.parts = [Term(lambda u, q, v: u[1], INPUT)]
        if effects.gravity and mass:
            weight = Term(
                lambda u, q, v: cosine * u[4] + sine * u[5],
                potential=lambda q: sine * cos(q) - cosine * sin(q),
            )
            self.parts.append(weight)
        self.spring = None
        if (table := effects.torsion_spring) is not None:
            k, q_0 = self.spring = table.stiffness, radians(table.free_angle_deg)
            energy = lambda q: 0.5 * k * (q - q_0) * (q - q_0)  # noqa: E731
            self.parts.append(Term(lambda u, q, v: -k * (q - q_0), potential=energy))
        self.parts += viscous_damping(effects.viscous_damping)
        self._torques: list[Any] = [part.torque for part in self.parts]

    def _carried(self, loads: list[Load]) -> list[Load]:
        return carried(loads, self.normal_load, lambda arms, size: Load(arms, Constant(size)))

    def torque(self, u: Acting, q: float, v: float) -> float:
        """Return the torque of all but dry friction and end stops, N m."""
        return sum([torque(u, q, v) for torque in self._torques])

    def static_limit(self, u: Acting, q: float) -> float:
        """Return r_s R at rest, N m."""
        return self.r_s * hypot(u[2], u[3])

    def roundoff(self, time: float, angle: float) -> float:
        """Return the roundoff of the torque and its limit at rest, N m."""
        terms = self._sizes(time, angle)
        if self.spring is not None:
            k, q_0 = self.spring
            terms += k * abs(angle - q_0)
        return ROUNDING * terms + SMALLEST

    def turning_load(self, u: Acting, q: float, v: float) -> tuple[float, float]:
        """Return a vector in proportion to the load of the shaft while it slides.

        That of an eccentric mass passes zero in no more than single points of a run, but it passes
        close to it, and friction has then all but a corner.
        """
        if self.eccentric is None:
            return u[2], u[3]
        along, across = self.eccentric.sliding_load(u, v, self.torque(u, q, v))
        c, d = self.eccentric.direction(u)
        return across * c - along * d, across * d + along * c

    @property
    def may_reverse(self) -> bool:
        """Whether the load of the friction may pass zero."""
        if self.normal_load is not None:
            return False
        fixed, turning, _ = total_of(self.forces)
        varies = any(load.arms.is_force for load in self.forces if not load.is_constant)
        return self.eccentric is not None or varies or (any(fixed[1:]) and any(turning[1:]))

    @property
    def turns(self) -> bool:
        """Whether a moment or a component of a force depends on the angle of the body."""
        every = [*self.forces, *self.weights]
        varying = [load for load in every if not load.is_constant]
        return (
            self.eccentric is not None
            or total_of(every).turn
            or any(load.arms.turn or load.over == ANGLE for load in varying)
        )


class Excess:
    """The torque at rest beyond its limit and its roundoff in a direction, over time, N m.

    Parameters
    ----------
    shaft : Shaft
    r_s : float, m
        Zero on an end stop of a body without dry friction.
    s : {1, -1}
    angle : float, rad
    """

    def __init__(self, shaft: Shaft, r_s: float, s: int, angle: float) -> None:
        self.shaft, self.r_s, self.s, self.angle = shaft, r_s, s, angle
        self.changing = [
            (load.size, load.arms.at(angle))
            for load in shaft.forces
            if load.over == TIME and not load.is_constant
        ]

    def _loads(self, t: float) -> tuple[float, float, float]:
        """Return the torque, N m, and the resultant of all forces, N."""
        u = self.shaft.acting(t, self.angle, 0.0)
        return self.shaft.torque(u, self.angle, 0.0), u[2], u[3]

    def at(self, t: float) -> float:
        """Return the excess at a time, s."""
        torque, x, y = self._loads(t)
        return self.s * torque - self.r_s * hypot(x, y) - self.shaft.roundoff(t, self.angle)

    def slope(self, t: float) -> float:
        """Return the derivative after a time, N m/s; the roundoff counts as constant."""
        moment = dx = dy = 0.0
        for size, (arm, a_x, a_y) in self.changing:
            rate = size.derivative(t)
            moment, dx, dy = moment + rate * arm, dx + rate * a_x, dy + rate * a_y
        _, x, y = self._loads(t)
        force = hypot(x, y)
        growth = (x * dx + y * dy) / force if force > 0.0 else hypot(dx, dy)
        return self.s * moment - self.r_s * growth

    def largest(self, begin: float, end: float) -> float:
        """Return a bound of the excess without roundoff between two times, s.

        The signals are smooth between the times.
        """
        (torque, x, y), slack = self._loads(begin), 0.0
        for size, (arm, a_x, a_y) in self.changing:
            lowest, highest = size.extremes(begin, end)
            change = 0.5 * (lowest + highest) - size(begin)
            torque, x, y = torque + change * arm, x + change * a_x, y + change * a_y
            slack += 0.5 * (highest - lowest) * (abs(arm) + self.r_s * hypot(a_x, a_y))
        return self.s * torque - self.r_s * hypot(x, y) + slack

    def time(self, begin: float, end: float) -> float:
        """Return a time up to which the excess becomes positive at most once, s."""
        curvature = sum(
            size.curvature(begin, end) * (abs(arm) + self.r_s * hypot(x, y))
            for size, (arm, x, y) in self.changing
        )
        tie = self.shaft.roundoff(begin, self.angle)
        until: float = time_of_excess(self, curvature, begin, end, tie)
        return until


def first_excess(shaft: Shaft, r_s: float, angle: float, begin: float, end: float) -> float:
    """Return a time up to which the torque at rest exceeds its limit at most once, s.

    A stop keeps the body from turning in its direction.
    """
    closed = 0 if shaft.stops is None else shaft.stops.side(angle)
    both = [Excess(shaft, r_s, s, angle) for s in (1, -1) if s != closed]
    # At once, however many periods the loads have until then.
    for excess in [excess for excess in both if excess.largest(begin, end) >= 0.0]:
        end = excess.time(begin, end)
    return end


class Reversal:
    """The surface at which the load of the shaft has turned by a right angle within a step.

    A load that passes zero turns by two at once, where its size, and friction with it, has a
    corner.
    """

    event = ""

    def __init__(self, shaft: Shaft) -> None:
        self.shaft = shaft

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return the negative product of the load and that at the start of the step."""
        x_old, y_old = self._load(step.t_old, step.y_old)
        across, up = self._load(t, y)
        return -(across * x_old + up * y_old)

    def _load(self, t: float, y: list[float]) -> tuple[float, float]:
        u = self.shaft.acting(t, y[0], y[1])
        return self.shaft.turning_load(u, y[0], y[1])


def _kinetic_limit(shaft: Shaft, radius: OverSpeed, is_driven: bool) -> Callable[..., float]:
    """Return the kinetic limit; with an eccentric mass, K of `EccentricMass` is r_k R."""
    mass, at, r_k = shaft.eccentric, radius.at, radius.at_rest
    if mass is None or shaft.normal_load is not None:
        if radius.varies:
            return lambda u, q, v, s, M: at(v) * hypot(u[2], u[3])
        return lambda u, q, v, s, M: r_k * hypot(u[2], u[3])
    of = EccentricMass.limit_at_speed if is_driven else EccentricMass.kinetic_limit
    if not radius.varies:
        return partial(of, mass)
    numbers = mass.p, mass.azimuth, mass.inertia
    return lambda u, q, v, s, M: of(EccentricMass(*numbers, at(v)), u, q, v, s, M)


class ShaftAtSpeed(OneAtSpeed):
    """A body of given speed: the torque of its drive adds to the moment of the loads."""

    def driven(self, u: Acting, torque: float) -> Acting:
        t, moment, *others = u
        return (t, moment + torque, *others)  # type: ignore[return-value]


def system_of(scenario: ShaftScenario, shaft: Shaft) -> OneCoordinate:
    """Return the equation of motion."""
    journal, stops, eccentric = scenario.effects.shaft_friction, shaft.stops, shaft.eccentric
    speed, friction = scenario.given_speed, None
    if journal is not None:
        radius = journal.radius_over_speed
        friction = Friction(
            CONTACT_NAME,
            static=shaft.static_limit,
            kinetic=_kinetic_limit(shaft, radius, speed is not None),
            roundoff=lambda u, q: shaft.roundoff(u[0], q),
            surfaces=radius.surfaces(1),
            **journal.law_of_contact(),
        )

    def recorded(u: Acting, q: float, v: float, a: float) -> list[float]:
        torque = shaft.torque(u, q, v)
        if shaft.normal_load is not None:
            u = (*u[:2], *shaft.resultant(u[0], q, v)[2:])
        x, y = eccentric.load(u, v, a) if eccentric else (u[2], u[3])
        numbers = [torque, hypot(x, y), -x, -y]
        if speed is not None:
            numbers.append(u[1] - shaft.acting(u[0], q, v)[1])
        if stops is not None:
            numbers.append(-torque if stops.takes(q, v, torque) else 0.0)
        return numbers

    reverses = friction is not None and shaft.may_reverse and not (eccentric and speed)
    kind: Any = OneCoordinate if speed is None else partial(ShaftAtSpeed, speed)
    system: OneCoordinate = kind(
        Elapsed(tuple(load.size for load in shaft.loads if load.over == TIME)),
        shaft.acting,
        shaft.inertia,
        shaft.parts,
        friction,
        start=start_of(scenario),
        first_excess=lambda q, a, b: first_excess(shaft, shaft.r_s, q, a, b),
        surfaces=(*knots_of(shaft.loads), *([Reversal(shaft)] if reverses else [])),
        stops=stops,
        channels=(
            *("applied_torque", "shaft_reaction", "reaction_x", "reaction_y"),
            *(["drive_torque"] if speed is not None else []),
            *(["stop_torque"] if stops is not None else []),
        ),
        recorded=recorded,
    )
    return system
