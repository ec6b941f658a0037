"""Impending motion of a body on a dry shaft: eq 24 for one unknown, with all its real roots.

Moment and components of the resultant are linear in the unknown x. Loads, weights and spring are
those of the equation of motion: a_0 and B_0 are of the scenario with the unknown zero, and a_1 and
B_1 of a scenario with nothing else in it.

    M(x)^2 = r_s^2 |F(x)|^2,   M = a_0 + a_1 x,   F = B_0 + B_1 x

is A x^2 + 2 B x + C = 0 with A = a_1^2 - r_s^2 B_1^2 and, without the cancellation of B^2 - A C,

    B^2 - A C = r_s^2 (V^2 - r_s^2 (B_0 x B_1)^2),   V = a_0 B_1 - a_1 B_0

The sign of M(x) is the direction in which the body is about to turn. It follows from

    A M(x) = +-a_1 sqrt(B^2 - A C) - r_s^2 V . B_1

If A > 0, there is one root of each direction, and the body rests between them. If A < 0, friction
grows faster with x than the moment: there is no root, and the body always rests, or both are of one
direction, and the body moves between them.
"""

from math import copysign, frexp, hypot, inf, radians, sqrt
from typing import NamedTuple

from frictionsim.mechanisms.effects import friction_radius
from frictionsim.mechanisms.shaft.equation import Shaft, loads_of, shaft_of, weights_of
from frictionsim.mechanisms.shaft.loads import (
    COUPLE,
    NONE,
    Load,
    Triple,
    scaled,
)
from frictionsim.mechanisms.shaft.loads import sum_of as sum_of_triples
from frictionsim.mechanisms.shaft.schema import Force, ShaftScenario
from frictionsim.mechanisms.shaft.unknowns import Unknown
from frictionsim.scenario.signal_tables import AngleTable

# The part of the unknown is the difference of two values of it. The step between them is a power
# of two, exact in products, and so large that the angle does not round away the free angle of a
# spring.
STEP = 2.0**20
MU_S, SHAFT_RADIUS = "mu_s", "shaft_radius"

COUNTER_CLOCKWISE, CLOCKWISE, BOTH = 1, -1, 0

# A difference counts as zero if it is no larger, relative to the terms that it is left of. Rounding
# of the terms leaves 1e-15 of them; no arm and no coefficient of friction is known to 1e-12.
ROUNDOFF = 1e-12


class Root(NamedTuple):
    """A root of eq 24.

    Attributes
    ----------
    value : float
    direction : int
        Of impending motion: 1 counter-clockwise, -1 clockwise; 0 both, where moment and friction
        vanish together.
    """

    value: float
    direction: int


class Roots(NamedTuple):
    """All real roots of eq 24.

    Attributes
    ----------
    real : tuple of Root
        In ascending order.
    leading : int
        Sign of A: the body rests between the roots (1), or moves between them (-1).
    every : bool
        Every value is a root.
    """

    real: tuple[Root, ...] = ()
    leading: int = 0
    every: bool = False

    def of(self, direction: int) -> list[float]:
        """Return the roots of a direction."""
        return [root.value for root in self.real if root.direction in (direction, BOTH)]


class Equation(NamedTuple):
    """Eq 24 with moments and forces in powers of two of the sizes of their terms.

    Attributes
    ----------
    a_0, x_0, y_0, a_1, x_1, y_1 : float
        Moment, and r_s times the components; of what is given, and per unit of the unknown.
    terms : float
        Sum of the terms that a_0, x_0 and y_0 are left of.
    unit : float
        Of the unknown.
    """

    a_0: float
    x_0: float
    y_0: float
    a_1: float
    x_1: float
    y_1: float
    terms: float
    unit: float

    @property
    def size(self) -> float:
        """The larger one of moment and friction per unit of the unknown."""
        return max(abs(self.a_1), hypot(self.x_1, self.y_1))

    @property
    def leading(self) -> float:
        """Moment less friction per unit of the unknown; A is in proportion to it."""
        return abs(self.a_1) - hypot(self.x_1, self.y_1)

    @property
    def across(self) -> tuple[float, float]:
        """r_s V."""
        return (
            self.a_0 * self.x_1 - self.a_1 * self.x_0,
            self.a_0 * self.y_1 - self.a_1 * self.y_0,
        )

    @property
    def margin(self) -> float:
        """|V| less r_s |B_0 x B_1|, of its terms; the discriminant is in proportion to it."""
        whole = self.terms * self.size
        cross = self.x_0 * self.y_1 - self.y_0 * self.x_1
        return (hypot(*self.across) - abs(cross)) / whole if whole else 0.0


