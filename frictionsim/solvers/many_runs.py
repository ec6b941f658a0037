"""The compiled entry of the event-driven solver: runs of one form, one after the other."""

from collections.abc import Callable
from typing import Any

from frictionsim.solvers import multi_contact, one_contact
from frictionsim.solvers.compilation import argument_of, compilable, compiled_by_type
from frictionsim.solvers.one_contact import DONE
from frictionsim.solvers.one_contact_state import EVENT_COLUMNS, EVENTS, ROWS, TURNS, Run

# Of the progress of a call: the run that is integrated, and how far the buffers are filled.
RUN, FILLED_ROWS, FILLED_EVENTS = range(3)


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
