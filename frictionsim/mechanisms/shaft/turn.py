"""The smallest and the largest root of eq 24 over a turn: a scan, refined.

A direction has none, one or two roots at an angle. Where their number changes, the scan is cut, to
rounding, by bisection: there, roots join, pass zero, or grow without bound. Between two cuts the
smallest and the largest are continuous functions, with corners where the slope of a size jumps. An
extremum narrower than the step of the scan is not seen.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import inf, isclose, radians
from typing import NamedTuple

from frictionsim.mechanisms.shaft.balance import CLOCKWISE, COUNTER_CLOCKWISE, ROUNDOFF, Balance

DIRECTIONS = {COUNTER_CLOCKWISE: "counter_clockwise", CLOCKWISE: "clockwise"}
SAMPLES = 3600  # 0.1 deg over a turn
LEVELS, FINER = 4, 20  # of steps in which roots begin or end, where others may do so, too
RESOLUTION = 1e-6  # deg: what is shorter is of rounding
HALVINGS = 60  # from 0.1 deg to below the rounding of an angle
# Towards a pole, a root grows so many times from one distance, deg, to the other.
FAR, NEAR, GROWTH = 1e-5, 1e-7, 5.0
# Two poles nearer to each other than 1e-4 deg, which rounding hides, end a run: its end is so many
# times as high as one and two stencils beside it. A bounded root does not grow so fast at an end.
STEEP = 100.0
# Where an arm only touches the friction radius, A is a tie within 8.1e-5 deg of its pole.
TOUCHING = 2e-4  # deg
STENCIL, SMALL_STEP = 0.05, 1e-3  # deg, of the derivatives at an extremum, and of their correction
DIGITS_OF_ANGLE = 7  # deg, 1e-9 rad

Sample = tuple[float, list[float]]  # angle, deg, and roots of a direction in ascending order
Run = list[Sample]  # with as many roots each


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
    """The roots of a direction; `missing` are the angles, deg, between which there is none."""

    smallest: Extreme
    largest: Extreme
    missing: list[tuple[float, float]]


def over_turn(
    balance: Balance, begin: float, end: float, knots: set[float], least: float
) -> dict[int, Turn]:
    """Return the extreme roots by direction.

    Parameters
    ----------
    balance : Balance
    begin, end : float, deg
    knots : set of float, deg
        Where slopes of sizes jump.
    least : float
        Roots below it do not count: a mass is not below zero.
    """

    def roots_at(angle: float) -> dict[int, list[float]]:
        roots = balance.roots(radians(angle), limits=True)
        return {s: [x for x in roots.of(s) if x >= least] for s in DIRECTIONS}

    step, middle, turns = (end - begin) / SAMPLES, 0.5 * (begin + end), {}
    scan: dict[float, dict[int, list[float]]] = {}
    angles = {begin + i * step for i in range(SAMPLES)} | {x for x in knots if begin < x < end}
    angles |= {end}
    for _ in range(LEVELS):
        scan |= {angle: roots_at(angle) for angle in angles - set(scan)}
        angles = {
            one + i * (two - one) / FINER
            for one, two in pairwise(sorted(scan))
            if any(len(scan[one][s]) != len(scan[two][s]) for s in DIRECTIONS)
            for i in range(1, FINER)
        }
    for s in DIRECTIONS:

        def roots(angle: float, s: int = s) -> list[float]:
            return roots_at(angle)[s]

        samples = [(angle, scan[angle][s]) for angle in sorted(scan)]
        runs = [
            run
            for run in _runs(roots, samples)
            if run[0][1] and run[-1][0] - run[0][0] > RESOLUTION
        ]
        ends = [begin, *(x for run in runs for x in (run[0][0], run[-1][0])), end]
        smallest, largest = (
            _extreme(balance, [x for run in runs for x in _extrema(roots, run, sign)], sign, middle)
            for sign in (-1, 1)
        )
        missing = [
            (_rounded(low), _rounded(high))
            for low, high in zip(ends[::2], ends[1::2], strict=True)
            if high - low > RESOLUTION
        ]
        turns[s] = Turn(smallest, largest, missing)
    return turns


def _rounded(angle: float) -> float:
    return round(angle, DIGITS_OF_ANGLE) + 0.0  # without the sign of a zero


def _extreme(
    balance: Balance, extrema: list[tuple[float, float]], sign: int, middle: float
) -> Extreme:
    """Return the highest of heights and angles; of equal ones the nearest to the middle.

    Of several poles, it is the first.
    """
    if not extrema:
        return Extreme(None, None)
    highest = max(height for height, _ in extrema)
    equal = (each for each in extrema if isclose(each[0], highest, rel_tol=ROUNDOFF))
    if highest == inf:
        poles = sorted(angle for _, angle in equal)
        near = [angle for angle in poles if angle - poles[0] < TOUCHING]
        between = 0.5 * (near[0] + near[-1])
        is_one = balance.roots(radians(between)).leading == 0
        return Extreme(None, _rounded(between if is_one else poles[0]))
    height, angle = min(equal, key=lambda each: abs(each[1] - middle))
    value = sign * height + 0.0
    return Extreme(value, _rounded(angle), not balance.vanishes(radians(angle)))


def _runs(roots: Callable[[float], list[float]], samples: Run) -> list[Run]:
    """Return the samples in runs with as many roots, each up to the angle where that changes."""
    runs = [[samples[0]]]
    for one, two in pairwise(samples):
        if len(one[1]) != len(two[1]):
            runs[-1].append(_end_of(one, two[0], roots))
            runs.append([_end_of(two, one[0], roots)])
        runs[-1].append(two)
    return runs


def _end_of(inside: Sample, beyond: float, roots: Callable[[float], list[float]]) -> Sample:
    for _ in range(HALVINGS):
        angle = 0.5 * (inside[0] + beyond)
        found = roots(angle)
        if len(found) == len(inside[1]):
            inside = angle, found
        else:
            beyond = angle
    return inside


def _extrema(
    roots: Callable[[float], list[float]], run: Run, sign: int
) -> Iterator[tuple[float, float]]:
    """Yield the maxima of the largest root (1) of a run, or of minus the smallest (-1)."""
    rank, count = (-1 if sign > 0 else 0), len(run[0][1])

    def height(angle: float) -> float:
        found = roots(angle)
        return sign * found[rank] if len(found) == count else -inf

    heights = [sign * found[rank] for _, found in run]
    for i, (angle, _) in enumerate(run):
        first, last = max(i - 1, 0), min(i + 1, len(run) - 1)
        beside = heights[first], heights[last]
        tie = ROUNDOFF * max(abs(heights[i]), *map(abs, beside))
        if heights[i] < max(beside) - tie:
            continue
        best = heights[i], angle
        if min(beside) < heights[i] - tie:  # else it is constant
            best = _refined(height, best, (run[first][0], run[last][0]), min(beside))
        yield best


def _refined(
    height: Callable[[float], float],
    best: tuple[float, float],
    bounds: tuple[float, float],
    lowest: float,
) -> tuple[float, float]:
    """Return height and angle of a maximum; the height of a pole is infinite."""
    from scipy.optimize import minimize_scalar  # imported here because `check` does not need it

    at = best[1]
    found = minimize_scalar(
        lambda x: -max(height(at + x), lowest),
        bounds=(bounds[0] - at, bounds[1] - at),
        method="bounded",
        options={"xatol": 1e-12},
    )
    best = max(best, (-float(found.fun), at + float(found.x)))
    # Values are flat at a maximum. Its angle is that at which the derivative vanishes.
    a, b, c, d, e = (height(best[1] + i * STENCIL) for i in (-2, -1, 0, 1, 2))
    if (curvature := b - 2.0 * c + d) < 0.0:
        step = STENCIL * (8.0 * (b - d) + e - a) / (12.0 * curvature)
        if abs(step) < SMALL_STEP and height(best[1] + step) >= c - ROUNDOFF * abs(c):
            best = c, best[1] + step
    near, far = (max(height(best[1] - x), height(best[1] + x)) for x in (NEAR, FAR))
    beside = max(abs(max(b, d)), abs(max(a, e)))
    is_end = any(abs(best[1] - bound) < FAR for bound in bounds)
    is_pole = near > GROWTH * abs(far) < inf or (is_end and best[0] > STEEP * beside)
    return (inf if is_pole else best[0]), best[1]
