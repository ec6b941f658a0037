"""The simulation of a mechanism of one coordinate, and its results."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import STICK, Check, Quantities, Quantity, SimulationResult, Transition
from frictionsim.scenario import methods
from frictionsim.simulation.audit import allowed_residual, audit, leaves_stick, release_check
from frictionsim.simulation.checkpoint import (
    Arrays,
    dump_part,
    load_part,
    require_array,
    unfit,
)
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.run_warnings import hidden_stick_slip, nothing_moves, tiny_motion
from frictionsim.solvers import new_solver
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.end_stops import EVENT
from frictionsim.solvers.mechanism import Mechanism, Trajectory
from frictionsim.solvers.one_contact_state import ROW_COLUMNS
from frictionsim.solvers.problems import event_names

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


# Channels that /events holds as `angle`, `mode_from` and `mode_to`, not as sides.
EVENT_CHANNELS = ("angle", "mode")
TIME_COLUMN, VELOCITY_COLUMN, MODE_COLUMN = 0, 3, 6  # of a row of `SampleBuffer`


class Samples(NamedTuple):
    """The finite samples of a run.

    Attributes
    ----------
    rows : (n, width)
        The samples, at strictly increasing times.
    transitions : list of Transition
        In the order of time.
    before, after : (m, width)
        Samples immediately before and after each transition.
    non_finite_tail : bool
        A sample was not finite; it and all later ones were removed.
    """

    rows: Any
    transitions: list[Transition]
    before: Any
    after: Any
    non_finite_tail: bool


def samples_of(buffer: "SampleBuffer", width: int) -> Samples:
    """Return the finite samples of a run; `width` is the number of columns of a sample."""
    rows = np.array(buffer.rows).reshape(-1, width)
    sides = np.array(buffer.sides).reshape(-1, 2, width)
    # A step records the event at its end before a stop within it.
    order = np.argsort(sides[:, 1, TIME_COLUMN], kind="stable")
    sides, transitions = sides[order], [buffer.transitions[i] for i in order]
    finite, events_finite = np.isfinite(rows).all(axis=1), np.isfinite(sides).all(axis=(1, 2))
    times, event_times = rows[:, TIME_COLUMN], sides[:, 1, TIME_COLUMN]
    ends = times[~finite], event_times[~events_finite]
    end = np.min(np.nan_to_num(np.concatenate(ends), nan=-np.inf), initial=np.inf)
    non_finite_tail = not (finite.all() and events_finite.all())
    rows = rows[: np.argmin(finite)] if not finite.all() else rows
    kept = events_finite & (event_times < end)
    sides, transitions = sides[kept], [e for e, keep in zip(transitions, kept, strict=True) if keep]
    return Samples(rows, transitions, sides[:, 0], sides[:, 1], non_finite_tail)


def _merged(rows: Any, at_events: Any) -> Any:
    """Return the regular samples and those of events, which replace regular ones at their times."""
    time = at_events[:, TIME_COLUMN]
    last = np.append(time[1:] != time[:-1], True)
    time, at_events = time[last], at_events[last]
    replaced = np.isin(rows[:, TIME_COLUMN], time)
    regular = rows[~replaced] if replaced.any() else rows
    return np.insert(regular, np.searchsorted(regular[:, TIME_COLUMN], time), at_events, 0)


class RecordedSimulation:
    """The parts of a `Simulation` that go by the samples and transitions which its solver records.

    Parameters
    ----------
    scenario : Scenario
    mechanism : Mechanism or MultiContactMechanism
        Built from the scenario.
    solver : callable
        Returns the solver for a buffer.
    width : int
        Number of columns of a sample.
    """

    mode_columns = slice(MODE_COLUMN, MODE_COLUMN + 1)

    def __init__(
        self,
        scenario: "Scenario",
        mechanism: Any,
        solver: "Callable[[SampleBuffer], Any]",
        width: int,
    ) -> None:
        self._mechanism, self._settings = mechanism, scenario.solver
        self.effects, self.channel_info = mechanism.effects, mechanism.channel_info
        self.states = len(mechanism.initial_state)
        self._at_events, self._interval = scenario.output.at_events, scenario.interval
        self._resumable = methods.METHODS[scenario.solver.backend].resumable
        self._recording = SampleBuffer(SampleTimes(scenario.solver.duration, scenario.interval))
        self._solver: Any = solver(self._recording)
        self._width = width
        self.axes: Mapping[str, tuple[str, ...]] = {}

    def sample_at(self, times: Sequence[float]) -> None:
        """Take samples at these times, s, instead of the regular ones; before `solve`."""
        self._recording.times.give(times)

    def prepare(self, monitor: RunMonitor) -> float:
        """Compile the rest of a long run if that pays; return how long it took, s."""
        return (self.compile(monitor) or 0.0) if self._solver.is_to_be_compiled else 0.0

    def compile(self, monitor: RunMonitor) -> float | None:
        """Compile the loop of the run; None for a method that is Python alone."""
        started, expected = perf_counter(), self._solver.compile_seconds
        if expected is None:
            return None
        with monitor.compiling(expected) if expected else nullcontext():
            self._solver.compile()
        return perf_counter() - started if expected else 0.0

    def solve(self, on_step: Callable[[float], Any]) -> bool:
        """Integrate to the end with the backend of the scenario; see `Simulation.solve`."""
        return self._solver.run(on_step)

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""
        stepper = self._solver.stepper
        return stepper.steps, stepper.rejected, stepper.nfev

    def state(self) -> Arrays | None:
        """Return the state to resume from; None for SciPy's integrators, whose state is private."""
        if not self._resumable:
            return None
        parts = self._solver.checkpoint_parts
        state = {k: v for name, part in parts.items() for k, v in dump_part(part, name).items()}
        transitions = self._recording.transitions
        state["transitions.contact"] = np.array([e.contact for e in transitions], dtype=np.bytes_)
        state["transitions"] = np.array(
            [(e.time, e.mode_from, e.mode_to, e.position) for e in transitions], dtype=np.float64
        ).reshape(-1, 4)
        return state

    def restore(self, state: Arrays) -> None:
        """Load the state of another simulation of the same scenario."""
        for name, part in self._solver.checkpoint_parts.items():
            load_part(part, name, state)
        self._recording.transitions[:] = self._transitions(state)
        self._check_samples()

    def _transitions(self, state: Arrays) -> list[Transition]:
        """Return the transitions of a state."""
        contacts = require_array(state, "transitions.contact", np.bytes_, ndim=1).tolist()
        rows = require_array(state, "transitions", np.float64, ndim=2)
        if rows.shape != (len(contacts), 4):  # time, modes before and after it, position
            raise unfit("transitions", "is of another type or shape")
        known = {name.encode(): name for name in event_names(self._mechanism) if name}
        if not known.keys() >= set(contacts):
            raise unfit("transitions.contact", "names no contact of it")
        return [
            Transition(time, known[contact], int(mode_from), int(mode_to), position)
            for contact, (time, mode_from, mode_to, position) in zip(
                contacts, rows.tolist(), strict=True
            )
        ]

    def _check_samples(self) -> None:
        """Check the number of the restored samples."""
        recording = self._recording
        sides = 2 * len(recording.transitions)
        for name, rows in (("rows", recording.times.count), ("sides", sides)):
            if len(getattr(recording, name)) != rows * self._width:
                raise unfit(f"buffer.{name}", "is of another type or shape")

    def trajectory(self) -> Any:
        """Return the samples before the first non-finite one."""
        return self._trajectory_of_samples(self._samples())

    def _samples(self) -> Samples:
        samples = samples_of(self._recording, self._width)
        if not (self._at_events and samples.transitions):
            return samples
        breaks_away = np.array([e.mode_from == STICK for e in samples.transitions])
        at_events = self._sides_at_events(samples.before, samples.after, breaks_away)
        return samples._replace(rows=_merged(samples.rows, at_events))

    def _sides_at_events(self, before: Any, after: Any, breaks_away: Any) -> Any:
        """Return one sample for each event: the side before a breakaway, else the side after it.

        Of several events at one time the last is taken.
        """
        return np.where(breaks_away[:, None], before, after)

    def _trajectory_of_samples(self, samples: Samples) -> Any:
        return self._trajectory_of(samples.rows, samples.transitions)

    def _trajectory_of(self, rows: Any, transitions: list[Transition]) -> Any:
        """Return the trajectory of rows (n, width)."""
        raise NotImplementedError

    def observe(self) -> SimulationResult:
        """Return the finite samples, and quantities, checks and warnings from them."""
        samples = self._samples()
        trajectory = self._trajectory_of_samples(samples)
        energies = trajectory.energy_integrals | trajectory.stored_energies
        return SimulationResult(
            time=trajectory.time,
            channels=self._full(self._channels(trajectory) | energies, trajectory),
            transitions=trajectory.transitions,
            quantities=self._quantities(trajectory, energies),
            checks=self._checks(trajectory, samples),
            non_finite_tail=samples.non_finite_tail,
            warnings=tuple(self._run_warnings(trajectory)),
            sides={
                f"{name}_{side}": channel
                for side, rows in (("before", samples.before), ("after", samples.after))
                for name, channel in self._side(rows, samples.transitions).items()
            },
        )

    def _side(self, rows: Any, transitions: list[Transition]) -> dict[str, Any]:
        """Return the channels that may jump at events, on one side of each event."""
        trajectory = self._trajectory_of(rows, transitions)
        channels = self._full(self._channels(trajectory), trajectory)
        return {name: values for name, values in channels.items() if name not in EVENT_CHANNELS}

    def _full(self, channels: dict[str, Any], trajectory: Any) -> dict[str, Any]:
        """Return channels of which a constant one may be given as a number."""
        shape = trajectory.time.shape
        return {name: filled(values, shape) for name, values in channels.items()}

    def _channels(self, trajectory: Any) -> dict[str, Any]:
        """Return the channels that are not energies."""
        raise NotImplementedError

    def _checks(self, trajectory: Any, samples: Samples) -> dict[str, Check]:
        """Return the checks of the audit."""
        raise NotImplementedError

    @property
    def _contact_names(self) -> tuple[str, ...]:
        """The names of the events of which breakaway and rest are quantities."""
        raise NotImplementedError

    def _quantities(self, trajectory: Any, energies: dict[str, Any]) -> Quantities:
        """Return the quantities of the mechanism, of its first contact and of the end.

        Transitions after the last sample, which a failed run may have, are ignored.
        """
        quantities: Quantities = self._mechanism.quantities(trajectory)
        end, names = np.max(trajectory.time, initial=-np.inf), self._contact_names
        if names:
            quantities |= quantities_of_transitions(
                [e for e in trajectory.transitions if e.contact in names and e.time <= end]
            )
        if trajectory.time.size:
            position, velocity = map(np.atleast_2d, (trajectory.position, trajectory.velocity))
            quantities |= final_quantities(
                float(trajectory.time[-1]),
                float(position[0, -1]),
                float(velocity[0, -1]),
                float(self._mechanism.initial_energy),
                {name: float(energy[-1]) for name, energy in energies.items()},
            )
        return quantities

    def _run_warnings(self, trajectory: Any) -> list[str]:
        """Return the warnings about the run; none if it stopped before its end."""
        if trajectory.time.size < 2 or trajectory.time[-1] < self._settings.duration:
            return []
        return [*self._warnings(trajectory), *self._hidden_stick_slip(trajectory)]

    def _warnings(self, trajectory: Any) -> list[str]:
        """Return the warnings about a complete run."""
        raise NotImplementedError

    def _hidden_stick_slip(self, trajectory: Any) -> list[str]:
        return hidden_stick_slip(trajectory.transitions, self._interval, self._settings.duration)


