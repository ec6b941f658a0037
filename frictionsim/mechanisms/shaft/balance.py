"""The balance of a body at rest on a shaft, as sums that are linear in one unknown.

Moment and components of the resultant are M = a_0 + a_1 x and F = B_0 + B_1 x, with the unknown x.
"""

from bisect import bisect_right
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.mechanisms.shaft.equation import load_of
from frictionsim.mechanisms.shaft.loads import COUPLE, NONE, Arms, Turning, arms_of_force
from frictionsim.mechanisms.shaft.many_digits import PI, cosine_and_sine, exact
from frictionsim.scenario.signal_tables import AngleTable

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import Couple, Force, ShaftScenario
    from frictionsim.mechanisms.shaft.unknowns import Unknown

# Moment and components, N m, N, N; or these per unit of the unknown.
Values = tuple[Decimal, Decimal, Decimal]


class AngleSize(NamedTuple):
    """A size that is piecewise linear in the angle, deg, and constant beyond its points."""

    degrees: tuple[Decimal, ...]
    values: tuple[Decimal, ...]

    def at(self, degrees: Decimal) -> Decimal:
        """Return the size at an angle."""
        i = bisect_right(self.degrees, degrees)
        if i in (0, len(self.degrees)):
            return self.values[min(i, len(self.values) - 1)]
        begin, end = self.degrees[i - 1 : i + 1]
        one, other = self.values[i - 1 : i + 1]
        return one + (other - one) * (degrees - begin) / (end - begin)


class Sum:
    """A sum of loads as a function of the angle: moment and components of the resultant.

    Attributes
    ----------
    arms : Arms
        Of all loads whose sizes do not depend on the angle, times their sizes.
    moment_per_angle : Decimal, N m/rad
        Of a torsion spring.
    tables : list of (Arms, AngleSize)
        Of loads whose sizes are functions of the angle.
    """

    def __init__(self) -> None:
        self.arms: Any = _decimal(Arms())
        self.moment_per_angle = Decimal(0)
        self.tables: list[tuple[Any, AngleSize]] = []

    def add(self, arms: Any, size: Decimal) -> None:
        """Add a load."""
        self.arms = self.arms.plus(arms.times(size))

    def at(self, degrees: Decimal) -> Values:
        """Return moment and components at an angle, deg."""
        c, s = cosine_and_sine(degrees)
        moment, across, up = _turned(self.arms, c, s)
        for arms, size in self.tables:
            factor = size.at(degrees)
            one, two, three = _turned(arms, c, s)
            moment, across, up = moment + one * factor, across + two * factor, up + three * factor
        if self.moment_per_angle:
            moment += self.moment_per_angle * degrees * PI / 180
        return moment, across, up

    @property
    def sizes(self) -> tuple[Decimal, Decimal]:
        """The largest terms of the moment and of the components."""
        all_arms = [
            self.arms,
            *(arms.times(max(map(abs, size.values))) for arms, size in self.tables),
        ]
        triples: list[Any] = [triple for arms in all_arms for triple in arms]
        moment = max(abs(triple[0]) for triple in triples) + abs(self.moment_per_angle)
        return moment, max(abs(value) for triple in triples for value in triple[1:])

    @property
    def is_periodic(self) -> bool:
        """Whether it is the same after a turn."""
        return not self.tables and not self.moment_per_angle


def _decimal(arms: Arms) -> Any:
    """Return arms in numbers of many digits."""
    triples: Any = [tuple(map(exact, triple)) for triple in arms]
    return Arms(*triples)


def _turned(arms: Any, c: Decimal, s: Decimal) -> Values:
    """Return what `Arms.at` does, in these digits."""
    one, two, three = (a + b * c + d * s for a, b, d in zip(*arms, strict=True))
    return one, two, three


class Balance(NamedTuple):
    """The balance of a scenario.

    Attributes
    ----------
    given, sought : Sum
        Of all that is known; and per unit of the unknown.
    shaft_radius, mu : Decimal, m, 1
        Static coefficient of friction; zeros without friction.
    unknown : Unknown or None
    """

    given: Sum
    sought: Sum
    shaft_radius: Decimal
    mu: Decimal
    unknown: "Unknown | None"

    @property
    def friction_radius(self) -> Decimal:
        """r_s, m."""
        return self.shaft_radius * self.mu / (1 + self.mu * self.mu).sqrt()

    @property
    def knots(self) -> list[Decimal]:
        """The angles at which slopes of sizes jump, deg."""
        tables = (*self.given.tables, *self.sought.tables)
        return sorted({knot for _, size in tables for knot in size.degrees})


