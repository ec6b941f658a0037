"""Zeros, extrema and limits of a function of one variable in numbers of many digits."""

from collections.abc import Callable, Iterator
from decimal import Decimal
from itertools import pairwise
from math import comb

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
