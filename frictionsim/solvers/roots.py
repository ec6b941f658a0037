"""Roots in a bracket, and the first time at which a function may exceed zero.

Importing SciPy's root finder would take longer than a short run.

A short excess is not missed: a function whose second derivative is at most K stays below the
parabola through its value with its slope. The root of the parabola is a time before which there is
no excess; from there the same again converges to the first root as Newton's method does, or passes
all of the interval. The slope may jump downwards: the function is below the parabola all the more.
"""

from collections.abc import Callable
from math import inf, sqrt, ulp
from typing import Any

from frictionsim.errors import StepUnderflow

# Of the way to the first excess: the shortest step, in units in the last place of the time.
MIN_STEP_ULPS = 4.0
MAX_STEPS = 1000


def bracket_root(
    f: Callable[[float], float], a: float, b: float, resolution: float = 0.0
) -> tuple[float, float]:
    """Return a bracket (lo, hi) of a root in [a, b]: f(lo) has the sign of f(a), f(hi) of f(b).

    Chandrupatla's method [1]_: inverse quadratic interpolation where it is safe, else bisection.

    Parameters
    ----------
    f : callable
        Positive at exactly one of a and b; zero counts as not positive.
    a, b : float
        a < b.
    resolution : float
        Allowed width of the bracket; at least the roundoff of the abscissa.

    Returns
    -------
    (float, float)

    Raises
    ------
    StepUnderflow
        If f(a) and f(b) have the same sign: the callers have seen a change, which rounding hides.

    References
    ----------
    .. [1] T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145-149.
    """
    x, f_x, y, f_y, fraction = a, f(a), b, f(b), 0.5
    if (f_x > 0.0) == (f_y > 0.0):
        raise StepUnderflow(
            f"between {a:.9g} and {b:.9g} rounding hides an event (no change of sign: {f_x:.3g}"
            f" and {f_y:.3g}); check the scenario for numbers that are far too large or too small"
        )
    while True:
        least, width = max(0.5 * resolution, ulp(max(abs(x), abs(y)))), abs(y - x)
        if width <= 2.0 * least:
            return min(x, y), max(x, y)
        share = least / width
        new = x + min(max(fraction, share), 1.0 - share) * (y - x)
        f_new = f(new)
        if (f_new > 0.0) == (f_x > 0.0):
            z, f_z = x, f_x
        else:
            z, f_z, y, f_y = y, f_y, x, f_x
        x, f_x = new, f_new
        fraction = _next_fraction(x, f_x, y, f_y, z, f_z)


def _next_fraction(x: float, f_x: float, y: float, f_y: float, z: float, f_z: float) -> float:
    """Return the next point, as a fraction of the interval from x to y; 0.5 is bisection."""
    if f_x == f_z or f_y == f_z:
        return 0.5
    xi = (x - y) / (z - y)
    phi = (f_x - f_y) / (f_z - f_y)
    if not (phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi):
        return 0.5
    return f_x / (f_y - f_x) * f_z / (f_y - f_z) + (z - x) / (y - x) * (
        f_x / (f_z - f_x) * f_y / (f_z - f_y)
    )


def time_of_excess(f: Any, curvature: float, begin: float, end: float, tie: float) -> float:
    """Return a time b such that the function exceeds zero at most once from the start to b.

    If it does so, it is positive at b; b is the end of the interval, or earlier.

    Parameters
    ----------
    f : object
        With the methods at(t), its value at a time, and slope(t), its derivative after it.
    curvature : float
        Upper bound of the second derivative in the interval.
    begin, end : float, s
        The interval.
    tie : float
        Roundoff of the value: an excess below it may be missed.
    """
    t = begin
    resolution = sqrt(2.0 * tie / curvature) if curvature > 0.0 else 0.0
    growth = 1.0
    for _ in range(MAX_STEPS):
        value = f.at(t)
        if value > 0.0 and t > begin:
            return t
        # Near the root, rounding leaves steps of no length: they double until they pass it.
        floor = max(resolution, MIN_STEP_ULPS * growth * ulp(t))
        step = _root_of_parabola(min(value, 0.0), f.slope(t), curvature)
        growth = 2.0 * growth if step < floor else 1.0
        t += max(step, floor)
        if t >= end:
            return end
    return t


def _root_of_parabola(f: float, slope: float, curvature: float) -> float:
    """Return the smallest positive root of f + slope x + curvature x^2/2, f <= 0; else inf."""
    if curvature <= 0.0:
        return -f / slope if slope > 0.0 else inf
    root = sqrt(slope * slope - 2.0 * curvature * f)
    return -2.0 * f / (root + slope) if slope > 0.0 else (root - slope) / curvature
