"""Event-driven integration of one coordinate with one dry contact: one loop, as Python or compiled.

In a stick phase the state is constant; it ends where the applied torque first exceeds the static
limit. In a slip phase the kinetic friction has a fixed direction; it ends where the velocity
becomes zero. The static limit then decides the next phase; if the torque equals it, the contact
sticks.

The loop takes a `system`, a named tuple of numbers whose methods are the equation of motion
(`frictionsim.solvers.system`), and keeps its state in one array s (`one_contact_state`). It ends
where a buffer is full or after a number of steps, never shortens a step for that, and continues
from there.
"""

from math import inf, ulp
from typing import Any

from frictionsim.solvers.common import SAME_TIME_ULPS
from frictionsim.solvers.compilation import compilable, inlined
from frictionsim.solvers.end_stops import HIDDEN_ULPS
from frictionsim.solvers.one_contact_location import (
    ACCELERATION,
    DRIVE,
    EXCESS,
    EXCESS_BEYOND_ROUNDOFF,
    LOAD,
    POSITION,
    SURFACE,
    VELOCITY,
    EventFunction,
    against_load,
    beyond_surface,
    bracket,
    excess,
    excess_beyond_roundoff,
)
from frictionsim.solvers.one_contact_state import (
    BEFORE,
    CONTACT_EVENT,
    DIRECTION,
    DIVERGED,
    EVENT_COLUMNS,
    EVENTS,
    F_NEW,
    F_OLD,
    FIRST_SURFACE_EVENT,
    HELD,
    INSIDE,
    MODE,
    NEXT_TIME,
    NO_EVENT,
    PHASE_ENDS,
    ROW_COLUMNS,
    ROWS,
    SAMPLED_UNTIL,
    SEGMENT_END,
    STARTED,
    STOP_EVENT,
    SURFACE_EVENT,
    T_NEW,
    T_OLD,
    TIME,
    TURNS,
    Y_NEW,
    Y_OLD,
    Run,
    Y,
    begin_event,
    copy,
    count_sample,
    count_switch,
    fail,
)
from frictionsim.solvers.one_contact_step import (
    advance,
    repeats_shorter,
    start_segment,
    truncate,
    write_inside,
)

DONE, PAUSED, FULL = range(3)

# Kinetic energy above this multiple of the energy input indicates an unstable integration.
MAX_ENERGY_RATIO = 100.0

# Resolution of the end of a slip phase, relative to the step.
RESOLUTION = 1e-12


@compilable
def integrate(system: Any, run: Run, s: Any, rows: Any, events: Any, steps: float) -> int:
    """Integrate to the end, from the start or from where an earlier call ended.

    Parameters
    ----------
    system : named tuple
    run : Run
    s : (LENGTH,)
        The state; changed.
    rows, events : (n,)
        Buffers for samples and events, filled from their begin.
    steps : float
        The call ends after so many steps or rests.

    Returns
    -------
    int
        DONE at the end of the run, FULL where a buffer has no room, PAUSED after the steps.
    """
    event_width = EVENT_COLUMNS + 2 * run.columns
    s[ROWS] = s[EVENTS] = s[TURNS] = 0.0
    if s[STARTED] == 0.0:
        if event_width > len(events):
            return FULL
        _start(system, run, s, events)
        s[STARTED] = 1.0
    while True:
        while s[NEXT_TIME] < s[SAMPLED_UNTIL]:
            if (s[ROWS] + 1.0) * run.columns > len(rows):
                return FULL
            _sample(system, run, s, rows, s[NEXT_TIME])
        if (s[EVENTS] + 1.0) * event_width > len(events):
            return FULL
        s[TIME] = s[SAMPLED_UNTIL]
        if s[PHASE_ENDS] != 0.0:
            _end_phase(system, run, s, events)
        if s[TIME] >= run.end:
            if s[NEXT_TIME] <= run.end:
                if (s[ROWS] + 1.0) * run.columns > len(rows):
                    return FULL
                _sample(system, run, s, rows, run.end)
            return DONE
        if (s[EVENTS] + 1.0) * event_width > len(events):
            return FULL
        if s[TURNS] >= steps:
            return PAUSED
        s[TURNS] += 1.0
        if s[MODE] == 0.0:
            _stick(system, run, s)
        else:
            _slip(system, run, s, events)


