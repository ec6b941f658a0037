"""Signals: inputs of a mechanism over time, with their discontinuities and extrema.

Solvers end a step where a derivative jumps, so that every step is smooth. Between two extrema a
signal is monotone and crosses a threshold at most once, so that no breakaway is missed.
"""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import ceil, copysign, cos, inf, pi, sin, sqrt, ulp
from typing import NamedTuple


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


class Signal:
    """A continuous, piecewise smooth function of time: monotone cubic pieces and one harmonic.

    Pieces are in the order of their knots, s; the first one has no beginning, whatever its knot is.
    To a harmonic belongs one piece, a constant.
    """

    def __init__(self, pieces: Sequence[CubicPiece], harmonic: Harmonic | None = None) -> None:
        self.pieces, self.harmonic = tuple(pieces), harmonic
        # The times at which a derivative jumps, s.
        self.knots = [piece.knot for piece in self.pieces[1:]]

    def __call__(self, t: float) -> float:
        """Return the value at time t, s."""
        knot, c0, c1, c2, c3 = self.pieces[bisect_right(self.knots, t)]
        x = t - knot
        value = c0 + x * (c1 + x * (c2 + x * c3))
        if self.harmonic is not None:
            amplitude, omega, phase = self.harmonic
            value += amplitude * sin(omega * t + phase)
        return value

    def derivative(self, t: float) -> float:
        """Return the derivative at time t, s; the one-sided derivative after t if it jumps."""
        knot, _, c1, c2, c3 = self.pieces[bisect_right(self.knots, t)]
        x = t - knot
        rate = c1 + x * (2.0 * c2 + x * (3.0 * c3))
        if self.harmonic is not None:
            amplitude, omega, phase = self.harmonic
            rate += amplitude * omega * cos(omega * t + phase)
        return rate

    def next_discontinuity(self, t: float) -> float:
        """Return the first time after t, s, at which a derivative jumps; inf if there is none."""
        i = bisect_right(self.knots, t)
        return self.knots[i] if i < len(self.knots) else inf

    def corners(self) -> tuple[float, ...]:
        """Return the sizes of all places but 0 at which a derivative jumps, ascending."""
        return tuple(sorted({abs(x) for x in self.knots} - {0.0}))

    def next_extremum(self, t: float) -> float:
        """Return a time after t, s, up to which the signal is monotone and smooth; inf if all."""
        if self.harmonic is None:
            return self.next_discontinuity(t)
        _, omega, phase = self.harmonic
        k, further = ceil((omega * t + phase - pi / 2) / pi), 1
        while True:
            extremum = (pi / 2 + k * pi - phase) / omega
            # Rounding may return t itself; many times, where periods are below its resolution.
            if extremum > t:
                return extremum
            k += further
            further *= 2

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        """Return bounds of the value between two times between which it is smooth."""
        one, two = self(begin), self(end)
        if self.harmonic is not None:
            one = self.pieces[0].c0 - self.harmonic.amplitude
            two = self.pieces[0].c0 + self.harmonic.amplitude
        return (one, two) if one <= two else (two, one)

    def curvature(self, begin: float, end: float) -> float:
        """Return a bound of the second derivative between two such times, per s^2."""
        knot, _, _, c2, c3 = self.pieces[bisect_right(self.knots, begin)]
        bound = max(abs(2.0 * c2 + 6.0 * c3 * (t - knot)) for t in (begin, end))
        if self.harmonic is not None:
            bound += abs(self.harmonic.amplitude) * self.harmonic.angular_frequency**2
        return bound

    def bend(self, t: float) -> tuple[float, float]:
        """Return the second derivative just after t, s, and a bound of the third one."""
        knot, _, _, c2, c3 = self.pieces[bisect_right(self.knots, t)]
        second, third = 2.0 * c2 + 6.0 * c3 * (t - knot), abs(6.0 * c3)
        if self.harmonic is not None:
            amplitude, omega, phase = self.harmonic
            second -= amplitude * omega**2 * sin(omega * t + phase)
            third += abs(amplitude) * omega**3
        return second, third


class Constant(Signal):
    """A constant; most signals are, and are asked for at every step."""

    def __init__(self, value: float) -> None:
        super().__init__([CubicPiece(0.0, value)])
        self._value = value

    def __call__(self, t: float) -> float:
        return self._value


# In the search for an extremum of a sum: the shortest step, as a part of its fastest period (rad),
# in which it changes by roundoff alone, and the number of steps.
LEAST_PHASE, MOST_LOOKS = 1e-7, 10_000


class Sum(Signal):
    """A sum of signals, of which one extremum after the other is searched for."""

    def __init__(self, terms: Sequence[Signal]) -> None:
        super().__init__([CubicPiece(0.0, 0.0)])
        self.terms = tuple(terms)
        self.knots = sorted({knot for term in terms for knot in term.knots})
        fastest = [term.harmonic.angular_frequency for term in terms if term.harmonic]
        self._least = LEAST_PHASE / max(fastest, default=inf)

    def __call__(self, t: float) -> float:
        return sum([term(t) for term in self.terms])

    def derivative(self, t: float) -> float:
        return sum([term.derivative(t) for term in self.terms])

    def next_extremum(self, t: float) -> float:
        """Return a time after t, s, up to which the sum is monotone, but for roundoff, and smooth.

        Where |f'''| <= D, a positive slope f' stays so up to the root of f' + f'' d - D d^2 / 2.
        """
        end, x, first = self.next_discontinuity(t), t, 0.0
        least = max(self._least, 4.0 * ulp(t))
        for _ in range(MOST_LOOKS):  # a shorter time is as true
            rate = self.derivative(x)
            if x >= end or rate * first < 0.0:
                break
            first = first or rate
            second, third = self.bend(x)
            second = copysign(1.0, first) * second if first else 0.0
            root = sqrt(second**2 + 2.0 * third * abs(rate))
            if third == 0.0 and second >= 0.0:
                return end
            falls = 2.0 * abs(rate) / (root - second) if second < 0.0 else 0.0
            x += max(falls or (second + root) / third, least)
        return min(x, end)

    def extremes(self, begin: float, end: float) -> tuple[float, float]:
        lows, highs = zip(*[term.extremes(begin, end) for term in self.terms], strict=True)
        return sum(lows), sum(highs)

    def curvature(self, begin: float, end: float) -> float:
        return sum([term.curvature(begin, end) for term in self.terms])

    def bend(self, t: float) -> tuple[float, float]:
        bends = [term.bend(t) for term in self.terms]
        return sum([second for second, _ in bends]), sum([third for _, third in bends])


def sum_of(terms: Sequence[Signal]) -> Signal:
    """Return the sum of signals, the only one as it is."""
    return terms[0] if len(terms) == 1 else Sum(terms) if terms else Constant(0.0)


def linear(times: Sequence[float], values: Sequence[float]) -> Signal:
    """Return linear interpolation between points, constant before the first and after the last."""
    points = list(zip(times, values, strict=True))
    if all(value == values[0] for value in values):
        return Constant(values[0])
    pieces = [CubicPiece(t0, v0, (v1 - v0) / (t1 - t0)) for (t0, v0), (t1, v1) in pairwise(points)]
    return Signal([CubicPiece(*points[0]), *pieces, CubicPiece(*points[-1])])
