"""The first time at which a function may exceed zero, without missing a short excess.

A function whose second derivative is at most K stays below the parabola through its value with its
slope. The root of the parabola is a time before which there is no excess; from there the same again
converges to the first root as Newton's method does, or passes all of the interval. The slope may
jump downwards: the function is below the parabola all the more.
"""

from math import inf, sqrt, ulp
from typing import Any

from frictionsim.solvers.compilation import compilable

# Shortest step, in units in the last place of the time.
MIN_STEP_ULPS = 4.0
MAX_STEPS = 1000


@compilable
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


@compilable
def _root_of_parabola(f: float, slope: float, curvature: float) -> float:
    """Return the smallest positive root of f + slope x + curvature x^2/2, f <= 0; else inf."""
    if curvature <= 0.0:
        return -f / slope if slope > 0.0 else inf
    root = sqrt(slope * slope - 2.0 * curvature * f)
    return -2.0 * f / (root + slope) if slope > 0.0 else (root - slope) / curvature
