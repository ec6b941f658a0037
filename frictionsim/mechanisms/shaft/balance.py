"""The body at rest on a dry shaft, and eq 24 for one key x of the scenario: all real roots.

Moment and components of the resultant are linear in x, as each load is a product of an arm and keys
of the scenario. They are a_0 and B_0 of the loads without x, and per unit of x a_1 and B_1:

    M(x)^2 = r_s^2 |F(x)|^2,   M = a_0 + a_1 x,   F = B_0 + B_1 x

is A x^2 + 2 B x + C = 0 with A = a_1^2 - r_s^2 B_1^2 and, without the cancellation of B^2 - A C,

    B^2 - A C = r_s^2 (V^2 - r_s^2 (B_0 x B_1)^2),   V = a_0 B_1 - a_1 B_0

The sign of M(x) is the direction in which the body is about to turn. It follows from

    A M(x) = +-a_1 sqrt(B^2 - A C) - r_s^2 V . B_1

If A > 0, there is one root of each direction, and the body rests between them. If A < 0, friction
grows faster with x than the moment: there is no root, and the body always rests, or both are of one
direction, and the body moves between them.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from math import copysign, frexp, hypot, inf, prod, radians, sqrt
from typing import NamedTuple

from frictionsim.mechanisms.effects import friction_radius
from frictionsim.mechanisms.shaft.equation import load_of
from frictionsim.mechanisms.shaft.loads import (
    ANGLE,
    COUPLE,
    THROUGH_AXIS,
    Arms,
    Load,
    acting_of,
    arms_of_weight,
    carried,
    sizes_of,
)
from frictionsim.mechanisms.shaft.schema import Force, ShaftScenario
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.signals import Constant

COUNTER_CLOCKWISE, CLOCKWISE, BOTH = 1, -1, 0

# A difference counts as zero if it is no larger, relative to the terms that it is left of. Rounding
# of the terms leaves 1e-15 of them; no arm and no coefficient of friction is known to 1e-12.
ROUNDOFF = 1e-12
# Where eq 24 is 0/0 a root is a limit. So near to it, 1e-10 of the root would be rounding.
VANISHING = 1e-5
# rad: derivatives are differences of the fourth order, good to 1e-12 with this step.
STEP = 1e-3


UNKNOWN_KEY = ("statics", "unknown")
WEIGHT_KEYS = "mechanism.mass", "effects.eccentric_mass.mass", "effects.eccentric_mass.radius"


class Unknown(NamedTuple):
    """A key for which eq 24 is solved, its name in quantities, its unit, and whether it has a sign.

    Without a sign it is not below zero.
    """

    key: str
    label: str
    unit: str
    signed: bool = True

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rpartition(".")[2]

    @property
    def is_of_friction(self) -> bool:
        """Whether it changes the friction, and neither moment nor resultant."""
        return self.key.startswith("effects.shaft_friction.")


def unknowns_of(scenario: ShaftScenario) -> Iterator[Unknown]:
    """Yield the keys for which eq 24 of a scenario can be solved."""
    effects = scenario.effects
    for force in scenario.forces:
        key, name = f"forces.{force.name}", force.name
        yield Unknown(f"{key}.size", name, "N")
        if force.cord_radius is not None:
            yield Unknown(f"{key}.cord_radius", f"{name}_cord_radius", "m")
        elif any(force.point or ()):
            yield Unknown(f"{key}.distance", f"{name}_distance", "m")
    for couple in scenario.couples:
        yield Unknown(f"couples.{couple.name}.size", couple.name, "N m")
    if effects.shaft_friction is not None:
        yield Unknown("effects.shaft_friction.mu_s", "mu_s", "1", signed=False)
        yield Unknown("effects.shaft_friction.shaft_radius", "shaft_radius", "m", signed=False)
    if effects.gravity is not None:
        yield Unknown("mechanism.mass", "mass", "kg", signed=False)
        if scenario.mechanism.mass > 0.0 or effects.eccentric_mass is not None:
            yield Unknown("effects.gravity.g", "g", "m/s^2", signed=False)
        if effects.eccentric_mass is not None:
            table = "effects.eccentric_mass"
            yield Unknown(f"{table}.mass", "eccentric_mass", "kg", signed=False)
            yield Unknown(f"{table}.radius", "eccentric_radius", "m", signed=False)
    if effects.torsion_spring is not None:
        table = "effects.torsion_spring"
        yield Unknown(f"{table}.stiffness", "stiffness", "N m/rad", signed=False)
        yield Unknown(f"{table}.free_angle_deg", "free_angle_deg", "deg")


def unknown_of(scenario: ShaftScenario) -> Unknown | None:
    """Return the unknown of the statics; raises an error if eq 24 cannot be solved for it."""
    key = None if scenario.statics is None else scenario.statics.unknown
    if key is None:
        return None
    known = {unknown.key: unknown for unknown in unknowns_of(scenario)}
    if key not in known:
        if key in WEIGHT_KEYS and scenario.effects.gravity is None:
            why = f"'{key}' does not enter eq 24: the scenario has no [effects.gravity]"
            raise inconsistent(UNKNOWN_KEY, why)
        why = f"eq 24 is not solved for '{key}'; known: {', '.join(known)}"
        raise inconsistent(UNKNOWN_KEY, why)
    return known[key]


class Root(NamedTuple):
    """A root of eq 24; its direction of impending motion is BOTH where M and F vanish together."""

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


class Acting(NamedTuple):
    """Moment, N m, components of the resultant, N, and the sum of the terms, N m."""

    moment: float
    x: float
    y: float
    terms: float


def roots_of(given: Acting, sought: Acting, radius: float) -> Roots:
    """Return all real roots of eq 24.

    Parameters
    ----------
    given : Acting
        a_0 and B_0, and the terms that these are left of.
    sought : Acting
        a_1 and B_1, per unit of the unknown.
    radius : float, m
        r_s.
    """
    terms = max(given.terms, _size(given, radius))
    # In powers of two of the terms, which are exact, squares neither overflow nor underflow.
    one, two = _power_of_two(terms), _power_of_two(_size(sought, radius))
    a_0, x_0, y_0 = given.moment / one, radius * given.x / one, radius * given.y / one
    a_1, x_1, y_1 = sought.moment / two, radius * sought.x / two, radius * sought.y / two
    terms, unit = terms / one, one / two
    f_0, f_1 = hypot(x_0, y_0), hypot(x_1, y_1)
    size, leading = max(abs(a_1), f_1), abs(a_1) - f_1
    b = a_0 * a_1 - x_0 * x_1 - y_0 * y_1
    c = (abs(a_0) - f_0) * (abs(a_0) + f_0)
    tie = ROUNDOFF * terms * size

    def root_at(x: float, direction: int) -> Root:
        return Root(0.0 if abs(x) * size <= ROUNDOFF * terms else x * unit, direction)

    if abs(leading) <= ROUNDOFF * size:  # A = 0, and 2 B x + C = 0
        if abs(b) <= tie:
            return Roots(every=abs(c) <= ROUNDOFF * terms * terms)
        x = -c / (2.0 * b)
        moment = a_0 + a_1 * x
        tied = abs(moment) <= ROUNDOFF * (terms + abs(a_1 * x))
        return Roots((root_at(x, BOTH if tied else _sign(moment)),))
    a, sign_of_a = leading * (abs(a_1) + f_1), _sign(leading)
    v_x, v_y = a_0 * x_1 - a_1 * x_0, a_0 * y_1 - a_1 * y_0  # r_s V
    v, cross = hypot(v_x, v_y), abs(x_0 * y_1 - y_0 * x_1)
    vanishing = v <= tie  # moment and friction, together
    if sign_of_a < 0 and v - cross < -tie:
        return Roots((), sign_of_a)
    double = vanishing or (sign_of_a < 0 and v - cross <= tie)
    # The product of two roots does not underflow where that of the numbers does.
    root = 0.0 if double else sqrt(max(v - cross, 0.0)) * sqrt(v + cross)
    # The root of larger magnitude has no cancellation, and that of the other one is c/a over it.
    outer = -1.0 if b > 0.0 else 1.0
    numerator = -b + outer * root
    real = []
    for sign in (outer,) if double else (1.0, -1.0):
        x = numerator / a if sign == outer or not numerator else c / numerator
        turning = sign * a_1 if sign_of_a > 0 else v_x * x_1 + v_y * y_1
        real.append(root_at(x, BOTH if vanishing else _sign(turning)))
    return Roots(tuple(sorted(real)), sign_of_a)


def _size(acting: Acting, radius: float) -> float:
    """Return the larger one of moment and friction, N m."""
    return max(abs(acting.moment), radius * hypot(acting.x, acting.y))


def _power_of_two(size: float) -> float:
    return 2.0 ** min(frexp(size)[1], 1023) if 0.0 < size < inf else 1.0


def _sign(x: float) -> int:
    return int(copysign(1.0, x))


class Term(NamedTuple):
    """A load at a time: arms x product of the factors x table(angle).

    Attributes
    ----------
    arms : Arms
    factors : dict of float
        By their keys in the scenario.
    table : callable or None
        What depends on the angle, rad: a size, or the twist of a spring.
    """

    arms: Arms
    factors: dict[str, float]
    table: Callable[[float], float] | None = None

    @property
    def load(self) -> Load:
        """The load at rest."""
        size, table = prod(self.factors.values()), self.table
        if table is None:
            return Load(self.arms, Constant(size))
        return Load(self.arms, lambda q: size * table(q), ANGLE)


def terms_of(scenario: ShaftScenario, time: float, unknown: str = "") -> Iterator[Term]:
    """Yield all loads; those that are not proportional to the unknown in two parts."""
    effects = scenario.effects
    gravity, eccentric, spring = effects.gravity, effects.eccentric_mass, effects.torsion_spring
    for name, parts in (("forces", scenario.forces), ("couples", scenario.couples)):
        for part in parts:
            key, load = f"{name}.{part.name}", load_of(part)
            turns = load.over == ANGLE
            size = {f"{key}.size": 1.0 if turns else load.at_rest(time, 0.0)}
            term = Term(load.arms, size, load.size if turns else None)
            if isinstance(part, Force) and unknown in (f"{key}.cord_radius", f"{key}.distance"):
                yield from _force_and_moment(term._replace(arms=_at_unit_distance(part)), unknown)
            else:
                yield term
    if gravity is not None:
        g = {"effects.gravity.g": gravity.g}
        yield Term(arms_of_weight(0.0, 0.0), g | {"mechanism.mass": scenario.mechanism.mass})
        if eccentric is not None:
            sought = unknown == "effects.eccentric_mass.radius"
            azimuth = radians(eccentric.azimuth_deg)
            arms = arms_of_weight(1.0 if sought else eccentric.radius, azimuth)
            term = Term(arms, g | {"effects.eccentric_mass.mass": eccentric.mass})
            yield from _force_and_moment(term, unknown) if sought else (term,)
    if spring is not None:
        k = {"effects.torsion_spring.stiffness": spring.stiffness}
        q_0 = radians(spring.free_angle_deg)
        if unknown == "effects.torsion_spring.free_angle_deg":
            yield Term(COUPLE, k | {unknown: 1.0, "rad per deg": radians(1.0)})
            q_0 = 0.0
        yield Term(COUPLE, k, lambda q: q_0 - q)


def _at_unit_distance(force: Force) -> Arms:
    if force.point is None:
        return force.model_copy(update={"cord_radius": 1.0}).arms
    x, y = (component / hypot(*force.point) for component in force.point)
    return force.model_copy(update={"point": (x, y)}).arms


def _force_and_moment(term: Term, key: str) -> Iterator[Term]:
    """Yield the force of a load, and its moment per metre of the arm that is the unknown."""
    yield term._replace(arms=Arms(*((0.0, x, y) for _, x, y in term.arms)))
    yield Term(term.arms.moments, term.factors | {key: 1.0}, term.table)


class Sum:
    """The loads at rest over the angle q, rad."""

    def __init__(self, terms: Iterable[Term], radius: float) -> None:
        loads = [term.load for term in terms]
        self._acting, self._sizes, self._radius = acting_of(loads), sizes_of(loads, radius), radius
        self._varying = sizes_of([load for load in loads if not load.is_constant], radius)
        forces = [load._replace(arms=THROUGH_AXIS) for load in loads if load.arms.is_force]
        self._forces = sizes_of(forces, 1.0)
        self.at = lru_cache(maxsize=1)(self._at)  # asked for several times at each angle

    def _at(self, q: float) -> Acting:
        """Return what acts at an angle; the moment is zero where its terms leave a tie."""
        _, moment, x, y, _, _ = self._acting(0.0, q, 0.0)
        terms = self._sizes(0.0, q)
        return Acting(moment if abs(moment) > ROUNDOFF * terms else 0.0, x, y, terms)

    def slopes(self, q: float) -> Acting:
        """Return the derivatives over the angle, per rad, of what acts."""
        rows = zip(*(self.at(q + i * STEP)[:3] for i in (-2, -1, 1, 2)), strict=True)
        moment, x, y = ((8.0 * (c - b) - (d - a)) / (12.0 * STEP) for a, b, c, d in rows)
        return Acting(moment, x, y, 0.0)

    def reaction(self, q: float) -> float:
        """Return the size of the resultant, N; zero where the forces leave a tie."""
        _, x, y, _ = self.at(q)
        return hypot(x, y) if hypot(x, y) > ROUNDOFF * self._forces(0.0, q) else 0.0

    def vanishes(self, q: float) -> bool:
        """Return whether moment and friction vanish, also relative to those a radian beside."""
        acting = self.at(q)
        terms = acting.terms + self._varying(0.0, q + 1.0)
        return _size(acting, self._radius) <= VANISHING * terms


class Balance:
    """Eq 24 of a scenario for an unknown at a time, s; of steady motion with r_k, not r_s."""

    def __init__(
        self, scenario: ShaftScenario, unknown: Unknown, time: float, steady: bool = False
    ) -> None:
        self._unknown, self._journal, self._radius = unknown, scenario.effects.shaft_friction, 0.0
        if journal := self._journal:
            radius = journal.kinetic_radius if steady else journal.static_radius
            # Any coefficient may be the value: the friction radius is at most that of the shaft.
            self._radius = journal.shaft_radius if unknown.is_of_friction else radius
        terms = terms_of(scenario, time, unknown.key)
        normal_load, given, sought = (journal.normal_load if journal else None), [], []
        for term in carried(terms, normal_load, lambda arms, size: Term(arms, {"N": size})):
            if unknown.key in term.factors:
                table = None if unknown.name == "size" else term.table
                sought.append(Term(term.arms, term.factors | {unknown.key: 1.0}, table))
            else:
                given.append(term)
        self._given, self._sought = Sum(given, self._radius), Sum(sought, self._radius)

    def enters(self, q: float) -> bool:
        """Return whether the unknown enters eq 24 at an angle, rad."""
        if self._journal is not None and self._unknown.is_of_friction:
            acts = self._unknown.name == "mu_s" or self._journal.mu_s > 0.0
            return acts and self._given.reaction(q) > 0.0
        sought = self._sought.at(q)
        return _size(sought, self._radius) > ROUNDOFF * sought.terms

    def vanishes(self, q: float) -> bool:
        """Return whether eq 24 is 0/0 at an angle, rad: neither the unknown nor the others act."""
        return self._sought.vanishes(q) and self._given.vanishes(q)

    def moves(self, q: float, value: float, direction: int) -> bool:
        """Return whether the moment with a value of the unknown is above the largest friction."""
        given, sought = self._given.at(q), self._sought.at(q)
        moment, x, y = (a + value * b for a, b in zip(given[:3], sought[:3], strict=True))
        return direction * moment > self._radius * hypot(x, y)

    def roots(self, q: float, limits: bool = False) -> Roots:
        """Return all roots at an angle, rad.

        With limits, also those where eq 24 is 0/0, from the balance of the slopes over the angle.
        """
        if limits and self.vanishes(q):
            given, sought = self._given.slopes(q), self._sought.slopes(q)
            if self._unknown.is_of_friction:
                return self._roots_of_friction(given.moment, hypot(given.x, given.y))
        elif not self.enters(q):
            return Roots()
        else:
            given, sought = self._given.at(q), self._sought.at(q)
            if self._unknown.is_of_friction:
                return self._roots_of_friction(given.moment, self._given.reaction(q))
        return roots_of(given, sought, self._radius)

    def _roots_of_friction(self, moment: float, reaction: float) -> Roots:
        """Return mu_s or the shaft radius of impending motion, |M| = r sin(atan mu) R."""
        if not moment:
            return Roots(() if not reaction else (Root(0.0, BOTH),), every=not reaction)
        assert self._journal is not None  # as one of its keys is the unknown
        direction, moment = _sign(moment), abs(moment)
        if self._unknown.name == "shaft_radius":
            limit = friction_radius(1.0, self._journal.mu_s) * reaction
            return Roots((Root(moment / limit, direction),) if limit else ())
        most = self._journal.shaft_radius * reaction
        if most - moment <= ROUNDOFF * most:
            return Roots()
        return Roots((Root(moment / (sqrt(most - moment) * sqrt(most + moment)), direction),))
