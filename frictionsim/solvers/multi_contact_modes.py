"""The modes of several contacts that are consistent with a state.

Where several combinations are solutions, quasi-static stick is kept: all combinations with one more
contact that holds are tried, also those in which the acceleration of a contact at its limit is
roundoff, before any with one fewer.

All combinations, up to 3^m of m contacts, are counted through for each number that holds, and those
with that number balanced: for the contacts of a lift there are at most 12 in all, for eight 6561.
Where the solution is unique (limits that do not depend on the unknown forces, independent
contacts), a search that starts where all hold and changes the first contact that violates its
inequality, again and again (Murty's rule of the least index), should find it in about m balances.
That was not tried. Such a search has to keep what the passes for released contacts do: of those
located at their limit one gives way, of those that gave way before at the same time all do.
"""

from typing import Any

from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.contacts import MARGIN
from frictionsim.solvers.multi_contact_state import (
    ACCELERATION,
    CHOICES,
    MODES,
    RELEASED_BEFORE,
    RELEASED_NOW,
    balance,
    coordinate_of,
    form_of,
    form_value,
    holds,
    roundoff_of,
)
from frictionsim.solvers.one_contact_state import NO_MODES, TIME, Run, Y, fail

RELEASED = 1.0  # direction in which a rope is released

# Whose accelerations do not count: of none, of those that gave way before at the same time, of
# these and of those whose force was located at its limit, for it may be roundoff of the wrong sign.
NONE, GONE, LOCATED = range(3)


@compilable
def direction_of(mode: float) -> float:
    """Return the direction in which a contact gives way in a mode; 0 if it holds."""
    if mode == SLACK:
        return RELEASED
    return 0.0 if mode == TAUT else mode


@compilable
def write_consistent_modes(system: Any, run: Run, s: Any) -> None:
    """Write the modes that are consistent with the state of the phase; most contacts hold in them.

    Zeros of velocities and gaps are exact.
    """
    m, u = system.contacts.size, system.drive.at(s[TIME])
    combinations = 1
    for i in range(m):
        s[CHOICES + i] = float(_choices(system, s, i))
        combinations *= int(s[CHOICES + i])
    for holding in range(m, -1, -1):
        for forgiven in (GONE, LOCATED):
            if _write_first_consistent(system, s, u, combinations, holding, forgiven):
                return
    for holding in range(m, -1, -1):
        if _write_first_consistent(system, s, u, combinations, holding, NONE):
            return
    fail(NO_MODES, s[TIME], 0.0, 0.0, 0.0)


@compilable
def _choices(system: Any, s: Any, i: int) -> int:
    """Return the number of modes of a contact that its slip or gap allows."""
    c, n = coordinate_of(system, i), system.coordinates
    gap, rate = s[Y + c], s[Y + n + c]
    if i >= system.contacts.frictions:
        return 1 if gap > 0.0 or rate > 0.0 else 2
    return 1 if rate != 0.0 else 3


@compilable
def _mode(system: Any, s: Any, i: int, choice: int) -> float:
    """Return a mode of a contact by its number, the one that holds first."""
    if i >= system.contacts.frictions:
        return float(SLACK) if choice + 1 == int(s[CHOICES + i]) else float(TAUT)
    if s[CHOICES + i] == 1.0:
        rate = s[Y + system.coordinates + coordinate_of(system, i)]
        return float(FORWARD) if rate > 0.0 else float(BACKWARD)
    if choice == 0:
        return float(STICK)
    return float(FORWARD) if choice == 1 else float(BACKWARD)


@compilable
def _write_first_consistent(
    system: Any, s: Any, u: float, combinations: int, holding: int, forgiven: int
) -> bool:
    """Write the first consistent modes in which so many contacts hold, if any."""
    for number in range(combinations):
        is_candidate = _write_modes(system, s, number) == holding
        if is_candidate and forgiven != NONE:
            is_candidate = _gives_way(system, s, forgiven)
        if is_candidate and _is_consistent(system, s, u, forgiven):
            return True
    return False


@compilable
def _write_modes(system: Any, s: Any, number: int) -> int:
    """Write a combination of modes; return how many contacts hold in it."""
    holding = 0
    for i in range(system.contacts.size - 1, -1, -1):
        choices = int(s[CHOICES + i])
        mode = _mode(system, s, i, number % choices)
        number //= choices
        s[MODES + i] = mode
        if holds(mode):
            holding += 1
    return holding


@compilable
def _gives_way(system: Any, s: Any, forgiven: int) -> bool:
    """Return whether one of the located contacts gives way, and all that are forgiven."""
    some_now = any_now = False
    for i in range(system.contacts.size):
        direction = direction_of(s[MODES + i])
        now, before = s[RELEASED_NOW + i], s[RELEASED_BEFORE + i]
        if now != 0.0:
            any_now = True
            some_now = some_now or direction == now
            if forgiven == LOCATED and direction != now:
                return False
        elif before != 0.0 and direction != before:
            return False
    return some_now or not any_now


@compilable
def _is_consistent(system: Any, s: Any, u: float, forgiven: int) -> bool:
    """Return whether forces are within their limits, and contacts that give way move that way.

    Those that are forgiven give way in their direction whatever their acceleration is.
    """
    n = system.coordinates
    balance(system, s, u, Y)
    for i in range(system.contacts.size):
        mode, c = s[MODES + i], coordinate_of(system, i)
        if holds(mode):
            roundoff = roundoff_of(system, s, i)
            if form_value(system, s, form_of(system, i, MARGIN)) < -roundoff:
                return False
            backward = form_of(system, i, MARGIN + 1)
            if mode == STICK and form_value(system, s, backward) < -roundoff:
                return False
        elif s[Y + n + c] == 0.0 and not (mode == SLACK and s[Y + c] > 0.0):
            is_forgiven = forgiven != NONE and s[RELEASED_BEFORE + i] != 0.0
            if forgiven == LOCATED:
                is_forgiven = is_forgiven or s[RELEASED_NOW + i] != 0.0
            if not is_forgiven and not direction_of(mode) * s[ACCELERATION + c] > 0.0:
                return False
    return True
