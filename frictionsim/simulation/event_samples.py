"""The samples of a run of one coordinate: regular ones, and both sides of each event."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import STICK, Transition

if TYPE_CHECKING:
    from frictionsim.solvers.common import SampleBuffer

TIME, VELOCITY, MODE = 0, 3, 6  # columns of a row of `SampleBuffer`


class Samples(NamedTuple):
    """The finite samples of a run.

    Attributes
    ----------
    rows : (n, width)
        The samples, at strictly increasing times.
    transitions : list of Transition
        In the order of time.
    before, after : (m, width)
        Samples immediately before and after each transition.
    non_finite_tail : bool
        A sample was not finite; it and all later ones were removed.
    """

    rows: Any
    transitions: list[Transition]
    before: Any
    after: Any
    non_finite_tail: bool


def samples_of(
    buffer: "SampleBuffer", width: int, at_events: bool, several: bool = False
) -> Samples:
    """Return the finite samples of a run.

    Parameters
    ----------
    buffer : SampleBuffer
    width : int
        Number of columns of a sample.
    at_events : bool
        Add a sample at each event to the regular ones.
    several : bool
        The columns are those of several coordinates and contacts.
    """
    rows = np.array(buffer.rows).reshape(-1, width)
    sides = np.array(buffer.sides).reshape(-1, 2, width)
    # A step records the event at its end before a stop within it.
    order = np.argsort(sides[:, 1, TIME], kind="stable")
    sides, transitions = sides[order], [buffer.transitions[i] for i in order]
    finite, events_finite = np.isfinite(rows).all(axis=1), np.isfinite(sides).all(axis=(1, 2))
    ends = [values[~fine, TIME] for values, fine in ((rows, finite), (sides[:, 1], events_finite))]
    end = np.min(np.nan_to_num(np.concatenate(ends), nan=-np.inf), initial=np.inf)
    non_finite_tail = not (finite.all() and events_finite.all())
    rows = rows[: np.argmin(finite)] if not finite.all() else rows
    kept = events_finite & (sides[:, 1, TIME] < end)
    sides, transitions = sides[kept], [e for e, keep in zip(transitions, kept, strict=True) if keep]
    before, after = sides[:, 0], sides[:, 1]
    if at_events and transitions:
        chosen = _sides_of_several if several else _sides_that_stick
        rows = _merged(rows, chosen(before, after, transitions))
    return Samples(rows, transitions, before, after, non_finite_tail)


def _sides_that_stick(before: Any, after: Any, transitions: list[Transition]) -> Any:
    """Return one sample for each event: its sticking side, else the side after it.

    Of several events at one time the last that sticks, else the last.
    """
    breaks_away = np.array([e.mode_from == STICK for e in transitions])
    # No sticking side: the run starts beyond the limit, or the contact has moved within the step.
    holds = (before[:, MODE] == STICK) & (before[:, VELOCITY] == after[:, VELOCITY])
    at_events = np.where((breaks_away & holds)[:, None], before, after)
    return at_events[np.lexsort((at_events[:, MODE] == STICK, at_events[:, TIME]))]


def _sides_of_several(before: Any, after: Any, transitions: list[Transition]) -> Any:
    """Return one sample for each event: the side before a breakaway, else the side after it.

    Of several events at one time the last.
    """
    breaks_away = np.array([e.mode_from == STICK for e in transitions])
    return np.where(breaks_away[:, None], before, after)


def _merged(rows: Any, at_events: Any) -> Any:
    """Return the regular samples and those of events, which replace regular ones at their times."""
    time = at_events[:, TIME]
    at_events = at_events[np.append(time[1:] != time[:-1], True)]
    regular = rows[~np.isin(rows[:, TIME], time)]
    merged = np.concatenate((regular, at_events))
    return merged[np.argsort(merged[:, TIME], kind="stable")]
