"""Many runs of one coordinate: quantities, audit, events and warnings of each.

They are integrated one after the other by compiled code, and observed together, as arrays. Each
result has the bits of that of its scenario alone with samples at the start, at the events and at
the end only. A run that fails, or is unlike the others, is given back to be run alone.
"""

import gc
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import STICK, Check, Quantities, SimulationResult, Transition
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.simulation.audit import (
    RELEASE_DISTANCE,
    ROUNDING,
    allowed_residual,
    driving_power,
    energy_residual,
    friction_violation,
    leaves_stick,
    release_distance,
    stick_drift,
)
from frictionsim.simulation.run_warnings import hidden_stick_slip, nothing_moves
from frictionsim.simulation.single_dof import (
    MODE_COLUMN,
    TIME_COLUMN,
    VELOCITY_COLUMN,
    energy_scale,
    final_quantities,
    quantities_of_transitions,
    trajectory_of,
)
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.compilation import form_of
from frictionsim.solvers.event_driven import CompiledRuns, kernel_of
from frictionsim.solvers.mechanism import Mechanism, Trajectory, equation_of
from frictionsim.solvers.one_contact_state import EVENT_COLUMNS
from frictionsim.solvers.problems import Problem, event_names

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.solvers.compilation import Kernel

BACKEND = "events"
BATCH = 2000  # runs that are observed together; more take as long each


class Unlike(Exception):
    """Two runs differ in more than numbers."""


class _OfEachRun:
    """An array that differs between runs; if an equation reads it, runs are observed alone."""

    def __len__(self) -> int:
        raise Unlike

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise Unlike


def kernel_for(scenario: "Scenario") -> "Kernel | None":
    """Return the kernel for runs like that of a scenario; None if they have to be run alone."""
    build = getattr(mechanism_module(scenario.kind), "build", None)
    mechanism = None if build is None else build(scenario)
    # One of several coordinates is no `Mechanism`.
    if not isinstance(mechanism, Mechanism) or not _goes_together(scenario, mechanism):
        return None
    kernel = kernel_of(_problem(scenario, mechanism))
    return None if kernel.reason else kernel


def _goes_together(scenario: "Scenario", mechanism: Mechanism) -> bool:
    contact = mechanism.contact
    return (
        scenario.solver.backend == BACKEND
        and mechanism.system is not None
        and contact is not None
        and contact.law == SET_VALUED
        and not mechanism.prescribed
        and mechanism.stops is None
    )


def _problem(scenario: "Scenario", mechanism: Mechanism) -> Problem:
    times = SampleTimes(scenario.solver.duration, interval=scenario.solver.duration)
    return Problem(mechanism, scenario.solver, SampleBuffer(times))


def run_many(
    scenarios: "Sequence[Scenario]", on_run: Callable[[], object] = lambda: None
) -> list[SimulationResult | None]:
    """Simulate many scenarios of one kind, with samples at start, events and end only.

    Parameters
    ----------
    scenarios : sequence of Scenario
    on_run : callable, optional
        Called between runs; it may raise Interrupted.

    Returns
    -------
    list of SimulationResult or None
        Quantities, checks, transitions and warnings of each run, without channels; None where the
        run has to be done alone, because it fails or is unlike the first.
    """
    found: list[SimulationResult | None] = []
    with no_search_for_cycles():
        for first in range(0, len(scenarios), BATCH):
            found += _run_batch(scenarios[first : first + BATCH], on_run)
    return found


