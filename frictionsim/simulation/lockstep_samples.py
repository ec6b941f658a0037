"""The samples of runs in lockstep: at the start, at each event and at the end."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import STICK, Transition
from frictionsim.simulation.single_dof import MODE_COLUMN, TIME_COLUMN, VELOCITY_COLUMN
from frictionsim.solvers.lockstep_functions import selected

if TYPE_CHECKING:
    from frictionsim.solvers.lockstep import LockstepSolver
    from frictionsim.solvers.mechanism import Mechanism


class Breakaways(NamedTuple):
    """The breakaways of many runs, with the samples on both sides of each.

    Attributes
    ----------
    run : (n,)
    before, after : (width, n)
    """

    run: Any
    before: Any
    after: Any


class SamplesOfRuns:
    """The samples and transitions of many runs.

    Parameters
    ----------
    rows : (width, samples)
        Columns as of `SampleBuffer`, in the order of run and time.
    run : (samples,)
        The run of each sample.
    transitions : list of Transition
        In the order of run and time.
    first : (runs + 1,)
        Where the transitions of each run begin.
    sound : (runs,) of bool
        Not given back, and all its samples are finite.
    breakaways : Breakaways
    """

    def __init__(
        self,
        rows: Any,
        run: Any,
        transitions: list[Transition],
        first: Any,
        sound: Any,
        breakaways: Breakaways,
    ) -> None:
        self._rows, self._transitions, self._sound = rows, transitions, sound
        self.breakaways = breakaways
        self._first = first.tolist()
        self._counts = np.bincount(run, minlength=sound.size)
        self._begin = np.cumsum(self._counts) - self._counts

    def runs_by_length(self) -> Iterator[Any]:
        """Yield the indices of the sound runs with as many samples each."""
        for count in np.unique(self._counts[self._sound]):
            yield np.flatnonzero(self._sound & (self._counts == count))

    def columns(self, runs: Any) -> Any:
        """Return the samples of runs with as many each, (width, n, runs)."""
        within = np.arange(self._counts[runs[0]])
        return self._rows[:, self._begin[runs] + within[:, None]]

    def transitions(self, run: int) -> list[Transition]:
        """Return the transitions of a run."""
        return self._transitions[self._first[run] : self._first[run + 1]]


def samples_of_runs(
    solver: "LockstepSolver", mechanism: "Mechanism", end: Any, at_events: Any
) -> SamplesOfRuns:
    """Return the samples of all runs of a solver.

    Parameters
    ----------
    solver : LockstepSolver
        That has run.
    mechanism : Mechanism
        Of all runs.
    end : (runs,), s
    at_events : (runs,) of bool
        Add samples at the events.
    """
    runs = np.arange(end.size)
    start_y = np.zeros_like(solver.y)
    start_y[0], start_y[1] = mechanism.position, mechanism.velocity
    start = _rows(mechanism, np.zeros_like(end), start_y, solver.start_mode)
    last = _rows(mechanism, end, solver.y, solver.mode)
    who, time, held, mode_from, mode_to, y = (
        np.concatenate(parts, axis=-1) for parts in zip(*solver.events, strict=True)
    )
    order = np.argsort(who, kind="stable")  # those of one run are in the order of time
    who, time, held, mode_from, mode_to = (x[order] for x in (who, time, held, mode_from, mode_to))
    y, at = y[:, order], selected(mechanism, who)
    after = _rows(at, time, y, mode_to)
    before = np.where(held >= 0.0, _rows(at, np.minimum(held, time), y, mode_from), after)
    before[TIME_COLUMN] = time
    sound = ~solver.given_back
    for columns, of in ((start, runs), (last, runs), (before, who), (after, who)):
        sound[of[~np.isfinite(columns).all(axis=0)]] = False
    kept = at_events[who]
    rows, run = with_events(
        start, last, (before[:, kept], after[:, kept], mode_from[kept]), who[kept]
    )
    transitions = _transitions(mechanism, who, (time, mode_from, mode_to, y[0]))
    first = np.searchsorted(who, np.arange(end.size + 1))
    leaves = mode_from == STICK
    breakaways = Breakaways(who[leaves], before[:, leaves], after[:, leaves])
    return SamplesOfRuns(rows, run, transitions, first, sound, breakaways)


def _transitions(mechanism: "Mechanism", who: Any, columns: Any) -> list[Transition]:
    assert mechanism.contact is not None  # of `joined_mechanism`
    name = mechanism.contact.name
    return [
        Transition(time, name, int(mode_from), int(mode_to), position)
        for time, mode_from, mode_to, position in zip(*(c.tolist() for c in columns), strict=True)
    ]


def _rows(mechanism: "Mechanism", t: Any, y: Any, mode: Any) -> Any:
    """Return the samples of states y at times t, (width, samples); `EventDrivenSolver.row`."""
    contact, drive, q, v = mechanism.contact, mechanism.drive, y[0], y[1]
    assert contact is not None  # of `joined_mechanism`
    u = drive(t)
    applied_torque = mechanism.applied_torque(u, q, v)
    sliding = -mode * contact.kinetic_limit(u, q, v, mode)
    friction = np.where(mode == STICK, -applied_torque, sliding)
    moving = (applied_torque + friction) / mechanism.inertia
    acceleration = np.where(mode == STICK, 0.0, moving)
    return np.stack(np.broadcast_arrays(t, u, q, v, acceleration, friction, mode, *y[2:]))


def with_events(start: Any, last: Any, events: Any, who: Any) -> tuple[Any, Any]:
    """Return the samples of all runs with those at events, and the run of each.

    As `samples_of` of one run: an event replaces a regular sample at its time, by
    its sticking side if there is one; of several at one time take the last that sticks, else the
    last.
    """
    before, after, mode_from = events
    holds = (before[MODE_COLUMN] == STICK) & (before[VELOCITY_COLUMN] == after[VELOCITY_COLUMN])
    at_events = np.where((mode_from == STICK) & holds, before, after)
    runs = np.arange(start.shape[1])
    rows = np.concatenate((start, at_events, last), axis=1)
    run = np.concatenate((runs, who, runs))
    is_event = np.repeat((False, True, False), (runs.size, who.size, runs.size))
    order = np.lexsort((is_event & (rows[MODE_COLUMN] == STICK), is_event, rows[TIME_COLUMN], run))
    rows, run = rows[:, order], run[order]
    later = (rows[TIME_COLUMN, 1:] != rows[TIME_COLUMN, :-1]) | (run[1:] != run[:-1])
    last_at_its_time = np.append(later, True)
    return rows[:, last_at_its_time], run[last_at_its_time]
