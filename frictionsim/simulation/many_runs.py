"""Many runs of one coordinate: quantities and audit of each.

A scenario with the numbers of many runs gives one mechanism with arrays. The runs are integrated
one after the other by compiled code, and observed together. Each has the bits of that of its
scenario alone with samples at the start, at the events and at the end only, or at given times.
Runs that fail or that do not pass the audit are left to be run alone, which says why.
"""

from collections.abc import Callable, Sequence
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
    drift,
    driving_power,
    energy_residual,
    friction_violation,
    release_distance,
)
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.run_warnings import SMALL_SHARE, nothing_moves, tiny_motion
from frictionsim.simulation.single_dof import (
    MODE_COLUMN,
    TIME_COLUMN,
    channels_of,
    energy_scale,
    filled,
    final_quantities,
    sticking_sides,
    trajectory_of,
)
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.compilation import form_of
from frictionsim.solvers.event_driven import SECONDS_OF_COMPILATION, compiled_for, kernel_of
from frictionsim.solvers.many_runs import Recorded, recorded
from frictionsim.solvers.mechanism import Mechanism, Trajectory, equation_of
from frictionsim.solvers.one_contact_state import EVENT_COLUMNS, ROW_COLUMNS, STOP_EVENT, Run
from frictionsim.solvers.problems import Problem, initial_states, run_of

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.solvers.compilation import Kernel

BACKEND = "events"


class RunForm(NamedTuple):
    """The kernel that runs of one form share, and the problem of one of them."""

    kernel: "Kernel"
    problem: Problem

    def compiled(self, monitor: RunMonitor) -> Any:
        """Return the compiled code, or None; a monitor is notified if that takes long."""
        if self.kernel.is_at_hand:
            return compiled_for(self.kernel, self.problem)
        with monitor.compiling(SECONDS_OF_COMPILATION):
            return compiled_for(self.kernel, self.problem)


def form_of_runs(scenario: "Scenario") -> RunForm | None:
    """Return the form of runs like that of a scenario; None if they have to be run alone."""
    build = getattr(mechanism_module(scenario.kind), "build", None)
    mechanism = None if build is None else build(scenario)
    if mechanism is None or not _goes_together(scenario, mechanism):
        return None
    problem = Problem(mechanism, scenario.solver, _sparse(scenario))
    kernel = kernel_of(problem)
    return None if kernel.reason else RunForm(kernel, problem)


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
    """Placeholder before the runs: a quantity that reads samples raises `Unlike`."""

    def __getattr__(self, name: str) -> NoReturn:
        raise Unlike


class Prepared(NamedTuple):
    """Runs of one form: their mechanism with arrays, and other data from their scenarios."""

    form: RunForm
    mechanism: Mechanism
    run: Run
    energy_limit: Any
    quantities: Quantities  # of the mechanism, with arrays
    warnings: tuple[str, ...] | None  # about each scenario; None if each has its own
    times: Any  # given ones of the samples, s; None without


def prepared(form: RunForm, scenario: "Scenario", times: Sequence[float] | None = None) -> Prepared:
    """Prepare the runs of a scenario with the numbers of many, if they have a form.

    The samples are at the given times, s, strictly increasing from the start to the end.

    Raises
    ------
    Unlike
        If they have not, or not all.
    """
    mechanism = mechanism_module(scenario.kind).build(scenario)
    if not _goes_together(scenario, mechanism):
        raise Unlike
    if form_of(mechanism.system) != form_of(form.problem.system):
        raise Unlike
    samples: Any = _NoSamples()
    buffer = _sparse(scenario)
    if times is not None:
        buffer.times.give(times)
    return Prepared(
        form,
        mechanism,
        run_of(mechanism, scenario.solver, buffer),
        allowed_residual(scenario.solver.rtol),
        mechanism.quantities(samples),
        _warnings(scenario),
        None if times is None else np.asarray(times, dtype=float),
    )


def _warnings(scenario: "Scenario") -> tuple[str, ...] | None:
    try:
        return tuple(scenario.warnings())
    except Unlike as unlike:
        if unlike.holds is not None:
            raise
        return None


class Observed(NamedTuple):
    """The results of many runs.

    Attributes
    ----------
    sound : (runs,) of bool
        Those that need not be run alone.
    quantities : Quantities
        An array (runs,), or one number that all have.
    warnings : dict
        All warnings of runs that have others than those of `Prepared`, by their numbers.
    channels : dict of (runs, n)
        At the given times; empty without. Undefined of runs that are not sound.
    event_runs, event_times : (m,)
        The run and the time, s, of each event: there a channel may jump.
    """

    sound: Any
    quantities: Quantities
    warnings: dict[int, tuple[str, ...]]
    channels: dict[str, Any]
    event_runs: Any
    event_times: Any