class SingleDofSimulation(RecordedSimulation):
    """The `Simulation` of a mechanism of one coordinate.

    Parameters
    ----------
    scenario : Scenario
    mechanism : Mechanism
        Built from the scenario.
    """

    def __init__(self, scenario: "Scenario", mechanism: Mechanism) -> None:
        super().__init__(
            scenario,
            mechanism,
            lambda recording: new_solver(mechanism, scenario.solver, recording),
            ROW_COLUMNS + len(mechanism.energy_integrals),
        )
        # Regularised friction creeps instead of sticking; the friction checks do not apply.
        contact = mechanism.contact
        law = "" if contact is None else contact.law
        regularised = law == methods.REGULARISED and not mechanism.prescribed
        self._set_valued = None if regularised else contact
        self._locates_events = methods.METHODS[scenario.solver.backend].locates_events

    def _sides_at_events(self, before: Any, after: Any, breaks_away: Any) -> Any:
        """Return one sample for each event: its sticking side, else the side after it.

        Of several events at one time the last that sticks is taken, else the last.
        """
        sides = sticking_sides(before.T, after.T, breaks_away).T
        return sides[np.lexsort((sides[:, MODE_COLUMN] == STICK, sides[:, TIME_COLUMN]))]

    @property
    def _contact_names(self) -> tuple[str, ...]:
        if self._mechanism.contact is None:  # a rest on a stop is one
            return () if self._mechanism.stops is None else (EVENT,)
        return event_names(self._mechanism)

    def _trajectory_of_samples(self, samples: Samples) -> Trajectory:
        trajectory = self._trajectory_of(samples.rows, samples.transitions)
        before, after = (side[:, VELOCITY_COLUMN] for side in (samples.before, samples.after))
        return trajectory._replace(velocity_before=before, velocity_after=after)

    def _trajectory_of(self, rows: Any, transitions: list[Transition]) -> Trajectory:
        return trajectory_of(self._mechanism, rows.T.copy(), transitions)

    def _checks(self, trajectory: Trajectory, samples: Samples) -> dict[str, Check]:
        mechanism, settings = self._mechanism, self._settings
        return audit(
            trajectory,
            self._set_valued,
            allowed_residual(settings.rtol, self.statistics()[0]),
            settings.atol * mechanism.tolerance_share,
            float(energy_scale(mechanism, trajectory)),
            mechanism.stops,
        ) | self._release_check(samples)

    def _release_check(self, samples: Samples) -> dict[str, Check]:
        """Return the check of the breakaways; none where stick is not left at a located event."""
        if self._set_valued is None or self._mechanism.prescribed or not self._locates_events:
            return {}
        leaves = np.array([leaves_stick(event) for event in samples.transitions], dtype=bool)
        before = self._trajectory_of(samples.before[leaves], [])
        after = self._trajectory_of(samples.after[leaves], [])
        return {"release": release_check(self._mechanism, before, after, self._settings.duration)}

    def _warnings(self, trajectory: Trajectory) -> list[str]:
        return [
            *nothing_moves(self._mechanism, trajectory),
            *tiny_motion(trajectory, self._settings.atol * self._mechanism.tolerance_share),
            *self._mechanism.run_warnings(trajectory),
        ]

    def _hidden_stick_slip(self, trajectory: Trajectory) -> list[str]:
        # Regularised friction passes "stick" at each reversal.
        return [] if self._set_valued is None else super()._hidden_stick_slip(trajectory)

    def _channels(self, trajectory: Trajectory) -> dict[str, Any]:
        return channels_of(self._mechanism, trajectory)


