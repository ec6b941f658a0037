"""Functions of time in closed form, with 50 digits: what the forces of a lift make of its motion.

On a piece of its motion every quantity of a pulley with hanging masses is a `Curve`: a polynomial,
decaying exponentials and sine waves. Curves are closed under what the equations of motion ask for,
and their first zero is located by scanning value and slope, and by Newton's method. Nothing here
is taken from frictionsim.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpmath import mp, mpf

mp.dps = 50
Number = Any  # mpf; mpmath has no types

ROUNDING = mpf(10) ** -22  # of values that are sums of numbers up to 1e15, with 50 digits
SCAN = 96  # grid points of the scan beside the ones that crowd towards the start
TAYLOR = 24  # terms of a decay that falls by less than 1/e
DOUBTFUL = 1e-9  # relative; a grid value below it is computed again with all digits


@dataclass(frozen=True)
class Curve:
    """sum c_k u^k + sum E exp(-lambda u) + sum (A sin(omega u) + B cos(omega u)), u = t - start."""

    poly: tuple[Number, ...] = ()
    decays: Mapping[Number, Number] = field(default_factory=dict)  # lambda: E
    waves: Mapping[Number, tuple[Number, Number]] = field(default_factory=dict)  # omega: A, B

    def __add__(self, other: "Curve | Number") -> "Curve":
        if not isinstance(other, Curve):
            other = Curve((mpf(other),))
        length = max(len(self.poly), len(other.poly))
        poly = [mpf(0)] * length
        for source in (self.poly, other.poly):
            for k, c in enumerate(source):
                poly[k] += c
        decays = dict(self.decays)
        for rate, c in other.decays.items():
            decays[rate] = decays.get(rate, mpf(0)) + c
        waves = dict(self.waves)
        for omega, (a, b) in other.waves.items():
            first, second = waves.get(omega, (mpf(0), mpf(0)))
            waves[omega] = (first + a, second + b)
        return Curve(tuple(poly), decays, waves)

    __radd__ = __add__

    def __mul__(self, factor: Number) -> "Curve":
        return Curve(
            tuple(c * factor for c in self.poly),
            {rate: c * factor for rate, c in self.decays.items()},
            {omega: (a * factor, b * factor) for omega, (a, b) in self.waves.items()},
        )

    __rmul__ = __mul__

    def __neg__(self) -> "Curve":
        return self * mpf(-1)

    def __sub__(self, other: "Curve | Number") -> "Curve":
        return self + (-other)

    def __rsub__(self, other: Number) -> "Curve":
        return -self + other

    def __call__(self, u: Number) -> Number:
        total = mpf(0)
        for c in reversed(self.poly):
            total = total * u + c
        for rate, c in self.decays.items():
            total += c * mp.exp(-rate * u)
        for omega, (a, b) in self.waves.items():
            total += a * mp.sin(omega * u) + b * mp.cos(omega * u)
        return total

    def floats(self, u: Any) -> Any:
        """Return the values at times u in double precision."""
        length = mpf(float(np.max(u)))
        slow = {rate: c for rate, c in self.decays.items() if rate * length < 1}
        # A slow decay and a polynomial cancel: summed as a polynomial before they are rounded.
        poly = [mpf(0)] * max(len(self.poly), TAYLOR if slow else 0)
        for k, c in enumerate(self.poly):
            poly[k] += c
        for rate, c in slow.items():
            for k in range(TAYLOR):
                poly[k] += c
                c *= -rate / (k + 1)
        total = np.zeros_like(u)
        for c in reversed(poly):
            total = total * u + float(c)
        for rate, c in self.decays.items():
            if rate not in slow:
                total = total + float(c) * np.exp(-float(rate) * u)
        for omega, (a, b) in self.waves.items():
            total = total + float(a) * np.sin(float(omega) * u)
            total = total + float(b) * np.cos(float(omega) * u)
        return total

    def size(self, length: float) -> float:
        """Return a bound of its terms up to u = length."""
        terms = [abs(float(c)) * length**k for k, c in enumerate(self.poly)]
        terms += [abs(float(c)) for c in self.decays.values()]
        terms += [abs(float(part)) for pair in self.waves.values() for part in pair]
        return sum(terms)

    def slope(self) -> "Curve":
        return Curve(
            tuple(k * c for k, c in enumerate(self.poly))[1:],
            {rate: -rate * c for rate, c in self.decays.items()},
            {omega: (-omega * b, omega * a) for omega, (a, b) in self.waves.items()},
        )

    def integral(self, first: Number) -> "Curve":
        """Return the antiderivative that is `first` at u = 0."""
        curve = Curve(
            (mpf(0), *(c / (k + 1) for k, c in enumerate(self.poly))),
            {rate: -c / rate for rate, c in self.decays.items()},
            {omega: (b / omega, -a / omega) for omega, (a, b) in self.waves.items()},
        )
        return curve + (first - curve(mpf(0)))


def response(mass: Number, damping: Number, force: Curve, first: Number) -> Curve:
    """Return v with mass v' + damping v = force and v(0) = first; of force without decays."""
    if damping == 0:
        return (force * (1 / mass)).integral(first)
    particular = [mpf(0)] * len(force.poly)
    above = mpf(0)
    for k in range(len(force.poly) - 1, -1, -1):
        above = (force.poly[k] - mass * (k + 1) * above) / damping
        particular[k] = above
    waves = {}
    for omega, (a, b) in force.waves.items():
        inertia = mass * omega
        square = damping**2 + inertia**2
        waves[omega] = ((damping * a + inertia * b) / square, (damping * b - inertia * a) / square)
    particular_part = Curve(tuple(particular), {}, waves)
    return particular_part + Curve((), {damping / mass: first - particular_part(mpf(0))})