@compilable
def _start(system: Any, run: Run, s: Any, events: Any) -> None:
    if is_hit(system.stops, s):
        _hit_stop(system.stops, system, run, s, events)
    elif s[MODE] == 0.0:
        _switch_mode(system, run, s, events, mode_from_rest(system, s))
    else:
        _begin_slip(system, run, s)


@compilable
def _end_phase(system: Any, run: Run, s: Any, events: Any) -> None:
    """Switch to the mode that follows at the end of the last step."""
    s[PHASE_ENDS] = 0.0
    if s[MODE] == 0.0:
        _switch_mode(system, run, s, events, s[DIRECTION])
        return
    write_inside(system, run, s, s[MODE], s[TIME])
    copy(s, Y, INSIDE, run.states)
    if is_hit(system.stops, s):
        _hit_stop(system.stops, system, run, s, events)
        return
    s[Y + 1] = 0.0
    _switch_mode(system, run, s, events, mode_from_rest(system, s))


@compilable
def _begin_slip(system: Any, run: Run, s: Any) -> None:
    start_segment(system, run, s, s[TIME])
    s[SEGMENT_END] = s[TIME]


@compilable
def _switch_mode(system: Any, run: Run, s: Any, events: Any, mode: float) -> None:
    """Switch to the next mode and record the transition if the mode changes."""
    count_switch(run, s)
    t, before = s[TIME], s[MODE]
    if mode != before:
        held = s[HELD] if before == 0.0 else t
        at = begin_event(run, s, events, CONTACT_EVENT, t, before, mode)
        if held >= 0.0:
            # The last time in the mode before is one rounding earlier if the drive jumps at t.
            _write_row(system, run, s, events, at, min(held, t), Y, before)
            events[at] = t
        else:  # the run starts in the mode after
            _write_row(system, run, s, events, at, t, Y, mode)
        _write_row(system, run, s, events, at + run.columns, t, Y, mode)
        s[MODE] = mode
    if mode != 0.0:
        _begin_slip(system, run, s)


@compilable
def mode_from_rest(system: Any, s: Any) -> float:
    """Return the mode that follows from rest at the present time."""
    if excess_beyond_roundoff(system, s, s[TIME], 1.0) > 0.0:
        return 1.0
    return -1.0 if excess_beyond_roundoff(system, s, s[TIME], -1.0) > 0.0 else 0.0


@compilable
def _stick(system: Any, run: Run, s: Any) -> None:
    """Stick for a monotone segment of the drive, or up to the breakaway in it."""
    a = s[TIME]
    b = system.first_excess(s[Y], a, monotone_segment_end(system, run, s, a))
    s[SAMPLED_UNTIL] = b
    direction = 1.0
    if not excess_beyond_roundoff(system, s, b, 1.0) > 0.0:
        if not excess_beyond_roundoff(system, s, b, -1.0) > 0.0:
            return
        direction = -1.0
    s[HELD], s[SAMPLED_UNTIL] = breakaway(system, run, s, direction, a, b)
    s[DIRECTION], s[PHASE_ENDS] = direction, 1.0


