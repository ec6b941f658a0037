"""Parts shared by the solvers: samples and their times, and chattering."""

from array import array
from collections import deque
from collections.abc import Sequence
from math import floor

from frictionsim.errors import Chattering
from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.solvers.one_contact_state import sample_time

# A root search stops at an interval of two units in the last place of the time.
SAME_TIME_ULPS = 2.0
NO_MULTIPLE = -2  # the number of the last sample at a multiple of the interval


def direction_of(v: float) -> int:
    """Return the direction of a velocity; STICK for one that is zero."""
    return FORWARD if v > 0.0 else BACKWARD if v < 0.0 else STICK


class SampleTimes:
    """The sample times: 0, interval, 2 interval, ..., duration, unless others are given."""

    CHECKPOINT_FIELDS = ("_next", "next")  # after the last sample the next one is never: inf

    def __init__(self, duration: float, interval: float) -> None:
        self.interval, self.end, self.given = interval, duration, array("d")
        # A multiple that differs from the duration by rounding is replaced by the duration.
        self.last = floor(duration / interval * (1.0 - 1e-12))
        self.set_next(0)

    def give(self, times: Sequence[float]) -> None:
        """Have samples at these times only, s, as those of measured data.

        They increase strictly and are within the run, which is not resumed.
        """
        self.given, self.last = array("d", times), NO_MULTIPLE
        self.set_next(0)

    @property
    def count(self) -> int:
        """The number of samples so far."""
        return self._next

    def advance(self) -> None:
        """Advance to the next sample time; `next` is inf after the last."""
        self.set_next(self._next + 1)

    def set_next(self, number: int) -> None:
        """Set the number of samples that were taken."""
        self._next, self.next = number, sample_time(self, number)


SampleRow = tuple[float, ...]
"""A sample: time, drive, position, velocity, acceleration, friction, mode, energy integrals."""


class SampleBuffer:
    """The samples and events of a run, filled by the solver.

    Attributes
    ----------
    rows : array of double
        The regular samples, concatenated.
    transitions : list of Transition
    sides : array of double
        Two samples for each transition: immediately before and after it.
    """

    CHECKPOINT_FIELDS = ("rows", "sides")

    def __init__(self, times: SampleTimes) -> None:
        self.times = times
        self.rows = array("d")
        self.sides = array("d")
        self.transitions: list[Transition] = []

    def add(self, sample: SampleRow) -> None:
        """Add a regular sample and advance to the next sample time."""
        self.rows.extend(sample)
        self.times.advance()

    def record_event(self, transition: Transition, before: SampleRow, after: SampleRow) -> None:
        """Add an event with the samples immediately before and after it."""
        self.transitions.append(transition)
        self.sides.extend(before)
        self.sides.extend(after)


class ChatteringDetector:
    """Stops a run in which an event recurs too often within a time window.

    Parameters
    ----------
    window : float, s
    max_events : int
        Allowed number of events in the window.
    what : str
        The event, for the message: "the contact 'shaft' changed its mode".
    advice : str
        End of the message.
    """

    CHECKPOINT_FIELDS = ("_times",)

    def __init__(self, window: float, max_events: int, what: str, advice: str) -> None:
        self._window = window
        self._what = what
        self._advice = advice
        self._times: deque[float] = deque(maxlen=max_events)

    def count(self, t: float) -> None:
        """Count an event at t, s; raise Chattering if there are too many in the window."""
        times = self._times
        if len(times) == times.maxlen and t - times[0] < self._window:
            raise chattering_error(t, self._what, len(times), t - times[0], self._advice)
        times.append(t)


def chattering_error(t: float, what: str, events: int, within: float, advice: str) -> Chattering:
    """Return the error for an event that recurs too often up to t, s; `within` is a time, s."""
    return Chattering(
        f"chattering at t = {t:.9g} s: {what} {events} times within {within:.2g} s; {advice}"
    )
