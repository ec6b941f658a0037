"""Independent evaluation of results: each quantity of a summary, computed a second way.

It uses only the recorded channels, the events and the scenario, and shares no quantity,
function or constant with the package. Balances are solved by bisection where the package has
closed forms; work and dissipation are integrals over the samples where the package integrates
them with the motion. Each value has an uncertainty, which follows from the samples.
"""

from collections.abc import Callable, Mapping
from math import inf, pi, radians, sin
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


def root(function: Callable[[float], float], low: float, size: float) -> float | None:
    """Return the root of an increasing function at or above `low`; None if there is none.

    The root is exact to the roundoff of numbers of the given size.
    """
    if function(low) >= 0.0:
        return low
    width = size
    while function(low + width) <= 0.0:
        width *= 2.0
        if width > 1e12 * size:
            return None
    high = low + width
    while high - low > 1e-15 * size and low < (middle := 0.5 * (low + high)) < high:
        low, high = (low, middle) if function(middle) > 0.0 else (middle, high)
    return high


def least(function: Callable[[float], float], low: float, high: float) -> float:
    for _ in range(60):
        third = (high - low) / 3.0
        if function(low + third) < function(high - third):
            high -= third
        else:
            low += third
    return function(0.5 * (low + high))


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


# --- all mechanisms of one coordinate -------------------------------------------------------------


def of_any_motion(record: Recorded) -> dict[str, Seen]:
    """Return the final values from the last sample; `motion` integrates them."""
    torque = record.channels.get("drive_torque", np.zeros(1))
    peak = {"drive_torque_peak": closed(float(np.max(np.abs(torque))))}
    return (peak if "speed" in record.scenario.get("drive", {}) else {}) | {
        "final_time": Seen(record.scenario["solver"]["duration"]),
        "final_angle": Seen(float(record.channels["angle"][-1])),
        "final_angular_velocity": Seen(float(record.channels["angular_velocity"][-1])),
        "initial_energy": closed(stored_at_start(record.channels)),
    }


def stored_at_start(channels: Mapping[str, Array]) -> float:
    names = ("energy_kinetic", "energy_potential")
    return sum(float(channels[name][0]) for name in names if name in channels)


def motion(record: Recorded) -> dict[str, Seen]:
    """Return the last angle and velocity as the integrals of velocity and acceleration."""
    time, geometry, drive = (
        record.time,
        record.scenario["mechanism"],
        record.scenario.get("drive", {}),
    )
    turned = integral(time, record.channels["angular_velocity"])
    if "speed" in drive:
        speed = closed(float(signal(drive["speed"], time)[-1]))
    else:
        gained = integral(time, record.channels["angular_acceleration"])
        speed = plus(geometry["initial_angular_velocity"], gained)
    return {
        "angle": plus(radians(geometry["initial_angle_deg"]), turned),
        "angular_velocity": speed,
    }


def of_stick_and_slip(record: Recorded) -> dict[str, Seen]:
    """Return the times of the first breakaway and of the last stop, from the events.

    `residuals` checks the events against the samples between them.
    """
    changes = _changes(record)
    slips = [e.time for e in changes if e.mode_from == 0]
    rests = [e.time for e in changes if e.mode_to == 0]
    return {
        "breakaway_time": Seen(slips[0] if slips else None),
        "last_rest_time": Seen(rests[-1] if rests else None),
    }


def residuals(record: Recorded) -> list[float]:
    """Return the times of samples whose mode or velocity contradicts the events before them.

    A sample at the very time of an event may show either side of it.
    """
    changes, mode = _changes(record), record.channels["mode"]
    times = np.array([-inf, *(e.time for e in changes)])
    first = changes[0].mode_from if changes else int(mode[0])
    modes = np.array([first, *(e.mode_to for e in changes)])
    after = modes[np.searchsorted(times, record.time, side="right") - 1]
    before = modes[np.searchsorted(times, record.time, side="left") - 1]
    wrong = (mode != after) & (mode != before)
    wrong |= (mode == 0.0) & (record.channels["angular_velocity"] != 0.0)
    return [float(t) for t in record.time[wrong]]


def _changes(record: Recorded) -> list[Event]:
    return [e for e in record.events if e.mode_from != e.mode_to]
