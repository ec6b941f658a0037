"""The event-driven solver: keeps the state of a run, and has `one_contact` integrate it."""

import logging
from array import array
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from math import inf
from time import perf_counter
from typing import TYPE_CHECKING, Any

from frictionsim.errors import BudgetExceeded, Diverged, FrictionsimError, NonFinite, SolverError
from frictionsim.results import Transition
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.common import SampleBuffer, chattering_error
from frictionsim.solvers.compilation import Kernel, packed
from frictionsim.solvers.many_runs import integrate_runs
from frictionsim.solvers.one_contact import DONE, PAUSED
from frictionsim.solvers.one_contact_state import CHATTERING_EVENTS, EVENT_COLUMNS, Failure
from frictionsim.solvers.problems import Field, Problem, problem_of, stepper_fields
from frictionsim.solvers.root_finding import hidden_event
from frictionsim.solvers.stepper import non_finite_error, step_underflow

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.contacts import MultiContactMechanism
    from frictionsim.solvers.mechanism import Mechanism

LOG = logging.getLogger(__name__)

# Samples and events between two calls of `on_step`, as Python and compiled.
PYTHON_BUFFERS = 64, 4
COMPILED_BUFFERS = 4096, 512
SECONDS_OF_A_CALL = 0.1  # of compiled code, which is not interrupted
FIRST_CALL = 1000.0  # steps
# After so many calls as Python, a run that has as many steps left is compiled: code on the disk
# takes half a second, a compilation some twelve, a step of one contact as Python 20 us. A sample
# within a step takes nearly as many evaluations as a step.
PATIENCE = 2000
EVALUATIONS_OF_A_STEP = 6.0
STEPS_THAT_PAY, STEPS_THAT_PAY_COMPILING = 40_000.0, 600_000.0
SECONDS_OF_COMPILATION = 10.0  # on an idle core
_python_steps: Counter[Any] = Counter()  # of this process, by the form of the kernel


@contextmanager
def named_failures(problem: Problem, settings: "SolverSettings") -> Iterator[None]:
    """Report the failures of a run by their errors."""
    try:
        yield
    except Failure as failure:
        raise error_of(failure, problem, settings) from None
    except ArithmeticError:
        t = problem.state[layout.TIME]
        raise NonFinite(
            f"after t = {t:.9g} s {problem.subject} exceeds the range of double precision; check"
            " the scenario for forces or inertias that are far too large or too small"
        ) from None


