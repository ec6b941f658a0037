"""Impending motion of a body on a dry shaft: eq 24 for one unknown, with all its real roots.

    M(x)^2 = r_s^2 |F(x)|^2,   M = a_0 + a_1 x,   F = B_0 + B_1 x

is A x^2 + 2 B x + C = 0 with A = a_1^2 - r_s^2 B_1^2 and, without the cancellation of B^2 - A C,

    B^2 - A C = r_s^2 (V^2 - r_s^2 (B_0 x B_1)^2),   V = a_0 B_1 - a_1 B_0

The sign of M(x) is the direction in which the body is about to turn. It follows from

    A M(x) = +-a_1 sqrt(B^2 - A C) - r_s^2 V . B_1

which keeps its digits however small the friction is. If A > 0, there is one root of each direction,
and the body rests between them. If A < 0, friction grows faster with x than the moment: there is no
root, and the body always rests, or both are of one direction, and the body moves between them.
"""

from decimal import Decimal
from typing import NamedTuple

from frictionsim.mechanisms.shaft.balance import Balance, Values

COUNTER_CLOCKWISE, CLOCKWISE, BOTH = 1, -1, 0

# A few units in the last place of double precision: what is left by the rounding of arms and
# coefficients in a scenario is none. A root farther than its inverse would be one of rounding.
ROUNDING = Decimal(2) ** -50
# Of these numbers themselves, and of a function of the angle near its zeros.
EXACT = Decimal(10) ** -45
NEGLIGIBLE = Decimal(10) ** -30
ZERO = Decimal(0)


