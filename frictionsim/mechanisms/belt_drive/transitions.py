"""Transitions of a belt drive: full slip and grip, lift-off, slack spans.

Each sample classifies the contact of the belt with every pulley, named as the pulley:

    FORWARD, BACKWARD   full slip: bodies touch the pulley, none of them sticks, and the friction
                        is at the whole of its kinetic limit
    OPEN                no body touches the pulley
    STICK               else: it grips, or, where there is no full slip, it is touched

and every span, named `span.<from>.<to>`: SLACK where its tension is next to nothing, else TAUT.

Directions. FORWARD is a belt that moves over the rim in the direction of positive (that is,
counter-clockwise) rotation of that pulley: v . t > R omega for t = z x n along the rim, so that
the friction on the belt points backward. A belt that is driven by a pulley turning clockwise and
falls behind slips FORWARD on it.

Full slip is looked for on pulleys that have a drive, torque or speed, and friction: one that turns
freely carries nothing, and whether the belt grips it is noise. Regularised laws never stick; for
them a body counts as sticking while it slips slower than the transition speed.

States are known at samples only: a transition has the time of the first sample of its new state,
and lies within one `output.interval` before it. It is a transition if the new state lasts: for
SAMPLES_TO_LEAVE samples where STICK or TAUT is left, for SAMPLES_TO_RETURN where another state is.
That a belt grips takes one body that sticks, and single bodies do so now and then while it slips
as a whole, as they land on the pulley; bodies that all slide by chance are rarer. The state of a
load at the very limit differs in every sample: of 30 000 samples with random states
some 30 are transitions (one for each 2^4 - 2 and 2^11 - 2 samples by turns).
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.results import BACKWARD, FORWARD, OPEN, SLACK, STICK, TAUT, Transition

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.quantities import BeltSamples

    Array = npt.NDArray[np.float64]
    Bools = npt.NDArray[np.bool_]
    ModeArray = npt.NDArray[np.int64]

SLACK_TENSION = 0.01  # of the pretension
FULL_SLIP = 0.99  # of the friction that sliding bodies have
# For how many samples a new state lasts, where STICK or TAUT is left, and where another state is.
SAMPLES_TO_LEAVE = 3
SAMPLES_TO_RETURN = 10


def is_slack(run: "BeltSamples") -> "Bools":
    """Return which spans are slack, (n, spans)."""
    slack: Bools = run.seen["_span_tension"] < SLACK_TENSION * run.pretension
    return slack


def is_full_slip(run: "BeltSamples") -> "Bools":
    """Return on which pulleys all bodies slide at the limit of friction, (n, pulleys).

    Never on a pulley without a drive or without friction.
    """
    scenario, seen, law = run.scenario, run.seen, run.scenario.effects.belt_friction
    if law is None:
        return np.zeros(seen["_touching"].shape, dtype=np.bool_)
    can_slip = [
        name in scenario.drive and law.pulleys.get(name, law).mu_s > 0.0 for name in run.names
    ]
    none_sticks = (seen["_touching"] > 0.0) & (seen["_sticking"] == 0.0)
    at_limit = np.abs(seen["_friction"]) >= FULL_SLIP * seen["_capacity"]
    full: Bools = none_sticks & at_limit & np.array(can_slip)
    return full


def pulley_modes(run: "BeltSamples") -> "ModeArray":
    """Return STICK, FORWARD, BACKWARD or OPEN for each pulley in every sample, (n, pulleys)."""
    seen, full = run.seen, is_full_slip(run)
    modes = np.full(full.shape, STICK, dtype=np.int64)
    if full.any():
        # A kinetic coefficient of zero has no friction to tell the direction.
        along = np.where(seen["_friction"] != 0.0, seen["_friction"], seen["_slip"])
        modes[full & (along < 0.0)] = FORWARD
        modes[full & (along > 0.0)] = BACKWARD
    modes[seen["_touching"] == 0.0] = OPEN
    return modes


def lasting_changes(modes: "ModeArray") -> list[tuple[int, int, int]]:
    """Return the changes to a mode that lasts: first sample of the new mode, old and new mode.

    Parameters
    ----------
    modes : (n,)
        Of one contact in every sample; the first one is the mode at the start.
    """
    starts = np.flatnonzero(np.diff(modes)) + 1
    lengths = np.diff(np.append(starts, len(modes)))
    mode, changes = int(modes[0]), []
    for start, length in zip(starts, lengths, strict=True):
        new = int(modes[start])
        needed = SAMPLES_TO_LEAVE if mode in (STICK, TAUT) else SAMPLES_TO_RETURN
        if new != mode and length >= needed:
            changes.append((int(start), mode, new))
            mode = new
    return changes


def transitions_of(run: "BeltSamples") -> list[Transition]:
    """Return the transitions of pulleys and spans, in the order of time."""
    if not run.time.size:
        return []
    contacts = [*run.names, *(f"span.{a}.{b}" for a, b in run.spans)]
    modes = np.hstack([pulley_modes(run), np.where(is_slack(run), SLACK, TAUT)])
    transitions = [
        Transition(float(run.time[sample]), contact, old, new)
        for contact, column in zip(contacts, modes.T, strict=True)
        for sample, old, new in lasting_changes(column)
    ]
    return sorted(transitions, key=lambda transition: transition.time)
