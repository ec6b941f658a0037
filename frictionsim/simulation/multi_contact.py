"""The simulation of a mechanism of several coordinates and contacts, and its results."""

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from frictionsim.results import Check, SimulationResult, Transition
from frictionsim.simulation.audit import allowed_residual
from frictionsim.simulation.event_samples import Samples, samples_of
from frictionsim.simulation.multi_contact_audit import audit, release_check
from frictionsim.simulation.run_warnings import hidden_stick_slip
from frictionsim.simulation.single_dof import (
    OF_EVENTS,
    RecordedSimulation,
    final_quantities,
    quantities_of_transitions,
)
from frictionsim.solvers.multi_contact import MultiContactMechanism, MultiContactTrajectory
from frictionsim.solvers.multi_contact_solver import MODE, MultiContactSolver

if TYPE_CHECKING:
    from frictionsim.results import Quantities
    from frictionsim.scenario.settings import Scenario
    from frictionsim.solvers.state_values import Values


class MultiContactSimulation(RecordedSimulation):
    """The `Simulation` of a mechanism of several coordinates and contacts.

    Parameters
    ----------
    scenario : Scenario
    mechanism : MultiContactMechanism
        Built from the scenario.
    """

    MODE: ClassVar["Values"] = MODE

    def __init__(self, scenario: "Scenario", mechanism: MultiContactMechanism) -> None:
        coordinates, contacts = len(mechanism.position), len(mechanism.contacts)
        first = 2 + 3 * coordinates + mechanism.forces
        super().__init__(
            scenario,
            lambda recording: MultiContactSolver(mechanism, scenario.solver, recording),
            first + contacts + len(mechanism.energy_integrals),
        )
        self.mode_columns = slice(first, first + contacts)
        self._mechanism = mechanism
        self.effects = mechanism.effects
        self.states = len(mechanism.initial_state)
        self.channel_info = mechanism.channel_info

    @property
    def event_names(self) -> tuple[str, ...]:
        return tuple(contact.name for contact in self._mechanism.contacts)

    def trajectory(self) -> MultiContactTrajectory:
        """Return the samples before the first non-finite one."""
        samples = self._samples()
        return self._trajectory_of(samples.rows, samples.transitions)

    def _samples(self) -> Samples:
        return samples_of(self._recording, self._width, self._at_events, several=True)

    def _trajectory_of(self, rows: Any, transitions: list[Transition]) -> MultiContactTrajectory:
        """Return the trajectory of rows (n, width)."""
        mechanism, n = self._mechanism, len(self._mechanism.position)
        columns = rows.T.copy()
        time, drive = columns[:2]
        position, velocity, acceleration = columns[2 : 2 + 3 * n].reshape(3, n, -1)
        modes = columns[self.mode_columns]
        integrals = columns[self.mode_columns.stop :]
        return MultiContactTrajectory(
            time=time,
            drive=drive,
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            forces=columns[2 + 3 * n : self.mode_columns.start],
            modes=modes,
            energy_integrals=dict(zip(mechanism.energy_integrals, integrals, strict=True)),
            stored_energies={
                name: energy(position, velocity)
                for name, energy in mechanism.stored_energies.items()
            },
            transitions=transitions,
        )

    def observe(self) -> SimulationResult:
        """Return the finite samples, and quantities, checks and warnings from them."""
        mechanism, settings, samples = self._mechanism, self._settings, self._samples()
        trajectory = self._trajectory_of(samples.rows, samples.transitions)
        before, after = (
            self._trajectory_of(rows, samples.transitions)
            for rows in (samples.before, samples.after)
        )
        energies = trajectory.energy_integrals | trajectory.stored_energies
        return SimulationResult(
            time=trajectory.time,
            channels=mechanism.channels(trajectory) | energies,
            transitions=trajectory.transitions,
            quantities=self._quantities(trajectory, energies),
            checks=audit(
                trajectory,
                mechanism,
                allowed_residual(settings.rtol, self.statistics()[0]),
                settings.atol,
            )
            | self._release_check(before, after),
            non_finite_tail=samples.non_finite_tail,
            warnings=tuple(self._run_warnings(trajectory)),
            sides={
                f"{name}_{side}": channel
                for side, trajectory in (("before", before), ("after", after))
                for name, channel in mechanism.channels(trajectory).items()
                if name not in OF_EVENTS
            },
        )

    def _release_check(
        self, before: MultiContactTrajectory, after: MultiContactTrajectory
    ) -> dict[str, Check]:
        mechanism = self._mechanism
        if not mechanism.frictions:
            return {}
        return {"release": release_check(mechanism, before, after, self._settings.duration)}

    def _quantities(
        self, trajectory: MultiContactTrajectory, energies: dict[str, Any]
    ) -> "Quantities":
        """Return the quantities of the mechanism, of its first contact and of the end."""
        mechanism = self._mechanism
        found = mechanism.quantities(trajectory)
        if mechanism.frictions:
            end, name = np.max(trajectory.time, initial=-np.inf), mechanism.frictions[0][1].name
            found |= quantities_of_transitions(
                [e for e in trajectory.transitions if e.contact == name and e.time <= end]
            )
        if trajectory.time.size:
            found |= final_quantities(
                float(trajectory.time[-1]),
                float(trajectory.position[0, -1]),
                float(trajectory.velocity[0, -1]),
                {name: float(energy[-1]) for name, energy in energies.items()},
            )
        return found

    def _run_warnings(self, trajectory: MultiContactTrajectory) -> list[str]:
        """Return the warnings about the run; none if it stopped before its end."""
        duration = self._settings.duration
        if trajectory.time.size < 2 or trajectory.time[-1] < duration:
            return []
        warnings = [] if np.any(trajectory.velocity) else ["nothing moves: all contacts hold"]
        warnings += self._mechanism.run_warnings(trajectory)
        return warnings + hidden_stick_slip(trajectory.transitions, self._interval, duration)