@contextmanager
def no_search_for_cycles() -> Iterator[None]:
    """Make thousands of small objects, none of them in a cycle, without a search for cycles."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def _run_batch(
    scenarios: "Sequence[Scenario]", on_run: Callable[[], object]
) -> list[SimulationResult | None]:
    found: list[SimulationResult | None] = [None] * len(scenarios)
    runs = _recorded(scenarios, on_run)
    if not runs:
        return found
    try:
        # A division by zero stops a run alone.
        with np.errstate(divide="raise", over="ignore", invalid="ignore", under="ignore"):
            for number, result in _Batch(runs).results():
                found[number] = result
    except (Unlike, ArithmeticError):
        pass  # the others run alone
    return found


class _Recorded(NamedTuple):
    """A run that has come to its end: its number, and its samples and events."""

    number: int
    scenario: "Scenario"
    mechanism: Mechanism
    rows: "array[float]"
    events: "array[float]"


def _recorded(scenarios: "Sequence[Scenario]", on_run: Callable[[], object]) -> list[_Recorded]:
    """Return the runs that are like the first and come to their end."""
    build, found, form = mechanism_module(scenarios[0].kind).build, [], ""
    runs: CompiledRuns | None = None
    for number, scenario in enumerate(scenarios):
        mechanism = build(scenario)
        if not isinstance(mechanism, Mechanism) or not _goes_together(scenario, mechanism):
            continue
        problem = _problem(scenario, mechanism)
        if runs is None:
            kernel, form = kernel_of(problem), form_of(mechanism.system)
            if kernel.reason:
                break
            runs = CompiledRuns(kernel, on_run)
        if form_of(mechanism.system) == form and (recorded := runs.recorded(problem)):
            found.append(_Recorded(number, scenario, mechanism, *recorded))
    return found


class _Batch:
    """Runs that are observed together."""

    def __init__(self, runs: list[_Recorded]) -> None:
        self._runs = runs
        self._joined = joined_mechanism([run.mechanism for run in runs])
        width = SampleBuffer.COLUMNS + len(runs[0].mechanism.energy_integrals)
        rows = _numbers([run.rows for run in runs]).reshape(len(runs), 2, width)
        events = _numbers([run.events for run in runs]).reshape(-1, EVENT_COLUMNS + 2 * width)
        counts = [len(run.events) // events.shape[1] for run in runs]
        who = np.repeat(np.arange(len(runs)), counts)
        before = events[:, EVENT_COLUMNS : EVENT_COLUMNS + width]
        after = events[:, EVENT_COLUMNS + width :]
        # A step records the event at its end before a rest within it.
        order = np.lexsort((after[:, TIME_COLUMN], who))
        who, events, before, after = who[order], events[order], before[order], after[order]
        self._sound = np.isfinite(rows).all(axis=(1, 2))
        self._sound[who[~np.isfinite(events).all(axis=1)]] = False
        self._first = np.searchsorted(who, np.arange(len(runs) + 1)).tolist()
        names = event_names(runs[0].mechanism)
        self._transitions = [
            Transition(time, names[int(name)], int(mode_from), int(mode_to), position)
            for name, time, mode_from, mode_to, position in events[:, :EVENT_COLUMNS].tolist()
        ]
        at_events = np.array([run.scenario.output.at_events for run in runs], dtype=bool)[who]
        kept = before.T[:, at_events], after.T[:, at_events], events[at_events, 2]
        self._rows, run = with_events(rows[:, 0].T, rows[:, 1].T, kept, who[at_events])
        self._counts = np.bincount(run, minlength=len(runs))
        self._begin = np.cumsum(self._counts) - self._counts
        leaves = np.array([leaves_stick(event) for event in self._transitions], dtype=bool)
        self._released = self._largest_distance(who[leaves], before[leaves].T, after[leaves].T)

    def _largest_distance(self, who: Any, before: Any, after: Any) -> Any:
        """Return the largest distance of a breakaway from its static limit, (runs,)."""
        mechanism = selected(self._joined, who)
        sides = (trajectory_of(mechanism, columns, []) for columns in (before, after))
        largest = np.zeros(len(self._runs))
        np.maximum.at(largest, who, release_distance(mechanism, *sides))
        return largest

    def results(self) -> Iterator[tuple[int, SimulationResult]]:
        """Yield the number and result of each run that need not be done alone."""
        for count in np.unique(self._counts[self._sound]):
            yield from self._observe(np.flatnonzero(self._sound & (self._counts == count)))

    def _observe(self, runs: Any) -> Iterator[tuple[int, SimulationResult]]:
        """Yield the results of runs with as many samples each, as `SingleDofSimulation.observe`.

        One whose energy does not close, or that leaves stick off its static limit, is left out.
        """
        mechanism = selected(self._joined, runs)
        columns = self._rows[:, self._begin[runs] + np.arange(self._counts[runs[0]])[:, None]]
        trajectory = trajectory_of(mechanism, columns, [])
        settings = [self._runs[run].scenario.solver for run in runs]
        checks = _checks(mechanism, trajectory, settings)
        sticks = (trajectory.mode[1:] == 0) & (trajectory.mode[:-1] == 0)
        may_drift = np.any(sticks & (np.diff(trajectory.position, axis=0) != 0.0), axis=0)
        rests = ~np.any(trajectory.velocity, axis=0) & ~(np.ptp(trajectory.position, axis=0) > 0.0)
        of_one = _split(trajectory)
        for i, run in enumerate(runs.tolist()):
            found, released = checks(i), Check(self._released.item(run), RELEASE_DISTANCE)
            if not (found["energy_balance"].ok and released.ok):
                continue  # alone, its limit is one of all its steps, and the load may jump
            alone = of_one(i, self._transitions[self._first[run] : self._first[run + 1]])
            drift = stick_drift(alone) if may_drift[i] else 0.0
            yield (
                self._runs[run].number,
                SimulationResult(
                    time=alone.time,
                    channels={},
                    transitions=alone.transitions,
                    quantities=_quantities(self._runs[run].mechanism, alone),
                    checks=found | {"stick_drift": Check(drift, 0.0), "release": released},
                    non_finite_tail=False,
                    warnings=self._warnings(self._runs[run], alone, bool(rests[i])),
                ),
            )

    def _warnings(self, run: _Recorded, trajectory: Trajectory, rests: bool) -> tuple[str, ...]:
        mechanism, scenario = run.mechanism, run.scenario
        return (
            *(nothing_moves(mechanism, trajectory) if rests else ()),
            *mechanism.run_warnings(trajectory),
            *hidden_stick_slip(trajectory.transitions, scenario.interval, scenario.solver.duration),
        )


def _numbers(parts: "Sequence[array[float]]") -> Any:
    return np.frombuffer(b"".join(part.tobytes() for part in parts))


def joined_mechanism(mechanisms: Sequence[Mechanism]) -> Mechanism:
    """Return a mechanism whose numbers are arrays, (runs,)."""
    system = joined([mechanism.system for mechanism in mechanisms])
    start: dict[str, Any] = {
        name: np.array([getattr(mechanism, name) for mechanism in mechanisms])
        for name in ("position", "velocity")
    }
    return _with_system(mechanisms[0], system)._replace(**start)


def _with_system(mechanism: Mechanism, system: Any) -> Mechanism:
    contact = mechanism.contact
    assert contact is not None  # of `_goes_together`
    names = "static_limit", "kinetic_limit", "roundoff", "first_excess"
    limits = {name: getattr(system, name) for name in names}
    flows, stored = tuple(mechanism.power_flows), tuple(mechanism.stored_energies)
    return mechanism._replace(
        **equation_of(system, flows, stored), contact=contact._replace(**limits)
    )


def joined(values: Sequence[Any]) -> Any:
    """Return the numbers of many runs as one array in the place of each."""
    first = values[0]
    if isinstance(first, tuple):
        parts = [joined(column) for column in zip(*values, strict=True)]
        return tuple(parts) if type(first) is tuple else type(first)(*parts)
    if isinstance(first, float):
        return np.array(values)
    if all(value == first for value in values):
        return first
    if isinstance(first, array):
        return _OfEachRun()
    raise Unlike


def selected(mechanism: Mechanism, runs: Any) -> Mechanism:
    """Return the joined mechanism of some of the runs, by their indices."""

    def chosen(value: Any) -> Any:
        if isinstance(value, tuple):
            parts = map(chosen, value)
            return tuple(parts) if type(value) is tuple else type(value)(*parts)
        return value[runs] if isinstance(value, np.ndarray) else value

    position: Any = mechanism.position
    velocity: Any = mechanism.velocity
    start = {"position": position[runs], "velocity": velocity[runs]}
    return _with_system(mechanism, chosen(mechanism.system))._replace(**start)


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


def _split(trajectory: Trajectory) -> Any:
    """Return a function of index and transitions that returns the trajectory of one run."""
    integrals, stored = list(trajectory.energy_integrals), list(trajectory.stored_energies)
    columns: list[Any] = [
        *trajectory[: Trajectory._fields.index("energy_integrals")],
        *trajectory.energy_integrals.values(),
        *trajectory.stored_energies.values(),
    ]
    by_run = np.stack(columns).transpose(2, 0, 1).copy()  # (runs, columns, n)

    def of_one(run: int, transitions: list[Transition]) -> Trajectory:
        time, drive, position, velocity, acceleration, friction, mode, *energies = by_run[run]
        return Trajectory(
            time,
            drive,
            position,
            velocity,
            acceleration,
            friction,
            mode,
            dict(zip(integrals, energies[: len(integrals)], strict=True)),
            dict(zip(stored, energies[len(integrals) :], strict=True)),
            transitions,
        )

    return of_one


def _checks(mechanism: Mechanism, trajectory: Trajectory, settings: Sequence[Any]) -> Any:
    """Return a function of the index of a run that returns its checks, without the drift."""
    assert mechanism.contact is not None  # of `_goes_together`
    limits = [allowed_residual(one.rtol) for one in settings]
    size, atol = energy_scale(mechanism, trajectory), np.array([one.atol for one in settings])
    energy = energy_residual(trajectory, np.array(limits), atol, size).tolist()
    friction = friction_violation(trajectory, mechanism.contact).tolist()
    power = driving_power(trajectory).tolist()
    return lambda i: {
        "energy_balance": Check(energy[i], limits[i]),
        "friction_law": Check(friction[i], ROUNDING),
        "dissipation_sign": Check(power[i], 0.0),
    }


def _quantities(mechanism: Mechanism, trajectory: Trajectory) -> Quantities:
    energies = trajectory.energy_integrals | trajectory.stored_energies
    return (
        mechanism.quantities(trajectory)
        | quantities_of_transitions(trajectory.transitions)
        | final_quantities(
            trajectory.time.item(-1),
            trajectory.position.item(-1),
            trajectory.velocity.item(-1),
            float(mechanism.initial_energy),
            {name: energy.item(-1) for name, energy in energies.items()},
        )
    )
