"""The smallest and the largest root of eq 24 over a turn, in each direction of impending motion.

Roots are smooth functions of the angle but at a few angles: where both join and cease to exist, or
cross; where one grows without bound; where the slope of a size jumps. These angles, the zeros of
`Roots.features`, cut the turn into pieces. On a piece from a to b, the roots are smooth functions
of u from 0 to 180 deg with the angle (a + b)/2 - (b - a)/2 cos u, even where they join: there, one
is the continuation of the other, which is at 360 deg - u. Extrema lie between samples and are
located as zeros of the derivative. Where a root ceases to exist at the end of a piece, its limit
there counts as well, in the direction of that root.

Zeros, extrema and limits of a function of one variable in numbers of many digits.
"""

from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from functools import cache
from itertools import pairwise
from math import comb
from typing import Any, NamedTuple

from frictionsim.mechanisms.shaft.impending_motion import (
    BOTH,
    CLOCKWISE,
    COUNTER_CLOCKWISE,
    Root,
    Roots,
)
from frictionsim.mechanisms.shaft.many_digits import PI, cosine_and_sine

# deg: of zeros, so that what vanishes there does; of extrema, whose values are exact to its square.
RESOLUTION = Decimal(10) ** -45
RESOLUTION_OF_EXTREMA = Decimal(10) ** -20
# Central differences over it are exact to 20 digits.
DIFFERENCE = Decimal(10) ** -18
MAX_ITERATIONS = 200
# Of the polynomial through as many values that gives a limit.
DEGREE = 8

Function = Callable[[Decimal], Decimal | None]


def zeros(
    function: Callable[[Decimal], Decimal], grid: list[Decimal], values: list[Decimal]
) -> Iterator[Decimal]:
    """Yield the zeros of a function from its samples, also those where it touches zero."""
    for i, (low, high) in enumerate(pairwise(grid)):
        if values[i] * values[i + 1] < 0:
            yield zero(function, low, high)
    for i, x in enumerate(values):
        inside = 0 < i < len(values) - 1
        if x == 0 and (not inside or values[i - 1] or values[i + 1]):
            yield grid[i]
        elif inside and 0 < abs(x) <= min(abs(values[i - 1]), abs(values[i + 1])):
            yield from _beside_extremum(function, grid[i - 1], grid[i + 1], x)


def _beside_extremum(
    function: Callable[[Decimal], Decimal], low: Decimal, high: Decimal, sample: Decimal
) -> Iterator[Decimal]:
    """Yield the zeros near an extremum that samples do not show: one that touches, or two."""
    angle = extremum(function, low, high)
    if angle is None:
        return
    x = function(angle)
    if x == 0:
        yield angle
    elif x * sample < 0:
        for end in (low, high):
            if function(end) * x < 0:
                yield zero(function, *sorted((end, angle)))


def zero(
    function: Callable[[Decimal], Decimal],
    low: Decimal,
    high: Decimal,
    resolution: Decimal = RESOLUTION,
) -> Decimal:
    """Return the zero of a function between two angles of other signs, by the Illinois method."""
    f_low, f_high = function(low), function(high)
    for _ in range(MAX_ITERATIONS):
        if high - low <= resolution:
            break
        middle = high - f_high * (high - low) / (f_high - f_low)
        # Away from the ends, so that both come near.
        middle = min(max(middle, low + resolution / 4), high - resolution / 4)
        x = function(middle)
        if x == 0:
            return middle
        if (x < 0) == (f_low < 0):
            low, f_low, f_high = middle, x, f_high / 2
        else:
            high, f_high, f_low = middle, x, f_low / 2
    return (low + high) / 2


def extremum(function: Function, low: Decimal, high: Decimal) -> Decimal | None:
    """Return the zero of the derivative of a function between two angles; None if there is none."""

    def slope(angle: Decimal) -> Decimal:
        before, after = function(angle - DIFFERENCE), function(angle + DIFFERENCE)
        return Decimal(0) if before is None or after is None else after - before

    at_low, at_high = slope(low), slope(high)
    if at_low == 0 or at_high == 0:
        return low if at_low == 0 else high
    return zero(slope, low, high, RESOLUTION_OF_EXTREMA) if at_low * at_high < 0 else None


def limit_at_zero(function: Function, step: Decimal) -> Decimal | None:
    """Return the limit of a smooth function at zero from its values at multiples of a step.

    It is exact to the eighth power of the step. None where the function has no value.
    """
    found = Decimal(0)
    for i in range(1, DEGREE + 1):
        value = function(i * step)
        if value is None:
            return None
        found -= (-1) ** i * comb(DEGREE, i) * value
    return found


