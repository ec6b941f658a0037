"""The adaptive Runge-Kutta-Fehlberg method of order 4(5).

The stages are plain loops over the states, which run on the short lists of mechanisms with few
states; numba compiles the same functions for the arrays of belts. Long sums are split into two
loops, because compilers vectorise loops over a few arrays only.
"""

from collections.abc import Mapping, Sequence
from math import isfinite, ulp
from typing import ClassVar

from frictionsim.errors import BudgetExceeded
from frictionsim.solvers.state_values import COUNT, NON_NEGATIVE, NUMBER, TIME, Values, unfit
from frictionsim.solvers.stepper import (
    MIN_ERROR_NORM,
    STEP_END_TOLERANCE,
    Rhs,
    State,
    clipped_step,
    next_step_size,
    non_finite_error,
    reduced_step,
    step_underflow,
)

# Fehlberg 1969 (NASA TR R-315), table III, formula 2: nodes, stages, order 5, error estimate.
C2, C3, C4, C6 = 1 / 4, 3 / 8, 12 / 13, 1 / 2  # C5 = 1
A21 = 1 / 4
A31, A32 = 3 / 32, 9 / 32
A41, A42, A43 = 1932 / 2197, -7200 / 2197, 7296 / 2197
A51, A52, A53, A54 = 439 / 216, -8.0, 3680 / 513, -845 / 4104
A61, A62, A63, A64, A65 = -8 / 27, 2.0, -3544 / 2565, 1859 / 4104, -11 / 40
B1, B3, B4, B5, B6 = 16 / 135, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55
E1, E3, E4, E5, E6 = 1 / 360, -128 / 4275, -2197 / 75240, 1 / 50, 2 / 55  # order 5 - order 4

MIN_TRIAL_STEP = 1e-100  # s, for the estimate of the first step
# Units in the last place of the time: a step that is cut so short is not repeated.
MIN_REPEATED_ULPS = 16.0


def stage_2(h: float, y: State, k1: State, stage: State) -> None:
    """Write the state of the second stage, at t + C2 h; h is the length of the step, s."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A21 * k1[i])


def stage_3(h: float, y: State, k1: State, k2: State, stage: State) -> None:
    """Write the state of the third stage, at t + C3 h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A31 * k1[i] + A32 * k2[i])


def stage_4(h: float, y: State, k1: State, k2: State, k3: State, stage: State) -> None:
    """Write the state of the fourth stage, at t + C4 h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A41 * k1[i] + A42 * k2[i] + A43 * k3[i])


def stage_5(h: float, y: State, k1: State, k2: State, k3: State, k4: State, stage: State) -> None:
    """Write the state of the fifth stage, at t + h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A51 * k1[i] + A52 * k2[i])
    for i in range(len(y)):
        stage[i] += h * (A53 * k3[i] + A54 * k4[i])


