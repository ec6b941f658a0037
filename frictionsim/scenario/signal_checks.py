"""Periods and extreme values of the signals of a scenario, for warnings about the sampling."""

from itertools import pairwise
from math import floor, log10
from typing import Any, NamedTuple

from frictionsim.scenario.signal_tables import PiecewiseLinearTable, SineTable, signal_from

# Number of samples that resolve a period.
SAMPLES_PER_PERIOD = 10
ROUNDING = 1e-9  # tolerance for an interval of exactly a tenth


def period_of(signal: Any, end: float) -> float | None:
    """Return the shortest period of a signal, s; None if it has none.

    The period of a table of points is twice the shortest time between two extrema, or the
    duration of the shortest pulse: from the start of its rise to the end of its fall.

    Parameters
    ----------
    signal : number or signal table of the scenario, or a tuple of them, which add
    end : float, s
        Extrema after this time are ignored.

    Returns
    -------
    float or None, s
    """
    if isinstance(signal, tuple):
        found = [period_of(term, end) for term in signal]
        return min((period for period in found if period is not None), default=None)
    if isinstance(signal, SineTable):
        return 1.0 / signal.sine.frequency_hz if signal.sine.amplitude else None
    if not isinstance(signal, PiecewiseLinearTable):
        return None
    extrema = [extremum for extremum in _extrema(signal) if 0.0 < extremum.time < end]
    periods = [extremum.pulse for extremum in extrema]
    periods += [2.0 * (b.time - a.time) for a, b in pairwise(extrema)]
    return min(periods, default=None)


class _Extremum(NamedTuple):
    """Time of an extremum, and duration of the monotone parts before and after it, s."""

    time: float
    pulse: float


def _extrema(table: PiecewiseLinearTable) -> list[_Extremum]:
    """Return the extrema of a table of points; of a plateau the middle."""
    extrema: list[_Extremum] = []
    rising: bool | None = None
    began, since = 0.0, 0.0  # start of the last monotone part, and of the last plateau
    for (t0, v0), (t1, v1) in pairwise(zip(table.time, table.value, strict=True)):
        if v0 == v1:
            continue
        if rising is not None and rising != (v1 > v0):
            extrema.append(_Extremum(0.5 * (since + t0), t1 - began))
        rising, began, since = v1 > v0, t0, t1
    return extrema


def extremes(signal: Any, end: float) -> tuple[float, float]:
    """Return the minimum and maximum of a signal between 0 and `end`.

    Parameters
    ----------
    signal : number or signal table of the scenario
    end : float, s

    Returns
    -------
    (float, float)
    """
    if isinstance(signal, SineTable) and signal.sine.frequency_hz * end >= 1.0:
        mean, amplitude = signal.sine.mean, abs(signal.sine.amplitude)
        return mean - amplitude, mean + amplitude
    value = signal_from(signal)
    values, t = [value(0.0), value(end)], value.next_extremum(0.0)
    while t < end:
        values.append(value(t))
        t = value.next_extremum(t)
    return min(values), max(values)


def too_long(interval: float, period: float) -> bool:
    """Return whether a sampling interval, s, is too long to resolve a period, s."""
    return interval * SAMPLES_PER_PERIOD > period * (1.0 + ROUNDING)


def shorter(period: float, duration: float, max_samples: int) -> str:
    """Return the advice on the sampling interval in a warning.

    Parameters
    ----------
    period, duration : float, s
    max_samples : int
    """
    interval = period / SAMPLES_PER_PERIOD
    unit = 10.0 ** (floor(log10(interval)) - 1)
    digits = floor(interval / unit * (1.0 + ROUNDING))
    if duration / (digits * unit) <= max_samples:
        return f"give {float(f'{digits}e{round(log10(unit))}'):g} s or less"
    return f"a sufficient interval needs more than {max_samples} samples; shorten the run"
