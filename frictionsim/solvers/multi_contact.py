"""Event-driven integration of several coordinates and contacts: one loop, as Python or compiled.

Between two events all contacts keep their modes and the equations are smooth. A mode ends where a
force reaches its limit, a sliding contact comes to rest, or a gap closes, which is an impact. The
combination of modes that follows is the one that is consistent; if several are, the one in which
most contacts hold.

While all contacts hold and there is no other motion, a step is a segment on which the drive is
monotone, and Y is the state. Otherwise the integrator takes a step and holds the state.

`frictionsim.solvers.one_contact` is the loop for one contact on one coordinate, which is faster;
this one has its form, its steps and its state. A `system` is a named tuple of numbers:

drive
    The input u over time, a `Curve`.
coordinates : int
    Their number.
contacts : PackedContacts
    `frictionsim.solvers.contacts.table_of` its contacts.
balance(u, s, y)
    Writes accelerations and forces into s[ACCELERATION] and s[FORCES] that solve the equations of
    motion in the modes of s[MODES]: positions are at s[y], velocities behind them. Accelerations of
    coordinates that contacts hold are exactly zero. It depends on u and velocities linearly, so
    that a monotone drive lets a contact at rest go at most once.
impact(contact, restitution, s, y)
    Changes the velocities at s[y] by the impact in which a gap, the contact with that index,
    closes. It may stop or reverse sliding, and open other gaps. Adds what is lost to s[HEATS], of
    each contact, J.
powers(u, s, y)
    The power of each energy integral, W, but for the heats of contacts.
stored_energies(q, v)
    J, of numbers or arrays, the kinetic energy first.
"""

from typing import Any

from frictionsim.results import SLACK
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.contacts import CAPTURE_SPEED, RESTITUTION
from frictionsim.solvers.multi_contact_location import find_first_events
from frictionsim.solvers.multi_contact_modes import direction_of, write_consistent_modes
from frictionsim.solvers.multi_contact_state import (
    ACCELERATION,
    ENDS,
    FORCES,
    HEATS,
    MODES,
    OLD_MODES,
    RELEASED_BEFORE,
    RELEASED_NOW,
    RESTING,
    balance,
    coordinate_of,
    holds,
    write_phase,
)
from frictionsim.solvers.multi_contact_step import advance, start_segment, write_inside
from frictionsim.solvers.one_contact import DONE, FULL, PAUSED
from frictionsim.solvers.one_contact_state import (
    BEFORE,
    EVENT_COLUMNS,
    EVENTS,
    HELD,
    INSIDE,
    NEXT_TIME,
    ROWS,
    SAMPLED_UNTIL,
    SEGMENT_END,
    STARTED,
    T_NEW,
    TIME,
    TURNS,
    Run,
    Y,
    begin_event,
    copy,
    copy_to_buffer,
    count_sample,
    count_switch,
)


@compilable
def integrate(system: Any, run: Run, s: Any, rows: Any, events: Any, steps: float) -> int:
    """Integrate to the end, from the start or from where an earlier call ended.

    As `frictionsim.solvers.one_contact.integrate`; the buffer of events has room for one of each
    contact at least.
    """
    room = system.contacts.size * (EVENT_COLUMNS + 2 * run.columns)
    s[ROWS] = s[EVENTS] = s[TURNS] = 0.0
    while True:
        while s[NEXT_TIME] < s[SAMPLED_UNTIL]:
            if (s[ROWS] + 1.0) * run.columns > len(rows):
                return FULL
            _sample(system, run, s, rows, s[NEXT_TIME])
        if s[EVENTS] * (EVENT_COLUMNS + 2 * run.columns) + room > len(events):
            return FULL
        s[TIME] = s[SAMPLED_UNTIL]
        if s[STARTED] == 0.0 or _ends(system, s):
            _end_phase(system, run, s)
            _switch_modes(system, run, s, events)
            s[STARTED] = 1.0
        if s[TIME] >= run.end:
            if s[NEXT_TIME] <= run.end:
                if (s[ROWS] + 1.0) * run.columns > len(rows):
                    return FULL
                _sample(system, run, s, rows, run.end)
            return DONE
        if s[TURNS] >= steps:
            return PAUSED
        s[TURNS] += 1.0
        _step(system, run, s)
        find_first_events(system, run, s)


@compilable
def _step(system: Any, run: Run, s: Any) -> None:
    """Stay at rest for a monotone segment of the drive, or take a step."""
    if s[RESTING] != 0.0:
        s[SAMPLED_UNTIL] = min(run.end, system.drive.next_extremum(s[TIME]))
    else:
        if s[T_NEW] >= s[SEGMENT_END]:
            s[SEGMENT_END] = min(run.end, system.drive.next_extremum(s[T_NEW]))
        advance(system, run, s, s[SEGMENT_END])
        s[SAMPLED_UNTIL] = s[T_NEW]


