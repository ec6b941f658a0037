"""What a user should know of a run of one coordinate before trusting it; nothing if all is well."""

from itertools import pairwise
from math import ulp
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.scenario.settings import MOST_SAMPLES
from frictionsim.scenario.signal_checks import shorter, too_long
from frictionsim.simulation.averages import time_mean

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionsim.results import Array, Transition
    from frictionsim.scenario.signals import Signal
    from frictionsim.solvers.mechanism import Mechanism, Series

# Two transitions that are no further apart are one: a search ends within two roundings.
ROUNDINGS_OF_TIME = 4.0
# A drive that turns more often repeats itself, or is a table as dense as the samples.
MOST_TURNS = 100_000


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
        f" between them; {shorter(shortest, duration, MOST_SAMPLES)}"
    ]


def nothing_moves(mechanism: "Mechanism", series: "Series") -> list[str]:
    """Return that a mechanism has not moved at all, and how far from it it was."""
    if mechanism.prescribed or np.any(series.velocity) or np.ptp(series.position) > 0.0:
        return []
    u = np.concatenate((series.drive, _at_turns(mechanism.drive, series.time[-1])))
    q = np.full(u.shape, series.position[0])
    moment = np.broadcast_to(np.abs(mechanism.moment(u, q, np.zeros_like(u))), q.shape)
    if mechanism.contact is None or not np.any(moment):
        return ["nothing moves: no moment is applied"]
    limit = np.broadcast_to(mechanism.contact.static_limit(u, q), q.shape)
    share = np.max(moment[limit > 0.0] / limit[limit > 0.0], initial=0.0)
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
    t = drive.next_turn(0.0)
    while t < end and len(found) < MOST_TURNS:
        found.append(drive(t))
        t = drive.next_turn(t)
    return found