@compilable
def breakaway(
    system: Any, run: Run, s: Any, direction: float, a: float, b: float
) -> tuple[float, float]:
    """Return the time of the breakaway in a direction within a monotone segment from a to b.

    Two adjacent times, s: the contact still holds at the first. Both are a if the torque equals
    the limit there and exceeds it within the roundoff of the time.
    """
    at_a, which = excess(system, s, a, direction), EXCESS
    if not at_a <= 0.0:  # an excess that is roundoff is ignored
        at_a, which = excess_beyond_roundoff(system, s, a, direction), EXCESS_BEYOND_ROUNDOFF
    held, after = bracket(EventFunction(which, direction, 0.0), system, run, s, a, b, 0.0)
    tie = system.roundoff(system.drive.at(a), s[Y])
    if after - a <= SAME_TIME_ULPS * ulp(run.end) and at_a >= -tie:
        return a, a
    return held, after


@compilable
def monotone_segment_end(system: Any, run: Run, s: Any, t: float) -> float:
    """Return a time after t up to which drive and friction limits are smooth and monotone, s."""
    b = min(run.end, system.drive.next_extremum(t))
    for i in range(len(system.breaks)):
        critical = system.breaks[i]
        if (system.drive.at(t) - critical) * (system.drive.at(b) - critical) < 0.0:
            b = bracket(EventFunction(DRIVE, 0.0, critical), system, run, s, t, b, 0.0)[1]
    return b


@compilable
@inlined
def _slip(system: Any, run: Run, s: Any, events: Any) -> None:
    """Slide for a step, or up to the rest or impact within it."""
    direction = s[MODE]
    if s[T_NEW] >= s[SEGMENT_END]:
        s[SEGMENT_END] = monotone_segment_end(system, run, s, s[T_NEW])
    _step(system, run, s, direction)
    check_energy(system, run, s, 0.0)
    s[TIME] = s[T_NEW]
    rest = _rest_within_step(system, run, s, direction)
    until = min(s[T_NEW], rest)
    impact = _impact_within_step(system.stops, system, run, s, direction, until)
    rest, until = min(rest, impact), min(until, impact)
    s[PHASE_ENDS] = 1.0 if rest != inf else 0.0
    if rest == inf and s[SURFACE_EVENT] != NO_EVENT:
        _record_crossing(system, run, s, events)
    s[SAMPLED_UNTIL] = until


@compilable
@inlined
def _step(system: Any, run: Run, s: Any, direction: float) -> None:
    """Take a step that ends at a switching surface, or where the load has turned, if it does."""
    advance(system, run, s, direction, s[SEGMENT_END])
    while _cut_at_surfaces(system.surfaces, system, run, s, direction) and repeats_shorter(
        system, run, s, direction
    ):
        advance(system, run, s, direction, s[SEGMENT_END])
    loads, q, v = system.reversing_load, s[Y_NEW], s[Y_NEW + 1]
    if against_load(loads, system, s, s[T_NEW], q, v) > 0.0:
        reversal = EventFunction(LOAD, direction, 0.0)
        turned = bracket(reversal, system, run, s, s[T_OLD], s[T_NEW], 0.0)[1]
        if turned < s[T_NEW]:
            truncate(system, run, s, direction, turned)
            s[SURFACE_EVENT] = NO_EVENT


@compilable
def _cut_at_surfaces(surfaces: Any, system: Any, run: Run, s: Any, direction: float) -> bool:
    """End the last step at the first surface that it crosses; return whether that is of a table."""
    s[SURFACE_EVENT] = NO_EVENT
    of_table = False
    if len(surfaces) == 0:
        return of_table
    n = run.states
    for i in range(len(surfaces)):
        if beyond_surface(surfaces, s, float(i), s[Y_NEW], s[Y_NEW + 1]) > 0.0:
            crossing = EventFunction(SURFACE, direction, float(i))
            before, after = bracket(crossing, system, run, s, s[T_OLD], s[T_NEW], 0.0)
            s[SURFACE_EVENT] = NO_EVENT
            if surfaces[i].is_event:
                write_inside(system, run, s, direction, before)
                copy(s, BEFORE, INSIDE, n)
                s[SURFACE_EVENT] = float(i)
            truncate(system, run, s, direction, after)
            of_table = surfaces[i].is_of_table
    return of_table