@compilable
def _ends(system: Any, s: Any) -> bool:
    """Return whether the mode of a contact ends at the end of the last step."""
    ending = False
    for i in range(system.contacts.size):
        ending = ending or s[ENDS + i] != 0.0
    return ending


@compilable
def _end_phase(system: Any, run: Run, s: Any) -> None:
    """Write the state at the end of the last step, and which contacts are released there."""
    n = system.coordinates
    if s[RESTING] == 0.0:
        write_inside(system, run, s, s[TIME])
        copy(s, Y, INSIDE, run.states)
    copy(s, BEFORE, Y, run.states)
    for i in range(system.contacts.size):
        mode, c = s[MODES + i], coordinate_of(system, i)
        s[RELEASED_NOW + i] = s[RELEASED_BEFORE + i] = 0.0
        if s[ENDS + i] == 0.0:
            # Released at this very time, it has not moved yet.
            if not holds(mode) and s[BEFORE + n + c] == 0.0:
                s[RELEASED_BEFORE + i] = direction_of(mode)
        elif holds(mode):
            s[RELEASED_NOW + i] = s[ENDS + i]
        elif mode == SLACK:
            s[BEFORE + c] = s[Y + c] = 0.0
            _close_gap(system, run, s, i)
        else:
            s[BEFORE + n + c] = s[Y + n + c] = 0.0


@compilable
def _close_gap(system: Any, run: Run, s: Any, i: int) -> None:
    """Change the state by the impact of a gap that closes."""
    n, contacts, m = system.coordinates, system.contacts, system.contacts.size
    row = i * contacts.width
    is_slow = -s[Y + n + coordinate_of(system, i)] < contacts.numbers[row + CAPTURE_SPEED]
    for j in range(m):
        s[HEATS + j] = 0.0
    system.impact(i, 0.0 if is_slow else contacts.numbers[row + RESTITUTION], s, Y)
    for j in range(m):
        s[Y + run.heats + min(j, contacts.frictions)] += s[HEATS + j]


@compilable
def _switch_modes(system: Any, run: Run, s: Any, events: Any) -> None:
    """Switch to the consistent modes, record what changes, and start the integrator."""
    count_switch(run, s)
    m, t = system.contacts.size, s[TIME]
    # Samples are of all that changes.
    first = int(s[EVENTS]) * (EVENT_COLUMNS + 2 * run.columns) + EVENT_COLUMNS
    located = False
    for i in range(m):
        located = located or s[RELEASED_NOW + i] != 0.0
    if t > 0.0:
        held = min(s[HELD], t) if located else t
        _write_row(system, run, s, events, first, held, BEFORE)
        events[first] = t
    copy(s, OLD_MODES, MODES, m)
    write_consistent_modes(system, run, s)
    _write_row(system, run, s, events, first + run.columns, t, Y)
    if not t > 0.0:
        _write_row(system, run, s, events, first, t, Y)
    for i in range(m):
        mode, before = s[MODES + i], s[OLD_MODES + i]
        if mode != before or (before == SLACK and s[ENDS + i] != 0.0):
            at = begin_event(run, s, events, float(i), t, before, mode)
            if at != first:
                copy_to_buffer(events, at, events, first, 2 * run.columns)
        s[ENDS + i] = s[RELEASED_NOW + i] = s[RELEASED_BEFORE + i] = 0.0
    write_phase(system, s)
    if s[RESTING] == 0.0:
        start_segment(system, run, s, t)
        s[SEGMENT_END] = t


@compilable
def _sample(system: Any, run: Run, s: Any, rows: Any, t: float) -> None:
    """Record the state at t, s, and advance to the next sample time."""
    at, y = int(s[ROWS]) * run.columns, Y
    if s[RESTING] == 0.0:
        write_inside(system, run, s, t)
        y = INSIDE
    _write_row(system, run, s, rows, at, t, y)
    count_sample(run, s)


@compilable
def _write_row(system: Any, run: Run, s: Any, out: Any, at: int, t: float, y: int) -> None:
    """Write the sample of the state at s[y].

    Time, drive, positions, velocities, accelerations, forces, modes, energy integrals.
    """
    n, u, contacts = system.coordinates, system.drive.at(t), system.contacts
    balance(system, s, u, y)
    out[at] = t
    out[at + 1] = u
    at += 2
    copy_to_buffer(out, at, s, y, 2 * n)
    at += 2 * n
    copy_to_buffer(out, at, s, ACCELERATION, n)
    at += n
    copy_to_buffer(out, at, s, FORCES, contacts.terms - 2)
    at += contacts.terms - 2
    copy_to_buffer(out, at, s, MODES, contacts.size)
    copy_to_buffer(out, at + contacts.size, s, y + 2 * n, run.states - 2 * n)
