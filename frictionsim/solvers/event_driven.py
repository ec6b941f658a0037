"""The event-driven solver: keeps the state of a run, and has `one_contact` integrate it."""

from array import array
from collections import deque
from collections.abc import Callable, Mapping
from math import copysign, inf
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import BudgetExceeded, Diverged, FrictionsimError, NonFinite
from frictionsim.results import Transition
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.common import (
    SampleBuffer,
    chattering_error,
    subject_of,
)
from frictionsim.solvers.end_stops import ENERGY, EVENT
from frictionsim.solvers.one_contact import DONE, integrate
from frictionsim.solvers.one_contact_state import (
    CHATTERING_EVENTS,
    EVENT_COLUMNS,
    NEVER,
    ROW_COLUMNS,
    Failure,
    Run,
)
from frictionsim.solvers.root_finding import hidden_event
from frictionsim.solvers.state_values import (
    COUNT,
    DIRECTION,
    FLAG,
    NON_NEGATIVE,
    NUMBER,
    TIME,
    Values,
    unfit,
)
from frictionsim.solvers.stepper import MIN_ERROR_NORM, non_finite_error, step_underflow
from frictionsim.solvers.system import system_of

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism

BUFFERED_ROWS, BUFFERED_EVENTS = 64, 4  # between two calls of `on_step`


class Field(NamedTuple):
    """A field of a checkpoint: what it may hold, where it is in the state, list of a vector."""

    expected: Values
    place: int
    kind: type = float


SOLVER_FIELDS = {
    "t": Field(TIME, layout.TIME),
    "started": Field(FLAG, layout.STARTED, bool),
    "y": Field(NUMBER, layout.Y, list),
    "mode": Field(DIRECTION, layout.MODE, int),
    "sampled_until": Field(TIME, layout.SAMPLED_UNTIL),
    "phase_ends": Field(FLAG, layout.PHASE_ENDS, bool),
    "direction": Field(DIRECTION, layout.DIRECTION, int),
    "held": Field(TIME._replace(low=NEVER), layout.HELD),
    "segment_end": Field(TIME, layout.SEGMENT_END),
}
STEPPER_FIELDS = {
    "t_old": Field(TIME, layout.T_OLD),
    "t": Field(TIME, layout.T_NEW),
    "y_old": Field(NUMBER, layout.Y_OLD, list),
    "y": Field(NUMBER, layout.Y_NEW, list),
    "f_old": Field(NUMBER, layout.F_OLD, list),
    # Beyond the range of double precision in a state that a step may end at; the next step
    # fails by name then.
    "f": Field(Values(finite=False), layout.F_NEW, list),
    "_h": Field(NON_NEGATIVE, layout.STEP),  # 0 before the first segment
    "_error_before": Field(Values(low=MIN_ERROR_NORM), layout.ERROR_BEFORE),
    "steps": Field(COUNT, layout.STEPS, int),
    "rejected": Field(COUNT, layout.REJECTED, int),
    "nfev": Field(COUNT, layout.EVALUATIONS, int),
}


class StatePart:
    """Some numbers of the state by name, as attributes: a part of a checkpoint.

    Parameters
    ----------
    state : array
    fields : mapping of str to Field
    run : Run
    """

    _state: "array[float]"
    _run: Run
    CHECKPOINT_FIELDS: Mapping[str, Values]

    def __init__(self, state: "array[float]", fields: Mapping[str, Field], run: Run) -> None:
        expected = {name: field.expected for name, field in fields.items()}
        self.__dict__.update(_state=state, _fields=fields, _run=run, CHECKPOINT_FIELDS=expected)

    def __getattr__(self, name: str) -> Any:
        field = self.__dict__["_fields"].get(name)
        if field is None:
            raise AttributeError(name)
        if field.kind is list:
            return self._state[field.place : field.place + self._run.states].tolist()
        return field.kind(self._state[field.place])

    def __setattr__(self, name: str, value: Any) -> None:
        field = self.__dict__["_fields"][name]
        if field.kind is list:
            self._state[field.place : field.place + len(value)] = array("d", value)
        else:
            self._state[field.place] = value


