"""Signals: inputs of a mechanism over time, with their discontinuities and extrema.

Solvers end a step where a derivative jumps, so that every step is smooth. Between two extrema a
signal is monotone and crosses a threshold at most once, so that no breakaway is missed.
"""

from bisect import bisect_right
from collections.abc import Sequence
from math import ceil, cos, inf, pi, sin
from typing import NamedTuple, Protocol


class CubicPiece(NamedTuple):
    """A signal from a knot to the next: c0 + c1 x + c2 x^2 + c3 x^3, x = t - knot."""

    knot: float
    c0: float
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0


class Harmonic(NamedTuple):
    """amplitude sin(angular_frequency t + phase)."""

    amplitude: float
    angular_frequency: float
    phase: float


class Signal(Protocol):
    """A continuous, piecewise smooth function of time: cubic pieces, and one harmonic or none."""

    def __call__(self, t: float) -> float:
        """Return the value at time t, s."""

    def derivative(self, t: float) -> float:
        """Return the derivative at time t, s; the one-sided derivative after t if it jumps."""

    def next_discontinuity(self, t: float) -> float:
        """Return the first time after t, s, at which a derivative jumps; inf if there is none."""

    def next_extremum(self, t: float) -> float:
        """Return a time after t, s, up to which the signal is monotone and smooth; inf if all."""

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        """Return bounds of the value between two times between which it is smooth."""

    def curvature(self, begin: float, end: float) -> float:
        """Return a bound of the second derivative between two such times, per s^2."""

    def pieces(self) -> list[CubicPiece]:
        """Return its cubic pieces; the first has no beginning, whatever its knot is."""

    def harmonic(self) -> Harmonic | None:
        """Return the part that is added to the pieces."""


def _in_order(one: float, two: float) -> tuple[float, float]:
    return (one, two) if one <= two else (two, one)


class Constant:
    """A constant."""

    def __init__(self, value: float) -> None:
        self._value = value

    def __call__(self, t: float) -> float:
        return self._value

    def derivative(self, t: float) -> float:
        return 0.0

    def next_discontinuity(self, t: float) -> float:
        return inf

    def next_extremum(self, t: float) -> float:
        return inf

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        return self._value, self._value

    def curvature(self, begin: float, end: float) -> float:
        return 0.0

    def pieces(self) -> list[CubicPiece]:
        return [CubicPiece(0.0, self._value)]

    def harmonic(self) -> Harmonic | None:
        return None


class PiecewiseLinear:
    """Linear interpolation between points, constant before the first and after the last."""

    def __init__(self, times: Sequence[float], values: Sequence[float]) -> None:
        self._times = list(times)
        # Constant extrapolation: the line before the first point uses that point.
        self._from_time = [times[0], *times]
        self._from_value = [values[0], *values]
        slopes = [
            (v1 - v0) / (t1 - t0)
            for t0, t1, v0, v1 in zip(times, times[1:], values, values[1:], strict=False)
        ]
        self._slope = [0.0, *slopes, 0.0]

    def __call__(self, t: float) -> float:
        i = bisect_right(self._times, t)
        return self._from_value[i] + self._slope[i] * (t - self._from_time[i])

    def derivative(self, t: float) -> float:
        return self._slope[bisect_right(self._times, t)]

    def next_discontinuity(self, t: float) -> float:
        i = bisect_right(self._times, t)
        return self._times[i] if i < len(self._times) else inf

    next_extremum = next_discontinuity

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        return _in_order(self(begin), self(end))

    def curvature(self, begin: float, end: float) -> float:
        return 0.0

    def pieces(self) -> list[CubicPiece]:
        parts = zip(self._from_time, self._from_value, self._slope, strict=True)
        return [CubicPiece(*part) for part in parts]

    def harmonic(self) -> Harmonic | None:
        return None


class Sine:
    """mean + amplitude sin(angular_frequency t + phase)."""

    def __init__(
        self, mean: float, amplitude: float, angular_frequency: float, phase: float
    ) -> None:
        self._mean = mean
        self._amplitude = amplitude
        self._angular_frequency = angular_frequency
        self._phase = phase

    def __call__(self, t: float) -> float:
        return self._mean + self._amplitude * sin(self._angular_frequency * t + self._phase)

    def derivative(self, t: float) -> float:
        omega = self._angular_frequency
        return self._amplitude * omega * cos(omega * t + self._phase)

    def next_discontinuity(self, t: float) -> float:
        return inf

    def next_extremum(self, t: float) -> float:
        half_periods = (self._angular_frequency * t + self._phase - pi / 2) / pi
        k, further = ceil(half_periods), 1
        while True:
            extremum = (pi / 2 + k * pi - self._phase) / self._angular_frequency
            # Rounding may return t itself; many times, where periods are below its resolution.
            if extremum > t:
                return extremum
            k += further
            further *= 2

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        return _in_order(self._mean - self._amplitude, self._mean + self._amplitude)

    def curvature(self, begin: float, end: float) -> float:
        return abs(self._amplitude) * self._angular_frequency**2

    def pieces(self) -> list[CubicPiece]:
        return [CubicPiece(0.0, self._mean)]

    def harmonic(self) -> Harmonic | None:
        return Harmonic(self._amplitude, self._angular_frequency, self._phase)


class SmoothStep:
    """Transition between two values by 3 x^2 - 2 x^3, constant before and after.

    The first derivative is continuous; the second jumps at both ends.
    """

    def __init__(self, before: float, after: float, start: float, stop: float) -> None:
        self._before, self._after = before, after
        self._rise = after - before
        self._start = start
        self._stop = stop
        self._duration = stop - start

    def __call__(self, t: float) -> float:
        x = min(max((t - self._start) / self._duration, 0.0), 1.0)
        return self._before + self._rise * (x * x * (3.0 - 2.0 * x))

    def derivative(self, t: float) -> float:
        x = min(max((t - self._start) / self._duration, 0.0), 1.0)
        return self._rise * 6.0 * x * (1.0 - x) / self._duration

    def next_discontinuity(self, t: float) -> float:
        if t < self._start:
            return self._start
        return self._stop if t < self._stop else inf

    next_extremum = next_discontinuity

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        return _in_order(self(begin), self(end))

    def curvature(self, begin: float, end: float) -> float:
        if end <= self._start or begin >= self._stop:
            return 0.0
        x, y = ((t - self._start) / self._duration for t in (begin, end))
        return (
            abs(6.0 * self._rise) / self._duration**2 * max(abs(1.0 - 2.0 * x), abs(1.0 - 2.0 * y))
        )

    def pieces(self) -> list[CubicPiece]:
        curvature = 3.0 * self._rise / self._duration**2
        return [
            CubicPiece(self._start, self._before),
            CubicPiece(
                self._start, self._before, 0.0, curvature, -2.0 * self._rise / self._duration**3
            ),
            CubicPiece(self._stop, self._after),
        ]

    def harmonic(self) -> Harmonic | None:
        return None