def balance_of(scenario: "ShaftScenario", unknown: "Unknown | None", time: float) -> Balance:
    """Return the balance at rest at a time, s."""
    journal, found = scenario.effects.shaft_friction, (Sum(), Sum())
    for force in scenario.forces:
        _add_force(found, force, unknown, time)
    for couple in scenario.couples:
        if unknown is not None and unknown.key == f"couples.{couple.name}.size":
            found[1].add(_decimal(COUPLE), Decimal(1))
        else:
            _add_load(found[0], couple, _decimal(COUPLE), time)
    _add_weights(found, scenario, unknown)
    _add_spring(found, scenario, unknown)
    radius, mu = (0.0, 0.0) if journal is None else (journal.shaft_radius, journal.mu_s)
    return Balance(*found, exact(radius), exact(mu), unknown)


def _add_force(
    found: tuple[Sum, Sum], force: "Force", unknown: "Unknown | None", time: float
) -> None:
    given, sought = found
    arms = _arms_of(force)
    if unknown is None or unknown.table != f"forces.{force.name}":
        _add_load(given, force, arms, time)
    elif unknown.name == "size":
        sought.add(arms, Decimal(1))
    else:  # an arm: the moment is in proportion to it
        moments = _decimal(COUPLE)
        if force.point is not None:
            distance = _length(force.point)
            moments = _decimal(Arms(*((triple[0] / distance, *NONE[1:]) for triple in arms)))
        components = _decimal(Arms(*((0.0, *triple[1:]) for triple in arms)))
        _add_load(sought, force, moments, time)
        _add_load(given, force, components, time)


def _add_load(found: Sum, part: "Force | Couple", arms: Any, time: float) -> None:
    size = part.size
    if isinstance(size, AngleTable):
        points = AngleSize(tuple(map(exact, size.angle_deg)), tuple(map(exact, size.value)))
        found.tables.append((arms, points))
    else:
        found.add(arms, exact(load_of(part, arms).at_rest(time, 0.0)))


def _length(vector: tuple[float, float]) -> Decimal:
    x, y = map(exact, vector)
    return (x * x + y * y).sqrt()


def _arms_of(force: "Force") -> Any:
    """Return `Force.arms` in these digits."""
    x, y = map(exact, force.direction)
    length = _length(force.direction)
    unit = x / length, y / length
    if force.cord_radius is not None:
        return _decimal(Arms((exact(force.cord_radius), *unit)))  # type: ignore[arg-type]
    turning = Turning(force.direction_turns, force.point_turns)
    return _decimal(arms_of_force(unit, tuple(map(exact, force.point or ())), turning))


def _add_weights(
    found: tuple[Sum, Sum], scenario: "ShaftScenario", unknown: "Unknown | None"
) -> None:
    gravity, eccentric = scenario.effects.gravity, scenario.effects.eccentric_mass
    if gravity is None:
        return
    given, sought = found
    key = "" if unknown is None else unknown.key
    g = exact(gravity.g)
    # The weight of the body, and of the eccentric mass as if it were on the axis.
    at_axis, mass = _decimal(Arms((0.0, 0.0, -1.0))), exact(scenario.mechanism.mass)
    weights = [("mechanism.mass", mass, at_axis)]
    if eccentric is not None:
        mass, radius = exact(eccentric.mass), exact(eccentric.radius)
        c, s = cosine_and_sine(exact(eccentric.azimuth_deg))
        turning: Any = (-c, 0.0, 0.0), (s, 0.0, 0.0)
        arms = _decimal(Arms(NONE, *turning))
        if key == "effects.eccentric_mass.radius":
            sought.add(arms, mass * g)
            arms = at_axis
        else:
            arms = arms.times(radius).plus(at_axis)
        weights.append(("effects.eccentric_mass.mass", mass, arms))
    for of, mass, arms in weights:
        if key == of:
            sought.add(arms, g)
        elif key == "effects.gravity.g":
            sought.add(arms, mass)
        else:
            given.add(arms, mass * g)


def _add_spring(
    found: tuple[Sum, Sum], scenario: "ShaftScenario", unknown: "Unknown | None"
) -> None:
    spring, (given, sought) = scenario.effects.torsion_spring, found
    if spring is None:
        return
    key = "" if unknown is None else unknown.key
    stiffness = exact(spring.stiffness)
    free = exact(spring.free_angle_deg) * PI / 180
    couple = _decimal(COUPLE)
    if key == "effects.torsion_spring.stiffness":
        sought.moment_per_angle = Decimal(-1)
        sought.add(couple, free)
        return
    given.moment_per_angle = -stiffness
    if key == "effects.torsion_spring.free_angle_deg":
        sought.add(couple, stiffness * PI / 180)
    else:
        given.add(couple, stiffness * free)