class Root(NamedTuple):
    """A root of eq 24.

    Attributes
    ----------
    value : Decimal
    direction : int
        Of impending motion: 1 counter-clockwise, -1 clockwise; 0 both, where moment and friction
        vanish together.
    """

    value: Decimal
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
    features : tuple of Decimal
        Functions of the angle whose zeros may end, join or cross roots; of the size of 1.
    at_zero : Decimal
        The excess of friction with the unknown zero, C, in units of its largest term: where it
        vanishes, a root passes zero.
    """

    found: tuple[Root, ...]
    leading: int = 0
    every: bool = False
    features: tuple[Decimal, ...] = ()
    at_zero: Decimal = ZERO

    def of(self, direction: int) -> list[Decimal]:
        """Return the roots of a direction."""
        return [root.value for root in self.found if root.direction in (direction, BOTH)]


def possible_roots_at(balance: Balance, degrees: Decimal) -> Roots:
    """Return the roots that the unknown can have: a mass, say, is not below zero."""
    roots = roots_at(balance, degrees)
    assert balance.unknown is not None  # as in `roots_at`
    if balance.unknown.signed or balance.unknown.label in ("mu_s", "shaft_radius"):
        return roots
    found = roots.found
    if not roots.at_zero:  # one is zero, or two that join there
        least = min((abs(root.value) for root in found), default=ZERO)
        found = tuple(root._replace(value=ZERO) if abs(root.value) <= 2 * least else root
                      for root in found)  # fmt: skip
    return roots._replace(
        found=tuple(root for root in found if root.value >= 0),
        features=(*roots.features, roots.at_zero),
    )


def roots_at(balance: Balance, degrees: Decimal) -> Roots:
    """Return all roots of a balance at an angle, deg."""
    given = balance.given.at(degrees)
    assert balance.unknown is not None  # asked by the caller
    if balance.unknown.label == "mu_s":
        return _coefficients(given, balance.given.sizes[0], balance.shaft_radius)
    if balance.unknown.label == "shaft_radius":
        return _radii(given, balance.given.sizes[0], balance.mu)
    sought, radius = balance.sought.at(degrees), balance.friction_radius
    moment, component = balance.given.sizes
    roots = roots_of(given, sought, radius, EXACT * (moment + radius * component))
    # What is left of an unknown that drops out here is of the rounding of these numbers.
    return roots if _has_part(balance, sought) else roots._replace(found=())


def enters(balance: Balance, degrees: Decimal) -> bool:
    """Return whether the unknown enters eq 24 at an angle, deg."""
    assert balance.unknown is not None  # asked by the caller
    if balance.unknown.label in ("mu_s", "shaft_radius"):
        reaction = _length(*balance.given.at(degrees)[1:])
        acting = balance.mu > 0 or balance.unknown.label == "mu_s"
        return acting and reaction > EXACT * balance.given.sizes[1]
    return _has_part(balance, balance.sought.at(degrees))


def _has_part(balance: Balance, sought: Values) -> bool:
    """Return whether an unknown with this moment and these components is in eq 24."""
    moment, across, up = sought
    arm, component = balance.sought.sizes
    radius = balance.friction_radius
    entering = max(abs(moment), radius * max(abs(across), abs(up)))
    return entering > EXACT * (arm + radius * component)


def roots_of(given: Values, sought: Values, radius: Decimal, negligible: Decimal = ZERO) -> Roots:
    """Solve eq 24.

    Parameters
    ----------
    given : (Decimal, Decimal, Decimal), N m, N, N
        a_0 and B_0.
    sought : (Decimal, Decimal, Decimal)
        a_1 and B_1, per unit of the unknown; not all zero.
    radius : Decimal, m
        r_s.
    negligible : Decimal, N m
        A moment that is one of the rounding of these numbers: a root is zero if its is not larger.
    """
    a_0, x_0, y_0 = given[0], radius * given[1], radius * given[2]
    a_1, x_1, y_1 = sought[0], radius * sought[1], radius * sought[2]
    f_0, f_1 = _length(x_0, y_0), _length(x_1, y_1)
    v_x, v_y, cross = a_0 * x_1 - a_1 * x_0, a_0 * y_1 - a_1 * y_0, x_0 * y_1 - y_0 * x_1
    a = (abs(a_1) - f_1) * (abs(a_1) + f_1)
    b = a_0 * a_1 - x_0 * x_1 - y_0 * y_1
    c = (abs(a_0) - f_0) * (abs(a_0) + f_0)
    v, terms = _length(v_x, v_y), abs(a_0) * f_1 + abs(a_1) * f_0
    discriminant = (v - abs(cross)) * (v + abs(cross))
    tie = ROUNDING * (terms + f_0 * f_1)
    size, known = max(abs(a_1), f_1), max(abs(a_0), f_0)
    features = (
        _feature(discriminant, (tie / ROUNDING) ** 2),
        _feature(a, size * size),
        _feature(a_1, size),
    )
    at_zero = _feature(c, known * known)
    if abs(a) <= ROUNDING * size * size:
        linear = _linear((a_0, a_1), b, c, known)
        return linear._replace(features=features, at_zero=at_zero)
    leading = 1 if a > 0 else -1
    if discriminant < -tie * tie:
        return Roots((), leading, features=features, at_zero=at_zero)
    vanishing = v <= ROUNDING * terms  # moment and friction, together
    root = ZERO if vanishing else max(discriminant, ZERO).sqrt()
    # The root of larger magnitude has no cancellation, and that of the other one is c/a over it.
    outer = -1 if b > 0 else 1
    numerator = -b + outer * root
    found = []
    for sign in (1, -1) if root else (outer,):
        value = numerator / a if sign == outer else c / numerator
        if abs(value) * size <= negligible:
            value = ZERO
        turning = leading * (sign * a_1 * root - v_x * x_1 - v_y * y_1)
        found.append(Root(value, BOTH if vanishing else _sign(turning)))
    return Roots(tuple(sorted(found)), leading, features=features, at_zero=at_zero)


def _linear(moment: tuple[Decimal, Decimal], b: Decimal, c: Decimal, size: Decimal) -> Roots:
    """Solve 2 B x + C = 0, eq 24 where A = 0, with the largest term of C, N m."""
    a_0, a_1 = moment
    if abs(b) <= ROUNDING * size * abs(a_1):
        return Roots((), every=abs(c) <= ROUNDING * size * size)
    value = -c / (2 * b)
    turning = a_0 + a_1 * value
    tied = abs(turning) <= ROUNDING * (abs(a_0) + abs(a_1 * value))
    return Roots((Root(value, BOTH if tied else _sign(turning)),))


def _coefficients(given: Values, terms: Decimal, shaft_radius: Decimal) -> Roots:
    """Return mu_s of impending motion, |M| = r sin(atan mu) R, with the terms of M, N m."""
    moment, most = abs(given[0]), shaft_radius * _length(*given[1:])
    difference = (most - moment) * (most + moment)
    size = max(moment, most)
    features = _feature(given[0], size), _feature(difference, size * size)
    if moment <= EXACT * terms:
        every = most <= EXACT * terms
        return Roots(() if every else (Root(ZERO, BOTH),), every=every, features=features)
    if difference <= ROUNDING * most * most:
        return Roots((), features=features)
    return Roots((Root(moment / difference.sqrt(), _sign(given[0])),), features=features)


def _radii(given: Values, terms: Decimal, mu: Decimal) -> Roots:
    """Return the shaft radius of impending motion, |M| = r sin(atan mu) R."""
    moment, most = abs(given[0]), _length(*given[1:]) * mu / (1 + mu * mu).sqrt()
    size = moment + most
    features = _feature(given[0], size), _feature(most * most, size * size)
    if moment <= EXACT * terms:
        every = most <= EXACT * terms
        return Roots(() if every else (Root(ZERO, BOTH),), every=every, features=features)
    if most <= EXACT * size:
        return Roots((), features=features)
    return Roots((Root(moment / most, _sign(given[0])),), features=features)


def _length(x: Decimal, y: Decimal) -> Decimal:
    return (x * x + y * y).sqrt()


def _sign(x: Decimal) -> int:
    return 1 if x > 0 else -1


def _feature(x: Decimal, size: Decimal) -> Decimal:
    """Return a function in units of the largest it may be; zero where it is one of rounding."""
    share = x / size if size else ZERO
    return share if abs(share) > NEGLIGIBLE else ZERO
