"""Adaptive RKF4(5) for belt drives, compiled, with set-valued friction in the right-hand side.

The stages, the error estimate and the choice of steps are those of
`frictionsim.solvers.runge_kutta_fehlberg`; the loop around them works on arrays without allocation.
The solution that is propagated is y5 + s (y5 - y4), s = DISSIPATION, of order 4: it takes energy
out of every wave that a step resolves, where Fehlberg's solution of order 5 puts energy in
(`stability.md` in this folder). A step is never longer than the waves in the belt allow: error
control alone would hover at the stability limit, rejecting every other step.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import NonFinite, StepUnderflow
from frictionsim.mechanisms.belt_drive.equation import (
    find_contact_candidates,
    prescribed_speeds,
    rhs,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import update_contact_modes
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel, shared_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    FRICTION,
    SLIP,
    STICKING,
    Array,
    Indices,
    System,
    copy,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.steppers.base import Stepper
from frictionsim.solvers import runge_kutta_fehlberg, stepper
from frictionsim.solvers.runge_kutta_fehlberg import (
    B1,
    B3,
    B4,
    B5,
    B6,
    C2,
    C3,
    C4,
    C6,
    E1,
    E3,
    E4,
    E5,
    E6,
)
from frictionsim.solvers.stepper import MIN_ERROR_NORM

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings


CANDIDATE_UPDATE_INTERVAL = 8  # steps from one search for contact candidates to the next

# The numbers in `clock`: start and end of the last step, the length of the next one, s, and the
# error of the last one, in tolerances.
T_OLD, T, H, ERROR = range(4)
# The numbers in `counts`: the last one is the steps since the search for candidates.
STEPS, REJECTED, NFEV, SINCE_SEARCH = range(4)


class RKF45State(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y_old, y : (size,)
        The states at the start and the end of the last step.
    k : six of (size,)
        The rates of its stages; k[0] are those at its start.
    f : (size,)
        The rates at its end.
    kinematics : (6, width)
        Those that y begins with: a view.
    stage, error, inside : (size,)
        Workspace.
    inv_error_scale : (size,)
        1 over the error that a step may make in each state, 0 for an energy.
    clock : (4,)
        T_OLD, T, H, ERROR.
    counts : (4,)
        STEPS, REJECTED, NFEV, SINCE_SEARCH.
    """

    y_old: Array
    y: Array
    k: tuple[Array, ...]
    f: Array
    kinematics: Array
    stage: Array
    error: Array
    inside: Array
    inv_error_scale: Array
    clock: Array
    counts: Indices


stage_2 = inline_kernel(runge_kutta_fehlberg.stage_2)
stage_3 = inline_kernel(runge_kutta_fehlberg.stage_3)
stage_4 = inline_kernel(runge_kutta_fehlberg.stage_4)
stage_5 = inline_kernel(runge_kutta_fehlberg.stage_5)
stage_6 = inline_kernel(runge_kutta_fehlberg.stage_6)
error_estimate_5 = inline_kernel(runge_kutta_fehlberg.error_estimate_5)
clipped_step = inline_kernel(stepper.clipped_step)
reduced_step = inline_kernel(stepper.reduced_step)
next_step_size = inline_kernel(stepper.next_step_size)

FIRST_STEP_RATIO = 0.01  # of the longest step

# Seconds on one core at about 3 GHz, with contact, damping, bending and friction; less with fewer
# effects; shown to users only.
COMPILE_SECONDS = 12.0

RUNNING, NON_FINITE, TOO_SHORT = 0, 1, 2
START, STEP, INTERPOLATE = range(3)  # tasks

# The weight s of the error estimate in the solution that is propagated, its coefficients, and those
# of its stability polynomial R, the highest power first (`stability.md`).
DISSIPATION = 0.8
D1, D3, D4, D5, D6 = (
    b + DISSIPATION * e for b, e in ((B1, E1), (B3, E3), (B4, E4), (B5, E5), (B6, E6))
)
R6, R5 = (1.0 + DISSIPATION) / 2080, 1 / 120 - DISSIPATION * (1 / 104 - 1 / 120)
STABILITY_POLYNOMIAL = (R6, R5, 1 / 24, 1 / 6, 1 / 2, 1.0, 1.0)
STABILITY_MARGIN = 0.985  # of the longest stable step


class StepControl(NamedTuple):
    """What the choice of steps goes by.

    Attributes
    ----------
    max_step : float, s
    distinct_static_friction : bool
        Static and kinetic friction differ: modes have to be remembered.
    """

    max_step: float
    distinct_static_friction: bool


