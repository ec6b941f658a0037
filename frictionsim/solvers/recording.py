"""The samples and events of a run as rows of numbers."""

from array import array
from collections.abc import Callable, Sequence
from math import floor, inf
from typing import Any

from frictionsim.results import Transition


class SampleTimes:
    """The sample times: 0, interval, 2 interval, ..., duration, unless others are given.

    Attributes
    ----------
    count : int
        The number of samples so far.
    """

    CHECKPOINT_FIELDS = ("count",)

    def __init__(self, duration: float, interval: float) -> None:
        self._interval, self._end, self._given, self.count = interval, duration, array("d"), 0
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

    @property
    def next(self) -> float:
        """The time of the next sample, s; inf after the last."""
        return self.at(self.count)

    def advance(self) -> None:
        """Count a sample."""
        self.count += 1


class Recording:
    """Samples and events.

    A row is the time, s, the state, what `system.recorded` adds, and the modes, all as floats in SI
    units; `Mechanism.columns` has the names of all but the time.

    Parameters
    ----------
    system : System
    duration, interval : float, s

    Attributes
    ----------
    times : SampleTimes
    rows : array
        Of the samples, one after the other.
    transitions : list of Transition
    sides : array
        Two rows for each transition: immediately before and after it.
    """

    def __init__(self, system: Any, duration: float, interval: float) -> None:
        self._system, self.times = system, SampleTimes(duration, interval)
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
            new = row(t)
            try:
                self.rows.extend(new)
            except BufferError:  # somebody still looks at what a checkpoint saw of them
                self.rows = self.rows[:]
                self.rows.extend(new)
            number += 1
            t = self.times.at(number)
        return number

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
        for side in sides:
            self.sides.extend(side)
