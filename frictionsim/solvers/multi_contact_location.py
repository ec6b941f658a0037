"""The first event within a smooth part of a run: which margin of which contact reaches zero first.

A margin must stay positive, or not negative, for a contact to keep its mode: of a contact that
holds that of its force, one in either direction of friction; else its gap, or its velocity in the
direction of its slip, whose zero ends the mode.

A margin may reach zero and recover within one step, as where a motion nearly stops. The margins
are therefore evaluated between the ends of a step, on the cubic polynomial through its ends, and
where one is small on the solution itself.
"""

from math import inf, ulp
from typing import Any, NamedTuple

from frictionsim.solvers.common import SAME_TIME_ULPS
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.multi_contact_state import (
    COMPONENT,
    CONTACT,
    DIRECTION,
    ENDS,
    EVENT_HELD,
    EVENT_TIME,
    FORM,
    MARGINS,
    PLACE_TIMES,
    RESTING,
    SAMPLED_MARGINS,
    SIGN,
    balance,
    form_value,
    roundoff_of,
)
from frictionsim.solvers.multi_contact_step import write_cubic, write_inside
from frictionsim.solvers.one_contact_location import bracket
from frictionsim.solvers.one_contact_state import (
    HELD,
    INSIDE,
    SAMPLED_UNTIL,
    T_NEW,
    T_OLD,
    TIME,
    Run,
    Y,
    copy,
)

# Where the margins are evaluated, in parts of a step; near its ends for the sign of their slopes.
PLACES = (0.0, 1e-3, 1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1.0 - 1e-3, 1.0)
# A minimum of a margin is searched for below this part of its rise on both sides, or where a
# parabola has a minimum below this part of the margin in the middle.
LOW_MARGIN = 0.5
# Resolution of the end of a motion and of a minimum, relative to the step.
RESOLUTION = 1e-12
MINIMUM_RESOLUTION = 1e-9
GOLDEN = 0.381966011250105

# What of a margin is evaluated: it, or that of a force plus its roundoff.
BARE, BEYOND_ROUNDOFF = range(2)


@compilable
def is_of_force(s: Any, k: int) -> bool:
    """Return whether a margin is of a force, which may be zero."""
    return s[FORM + k] >= 0.0


@compilable
def margin(system: Any, s: Any, k: int, which: int) -> float:
    """Return the margin number k of the state in INSIDE, after its balance."""
    form = int(s[FORM + k])
    if form < 0:
        return s[SIGN + k] * s[INSIDE + int(s[COMPONENT + k])]
    value = form_value(system, s, form)
    return value if which == BARE else value + roundoff_of(system, s, int(s[CONTACT + k]))


@compilable
def write_at(system: Any, run: Run, s: Any, t: float) -> None:
    """Write the state at a time within the part into INSIDE, and its balance."""
    if s[RESTING] != 0.0:
        copy(s, INSIDE, Y, run.states)
    else:
        write_inside(system, run, s, t)
    balance(system, s, system.drive.at(t), INSIDE)


@compilable
def value(system: Any, run: Run, s: Any, k: int, which: int, t: float) -> float:
    """Return the margin number k at a time, s."""
    write_at(system, run, s, t)
    return margin(system, s, k, which)


@compilable
class UsedUp(NamedTuple):
    """A function of time whose root is where the margin number k is used up.

    A force may be zero, so that it is the negative of its margin that becomes positive.
    """

    k: int
    which: int

    def value_at(self, system: Any, run: Run, s: Any, t: float) -> float:
        """Return the value at a time, s."""
        sign = -1.0 if is_of_force(s, self.k) else 1.0
        return sign * value(system, run, s, self.k, self.which, t)


@compilable
def find_first_events(system: Any, run: Run, s: Any) -> None:
    """Write which contacts are released first within the part, and when.

    Several are only if at the same time. The part is the last step, or the rest from TIME on.
    """
    margins, first = int(s[MARGINS]), inf
    places = _sample_margins(system, run, s)
    for k in range(margins):
        s[EVENT_TIME + k] = inf
        before, after = _search(system, run, s, k, places)
        if after != inf:
            _locate(system, run, s, k, before, after)
        first = min(first, s[EVENT_TIME + k])
    for k in range(margins):
        if s[EVENT_TIME + k] - first <= SAME_TIME_ULPS * ulp(run.end):
            s[SAMPLED_UNTIL], s[HELD] = s[EVENT_TIME + k], s[EVENT_HELD + k]
            s[ENDS + int(s[CONTACT + k])] = s[DIRECTION + k]