def error_of(failure: Failure, problem: Problem, settings: "SolverSettings") -> FrictionsimError:
    """Return the error with which the run ends."""
    t, x, y, z = failure.numbers
    what = problem.subject
    if failure.reason == layout.TOO_MANY_STEPS:
        return BudgetExceeded(
            f"limit of {settings.max_steps} steps reached at t = {t:.9g} s of {what};"
            f" {problem.budget_advice} (unless a short time constant, such as inertia over"
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
    if failure.reason == layout.NO_MODES:
        return SolverError(
            f"at t = {t:.9g} s no combination of sticking, sliding and slack satisfies the"
            f" equations of {what}: the friction is too large for them; check the coefficients"
            " of friction and the radius of the shaft"
        )
    return chattering_error(t, problem.change, CHATTERING_EVENTS, x, problem.advice)


class StatePart:
    """Some numbers of the state by name, as attributes: a part of a checkpoint."""

    _problem: Problem
    _state: "array[float]"
    CHECKPOINT_FIELDS: tuple[str, ...]

    def __init__(self, problem: Problem, fields: Mapping[str, Field]) -> None:
        self.__dict__.update(_problem=problem, _state=problem.state, _fields=fields)
        self.__dict__.update(CHECKPOINT_FIELDS=tuple(fields))

    def __getattr__(self, name: str) -> Any:
        field = self.__dict__["_fields"].get(name)
        if field is None:
            raise AttributeError(name)
        if field.kind is list:
            return self._state[field.place : field.place + field.length].tolist()
        return field.kind(self._state[field.place])

    def __setattr__(self, name: str, value: Any) -> None:
        field = self.__dict__["_fields"][name]
        if field.kind is list:
            self._state[field.place : field.place + len(value)] = array("d", value)
        else:
            self._state[field.place] = value


class SolverPart(StatePart):
    """The numbers of the phase."""

    def restored(self) -> None:
        """Set what follows from the fields."""
        self._problem.restored()


class StepperPart(StatePart):
    """The numbers of the integrator."""

    def restored(self) -> None:
        """Give the part of a run that begins now all the steps of the limit."""
        self._state[layout.GRANTED] = self.steps + self.rejected


class SwitchTimes:
    """The times of the last changes of mode, of the oldest first: a part of a checkpoint."""

    CHECKPOINT_FIELDS = ("_times",)

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
    mechanism : Mechanism or MultiContactMechanism
    settings : SolverSettings
    buffer : SampleBuffer
        Receives samples and transitions.

    Attributes
    ----------
    stepper : StatePart
        With `steps`, `rejected` and `nfev`.
    """

    def __init__(
        self,
        mechanism: "Mechanism | MultiContactMechanism",
        settings: "SolverSettings",
        buffer: SampleBuffer,
    ) -> None:
        problem = problem_of(mechanism, settings, buffer)
        self._problem, self._settings, self._buffer = problem, settings, buffer
        self._run, self._state = problem.run, problem.state
        self._kernel = kernel_of(problem)
        self._compiled: Any = None
        self._compiled_buffers: tuple[array[float], array[float]] | None = None
        self._steps_of_a_call = FIRST_CALL
        self._patience = PATIENCE
        self._is_long = False
        self._solver = SolverPart(problem, problem.fields)
        self.stepper = StepperPart(problem, stepper_fields(problem.run.states))

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

    def run(self, on_step: Callable[[float], object]) -> bool:
        """Integrate to the end, from the start or from where the last call ended.

        `on_step` is called with the time between steps; it may raise Interrupted.

        Returns
        -------
        bool
            True if the rest is so long that it pays to `compile` first.
        """
        with named_failures(self._problem, self._settings):
            return self._integrate(on_step)

    @property
    def is_to_be_compiled(self) -> bool:
        """Whether it pays to compile the rest of the run."""
        return self._is_long or self._pays_already()

    @property
    def compile_seconds(self) -> float:
        """How long `compile` should take, s; 0 if the code is at hand."""
        return 0.0 if self._kernel.is_at_hand else SECONDS_OF_COMPILATION

    def compile(self) -> None:
        """Have the rest of the run compiled, if that is possible."""
        self._is_long = False
        self._patience = -1
        self._compiled = compiled_for(self._kernel, self._problem)

    def _integrate(self, on_step: Callable[[float], object]) -> bool:
        s, times = self._state, self._buffer.times
        self._run = self._run._replace(given=times.given)
        s[layout.NEXT_SAMPLE], s[layout.NEXT_TIME] = times.count, times.next
        if self._compiled is None and self._patience >= 0 and self._kernel.is_loaded:
            self.compile()
        integrate, system = self._problem.integrate, self._problem.system
        start, buffers, calls = s[layout.TIME], buffers_of(self._problem, *PYTHON_BUFFERS), 0
        evaluations = s[layout.EVALUATIONS]
        while True:
            on_step(s[layout.TIME])
            if self._compiled is not None:
                status = self._piece_of_a_call()
            else:
                calls += 1
                try:
                    status = integrate(system, self._run, s, *buffers, 1.0)
                finally:
                    self._take(*buffers)
                if calls == self._patience:
                    self._is_long = self._pays(self._steps_since(evaluations), start)
                    if self._is_long:
                        return True
            if status == DONE:
                if self._compiled is None:
                    self._count(int(self._steps_since(evaluations)))
                return False

    def _steps_since(self, evaluations: float) -> float:
        """Return how many steps of one contact take as long as what followed evaluations."""
        done = self._state[layout.EVALUATIONS] - evaluations
        return self._problem.cost * done / EVALUATIONS_OF_A_STEP

    def _count(self, steps: int) -> None:
        """Count steps as Python; those of a long run for later processes, too."""
        kernel = self._kernel
        if not kernel.reason:
            _python_steps[kernel.form] += steps
            if steps > STEPS_THAT_PAY:
                kernel.count_steps_as_python(steps)

    def _pays_already(self) -> bool:
        """Return whether earlier Python steps took longer than a compilation.

        What was run often, as in a sweep or a fit, will be run again.
        """
        kernel = self._kernel
        if self._compiled is not None or self._patience < 0 or kernel.reason or kernel.is_loaded:
            return False
        steps = _python_steps[kernel.form]
        return steps > STEPS_THAT_PAY_COMPILING or (steps > STEPS_THAT_PAY and kernel.is_at_hand)

    def _pays(self, done: float, start: float) -> bool:
        """Return whether it pays to compile the rest after so many steps from a start, s.

        A compilation is worth the steps that this run and those of earlier processes take without.
        """
        kernel, t = self._kernel, self._state[layout.TIME]
        steps = done * (self._run.end - t) / (t - start) if t > start else inf
        if not steps > STEPS_THAT_PAY:
            return False
        if kernel.reason:
            LOG.info("the rest of the run is not compiled: %s", kernel.reason)
            return False
        return steps + kernel.steps_as_python > STEPS_THAT_PAY_COMPILING or kernel.is_at_hand

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
            self._compiled = None
            LOG.info(
                "compiled code failed at t = %.9g s; Python repeats the step to report the reason",
                self._state[layout.TIME],
            )
        seconds = max(perf_counter() - started, 1e-6)
        growth = min(SECONDS_OF_A_CALL / seconds, 10.0)
        self._steps_of_a_call = max(1.0, self._steps_of_a_call * growth)
        return status

    def _piece_compiled(self, function: Any, steps: float) -> int:
        if self._compiled_buffers is None:
            self._compiled_buffers = buffers_of(self._problem, *COMPILED_BUFFERS)
            self._arguments = packed((self._problem.system, self._run))
        buffers = arrays(self._state, *self._compiled_buffers)
        status: int = function(*self._arguments, *buffers, steps)
        self._take(*self._compiled_buffers)
        return status

    def _take(self, rows: "array[float]", events: "array[float]") -> None:
        """Add the samples and events in the buffers to those of the run."""
        s, buffer, width = self._state, self._buffer, self._run.columns
        buffer.rows.extend(rows[: int(s[layout.ROWS]) * width])
        buffer.times.set_next(int(s[layout.NEXT_SAMPLE]))
        for k in range(int(s[layout.EVENTS])):
            at = k * (EVENT_COLUMNS + 2 * width)
            number, t, before, after, position = events[at : at + EVENT_COLUMNS]
            name = self._problem.event_names[int(number)]
            buffer.transitions.append(Transition(t, name, int(before), int(after), position))
            buffer.sides.extend(events[at + EVENT_COLUMNS : at + EVENT_COLUMNS + 2 * width])


SOLVER = EventDrivenSolver


def buffers_of(problem: Problem, rows: int, events: int) -> "tuple[array[float], array[float]]":
    """Return buffers for so many samples and events, for one of each contact at least."""
    run, contacts = problem.run, problem.contacts
    rows = max(1, min(rows, len(run.given) or int(run.last) + 2))  # of which the run has no more
    events = max(events // contacts, 1) * contacts
    size = events * (EVENT_COLUMNS + 2 * run.columns)
    return array("d", bytes(8 * rows * run.columns)), array("d", bytes(8 * size))


def arrays(state: "array[float]", rows: "array[float]", events: "array[float]") -> tuple[Any, ...]:
    """Return state, buffers and progress of one run as compiled code takes them, in place."""
    import numpy as np  # imported here because a run as Python does not need it

    return np.frombuffer(state)[None], np.frombuffer(rows), np.frombuffer(events), np.zeros(3)


def compiled_for(kernel: Kernel, problem: Problem) -> Any:
    """Return the compiled loop for problems of one form; None if there is none."""
    s = array("d", bytes(8 * len(problem.state)))
    s[layout.STARTED] = 1.0  # no step follows, so that nothing is evaluated
    arguments = *packed((problem.system, problem.run)), *arrays(s, *buffers_of(problem, 1, 1))
    return kernel.compiled(lambda function: function(*arguments, 0.0))


def kernel_of(problem: Problem) -> Kernel:
    """Return the kernel for the runs of a form."""
    return Kernel(integrate_runs, (problem.system, problem.run))
