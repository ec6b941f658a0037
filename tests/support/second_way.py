"""Quantities of a summary read from recorded channels, events and the scenario alone.

Work and dissipation are integrals over the samples where the package integrates them with the
motion. Each value has an uncertainty, which follows from the samples.
"""

from math import pi, radians, sin
from sys import float_info
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Table = dict[str, Any]

# Relative and absolute: local errors of a hundred steps at the defaults rtol = 1e-9, atol = 1e-12.
INTEGRATION_ERROR, MIN_ERROR = 1e-7, 1e-10
# A closed form and a bisection to adjacent floats differ by a few roundings.
ROUNDING = 1e-12


class Seen(NamedTuple):
    """A quantity computed a second way; None if it is undefined."""

    value: float | None
    uncertainty: float = 0.0

    def agrees(self, value: float | None) -> bool:
        """Return whether a quantity of the summary agrees within the uncertainty."""
        if self.value is None or value is None:
            return self.value is value
        # Numbers below the smallest normal one have no digits left.
        return abs(value - self.value) <= self.uncertainty + float_info.min


class Recorded(NamedTuple):
    """A result: the scenario with its defaults, the channels and the events."""

    scenario: Table
    time: Array
    channels: dict[str, Array]
    events: list["Event"]


class Event(NamedTuple):
    time: float
    contact: str
    mode_from: int
    mode_to: int
    angle: float


# --- quantities ---------------------------------------------------------------------------


def closed(value: float | None) -> Seen:
    return Seen(value, 0.0 if value is None else ROUNDING * abs(value))


def integral(time: Array, values: Array) -> Seen:
    """Return the integral over the samples by trapezoids.

    In a cell of width h they are off by at most h^2/8 times the variation of the slope there, which
    is estimated by that from the middle of the cell before to the middle of the one after. The
    estimate also covers a jump J within a cell, worth at most h J/2; the slopes beside a jump may
    make it look smaller, hence 6 and not 8.
    """
    h = np.diff(time)
    turn = np.abs(np.diff(np.diff(values) / h))
    # The variation outside the first and the last cell is assumed equal to that inside.
    variation = np.append(turn, turn[-1]) + np.insert(turn, 0, turn[0])
    cells = 0.5 * h * (values[1:] + values[:-1])
    error = float(np.sum(h * h * variation)) / 6.0
    return Seen(
        float(np.sum(cells)), error + INTEGRATION_ERROR * float(np.sum(np.abs(cells))) + MIN_ERROR
    )


def plus(start: float, gained: Seen) -> Seen:
    assert gained.value is not None
    return Seen(start + gained.value, gained.uncertainty + ROUNDING * abs(start))


def signal(table: Any, time: Array) -> Array:
    if isinstance(table, int | float):
        return np.full(time.shape, float(table))
    if "sine" in table:
        s = table["sine"]
        phase = 2.0 * pi * s["frequency_hz"] * time + radians(s.get("phase_deg", 0.0))
        return s.get("mean", 0.0) + s["amplitude"] * np.sin(phase)
    if "smooth_step" in table:
        s = table["smooth_step"]
        x = np.clip((time - s["start"]) / (s["stop"] - s["start"]), 0.0, 1.0)
        return s["from"] + (s["to"] - s["from"]) * (3.0 * x**2 - 2.0 * x**3)
    return np.interp(time, table["time"], table["value"])


def friction_radius(shaft_radius: float, mu: float) -> float:
    return shaft_radius * sin(np.arctan(mu))
