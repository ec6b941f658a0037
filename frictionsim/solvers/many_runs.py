"""The compiled entry of the event-driven solver: runs of one form, one after the other."""

from collections.abc import Callable
from typing import Any, NamedTuple

from frictionsim.solvers import multi_contact, one_contact
from frictionsim.solvers.compilation import argument_of, compilable, compiled_by_type, packed
from frictionsim.solvers.one_contact import DONE
from frictionsim.solvers.one_contact_state import EVENT_COLUMNS, EVENTS, ROWS, TURNS, Run

# Of the progress of a call: the run that is integrated, and how far the buffers are filled.
RUN, FILLED_ROWS, FILLED_EVENTS = range(3)
SAMPLES, EVENTS_OF_A_CALL = 4096, 2048  # in the buffers
STEPS_OF_A_CALL = 300_000.0


def _loop_of(system: Any, *_: Any) -> Callable[..., Any]:
    fields = getattr(system, "fields", None) or system._fields  # of a type of numba, or a tuple
    return multi_contact.integrate if "contacts" in fields else one_contact.integrate


@compiled_by_type(_loop_of, 6)
def _integrate(system: Any, run: Run, s: Any, rows: Any, events: Any, steps: float) -> int:
    """Integrate a run by the loop for its system."""
    status: int = _loop_of(system)(system, run, s, rows, events, steps)
    return status


@compilable
def integrate_runs(
    template: Any, numbers: Any, states: Any, rows: Any, events: Any, progress: Any, steps: float
) -> int:
    """Integrate runs to their ends, from the start or from where an earlier call ended.

    Parameters
    ----------
    template : tuple
    numbers : (runs, k) array
        The systems and `Run` of the runs, as `packed`.
    states : (runs, LENGTH)
        Changed.
    rows, events : (n,)
        Buffers for samples and events, filled from their begin.
    progress : (3,)
        The run that is integrated, and how far the buffers are filled; changed, also where a run
        fails.
    steps : float
        The call ends after so many steps or rests.

    Returns
    -------
    int
        DONE after the last run, FULL where a buffer has no room, PAUSED after the steps.
    """
    progress[FILLED_ROWS] = progress[FILLED_EVENTS] = 0.0
    while progress[RUN] < len(states):
        number = int(progress[RUN])
        s = states[number]
        system, run = argument_of(template, numbers, number)
        free = rows[int(progress[FILLED_ROWS]) :], events[int(progress[FILLED_EVENTS]) :]
        status = _integrate(system, run, s, free[0], free[1], steps)
        progress[FILLED_ROWS] += s[ROWS] * run.columns
        progress[FILLED_EVENTS] += s[EVENTS] * (EVENT_COLUMNS + 2 * run.columns)
        if status != DONE:
            return status
        steps -= s[TURNS]
        progress[RUN] += 1.0
    return DONE


class Recorded(NamedTuple):
    """The samples and events of many runs, in the order of the runs.

    Attributes
    ----------
    done : (runs,) of bool
        Of those that come to their end.
    rows : (n, columns)
        The samples of all runs.
    events : (m, width)
        The events of all runs, as `integrate` writes them.
    counts : (runs, 2)
        How many of the two are of each run.
    """

    done: Any
    rows: Any
    events: Any
    counts: Any


def recorded(
    function: Callable[..., int], arguments: tuple[Any, Run], states: Any, on_call: Any
) -> Recorded:
    """Integrate many runs from their start.

    Parameters
    ----------
    function : callable
        `integrate_runs`, compiled.
    arguments : tuple
        System and `Run`, whose numbers may be arrays (runs,).
    states : (runs, LENGTH)
    on_call : callable
        Called between calls of compiled code; it may raise Interrupted.
    """
    import numpy as np  # imported here because a run as Python does not need it

    columns, runs = arguments[1].columns, len(states)
    width = EVENT_COLUMNS + 2 * columns
    template, numbers = packed(arguments, runs)
    buffers = np.empty(SAMPLES * columns), np.empty(EVENTS_OF_A_CALL * width)
    progress, done = np.zeros(3), np.ones(runs, dtype=bool)
    counts, rows, events = np.zeros((runs, 2), dtype=int), [], []
    while progress[RUN] < runs:
        on_call()
        first = int(progress[RUN])
        try:
            function(template, numbers, states, *buffers, progress, STEPS_OF_A_CALL)
            end = int(progress[RUN]) + 1
        except (ArithmeticError, RuntimeError, ValueError):
            end = int(progress[RUN])
            done[end] = False
            progress[RUN] += 1.0
        counts[first:end] += states[first:end, [ROWS, EVENTS]].astype(int)
        rows.append(buffers[0][: int(progress[FILLED_ROWS])].copy())
        events.append(buffers[1][: int(progress[FILLED_EVENTS])].copy())
    tables = np.concatenate(rows).reshape(-1, columns), np.concatenate(events).reshape(-1, width)
    return Recorded(done, *tables, counts)
