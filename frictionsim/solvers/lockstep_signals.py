"""Signals of many runs: each returns one value for each run, at a time of each run.

They have the bits of the signals in `frictionsim.scenario.signals`, of which they are made.
"""

from collections.abc import Sequence
from math import inf, pi
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from frictionsim.scenario.signals import Constant, PiecewiseLinear, Sine, SmoothStep

if TYPE_CHECKING:
    from frictionsim.scenario.signals import Signal

# Tables of more points are searched in the time order of one run only.
MAX_POINTS = 64


class Unlike(Exception):
    """Two runs differ in more than numbers, so that they do not go in lockstep."""


class SignalOfRuns(Protocol):
    """The signals of many runs; times and values have shape (runs,)."""

    def __call__(self, t: Any) -> Any:
        """Return the values at times t, s."""

    def next_extremum(self, t: Any) -> Any:
        """Return times after t up to which each signal is monotone and smooth, s."""

    def select(self, runs: Any) -> Self:
        """Return the signals of some of the runs, by their indices."""


def joined_signal(signals: "Sequence[Signal]") -> SignalOfRuns:
    """Return the signals of many runs as one.

    Raises
    ------
    Unlike
        If they are not of one form.
    """
    form = type(signals[0])
    if form not in FORMS or any(type(signal) is not form for signal in signals):
        raise Unlike
    found: SignalOfRuns = FORMS[form](signals)
    return found


def _table(rows: list[Any]) -> Any:
    """Return one column for each run, from a row for each."""
    return np.array(rows).T.copy()


class _OfParameters:
    """Signals with the same few parameters in each run, one array each."""

    _parameters: Any

    def select(self, runs: Any) -> Self:
        found = object.__new__(type(self))
        found._parameters = self._parameters[:, runs]
        return found


class ConstantOfRuns(_OfParameters):
    """A constant in each run."""

    def __init__(self, signals: "Sequence[Signal]") -> None:
        self._parameters = _table([(signal(0.0),) for signal in signals])

    def __call__(self, t: Any) -> Any:
        return self._parameters[0]

    def next_extremum(self, t: Any) -> Any:
        return np.full(t.shape, inf)


class SineOfRuns(_OfParameters):
    """mean + amplitude sin(angular_frequency t + phase)."""

    def __init__(self, signals: "Sequence[Signal]") -> None:
        self._parameters = _table([(s.pieces()[0].c0, *s.harmonic()) for s in signals])  # type: ignore[misc]

    def __call__(self, t: Any) -> Any:
        mean, amplitude, omega, phase = self._parameters
        return mean + amplitude * np.sin(omega * t + phase)

    def next_extremum(self, t: Any) -> Any:
        _, _, omega, phase = self._parameters
        k, further = np.ceil((omega * t + phase - pi / 2) / pi), 1.0
        while True:
            extremum = (pi / 2 + k * pi - phase) / omega
            same = extremum <= t  # by rounding
            if not same.any():
                return extremum
            k = np.where(same, k + further, k)
            further *= 2.0


class SmoothStepOfRuns(_OfParameters):
    """Transition between two values by 3 x^2 - 2 x^3."""

    def __init__(self, signals: "Sequence[Signal]") -> None:
        rows = []
        for signal in signals:
            before, rise, after = signal.pieces()
            rows.append((before.c0, after.c0 - before.c0, rise.knot, after.knot))
        self._parameters = _table(rows)

    def __call__(self, t: Any) -> Any:
        before, rise, start, stop = self._parameters
        x = np.minimum(np.maximum((t - start) / (stop - start), 0.0), 1.0)
        return before + rise * (x * x * (3.0 - 2.0 * x))

    def next_extremum(self, t: Any) -> Any:
        _, _, start, stop = self._parameters
        return np.where(t < start, start, np.where(t < stop, stop, inf))


class PiecewiseLinearOfRuns:
    """Linear interpolation between points, constant before the first and after the last.

    A step stays between two points, so that the line of each run is kept from call to call, and
    looked up where the time has left it.
    """

    def __init__(self, signals: "Sequence[Signal]") -> None:
        same, runs = vars(signals[0]), len(signals)
        if all(vars(signal) == same for signal in signals):
            signals = signals[:1]  # one table for all runs
        tables = [[piece[:3] for piece in signal.pieces()] for signal in signals]
        if set(map(len, tables)) != {len(tables[0])}:
            raise Unlike
        if len(signals) > 1 and len(tables[0]) > MAX_POINTS:
            raise Unlike
        # (table, piece, run): the knots, values and slopes; the first piece has no beginning.
        self._pieces = np.array(tables).transpose(2, 1, 0)
        self._begin(runs)

    def _begin(self, runs: int) -> None:
        self._runs = runs
        # Of the present line of each run: times between which it holds; none is known yet.
        self._from, self._to = np.full(runs, inf), np.full(runs, -inf)
        self._line = np.zeros((3, runs))

    def select(self, runs: Any) -> Self:
        found = object.__new__(type(self))
        shared = self._pieces.shape[2] == 1
        found._pieces = self._pieces if shared else self._pieces[:, :, runs]
        found._begin(len(runs))
        return found

    def __call__(self, t: Any) -> Any:
        outside = (t < self._from) | (t >= self._to)
        if outside.any():
            self._look_up(t, np.flatnonzero(outside))
        knot, value, slope = self._line
        return value + slope * (t - knot)

    def next_extremum(self, t: Any) -> Any:
        outside = (t < self._from) | (t >= self._to)
        if outside.any():
            self._look_up(t, np.flatnonzero(outside))
        return self._to.copy()

    def _look_up(self, t: Any, runs: Any) -> None:
        """Take the lines that hold at times t, for some of the runs."""
        t = t[runs] if np.ndim(t) else np.full(runs.shape, t)
        table = np.zeros_like(runs) if self._pieces.shape[2] == 1 else runs
        times = self._pieces[0, 1:]
        if self._pieces.shape[2] == 1:
            piece = np.searchsorted(times[:, 0], t, side="right")
        else:
            piece = np.sum(times[:, runs] <= t, axis=0)
        self._line[:, runs] = self._pieces[:, piece, table]
        last = len(times)
        at = np.minimum(piece, last - 1)
        self._to[runs] = np.where(piece < last, times[at, table], inf)
        self._from[runs] = np.where(piece > 0, times[piece - 1, table], -inf)


FORMS: dict[type, Any] = {
    Constant: ConstantOfRuns,
    PiecewiseLinear: PiecewiseLinearOfRuns,
    Sine: SineOfRuns,
    SmoothStep: SmoothStepOfRuns,
}