def run_many(
    runs: Prepared,
    count: int,
    scenario_of: "Callable[[int], Scenario]",
    monitor: RunMonitor,
) -> Observed | None:
    """Simulate many runs, with samples at the given times, or at start, events and end only.

    Parameters
    ----------
    runs : Prepared
    count : int
        Their number.
    scenario_of : callable
        Returns the scenario of one of them, by its number.
    monitor : RunMonitor
        Called between runs, or after many steps, with 0 s; it may raise Interrupted.

    Returns
    -------
    Observed or None
        None if all have to be run alone.
    """
    function = runs.form.compiled(monitor)
    if function is None:
        return None
    arguments = runs.mechanism.system, runs.run
    states = initial_states(runs.mechanism, count)
    recording = recorded(function, arguments, states, lambda: monitor(0.0))
    try:
        # A division by zero stops a run alone.
        with np.errstate(divide="raise", over="ignore", invalid="ignore", under="ignore"):
            return _observed(runs, recording, scenario_of)
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

    def slips_before(self, time: Any, sample_runs: Any) -> Any:
        """Return the number of events before each sample, of all runs, after which a run slips."""
        slips = self.mode_to != STICK
        time, run = np.append(time, self.time[slips]), np.append(sample_runs, self.run[slips])
        is_slip = np.arange(len(time)) >= len(sample_runs)
        order, numbers = np.lexsort((is_slip, time, run)), np.empty(len(time), dtype=int)
        numbers[order] = np.cumsum(is_slip[order])
        return numbers[: len(sample_runs)]


def _observed(
    runs: Prepared, recording: Recorded, scenario_of: "Callable[[int], Scenario]"
) -> Observed | None:
    count, sound = len(recording.done), recording.done.copy()
    sample_runs, event_runs = (
        np.repeat(np.arange(count), numbers) for numbers in recording.counts.T
    )
    sound[sample_runs[~np.isfinite(recording.rows).all(axis=1)]] = False
    sound[event_runs[~np.isfinite(recording.events).all(axis=1)]] = False
    if not sound.any():
        return None
    events = _Events(recording.events[sound[event_runs]], event_runs[sound[event_runs]])
    channels = {} if runs.times is None else _channels(runs, recording, sound)
    sample_runs, samples = sample_runs[sound[sample_runs]], recording.rows[sound[sample_runs]].T
    samples, sample_runs = with_events(samples, sample_runs, events)
    slips = events.slips_before(samples[TIME_COLUMN], sample_runs)
    numbers = np.bincount(sample_runs, minlength=count)
    begin = np.cumsum(numbers) - numbers
    sound &= _largest_distance(runs.mechanism, events, count) <= RELEASE_DISTANCE
    # In the order of those of one run.
    units = {name: quantity.unit for name, quantity in runs.quantities.items()}
    units |= {"breakaway_time": "s", "last_rest_time": "s"}
    values: dict[str, Any] = {name: quantity.value for name, quantity in runs.quantities.items()}
    values["breakaway_time"] = events.first(events.mode_from == STICK, count)
    values["last_rest_time"] = events.last(events.mode_to == STICK, count)
    warnings: dict[int, tuple[str, ...]] = {}
    for n in np.unique(numbers[sound]):
        chosen = np.flatnonzero(sound & (numbers == n))
        mechanism = selected(runs.mechanism, chosen)
        places = begin[chosen] + np.arange(n)[:, None]
        trajectory = trajectory_of(mechanism, samples[:, places], [])
        passes = _passes(runs, chosen, mechanism, trajectory)
        passes &= drift(trajectory.position, trajectory.mode == STICK, slips[places]) == 0.0
        sound[chosen] = passes
        hardly_moves = _moved(trajectory) * SMALL_SHARE <= _chosen(runs.run.atol, chosen)
        own = passes & (hardly_moves | (runs.warnings is None))
        for i in np.flatnonzero(own).tolist():
            number = int(chosen[i])
            warnings[number] = _warnings_of_one(scenario_of(number), trajectory, i)
        energies = trajectory.energy_integrals | trajectory.stored_energies
        last = final_quantities(
            trajectory.time[-1],
            trajectory.position[-1],
            trajectory.velocity[-1],
            mechanism.initial_energy,
            {name: energy[-1] for name, energy in energies.items()},
        )
        for name, quantity in last.items():
            units[name] = quantity.unit
            values.setdefault(name, np.full(count, np.nan))[chosen] = quantity.value
    quantities = {name: Quantity(values[name], units[name]) for name in values}
    return Observed(sound, quantities, warnings, channels, events.run, events.time)


