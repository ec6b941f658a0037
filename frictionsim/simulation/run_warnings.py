"""Warnings about runs of one coordinate whose results may mislead; each returns [] if sound."""

from itertools import pairwise
from math import pi, ulp
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import STICK
from frictionsim.scenario.settings import MAX_SAMPLES
from frictionsim.scenario.signal_tables import SAMPLES_PER_PERIOD, shorter, too_long
from frictionsim.simulation.averages import time_mean
from frictionsim.solvers.events import STOP

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from frictionsim.results import Array, Transition
    from frictionsim.scenario.signals import Signal

# Transitions closer than this are one: event location is exact to two units in the last place.
SAME_EVENT_ULPS = 4.0
# Torque and limit that differ by less, relatively, are equal but for rounding.
TIE = 1e-9
# The absolute tolerance may be the first share of a motion, and fits it with the second.
SMALL_SHARE, FITTING_SHARE = 1e-6, 1e-9
# A signal with more extrema is periodic, or a table as dense as the samples.
MAX_EXTREMA = 100_000


def hidden_stick_slip(
    transitions: "Sequence[Transition]", interval: float, duration: float
) -> list[str]:
    """Warn if the sampling interval does not resolve the changes of stick and slip.

    The flights of a body that bounces on an end stop, ever shorter ones, do not count.

    Parameters
    ----------
    transitions : sequence of Transition
    interval, duration : float, s
    """
    changes = [e for e in transitions if e.mode_from != e.mode_to]
    apart = SAME_EVENT_ULPS * ulp(duration)
    between = (b.time - a.time for a, b in pairwise(changes) if STOP not in (a.contact, b.contact))
    shortest = min((time for time in between if time > apart), default=None)
    if shortest is None or not too_long(interval, shortest):
        return []
    return [
        f"output.interval = {interval:g} s is longer than a tenth of the shortest time between"
        f" two changes of stick and slip, {shortest:.6g} s: the samples do not resolve the motion"
        f" between them; {shorter(shortest, duration, MAX_SAMPLES)}"
    ]


def nothing_moved(
    system: Any, samples: Any, is_turned: "Callable[[Any], bool] | None" = None
) -> list[str]:
    """Warn if a mechanism of one coordinate did not move, with the largest torque over its limit.

    Parameters
    ----------
    system : OneCoordinate
    samples : Samples
    is_turned : callable or None
        Of the samples: whether torques act that cancel each other; else whether the drive does.
    """
    if np.any(samples["angular_velocity"]) or np.ptp(samples["angle"]) > 0.0:
        return []
    end, t, left = float(samples.time[-1]), 0.0, MAX_EXTREMA
    y, times = [float(samples["angle"][0]), 0.0], samples.time.tolist()
    while t < end and left:  # at its extrema, too, which the samples may miss
        t, left = system.smooth_until(t, y, end), left - 1
        times.append(t)
    times += _extrema(getattr(system.drive, "signals", ()), end)
    acting = [system.acting(t, y[0], 0.0) for t in times]
    torques = np.array([system.torque(u, y[0], 0.0) for u in acting])
    stops, none = system.stops, not np.any(torques)
    if none and stops is not None and stops.side(y[0]) != STICK:
        return ["nothing moves: the body rests on its end stop"]
    if system.friction is None or none:
        if is_turned(samples) if is_turned else any(map(np.any, acting)):
            return ["nothing moves: the applied torques are in balance, their sum is zero"]
        return ["nothing moves: no torque is applied"]
    limit = np.array([system.friction.static(u, y[0]) for u in acting])
    roundoff = np.array([system.friction.roundoff(u, y[0]) for u in acting])
    size = np.abs(torques)
    hidden = (size > (1.0 + TIE) * limit) & (size <= limit + roundoff)
    if np.any(hidden):
        return [
            f"nothing moves: a torque of {np.max(size[hidden]):.4g} N m is above the static limit,"
            f" but not by more than the rounding of the forces, {np.max(roundoff):.2g} N m; give"
            " smaller forces"
        ]
    ratio = np.max(size[limit > 0.0] / limit[limit > 0.0], initial=0.0)
    return [f"nothing moves: the largest torque is {100.0 * ratio:.10g} % of the static limit"]


def tiny_motion(position: "Array", velocity: "Array", atol: float) -> list[str]:
    """Warn of a motion of which the absolute tolerance `atol`, in rad and rad/s, is no small part.

    The stops of a motion of 1e-7 rad are 1e-6 of their time off with an atol of 1e-12.
    """
    moved = max(float(np.ptp(position)), float(np.max(np.abs(velocity))))
    if moved == 0.0 or atol <= SMALL_SHARE * moved:
        return []
    return [
        f"the motion is at most {moved:.3g} rad and rad/s, of which solver.atol = {atol:.3g} is no"
        f" small part: its events may be off; give solver.atol = {FITTING_SHARE * moved:.0e}"
    ]


def hidden_turns(
    position: "Array", velocity: "Array", interval: float, duration: float
) -> list[str]:
    """Warn if the sampling interval does not resolve the turns of what depends on an angle.

    Motion within a tenth of a turn does not count, however fast.

    Parameters
    ----------
    position : (n,) or (n, pulleys), rad
    velocity : of the same shape, rad/s
    interval, duration : float, s
    """
    turns = np.ptp(position, axis=0) * SAMPLES_PER_PERIOD > 2.0 * pi
    fastest = float(np.max(np.abs(velocity) * turns, initial=0.0))
    if interval * fastest == 0.0:
        return []
    turn = 2.0 * pi / fastest
    if not too_long(interval, turn):
        return []
    return [
        f"output.interval = {interval:g} s is longer than a tenth of a turn, which takes"
        f" {turn:.3g} s at the largest speed: the samples do not resolve what depends on the angle;"
        f" {shorter(turn, duration, MAX_SAMPLES)}"
    ]


def against_drive(time: "Array", torque: "Array", position: "Array") -> str:
    """Return the text of a warning if the motion went against the mean torque; else empty.

    Parameters
    ----------
    time : (n,), s
    torque : (n,) or scalar, N m
        Torque of the drive.
    position : (n,), rad
    """
    mean = float(time_mean(time, np.broadcast_to(torque, time.shape)))
    displacement = float(position[-1] - position[0])
    if mean * displacement >= 0.0:
        return ""
    return f"ran back by {abs(displacement):.6g} rad, against a mean torque of {mean:.4g} N m"


def _extrema(signals: "Sequence[Signal]", end: float) -> list[float]:
    """Return the times of the extrema of signals, s."""
    times: list[float] = []
    for signal in signals:
        t, left = signal.next_extremum(0.0), MAX_EXTREMA
        while t < end and left:
            times.append(t)
            t, left = signal.next_extremum(t), left - 1
    return times
