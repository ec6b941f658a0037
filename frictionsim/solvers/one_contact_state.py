"""The state of a run of one coordinate with one dry contact: one array of numbers, and its layout.

All that a run needs to continue is in this array, so that the loop of `one_contact` may end at any
step and be continued, as Python or compiled, with the same bits. Vectors (position, velocity,
energy integrals) have room for MAX_STATES numbers.
"""

from math import inf
from typing import Any, NamedTuple

from frictionsim.solvers.compilation import compilable, compiled_as

MAX_STATES = 64

# The run: time, s; mode of the contact; end of the samples in the last step, s; whether the phase
# ends there, and in which direction the contact then breaks away; the last time at which it held;
# the end of the smooth segment in which it slides.
TIME, STARTED, MODE, SAMPLED_UNTIL, PHASE_ENDS, DIRECTION, HELD, SEGMENT_END = range(8)
# The integrator: start and end of the last step, s; length of the next; the error of the last one.
T_OLD, T_NEW, STEP, ERROR_BEFORE, STEPS, REJECTED, EVALUATIONS, GRANTED = range(8, 16)
# Sampling: number and time of the next sample; rows and events that are in the buffers.
NEXT_SAMPLE, NEXT_TIME, ROWS, EVENTS = range(16, 20)
# Turns of the loop in this call; changes of mode so far.
TURNS, SWITCHES = range(20, 22)
SURFACE_EVENT = 23  # the surface that the last step ends at; NO_EVENT if it ends at none
Y = 32  # state of the phase
Y_OLD, Y_NEW, F_OLD, F_NEW, INSIDE, BEFORE = (Y + k * MAX_STATES for k in range(1, 7))
SWITCH_TIMES = BEFORE + MAX_STATES  # the last ones, in a ring

# So many changes of mode within this time, s, are chattering.
CHATTERING_EVENTS = 100
CHATTERING_WINDOW = 1e-6
LENGTH = SWITCH_TIMES + CHATTERING_EVENTS

NEVER = -1.0  # s
NO_EVENT = -1.0
ROW_COLUMNS = 7  # of a sample, without its energies
# An event: its number (below), time, modes before and after it, position; then two samples.
EVENT_COLUMNS = 5
CONTACT_EVENT, STOP_EVENT = 0.0, 1.0
FIRST_SURFACE_EVENT = 2.0  # and above: the number of the surface

# Why a run cannot continue.
TOO_MANY_STEPS, NON_FINITE, UNDERFLOW, HIDDEN_EVENT, DIVERGED, CHATTERS, NO_MODES = range(7)


class Run(NamedTuple):
    """The numbers of a run that do not change, beside the mechanism's.

    Attributes
    ----------
    states, columns : int
        Length of the state (position, velocity, energy integrals) and of a sample.
    end : float, s
    rtol, atol : float
    max_step, fixed_step : float, s
        Infinite and 0 if not given.
    max_steps : int
    interval, last : float
        Time between samples, s, and the number of the last at a multiple of it.
    given : array
        Times of the samples if they are given, s; else empty.
    stored : tuple of float, J
        The stored energies at the start, the kinetic one first.
    energy_floor : float, J
        Energies below are accurate to the absolute tolerance only.
    jump_ulps : float
        A step of this number of units in the last place of the time is accepted whatever its error.
    input, heats : int
        Where the energy input and the heat of impacts are in the state; of several contacts the
        first of their heats, that of impacts behind those of friction.
    """

    states: int
    columns: int
    end: float
    rtol: float
    atol: float
    max_step: float
    fixed_step: float
    max_steps: int
    interval: float
    last: float
    given: Any
    stored: tuple[float, ...]
    energy_floor: float
    input: int
    heats: int
    jump_ulps: float = 0.0


class Failure(RuntimeError):
    """A run cannot continue.

    Attributes
    ----------
    reason : int
        TOO_MANY_STEPS, NON_FINITE, ...
    numbers : tuple of float
        For the message.
    """

    def __init__(self, reason: int, *numbers: float) -> None:
        self.reason, self.numbers = reason, numbers


def _end_call(reason: int, t: float, x: float, y: float, z: float) -> None:
    raise RuntimeError  # without a reason, which the same piece as Python gives


@compiled_as(_end_call)
def fail(reason: int, t: float, x: float, y: float, z: float) -> None:
    """End the run."""
    raise Failure(reason, t, x, y, z)


def _copy_one_by_one(s: Any, to: int, start: int, n: int) -> None:
    for i in range(n):
        s[to + i] = s[start + i]


@compiled_as(_copy_one_by_one)
def copy(s: Any, to: int, start: int, n: int) -> None:
    """Copy n numbers of the state from one place to another."""
    s[to : to + n] = s[start : start + n]


def _copy_to_buffer_one_by_one(out: Any, at: int, s: Any, start: int, n: int) -> None:
    for i in range(n):
        out[at + i] = s[start + i]


@compiled_as(_copy_to_buffer_one_by_one)
def copy_to_buffer(out: Any, at: int, s: Any, start: int, n: int) -> None:
    """Copy n numbers of the state into a buffer."""
    out[at : at + n] = s[start : start + n]


@compilable
def sample_time(run: Any, number: float) -> float:
    """Return the time of a sample of a `Run`, counted from 0, s; infinite after the last."""
    if len(run.given) > 0:
        return run.given[int(number)] if number < len(run.given) else inf
    if number <= run.last:
        return number * run.interval
    return run.end if number == run.last + 1.0 else inf


@compilable
def count_sample(run: Run, s: Any) -> None:
    """Count a sample, and set the time of the next."""
    s[ROWS] += 1.0
    s[NEXT_SAMPLE] += 1.0
    s[NEXT_TIME] = sample_time(run, s[NEXT_SAMPLE])


@compilable
def begin_event(
    run: Run, s: Any, events: Any, number: float, t: float, before: float, after: float
) -> int:
    """Write an event at the position of the phase; return where its first sample goes."""
    at = int(s[EVENTS]) * (EVENT_COLUMNS + 2 * run.columns)
    events[at] = number
    events[at + 1] = t
    events[at + 2] = before
    events[at + 3] = after
    events[at + 4] = s[Y]
    s[EVENTS] += 1.0
    return at + EVENT_COLUMNS


@compilable
def count_switch(run: Run, s: Any) -> None:
    """Count a change of mode; the run ends if there are too many in the window."""
    t, place = s[TIME], SWITCH_TIMES + int(s[SWITCHES] % CHATTERING_EVENTS)
    window = CHATTERING_WINDOW * min(1.0, run.end)
    if s[SWITCHES] >= CHATTERING_EVENTS and t - s[place] < window:
        fail(CHATTERS, t, t - s[place], 0.0, 0.0)
    s[place] = t
    s[SWITCHES] += 1.0