def _channels(runs: Prepared, recording: Recorded, sound: Any) -> dict[str, Any]:
    """Return the channels at the given times, (runs, n); undefined of runs that are not sound."""
    # Of all runs: the functions of a mechanism have the numbers of all.
    rows = np.full((len(sound), len(runs.times), recording.rows.shape[1]), np.nan)
    rows[sound] = recording.rows[np.repeat(sound, recording.counts[:, 0])].reshape(
        -1, *rows.shape[1:]
    )
    trajectory = trajectory_of(runs.mechanism, rows.transpose(2, 1, 0), [])
    channels = channels_of(runs.mechanism, trajectory)
    channels |= trajectory.energy_integrals | trajectory.stored_energies
    return {name: filled(values, rows.shape[1::-1]).T for name, values in channels.items()}


def _passes(runs: Prepared, chosen: Any, mechanism: Mechanism, trajectory: Trajectory) -> Any:
    """Return which runs pass the audit, (runs,) of bool.

    The energy of another may close within the limit of all its steps, and the load jump past the
    limit of its friction: alone, that is looked at.
    """
    assert mechanism.contact is not None  # of `_goes_together`
    limit, atol = _chosen(runs.energy_limit, chosen), _chosen(runs.run.atol, chosen)
    residual = energy_residual(trajectory, limit, atol, energy_scale(mechanism, trajectory))
    return (
        (residual <= limit)
        & (friction_violation(trajectory, mechanism.contact) <= ROUNDING)
        & (driving_power(trajectory, atol) <= 0.0)
    )


def _moved(trajectory: Trajectory) -> Any:
    """Return the largest angle and speed of a motion, rad and rad/s, of each run, (runs,)."""
    fastest = np.max(np.abs(trajectory.velocity), axis=0)
    return np.maximum(np.ptp(trajectory.position, axis=0), fastest)


def _warnings_of_one(scenario: "Scenario", trajectory: Trajectory, i: int) -> tuple[str, ...]:
    """Return the warnings about the scenario and the samples of one of the runs."""
    mechanism = mechanism_module(scenario.kind).build(scenario)
    columns: list[Any] = [*trajectory[:ROW_COLUMNS]]
    run_trajectory = Trajectory(*[column[:, i] for column in columns], {}, {}, [])  # type: ignore[call-arg]
    if run_trajectory.time[-1] < scenario.solver.duration:  # no sample is at the end
        return tuple(scenario.warnings())
    return (
        *scenario.warnings(),
        *nothing_moves(mechanism, run_trajectory),
        *tiny_motion(run_trajectory, scenario.solver.atol * mechanism.tolerance_share),
    )


def _largest_distance(mechanism: Mechanism, events: _Events, count: int) -> Any:
    """Return the largest distance of a breakaway from its static limit, (runs,)."""
    leaves = (events.mode_from == STICK) & (events.mode_to != STICK) & (events.name != STOP_EVENT)
    run = events.run[leaves]
    selection = selected(mechanism, run)
    sides = (
        trajectory_of(selection, side[:, leaves], []) for side in (events.before, events.after)
    )
    largest = np.zeros(count)
    np.maximum.at(largest, run, release_distance(selection, *sides))
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


def with_events(samples: Any, sample_runs: Any, events: _Events) -> tuple[Any, Any]:
    """Return the samples of all runs with those at events, (columns, n), and the run of each.

    As of one run: an event replaces a regular sample at its time, by its sticking side if there is
    one; of several at one time take the last that sticks, else the last.
    """
    at_events = sticking_sides(events.before, events.after, events.mode_from == STICK)
    rows, run = np.concatenate((samples, at_events), axis=1), np.append(sample_runs, events.run)
    is_event = np.repeat((False, True), (len(sample_runs), len(events.run)))
    order = np.lexsort((is_event & (rows[MODE_COLUMN] == STICK), is_event, rows[TIME_COLUMN], run))
    rows, run = rows[:, order], run[order]
    later = (rows[TIME_COLUMN, 1:] != rows[TIME_COLUMN, :-1]) | (run[1:] != run[:-1])
    last_at_its_time = np.append(later, True)
    return rows[:, last_at_its_time], run[last_at_its_time]
