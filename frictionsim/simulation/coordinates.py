"""The simulation of a mechanism of one or several coordinates, and its results."""

from array import array
from collections.abc import Callable, Collection, Mapping, Sequence
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.results import STICK, Quantities, Quantity, SimulationResult, Transition
from frictionsim.scenario import methods
from frictionsim.simulation.audit import audit
from frictionsim.simulation.checkpoint import Arrays, require_array, unfit
from frictionsim.simulation.mechanism import Mechanism, Samples, Simulation
from frictionsim.simulation.run_warnings import foreseen, hidden_stick_slip, undetermined
from frictionsim.simulation.sample_store import SAMPLES
from frictionsim.solvers import solver_of
from frictionsim.solvers.loop import State
from frictionsim.solvers.modes import holds, subject
from frictionsim.solvers.prescribed import PrescribedEvents
from frictionsim.solvers.recording import Recording
from frictionsim.solvers.rkf45 import Step, Tolerances
from frictionsim.solvers.system import STOP

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

# Channels that /events holds as `angle`, `mode_from` and `mode_to`, not as sides.
EVENT_CHANNELS = ("angle", "mode")


class CoordinateSimulation(Simulation):
    """The simulation of a mechanism of one or several coordinates, built from its scenario.

    The system of the mechanism belongs to the run: a friction law may replace its friction.
    """

    axes: Mapping[str, tuple[str, ...]] = MappingProxyType({})

    def __init__(self, scenario: "Scenario", mechanism: Mechanism) -> None:
        settings, system = scenario.solver, mechanism.system
        self._mechanism, self._settings = mechanism, settings
        self._interval, self._wanted = scenario.interval, scenario.output.channels
        self._method = methods.METHODS[settings.backend]
        self.effects, self.channel_info = mechanism.effects, mechanism.channel_info
        self.states = len(system.start)
        tolerances = Tolerances(
            settings.rtol,
            settings.atol * mechanism.tolerance_share,
            settings.max_step or inf,
            settings.step or 0.0,
            settings.max_steps,
            subject=subject(system),
            budget_advice=scenario.budget_advice,
        )
        self._recording = Recording(
            system, settings.duration, scenario.interval, scenario.output.at_events
        )
        parts = system, tolerances, self._recording, settings.duration
        if system.stops is not None and settings.backend != "events":
            raise InputError(
                f"solver.backend: end stops need the backend 'events', got '{settings.backend}'"
            )
        self._solver = (
            PrescribedEvents(*parts)
            if mechanism.prescribed
            else solver_of(mechanism.law, settings.backend, *parts)
        )

    def sample_at(self, times: Sequence[float]) -> None:
        self._recording.times.give(times)

    def solve(self, on_step: Callable[[float], Any]) -> None:
        self._solver.run(on_step)

    def statistics(self) -> tuple[int, int, int]:
        step = self._solver.state.step
        return step.taken, step.rejected, step.evaluations

    def state(self) -> Arrays | None:
        """Return the state to resume from; None for SciPy's integrators, whose state is private."""
        if not self._method.resumable:
            return None
        recording, state = self._recording, self._solver.state
        numbers = {f"step.{name}": x for name, x in state.step._asdict().items()}
        numbers |= {f"state.{n}": x for n, x in state._asdict().items() if n != "step"}
        columns = _in_order(self._rows(recording.rows)).T  # views
        contacts = [e.contact for e in recording.transitions]
        events = [(e.time, e.mode_from, e.mode_to, e.position) for e in recording.transitions]
        return {
            **{name: np.array(x, dtype=float) for name, x in numbers.items()},
            **{SAMPLES + n: column for n, column in zip(self._row_names, columns, strict=True)},
            "sides": np.array(recording.sides),
            "transitions.contact": np.array(contacts, dtype=np.bytes_),
            "transitions": np.array(events, dtype=np.float64).reshape(-1, 4),
        }

    def restore(self, state: Arrays) -> None:
        """Load the state of another simulation of the same scenario."""
        recording, solver = self._recording, self._solver
        step = _restored(Step, "step.", state, solver.state.step, {0, self.states})
        before = solver.state._replace(step=step)
        solver.state = _restored(State, "state.", state, before, {self.states})
        solver.tolerances = solver.tolerances._replace(granted=step.taken + step.rejected)
        recording.transitions[:] = self._transitions(state)
        names = [SAMPLES + name for name in self._row_names]
        columns = [require_array(state, name, np.float64, ndim=1) for name in names]
        for name, column in zip(names, columns, strict=True):
            if len(column) != len(columns[0]):
                raise unfit(name)
        recording.rows = array("d", np.column_stack(columns).tobytes())
        sides = require_array(state, "sides", np.float64, ndim=1)
        if len(sides) != 2 * len(recording.transitions) * len(names):
            raise unfit("sides")
        recording.sides = array("d", sides.tobytes())

    @property
    def _row_names(self) -> tuple[str, ...]:
        return "time", *self._mechanism.columns

    def _rows(self, numbers: "array[float]") -> Any:
        """Return recorded rows (n, columns), a view."""
        rows = np.frombuffer(numbers) if numbers else np.zeros(0)
        return rows.reshape(-1, len(self._row_names))

    def _transitions(self, state: Arrays) -> list[Transition]:
        names = require_array(state, "transitions.contact", np.bytes_, ndim=1)
        rows = require_array(state, "transitions", np.float64, ndim=2)
        if rows.shape != (len(names), 4):  # time, modes before and after it, position
            raise unfit("transitions")
        contacts = [name.decode(errors="replace") for name in names.tolist()]
        return [
            Transition(time, contact, int(mode_from), int(mode_to), position)
            for contact, (time, mode_from, mode_to, position) in zip(
                contacts, rows.tolist(), strict=True
            )
        ]

    def observe(self) -> SimulationResult:
        samples, is_cut = self._samples()
        is_channel = self.channel_info.__contains__
        times = np.array([e.time for e in samples.transitions])
        sides = {
            f"{name}_{side}": values
            for side, columns in (("before", samples.before), ("after", samples.after))
            for name, values in {**columns, **self._derived(times, columns, samples)}.items()
            if is_channel(name) and name not in EVENT_CHANNELS and not name.startswith("energy_")
        }
        recorded = {name: samples[name] for name in ("time", *self._channel_names())}
        return SimulationResult(
            channels=recorded | self._derived(samples.time, samples.columns, samples),
            transitions=samples.transitions,
            quantities=self._quantities(samples),
            checks=audit(self._mechanism, samples, self._settings, self.statistics()[0]),
            non_finite_tail=is_cut,
            warnings=tuple(self._run_warnings(samples)),
            sides=sides,
        )

    def _derived(self, time: Any, columns: Any, samples: Samples) -> dict[str, Any]:
        """Return the derived channels that are wanted, of some rows."""
        return {
            name: derive(time, columns, samples)
            for name, derive in self._mechanism.derived.items()
            if self._wanted is None or name in self._wanted
        }

    def _channel_names(self) -> list[str]:
        """Return the names of the channels: motion, forces, friction, energies."""
        motion = ("angle", "angular_velocity", "angular_acceleration")
        ranks = {name: i - 10 for i, name in enumerate(motion)}
        ranks |= {"friction_torque": 1, "mode": 2}
        names = [name for name in self._mechanism.columns if name in self.channel_info]
        return sorted(names, key=lambda n: 3 if n.startswith("energy_") else ranks.get(n, 0))

    def _samples(self) -> tuple[Samples, bool]:
        """Return the samples before the first that is not finite, and whether there is one."""
        recording, names = self._recording, self._mechanism.columns
        rows = _in_order(self._rows(recording.rows))
        sides = self._rows(recording.sides).reshape(-1, 2, 1 + len(names))
        transitions = recording.transitions
        # Laws record that a step ends at a surface before a change of mode within it.
        order = np.argsort(sides[:, 1, 0], kind="stable")
        sides, transitions = sides[order], [transitions[i] for i in order]
        wrong, wrong_sides = (~np.isfinite(of).all(axis=-1) for of in (rows, sides))
        ends = np.concatenate((rows[wrong, 0], sides[wrong_sides.any(axis=1), 1, 0]))
        if ends.size:
            rows, kept = rows[rows[:, 0] < ends.min()], sides[:, 1, 0] < ends.min()
            sides, transitions = sides[kept], transitions[: int(kept.sum())]
        # Views: no second copy of all samples is made.
        columns = dict(zip(self._row_names, rows.T, strict=True))
        before, after = (
            dict(zip(names, side.T[1:], strict=True)) for side in (sides[:, 0], sides[:, 1])
        )
        return Samples(columns["time"], columns, transitions, before, after), bool(ends.size)

    def _quantities(self, samples: Samples) -> Quantities:
        """Return the quantities of the mechanism, of its contacts and of the end.

        Transitions after the last sample, which a failed run may have, are ignored.
        """
        mechanism = self._mechanism
        quantities: Quantities = mechanism.quantities(samples)
        end = np.max(samples.time, initial=-np.inf)
        first = [c.name for c in mechanism.contacts if c.backward][:1]
        system = mechanism.system
        names = [*first, *[s.event for s in system.surfaces if s.event]] if first else []
        if system.stops is not None:  # a rest on a stop is one
            names.append(STOP)
        if names:
            events = [e for e in samples.transitions if e.time <= end]
            slips = (e.time for e in events if e.contact in names and e.mode_from == STICK)
            quantities |= {
                "breakaway_time": Quantity(next(slips, None), "s"),
                "last_rest_time": Quantity(self._last_rest(samples, events, names), "s"),
            }
        if samples.time.size:
            if mechanism.prescribed:
                quantities["drive_torque_peak"] = Quantity(samples.largest("drive_torque"), "N m")
            last = {name: float(values[-1]) for name, values in samples.columns.items()}
            stored = [name for name in ("energy_kinetic", "energy_potential") if name in last]
            at_start = system.recorded(0.0, system.start, [STICK for _ in mechanism.contacts])
            start = dict(zip(mechanism.columns[self.states :], at_start, strict=False))
            quantities |= {
                "final_time": Quantity(float(samples.time[-1]), "s"),
                "final_angle": Quantity(last["angle"], "rad"),
                "final_angular_velocity": Quantity(last["angular_velocity"], "rad/s"),
                "initial_energy": Quantity(sum(start[name] for name in stored), "J"),
                **{n: Quantity(last[n], "J") for n in (*mechanism.energies, *stored)},
            }
        return quantities

    def _last_rest(
        self, samples: Samples, events: list[Transition], names: Sequence[str]
    ) -> float | None:
        """Return when all contacts last came to hold, s; None if they never did."""
        contacts = self._mechanism.contacts
        if len(contacts) < 2:
            rests = (e.time for e in reversed(events) if e.contact in names and e.mode_to == STICK)
            return next(rests, None)
        if not samples.time.size:
            return None
        modes = {c.name: int(samples[c.mode][-1]) for c in contacts}
        for e in reversed(events):
            if all(map(holds, modes.values())):
                return e.time
            modes[e.contact] = e.mode_from
        return None

    def _run_warnings(self, samples: Samples) -> list[str]:
        """Return the warnings about the run; none if it stopped before its end."""
        mechanism, settings = self._mechanism, self._settings
        if samples.time.size < 2 or samples.time[-1] < settings.duration:
            return []
        warnings = [*foreseen(mechanism, settings.duration), *mechanism.run_warnings(samples)]
        if mechanism.prescribed:
            warnings += undetermined(samples)
        if mechanism.law in ("", methods.REGULARISED):  # which passes "stick" at each reversal
            return warnings
        return warnings + hidden_stick_slip(samples.transitions, self._interval, settings.duration)


def _restored(kind: Any, prefix: str, state: Arrays, before: Any, lengths: Collection[int]) -> Any:
    """Return a named tuple of numbers and lists from the arrays of a state.

    `lengths` are those that a state and its derivative may have; a step has none at the start.
    """
    values = before._asdict()
    for name, value in before._asdict().items():
        if name == "step":
            continue
        is_mode = name in ("modes", "now")
        dtype: Any = int if is_mode or isinstance(value, int) else float
        numbers = require_array(state, prefix + name, np.float64, ndim=np.ndim(value))
        allowed = {len(value)} if is_mode else lengths
        if isinstance(value, list) and name != "changes" and len(numbers) not in allowed:
            raise unfit(prefix + name)
        values[name] = numbers.astype(dtype).tolist()
    return kind(**values)


def _in_order(rows: Any) -> Any:
    """Return rows in the order of their times, and of several at one time the last."""
    if np.all(np.diff(rows[:, 0]) > 0.0):
        return rows
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return rows[np.append(np.diff(rows[:, 0]) > 0.0, True)]