# Of features, whose period is not below a quarter of a turn.
SAMPLES = 720
MIN_SAMPLES = 24
# Values are equal if they differ by less: angles of extrema are those of values, not of noise.
SAME = Decimal(10) ** -30
# Beside a pole, a root is at least so many times as large at a hundredth of the distance.
GROWTH = 5
BESIDE = tuple(map(Decimal, ("1e-4", "1e-6", "1e-9")))  # deg
PAD = Decimal(1)  # deg, of a periodic balance, so that its ends are within
# What is left of a value that is zero by the resolution of its angle, of the roots of a turn; near
# zero a root may go with the square root of the angle.
ZERO_OF_ROOTS = Decimal(10) ** -16
DIGITS_OF_ANGLE = 16  # deg
MIN_GAP = Decimal(10) ** -9  # deg, without a root: shorter ones are of the numbers' rounding
# A root at the end of a piece is the limit of one on it if they agree to so many digits. The limit
# is from values this far from the end and eight times as far, rad: where a root still has more
# digits than those of the scenario.
AGREEMENT = Decimal(10) ** -9
FROM_END = Decimal(10) ** -11


class Extreme(NamedTuple):
    """The smallest or the largest root of a direction.

    Attributes
    ----------
    value : Decimal or None
        None without a root, and without a bound.
    angle : Decimal or None
        deg; where it is, or where it grows without bound.
    reached : bool
        Whether it is a root there; else it is the limit of the roots beside that angle.
    """

    value: Decimal | None
    angle: Decimal | None
    reached: bool = True


class Turn(NamedTuple):
    """The roots over a turn; both by the direction of impending motion.

    Attributes
    ----------
    smallest, largest : dict of Extreme
    missing : dict of list of (Decimal, Decimal)
        From which to which angle there is none, deg.
    """

    smallest: dict[int, Extreme]
    largest: dict[int, Extreme]
    missing: dict[int, list[tuple[Decimal, Decimal]]]


class _Piece(NamedTuple):
    begin: Decimal
    end: Decimal
    directions: tuple[int, ...]  # of its roots in ascending order


def over_turn(
    roots_at: Callable[[Decimal], Roots],
    turn: tuple[Decimal, Decimal],
    knots: Iterable[Decimal] = (),
    periodic: bool = True,
) -> Turn:
    """Return the extreme roots over a turn.

    Parameters
    ----------
    roots_at : callable
        The roots at an angle, deg.
    turn : (Decimal, Decimal), deg
        From which to which angle.
    knots : iterable of Decimal, deg
        Where slopes of the balance jump.
    periodic : bool
        Whether it is the same after a turn.
    """
    return _Search(cache(roots_at), turn, periodic).result(knots)