def equation_of(given: Triple, sought: Triple, radius: float, terms: float = 0.0) -> Equation:
    """Return eq 24.

    Parameters
    ----------
    given : (float, float, float), N m, N, N
        a_0 and B_0.
    sought : (float, float, float)
        a_1 and B_1, per unit of the unknown.
    radius : float, m
        r_s.
    terms : float, N m
        Sum of the terms of a_0 and r_s B_0 where these are differences.
    """
    a_0, x_0, y_0 = given[0], radius * given[1], radius * given[2]
    a_1, x_1, y_1 = sought[0], radius * sought[1], radius * sought[2]
    terms = max(terms, abs(a_0), hypot(x_0, y_0))
    one, two = _power_of_two(terms), _power_of_two(max(abs(a_1), hypot(x_1, y_1)))
    known, per_unit = (a_0 / one, x_0 / one, y_0 / one), (a_1 / two, x_1 / two, y_1 / two)
    return Equation(*known, *per_unit, terms / one, one / two)


def _power_of_two(size: float) -> float:
    return 2.0 ** min(frexp(size)[1], 1023) if 0.0 < size < inf else 1.0


def roots_of(equation: Equation) -> Roots:
    """Return all real roots of eq 24; the unknown is in it."""
    a_0, x_0, y_0, a_1, x_1, y_1, terms, _ = equation
    f_1 = hypot(x_1, y_1)
    b = a_0 * a_1 - x_0 * x_1 - y_0 * y_1
    f_0 = hypot(x_0, y_0)
    c = (abs(a_0) - f_0) * (abs(a_0) + f_0)
    if abs(equation.leading) <= ROUNDOFF * equation.size:
        return _linear(equation, b, c)
    a, sign_of_a = equation.leading * (abs(a_1) + f_1), 1 if equation.leading > 0.0 else -1
    v_x, v_y = equation.across
    v, cross = hypot(v_x, v_y), abs(x_0 * y_1 - y_0 * x_1)
    tie = ROUNDOFF * terms * equation.size
    vanishing = v <= tie  # moment and friction, together
    if sign_of_a < 0 and v - cross < -tie:
        return Roots((), sign_of_a)
    double = vanishing or (sign_of_a < 0 and v - cross <= tie)
    # The product of two roots does not underflow where that of the numbers does.
    root = 0.0 if double else sqrt(max(v - cross, 0.0)) * sqrt(v + cross)
    # The root of larger magnitude has no cancellation, and that of the other one is c/a over it.
    outer = -1.0 if b > 0.0 else 1.0
    numerator = -b + outer * root
    roots = []
    for sign in (outer,) if double else (1.0, -1.0):
        value = numerator / a if sign == outer or not numerator else c / numerator
        turning = sign * a_1 if sign_of_a > 0 else v_x * x_1 + v_y * y_1
        direction = BOTH if vanishing else _sign(turning)
        roots.append(Root(_in_units(value, equation), direction))
    return Roots(tuple(sorted(roots)), sign_of_a)


def _linear(equation: Equation, b: float, c: float) -> Roots:
    """Solve 2 B x + C = 0, eq 24 where A = 0."""
    terms = equation.terms
    if abs(b) <= ROUNDOFF * terms * equation.size:
        return Roots(every=abs(c) <= ROUNDOFF * terms * terms)
    value = -c / (2.0 * b)
    turning = equation.a_0 + equation.a_1 * value
    tied = abs(turning) <= ROUNDOFF * (terms + abs(equation.a_1 * value))
    root = Root(_in_units(value, equation), BOTH if tied else _sign(turning))
    return Roots((root,))


