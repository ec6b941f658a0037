"""Warnings about a valid scenario: a slip of a unit, a duration or a sampling that may mislead."""

from collections.abc import Iterator
from itertools import groupby, pairwise
from math import floor, inf, log10
from operator import itemgetter
from typing import Any

from frictionsim.scenario.schema import Params
from frictionsim.scenario.signal_tables import PiecewiseLinearTable, SineTable, last_change

# More do not fit into the memory of an ordinary machine.
MAX_SAMPLES = 10_000_000
SAMPLES_PER_PERIOD = 10  # that resolve it
ROUNDING = 1e-9  # tolerance for an interval of exactly a tenth
LONG = 1000.0  # times as long as the drive changes
MAX_RADIUS = 5.0  # m; the largest winders and flywheels have about as much
MAX_MU = 2.0  # soft rubber on dry rough ground stays below it
MAX_G = 30.0  # m/s^2; on Jupiter it is 25
# kg, of a disc with the moment of inertia and the radius; a mill's drum has about as much.
MAX_DISC = 2e5
RADII = ("radius", "cord_radius")  # of the body itself


def warnings_of(scenario: Any) -> list[str]:
    """Return warnings about a scenario whose results may mislead."""
    interval, duration = scenario.interval, scenario.solver.duration
    warnings = list(_unlikely_values(scenario))
    changes = max(map(last_change, scenario.signals.values()), default=0.0)
    if 0.0 < LONG * changes < duration:
        warnings.append(
            f"solver.duration = {duration:g} s is more than {LONG:g} times as long as the drive"
            f" changes, {changes:g} s: is it meant in seconds?"
        )
    if interval > duration:
        warnings.append(
            f"output.interval = {interval:g} s is longer than the run: only its start and end are"
            " sampled"
        )
        return warnings
    for name, signal in scenario.signals.items():
        period = _shortest_period(signal, duration)
        of = f"the period of {name}, {period:.6g} s"
        warnings += unresolved(interval, period, duration, of, "it")
    return warnings


def unresolved(interval: float, period: float, duration: float, of: str, what: str) -> list[str]:
    """Return the warning of an interval of samples too long for a period `of` something, s."""
    if interval * SAMPLES_PER_PERIOD <= period * (1.0 + ROUNDING):
        return []
    enough = period / SAMPLES_PER_PERIOD
    power = floor(log10(enough)) - 1  # of the last of two digits
    shorter = float(f"{floor(enough / 10.0**power * (1.0 + ROUNDING))}e{power}")
    way = f"give {shorter:g} s or less"
    if duration / shorter > MAX_SAMPLES:
        way = f"a sufficient interval needs more than {MAX_SAMPLES} samples; shorten the run"
    return [
        f"output.interval = {interval:g} s is longer than a tenth of {of}: the samples do not"
        f" resolve {what}; {way}"
    ]


def _shortest_period(signal: Any, end: float) -> float:
    """Return the shortest period of a signal, or of signals that add, before a time, s; or inf.

    That of points is twice the shortest time between two extrema, or between the start of a rise
    and the end of the fall behind it.
    """
    periods = [inf]
    for term in signal if isinstance(signal, tuple) else (signal,):
        if isinstance(term, SineTable) and term.sine.amplitude:
            periods.append(1.0 / term.sine.frequency_hz)
        elif isinstance(term, PiecewiseLinearTable):
            steps = pairwise(zip(term.time, term.value, strict=True))
            moves = [(v1 > v0, t0, t1) for (t0, v0), (t1, v1) in steps if v1 != v0]
            ways = [list(moves) for _, moves in groupby(moves, key=itemgetter(0))]  # up or down
            # Of each extremum the middle of its plateau, and how long it takes there and back.
            extrema = [(0.5 * (a[-1][2] + b[0][1]), b[-1][2] - a[0][1]) for a, b in pairwise(ways)]
            extrema = [(time, pulse) for time, pulse in extrema if 0.0 < time < end]
            periods += [pulse for _, pulse in extrema]
            periods += [2.0 * (after - before) for (before, _), (after, _) in pairwise(extrema)]
    return min(periods)


def _unlikely_values(table: Params, path: str = "") -> Iterator[str]:
    """Yield a warning of each value of a table, and of those in it, that is hardly meant."""
    values = table.__dict__
    for name, value in values.items():
        key = f"{path}{name}"
        if isinstance(value, Params):
            yield from _unlikely_values(value, f"{key}.")
        elif isinstance(value, dict | tuple):
            for of, row in _rows(value):
                yield from _unlikely_values(row, f"{key}.{of}.")
        elif not isinstance(value, float):
            continue
        elif name.endswith("radius") and abs(value) > MAX_RADIUS:
            yield (
                f"{key} = {value:g} m is a radius above {MAX_RADIUS:g} m; did you mean"
                f" {value / 1000.0:.6g}, for {value:g} mm?"
            )
        elif name in ("mu_s", "mu_k") and value > MAX_MU:
            yield (
                f"{key} = {value:g} is a coefficient of friction above {MAX_MU:g}; did you mean"
                f" {value / 10.0 ** (floor(log10(value)) + 1):.6g}?"
            )
        elif name == "g" and value > MAX_G:
            yield f"{key} = {value:g} m/s^2 is above {MAX_G:g} m/s^2; did you mean 9.81?"
        elif name == "inertia":
            radius = next((values[r] for r in RADII if r in values), 0.0)
            mass = 2.0 * value / radius / radius if 0.0 < radius <= MAX_RADIUS else 0.0
            if mass > MAX_DISC:
                yield (
                    f"{key} = {value:g} kg m^2 is that of a disc of {mass:.3g} kg with the radius"
                    f" {radius:g} m; did you mean another unit?"
                )


def _rows(values: Any) -> Iterator[tuple[Any, Params]]:
    """Yield the tables by name, or of a list, by the names that they have."""
    items = values.items() if isinstance(values, dict) else enumerate(values)
    for of, row in items:
        if isinstance(row, Params):
            yield getattr(row, "name", of), row