class StepperPart(StatePart):
    """The numbers of the integrator."""

    def restored_fault(self) -> str:
        """Return the field that does not go with the others, empty if all do.

        The part of a run that begins now has all the steps of the limit.
        """
        self._state[layout.GRANTED] = self.steps + self.rejected
        if self._run.fixed_step and self._h not in (0.0, self._run.fixed_step):
            return "_h"
        return "" if self.t_old <= self.t else "t_old"


class SwitchTimes:
    """The times of the last changes of mode, of the oldest first: a part of a checkpoint."""

    CHECKPOINT_FIELDS: Mapping[str, Values] = {"_times": TIME._replace(ascending=True)}

    def __init__(self, state: "array[float]") -> None:
        self._state = state

    @property
    def _times(self) -> "deque[float]":
        first, n = layout.SWITCH_TIMES, int(self._state[layout.SWITCHES])
        ring = self._state[first : first + min(n, CHATTERING_EVENTS)]
        oldest = n % CHATTERING_EVENTS if n > CHATTERING_EVENTS else 0
        return deque(ring[oldest:] + ring[:oldest], maxlen=CHATTERING_EVENTS)

    @_times.setter
    def _times(self, times: "deque[float]") -> None:
        first = layout.SWITCH_TIMES
        self._state[first : first + len(times)] = array("d", times)
        self._state[layout.SWITCHES] = len(times)


