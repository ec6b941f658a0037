"""Warnings about runs of one coordinate whose results may mislead; each returns [] if sound."""

from itertools import pairwise
from math import ulp
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.scenario.settings import MAX_SAMPLES
from frictionsim.scenario.signal_checks import shorter, too_long
from frictionsim.simulation.averages import time_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionsim.results import Array, Transition
    from frictionsim.scenario.signals import Signal
    from frictionsim.solvers.mechanism import Mechanism, Trajectory

# Transitions closer than this are one: event location is exact to two units in the last place.
SAME_EVENT_ULPS = 4.0
# A signal with more extrema is periodic, or a table as dense as the samples.
MAX_EXTREMA = 100_000


def hidden_stick_slip(
    transitions: "Sequence[Transition]", interval: float, duration: float
) -> list[str]:
    """Warn if the sampling interval does not resolve the changes of mode.

    Parameters
    ----------
    transitions : sequence of Transition
    interval, duration : float, s

    Returns
    -------
    list of str
    """
    changes = [e.time for e in transitions if e.mode_from != e.mode_to]
    apart = SAME_EVENT_ULPS * ulp(duration)
    shortest = min((b - a for a, b in pairwise(changes) if b - a > apart), default=None)
    if shortest is None or not too_long(interval, shortest):
        return []
    return [
        f"output.interval = {interval:g} s is longer than a tenth of the shortest time between"
        f" two changes of stick and slip, {shortest:.6g} s: the samples do not resolve the motion"
        f" between them; {shorter(shortest, duration, MAX_SAMPLES)}"
    ]


def nothing_moves(mechanism: "Mechanism", trajectory: "Trajectory") -> list[str]:
    """Warn if a mechanism did not move, with the largest ratio of torque to static limit.

    Parameters
    ----------
    mechanism : Mechanism
    trajectory : Trajectory

    Returns
    -------
    list of str
    """
    if mechanism.prescribed or np.any(trajectory.velocity) or np.ptp(trajectory.position) > 0.0:
        return []
    u = np.concatenate((trajectory.drive, _at_extrema(mechanism.drive, trajectory.time[-1])))
    q = np.full(u.shape, trajectory.position[0])
    applied_torque = np.broadcast_to(
        np.abs(mechanism.applied_torque(u, q, np.zeros_like(u))), q.shape
    )
    if mechanism.contact is None or not np.any(applied_torque):
        return ["nothing moves: no torque is applied"]
    limit = np.broadcast_to(mechanism.contact.static_limit(u, q), q.shape)
    ratio = np.max(applied_torque[limit > 0.0] / limit[limit > 0.0], initial=0.0)
    return [f"nothing moves: the largest torque is {100.0 * ratio:.10g} % of the static limit"]


def against_drive(time: "Array", torque: "Array", position: "Array") -> str:
    """Return the text of a warning if the motion went against the mean torque; else empty.

    Parameters
    ----------
    time : (n,), s
    torque : (n,) or scalar, N m
        Torque of the drive.
    position : (n,), rad

    Returns
    -------
    str
    """
    mean = float(time_mean(time, np.broadcast_to(torque, time.shape)))
    displacement = float(position[-1] - position[0])
    if mean * displacement >= 0.0:
        return ""
    return f"ran back by {abs(displacement):.6g} rad, against a mean torque of {mean:.4g} N m"


def _at_extrema(drive: "Signal", end: float) -> list[float]:
    """Return the values of a signal at its extrema, which the samples may miss."""
    values: list[float] = []
    t = drive.next_extremum(0.0)
    while t < end and len(values) < MAX_EXTREMA:
        values.append(drive(t))
        t = drive.next_extremum(t)
    return values
