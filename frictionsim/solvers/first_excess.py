"""The first time at which a function may exceed zero, without missing a short excess.

A function whose second derivative is at most K stays below the parabola through its value with its
slope. The root of the parabola is a time before which there is no excess; from there the same again
converges to the first root as Newton's method does, or passes all of the interval. The slope may
jump downwards: the function is below the parabola all the more.
"""

from collections.abc import Callable
from math import inf, sqrt, ulp

# Shortest step, in units in the last place of the time.
MIN_STEP_ULPS = 4.0
MAX_STEPS = 1000


def time_of_excess(
    value: Callable[[float], float],
    slope: Callable[[float], float],
    curvature: float,
    interval: tuple[float, float],
    tie: float,
) -> float:
    """Return a time b such that the function exceeds zero at most once from the start to b.

    If it does so, it is positive at b; b is the end of the interval, or earlier.

    Parameters
    ----------
    value, slope : callable
        Functions of the time; the slope is the one after it.
    curvature : float
        Upper bound of the second derivative in the interval.
    interval : (float, float), s
    tie : float
        Roundoff of the value: an excess below it may be missed.
    """
    t, end = interval
    resolution = sqrt(2.0 * tie / curvature) if curvature > 0.0 else 0.0
    short = 0
    for _ in range(MAX_STEPS):
        f = value(t)
        if f > 0.0 and t > interval[0]:
            return t
        # Near the root, rounding leaves steps of no length: they double until they pass it.
        floor = max(resolution, MIN_STEP_ULPS * 2.0**short * ulp(t))
        step = _root_of_parabola(min(f, 0.0), slope(t), curvature)
        short = short + 1 if step < floor else 0
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
