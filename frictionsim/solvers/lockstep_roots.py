"""The root finder of `frictionsim.solvers.root_finding`, for one function of each of many runs."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Brackets(NamedTuple):
    """The brackets of the roots.

    Attributes
    ----------
    low, high : (runs,)
    hidden : (runs,) of bool
        The function has the same sign at both ends.
    """

    low: Any
    high: Any
    hidden: Any


def bracket_roots(
    f: Callable[[Any], Any], a: Any, b: Any, wanted: Any, resolution: Any = 0.0
) -> Brackets:
    """Return a bracket of a root in [a, b] for each run, by the iterates of `bracket_root`.

    Parameters
    ----------
    f : callable
        Of an abscissa of each run, (runs,).
    a, b : (runs,)
    wanted : (runs,) of bool
        For the others the result is a, b.
    resolution : float or (runs,)
    """
    x, f_x, y, f_y = a, f(a), b, f(b)
    hidden = wanted & ((f_x > 0.0) == (f_y > 0.0))
    left = wanted & ~hidden
    low, high, fraction = a.copy(), b.copy(), 0.5
    with np.errstate(all="ignore"):  # runs that are done have no fraction
        while True:
            width = abs(y - x)
            min_width = np.maximum(0.5 * resolution, np.spacing(np.maximum(abs(x), abs(y))))
            done = left & (width <= 2.0 * min_width)
            if done.any():
                np.copyto(low, np.minimum(x, y), where=done)
                np.copyto(high, np.maximum(x, y), where=done)
                left &= ~done
            if not left.any():
                return Brackets(low, high, hidden)
            edge = min_width / width
            fraction = np.minimum(np.maximum(fraction, edge), 1.0 - edge)
            new = np.where(left, x + fraction * (y - x), x)
            f_new = f(new)
            same = (f_new > 0.0) == (f_x > 0.0)
            z, f_z = np.where(same, x, y), np.where(same, f_x, f_y)
            y, f_y = np.where(same, y, x), np.where(same, f_y, f_x)
            x, f_x = new, f_new
            fraction = _interpolated(x, f_x, y, f_y, z, f_z)


def _interpolated(x: Any, f_x: Any, y: Any, f_y: Any, z: Any, f_z: Any) -> Any:
    """Return the next points, as fractions of the intervals from x to y; 0.5 is bisection."""
    xi = (x - y) / (z - y)
    phi = (f_x - f_y) / (f_z - f_y)
    safe = (f_x != f_z) & (f_y != f_z)
    safe &= (phi * phi < xi) & ((1.0 - phi) * (1.0 - phi) < 1.0 - xi)
    quadratic = f_x / (f_y - f_x) * f_z / (f_y - f_z) + (z - x) / (y - x) * (
        f_x / (f_z - f_x) * f_y / (f_z - f_y)
    )
    return np.where(safe, quadratic, 0.5)