@kernel
def advance(
    task: int,
    state: RKF45State,
    control: StepControl,
    limit: float,
    sample: float,
    max_trials: int,
    system: System,
) -> int:
    """Evaluate the start, take steps, or interpolate in the last step.

    Each kernel that calls `rhs` holds a copy of it, which takes seconds to compile: so this one
    has all the tasks. START searches for candidates and evaluates the rates at the start. STEP
    steps until the limit, s, is reached, or a sample time passed, or `max_trials` steps are tried;
    it returns RUNNING, or why no further step could be taken from (t, y). INTERPOLATE writes the
    state at the time `sample` in the last step, that of a shorter step; the system has the forces
    there.
    """
    clock, counts = state.clock, state.counts
    if task == START:
        prescribed_speeds(clock[T], system)  # initial modes depend on them
        find_contact_candidates(system, state.kinematics)
        rhs(clock[T], clock[H], state.y, state.f, system)
        return RUNNING
    if task == INTERPOLATE:
        h = sample - clock[T_OLD]
        if sample < clock[T]:
            stages(clock[T_OLD], h, state.y_old, state.k, state.stage, state.inside, system)
        else:
            copy(state.y, state.inside)
        rhs(sample, h, state.inside, state.stage, system)
        return RUNNING
    last = counts[STEPS] + counts[REJECTED] + max_trials
    while clock[T] < limit and clock[T] < sample and counts[STEPS] + counts[REJECTED] < last:
        if counts[SINCE_SEARCH] >= CANDIDATE_UPDATE_INTERVAL:
            find_contact_candidates(system, state.kinematics)
            counts[SINCE_SEARCH] = 0
        copy(state.y, state.y_old)
        copy(state.f, state.k[0])
        t, rejected_here = clock[T], False
        while True:
            h = clipped_step(min(clock[H], control.max_step), limit - t)
            stages(t, h, state.y_old, state.k, state.stage, state.y, system)
            error = error_norm(h, state)
            if error <= 1.0:
                break
            rejected_here = True
            trouble = reduce_step(h, error, limit, state, control)
            if trouble != RUNNING:
                copy(state.y_old, state.y)
                return trouble
        clock[T_OLD], clock[T] = t, limit if h == limit - t else t + h
        rhs(clock[T], h, state.y, state.f, system)
        counts[NFEV] += 1
        choose_next_step(h, error, rejected_here, state, control)
        if control.distinct_static_friction and update_contact_modes(system.contacts):
            # Other limits of friction: the rates jump.
            rhs(clock[T], clock[H], state.y, state.f, system)
            counts[NFEV] += 1
    return RUNNING


@shared_kernel
def stages(
    t: float, h: float, y: Array, k: tuple[Array, ...], stage: Array, y_new: Array, system: System
) -> None:
    """Write the solution at the end of a step, and the rates k of its stages."""
    stage_2(h, y, k[0], stage)
    rhs(t + C2 * h, h, stage, k[1], system)
    stage_3(h, y, k[0], k[1], stage)
    rhs(t + C3 * h, h, stage, k[2], system)
    stage_4(h, y, k[0], k[1], k[2], stage)
    rhs(t + C4 * h, h, stage, k[3], system)
    stage_5(h, y, k[0], k[1], k[2], k[3], stage)
    rhs(t + h, h, stage, k[4], system)
    stage_6(h, y, k[0], k[1], k[2], k[3], k[4], stage)
    rhs(t + C6 * h, h, stage, k[5], system)
    dissipative_solution(h, y, k, y_new)


@inline_kernel
def dissipative_solution(h: float, y: Array, k: tuple[Array, ...], y_new: Array) -> None:
    """Write y5 + s (y5 - y4) at t + h, of order 4."""
    for i in range(len(y)):
        y_new[i] = y[i] + h * (D1 * k[0][i] + D3 * k[2][i] + D4 * k[3][i])
    for i in range(len(y)):
        y_new[i] += h * (D5 * k[4][i] + D6 * k[5][i])


@inline_kernel
def error_norm(h: float, state: RKF45State) -> float:
    """Return the norm of the error of a step, each state's in units of what it may be.

    The norm of order 16 is the largest error, or at most 1.8 times that where all of 10 000 states
    err alike: an error at one place counts in full however many bodies there are. In contrast to a
    maximum its loop is vectorised, and an error that is not a number stays noticed.
    """
    k, error, inv_error_scale = state.k, state.error, state.inv_error_scale
    error_estimate_5(h, k[0], k[2], k[3], k[4], k[5], error)
    state.counts[NFEV] += 5
    total = 0.0
    for i in range(len(error)):
        e2 = (error[i] * inv_error_scale[i]) ** 2
        e4 = e2 * e2
        e8 = e4 * e4
        total += e8 * e8
    return np.sqrt(np.sqrt(np.sqrt(np.sqrt(total))))


@inline_kernel
def reduce_step(
    h: float, error: float, limit: float, state: RKF45State, control: StepControl
) -> int:
    """Set the length to try next after a step that is rejected; return why there is none."""
    clock = state.clock
    state.counts[REJECTED] += 1
    if not error < np.inf and h < 1e-3 * control.max_step:
        return NON_FINITE
    clock[H] = reduced_step(h, min(error, 1e10)) if error == error else 0.2 * h
    return TOO_SHORT if clock[H] < 4e-16 * limit else RUNNING


