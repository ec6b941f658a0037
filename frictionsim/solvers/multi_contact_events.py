"""The first event within a smooth part of a run: which margin of which contact reaches zero first.

A margin may reach zero and recover within one step, as where a motion nearly stops. The margins
are therefore evaluated between the ends of a step, on the cubic polynomial through its ends, and
where one is small on the solution itself.
"""

from collections.abc import Callable, Sequence
from math import inf, ulp
from typing import NamedTuple

from frictionsim.solvers.common import SAME_TIME_ULPS, crossing_bracket
from frictionsim.solvers.multi_contact import Balance
from frictionsim.solvers.multi_contact_modes import Margin
from frictionsim.solvers.root_finding import bracket_root

# Where the margins are evaluated, in parts of a step; near its ends for the sign of their slopes.
PLACES = (0.0, 1e-3, 1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1.0 - 1e-3, 1.0)
# A minimum of a margin is searched for below this part of its rise on both sides, or where a
# parabola has a minimum below this part of the margin in the middle.
NEAR = 0.5
# Resolution of the end of a motion and of a minimum, relative to the step.
RESOLUTION = 1e-12
MINIMUM_RESOLUTION = 1e-9
GOLDEN = 0.381966011250105

State = tuple[float, Balance, Sequence[float], Sequence[float]]
"""Drive, balance, positions and velocities."""
At = Callable[[float], State]
"""at(t): the state at a time within the part."""


class Event(NamedTuple):
    """The end of the mode of a contact.

    Attributes
    ----------
    held : float, s
        Last time at which the contact kept its mode.
    time : float, s
    margin : Margin
        The margin that reaches zero.
    """

    held: float
    time: float
    margin: Margin


def first_events(
    margins: Sequence[Margin], at: At, places: Sequence[tuple[float, bool]], rough: At, end: float
) -> list[Event]:
    """Return the first events within a smooth part of a run, several only if at the same time.

    Parameters
    ----------
    margins : sequence of Margin
    at : callable
        The solution.
    places : sequence of (float, bool)
        Times from the start of the part to its end, s, and whether `rough` is to be taken there.
    rough : callable
        As `at`, an approximation.
    end : float, s
        Duration of the run, which sets the roundoff of the time.
    """
    seen = [(t, (rough if is_rough else at)(t)) for t, is_rough in places]
    found = [
        event for margin in margins if (event := _Search(margin, at, end).first(seen)) is not None
    ]
    first = min((event.time for event in found), default=inf)
    return [event for event in found if event.time - first <= SAME_TIME_ULPS * ulp(end)]


class _Search:
    """The search for the first time at which a margin reaches zero."""

    def __init__(self, margin: Margin, at: At, end: float) -> None:
        self._margin, self._at, self._end = margin, at, end

    def first(self, seen: Sequence[tuple[float, State]]) -> Event | None:
        """Return the event; None if the margin lasts.

        Parameters
        ----------
        seen : sequence of (time, state)
            From the start of the part to its end; approximate between them.
        """
        values = [self._beyond_roundoff(*arguments) for _, arguments in seen]
        times = [t for t, _ in seen]
        last = len(times) - 1
        for i in range(1, last + 1):
            if self._is_used_up(values[i]) and self._is_used_up(self._exact(times[i])):
                return self._between(times[0], times[i - 1], times[i])
            if i < last and _may_dip(times[i - 1 : i + 2], values[i - 1 : i + 2]):
                lowest = self._lowest(times[i - 1], times[i + 1])
                if lowest is not None:
                    return self._between(times[0], times[i - 1], lowest)
        return None

    def _beyond_roundoff(
        self, u: float, balance: Balance, q: Sequence[float], v: Sequence[float]
    ) -> float:
        """Return the margin, that of a force plus its roundoff."""
        value = self._margin.value(balance, q, v)
        return value + self._margin.roundoff(u, balance) if self._margin.of_force else value

    def _exact(self, t: float) -> float:
        return self._beyond_roundoff(*self._at(t))

    def _value(self, t: float) -> float:
        _, balance, q, v = self._at(t)
        return self._margin.value(balance, q, v)

    def _is_used_up(self, value: float) -> bool:
        return value < 0.0 if self._margin.of_force else value <= 0.0

    def _lowest(self, a: float, b: float) -> float | None:
        """Return a time about the minimum of the margin at which it reaches zero; None if never."""
        width = MINIMUM_RESOLUTION * (b - a)
        x, y = a + GOLDEN * (b - a), b - GOLDEN * (b - a)
        at_x, at_y = self._exact(x), self._exact(y)
        while b - a > width:
            if self._is_used_up(at_x):
                return x
            if self._is_used_up(at_y):
                return y
            if at_x < at_y:
                b, y, at_y = y, x, at_x
                x = a + GOLDEN * (b - a)
                at_x = self._exact(x)
            else:
                a, x, at_x = x, y, at_y
                y = b - GOLDEN * (b - a)
                at_y = self._exact(y)
        return None

    def _between(self, start: float, a: float, b: float) -> Event:
        """Return the event between a, where the margin is positive, and b, where it is not."""
        if self._margin.of_force:
            return self._of_force(a, b)
        if not self._value(a) > 0.0:  # only at the start, or by the error of what is approximate
            a = self._after(start, b)
            if a >= b or not self._value(a) > 0.0:
                return Event(a, a, self._margin)
        time = bracket_root(self._value, a, b, RESOLUTION * (b - start))[1]
        return Event(time, time, self._margin)

    def _of_force(self, a: float, b: float) -> Event:
        # If the force equals its limit at a, ignore an excess that is roundoff.
        value = self._value if self._value(a) >= 0.0 else self._exact
        u, balance, _, _ = self._at(a)
        tie = self._margin.roundoff(u, balance)
        held, time = crossing_bracket(lambda t: -value(t), a, b, tie, self._end)
        return Event(held, time, self._margin)

    def _after(self, start: float, b: float) -> float:
        """Return a time after the start at which the motion has begun; the start if it does not.

        The zero at the start of a motion does not count.
        """
        width, resolution = b - start, RESOLUTION * (b - start)
        while not self._value(start + width) > 0.0:
            width *= 0.1
            if width <= resolution:
                return start
        return start + width


def _may_dip(times: Sequence[float], values: Sequence[float]) -> bool:
    """Return whether a margin, positive at three times, may reach zero about the middle one.

    The times are unevenly spaced: a minimum may be far below the middle value where one of the
    spaces is much longer than the other.
    """
    before, middle, after = values
    rise = max(before, after) - middle
    if not (before >= middle <= after and rise > 0.0):
        return False
    left, right = times[1] - times[0], times[2] - times[1]
    fall, climb = (middle - before) / left, (after - middle) / right
    curvature = (climb - fall) / (left + right)
    slope = fall + curvature * left  # of the parabola at the middle time
    return middle < NEAR * rise or slope * slope > 4.0 * (1.0 - NEAR) * curvature * middle