def _in_units(value: float, equation: Equation) -> float:
    """Return a root in its unit; zero where the terms of the balance leave a tie."""
    return 0.0 if abs(value) * equation.size <= ROUNDOFF * equation.terms else value * equation.unit


def _sign(x: float) -> int:
    return int(copysign(1.0, x))


class Sum(NamedTuple):
    """The loads of a scenario at rest, weights included, and their sum as of the equation."""

    scenario: ShaftScenario
    shaft: Shaft
    loads: list[Load]

    def at(self, time: float, angle: float) -> Triple:
        """Return moment, N m, and components of the resultant, N."""
        return self.shaft.torque_and_force(time, angle, 0.0)

    def slopes(self, time: float, angle: float) -> Triple:
        """Return their derivatives over the angle, per rad."""
        total = NONE
        for load in self.loads:
            size = load.at_rest(time, angle)
            total = sum_of_triples(total, scaled(load.arms.slopes.at(angle), size))
            if load.over == "angle":
                rate = load.size.derivative(angle)
                total = sum_of_triples(total, scaled(load.arms.at(angle), rate))
        moment, across, up = total
        return moment - sum(spring.k for spring in self.shaft.spring), across, up

    def scale(self, time: float, angle: float) -> float:
        """Return the sum of the terms of moment and friction, N m."""
        scale: float = self.shaft.terms(time, angle)
        return scale

    def total_force(self, time: float, angle: float) -> float:
        """Return the sum of the sizes of all forces, N."""
        return sum(abs(load.at_rest(time, angle)) for load in self.loads if load.arms != COUPLE)


class Balance(NamedTuple):
    """The balance of a scenario at a time, s.

    Attributes
    ----------
    given : Sum
        With the unknown zero.
    parts : (Sum, Sum) or None
        The part of the unknown alone, with the unknown zero and a step larger; None of a
        coefficient of friction or a shaft radius.
    unknown : Unknown
    time : float, s
    """

    given: Sum
    parts: tuple[Sum, Sum] | None
    unknown: Unknown
    time: float

    @property
    def solves_for_friction(self) -> bool:
        """Whether the unknown changes the friction, and neither moment nor resultant."""
        return self.parts is None

    @property
    def radius(self) -> float:
        """r_s, m."""
        journal = self.given.scenario.effects.shaft_friction
        return 0.0 if journal is None else journal.static_radius

    @property
    def knots(self) -> list[float]:
        """The angles at which slopes of sizes jump, deg."""
        scenario = self.given.scenario
        sizes = [force.size for force in scenario.forces]
        sizes += [couple.size for couple in scenario.couples]
        return sorted({x for size in sizes if isinstance(size, AngleTable) for x in size.angle_deg})

    def sought(self, degrees: float, slopes: bool = False) -> Triple:
        """Return moment and components per unit of the unknown, or their slopes per rad."""
        if self.parts is None:
            return 0.0, 0.0, 0.0
        without, with_it = (
            part.slopes(self.time, radians(degrees))
            if slopes
            else part.at(self.time, radians(degrees))
            for part in self.parts
        )
        one, two, three = ((b - a) / STEP for a, b in zip(without, with_it, strict=True))
        return one, two, three

    def terms_of_sought(self, degrees: float) -> float:
        """Return the sum of the terms of moment and friction per unit of the unknown, N m."""
        return (
            0.0 if self.parts is None else self.parts[1].scale(self.time, radians(degrees)) / STEP
        )

    def equation(self, degrees: float, settled: bool = True) -> Equation:
        """Return eq 24 at an angle, deg; settled, moments that tie with zero are zero."""
        angle = radians(degrees)
        terms, sought_terms = self.given.scale(self.time, angle), self.terms_of_sought(degrees)
        given, sought = self.given.at(self.time, angle), self.sought(degrees)
        if settled and abs(given[0]) <= ROUNDOFF * terms:
            given = 0.0, *given[1:]
        if settled and abs(sought[0]) <= ROUNDOFF * sought_terms:
            sought = 0.0, *sought[1:]
        return equation_of(given, sought, self.radius, terms)

    def enters(self, degrees: float) -> bool:
        """Return whether the unknown enters eq 24 at an angle, deg."""
        angle = radians(degrees)
        if self.parts is None:
            acting = self.unknown.label == MU_S or self.radius > 0.0
            return acting and self.reaction(angle) > 0.0
        moment, across, up = self.sought(degrees)
        entering = max(abs(moment), self.radius * hypot(across, up))
        return entering > ROUNDOFF * self.terms_of_sought(degrees)

    def reaction(self, angle: float) -> float:
        """Return the resultant of what is given, N; zero where its forces leave a tie."""
        return reaction_of(self.given, self.time, angle)


