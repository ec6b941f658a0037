"""The event-driven solver: keeps the state of a run, and has `one_contact` integrate it."""

import logging
from array import array
from collections import Counter, deque
from collections.abc import Callable, Mapping
from math import copysign, inf
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import BudgetExceeded, Diverged, FrictionsimError, NonFinite
from frictionsim.results import Transition
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.common import (
    SampleBuffer,
    chattering_error,
    subject_of,
)
from frictionsim.solvers.compilation import Kernel, as_argument
from frictionsim.solvers.end_stops import ENERGY, EVENT
from frictionsim.solvers.one_contact import DONE, PAUSED, integrate
from frictionsim.solvers.one_contact_state import (
    CHATTERING_EVENTS,
    EVENT_COLUMNS,
    NEVER,
    ROW_COLUMNS,
    Failure,
    Run,
    sample_time,
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

LOG = logging.getLogger(__name__)

# Samples and events between two calls of `on_step`, as Python and compiled.
PYTHON_BUFFERS = 64, 4
COMPILED_BUFFERS = 4096, 512
SECONDS_OF_A_CALL = 0.1  # of compiled code, which is not interrupted
FIRST_CALL = 1000.0  # steps
STEPS_OF_A_CALL = 500_000.0  # of many runs
# After so many steps as Python, a run that has as many left is compiled: code on the disk takes
# half a second, a compilation some twelve, a step as Python 20 us.
PATIENCE = 2000
STEPS_THAT_PAY, STEPS_THAT_PAY_COMPILING = 40_000.0, 600_000.0
SECONDS_OF_COMPILATION = 10.0  # on an idle core
_python_steps: Counter[Any] = Counter()  # of this process, by the form of the kernel


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
    is_to_be_compiled : bool
        Whether it pays to compile the rest of the run.
    """

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        self._mechanism, self._settings, self._buffer = mechanism, settings, buffer
        self._system = system_of(mechanism)
        self._run = run_of(mechanism, settings, buffer)
        self._state = initial_state(mechanism)
        self._event_names = event_names(mechanism)
        self._kernel = Kernel(integrate, (self._system, self._run))
        self._compiled: Any = None
        self._compiled_buffers: tuple[array[float], array[float]] | None = None
        self._steps_of_a_call = FIRST_CALL
        self._patience = PATIENCE
        self.is_to_be_compiled = False
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

    def run(self, on_step: Callable[[float], object]) -> bool:
        """Integrate to the end, from the start or from where the last call ended.

        `on_step` is called with the time between steps; it may raise Interrupted.

        Returns
        -------
        bool
            True if the rest is so long that it pays to `compile` first.
        """
        try:
            return self._integrate(on_step)
        except Failure as failure:
            raise self._error(failure) from None
        except ArithmeticError:
            raise NonFinite(
                f"after t = {self._solver.t:.9g} s {subject_of(self._mechanism)} exceeds the range"
                " of double precision; check the scenario for forces or inertias that are far too"
                " large or too small"
            ) from None

    @property
    def compile_seconds(self) -> float:
        """How long `compile` should take, s; 0 if the code is at hand."""
        return 0.0 if self._kernel.is_at_hand else SECONDS_OF_COMPILATION

    def compile(self) -> None:
        """Have the rest of the run compiled, if that is possible."""
        self.is_to_be_compiled = False
        self._patience = -1
        self._compiled = compiled_for(self._kernel, self._system, self._run)

    def _integrate(self, on_step: Callable[[float], object]) -> bool:
        s, times = self._state, self._buffer.times
        self._run = self._run._replace(times=array("d", times.given))
        s[layout.NEXT_SAMPLE], s[layout.NEXT_TIME] = times.taken, times.next
        if self._pays_already():
            self.compile()
        start, buffers, steps = s[layout.TIME], buffers_of(self._run, *PYTHON_BUFFERS), 0
        while True:
            on_step(s[layout.TIME])
            if self._compiled is not None:
                status = self._piece_of_a_call()
            else:
                steps += 1
                try:
                    status = integrate(self._system, self._run, s, *buffers, 1.0)
                finally:
                    self._take(*buffers)
                if steps == self._patience:
                    self.is_to_be_compiled = self._pays(s[layout.TIME] - start)
                    if self.is_to_be_compiled:
                        return True
            if status == DONE:
                if not self._kernel.reason:
                    _python_steps[self._kernel.form] += steps
                return False

    def _pays_already(self) -> bool:
        """Return whether this process ran as long without compiled code as it takes to have it.

        What was run often, as in a sweep or a fit, will be run again.
        """
        kernel = self._kernel
        if self._compiled is not None or self._patience < 0 or kernel.reason:
            return False
        steps = _python_steps[kernel.form]
        return (
            kernel.is_loaded
            or steps > STEPS_THAT_PAY_COMPILING
            or (steps > STEPS_THAT_PAY and kernel.is_at_hand)
        )

    def _pays(self, done: float) -> bool:
        """Return whether it pays to compile the rest after PATIENCE steps for so many s."""
        left = self._run.end - self._state[layout.TIME]
        if not PATIENCE * left > STEPS_THAT_PAY * done:
            return False
        if self._kernel.reason:
            LOG.info("the rest of the run is not compiled: %s", self._kernel.reason)
            return False
        return PATIENCE * left > STEPS_THAT_PAY_COMPILING * done or self._kernel.is_at_hand

    def _piece_of_a_call(self) -> int:
        """Integrate for a call of compiled code; if that fails, up to the step before."""
        before, started = self._state[:], perf_counter()
        try:
            status = self._piece_compiled(self._compiled, self._steps_of_a_call)
        except (ArithmeticError, RuntimeError, ValueError):
            steps = self._state[layout.TURNS]
            self._state[:] = before
            status = PAUSED
            if steps > 1.0:
                status = self._piece_compiled(self._compiled, steps - 1.0)
            self._compiled = None  # Python says what is wrong
        seconds = max(perf_counter() - started, 1e-6)
        growth = min(SECONDS_OF_A_CALL / seconds, 10.0)
        self._steps_of_a_call = max(1.0, self._steps_of_a_call * growth)
        return status

    def _piece_compiled(self, function: Any, steps: float) -> int:
        if self._compiled_buffers is None:
            self._compiled_buffers = buffers_of(self._run, *COMPILED_BUFFERS)
            self._arguments = as_argument((self._system, self._run))
        arguments = as_argument((self._state, *self._compiled_buffers))
        status: int = function(*self._arguments, *arguments, steps)
        self._take(*self._compiled_buffers)
        return status

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
                f" {settings.budget_advice} (unless a short time constant, such as inertia over"
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


def initial_state(mechanism: "Mechanism") -> "array[float]":
    """Return the state of a run that has not begun."""
    s, y = array("d", bytes(8 * layout.LENGTH)), mechanism.initial_state
    s[layout.Y : layout.Y + len(y)] = array("d", y)
    if mechanism.velocity != 0.0:
        s[layout.MODE] = copysign(1.0, mechanism.velocity)
    s[layout.HELD], s[layout.ERROR_BEFORE] = NEVER, 1.0
    return s


def event_names(mechanism: "Mechanism") -> tuple[str, ...]:
    """Return the names of events by their numbers."""
    surfaces = [surface.event for surface in mechanism.switching_surfaces]
    assert mechanism.contact is not None  # else another solver takes it
    return (mechanism.contact.name, EVENT, *surfaces)


def buffers_of(run: Run, rows: int, events: int) -> "tuple[array[float], array[float]]":
    """Return buffers for so many samples and events."""
    width = ROW_COLUMNS + run.states - 2
    size = events * (EVENT_COLUMNS + 2 * width)
    return array("d", bytes(8 * rows * width)), array("d", bytes(8 * size))


class CompiledRuns:
    """Integrates many runs of one form, one after the other.

    Parameters
    ----------
    kernel : Kernel
    on_call : callable
        Called between calls of compiled code; it may raise Interrupted.
    """

    def __init__(self, kernel: Kernel, on_call: Callable[[], object]) -> None:
        self._kernel, self._on_call = kernel, on_call
        self._function: Any = None
        self._is_tried = False
        self._buffers: Any = None

    def recorded(
        self, mechanism: "Mechanism", run: Run
    ) -> "tuple[array[float], array[float]] | None":
        """Return the samples and events of a run, as `integrate` writes them; None if it fails."""
        s = initial_state(mechanism)
        s[layout.NEXT_TIME] = sample_time(run, 0.0)
        if self._buffers is None:
            self._buffers = buffers_of(run, *COMPILED_BUFFERS)
        buffers = self._buffers
        arguments = as_argument((mechanism.system, run, s, *buffers))
        if not self._is_tried:
            self._is_tried = True
            self._function = compiled_for(self._kernel, mechanism.system, run)
        if self._function is None:
            return None
        rows, events = array("d"), array("d")
        width = ROW_COLUMNS + run.states - 2
        status = PAUSED
        while status != DONE:
            self._on_call()
            try:
                status = self._function(*arguments, STEPS_OF_A_CALL)
            except (ArithmeticError, RuntimeError, ValueError):
                return None
            rows.extend(buffers[0][: int(s[layout.ROWS]) * width])
            events.extend(buffers[1][: int(s[layout.EVENTS]) * (EVENT_COLUMNS + 2 * width)])
        return rows, events


def compiled_for(kernel: Kernel, system: Any, run: Run) -> Any:
    """Return the compiled loop for systems and runs of one form; None if there is none."""
    s = array("d", bytes(8 * layout.LENGTH))
    s[layout.STARTED] = 1.0  # no step follows, so that nothing is evaluated
    arguments = as_argument((system, run, s, *buffers_of(run, 1, 1)))
    return kernel.compiled(lambda function: function(*arguments, 0.0))


def kernel_of(mechanism: "Mechanism", run: Run) -> Kernel:
    """Return the kernel for the runs of a form."""
    return Kernel(integrate, (mechanism.system, run))