@compilable
def _sample_margins(system: Any, run: Run, s: Any) -> int:
    """Write the margins at the places of the part, approximately between its ends; return places.

    At rest, where they are monotone, only the ends are places.
    """
    resting, margins = s[RESTING] != 0.0, int(s[MARGINS])
    start, end = (s[TIME], s[SAMPLED_UNTIL]) if resting else (s[T_OLD], s[T_NEW])
    last, at = 1 if resting else len(PLACES) - 1, SAMPLED_MARGINS
    for place in range(last + 1):
        t = end if place == last else start + PLACES[place] * (end - start)
        s[PLACE_TIMES + place] = t
        if place == 0 or place == last:
            write_at(system, run, s, t)
        else:
            write_cubic(system, s, (t - start) / (end - start))
            balance(system, s, system.drive.at(t), INSIDE)
        for k in range(margins):
            s[at + k] = margin(system, s, k, BARE)
        at += margins
    return last + 1


@compilable
def _search(system: Any, run: Run, s: Any, k: int, places: int) -> tuple[float, float]:
    """Return two times between which a margin is used up first, s; infinite if it lasts."""
    margins, at = int(s[MARGINS]), SAMPLED_MARGINS + k
    for place in range(1, places):
        at += margins
        t, before = s[PLACE_TIMES + place], s[PLACE_TIMES + place - 1]
        if s[at] <= 0.0 and _is_used_up(s, k, value(system, run, s, k, BEYOND_ROUNDOFF, t)):
            return before, t
        if place < places - 1 and s[at - margins] >= s[at] <= s[at + margins]:
            after = s[PLACE_TIMES + place + 1]
            if _may_dip(t - before, after - t, s[at - margins], s[at], s[at + margins]):
                lowest = _lowest(system, run, s, k, before, after)
                if lowest != inf:
                    return before, lowest
    return inf, inf


@compilable
def _is_used_up(s: Any, k: int, value: float) -> bool:
    return value < 0.0 if is_of_force(s, k) else value <= 0.0


@compilable
def _may_dip(left: float, right: float, before: float, middle: float, after: float) -> bool:
    """Return whether a margin, positive at three times, may reach zero about the middle one.

    The times, `left` and `right` apart, are unevenly spaced: a minimum may be far below the middle
    value, which is not above the others, where one of the spaces is much longer than the other.
    """
    rise = max(before, after) - middle
    if not rise > 0.0:
        return False
    fall, climb = (middle - before) / left, (after - middle) / right
    curvature = (climb - fall) / (left + right)
    slope = fall + curvature * left  # of the parabola at the middle time
    return (
        middle < LOW_MARGIN * rise or slope * slope > 4.0 * (1.0 - LOW_MARGIN) * curvature * middle
    )


@compilable
def _lowest(system: Any, run: Run, s: Any, k: int, a: float, b: float) -> float:
    """Return a time about the minimum of a margin at which it is used up; inf if it never is."""
    width = MINIMUM_RESOLUTION * (b - a)
    x, y = a + GOLDEN * (b - a), b - GOLDEN * (b - a)
    at_x = value(system, run, s, k, BEYOND_ROUNDOFF, x)
    at_y = value(system, run, s, k, BEYOND_ROUNDOFF, y)
    while b - a > width:
        if _is_used_up(s, k, at_x):
            return x
        if _is_used_up(s, k, at_y):
            return y
        if at_x < at_y:
            b, y, at_y = y, x, at_x
            x = a + GOLDEN * (b - a)
            at_x = value(system, run, s, k, BEYOND_ROUNDOFF, x)
        else:
            a, x, at_x = x, y, at_y
            y = b - GOLDEN * (b - a)
            at_y = value(system, run, s, k, BEYOND_ROUNDOFF, y)
    return inf


@compilable
def _locate(system: Any, run: Run, s: Any, k: int, a: float, b: float) -> None:
    """Write the event between a, where a margin is positive, and b, where it is not."""
    if is_of_force(s, k):
        # If the force equals its limit at a, ignore an excess that is roundoff.
        at_a, which = value(system, run, s, k, BARE, a), BARE
        tie = roundoff_of(system, s, int(s[CONTACT + k]))
        if not at_a >= 0.0:
            at_a, which = at_a + tie, BEYOND_ROUNDOFF
        held, time = bracket(UsedUp(k, which), system, run, s, a, b, 0.0)
        if time - a <= SAME_TIME_ULPS * ulp(run.end) and at_a <= tie:
            held = time = a
        s[EVENT_HELD + k], s[EVENT_TIME + k] = held, time
        return
    start = s[PLACE_TIMES]
    resolution = RESOLUTION * (b - start)
    if not value(system, run, s, k, BARE, a) > 0.0:
        # The zero at the start of a motion does not count, nor the error of what is approximate.
        width = b - start
        while width > resolution and not value(system, run, s, k, BARE, start + width) > 0.0:
            width *= 0.1
        a = start + width if width > resolution else start
        if a >= b or (width <= resolution and not value(system, run, s, k, BARE, a) > 0.0):
            s[EVENT_HELD + k] = s[EVENT_TIME + k] = a
            return
    time = bracket(UsedUp(k, BARE), system, run, s, a, b, resolution)[1]
    s[EVENT_HELD + k] = s[EVENT_TIME + k] = time
