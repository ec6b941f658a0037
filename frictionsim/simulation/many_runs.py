"""Many runs of one coordinate: quantities and audit of each.

A scenario with the numbers of many runs gives one mechanism with arrays. The runs are integrated
one after the other by compiled code, and observed together. Each has the bits of that of its
scenario alone with samples at the start, at the events and at the end only. Runs that fail, that
do not move or that do not pass the audit are left to be run alone, which says why.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from frictionsim.results import STICK, Quantities, Quantity
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.scenario.run_numbers import Unlike
from frictionsim.simulation.audit import (
    RELEASE_DISTANCE,
    ROUNDING,
    allowed_residual,
    driving_power,
    energy_residual,
    friction_violation,
    release_distance,
)
from frictionsim.simulation.single_dof import (
    MODE_COLUMN,
    TIME_COLUMN,
    VELOCITY_COLUMN,
    energy_scale,
    final_quantities,
    trajectory_of,
)
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.compilation import form_of
from frictionsim.solvers.event_driven import compiled_for, kernel_of
from frictionsim.solvers.many_runs import Recorded, recorded
from frictionsim.solvers.mechanism import Mechanism, Trajectory, equation_of
from frictionsim.solvers.one_contact_state import EVENT_COLUMNS, OF_STOP, Run
from frictionsim.solvers.problems import Problem, initial_states, run_of

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

BACKEND = "events"


def problem_like(scenario: "Scenario") -> Problem | None:
    """Return the problem of runs like that of a scenario; None if they have to be run alone."""
    build = getattr(mechanism_module(scenario.kind), "build", None)
    mechanism = None if build is None else build(scenario)
    if not _goes_together(scenario, mechanism):
        return None
    problem = Problem(mechanism, scenario.solver, _sparse(scenario))
    return None if kernel_of(problem).reason else problem


def _goes_together(scenario: "Scenario", mechanism: Any) -> bool:
    # One of several coordinates is no `Mechanism`.
    if not isinstance(mechanism, Mechanism) or mechanism.contact is None:
        return False
    return (
        scenario.solver.backend == BACKEND
        and mechanism.system is not None
        and mechanism.contact.law == SET_VALUED
        and not mechanism.prescribed
        and mechanism.stops is None
        and mechanism.run_warnings is Mechanism._field_defaults["run_warnings"]
    )


def _sparse(scenario: "Scenario") -> SampleBuffer:
    """Return a buffer for samples at start and end."""
    times = SampleTimes(scenario.solver.duration, interval=scenario.solver.duration)
    return SampleBuffer(times)


class _NoSamples:
    """The samples of runs that are not done yet: quantities that follow from them are of one."""

    def __getattr__(self, name: str) -> NoReturn:
        raise Unlike


class Prepared(NamedTuple):
    """Runs that go together: their mechanism with arrays, and what else follows from scenarios."""

    like: Problem
    mechanism: Mechanism
    run: Run
    energy_limit: Any
    quantities: Quantities  # of the mechanism, with arrays
    warnings: tuple[str, ...]  # the same about each scenario


def prepared(like: Problem, scenario: "Scenario") -> Prepared:
    """Prepare the runs of a scenario with the numbers of many, if they are like another one.

    Raises
    ------
    Unlike
        If they are not, or not all.
    """
    mechanism = mechanism_module(scenario.kind).build(scenario)
    if not _goes_together(scenario, mechanism):
        raise Unlike
    if form_of(mechanism.system) != form_of(like.system):
        raise Unlike
    samples: Any = _NoSamples()
    return Prepared(
        like,
        mechanism,
        run_of(mechanism, scenario.solver, _sparse(scenario)),
        allowed_residual(scenario.solver.rtol),
        mechanism.quantities(samples),
        tuple(scenario.warnings()),
    )


class Observed(NamedTuple):
    """The runs that need not be run alone, (runs,) of bool, and their quantities, (runs,) each."""

    sound: Any
    quantities: Quantities


def run_many(runs: Prepared, count: int, on_call: Callable[[], object]) -> Observed | None:
    """Simulate many runs, with samples at start, events and end only.

    Parameters
    ----------
    runs : Prepared
    count : int
        Their number.
    on_call : callable
        Called between runs, or after many steps; it may raise Interrupted.

    Returns
    -------
    Observed or None
        None if all have to be run alone.
    """
    function = compiled_for(kernel_of(runs.like), runs.like)
    if function is None:
        return None
    arguments = runs.mechanism.system, runs.run
    found = recorded(function, arguments, initial_states(runs.mechanism, count), on_call)
    try:
        # A division by zero stops a run alone.
        with np.errstate(divide="raise", over="ignore", invalid="ignore", under="ignore"):
            return _observed(runs, found)
    except ArithmeticError:
        return None


class _Events:
    """The events of runs, those of each in the order of time."""

    def __init__(self, events: Any, run: Any) -> None:
        width = (events.shape[1] - EVENT_COLUMNS) // 2
        # A step records the event at its end before a rest within it.
        order = np.lexsort((events[:, EVENT_COLUMNS + width + TIME_COLUMN], run))
        self.run, events = run[order], events[order].T
        self.name, self.time, self.mode_from, self.mode_to, _ = events[:EVENT_COLUMNS]
        self.before = events[EVENT_COLUMNS : EVENT_COLUMNS + width]
        self.after = events[EVENT_COLUMNS + width :]

    def first(self, chosen: Any, runs: int) -> Any:
        """Return the time of the first of some events of each run, (runs,); nan without one."""
        times = np.full(runs, np.nan)
        times[self.run[chosen][::-1]] = self.time[chosen][::-1]
        return times

    def last(self, chosen: Any, runs: int) -> Any:
        """Return the time of the last of some events of each run, (runs,); nan without one."""
        times = np.full(runs, np.nan)
        times[self.run[chosen]] = self.time[chosen]
        return times


def _observed(runs: Prepared, found: Recorded) -> Observed:
    count, sound = len(found.done), found.done.copy()
    of_samples, of_events = (np.repeat(np.arange(count), numbers) for numbers in found.counts.T)
    sound[of_samples[~np.isfinite(found.rows).all(axis=1)]] = False
    sound[of_events[~np.isfinite(found.events).all(axis=1)]] = False
    events = _Events(found.events[sound[of_events]], of_events[sound[of_events]])
    of_samples, samples = of_samples[sound[of_samples]], found.rows[sound[of_samples]].T
    samples, of_samples = with_events(samples, of_samples, events)
    numbers = np.bincount(of_samples, minlength=count)
    begin = np.cumsum(numbers) - numbers
    sound &= _largest_distance(runs.mechanism, events, count) <= RELEASE_DISTANCE
    quantities = runs.quantities | {
        "breakaway_time": Quantity(events.first(events.mode_from == STICK, count), "s"),
        "last_rest_time": Quantity(events.last(events.mode_to == STICK, count), "s"),
    }
    for n in np.unique(numbers[sound]):
        chosen = np.flatnonzero(sound & (numbers == n))
        mechanism = selected(runs.mechanism, chosen)
        columns = samples[:, begin[chosen] + np.arange(n)[:, None]]
        trajectory = trajectory_of(mechanism, columns, [])
        sound[chosen] = _passes(runs, chosen, mechanism, trajectory)
        energies = trajectory.energy_integrals | trajectory.stored_energies
        last = final_quantities(
            trajectory.time[-1],
            trajectory.position[-1],
            trajectory.velocity[-1],
            {name: energy[-1] for name, energy in energies.items()},
        )
        for name, quantity in last.items():
            empty = Quantity(np.full(count, np.nan), quantity.unit)
            quantities.setdefault(name, empty).value[chosen] = quantity.value
    return Observed(sound, quantities)


def _passes(runs: Prepared, chosen: Any, mechanism: Mechanism, trajectory: Trajectory) -> Any:
    """Return which runs move and pass the audit, (runs,) of bool.

    The energy of one that does not may close within the limit of all its steps, and its position
    drift between samples that stick, if it slips between them; alone, that is looked at.
    """
    assert mechanism.contact is not None  # of `_goes_together`
    limit, atol = _chosen(runs.energy_limit, chosen), _chosen(runs.run.atol, chosen)
    residual = energy_residual(trajectory, limit, atol, energy_scale(mechanism, trajectory))
    sticks = (trajectory.mode[1:] == STICK) & (trajectory.mode[:-1] == STICK)
    moves = np.diff(trajectory.position, axis=0) != 0.0
    return (
        (residual <= limit)
        & (friction_violation(trajectory, mechanism.contact) <= ROUNDING)
        & (driving_power(trajectory) <= 0.0)
        & ~(sticks & moves).any(axis=0)
        & (moves.any(axis=0) | (trajectory.velocity != 0.0).any(axis=0))
    )


def _largest_distance(mechanism: Mechanism, events: _Events, count: int) -> Any:
    """Return the largest distance of a breakaway from its static limit, (runs,)."""
    leaves = (events.mode_from == STICK) & (events.mode_to != STICK) & (events.name != OF_STOP)
    run = events.run[leaves]
    of_each = selected(mechanism, run)
    sides = (trajectory_of(of_each, side[:, leaves], []) for side in (events.before, events.after))
    largest = np.zeros(count)
    np.maximum.at(largest, run, release_distance(of_each, *sides))
    return largest


def _chosen(value: Any, runs: Any) -> Any:
    """Return the numbers of some of the runs, of a mechanism or of one number."""
    if isinstance(value, tuple):
        parts = [_chosen(inner, runs) for inner in value]
        return tuple(parts) if type(value) is tuple else type(value)(*parts)
    return np.asarray(value)[runs] if isinstance(value, np.ndarray) else value


def selected(mechanism: Mechanism, runs: Any) -> Mechanism:
    """Return the mechanism of some of the runs, by their indices."""
    system, contact = _chosen(mechanism.system, runs), mechanism.contact
    assert contact is not None  # of `_goes_together`
    limits = {
        name: getattr(system, name)
        for name in ("static_limit", "kinetic_limit", "roundoff", "first_excess")
    }
    return mechanism._replace(
        **equation_of(system, tuple(mechanism.power_flows), tuple(mechanism.stored_energies)),
        contact=contact._replace(**limits),
        position=_chosen(mechanism.position, runs),
        velocity=_chosen(mechanism.velocity, runs),
    )


def with_events(samples: Any, of_samples: Any, events: _Events) -> tuple[Any, Any]:
    """Return the samples of all runs with those at events, (columns, n), and the run of each.

    As `samples_of` of one run: an event replaces a regular sample at its time, by
    its sticking side if there is one; of several at one time take the last that sticks, else the
    last.
    """
    before, after = events.before, events.after
    holds = (before[MODE_COLUMN] == STICK) & (before[VELOCITY_COLUMN] == after[VELOCITY_COLUMN])
    at_events = np.where((events.mode_from == STICK) & holds, before, after)
    rows, run = np.concatenate((samples, at_events), axis=1), np.append(of_samples, events.run)
    is_event = np.repeat((False, True), (len(of_samples), len(events.run)))
    order = np.lexsort((is_event & (rows[MODE_COLUMN] == STICK), is_event, rows[TIME_COLUMN], run))
    rows, run = rows[:, order], run[order]
    later = (rows[TIME_COLUMN, 1:] != rows[TIME_COLUMN, :-1]) | (run[1:] != run[:-1])
    last_at_its_time = np.append(later, True)
    return rows[:, last_at_its_time], run[last_at_its_time]