def channels_of(mechanism: Mechanism, trajectory: Trajectory) -> dict[str, Any]:
    """Return the channels of any motion and the mechanism's own, without the energies."""
    channels = {
        "angle": trajectory.position,
        "angular_velocity": trajectory.velocity,
        "angular_acceleration": trajectory.acceleration,
        **mechanism.channels(trajectory),
    }
    if mechanism.contact is not None:
        channels |= {"friction_torque": trajectory.friction, "mode": trajectory.mode}
    return channels


def trajectory_of(mechanism: Mechanism, columns: Any, transitions: list[Transition]) -> Trajectory:
    """Return the trajectory of columns (width, n)."""
    time, drive, position, velocity, *others = columns[:ROW_COLUMNS]
    acceleration, friction, mode = others
    return Trajectory(
        time,
        drive,
        position,
        velocity,
        acceleration,
        friction,
        mode,
        energy_integrals=dict(zip(mechanism.energy_integrals, columns[ROW_COLUMNS:], strict=True)),
        stored_energies={
            # An energy that does not change may be one number.
            name: filled(energy(position, velocity), position.shape)
            for name, energy in mechanism.stored_energies.items()
        },
        transitions=transitions,
    )


def sticking_sides(before: Any, after: Any, breaks_away: Any) -> Any:
    """Return columns (width, n) of events: the sticking side of each, else the side after it."""
    # No sticking side: the run starts beyond the limit, or the contact has moved in the step.
    holds = (before[MODE_COLUMN] == STICK) & (before[VELOCITY_COLUMN] == after[VELOCITY_COLUMN])
    return np.where(breaks_away & holds, before, after)


