"""What a user should know of a run of one coordinate before trusting it; nothing if all is well."""

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

# Two transitions that are no further apart are one: a search ends within two roundings.
ROUNDINGS_OF_TIME = 4.0
# A drive that turns more often repeats itself, or is a table as dense as the samples.
MAX_EXTREMA = 100_000


def hidden_stick_slip(
    transitions: "Sequence[Transition]", interval: float, duration: float
) -> list[str]:
    """Return that samples at an interval are too few for the changes of mode, s."""
    changes = [e.time for e in transitions if e.mode_from != e.mode_to]
    apart = ROUNDINGS_OF_TIME * ulp(duration)
    shortest = min((b - a for a, b in pairwise(changes) if b - a > apart), default=None)
    if shortest is None or not too_long(interval, shortest):
        return []
    return [
        f"output.interval = {interval:g} s is longer than a tenth of the shortest time between"
        f" two changes of stick and slip, {shortest:.6g} s: the samples do not show what happens"
        f" between them; {shorter(shortest, duration, MAX_SAMPLES)}"
    ]


def nothing_moves(mechanism: "Mechanism", trajectory: "Trajectory") -> list[str]:
    """Return that a mechanism has not moved at all, and how far from it it was."""
    if mechanism.prescribed or np.any(trajectory.velocity) or np.ptp(trajectory.position) > 0.0:
        return []
    u = np.concatenate((trajectory.drive, _at_turns(mechanism.drive, trajectory.time[-1])))
    q = np.full(u.shape, trajectory.position[0])
    applied_torque = np.broadcast_to(
        np.abs(mechanism.applied_torque(u, q, np.zeros_like(u))), q.shape
    )
    if mechanism.contact is None or not np.any(applied_torque):
        return ["nothing moves: no moment is applied"]
    limit = np.broadcast_to(mechanism.contact.static_limit(u, q), q.shape)
    share = np.max(applied_torque[limit > 0.0] / limit[limit > 0.0], initial=0.0)
    return [f"nothing moves: the largest moment is {100.0 * share:.10g} % of the static limit"]


def against_drive(time: "Array", torque: "Array", position: "Array") -> str:
    """Return that a motion went against the mean torque of its drive, and how far; or nothing."""
    mean = float(time_mean(time, np.broadcast_to(torque, time.shape)))
    way = float(position[-1] - position[0])
    if mean * way >= 0.0:
        return ""
    return f"ran back by {abs(way):.6g} rad, against a torque of {mean:.4g} N m in the mean"


def _at_turns(drive: "Signal", end: float) -> list[float]:
    """Return the values of a drive where it turns, between which its samples may lie."""
    found: list[float] = []
    t = drive.next_extremum(0.0)
    while t < end and len(found) < MAX_EXTREMA:
        found.append(drive(t))
        t = drive.next_extremum(t)
    return found
