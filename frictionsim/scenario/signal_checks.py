"""What the signals of a drive are like: how fast they repeat and between which values they go."""

from itertools import pairwise
from math import floor, log10
from typing import Any, NamedTuple

from frictionsim.scenario.signal_tables import PiecewiseLinearTable, SineTable, signal_from

# So many samples show a period.
SAMPLES_OF_A_PERIOD = 10
ROUNDING = 1e-9  # of an interval that was meant to be a tenth


def period_of(signal: Any, end: float) -> float | None:
    """Return the shortest period of a signal of the scenario up to `end`, s; None if it has none.

    Of a table of points it is twice the shortest time between two of its turns, or how long the
    shortest pulse takes: from where it begins to rise, before a turn, to where it has fallen.
    """
    if isinstance(signal, SineTable):
        return 1.0 / signal.sine.frequency_hz if signal.sine.amplitude else None
    if not isinstance(signal, PiecewiseLinearTable):
        return None
    turns = [turn for turn in _turns(signal) if 0.0 < turn.time < end]
    periods = [turn.pulse for turn in turns]
    periods += [2.0 * (b.time - a.time) for a, b in pairwise(turns)]
    return min(periods, default=None)


class _Turn(NamedTuple):
    """When a table of points turns, and how long it takes to that and from it, s."""

    time: float
    pulse: float


def _turns(table: PiecewiseLinearTable) -> list[_Turn]:
    """Return where a table of points turns; where it stays for a while, the middle of that."""
    turns: list[_Turn] = []
    rising: bool | None = None
    began, since = 0.0, 0.0  # the last way up or down, and the value it has stayed at
    for (t0, v0), (t1, v1) in pairwise(zip(table.time, table.value, strict=True)):
        if v0 == v1:
            continue
        if rising is not None and rising != (v1 > v0):
            turns.append(_Turn(0.5 * (since + t0), t1 - began))
        rising, began, since = v1 > v0, t0, t1
    return turns


def extremes(signal: Any, end: float) -> tuple[float, float]:
    """Return the least and the largest value of a signal of the scenario from 0 to `end`, s."""
    if isinstance(signal, SineTable) and signal.sine.frequency_hz * end >= 1.0:
        mean, amplitude = signal.sine.mean, abs(signal.sine.amplitude)
        return mean - amplitude, mean + amplitude
    value = signal_from(signal)
    found, t = [value(0.0), value(end)], value.next_extremum(0.0)
    while t < end:
        found.append(value(t))
        t = value.next_extremum(t)
    return min(found), max(found)


def too_long(interval: float, period: float) -> bool:
    """Return whether samples at an interval do not show what takes a period, s."""
    return interval * SAMPLES_OF_A_PERIOD > period * (1.0 + ROUNDING)


def shorter(period: float, duration: float, most: int) -> str:
    """Return the advice on an interval that shows a period, s; at most so many samples are kept."""
    wanted = period / SAMPLES_OF_A_PERIOD
    unit = 10.0 ** (floor(log10(wanted)) - 1)
    digits = floor(wanted / unit * (1.0 + ROUNDING))
    if duration / (digits * unit) <= most:
        return f"give {float(f'{digits}e{round(log10(unit))}'):g} s or less"
    return f"{most} samples of so short an interval do not reach to the end of the run"
