"""Impending motion of a body on a dry shaft: eq 24 for one unknown, with all its real roots.

    M(x)^2 = r_s^2 |F(x)|^2,   M = a_0 + a_1 x,   F = B_0 + B_1 x

is A x^2 + 2 B x + C = 0 with A = a_1^2 - r_s^2 B_1^2 and, without the cancellation of B^2 - A C,

    B^2 - A C = r_s^2 (V^2 - r_s^2 (B_0 x B_1)^2),   V = a_0 B_1 - a_1 B_0

The sign of M(x) is the direction in which the body is about to turn. It follows from

    A M(x) = +-a_1 sqrt(B^2 - A C) - r_s^2 V . B_1

If A > 0, there is one root of each direction, and the body rests between them. If A < 0, friction
grows faster with x than the moment: there is no root, and the body always rests, or both are of one
direction, and the body moves between them.
"""

from math import copysign, frexp, hypot, inf, sqrt
from typing import NamedTuple

COUNTER_CLOCKWISE, CLOCKWISE, BOTH = 1, -1, 0

# A difference counts as zero if it is no larger, relative to the terms that it is left of. Rounding
# of the terms leaves 1e-15 of them; no arm and no coefficient of friction is known to 1e-12.
TIE = 1e-12

# Moment and components of the resultant, N m, N, N; or these per unit of the unknown.
Triple = tuple[float, float, float]


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
    found : tuple of Root
        In ascending order.
    leading : int
        Sign of A: the body rests between the roots (1), or moves between them (-1).
    every : bool
        Every value is a root.
    """

    found: tuple[Root, ...] = ()
    leading: int = 0
    every: bool = False

    def of(self, direction: int) -> list[float]:
        """Return the roots of a direction."""
        return [root.value for root in self.found if root.direction in (direction, BOTH)]


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
    if abs(equation.leading) <= TIE * equation.size:
        return _linear(equation, b, c)
    a, sign_of_a = equation.leading * (abs(a_1) + f_1), 1 if equation.leading > 0.0 else -1
    v_x, v_y = equation.across
    v, cross = hypot(v_x, v_y), abs(x_0 * y_1 - y_0 * x_1)
    tie = TIE * terms * equation.size
    vanishing = v <= tie  # moment and friction, together
    if sign_of_a < 0 and v - cross < -tie:
        return Roots((), sign_of_a)
    double = vanishing or (sign_of_a < 0 and v - cross <= tie)
    # The product of two roots does not underflow where that of the numbers does.
    root = 0.0 if double else sqrt(max(v - cross, 0.0)) * sqrt(v + cross)
    # The root of larger magnitude has no cancellation, and that of the other one is c/a over it.
    outer = -1.0 if b > 0.0 else 1.0
    numerator = -b + outer * root
    found = []
    for sign in (outer,) if double else (1.0, -1.0):
        value = numerator / a if sign == outer or not numerator else c / numerator
        turning = sign * a_1 if sign_of_a > 0 else v_x * x_1 + v_y * y_1
        direction = BOTH if vanishing else _sign(turning)
        found.append(Root(_in_units(value, equation), direction))
    return Roots(tuple(sorted(found)), sign_of_a)


def _linear(equation: Equation, b: float, c: float) -> Roots:
    """Solve 2 B x + C = 0, eq 24 where A = 0."""
    terms = equation.terms
    if abs(b) <= TIE * terms * equation.size:
        return Roots(every=abs(c) <= TIE * terms * terms)
    value = -c / (2.0 * b)
    turning = equation.a_0 + equation.a_1 * value
    tied = abs(turning) <= TIE * (terms + abs(equation.a_1 * value))
    root = Root(_in_units(value, equation), BOTH if tied else _sign(turning))
    return Roots((root,))


def _in_units(value: float, equation: Equation) -> float:
    """Return a root in its unit; zero where the terms of the balance leave a tie."""
    return 0.0 if abs(value) * equation.size <= TIE * equation.terms else value * equation.unit


def _sign(x: float) -> int:
    return int(copysign(1.0, x))