class EventDrivenSolver:
    """Event-driven solver of a mechanism with dry friction.

    Parameters
    ----------
    mechanism : Mechanism
    settings : SolverSettings
    buffer : SampleBuffer
        Receives samples and transitions.

    Attributes
    ----------
    stepper : StatePart
        With `steps`, `rejected` and `nfev`.
    """

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        self._mechanism, self._settings, self._buffer = mechanism, settings, buffer
        self._system = system_of(mechanism)
        self._run = run_of(mechanism, settings, buffer)
        self._state = array("d", bytes(8 * layout.LENGTH))
        initial = mechanism.initial_state
        self._state[layout.Y : layout.Y + len(initial)] = array("d", initial)
        if mechanism.velocity != 0.0:
            self._state[layout.MODE] = copysign(1.0, mechanism.velocity)
        self._state[layout.HELD] = NEVER
        self._state[layout.ERROR_BEFORE] = 1.0
        surfaces = [surface.event for surface in mechanism.switching_surfaces]
        contact = mechanism.contact
        assert contact is not None  # else another solver takes it
        self._event_names = (contact.name, EVENT, *surfaces)
        self._solver = StatePart(self._state, SOLVER_FIELDS, self._run)
        self.stepper = StepperPart(self._state, STEPPER_FIELDS, self._run)

    @property
    def started(self) -> bool:
        """Whether the run is past its start."""
        return self._state[layout.STARTED] != 0.0

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        """The parts of a checkpoint."""
        return {
            "solver": self._solver,
            "stepper": self.stepper,
            "buffer": self._buffer,
            "times": self._buffer.times,
            "chattering": SwitchTimes(self._state),
        }

    def resume(self) -> None:
        """Start at the restored state."""
        if self._solver.mode and not self.stepper._h > 0.0:
            raise unfit("stepper._h", "is not a length of a step")

    def run(self, on_step: Callable[[float], object]) -> None:
        """Integrate to the end, from the start or from a restored state.

        `on_step` is called with the time between steps; it may raise Interrupted.
        """
        try:
            self._integrate(on_step)
        except Failure as failure:
            raise self._error(failure) from None
        except ArithmeticError:
            raise NonFinite(
                f"after t = {self._solver.t:.9g} s {subject_of(self._mechanism)} exceeds the range"
                " of double precision; check the scenario for forces or inertias that are far too"
                " large or too small"
            ) from None

    def _integrate(self, on_step: Callable[[float], object]) -> None:
        s, times = self._state, self._buffer.times
        run = self._run = self._run._replace(times=array("d", times.given))
        s[layout.NEXT_SAMPLE], s[layout.NEXT_TIME] = times.taken, times.next
        width = ROW_COLUMNS + run.states - 2
        rows = array("d", bytes(8 * BUFFERED_ROWS * width))
        events = array("d", bytes(8 * BUFFERED_EVENTS * (EVENT_COLUMNS + 2 * width)))
        status = None
        while status != DONE:
            on_step(s[layout.TIME])
            try:
                status = integrate(self._system, run, s, rows, events, 1.0)
            finally:
                self._take(rows, events)

    def _take(self, rows: "array[float]", events: "array[float]") -> None:
        """Add the samples and events in the buffers to those of the run."""
        s, buffer, width = self._state, self._buffer, ROW_COLUMNS + self._run.states - 2
        buffer.rows.extend(rows[: int(s[layout.ROWS]) * width])
        buffer.times.set_next(int(s[layout.NEXT_SAMPLE]))
        for k in range(int(s[layout.EVENTS])):
            at = k * (EVENT_COLUMNS + 2 * width)
            number, t, before, after, position = events[at : at + EVENT_COLUMNS]
            name = self._event_names[int(number)]
            buffer.transitions.append(Transition(t, name, int(before), int(after), position))
            buffer.sides.extend(events[at + EVENT_COLUMNS : at + EVENT_COLUMNS + 2 * width])

    def _error(self, failure: Failure) -> FrictionsimError:
        """Return the error with which the run ends."""
        t, x, y, z = failure.numbers
        what, settings = subject_of(self._mechanism), self._settings
        if failure.reason == layout.TOO_MANY_STEPS:
            return BudgetExceeded(
                f"limit of {settings.max_steps} steps reached at t = {t:.9g} s of {what};"
                f" {settings.after_budget} (unless a short time constant, such as inertia over"
                " damping, limits the steps)"
            )
        if failure.reason == layout.NON_FINITE:
            return non_finite_error(t, what)
        if failure.reason == layout.UNDERFLOW:
            return step_underflow(t, x, what)
        if failure.reason == layout.HIDDEN_EVENT:
            return hidden_event(t, x, y, z)
        if failure.reason == layout.DIVERGED:
            return Diverged(
                f"at t = {t:.9g} s the kinetic energy is {x:.3g} J, but the energy input"
                f" only {y:.3g} J: {what} diverges; give a shorter solver.step or max_step"
            )
        advice = "check whether the drive changes too fast" + (
            ", or give a larger effects.end_stops.capture_speed" if self._mechanism.stops else ""
        )
        contact = self._event_names[0]
        changed = f"the contact '{contact}' changed its mode"
        return chattering_error(t, changed, CHATTERING_EVENTS, x, advice)


SOLVER = EventDrivenSolver


def run_of(mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer) -> Run:
    """Return the numbers of a run that do not change."""
    start = mechanism.position, mechanism.velocity
    stored = [energy(*start) for energy in mechanism.stored_energies.values()]
    names = mechanism.energy_integrals
    return Run(
        states=len(mechanism.initial_state),
        end=settings.duration,
        rtol=settings.rtol,
        atol=settings.atol,
        max_step=settings.max_step or inf,
        fixed_step=settings.step or 0.0,
        max_steps=settings.max_steps,
        interval=buffer.times.interval,
        last=float(buffer.times.last),
        times=array("d"),
        stored=tuple(map(float, stored)),
        energy_floor=stored[0] + settings.atol / settings.rtol,
        input=2 + names.index("energy_input"),
        impact=2 + names.index(ENERGY) if ENERGY in names else 0,
    )
