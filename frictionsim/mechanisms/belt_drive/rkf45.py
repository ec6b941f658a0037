"""Adaptive RKF4(5) for belt drives, compiled, with set-valued friction in the right-hand side.

The stages, the error estimate and the choice of steps are those of
`frictionsim.solvers.rkf45`; the loop around them works on arrays without allocation.
The solution that is propagated is y5 + s (y5 - y4), s = DISSIPATION, of order 4: it takes energy
out of every wave that a step resolves, where Fehlberg's solution of order 5 puts energy in
(`stability.md` in this folder). A step is never longer than the waves in the belt allow: error
control alone would hover at the stability limit, rejecting every other step.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.errors import NonFinite, StepUnderflow
from frictionsim.mechanisms.belt_drive.belt import Array, Belt, Indices, Line, aligned
from frictionsim.mechanisms.belt_drive.compilation import kernel, loop, part
from frictionsim.mechanisms.belt_drive.equilibrium import Rest
from frictionsim.mechanisms.belt_drive.kernels import copy, rhs, search, update_modes
from frictionsim.mechanisms.belt_drive.limits import ComplexArray, error_scales, wave_eigenvalues
from frictionsim.solvers import rkf45 as rkf
from frictionsim.solvers.rkf45 import MIN_ERROR_NORM

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

SEARCH_INTERVAL = 8  # steps from one search for bodies near a pulley to the next

# The numbers in `clock`: start and end of the last step, the length of the next one, s, and the
# error of the last one, in tolerances.
T_OLD, T, H, ERROR = range(4)
# The numbers in `counts`: the last one is the steps since the search.
STEPS, REJECTED, NFEV, SINCE_SEARCH = range(4)

FIRST_STEP_RATIO = 0.01  # of the longest step
# Seconds on one core at about 3 GHz, with contact, damping, bending and friction; less with fewer
# effects; shown to users only.
COMPILE_SECONDS = 7.0

RUNNING, NON_FINITE, TOO_SHORT = range(3)
START, STEP, INTERPOLATE = range(3)  # tasks

# The weight s of the error estimate in the solution that is propagated, its coefficients, and those
# of its stability polynomial R, the highest power first (`stability.md`).
DISSIPATION = 0.8
ERRORS = (rkf.E1, rkf.E3, rkf.E4, rkf.E5, rkf.E6)
ORDER_5 = (rkf.B1, rkf.B3, rkf.B4, rkf.B5, rkf.B6)
SOLUTION = tuple(b + DISSIPATION * e for b, e in zip(ORDER_5, ERRORS, strict=True))
R6, R5 = (1.0 + DISSIPATION) / 2080, 1 / 120 - DISSIPATION * (1 / 104 - 1 / 120)
STABILITY_POLYNOMIAL = (R6, R5, 1 / 24, 1 / 6, 1 / 2, 1.0, 1.0)
STABILITY_MARGIN = 0.985  # of the longest stable step

STAGE_2 = (rkf.A21,)
STAGE_3 = (rkf.A31, rkf.A32)
STAGE_4 = (rkf.A41, rkf.A42, rkf.A43)
STAGE_5 = (rkf.A51, rkf.A52, rkf.A53, rkf.A54)
STAGE_6 = (rkf.A61, rkf.A62, rkf.A63, rkf.A64, rkf.A65)

clipped_step = part(rkf.clipped_step)
reduced_step = part(rkf.reduced_step)
next_step_size = part(rkf.next_step_size)


class RKF45State(NamedTuple):
    """An integration between two steps, in arrays, (size,), that its kernels write to."""

    y_old: Array  # the state at the start of the last step
    y: Array  # and at its end
    k0: Array  # the rates of its stages, k0 at its start
    k1: Array
    k2: Array
    k3: Array
    k4: Array
    k5: Array
    f: Array  # those at its end
    stage: Array  # workspace
    inside: Array  # the state that was interpolated
    inv_scale: Array  # 1 over the error that a step may make in each state, 0 for an energy
    clock: Array  # (4,)
    counts: Indices  # (4,)


@loop
def advanced(
    h: float,
    c: tuple[float, ...],
    y: Array,
    out: Array,
    k1: Array,
    k2: Array | None = None,
    k3: Array | None = None,
    k4: Array | None = None,
    k5: Array | None = None,
) -> None:
    """Write y + h (c1 k1 + c2 k2 + ...), of as many rates as there are."""
    for i in range(len(y)):
        total = c[0] * k1[i]
        if k2 is not None:
            total += c[1] * k2[i]
        if k3 is not None:
            total += c[2] * k3[i]
        if k4 is not None:
            total += c[3] * k4[i]
        if k5 is not None:
            total += c[4] * k5[i]
        out[i] = y[i] + h * total


@loop
def error_norm(
    h: float, k1: Array, k3: Array, k4: Array, k5: Array, k6: Array, inv_scale: Array
) -> float:
    """Return the norm of the error of a step, each state's in units of what it may be.

    The norm of order 16 is the largest error, or at most 1.8 times that where all of 10 000 states
    err alike: an error at one place counts in full however many bodies there are. In contrast to a
    maximum its loop is vectorised, and an error that is not a number stays noticed.
    """
    total = 0.0
    for i in range(len(k1)):
        e = rkf.E1 * k1[i] + rkf.E3 * k3[i] + rkf.E4 * k4[i] + rkf.E5 * k5[i] + rkf.E6 * k6[i]
        e2 = (h * e * inv_scale[i]) ** 2
        e4 = e2 * e2
        e8 = e4 * e4
        total += e8 * e8
    return np.sqrt(np.sqrt(np.sqrt(np.sqrt(total))))


@kernel
def advance(
    task: int,
    s: RKF45State,
    max_step: float,
    distinct: bool,
    limit: float,
    sample: float,
    trials: int,
    b: Belt,
    plane: bool | None,
    line: Line | None,
    inv_tau: float | None,
    wear: bool | None,
) -> int:
    """Evaluate the start, take steps, or interpolate in the last step.

    START searches for bodies near pulleys and evaluates the rates at the start. STEP steps until
    the limit, s, is reached, or a sample time passed, or so many steps are tried; it returns
    RUNNING, or why no further step could be taken from (t, y). INTERPOLATE writes the state at the
    time `sample` in the last step, that of a shorter step; the belt's rows have the forces there.
    With `distinct` static friction modes have to be remembered. The last four arguments are those
    of the belt. All tasks share one place where the stages stand, and are in one kernel: each that
    calls `rhs` holds a copy of it, which takes seconds to compile.
    """
    clock, counts = s.clock, s.counts
    k0, k1, k2, k3, k4, k5, z = s.k0, s.k1, s.k2, s.k3, s.k4, s.k5, s.stage
    kin = s.y[: b.angles].reshape((b.angles // b.width, b.width))
    if task == START:
        b.n_runs[0] = 0
        # Modes depend on the speeds.
        rhs(clock[T], clock[H], s.y, s.f, b, plane, line, inv_tau, wear)
        search(b, kin, plane, line, b.wrap)
        rhs(clock[T], clock[H], s.y, s.f, b, plane, line, inv_tau, wear)
        return RUNNING
    if task == INTERPOLATE and sample >= clock[T]:
        copy(s.y, s.inside)
        rhs(sample, sample - clock[T_OLD], s.inside, z, b, plane, line, inv_tau, wear)
        return RUNNING
    last = counts[STEPS] + counts[REJECTED] + trials
    t, h, y_new, rejected_here = clock[T_OLD], sample - clock[T_OLD], s.inside, False
    while True:
        if task == STEP:
            if not rejected_here:
                tried = counts[STEPS] + counts[REJECTED]
                if clock[T] >= limit or clock[T] >= sample or tried >= last:
                    return RUNNING
                if counts[SINCE_SEARCH] >= SEARCH_INTERVAL:
                    search(b, kin, plane, line, b.wrap)
                    counts[SINCE_SEARCH] = 0
                copy(s.y, s.y_old)
                copy(s.f, k0)
                t, y_new = clock[T], s.y
            h = clipped_step(min(clock[H], max_step), limit - t)
        advanced(h, STAGE_2, s.y_old, z, k0)
        rhs(t + rkf.C2 * h, h, z, k1, b, plane, line, inv_tau, wear)
        advanced(h, STAGE_3, s.y_old, z, k0, k1)
        rhs(t + rkf.C3 * h, h, z, k2, b, plane, line, inv_tau, wear)
        advanced(h, STAGE_4, s.y_old, z, k0, k1, k2)
        rhs(t + rkf.C4 * h, h, z, k3, b, plane, line, inv_tau, wear)
        advanced(h, STAGE_5, s.y_old, z, k0, k1, k2, k3)
        rhs(t + h, h, z, k4, b, plane, line, inv_tau, wear)
        advanced(h, STAGE_6, s.y_old, z, k0, k1, k2, k3, k4)
        rhs(t + rkf.C6 * h, h, z, k5, b, plane, line, inv_tau, wear)
        advanced(h, SOLUTION, s.y_old, y_new, k0, k2, k3, k4, k5)
        if task == INTERPOLATE:
            rhs(sample, h, y_new, z, b, plane, line, inv_tau, wear)
            return RUNNING
        error = error_norm(h, k0, k2, k3, k4, k5, s.inv_scale)
        counts[NFEV] += 5
        if not error <= 1.0:
            rejected_here = True
            counts[REJECTED] += 1
            if not error < np.inf and h < 1e-3 * max_step:
                trouble = NON_FINITE
            else:
                clock[H] = reduced_step(h, min(error, 1e10)) if error == error else 0.2 * h
                trouble = TOO_SHORT if clock[H] < 4e-16 * limit else RUNNING
            if trouble != RUNNING:
                copy(s.y_old, s.y)
                return trouble
            continue
        clock[T_OLD], clock[T] = t, limit if h == limit - t else t + h
        rhs(clock[T], h, s.y, s.f, b, plane, line, inv_tau, wear)
        counts[NFEV] += 1
        counts[STEPS] += 1
        counts[SINCE_SEARCH] += 1
        error = max(error, MIN_ERROR_NORM)
        clock[H] = next_step_size(h, clock[H], error, clock[ERROR], rejected_here, max_step)
        clock[ERROR], rejected_here = error, False
        if distinct and update_modes(b):
            # Other limits of friction: the rates jump.
            rhs(clock[T], clock[H], s.y, s.f, b, plane, line, inv_tau, wear)
            counts[NFEV] += 1


def max_stable_step(eigenvalues: ComplexArray) -> float:
    """Return the longest step h, s, up to which |R(h lambda)| <= 1 for all lambda, 1/s."""
    fastest = float(np.max(np.abs(eigenvalues)))
    upper = eigenvalues[eigenvalues.imag >= 0.0] / fastest  # one of each conjugate pair
    products = np.linspace(0.0, 5.0, 1001)[1:]  # h times the fastest; beyond 4.3 none is stable
    growth = np.abs(np.polyval(STABILITY_POLYNOMIAL, np.outer(products, upper)))
    first_unstable = int(np.argmax(np.max(growth, axis=1) > 1.0 + 1e-9))
    return float(products[first_unstable - 1]) / fastest


class RKF45Stepper:
    """A belt drive between two adaptive steps.

    Parameters
    ----------
    belt : Belt
    state : (size,)
        At the start.
    rest : Rest
        The belt at rest.
    settings : BeltSolverSettings
    """

    force_per_impulse = 1.0  # contacts hold forces, N
    compile_seconds = COMPILE_SECONDS
    warnings: tuple[str, ...] = ()  # it solves to the end, or fails

    def __init__(
        self,
        belt: Belt,
        state: Array,
        rest: Rest,
        settings: "BeltSolverSettings",
    ) -> None:
        self._belt, self._distinct = belt, belt.distinct
        stable = STABILITY_MARGIN * max_stable_step(wave_eigenvalues(belt, rest))
        self._max_step = min(stable, settings.max_step or np.inf)
        vectors = aligned(12, belt.size)
        inv_scale = vectors[11]
        inv_scale[:] = 1.0 / (settings.rtol * error_scales(belt, rest))
        clock = np.array([0.0, 0.0, FIRST_STEP_RATIO * self._max_step, 1.0])
        self._state = RKF45State._make([*vectors, clock, np.zeros(4, dtype=np.int64)])
        self._state.y[:] = self._state.y_old[:] = state
        self._pulleys: Array | None = None  # as the last step left them, while a sample is seen

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
        """Search for bodies near pulleys and evaluate the rates at the start."""
        self._run(START, self.t, self.t, 0)
        self._state.counts[NFEV] += 1

    def compile(self) -> None:
        """Have the kernel compiled, by taking no step."""
        self.advance(self.t, self.t, 0)

    def _run(self, task: int, limit: float, sample: float, trials: int) -> int:
        b, longest, times = self._belt, self._max_step, (float(limit), float(sample))
        own = b, b.plane, b.line, b.inv_tau, b.wear
        trouble: int = advance(task, self._state, longest, self._distinct, *times, trials, *own)
        return trouble

    def advance(self, limit: float, sample: float, steps: int) -> None:
        """Step until a limit, s, at which a step ends, or past a sample time, or so many steps."""
        self._restore_pulleys()
        trouble = self._run(STEP, limit, sample, steps)
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
        """Return the state at a time in the last step; the belt's rows have the forces there.

        It is that of a shorter step. Samples change no bit of a run: rows of contacts are written
        before the next steps read them, and those of pulleys, from which the search for their
        accelerations starts, are put back.
        """
        if self._pulleys is None:
            self._pulleys = self._belt.pul.copy()
        self._run(INTERPOLATE, t, t, 0)
        return self._state.inside

    def _restore_pulleys(self) -> None:
        if self._pulleys is not None:
            self._belt.pul[:] = self._pulleys
            self._pulleys = None

    def arrays(self) -> dict[str, Array | Indices]:
        """Return all that the next steps depend on, by name; writing to them restores it."""
        self._restore_pulleys()
        s = self._state
        own: dict[str, Array | Indices] = {"y": s.y, "f": s.f, "clock": s.clock, "counts": s.counts}
        return own | self._belt.arrays()