def reaction_of(loads: Sum, time: float, angle: float) -> float:
    """Return the resultant of loads at an angle, rad, in N; zero where they leave a tie."""
    _, across, up = loads.at(time, angle)
    resultant = hypot(across, up)
    return resultant if resultant > ROUNDOFF * loads.total_force(time, angle) else 0.0


def sum_of(scenario: ShaftScenario) -> Sum:
    """Return the loads of a scenario at rest."""
    return Sum(scenario, shaft_of(scenario), loads_of(scenario) + weights_of(scenario))


def balance_of(scenario: ShaftScenario, unknown: Unknown, time: float) -> Balance:
    """Return the balance at rest at a time, s."""
    if unknown.label in (MU_S, SHAFT_RADIUS):
        return Balance(sum_of(scenario), None, unknown, time)
    alone = _alone(scenario, unknown)
    without, with_it = (sum_of(_with_value(alone, unknown, x)) for x in (0.0, STEP))
    given = sum_of(_with_value(scenario, unknown, 0.0))
    return Balance(given, (without, with_it), unknown, time)


def _with_value(scenario: ShaftScenario, unknown: Unknown, value: float) -> ShaftScenario:
    """Return a scenario with a value of the unknown, which is not checked."""
    table, *inner = unknown.key.split(".")
    if table in ("forces", "couples"):
        loads = [
            load.model_copy(update=_value_of(load, unknown.name, value))
            if load.name == inner[0]
            else load
            for load in getattr(scenario, table)
        ]
        return scenario.model_copy(update={table: tuple(loads)})
    changed = {unknown.name: value}
    part = getattr(scenario, table)
    if len(inner) == 1:
        return scenario.model_copy(update={table: part.model_copy(update=changed)})
    effect = getattr(part, inner[0]).model_copy(update=changed)
    return scenario.model_copy(update={table: part.model_copy(update={inner[0]: effect})})


def _value_of(load: Force, name: str, value: float) -> dict[str, object]:
    if name != "distance":
        return {name: value}
    assert load.point is not None  # as the unknown is its distance
    x, y = (component / hypot(*load.point) for component in load.point)
    return {"point": (value * x, value * y)}


def _alone(scenario: ShaftScenario, unknown: Unknown) -> ShaftScenario:
    """Return a scenario without all that does not contain the unknown."""
    effects, table = scenario.effects, unknown.table
    needs_gravity = table == "mechanism" or unknown.name == "g" or "eccentric" in table
    loads = {
        name: tuple(x for x in getattr(scenario, name) if f"{name}.{x.name}" == table)
        for name in ("forces", "couples")
    }
    kept = effects.model_copy(
        update={
            "gravity": effects.gravity if needs_gravity else None,
            "eccentric_mass": None if table == "mechanism" else effects.eccentric_mass,
            "torsion_spring": effects.torsion_spring if "spring" in table else None,
        }
    )
    mechanism = scenario.mechanism
    if table == "effects.eccentric_mass":
        mechanism = mechanism.model_copy(update={"mass": 0.0})
    return scenario.model_copy(update={**loads, "effects": kept, "mechanism": mechanism})


def roots_at(balance: Balance, degrees: float) -> Roots:
    """Return all roots of a balance at an angle, deg."""
    angle = radians(degrees)
    if balance.solves_for_friction:
        given = balance.given.at(balance.time, angle)
        tie = ROUNDOFF * balance.given.scale(balance.time, angle)
        moment = 0.0 if abs(given[0]) <= tie else given[0]
        return _roots_of_friction(balance, moment, balance.reaction(angle))
    return roots_of(balance.equation(degrees)) if balance.enters(degrees) else Roots()


