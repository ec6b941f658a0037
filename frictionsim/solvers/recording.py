"""The samples and events of a run as rows of numbers."""

from array import array
from collections.abc import Callable, Sequence
from math import floor, inf
from typing import Any

from frictionsim.results import STICK, Transition


class SampleTimes:
    """The sample times: 0, interval, 2 interval, ..., duration, unless others are given."""

    def __init__(self, duration: float, interval: float) -> None:
        self._interval, self._end, self._given = interval, duration, array("d")
        # A multiple that differs from the duration by rounding is replaced by the duration.
        self._last = floor(duration / interval * (1.0 - 1e-12))

    def give(self, times: Sequence[float]) -> None:
        """Have samples at these times only, s, as those of measured data.

        They increase strictly and are within the run, which is not resumed.
        """
        self._given = array("d", times)

    def at(self, number: int) -> float:
        """Return the time of a sample, counted from 0, s; inf after the last."""
        if self._given:
            return self._given[number] if number < len(self._given) else inf
        if number <= self._last:
            return number * self._interval
        return self._end if number == self._last + 1 else inf


class Recording:
    """Samples and events.

    A row is the time, s, the state, what `system.recorded` adds, and the modes, all as floats in SI
    units; `Mechanism.columns` has the names of all but the time.

    With `at_events` events are samples, too: the side before a breakaway, else the side after the
    event. They replace regular ones at their times, and of several at one time the last counts.

    Attributes
    ----------
    times : SampleTimes
    rows : array
        Of the samples, one after the other. A law may locate an event before the last of them.
    transitions : list of Transition
    sides : array
        Two rows for each transition: immediately before and after it.
    """

    def __init__(
        self, system: Any, duration: float, interval: float, at_events: bool = True
    ) -> None:
        self._system, self.times = system, SampleTimes(duration, interval)
        self._at_events, self._velocity = at_events, 1 + system.coordinates  # its place in a row
        self.rows, self.sides = array("d"), array("d")
        self.transitions: list[Transition] = []

    def row(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        """Return the row of a state."""
        return [t, *y, *self._system.recorded(t, y, modes), *modes]

    def until(self, end: float, number: int, row: Callable[[float], list[float]]) -> int:
        """Add the samples before a time, s, from a number on; return the number of the next.

        `row` returns the row of a time.
        """
        t = self.times.at(number)
        while t < end:
            self._add(row(t), is_event=False)
            number += 1
            t = self.times.at(number)
        return number

    def _add(self, row: list[float], is_event: bool) -> None:
        rows, width = self.rows, len(row)
        if rows and rows[-width] == row[0]:
            if is_event:
                rows[-width:] = array("d", row)
            return
        try:
            rows.extend(row)
        except BufferError:  # somebody still looks at what a checkpoint saw of them
            self.rows = rows[:]
            self.rows.extend(row)

    def event(
        self,
        t: float,
        name: str,
        modes: tuple[int, int],
        position: float,
        sides: list[list[float]],
    ) -> None:
        """Add an event, with the rows before and after it."""
        self.transitions.append(Transition(t, name, *modes, position))
        before, after = sides
        self.sides.extend(before)
        self.sides.extend(after)
        if self._at_events:
            v = self._velocity
            breaks_away = modes[0] == STICK and before[v] == after[v]
            self._add(before if breaks_away else after, is_event=True)