class _Search:
    def __init__(
        self,
        roots_at: Callable[[Decimal], Roots],
        turn: tuple[Decimal, Decimal],
        periodic: bool,
    ) -> None:
        self._roots_at, self._turn, self._periodic = roots_at, turn, periodic
        pad = PAD if periodic else Decimal(0)
        self._begin, self._end = turn[0] - pad, turn[1] + pad
        # By direction and sign: 1 for the largest, -1 for the smallest.
        self._extremes: dict[tuple[int, int], Extreme] = {}
        self._unbounded: dict[tuple[int, int], Decimal] = {}
        self._size = Decimal(0)  # of most roots

    def result(self, knots: Iterable[Decimal]) -> Turn:
        cuts = self._cuts(knots)
        middle = (self._turn[0] + self._turn[1]) / 2
        # A root at a cut may be one of both directions that it has beside it in one of them only.
        if min(abs(middle - angle) for angle in cuts) > RESOLUTION_OF_EXTREMA * 1000:
            for root in self._roots_at(middle).found:
                self._add(root.value, root.direction, middle)
        pieces = [
            _Piece(begin, end, tuple(root.direction for root in self._within(begin, end).found))
            for begin, end in pairwise(cuts)
        ]
        for piece in pieces:
            self._search(piece)
        for angle in cuts:
            self._search_across(angle, max(b - a for a, b in pairwise(cuts)))
        sides = {
            sign: {s: self._extreme(s, sign) for s in (COUNTER_CLOCKWISE, CLOCKWISE)}
            for sign in (-1, 1)
        }
        missing = {s: self._missing(pieces, s) for s in (COUNTER_CLOCKWISE, CLOCKWISE)}
        return Turn(sides[-1], sides[1], missing)

    def _within(self, begin: Decimal, end: Decimal) -> Roots:
        return self._roots_at((begin + end) / 2)

    def _extreme(self, direction: int, sign: int) -> Extreme:
        if (direction, sign) in self._unbounded:
            return Extreme(None, _rounded(self._unbounded[direction, sign]))
        value, angle, reached = self._extremes.get((direction, sign), Extreme(None, None))
        return Extreme(value, None if angle is None else _rounded(angle), reached)

    def _missing(self, pieces: list[_Piece], direction: int) -> list[tuple[Decimal, Decimal]]:
        found: list[tuple[Decimal, Decimal]] = []
        for piece in pieces:
            begin, end = max(piece.begin, self._turn[0]), min(piece.end, self._turn[1])
            if {direction, BOTH} & set(piece.directions) or end - begin < MIN_GAP:
                continue
            if found and found[-1][1] == begin:
                begin = found.pop()[0]
            found.append((begin, end))
        return found

    def _in_turn(self, angle: Decimal) -> Decimal:
        begin, end = self._turn
        if not self._periodic:  # beyond an end by rounding
            return min(max(angle, begin), end)
        return angle + 360 if angle < begin else angle - 360 if angle > end else angle

    def _add(self, value: Decimal, direction: int, angle: Decimal, reached: bool = True) -> None:
        if abs(value) <= ZERO_OF_ROOTS * self._size:
            value = Decimal(0)
        angle = self._in_turn(angle)
        middle = (self._turn[0] + self._turn[1]) / 2
        for s in _of(direction):
            for sign in (1, -1):
                best, at, _ = self._extremes.get((s, sign), Extreme(None, None))
                if best is not None and at is not None:
                    rise, tie = sign * (value - best), SAME * max(abs(best), abs(value))
                    nearer = abs(at - middle) - abs(angle - middle) > RESOLUTION_OF_EXTREMA * 1000
                    if rise < -tie or (rise <= tie and not nearer):
                        continue
                self._extremes[s, sign] = Extreme(value, angle, reached)

    # --- where the turn is cut

    def _cuts(self, knots: Iterable[Decimal]) -> list[Decimal]:
        """Return the angles that cut the turn, with its ends."""
        step = (self._end - self._begin) / SAMPLES
        grid = [self._begin + i * step for i in range(SAMPLES + 1)]
        found = {self._begin, self._end, *(k for k in knots if self._begin < k < self._end)}
        sampled = [self._roots_at(angle).features for angle in grid]
        sizes = sorted(abs(root.value) for angle in grid for root in self._roots_at(angle).found)
        self._size = sizes[len(sizes) // 2] if sizes else self._size
        for i in range(min(map(len, sampled))):

            def feature(angle: Decimal, i: int = i) -> Decimal:
                features = self._roots_at(angle).features
                return features[i]

            found.update(zeros(feature, grid, [features[i] for features in sampled]))
        cuts: list[Decimal] = []
        for angle in sorted(found):
            if not cuts or angle - cuts[-1] > RESOLUTION_OF_EXTREMA * 1000:
                cuts.append(angle)
        return cuts

    # --- a piece

    def _search(self, piece: _Piece) -> None:
        """Add the extrema of a piece."""
        begin, end, directions = piece
        if not directions:
            return
        value = self._curve(piece)
        growing = [self._unbounded_at(piece, angle) for angle in (begin, end)]
        n = max(MIN_SAMPLES, int(SAMPLES * (end - begin) / (self._end - self._begin)))
        step = Decimal(180) / n
        count = 2 * n if len(directions) == 2 else n + 1
        found: list[Decimal | None] = []
        for i in range(count):
            at_pole = (i == 0 and growing[0]) or (i == n and growing[1])
            found.append(None if at_pole else value(i * step))
        # Of one root, the first and the last sample have no neighbours.
        inside = range(count) if count == 2 * n else range(1, n)
        for i in inside:
            samples = found[i - 1], found[i], found[(i + 1) % count]
            if None not in samples:
                self._refine(piece, value, i * step, step, samples)
        for root in range(len(directions)):
            for side in (0, 1):
                if root not in growing[side]:
                    self._search_end(piece, value, (root, side), step)

    def _search_end(
        self, piece: _Piece, value: Function, where: tuple[int, int], step: Decimal
    ) -> None:
        """Add the limit of a root (0, 1) at an end (0, 1) of a piece, and an extremum beside it."""
        root, side = where
        toward = 1 if root == side else -1

        def from_end(distance: Decimal) -> Decimal | None:
            return value(180 * side + toward * distance)

        angle, direction = (piece.begin, piece.end)[side], piece.directions[root]
        width = (piece.end - piece.begin) * PI / 180
        near = (4 * FROM_END / width).sqrt() * 180 / PI
        limit = limit_at_zero(from_end, near) if near * 8 < step else None
        here = [other.value for other in self._roots_at(angle).found]
        if limit is not None:
            size = max(abs(limit), abs(from_end(Decimal(90)) or Decimal(0)))
            off, exact = min(((abs(x - limit), x) for x in here), default=(size, limit))
            reached = off <= AGREEMENT * size and bool(here)
            self._add(exact if reached else limit, direction, angle, reached)
        elif len(here) == len(piece.directions):
            self._add(here[root], direction, angle)
        # The samples there have a neighbour at the end, where another root may be.
        at = extremum(from_end, min(near, step), 2 * step)
        if at is not None and (best := from_end(at)) is not None:
            self._add(best, direction, _angle_of(piece, 180 * side + toward * at))

    def _refine(
        self, piece: _Piece, value: Function, u: Decimal, step: Decimal, samples: Any
    ) -> None:
        """Add the extremum near a sample, if there is one."""
        before, x, after = samples
        tie = SAME * max(map(abs, samples))
        for sign in (1, -1):
            rise, fall = sign * (x - before), sign * (x - after)
            if rise < -tie or fall < -tie or max(rise, fall) <= tie:
                continue
            for at in (u, extremum(value, u - step, u + step)):
                if at is not None and (best := value(at)) is not None:
                    direction = piece.directions[0 if at % 360 <= 180 and at >= 0 else -1]
                    self._add(best, direction, _angle_of(piece, at))

    def _curve(self, piece: _Piece) -> Function:
        """Return the roots as a function of u."""
        count = len(piece.directions)

        def value(u: Decimal) -> Decimal | None:
            u %= 360
            u = u + 360 if u < 0 else u
            found = self._roots_at(_angle_of(piece, u)).found
            if not found or (count == 1 and len(found) != 1):
                return None
            return (found[0] if u <= 180 else found[-1]).value

        return value

    # --- poles

    def _unbounded_at(self, piece: _Piece, angle: Decimal) -> set[int]:
        """Return which roots of a piece grow without bound towards an end of it."""
        toward = 1 if angle == piece.begin else -1
        growing = set[int]()
        for distance in BESIDE:
            reach = toward * min(distance, (piece.end - piece.begin) / 4)
            far, near = (self._roots_at(angle + x).found for x in (reach, reach / 100))
            if len(near) == len(far):  # in the same order on the whole piece
                pairs = enumerate(zip(near, far, strict=True))
                growing |= {i for i, (x, y) in pairs if abs(x.value) > GROWTH * abs(y.value) > 0}
        near = self._roots_at(angle + toward * min(BESIDE[-1], piece.end - piece.begin) / 4).found
        growing &= set(range(len(near)))
        for i in growing:
            sign = 1 if near[i].value > 0 else -1
            for s in _of(near[i].direction):
                self._unbounded.setdefault((s, sign), self._in_turn(angle))
        return growing

    def _search_across(self, angle: Decimal, width: Decimal) -> None:
        """Add an extremum near a cut of the root that goes on there."""
        here = self._roots_at(angle).found
        reach = width / 1000
        if len(here) != 1 or not self._begin + reach < angle < self._end - reach:
            return
        at = here[0]

        def nearest(where: Decimal) -> Root | None:
            found = self._roots_at(where).found
            return min(found, key=lambda root: abs(root.value - at.value), default=None)

        def value(where: Decimal) -> Decimal | None:
            root = nearest(where)
            return None if root is None else root.value

        before, after = nearest(angle - reach), nearest(angle + reach)
        if before is None or after is None or before.direction != after.direction:
            return
        tie = SAME * abs(at.value)
        for sign in (1, -1):
            if sign * (at.value - before.value) > tie and sign * (at.value - after.value) > tie:
                where = extremum(value, angle - reach, angle + reach)
                if where is not None and (best := value(where)) is not None:
                    self._add(best, before.direction, where)


def _rounded(angle: Decimal) -> Decimal:
    return round(angle, DIGITS_OF_ANGLE) + 0  # without the sign of a zero


def _of(direction: int) -> tuple[int, ...]:
    return (COUNTER_CLOCKWISE, CLOCKWISE) if direction == BOTH else (direction,)


def _angle_of(piece: _Piece, u: Decimal) -> Decimal:
    c, _ = cosine_and_sine(u)
    return (piece.begin + piece.end) / 2 - (piece.end - piece.begin) / 2 * c
