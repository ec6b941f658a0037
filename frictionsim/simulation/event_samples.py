"""Samples of a run of one coordinate, from the regular ones and the two sides of each event."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import STICK, Transition

if TYPE_CHECKING:
    from frictionsim.solvers.common import SampleBuffer

TIME, VELOCITY, MODE = 0, 3, 6  # columns of a row of `SampleBuffer`


class Samples(NamedTuple):
    """What a run has recorded and what is finite of it.

    Attributes
    ----------
    rows : (n, width)
        The samples, at strictly increasing times.
    transitions : list of Transition
        In the order of time.
    before, after : (m, width)
        Their sides.
    unsound : bool
        Something was not finite; what follows it was left out.
    """

    rows: Any
    transitions: list[Transition]
    before: Any
    after: Any
    non_finite_tail: bool


def samples_of(buffer: "SampleBuffer", width: int, at_events: bool) -> Samples:
    """Return the regular samples, and with `at_events` one at each event, too."""
    rows = np.array(buffer.rows).reshape(-1, width)
    sides = np.array(buffer.sides).reshape(-1, 2, width)
    order = np.argsort(sides[:, 1, TIME], kind="stable")  # a step notes its end before a rest in it
    sides, transitions = sides[order], [buffer.transitions[i] for i in order]
    sound, events_sound = np.isfinite(rows).all(axis=1), np.isfinite(sides).all(axis=(1, 2))
    ends = [values[~fine, TIME] for values, fine in ((rows, sound), (sides[:, 1], events_sound))]
    end = np.min(np.nan_to_num(np.concatenate(ends), nan=-np.inf), initial=np.inf)
    non_finite_tail = not (sound.all() and events_sound.all())
    rows = rows[: np.argmin(sound)] if not sound.all() else rows
    kept = events_sound & (sides[:, 1, TIME] < end)
    sides, transitions = sides[kept], [e for e, keep in zip(transitions, kept, strict=True) if keep]
    before, after = sides[:, 0], sides[:, 1]
    if at_events:
        rows = _with_events(rows, before, after, transitions)
    return Samples(rows, transitions, before, after, non_finite_tail)


def _with_events(rows: Any, before: Any, after: Any, transitions: list[Transition]) -> Any:
    """Return samples with those at the events among them; one stands where two would.

    It shows the side that sticks where there is one, else that after the event.
    """
    if not transitions:
        return rows
    breaks_away = np.array([e.mode_from == STICK for e in transitions])
    # It may never have stuck, if it starts beyond its limit, or may have moved on since.
    holds = (before[:, MODE] == STICK) & (before[:, VELOCITY] == after[:, VELOCITY])
    at_events = np.where((breaks_away & holds)[:, None], before, after)
    # Of several at one time the last that sticks, else the last.
    at_events = at_events[np.lexsort((at_events[:, MODE] == STICK, at_events[:, TIME]))]
    time = at_events[:, TIME]
    at_events = at_events[np.append(time[1:] != time[:-1], True)]
    regular = rows[~np.isin(rows[:, TIME], time)]
    found = np.concatenate((regular, at_events))
    return found[np.argsort(found[:, TIME], kind="stable")]