def stage_6(
    h: float, y: State, k1: State, k2: State, k3: State, k4: State, k5: State, stage: State
) -> None:
    """Write the state of the sixth stage, at t + C6 h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A61 * k1[i] + A62 * k2[i] + A63 * k3[i])
    for i in range(len(y)):
        stage[i] += h * (A64 * k4[i] + A65 * k5[i])


def solution_5(
    h: float, y: State, k1: State, k3: State, k4: State, k5: State, k6: State, y_new: State
) -> None:
    """Write the solution of order 5, at t + h."""
    for i in range(len(y)):
        y_new[i] = y[i] + h * (B1 * k1[i] + B3 * k3[i] + B4 * k4[i])
    for i in range(len(y)):
        y_new[i] += h * (B5 * k5[i] + B6 * k6[i])


def error_estimate_5(
    h: float, k1: State, k3: State, k4: State, k5: State, k6: State, error: State
) -> None:
    """Write the difference of the solutions of order 5 and 4."""
    for i in range(len(k1)):
        error[i] = h * (E1 * k1[i] + E3 * k3[i] + E4 * k4[i])
    for i in range(len(k1)):
        error[i] += h * (E5 * k5[i] + E6 * k6[i])


def stages(
    rhs: Rhs,
    t: float,
    h: float,
    y: State,
    k: Sequence[State],
    stage: State,
    y_new: State,
    error: State,
) -> None:
    """Take one step of length h from (t, y), where the derivative k[0] is known.

    Parameters
    ----------
    rhs : callable
    t, h : float, s
    y : (n,)
    k : six of (n,)
        k[0] is read, the others are overwritten.
    stage : (n,)
        Workspace.
    y_new : (n,)
        Receives the solution of order 5.
    error : (n,)
        Receives its difference from the solution of order 4.
    """
    k1, k2, k3, k4, k5, k6 = k
    stage_2(h, y, k1, stage)
    rhs(t + C2 * h, stage, k2)
    stage_3(h, y, k1, k2, stage)
    rhs(t + C3 * h, stage, k3)
    stage_4(h, y, k1, k2, k3, stage)
    rhs(t + C4 * h, stage, k4)
    stage_5(h, y, k1, k2, k3, k4, stage)
    rhs(t + h, stage, k5)
    stage_6(h, y, k1, k2, k3, k4, k5, stage)
    rhs(t + C6 * h, stage, k6)
    solution_5(h, y, k1, k3, k4, k5, k6, y_new)
    error_estimate_5(h, k1, k3, k4, k5, k6, error)


class RungeKuttaFehlberg45:
    """Error-controlled integration over smooth segments.

    `start` starts a segment, `advance` takes one accepted step from (t_old, y_old) to (t, y), and
    `interpolate` returns the state within that step by a shorter step from its start, which is as
    accurate as the step itself.

    Parameters
    ----------
    states : int
    rtol, atol : float
        A step is accepted if |error| <= atol + rtol max(|y_old|, |y|) for every state.
    max_step : float, s
    max_steps : int
        Limit of accepted plus rejected steps.
    fixed_step : float or None, s
        Take steps of this length, whatever their error.
    what : str
        Subject of messages.
    advice : str
        What helps where the limit of steps is reached.

    Attributes
    ----------
    t_old, t : float, s
        Start and end of the last step.
    y_old, y, f_old, f : (n,)
        States and derivatives there.
    steps, rejected, nfev : int
        Accepted steps, rejected steps, evaluations of the right-hand side.
    CHECKPOINT_FIELDS : mapping of str to Values
        The attributes in a checkpoint, and what they may hold.
    """

    CHECKPOINT_FIELDS: ClassVar[Mapping[str, Values]] = {
        "t_old": TIME,
        "t": TIME,
        "y_old": NUMBER,
        "y": NUMBER,
        "f_old": NUMBER,
        # Beyond the range of double precision in a state that a step may end at; the next step
        # fails by name then.
        "f": Values(finite=False),
        "_h": NON_NEGATIVE,  # 0 before the first segment
        "_error_before": Values(low=MIN_ERROR_NORM),
        "steps": COUNT,
        "rejected": COUNT,
        "nfev": COUNT,
    }

    def __init__(
        self,
        states: int,
        rtol: float,
        atol: float,
        max_step: float,
        max_steps: int,
        fixed_step: float | None = None,
        what: str = "the motion",
        advice: str = "raise the limit",
    ) -> None:
        self._advice = advice
        self._rtol, self._atol = rtol, atol
        self._max_step, self._max_steps = max_step, max_steps
        self._fixed_step = fixed_step
        self._what = what
        self._granted = 0  # steps under earlier limits, before a resumption
        self.steps = self.rejected = self.nfev = 0
        self.t_old = self.t = 0.0
        self.y_old: State = [0.0] * states
        self.y: State = [0.0] * states
        self.f_old: State = [0.0] * states
        self.f: State = [0.0] * states
        self._k: list[State] = [[0.0] * states for _ in range(6)]  # the first is f_old
        self._stage: State = [0.0] * states
        self._error: State = [0.0] * states
        self._inside: State = [0.0] * states
        self._inside_error: State = [0.0] * states
        self._h = 0.0
        self._error_before = 1.0

    def start(self, rhs: Rhs, t: float, y: State) -> None:
        """Start a segment at (t, y), with a new initial step size."""
        self._rhs = rhs
        self.t_old = self.t = t
        self.y[:] = self.y_old[:] = y
        rhs(t, self.y, self.f)
        self.nfev += 1
        self._h = self._fixed_step or self._select_initial_step()
        self._error_before = 1.0

    def advance(self, limit: float, floor: float = 0.0) -> None:
        """Take one accepted step that ends at `limit` at the latest.

        Parameters
        ----------
        limit : float, s
        floor : float, s, optional
            A step of this length is accepted whatever its error: across a jump of the derivative
            no step meets the tolerance; the remaining error is floor times the jump.
        """
        self._check_budget()
        self.t_old, self.y_old, self.y = self.t, self.y, self.y_old
        self.f_old, self.f = self.f, self.f_old
        rejected_here = False
        while True:
            h = self._clip_step(limit - self.t_old)
            self._rk_step(h, self.y, self._error)
            error = self._error_norm()
            if not isfinite(error):
                raise non_finite_error(self.t_old, self._what)
            if self._fixed_step or error <= 1.0 or h <= floor:
                break
            self.rejected += 1
            rejected_here = True
            self._h = max(floor, reduced_step(h, error))
            if self._h < 4.0 * ulp(limit):
                raise step_underflow(self.t_old, self._h, self._what)
        self.t = limit if h == limit - self.t_old else self.t_old + h
        self._rhs(self.t, self.y, self.f)
        self.nfev += 1
        self.steps += 1
        if not self._fixed_step:
            self._update_step_size(h, error, rejected_here)

    def _check_budget(self) -> None:
        taken = self.steps + self.rejected
        if taken - self._granted < self._max_steps:
            return
        self._granted = taken  # a resumed run may take max_steps again
        raise BudgetExceeded(
            f"limit of {self._max_steps} steps reached at t = {self.t:.9g} s of {self._what};"
            f" {self._advice} (unless a short time constant, such as inertia over damping, limits"
            " the steps)"
        )

    def truncate(self, t: float) -> None:
        """End the last step at a time inside it."""
        self.y[:] = self.interpolate(t)
        self.t = t
        self._rhs(t, self.y, self.f)
        self.nfev += 1

    def repeat_shorter(self, floor: float) -> bool:
        """Undo the last step, which was truncated, if its error is too large; return whether it is.

        The stages of the whole step may have passed over what those of the truncated one meet.
        The next step is shorter, but not than `floor`, s, as in `advance`.
        """
        h = self.t - self.t_old
        self._rk_step(h, self._inside, self._error)
        error = self._error_norm()
        if self._fixed_step or error <= 1.0 or h <= max(floor, MIN_REPEATED_ULPS * ulp(self.t)):
            return False
        self.t, self._h = self.t_old, max(floor, reduced_step(h, error))
        self.y, self.y_old, self.f, self.f_old = self.y_old, self.y, self.f_old, self.f
        self.steps -= 1
        self.rejected += 1
        return True

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step; the next call overwrites it."""
        if t >= self.t:
            return self.y
        self._rk_step(t - self.t_old, self._inside, self._inside_error)
        return self._inside

    def _rk_step(self, h: float, y_new: State, error: State) -> None:
        self._k[0] = self.f_old
        stages(self._rhs, self.t_old, h, self.y_old, self._k, self._stage, y_new, error)
        self.nfev += 5

    def _clip_step(self, left: float) -> float:
        if self._fixed_step:
            return left if self._h >= left * STEP_END_TOLERANCE else self._h
        return clipped_step(self._h, left)

    def _error_norm(self) -> float:
        rtol, atol = self._rtol, self._atol
        worst = 0.0
        for error, y_old, y in zip(self._error, self.y_old, self.y, strict=True):
            ratio = abs(error) / (atol + rtol * max(abs(y_old), abs(y)))
            if not ratio <= worst:  # also true if it is NaN
                worst = ratio
        return worst

    def _update_step_size(self, h: float, error: float, rejected_here: bool) -> None:
        """Set the length of the next step from the error of this one and of the one before."""
        error = max(error, MIN_ERROR_NORM)
        last, limit = self._error_before, self._max_step
        self._h = next_step_size(h, self._h, error, last, rejected_here, limit)
        self._error_before = error

    def _select_initial_step(self) -> float:
        """Estimate the length of the first step from the derivative and its change [1]_.

        .. [1] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.4.
        """
        size = self._norm(self.y)
        rate = self._norm(self.f)
        if not isfinite(rate):
            raise non_finite_error(self.t, self._what)
        h0 = 0.01 * size / rate if size > 1e-5 and rate > 1e-5 else 1e-6
        h0 = min(max(h0, MIN_TRIAL_STEP), self._max_step)
        for i, dy in enumerate(self.f):
            self._stage[i] = self.y[i] + h0 * dy
        change = self._k[1]
        self._rhs(self.t + h0, self._stage, change)
        self.nfev += 1
        for i, dy in enumerate(self.f):
            change[i] = (change[i] - dy) / h0
        fastest = max(rate, self._norm(change))
        if not isfinite(fastest):
            return h0
        h1 = (0.01 / fastest) ** 0.2 if fastest > 1e-15 else max(1e-6, 1e-3 * h0)
        return min(100.0 * h0, h1, self._max_step)

    def _norm(self, values: State) -> float:
        """Return the maximum of the values, each relative to its tolerance."""
        rtol, atol = self._rtol, self._atol
        return max(abs(v) / (atol + rtol * abs(y)) for v, y in zip(values, self.y, strict=True))

    def restored_fault(self) -> str:
        """Return the field that does not go with the others, empty if all do.

        The part of a run that begins now has all the steps of the limit.
        """
        self._granted = self.steps + self.rejected
        if self._fixed_step and self._h not in (0.0, self._fixed_step):
            return "_h"
        return "" if self.t_old <= self.t else "t_old"

    def resume(self, rhs: Rhs) -> None:
        """Resume a segment after the attributes in CHECKPOINT_FIELDS were restored."""
        if not self._h > 0.0:
            raise unfit("stepper._h", "is not a length of a step")
        self._rhs = rhs
