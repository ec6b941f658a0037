"""The smallest and the largest root of eq 24 over a turn, in each direction of impending motion.

Roots are smooth functions of the angle but at a few angles: where both join and cease to exist, or
cross; where one grows without bound; where the slope of a size jumps. These angles, the zeros of
`features_at`, cut the turn into pieces. On a piece, extrema are zeros of `growth_at` between
samples. Where a root ceases to exist at the end of a piece, its limit there counts as well, in the
direction of that root.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import cos, pi
from typing import NamedTuple

from frictionsim.mechanisms.impending_motion import BOTH, CLOCKWISE, COUNTER_CLOCKWISE, TIE
from frictionsim.mechanisms.shaft.balance import (
    Balance,
    features_at,
    growth_at,
    limits_at,
    possible_roots_at,
)
from frictionsim.solvers.root_finding import bracket_root

SAMPLES = 720  # of features, whose period is not below a quarter of a turn
MIN_SAMPLES = 24
RESOLUTION = 1e-6  # deg: what is shorter is of rounding
NEAR = 1e-6  # of a piece, from its end
FARTHER, GROWTH = 100, 5  # towards a pole, a root grows so many times from a farther angle
SUBDIVISIONS = 8
DIGITS_OF_ANGLE = 12  # deg

Function = Callable[[float], float]


class Extreme(NamedTuple):
    """The smallest or the largest root of a direction.

    Attributes
    ----------
    value : float or None
        None without a root, and without a bound.
    angle : float or None
        deg; where it is, or where it grows without bound.
    reached : bool
        Whether it is a root there; else it is the limit of the roots beside that angle.
    """

    value: float | None
    angle: float | None
    reached: bool = True


class Turn(NamedTuple):
    """The roots over a turn; both by the direction of impending motion.

    Attributes
    ----------
    smallest, largest : dict of Extreme
    missing : dict of list of (float, float)
        From which to which angle there is none, deg.
    """

    smallest: dict[int, Extreme]
    largest: dict[int, Extreme]
    missing: dict[int, list[tuple[float, float]]]


class _Piece(NamedTuple):
    begin: float
    end: float
    directions: tuple[int, ...]  # of its roots in ascending order


def over_turn(balance: Balance, turn: tuple[float, float]) -> Turn:
    """Return the extreme roots from an angle to another, deg."""
    return _Search(balance, turn).result()


class _Search:
    def __init__(self, balance: Balance, turn: tuple[float, float]) -> None:
        self._balance, self._turn = balance, turn
        self._middle = 0.5 * (turn[0] + turn[1])
        # By direction and sign: 1 for the largest, -1 for the smallest.
        self._extremes: dict[tuple[int, int], Extreme] = {}
        self._unbounded: dict[tuple[int, int], float] = {}

    def result(self) -> Turn:
        cuts = self._cuts()
        # A root at a cut may be one of both directions that it has beside it in one of them only.
        if min(abs(self._middle - angle) for angle in cuts) > RESOLUTION:
            for root in possible_roots_at(self._balance, self._middle).found:
                self._add(root.value, root.direction, self._middle)
        pieces = []
        for begin, end in pairwise(cuts):
            roots = possible_roots_at(self._balance, 0.5 * (begin + end)).found
            pieces.append(_Piece(begin, end, tuple(root.direction for root in roots)))
        for piece in pieces:
            for side in (0, 1):
                self._search_end(piece, side)
            for i in range(len(piece.directions)):
                self._search_inside(piece, i)
        both = COUNTER_CLOCKWISE, CLOCKWISE
        smallest, largest = ({s: self._extreme(s, sign) for s in both} for sign in (-1, 1))
        return Turn(smallest, largest, {s: self._missing(pieces, s) for s in both})

    def _extreme(self, direction: int, sign: int) -> Extreme:
        if (direction, sign) in self._unbounded:
            return Extreme(None, _rounded(self._unbounded[direction, sign]))
        value, angle, reached = self._extremes.get((direction, sign), Extreme(None, None))
        return Extreme(value, None if angle is None else _rounded(angle), reached)

    def _missing(self, pieces: list[_Piece], direction: int) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for begin, end, directions in pieces:
            if {direction, BOTH} & set(directions):
                continue
            if found and found[-1][1] == begin:
                begin = found.pop()[0]
            found.append((begin, end))
        return [(_rounded(begin), _rounded(end)) for begin, end in found]

    def _add(self, value: float, direction: int, angle: float, reached: bool = True) -> None:
        for s in _of(direction):
            for sign in (1, -1):
                best, at, _ = self._extremes.get((s, sign), Extreme(None, None))
                if best is not None and at is not None:
                    rise, tie = sign * (value - best), TIE * max(abs(best), abs(value))
                    nearer = abs(at - self._middle) - abs(angle - self._middle) > RESOLUTION
                    if rise < -tie or (rise <= tie and not nearer):
                        continue
                self._extremes[s, sign] = Extreme(value, angle, reached)

    def _cuts(self) -> list[float]:
        """Return the angles that cut the turn, with its ends."""
        begin, end = self._turn
        step = (end - begin) / SAMPLES
        grid = [begin + i * step for i in range(SAMPLES)] + [end]
        sampled = [features_at(self._balance, angle) for angle in grid]
        found = [begin, end, *(knot for knot in self._balance.knots if begin < knot < end)]
        for i in range(len(sampled[0])):
            size = max(features[i][1] for features in sampled)
            if not size:
                continue

            def feature(angle: float, i: int = i, size: float = size) -> float:
                return features_at(self._balance, angle)[i][0] / size

            found += _zeros(feature, grid, [features[i][0] / size for features in sampled])
        cuts: list[float] = []
        for angle in found:  # ends and knots first
            if all(abs(angle - cut) > RESOLUTION for cut in cuts):
                cuts.append(angle)
        return sorted(cuts)

    def _search_inside(self, piece: _Piece, i: int) -> None:
        """Add the extrema of a root within a piece."""
        begin, end, directions = piece

        def growth(angle: float) -> float:
            found = possible_roots_at(self._balance, angle).found
            if len(found) != len(directions):
                return 0.0
            return growth_at(self._balance, angle, found[i]._replace(direction=directions[i]))

        width = end - begin
        n = max(MIN_SAMPLES, int(SAMPLES * width / (self._turn[1] - self._turn[0])))
        shares = [0.5 - 0.5 * cos(pi * k / n) for k in range(1, n)]
        grid = [begin + width * share for share in (NEAR, *shares, 1.0 - NEAR)]
        for angle in _changes(growth, grid, [growth(angle) for angle in grid]):
            found = possible_roots_at(self._balance, angle).found
            if len(found) == len(directions):
                self._add(found[i].value, directions[i], angle)

    def _search_end(self, piece: _Piece, side: int) -> None:
        """Add the limits of the roots at an end (0, 1) of a piece."""
        angle = (piece.begin, piece.end)[side]
        inward = NEAR * (piece.end - piece.begin) * (1 - 2 * side)
        here = possible_roots_at(self._balance, angle)
        limits = limits_at(self._balance, angle)
        beside = possible_roots_at(self._balance, angle + inward).found
        farther = possible_roots_at(self._balance, angle + FARTHER * inward).found
        if not len(beside) == len(farther) == len(piece.directions):
            return
        ordered = sorted(range(len(beside)), key=lambda i: abs(beside[i].value))
        for rank, i in enumerate(ordered):
            value, direction = beside[i].value, piece.directions[i]
            # Where A = 0, a root is left for the smaller one, and the larger one has no bound. Two
            # such angles may be one cut.
            bounded = here.leading != 0 or rank < len(here.found) or here.every
            bounded &= abs(value) <= GROWTH * abs(farther[i].value) or not farther[i].value
            near = (here if bounded else limits).of(direction)
            if near:
                _, limit = min((abs(x - value), x) for x in near)
                self._add(limit, direction, angle, bounded)
            elif not bounded:
                for s in _of(direction):
                    self._unbounded.setdefault((s, 1 if value > 0.0 else -1), angle)


def _zeros(function: Function, grid: list[float], values: list[float]) -> Iterator[float]:
    """Yield the zeros of a function from its samples, also those where it touches zero."""
    yield from _changes(function, grid, values)
    for i in range(1, len(grid) - 1):
        sign = 1.0 if values[i - 1] > 0.0 else -1.0
        before, x, after = (sign * value for value in values[i - 1 : i + 2])
        touches = -TIE <= x <= min(before, after) and min(before, after) > TIE
        if not touches or 2.0 * x > max(before, after):  # not even with a corner
            continue
        angle = _lowest(function, sign, grid[i - 1], grid[i + 1])
        lowest = sign * function(angle)
        if lowest < -TIE:
            yield _zero(function, grid[i - 1], angle)
            yield _zero(function, angle, grid[i + 1])
        elif lowest <= TIE:
            yield angle


def _changes(function: Function, grid: list[float], values: list[float]) -> Iterator[float]:
    """Yield the zeros between samples of other signs; those that tie with zero do not count."""
    signed = [(x, value) for x, value in zip(grid, values, strict=True) if abs(value) > TIE]
    for (low, one), (high, other) in pairwise(signed):
        if (one > 0.0) != (other > 0.0):
            yield _zero(function, low, high)


def _zero(function: Function, low: float, high: float) -> float:
    return sum(bracket_root(function, low, high)) / 2.0


def _lowest(function: Function, sign: float, low: float, high: float) -> float:
    """Return the extremum of a function of a sign that is nearest to zero, by finer samples."""
    while True:
        step = (high - low) / SUBDIVISIONS
        grid = [low + i * step for i in range(SUBDIVISIONS + 1)]
        best = min(range(SUBDIVISIONS + 1), key=lambda i: sign * function(grid[i]))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, SUBDIVISIONS)]
        if step < 1e-14 * max(abs(low), abs(high), 1.0):
            return grid[best]


def _rounded(angle: float) -> float:
    return round(angle, DIGITS_OF_ANGLE) + 0.0  # without the sign of a zero


def _of(direction: int) -> tuple[int, ...]:
    return (COUNTER_CLOCKWISE, CLOCKWISE) if direction == BOTH else (direction,)
