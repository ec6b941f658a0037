"""Closed forms of belt drives: creep, capstan, waves, weight. SI units, angles in rad."""

from math import cosh, exp, log, pi, sqrt, tan
from typing import NamedTuple

from scipy.integrate import quad
from scipy.optimize import brentq


class Drive(NamedTuple):
    """Two equal pulleys and a smooth, thin belt round them."""

    radius: float  # m
    distance: float  # m, of the axes
    inertia: float  # kg m^2, of each pulley
    axial: float  # N, EA
    mass: float  # kg/m
    pretension: float  # N, at rest

    @property
    def length(self) -> float:
        return 2.0 * (self.distance + pi * self.radius)


SECTION_4 = Drive(0.027, 0.515, 2.4e-4, 1.52e5, 0.096, 555.0)  # of `belt_drive.toml`


class Creep(NamedTuple):
    """A drive that runs steadily under a torque."""

    tight: float  # N
    slack: float  # N
    sliding: float  # rad, at the exit of each pulley
    slip: float  # how much slower the driven rim is, over the speed of the driver's


def creep(drive: Drive, torque: float, mu: float, speed: float) -> Creep:
    """Return the steady state of a belt that creeps (Euler, Reynolds; Leamy and Wasfy 2002).

    On each pulley the belt sticks at the tension of the span it comes from, then slides with a
    tension that is exponential. The unstretched length is that of the belt at rest.
    """
    force, momentum = torque / drive.radius, drive.mass * speed**2

    def sliding(slack: float) -> float:
        return log((slack + force - momentum) / (slack - momentum)) / mu

    def missing(slack: float) -> float:
        tight, beta = slack + force, sliding(slack)

        def strained(angle: float) -> float:
            tension = momentum + (slack - momentum) * exp(mu * angle)
            return drive.radius / (1.0 + tension / drive.axial)

        even = drive.distance + drive.radius * (pi - beta)
        length = sum(even / (1.0 + tension / drive.axial) for tension in (tight, slack))
        length += 2.0 * quad(strained, 0.0, beta)[0]
        return length - drive.length / (1.0 + drive.pretension / drive.axial)

    low = momentum + force / (exp(mu * pi) - 1.0) * (1.0 + 1e-9)
    slack = brentq(missing, low, 100.0 * (drive.pretension + force), xtol=1e-9)
    tight = slack + force
    return Creep(tight, slack, sliding(slack), force / (drive.axial + tight))


def slip_over_creep(drive: Drive, slip: float, tight: float, slack: float) -> float:
    """Return a slip over that of a string of the same tensions, which has 1.

    A rim is as fast as the span that runs onto it and sticks, V (1 + T/EA), where V is the speed of
    the belt unstretched: the string slips by 1 - (EA + T2)/(EA + T1) = (T1 - T2)/(EA + T1).
    """
    return slip * (drive.axial + tight) / (tight - slack)


def capstan(mu: float, wrap: float) -> float:
    """Return the ratio of the tensions, each less the momentum of the belt."""
    return exp(mu * wrap)


def capstan_with_bending(
    mu: float, wrap: float, rigidity: float, radius: float, t1: float
) -> float:
    """Return the ratio of the tensions of a belt that bends, from its tight span, N.

    Of an elastica: the tension drops by EI/(2 R^2) on to the arc, the arc is shorter by
    sqrt(EI/T)/R at each end, and the end forces sqrt(EI T)/R carry friction.
    """
    drop = rigidity / (2.0 * radius**2)

    def missing(t2: float) -> float:
        arc = wrap - sum(sqrt(rigidity / t) / radius for t in (t1, t2))
        left = t1 - drop - mu * sqrt(rigidity * t1) / radius
        return left - exp(mu * arc) * (t2 - drop + mu * sqrt(rigidity * t2) / radius)

    return t1 / float(brentq(missing, 1e-3 * t1, t1))


def two_pulley_mode(drive: Drive) -> float:
    """Return the lowest frequency at which the pulleys swing against each other, rad/s.

    The arcs stick: J w^2 = 2 R^2 EA k cot(k L/2), k = w sqrt(rho/EA), where L is a span,
    unstretched, and the mass of an arc counts with the pulley.
    """
    stretch = 1.0 + drive.pretension / drive.axial
    span = drive.distance / stretch
    inertia = drive.inertia + pi * drive.mass * drive.radius**3 / stretch

    def missing(w: float) -> float:
        k = w * sqrt(drive.mass / drive.axial)
        spring = 2.0 * drive.radius**2 * drive.axial * k / tan(0.5 * k * span)
        return inertia * w**2 - spring

    first = pi / span * sqrt(drive.axial / drive.mass)
    return float(brentq(missing, 1e-6 * first, first * (1.0 - 1e-9)))


def loop_mode(drive: Drive) -> float:
    """Return the frequency of the first wave along the whole belt, no friction, rad/s."""
    unstretched = drive.length / (1.0 + drive.pretension / drive.axial)
    return 2.0 * pi / unstretched * sqrt(drive.axial / drive.mass)


def transverse_mode(drive: Drive, number: int) -> float:
    """Return a frequency of a span across its length, rad/s; its mass is that of the stretched."""
    mass = drive.mass / (1.0 + drive.pretension / drive.axial)
    return number * pi / drive.distance * sqrt(drive.pretension / mass)


def sag(drive: Drive, tension: float, gravity: float) -> float:
    """Return how far the middle of a level span is below its ends, m, a catenary."""
    scale = tension * (1.0 + tension / drive.axial) / (drive.mass * gravity)
    return scale * (cosh(0.5 * drive.distance / scale) - 1.0)
