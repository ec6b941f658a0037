"""Warnings about runs of one coordinate whose results may mislead; each returns [] if sound."""

from itertools import pairwise
from math import pi, ulp
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.results import STICK
from frictionsim.scenario.settings import MAX_SAMPLES
from frictionsim.scenario.signal_tables import SAMPLES_PER_PERIOD, shorter, too_long
from frictionsim.simulation.averages import time_mean
from frictionsim.solvers.end_stops import EVENT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionsim.results import Array, Transition
    from frictionsim.scenario.signals import Signal
    from frictionsim.solvers.mechanism import Mechanism, Trajectory

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
    between = (b.time - a.time for a, b in pairwise(changes) if EVENT not in (a.contact, b.contact))
    shortest = min((time for time in between if time > apart), default=None)
    if shortest is None or not too_long(interval, shortest):
        return []
    return [
        f"output.interval = {interval:g} s is longer than a tenth of the shortest time between"
        f" two changes of stick and slip, {shortest:.6g} s: the samples do not resolve the motion"
        f" between them; {shorter(shortest, duration, MAX_SAMPLES)}"
    ]


def nothing_moves(mechanism: "Mechanism", trajectory: "Trajectory") -> list[str]:
    """Warn if a mechanism did not move, with the largest ratio of torque to static limit."""
    if mechanism.prescribed or np.any(trajectory.velocity) or np.ptp(trajectory.position) > 0.0:
        return []
    u = np.concatenate((trajectory.drive, _at_extrema(mechanism.drive, trajectory.time[-1])))
    q = np.full(u.shape, trajectory.position[0])
    applied_torque = np.broadcast_to(
        np.abs(mechanism.applied_torque(u, q, np.zeros_like(u))), q.shape
    )
    stops, none = mechanism.stops, not np.any(applied_torque)
    if none and stops is not None and stops.side(float(q[0])) != STICK:
        return ["nothing moves: the body rests on its end stop"]
    if mechanism.contact is None or none:
        if mechanism.is_turned(trajectory):
            return ["nothing moves: the applied torques are in balance, their sum is zero"]
        return ["nothing moves: no torque is applied"]
    limit = np.broadcast_to(mechanism.contact.static_limit(u, q), q.shape)
    roundoff = mechanism.contact.roundoff(u, q)
    hidden = (applied_torque > (1.0 + TIE) * limit) & (applied_torque <= limit + roundoff)
    if np.any(hidden):
        return [
            f"nothing moves: a torque of {np.max(applied_torque[hidden]):.4g} N m is above the"
            " static limit, but not by more than the rounding of the forces,"
            f" {np.max(roundoff):.2g} N m; give smaller forces"
        ]
    ratio = np.max(applied_torque[limit > 0.0] / limit[limit > 0.0], initial=0.0)
    return [f"nothing moves: the largest torque is {100.0 * ratio:.10g} % of the static limit"]


def tiny_motion(trajectory: "Trajectory", atol: float) -> list[str]:
    """Warn of a motion of which the absolute tolerance `atol`, in rad and rad/s, is no small part.

    The stops of a motion of 1e-7 rad are 1e-6 of their time off with an atol of 1e-12.
    """
    moved = max(float(np.ptp(trajectory.position)), float(np.max(np.abs(trajectory.velocity))))
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


def _at_extrema(drive: "Signal", end: float) -> list[float]:
    """Return the values of a signal at its extrema, which the samples may miss."""
    values: list[float] = []
    for signal in getattr(drive, "signals", [drive]):  # time as the drive of several signals
        t, left = signal.next_extremum(0.0), MAX_EXTREMA
        while t < end and left:
            values.append(drive(t))
            t, left = signal.next_extremum(t), left - 1
    return values
