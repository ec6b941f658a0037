"""Warnings about runs of one coordinate whose results may mislead; each returns [] if sound."""

from itertools import pairwise
from math import pi, ulp
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.results import STICK
from frictionsim.scenario.plausibility import SAMPLES_PER_PERIOD, unresolved
from frictionsim.simulation.averages import time_mean
from frictionsim.solvers.events import STOP
from frictionsim.solvers.system import MARGINS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionsim.results import Array, Transition
    from frictionsim.simulation.mechanism import Samples

# Transitions closer than this are one: event location is exact to two units in the last place.
SAME_EVENT_ULPS = 4.0
# The absolute tolerance may be the first share of a motion, and fits it with the second.
SMALL_SHARE, FITTING_SHARE = 1e-6, 1e-9


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
    if shortest is None:
        return []
    of = f"the shortest time between two changes of stick and slip, {shortest:.6g} s"
    return unresolved(interval, shortest, duration, of, "the motion between them")


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
    of = f"a turn, which takes {turn:.3g} s at the largest speed"
    return unresolved(interval, turn, duration, of, "what depends on the angle")


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


def undetermined(samples: "Samples") -> list[str]:
    """Warn of a rest that the drive gives to a body with dry friction."""
    if "mode" not in samples.columns:
        return []
    limit = np.where(samples["mode"] == STICK, samples[MARGINS[0]], 0.0)
    return [
        f"drive.speed is 0 at {time:.6g} s: the friction of a body that is held is undetermined,"
        " and counts as 0; drive_torque may differ from what is shown there by up to the static"
        f" limit, {np.max(limit):.4g} N m"
        for time in samples.time[limit > 0.0][:1]
    ]