def possible_roots_at(balance: Balance, degrees: float) -> Roots:
    """Return the roots that the unknown can have: a mass, say, is not below zero."""
    return _possible(balance, roots_at(balance, degrees))


def limits_at(balance: Balance, degrees: float) -> Roots:
    """Return the limits of the possible roots where neither the unknown nor another load acts.

    There, the balance is that of the slopes.
    """
    angle = radians(degrees)
    equation = balance.equation(degrees)
    if max(abs(equation.a_0), hypot(equation.x_0, equation.y_0)) > ROUNDOFF * equation.terms:
        return Roots()
    given = balance.given.slopes(balance.time, angle)
    if balance.solves_for_friction:
        return _roots_of_friction(balance, given[0], hypot(*given[1:]))
    sought = balance.sought(degrees, slopes=True)
    return _possible(balance, roots_of(equation_of(given, sought, balance.radius)))


def _possible(balance: Balance, roots: Roots) -> Roots:
    if balance.unknown.signed:
        return roots
    return roots._replace(real=tuple(root for root in roots.real if root.value >= 0.0))


def _roots_of_friction(balance: Balance, moment: float, reaction: float) -> Roots:
    """Return mu_s or the shaft radius of impending motion, |M| = r sin(atan mu) R."""
    if not moment:
        return Roots(() if not reaction else (Root(0.0, BOTH),), every=not reaction)
    journal = balance.given.scenario.effects.shaft_friction
    assert journal is not None  # as one of its keys is the unknown
    direction, moment = 1 if moment > 0.0 else -1, abs(moment)
    if balance.unknown.label == SHAFT_RADIUS:
        limit = friction_radius(1.0, journal.mu_s) * reaction
        return Roots((Root(moment / limit, direction),) if limit else ())
    most = journal.shaft_radius * reaction
    if most - moment <= ROUNDOFF * most:
        return Roots()
    root = (most - moment) ** 0.5 * (most + moment) ** 0.5
    return Roots((Root(moment / root, direction),))


def features_at(balance: Balance, degrees: float) -> tuple[tuple[float, float], ...]:
    """Return functions of the angle whose zeros may end, join or cross roots, and their terms."""
    angle = radians(degrees)
    moment, across, up = balance.given.at(balance.time, angle)
    scale = balance.given.scale(balance.time, angle)
    if not balance.solves_for_friction:
        at_zero = abs(moment) - balance.radius * hypot(across, up)
        sought, x, y = balance.sought(degrees)
        leading = abs(sought) - balance.radius * hypot(x, y)
        return (
            (balance.equation(degrees, settled=False).margin, 1.0),
            (leading, balance.terms_of_sought(degrees)),
            (at_zero, scale),
        )
    journal = balance.given.scenario.effects.shaft_friction
    assert journal is not None  # as one of its keys is the unknown
    if balance.unknown.label == MU_S:
        most = journal.shaft_radius * hypot(across, up)
        return (moment, scale), (most - abs(moment), most + abs(moment))
    force = balance.given.total_force(balance.time, angle)
    return (moment, scale), (hypot(across, up), force)


def growth_at(balance: Balance, degrees: float, root: Root) -> float:
    """Return the slope of moment less friction over the angle with the unknown at a root.

    It is in parts of its terms, and zero where they tie: there, the root has an extremum.
    """
    angle, x = radians(degrees), root.value
    pairs = zip(balance.given.at(balance.time, angle), balance.sought(degrees), strict=True)
    _, across, up = (a + b * x for a, b in pairs)
    given = balance.given.slopes(balance.time, angle)
    sought = balance.sought(degrees, slopes=True)
    moment, d_across, d_up = (a + b * x for a, b in zip(given, sought, strict=True))
    force = hypot(across, up)
    radius = balance.radius
    if balance.solves_for_friction and force:
        radius = abs(balance.given.at(balance.time, angle)[0]) / force
    friction = radius * (across * d_across + up * d_up) / force if force else 0.0
    sizes = [abs(a) + abs(b * x) for a, b in zip(given, sought, strict=True)]
    terms = sizes[0] + radius * (sizes[1] + sizes[2])
    slope = moment - friction if root.direction in (BOTH, 1) else -moment - friction
    return slope / terms if terms else 0.0
