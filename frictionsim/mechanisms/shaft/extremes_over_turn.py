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

from frictionsim.mechanisms.impending_motion import CLOCKWISE, COUNTER_CLOCKWISE, TIE, Root
from frictionsim.mechanisms.shaft.balance import (
    Balance,
    features_at,
    growth_at,
    limits_at,
    possible_roots_at,
)
from frictionsim.solvers.root_finding import bracket_root

BOTH_DIRECTIONS = COUNTER_CLOCKWISE, CLOCKWISE
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
    """A part of the turn between two cuts.

    A cut is a list of angles, deg: several where zeros of features are closer than RESOLUTION, as
    those of |M| - r_s F about a zero of M with little friction. Extremes may be at any of them.
    """

    first: list[float]
    last: list[float]
    counts: dict[int, int]  # of its roots by direction

    @property
    def begin(self) -> float:
        return max(self.first)

    @property
    def end(self) -> float:
        return min(self.last)


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
        if min(abs(self._middle - angle) for cut in cuts for angle in cut) > RESOLUTION:
            for s, values in self._roots(self._middle).items():
                for value in values:
                    self._add(value, s, self._middle)
        pieces = []
        for first, last in pairwise(cuts):
            roots = self._roots(0.5 * (max(first) + min(last)))
            pieces.append(_Piece(first, last, {s: len(roots[s]) for s in BOTH_DIRECTIONS}))
        for piece in pieces:
            inward = NEAR * (piece.end - piece.begin)
            for angle in piece.first:
                self._search_end(piece, angle, piece.begin, inward)
            for angle in piece.last:
                self._search_end(piece, angle, piece.end, -inward)
            for s, count in piece.counts.items():
                for i in range(count):
                    self._search_inside(piece, s, i)
        smallest, largest = (
            {s: self._extreme(s, sign) for s in BOTH_DIRECTIONS} for sign in (-1, 1)
        )
        return Turn(smallest, largest, {s: self._missing(pieces, s) for s in BOTH_DIRECTIONS})

    def _roots(self, angle: float) -> dict[int, list[float]]:
        """Return the possible roots at an angle by direction, each in ascending order."""
        roots = possible_roots_at(self._balance, angle)
        return {s: roots.of(s) for s in BOTH_DIRECTIONS}

    def _extreme(self, direction: int, sign: int) -> Extreme:
        if (direction, sign) in self._unbounded:
            return Extreme(None, _rounded(self._unbounded[direction, sign]))
        value, angle, reached = self._extremes.get((direction, sign), Extreme(None, None))
        return Extreme(value, None if angle is None else _rounded(angle), reached)

    def _missing(self, pieces: list[_Piece], direction: int) -> list[tuple[float, float]]:
        gaps: list[tuple[float, float]] = []
        adjoins = False
        for piece in pieces:
            is_gap = not piece.counts[direction]
            if is_gap:
                begin = gaps.pop()[0] if adjoins else piece.begin
                gaps.append((begin, piece.end))
            adjoins = is_gap
        return [(_rounded(begin), _rounded(end)) for begin, end in gaps]

    def _add(self, value: float, direction: int, angle: float, reached: bool = True) -> None:
        for sign in (1, -1):
            best, at, _ = self._extremes.get((direction, sign), Extreme(None, None))
            if best is not None and at is not None:
                rise, tie = sign * (value - best), TIE * max(abs(best), abs(value))
                nearer = abs(at - self._middle) - abs(angle - self._middle) > RESOLUTION
                if rise < -tie or (rise <= tie and not nearer):
                    continue
            self._extremes[direction, sign] = Extreme(value, angle, reached)

    def _cuts(self) -> list[list[float]]:
        """Return the cuts of the turn, with its ends."""
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
        cuts: list[list[float]] = []
        for angle in sorted(found):
            if cuts and angle - cuts[-1][-1] <= RESOLUTION:
                cuts[-1].append(angle)
            else:
                cuts.append([angle])
        exact = {begin, end, *self._balance.knots}  # these come first
        return [sorted(cut, key=lambda angle: angle not in exact) for cut in cuts]

    def _search_inside(self, piece: _Piece, direction: int, i: int) -> None:
        """Add the extrema of a root within a piece."""
        begin, end, count = piece.begin, piece.end, piece.counts[direction]

        def growth(angle: float) -> float:
            roots = self._roots(angle)[direction]
            if len(roots) != count:
                return 0.0
            return growth_at(self._balance, angle, Root(roots[i], direction))

        width = end - begin
        n = max(MIN_SAMPLES, int(SAMPLES * width / (self._turn[1] - self._turn[0])))
        shares = [0.5 - 0.5 * cos(pi * k / n) for k in range(1, n)]
        grid = [begin + width * share for share in (NEAR, *shares, 1.0 - NEAR)]
        for angle in _changes(growth, grid, [growth(angle) for angle in grid]):
            roots = self._roots(angle)[direction]
            if len(roots) == count:
                self._add(roots[i], direction, angle)

    def _search_end(self, piece: _Piece, angle: float, end: float, inward: float) -> None:
        """Add the limits of the roots of a piece at an angle of the cut at one of its ends."""
        here = possible_roots_at(self._balance, angle)
        limits = limits_at(self._balance, angle)
        beside, farther = self._roots(end + inward), self._roots(end + FARTHER * inward)
        if any(len(roots[s]) != piece.counts[s] for roots in (beside, farther) for s in roots):
            return
        branches = [
            (value, before, s)
            for s in BOTH_DIRECTIONS
            for value, before in zip(beside[s], farther[s], strict=True)
        ]
        for rank, (value, before, s) in enumerate(sorted(branches, key=lambda each: abs(each[0]))):
            # Where A = 0, a root is left for the smaller one, and the larger one has no bound. Two
            # such angles may be one cut.
            bounded = here.leading != 0 or rank < len(here.found) or here.every
            bounded &= abs(value) <= GROWTH * abs(before) or not before
            near = (here if bounded else limits).of(s)
            if near:
                _, limit = min((abs(x - value), x) for x in near)
                self._add(limit, s, angle, bounded)
            elif not bounded:
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
