"""The modes of contacts that are consistent with a state of rest, slip and slack.

Where several combinations are solutions, the one in which most contacts hold is taken, so that
quasi-static stick is kept; of several of these, the one in which those are released that are
beyond their limits when all hold. All combinations are tried, at most 3^n of n contacts.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any

from frictionsim.errors import SolverError
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT

Modes = list[int]
# No change of mode; modes are found anew, at the start of a run and after an end stop.
KEEPS, REFINDS = 9, 8


def holds(mode: int) -> bool:
    """Return whether a contact holds in a mode: its coordinate stands still."""
    return mode in (STICK, TAUT)


def direction_of(mode: int) -> int:
    """Return the direction in which a contact is released in a mode; 0 if it holds."""
    return FORWARD if mode == SLACK else STICK if mode == TAUT else mode


def options(system: Any, y: list[float], i: int) -> Modes:
    """Return the modes that slip or gap allow a contact, those that hold first."""
    n, c = system.coordinates, system.contacts[i].coordinate
    gap, rate = y[c], y[n + c]
    if system.contacts[i].is_rope:
        return [SLACK] if gap > 0.0 or rate > 0.0 else [TAUT, SLACK]
    if rate == 0.0:
        return [STICK, FORWARD, BACKWARD]
    return [FORWARD if rate > 0.0 else BACKWARD]


def consistent(system: Any, t: float, y: list[float], before: Modes, now: Modes) -> Modes:
    """Return the modes that follow at a time, s, in a state with exact zeros.

    `before` are the modes so far; `now` are those that were found to begin, else `KEEPS` or
    `REFINDS`.

    Raises
    ------
    SolverError
        If there are none.
    """
    n = system.coordinates
    located = {i: mode for i, mode in enumerate(now) if mode < REFINDS and not holds(mode)}
    # Released at this very time, they have not moved yet.
    gone = {
        i: mode
        for i, mode in enumerate(before)
        if now[i] == KEEPS and not holds(mode) and y[n + system.contacts[i].coordinate] == 0.0
    }
    each = [options(system, y, i) for i in range(len(before))]
    keep = [] if len(each) == 1 else _within_limits(system, t, y, [modes[0] for modes in each])
    some = sorted(
        product(*each),
        key=lambda modes: (-sum(map(holds, modes)), sum(not holds(modes[i]) for i in keep)),
    )
    # An acceleration at the limit may be roundoff of the wrong sign: what was found there, or was
    # released before, is released whatever it is. Of several that were found, one may relieve the
    # others.
    for modes, sure in _by_holding(some, (gone, gone | located)):
        released = not located or any(modes[i] == mode for i, mode in located.items())
        released = released and all(modes[i] == mode for i, mode in sure.items())
        if released and _is_consistent(system, t, y, list(modes), sure):
            return list(modes)
    for modes in some:
        if _is_consistent(system, t, y, list(modes), {}):
            return list(modes)
    raise SolverError(
        f"at t = {t:.9g} s no combination of sticking, sliding and slack satisfies the equations of"
        f" {subject(system)}: the friction is too large for them; check the coefficients of"
        " friction and the radius of the shaft"
    )


def _within_limits(system: Any, t: float, y: list[float], modes: Modes) -> list[int]:
    """Return which contacts hold in these modes, by forces within their limits."""
    margins = enumerate(zip(modes, system.margins(t, y, modes), strict=True))
    return [i for i, (mode, margin) in margins if holds(mode) and not _beyond(mode, *margin)]


def _beyond(mode: int, forward: float, backward: float, roundoff: float) -> bool:
    return forward < -roundoff or (mode == STICK and backward < -roundoff)


def _by_holding(some: list[Any], sure: tuple[dict[int, int], ...]) -> Iterator[Any]:
    """Yield combinations with what is sure, for each number that holds one after the other."""
    for holding in range(len(some[0]), -1, -1):
        for certain in sure:
            yield from ((m, certain) for m in some if sum(map(holds, m)) == holding)


def _is_consistent(
    system: Any, t: float, y: list[float], modes: Modes, sure: dict[int, int]
) -> bool:
    """Return whether forces are within their limits, and what is released moves that way."""
    n = system.coordinates
    margins, k = system.margins(t, y, modes), system.rates(t, y, modes)
    for i, mode in enumerate(modes):
        c = system.contacts[i].coordinate
        if holds(mode):
            if _beyond(mode, *margins[i]):
                return False
        elif y[n + c] != 0.0 or (mode == SLACK and y[c] > 0.0) or i in sure:
            continue
        elif not direction_of(mode) * k[n + c] > 0.0:
            return False
    return True


def subject(system: Any) -> str:
    """Return the subject of messages: "the motion on the contact 'shaft'"."""
    names = " and ".join(f"'{contact.name}'" for contact in system.contacts)
    if not names:
        return "the motion"
    return f"the motion on the contact{'s' if len(system.contacts) > 1 else ''} {names}"
