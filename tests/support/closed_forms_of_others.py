"""Closed forms of the benchmarks in `scenarios/validation`. SI units, angles in rad."""

from math import atan2, cos, exp, expm1, floor, hypot, log, log1p, pi, sin, sqrt

import numpy as np
from scipy.optimize import brentq

RATIOS = 0.7, 0.8, 1.2, 1.3, 1.5, 2.0, 3.0  # of frequencies, at which Den Hartog's does not stop
FRICTION = 0.5  # F/P


def _den_hartog(ratio: float) -> tuple[float, float]:
    """Return V and U, the response without friction and that to the friction."""
    return 1.0 / (1.0 - ratio**2), sin(pi / ratio) / (ratio * (1.0 + cos(pi / ratio)))


def den_hartog_amplitude(ratio: float, friction: float = FRICTION) -> float:
    """Return the amplitude over P/k of steady motion without stops, of F/P."""
    v, u = _den_hartog(ratio)
    return sqrt(v**2 - (friction * u) ** 2)


def den_hartog_goes_on(ratio: float, friction: float = FRICTION) -> bool:
    """Return whether the speed has one sign between the turning points."""
    v, u = _den_hartog(ratio)
    t = np.linspace(0.0, pi / ratio, 100_002)[1:-1]
    braked = np.sin(t) + ratio * u * (np.cos(ratio * t) - np.cos(t))
    least = np.max(braked / np.sin(ratio * t)) / ratio  # amplitude over F
    return bool(v**2 > friction**2 * (u**2 + least**2))


def friction_oscillator(x: float = 12.0, v: float = 6.0) -> tuple[float, float]:
    """Return when and where a body of m = k = F = 1 comes to rest that starts outwards, v > 0.

    Half waves about -1 and +1 by turns: each turning point is nearer by 2 than the one before.
    """
    first = hypot(x + 1.0, v) - 1.0
    turns = floor((first + 1.0) / 2.0)
    return atan2(v, x + 1.0) + pi * turns, (-1.0) ** turns * (first - 2.0 * turns)


def flat_belt() -> tuple[float, float, float]:
    """Return the steady speed of the driven pulley, rad/s, and the tensions T1 and T2, N.

    As much unstretched belt comes on to one pulley as on to the other: R w/(1 + T/EA) is the same
    for w1, T1 and w2, T2. The torque is R (T1 - T2) = 25 N m + 2 N m s w2. On each pulley the belt
    sticks at the tension with which it comes on, and creeps at the end of the arc, where T less
    the momentum grows by exp(mu angle). Its unstretched length is given.
    """
    radius, distance, axial, mu = 0.1, 0.1 * pi, 7600.0, 0.5
    length, speed = 0.38 * pi, 12.0
    momentum = 0.0087242 * (radius * speed) ** 2

    def state(driven: float) -> tuple[float, float, float]:
        """Return T1, T2 and by how much the belt of these is longer than it is."""
        # (1 + T2/EA)/(1 + T1/EA) = w2/w1 and T1 - T2 = M/R.
        tight = (25.0 + 2.0 * driven) / radius / (1.0 - driven / speed) - axial
        slack = (axial + tight) * driven / speed - axial
        angle = log((tight - momentum) / (slack - momentum)) / mu
        even = distance + radius * (pi - angle)
        stretched = sum(even / (1.0 + tension / axial) for tension in (tight, slack))
        # The integral of R/(1 + (m + a exp(mu x))/EA) from 0 to the angle.
        whole, a = axial + momentum, slack - momentum
        grown = log1p(a * expm1(mu * angle) / (whole + a)) / mu
        creeping = radius * axial / whole * (angle - grown)
        return tight, slack, stretched + 2.0 * creeping - length

    driven = brentq(lambda w: state(w)[2], 11.25, 11.36, xtol=1e-13)
    tight, slack, _ = state(driven)
    assert tight - momentum < exp(mu * pi) * (slack - momentum), "it slips as a whole"
    return driven, tight, slack