@compilable
def check_energy(system: Any, run: Run, s: Any, gained: float) -> None:
    """End a run whose kinetic energy far exceeds the energy input.

    The input is the initial kinetic energy, the work of the drive, the energy released by the
    other stores, and what friction has given, J.
    """
    stored = system.stored_energies(s[Y_NEW], s[Y_NEW + 1])
    supplied = run.energy_floor + abs(s[Y_NEW + run.input]) + gained
    for i in range(1, len(stored)):
        supplied += abs(stored[i] - run.stored[i])
    if stored[0] > MAX_ENERGY_RATIO * supplied:
        fail(DIVERGED, s[T_NEW], stored[0], supplied, 0.0)


@compilable
def _record_crossing(system: Any, run: Run, s: Any, events: Any) -> None:
    """Record the event at the end of the last step; the mode is unchanged."""
    t, mode = s[T_NEW], 1.0 if s[Y_NEW + 1] > 0.0 else -1.0
    at = begin_event(run, s, events, FIRST_SURFACE_EVENT + s[SURFACE_EVENT], t, mode, mode)
    events[at - 1] = s[Y_NEW]
    _write_row(system, run, s, events, at, t, BEFORE, mode)
    _write_row(system, run, s, events, at + run.columns, t, Y_NEW, mode)


@compilable
def _rest_within_step(system: Any, run: Run, s: Any, direction: float) -> float:
    """Return the time of the first rest in the last step, s; inf if there is none.

    The zero velocity at the start of a phase after a breakaway does not count.
    """
    t_old, t1, velocity = s[T_OLD], s[T_NEW], EventFunction(VELOCITY, direction, 0.0)
    if direction * s[Y_NEW + 1] > 0.0:
        t1 = _time_of_min_velocity(system, run, s, direction)
        if t1 == inf or velocity.value_at(system, run, s, t1) > 0.0:
            return inf
    resolution = RESOLUTION * (t1 - t_old)
    if direction * s[Y_OLD + 1] <= 0.0:
        width = t1 - t_old
        while velocity.value_at(system, run, s, t_old + width) <= 0.0:
            width *= 0.1
            if width <= resolution:
                return t_old
        t_old += width
        if t_old >= t1:
            return t1
    return bracket(velocity, system, run, s, t_old, t1, resolution)[1]


@compilable
def _time_of_min_velocity(system: Any, run: Run, s: Any, direction: float) -> float:
    """Return the time of the minimum velocity in the last step; inf if it stays positive."""
    h = s[T_NEW] - s[T_OLD]
    v0, v1 = direction * s[Y_OLD + 1], direction * s[Y_NEW + 1]
    a0, a1 = direction * s[F_OLD + 1], direction * s[F_NEW + 1]
    if not a0 < 0.0 < a1:
        return inf
    # The velocity is above its tangents at both ends, hence above their intersection.
    if v0 + a0 * (v1 - v0 - a1 * h) / (a0 - a1) > 0.0:
        return inf
    reversal = EventFunction(ACCELERATION, direction, 0.0)
    return bracket(reversal, system, run, s, s[T_OLD], s[T_NEW], RESOLUTION * h)[1]


@compilable
def is_hit(stops: Any, s: Any) -> bool:
    """Return whether a state is beyond a stop, or at it and moving into it."""
    if len(stops) == 0:
        return False
    stop, q = stops[0], s[Y]
    if stop.lowest < q < stop.highest:
        return False
    side = 1.0 if q >= stop.highest else -1.0
    return side * s[Y + 1] > 0.0 or q > stop.highest or q < stop.lowest