@inline_kernel
def choose_next_step(
    h: float, error: float, rejected_here: bool, state: RKF45State, control: StepControl
) -> None:
    """Set the length of the step after one that was accepted."""
    clock, counts = state.clock, state.counts
    counts[STEPS] += 1
    counts[SINCE_SEARCH] += 1
    error = max(error, MIN_ERROR_NORM)
    clock[H] = next_step_size(h, clock[H], error, clock[ERROR], rejected_here, control.max_step)
    clock[ERROR] = error


def max_stable_step(eigenvalues: "npt.NDArray[np.complex128]") -> float:
    """Return the longest step h, s, up to which |R(h lambda)| <= 1 for all lambda, 1/s."""
    fastest = float(np.max(np.abs(eigenvalues)))
    upper = eigenvalues[eigenvalues.imag >= 0.0] / fastest  # one of each conjugate pair
    products = np.arange(0.02, 5.0, 0.02)  # h times the fastest; beyond 4.6 none is stable
    growth = np.abs(np.polyval(STABILITY_POLYNOMIAL, np.outer(products, upper)))
    first_unstable = int(np.argmax(np.max(growth, axis=1) > 1.0 + 1e-9))
    return float(products[first_unstable - 1]) / fastest


class RKF45Stepper(Stepper):
    """A belt drive between two adaptive steps."""

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        super().__init__(model)
        self._system = system = model.system
        stable = STABILITY_MARGIN * max_stable_step(model.eigenvalues)
        max_step = min(stable, settings.max_step or np.inf)
        self._control = StepControl(max_step, model.distinct_static_friction)

        def vector() -> Array:
            return zero_state(system.layout)

        y = vector()
        self._state = RKF45State(
            y_old=vector(),
            y=y,
            k=tuple(vector() for _ in range(6)),
            f=vector(),
            kinematics=kinematics_of(y, system.layout),
            stage=vector(),
            error=vector(),
            inside=vector(),
            inv_error_scale=1.0 / (settings.rtol * model.error_scales),
            clock=np.array([0.0, 0.0, FIRST_STEP_RATIO * max_step, 1.0]),
            counts=np.zeros(4, dtype=np.int64),
        )
        self._state.y[:] = self._state.y_old[:] = model.state
        self._contacts: Array | None = None  # as the last step left them, while a sample is seen

    @property
    def compile_seconds(self) -> float:
        """The expected time of the compilation of its kernel, s."""
        return COMPILE_SECONDS

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._state.clock[T])

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        counts = self._state.counts
        return int(counts[STEPS]), int(counts[REJECTED]), int(counts[NFEV])

    def start(self) -> None:
        """Search for candidates and evaluate the rates at the start."""
        self._run(START, self.t, self.t, 0)
        self._state.counts[NFEV] += 1

    def prepare(self) -> None:
        """Have the kernel compiled, by taking no step."""
        self.advance(self.t, self.t, 0)

    def _run(self, task: int, limit: float, sample: float, max_steps: int) -> Any:
        state, control = self._state, self._control
        return advance(task, state, control, float(limit), float(sample), max_steps, self._system)

    def advance(self, limit: float, sample: float, max_steps: int) -> None:
        """Step until a limit, s, at which a step ends, or past a sample time, or `max_steps`."""
        self._restore_contacts()
        trouble = self._run(STEP, limit, sample, max_steps)
        if trouble == NON_FINITE:
            raise NonFinite(
                f"the state is not finite after t = {self.t:.9g} s; is a stiffness, a torque or a"
                " speed of the scenario too large?"
            )
        if trouble == TOO_SHORT:
            raise StepUnderflow(
                f"at t = {self.t:.9g} s the tolerance asks for a step of"
                f" {self._state.clock[H]:.2g} s,"
                " below what double precision resolves; give a larger solver.rtol"
            )

    def interpolate(self, t: float) -> Array:
        """Return the state at a time in the last step; the system has the forces there.

        It is that of a shorter step. Whatever the next steps depend on is left as it is: samples do
        not change a run.
        """
        s, system = self._state, self._system
        alpha = system.pulleys.table[ALPHA].copy()
        if self._contacts is None:
            self._contacts = system.contacts.table[[SLIP, FRICTION, STICKING]]
        self._run(INTERPOLATE, t, t, 0)
        system.pulleys.table[ALPHA] = alpha
        return s.inside

    def _restore_contacts(self) -> None:
        """Have the contacts slip and stick as the last step left them, whatever was sampled."""
        if self._contacts is not None:
            self._system.contacts.table[[SLIP, FRICTION, STICKING]] = self._contacts
            self._contacts = None

    def _own_arrays(self) -> dict[str, Any]:
        self._restore_contacts()
        s = self._state
        return {"y": s.y, "f": s.f, "clock": s.clock, "counts": s.counts}


STEPPER = RKF45Stepper