def holds_after_start(curve: Curve, tolerance: Number = ROUNDING, strictly: bool = False) -> bool:
    """Return whether a curve is not negative just after u = 0: its first derivative not zero."""
    value = curve(mpf(0))
    if abs(value) > tolerance:
        return bool(value > 0)
    for _ in range(5):
        curve = curve.slope()
        value = curve(mpf(0))
        if abs(value) > ROUNDING:
            return bool(value > 0)
    return not strictly


def first_fall(curve: Curve, length: Number, tolerance: Number) -> Number | None:
    """Return the first u in (0, length] at which a curve passes below zero, by more than tolerance.

    A curve that begins at zero has to rise first; one that falls at once returns 0.
    """
    if not holds_after_start(curve, max(ROUNDING, tolerance)):
        return mpf(0)
    end = float(length)
    grid = np.unique(
        np.concatenate([end * 0.5 ** np.arange(30.0), end * np.linspace(0.0, 1.0, SCAN + 1)[1:]])
    )
    slope = curve.slope()
    values, slopes = _signs(curve, grid, length), _signs(slope, grid, length)
    bound = -float(tolerance)
    before = mpf(0)
    for i, u in enumerate(grid):
        at = length if i == len(grid) - 1 else mpf(float(u))
        if i and values[i] > bound and slopes[i - 1] < 0.0 < slopes[i]:
            lowest = _root(slope, slope.slope(), before, at, rising=True)
            if curve(lowest) < -tolerance:
                return _root(curve, slope, before, lowest)
        if values[i] < bound:
            return _root(curve, slope, before, at)
        before = at
    return None


def _signs(curve: Curve, grid: Any, length: Number) -> Any:
    """Return values on a grid, with all digits where double precision leaves the sign open."""
    values = curve.floats(grid)
    doubtful = np.abs(values) < DOUBTFUL * max(curve.size(float(length)), 1e-300)
    for i in np.flatnonzero(doubtful):
        values[i] = float(curve(length if i == len(grid) - 1 else mpf(float(grid[i]))))
    return values


def _root(curve: Curve, slope: Curve, low: Number, high: Number, rising: bool = False) -> Number:
    """Return a zero between low and high, by Newton's method inside a bracket that it narrows.

    It falls at the zero, or rises; at `low` it may be zero itself, which is not what is wanted.
    """
    sign = -1 if rising else 1
    u = (low + high) / 2
    for _ in range(300):
        value = sign * curve(u)
        if value > 0:
            low = u
        else:
            high = u
        steepness = sign * slope(u)
        following = u - value / steepness if steepness != 0 else low
        if not low < following < high:
            following = (low + high) / 2
        if abs(following - u) < mpf(10) ** -42 or high - low < mpf(10) ** -42:
            return following
        u = following
    raise AssertionError("no root")


# --- signals of a scenario ------------------------------------------------------------------------


def piece_of_signal(signal: Any, t: Number) -> tuple[Curve, Number]:
    """Return a signal of a scenario from t on as a curve of u, and the time up to which it holds.

    The forms are those of a scenario file: a number, `time` and `value`, `sine`, `smooth_step`.
    """
    if isinstance(signal, (int, float)):
        return Curve((mpf(signal),)), mp.inf
    if "time" in signal:
        times, values = ([mpf(x) for x in signal[key]] for key in ("time", "value"))
        if t < times[0]:
            return Curve((values[0],)), times[0]
        for t0, t1, v0, v1 in zip(times, times[1:], values, values[1:], strict=False):
            if t0 <= t < t1:
                rate = (v1 - v0) / (t1 - t0)
                return Curve((v0 + rate * (t - t0), rate)), t1
        return Curve((values[-1],)), mp.inf
    if "sine" in signal:
        form = signal["sine"]
        omega = 2 * mp.pi * mpf(form["frequency_hz"])
        size = mpf(form["amplitude"])
        angle = omega * t + mp.radians(mpf(form.get("phase_deg", 0.0)))
        wave = {omega: (size * mp.cos(angle), size * mp.sin(angle))}
        # A scan sees every half wave if a piece is not longer than a period.
        return Curve((mpf(form.get("mean", 0.0)),), {}, wave), t + 2 * mp.pi / omega
    form = signal["smooth_step"]
    start, stop = mpf(form["start"]), mpf(form["stop"])
    before, after = mpf(form["from"]), mpf(form["to"])
    if t < start:
        return Curve((before,)), start
    if t >= stop:
        return Curve((after,)), mp.inf
    # 3 x^2 - 2 x^3 about x0 = (t - start)/(stop - start), in powers of u
    length, rise = stop - start, after - before
    x = (t - start) / length
    return Curve(
        (
            before + rise * (3 * x**2 - 2 * x**3),
            rise * (6 * x - 6 * x**2) / length,
            rise * (3 - 6 * x) / length**2,
            -2 * rise / length**3,
        )
    ), stop