@compilable
def _hit_stop(stops: Any, system: Any, run: Run, s: Any, events: Any) -> None:
    """Switch to the mode after an impact on a stop."""
    if len(stops) == 0:
        return
    t, mode_before = s[TIME], s[MODE]
    count_switch(run, s)
    rebound(stops, system, run, s)
    mode = -mode_before if s[Y + 1] != 0.0 else mode_from_rest(system, s)
    at = begin_event(run, s, events, STOP_EVENT, t, mode_before, mode)
    _write_row(system, run, s, events, at, t, BEFORE, mode_before)
    _write_row(system, run, s, events, at + run.columns, t, Y, mode)
    s[MODE] = mode
    if mode != 0.0:
        _begin_slip(system, run, s)


@compilable
def rebound(stops: Any, system: Any, run: Run, s: Any) -> None:
    """Write the state after an impact on a stop, v+ = -e v-, and that before it into BEFORE.

    Both are at the stop exactly.
    """
    if len(stops) == 0:
        return
    stop, q = stops[0], s[Y]
    side = 1.0 if q >= stop.highest else -1.0
    speed = side * s[Y + 1]
    kinetic_before = system.stored_energies(q, s[Y + 1])[0]
    s[Y] = min(max(q, stop.lowest), stop.highest)
    copy(s, BEFORE, Y, run.states)
    v = stop.restitution * speed
    if speed < stop.capture_speed or _is_hidden(stop, system, s, side, v):
        v = 0.0
    s[Y + 1] = -side * v if v > 0.0 else 0.0
    s[Y + run.heats] += kinetic_before - system.stored_energies(q, s[Y + 1])[0]


@compilable
def _is_hidden(stop: Any, system: Any, s: Any, side: float, rebound: float) -> bool:
    """Return whether rounding of time or position hides the flight after a rebound."""
    t, q = s[TIME], s[Y]
    towards = side * system.applied_torque(system.drive.at(t), q, -side * rebound) / system.inertia
    if towards <= 0.0:
        return False
    duration, height = 2.0 * rebound / towards, 0.5 * rebound * rebound / towards
    ulps = HIDDEN_ULPS / (1.0 - stop.restitution)
    return duration < ulps * ulp(t) or height < ulps * ulp(q)


@compilable
def _impact_within_step(
    stops: Any, system: Any, run: Run, s: Any, direction: float, until: float
) -> float:
    """Return the time of the impact in the last step up to a time, s; inf without one."""
    if len(stops) == 0:
        return inf
    stop = stops[0].highest if direction > 0.0 else stops[0].lowest
    beyond = EventFunction(POSITION, direction, stop)
    if beyond.value_at(system, run, s, until) <= 0.0:
        return inf
    return bracket(beyond, system, run, s, s[T_OLD], until, 0.0)[1]


@compilable
def _sample(system: Any, run: Run, s: Any, rows: Any, t: float) -> None:
    """Record the state at t, s, and advance to the next sample time."""
    at, y = int(s[ROWS]) * run.columns, Y
    if s[MODE] != 0.0:
        write_inside(system, run, s, s[MODE], t)
        y = INSIDE
    _write_row(system, run, s, rows, at, t, y, s[MODE])
    count_sample(run, s)


@compilable
def _write_row(
    system: Any, run: Run, s: Any, out: Any, at: int, t: float, y: int, mode: float
) -> None:
    """Write the sample of the state at s[y] in a mode: time, drive, motion, friction, energies."""
    u, q, v = system.drive.at(t), s[y], s[y + 1]
    applied = system.applied_torque(u, q, v)
    if mode == 0.0:
        friction, acceleration = -applied, 0.0
    else:
        friction = -mode * system.kinetic_limit(u, q, v, mode)
        acceleration = (applied + friction) / system.inertia
    out[at] = t
    out[at + 1] = u
    out[at + 2] = q
    out[at + 3] = v
    out[at + 4] = acceleration
    out[at + 5] = friction
    out[at + 6] = mode
    for i in range(2, run.states):
        out[at + ROW_COLUMNS - 2 + i] = s[y + i]
