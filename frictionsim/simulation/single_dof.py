"""The simulation of a mechanism of one coordinate: its samples, and what follows from them."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import STICK, Quantities, Quantity, SimulationResult, Transition
from frictionsim.scenario import methods
from frictionsim.simulation.audit import audit
from frictionsim.simulation.checkpoint import Arrays, dump_part, load_part, require_array
from frictionsim.simulation.event_samples import Samples, samples_of
from frictionsim.simulation.run_warnings import hidden_stick_slip, nothing_moves
from frictionsim.solvers import solver_factory
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.mechanism import Mechanism, Trajectory

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


# Channels that /events has under names of its own.
OF_EVENTS = ("angle", "mode")


class SingleDofSimulation:
    """The `Simulation` of a mechanism of one coordinate.

    Parameters
    ----------
    scenario : Scenario
    mechanism : Mechanism
        Built from it.
    """

    def __init__(self, scenario: "Scenario", mechanism: Mechanism) -> None:
        self._settings, self._mechanism = scenario.solver, mechanism
        self._at_events, self._interval = scenario.output.at_events, scenario.interval
        # Smoothed friction creeps where it should stick and has no limits that it must keep.
        contact, backend = mechanism.contact, scenario.solver.backend
        law = "" if contact is None else contact.law
        smoothed = law == methods.REGULARISED and not mechanism.prescribed
        self._set_valued = None if smoothed else contact
        self._resumable = methods.METHODS[backend].resumable
        self._recording = SampleBuffer(SampleTimes(scenario.solver.duration, scenario.interval))
        make_solver = solver_factory(backend, law, mechanism.prescribed)
        self._solver = make_solver(mechanism, scenario.solver, self._recording)
        self._width = SampleBuffer.COLUMNS + len(mechanism.energy_integrals)
        self.effects = mechanism.effects
        self.states = len(mechanism.initial_state)
        self.channel_info = mechanism.channel_info
        self.axes: Mapping[str, tuple[str, ...]] = {}

    def prepare(self, on_step: Callable[[float], Any]) -> float:
        """Return 0 s: nothing has to be compiled."""
        return 0.0

    def solve(self, on_step: Callable[[float], Any]) -> None:
        """Have the backend of the scenario step to the end."""
        self._solver.run(on_step)

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""
        stepper = self._solver.stepper
        return stepper.steps, stepper.rejected, stepper.nfev

    def state(self) -> Arrays | None:
        """Return all that the rest of the run depends on; None where SciPy keeps it to itself."""
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
        """Take over the state of another simulation of the same scenario.

        Raises
        ------
        InputError
            If it is of another scenario.
        """
        for name, part in self._solver.checkpoint_parts.items():
            load_part(part, name, state)
        contacts = require_array(state, "transitions.contact", np.bytes_, ndim=1)
        rows = require_array(state, "transitions", np.float64, ndim=2)
        self._recording.transitions[:] = [
            Transition(time, contact.decode(), int(mode_from), int(mode_to), position)
            for contact, (time, mode_from, mode_to, position) in zip(
                contacts.tolist(), rows.tolist(), strict=True
            )
        ]
        if self._solver.started:
            self._solver.resume()

    def trajectory(self) -> Trajectory:
        """Return the samples before the first that is not finite."""
        samples = self._samples()
        return self._trajectory_of(samples.rows, samples.transitions)

    def _samples(self) -> Samples:
        return samples_of(self._recording, self._width, self._at_events)

    def _trajectory_of(self, rows: Any, transitions: list[Transition]) -> Trajectory:
        """Return rows as the arrays that quantities and channels are made of."""
        mechanism, columns = self._mechanism, rows.T.copy()
        time, drive, position, velocity, *others = columns[: SampleBuffer.COLUMNS]
        acceleration, friction, mode = others
        return Trajectory(
            time,
            drive,
            position,
            velocity,
            acceleration,
            friction,
            mode,
            energy_integrals=dict(
                zip(mechanism.energy_integrals, columns[SampleBuffer.COLUMNS :], strict=True)
            ),
            stored_energies={
                name: np.asarray(energy(position, velocity))
                for name, energy in mechanism.stored_energies.items()
            },
            transitions=transitions,
        )

    def observe(self) -> SimulationResult:
        """Return the samples that are finite, and what follows from them."""
        mechanism, settings, samples = self._mechanism, self._settings, self._samples()
        trajectory = self._trajectory_of(samples.rows, samples.transitions)
        return SimulationResult(
            time=trajectory.time,
            channels=_channels(mechanism, trajectory),
            transitions=trajectory.transitions,
            quantities=_quantities(mechanism, trajectory),
            checks=audit(
                trajectory,
                self._set_valued,
                settings.rtol,
                settings.atol,
                _size(mechanism, trajectory),
            ),
            non_finite_tail=samples.non_finite_tail,
            warnings=tuple(self._run_warnings(trajectory)),
            sides={
                f"{name}_{side}": channel
                for side, rows in (("before", samples.before), ("after", samples.after))
                for name, channel in self._side(rows, samples.transitions).items()
            },
        )

    def _run_warnings(self, trajectory: Trajectory) -> list[str]:
        """Return what is odd about the run; nothing of one that stopped short of its end."""
        mechanism, duration = self._mechanism, self._settings.duration
        if trajectory.time.size < 2 or trajectory.time[-1] < duration:
            return []
        found = nothing_moves(mechanism, trajectory) + mechanism.run_warnings(trajectory)
        if self._set_valued is not None:  # what is smoothed passes through stick at each reversal
            found += hidden_stick_slip(trajectory.transitions, self._interval, duration)
        return found

    def _side(self, rows: Any, transitions: list[Transition]) -> dict[str, Any]:
        """Return the channels that may jump, on one side of the events."""
        trajectory = self._trajectory_of(rows, transitions)
        channels = self._mechanism.channels(trajectory)
        return {
            name: np.broadcast_to(values, trajectory.time.shape)
            for name, values in channels.items()
            if name not in OF_EVENTS
        }


def _size(mechanism: Mechanism, trajectory: Trajectory) -> float:
    """Return an energy of the size of the scenario, whatever the solver made of it, J."""
    applied_torque = mechanism.applied_torque(
        trajectory.drive, trajectory.position, np.zeros_like(trajectory.velocity)
    )
    at_start = mechanism.stored_energies["energy_kinetic"](mechanism.position, mechanism.velocity)
    return float(np.max(np.abs(applied_torque), initial=0.0)) + float(at_start)


def _channels(mechanism: Mechanism, trajectory: Trajectory) -> dict[str, Any]:
    """Return every channel by the name it has in the result file."""
    found = {
        **mechanism.channels(trajectory),
        **trajectory.energy_integrals,
        **trajectory.stored_energies,
    }
    # A channel that is constant may be given as a number.
    return {name: np.broadcast_to(values, trajectory.time.shape) for name, values in found.items()}


def _quantities(mechanism: Mechanism, trajectory: Trajectory) -> Quantities:
    """Return the summary's quantities: the mechanism's own, then those of any motion.

    breakaway_time is when a contact first goes over from stick to slip; None if it never does.
    A run that failed may have gone on after its last sample, of which no quantity speaks.
    """
    found = mechanism.quantities(trajectory)
    if mechanism.contact is not None:
        seen = [
            e for e in trajectory.transitions if e.time <= np.max(trajectory.time, initial=-np.inf)
        ]
        slips = (e.time for e in seen if e.mode_from == STICK)
        rests = [e.time for e in seen if e.mode_to == STICK]
        found["breakaway_time"] = Quantity(next(slips, None), "s")
        found["last_rest_time"] = Quantity(rests[-1] if rests else None, "s")
    if trajectory.time.size:
        found["final_time"] = Quantity(float(trajectory.time[-1]), "s")
        found["final_angle"] = Quantity(float(trajectory.position[-1]), "rad")
        found["final_angular_velocity"] = Quantity(float(trajectory.velocity[-1]), "rad/s")
        for name, energy in (
            *trajectory.energy_integrals.items(),
            *trajectory.stored_energies.items(),
        ):
            found[name] = Quantity(float(energy[-1]), "J")
    return found