def filled(values: Any, shape: tuple[int, ...]) -> Any:
    """Return values of a shape, which one number may be; numpy asks for longer whether they are."""
    return values if getattr(values, "shape", ()) == shape else np.broadcast_to(values, shape)


def energy_scale(mechanism: Mechanism, trajectory: Trajectory) -> Any:
    """Return the energy scale of the scenario, J, which does not depend on the solution.

    The drive of a prescribed motion is the torque that balances all others.
    """
    applied_torque = trajectory.drive
    if not mechanism.prescribed:
        applied_torque = mechanism.applied_torque(
            trajectory.drive, trajectory.position, np.zeros_like(trajectory.velocity)
        )
    at_start = mechanism.stored_energies["energy_kinetic"](mechanism.position, mechanism.velocity)
    torque = np.broadcast_to(np.abs(applied_torque), trajectory.velocity.shape)
    return np.max(torque, axis=0, initial=0.0) + at_start


def quantities_of_transitions(transitions: list[Transition]) -> Quantities:
    """Return when a contact first broke away and last came to rest; None if it did not.

    breakaway_time is the first transition from stick to slip.
    """
    slips = (e.time for e in transitions if e.mode_from == STICK)
    rests = (e.time for e in reversed(transitions) if e.mode_to == STICK)
    return {
        "breakaway_time": Quantity(next(slips, None), "s"),
        "last_rest_time": Quantity(next(rests, None), "s"),
    }


def final_quantities(
    time: float, position: float, velocity: float, at_start: float, energies: Mapping[str, float]
) -> Quantities:
    """Return the quantities of the last sample, and the energy at the start to balance them."""
    return {
        "final_time": Quantity(time, "s"),
        "final_angle": Quantity(position, "rad"),
        "final_angular_velocity": Quantity(velocity, "rad/s"),
        "initial_energy": Quantity(at_start, "J"),
        **{name: Quantity(energy, "J") for name, energy in energies.items()},
    }
