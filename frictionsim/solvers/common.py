"""Parts shared by the solvers: samples, right-hand sides, located events, chattering."""

from array import array
from collections import deque
from collections.abc import Sequence
from math import floor, inf
from typing import ClassVar

from frictionsim.errors import Chattering
from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.solvers.state_values import COUNT, SAMPLE, TIME, Values

# A root search stops at an interval of two units in the last place of the time.
SAME_TIME_ULPS = 2.0


def direction_of(v: float) -> int:
    """Return the direction of a velocity; STICK for one that is zero."""
    return FORWARD if v > 0.0 else BACKWARD if v < 0.0 else STICK


class SampleTimes:
    """The regular sample times: 0, interval, 2 interval, ..., duration."""

    # After the last sample the next one is never: inf.
    CHECKPOINT_FIELDS: ClassVar = {"_next": COUNT, "next": Values(low=0.0, finite=False)}

    def __init__(self, duration: float, interval: float) -> None:
        self.interval = interval
        self._duration = duration
        # A multiple that differs from the duration by rounding is replaced by the duration.
        self.last = floor(duration / interval * (1.0 - 1e-12))
        self.given: Sequence[float] = ()
        self._next = 0
        self.next = 0.0

    @property
    def count(self) -> int:
        """The number of samples so far."""
        return self._next

    def advance(self) -> None:
        """Advance to the next sample time; `next` is inf after the last."""
        self.set_next(self._next + 1)

    def set_next(self, number: int) -> None:
        """Set the number of samples that were taken."""
        self._next = number
        self.next = self._time_of(number)

    def _time_of(self, number: int) -> float:
        """Return the time of a sample, counted from 0; inf after the last."""
        if number <= self.last:
            return number * self.interval
        return self._duration if number == self.last + 1 else inf

    def restored_fault(self) -> str:
        """Return the field that does not go with the others, empty if all do."""
        if self._next > self.last + 2:
            return "_next"
        return "" if self.next == self._time_of(self._next) else "next"


class GivenTimes(SampleTimes):
    """Sample times from a list, as those of measured data; a run with them is not resumed.

    Parameters
    ----------
    times : sequence of float, s
        Strictly increasing; the last is not after the end of the run.
    """

    def __init__(self, times: Sequence[float]) -> None:
        self.interval, self.last, self.given = inf, 0, list(times)
        self.set_next(0)

    def _time_of(self, number: int) -> float:
        return self.given[number] if number < len(self.given) else inf


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

    COLUMNS = 7  # of a sample, without its energies
    CHECKPOINT_FIELDS: ClassVar = {"rows": SAMPLE, "sides": SAMPLE}

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

    CHECKPOINT_FIELDS: ClassVar = {"_times": TIME._replace(ascending=True)}

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
