"""The adaptive Runge-Kutta-Fehlberg method of order 4(5) for a few states, in lists of floats.

A `Step` is a value: it is not changed, and the next one follows from it. With the settings of the
run it is all that an integration needs to continue. Belts take the coefficients and the choice of
steps from here; their loops over arrays are in `belt_drive.rkf45`.
"""

from collections.abc import Callable
from math import inf, isfinite, ulp
from typing import Any, NamedTuple

from frictionsim.errors import BudgetExceeded, NonFinite, StepUnderflow, counted

# Fehlberg 1969 (NASA TR R-315), table III, formula 2: nodes, stages, order 5, error estimate.
C2, C3, C4, C6 = 1 / 4, 3 / 8, 12 / 13, 1 / 2  # C5 = 1
A21 = 1 / 4
A31, A32 = 3 / 32, 9 / 32
A41, A42, A43 = 1932 / 2197, -7200 / 2197, 7296 / 2197
A51, A52, A53, A54 = 439 / 216, -8.0, 3680 / 513, -845 / 4104
A61, A62, A63, A64, A65 = -8 / 27, 2.0, -3544 / 2565, 1859 / 4104, -11 / 40
B1, B3, B4, B5, B6 = 16 / 135, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55
E1, E3, E4, E5, E6 = 1 / 360, -128 / 4275, -2197 / 75240, 1 / 50, 2 / 55  # order 5 - order 4

SAFETY = 0.9  # Hairer, Norsett, Wanner 1993, II.4
MIN_FACTOR, MAX_FACTOR = 0.2, 5.0  # ibid.
STEP_END_TOLERANCE = 1.0 - 1e-9  # merge a remainder shorter than 1e-9 h into the step
# PI controller for an error estimate of order h^5: Gustafsson 1991, k_I = 0.3/5, k_P = 0.4/5.
PI_ALPHA, PI_BETA = 0.7 / 5, 0.4 / 5
MIN_ERROR_NORM = 1e-10  # replaces smaller errors in the controller

MIN_TRIAL_STEP = 1e-100  # s, for the estimate of the first step
# Units in the last place of the time: a step that is cut so short is not repeated.
MIN_REPEATED_ULPS = 16.0
UNLIMITED = 10**9  # steps


def reduced_step(h: float, error: float) -> float:
    """Return the length of the next trial after a step of length h with an error above 1."""
    return h * max(MIN_FACTOR, SAFETY * error**-0.2)


def clipped_step(h: float, left: float) -> float:
    """Return the length of the next step, at most `left`, s."""
    if h >= left * STEP_END_TOLERANCE:
        return left
    if h > 0.5 * left:
        return 0.5 * left  # two equal steps instead of a long one and a short one
    return h


def next_step_size(
    h: float, planned: float, error: float, error_old: float, rejected_here: bool, max_step: float
) -> float:
    """Return the length of the step after one of length h that was planned otherwise, s.

    Errors, of this step and of the one before, are relative to what is allowed; `rejected_here`
    says that a longer step was tried first.
    """
    growth = SAFETY * error**-PI_ALPHA * error_old**PI_BETA
    length = h * min(max(growth, MIN_FACTOR), 1.0 if rejected_here else MAX_FACTOR)
    # The error of a shortened step is not representative: keep the planned length.
    kept = planned if not rejected_here and h < planned else 0.0
    return min(max(length, kept), max_step)


class Tolerances(NamedTuple):
    """What decides the lengths of steps: an error of a number y is at most atol + rtol |y|."""

    rtol: float
    atol: float
    max_step: float = inf  # s
    fixed_step: float = 0.0  # s; 0 for steps that adapt
    max_steps: int = UNLIMITED  # trials, accepted or not, after the first `granted`
    granted: int = 0
    jump_ulps: float = 0.0  # of the time: a step so short is accepted whatever its error
    subject: str = "the motion"  # for messages, as is the advice
    budget_advice: str = ""

    def error(
        self, y_old: list[float], y: list[float], k1: list[float], stages: "Stages", h: float
    ) -> float:
        """Return the largest error of a step relative to what is allowed; NaN stays noticed.

        An error is the difference of the solutions of the orders 5 and 4.
        """
        rtol, atol, worst = self.rtol, self.atol, 0.0
        e1, e3, e4, e5, e6 = h * E1, h * E3, h * E4, h * E5, h * E6
        for a, b, k, c, d, e, f in zip(y_old, y, k1, *stages):
            error = e1 * k + e3 * c + e4 * d + e5 * e + e6 * f
            ratio = abs(error) / (atol + rtol * max(abs(a), abs(b)))
            if not ratio <= worst:  # also true if it is NaN
                worst = ratio
        return worst


class Step(NamedTuple):
    """The last step of y' = k(t, y), from t_old to t, and what the next begins with; times in s."""

    t_old: float
    y_old: list[float]
    k_old: list[float]
    t: float
    y: list[float]
    k: list[float]
    length: float  # planned for the next step
    error: float  # of this one, relative to what is allowed
    taken: int  # since the start of the run, as the next two
    rejected: int
    evaluations: int

    def at(self, system: Any, modes: list[int], t: float) -> list[float]:
        """Return the state at a time within the step: of a shorter one to there."""
        if t >= self.t or self.y is self.y_old:  # nothing moves
            return self.y
        if t <= self.t_old:
            return self.y_old
        h = t - self.t_old
        stages = _stages(system, modes, self.t_old, self.y_old, self.k_old, h)
        return _solution(self.y_old, self.k_old, stages, h)

    def near(self, x: float) -> list[float]:
        """Return the state at a part x of the step, by the cubic through its ends."""
        h = self.t - self.t_old
        return [
            a
            + x
            * (h * p + x * (3.0 * (b - a) - h * (2.0 * p + r) + x * (h * (p + r) - 2.0 * (b - a))))
            for a, b, p, r in zip(self.y_old, self.y, self.k_old, self.k)
        ]

    def started(
        self, system: Any, modes: list[int], t: float, y: list[float], tol: Tolerances
    ) -> "Step":
        """Return a step of no length at a state, with the length of the first after it [1]_.

        .. [1] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.4.
        """
        k = system.rates(t, y, modes)
        if tol.fixed_step > 0.0:
            return Step(t, y, k, t, y, k, tol.fixed_step, 1.0, *self[8:10], self.evaluations + 1)
        scale = [tol.atol + tol.rtol * abs(a) for a in y]
        size = max([abs(a) / w for a, w in zip(y, scale)])
        rate = _largest(k, scale)
        if not isfinite(rate):
            raise non_finite_error(t, tol.subject)
        h = 0.01 * size / rate if size > 1e-5 and rate > 1e-5 else 1e-6
        h = min(max(h, MIN_TRIAL_STEP), tol.max_step)
        k1 = system.rates(t + h, [a + h * b for a, b in zip(y, k)], modes)
        change = [(a - b) / h for a, b in zip(k1, k)]
        fastest, length = max(rate, _largest(change, scale)), h
        if isfinite(fastest):
            shorter = (0.01 / fastest) ** 0.2 if fastest > 1e-15 else max(1e-6, 1e-3 * h)
            length = min(100.0 * h, shorter, tol.max_step)
        return Step(t, y, k, t, y, k, length, 1.0, *self[8:10], self.evaluations + 2)

    def resting(self, t: float, end: float) -> "Step":
        """Return a step from a time to another in which nothing moves."""
        return self._replace(t_old=t, t=end, y_old=self.y, k_old=self.k)

    def advanced(self, system: Any, modes: list[int], limit: float, tol: Tolerances) -> "Step":
        """Return the next step, which ends at a time, s, at the latest.

        Raises
        ------
        BudgetExceeded, NonFinite, StepUnderflow
        """
        t, y, k, planned, rejected = self.t, self.y, self.k, self.length, self.rejected
        check_budget(self, tol)
        left, shortest, evaluations = limit - t, tol.jump_ulps * ulp(t), self.evaluations
        while True:
            if tol.fixed_step > 0.0:
                h = left if planned >= left * STEP_END_TOLERANCE else planned
            else:
                h = clipped_step(planned, left)
            stages = _stages(system, modes, t, y, k, h)
            evaluations += 5
            new = _solution(y, k, stages, h)
            error = tol.error(y, new, k, stages, h)
            if not isfinite(error):
                raise non_finite_error(t, tol.subject)
            if error <= 1.0 or tol.fixed_step > 0.0 or h <= shortest:
                break
            rejected += 1
            planned = max(shortest, reduced_step(h, error))
            if planned < 4.0 * ulp(limit):
                raise step_underflow(t, planned, tol.subject)
        end = limit if h == left else t + h
        length = planned
        if tol.fixed_step == 0.0:
            error = max(error, MIN_ERROR_NORM)
            repeated = rejected > self.rejected
            length = next_step_size(h, planned, error, self.error, repeated, tol.max_step)
        k_new = system.rates(end, new, modes)
        return Step(
            t, y, k, end, new, k_new, length, error, self.taken + 1, rejected, evaluations + 1
        )

    def cut(self, system: Any, modes: list[int], t: float) -> "Step":
        """Return the step ended at a time within it."""
        if t >= self.t:
            return self
        y = self.at(system, modes, t)
        k = system.rates(t, y, modes)
        return self._replace(t=t, y=y, k=k, evaluations=self.evaluations + 6)

    def repeated(
        self, cut: "Step", system: Any, modes: list[int], limit: float, tol: Tolerances
    ) -> "Step | None":
        """Return a shorter step after this one if a step that was cut has too large an error.

        The stages of the whole step may have passed over what those of the shorter one meet.
        """
        h = cut.t - self.t
        stages = _stages(system, modes, self.t, self.y, self.k, h)
        error = tol.error(self.y, cut.y, self.k, stages, h)
        if tol.fixed_step > 0.0 or error <= 1.0 or h <= MIN_REPEATED_ULPS * ulp(cut.t):
            return None
        length = max(tol.jump_ulps * ulp(self.t), reduced_step(h, error))
        rejected, evaluations = cut.rejected + 1, cut.evaluations + 5
        shorter = self._replace(length=length, rejected=rejected, evaluations=evaluations)
        # A part of the step that was begun within the budget, so that a limit of one step gets on.
        return shorter.advanced(system, modes, limit, tol._replace(max_steps=UNLIMITED))


START = Step(0.0, [], [], 0.0, [], [], 0.0, 1.0, 0, 0, 0)


def non_finite_error(t: float, what: str) -> NonFinite:
    """Return the error for a non-finite state after t, s; `what` is the subject."""
    return NonFinite(
        f"the state of {what} is not finite after t = {t:.9g} s; check the scenario for forces or"
        " coefficients that are too large"
    )


def step_underflow(t: float, h: float, what: str) -> StepUnderflow:
    """Return the error for a required step h, s, at t, s, below the resolution of the time."""
    return StepUnderflow(
        f"at t = {t:.9g} s the tolerances require a step of {h:.2g} s for {what}, below the"
        " resolution of double precision; give a larger solver.rtol or atol"
    )


def in_range(turn: Callable[[Any], Any], state: Any, tol: Tolerances) -> Any:
    """Return the state after a turn; a function of `math` without a value ends the run by name."""
    try:
        return turn(state)
    except (OverflowError, ValueError) as error:
        raise non_finite_error(state.t, tol.subject) from error


def check_budget(step: Any, tol: Tolerances) -> None:
    """Raise BudgetExceeded if the limit of steps is reached."""
    if step.taken + step.rejected - tol.granted >= tol.max_steps:
        raise BudgetExceeded(
            f"limit of {counted(tol.max_steps, 'step')} reached at t = {step.t:.9g} s of"
            f" {tol.subject}; {tol.budget_advice}"
        )


def _largest(numbers: list[float], scale: list[float]) -> float:
    """Return the largest size of numbers in their scales; NaN stays noticed."""
    largest = 0.0
    for number, width in zip(numbers, scale):
        size = abs(number) / width
        if not size <= largest:
            largest = size
    return largest


Stages = tuple[list[float], list[float], list[float], list[float]]


def _stages(
    system: Any, modes: list[int], t: float, y: list[float], k1: list[float], h: float
) -> Stages:
    """Return the derivatives at the stages 3 to 6 of a step of length h from t, s.

    Stages are of the motion alone, on which the rates of energies depend.
    """
    if system.coordinates == 1:
        return _stages_of_one(system.rates, modes, t, y, k1, h)
    rates, motion = system.rates, y[: 2 * system.coordinates]
    a1 = h * A21
    k2 = rates(t + C2 * h, [x + a1 * a for x, a in zip(motion, k1)], modes)
    a1, a2 = h * A31, h * A32
    k3 = rates(t + C3 * h, [x + a1 * a + a2 * b for x, a, b in zip(motion, k1, k2)], modes)
    a1, a2, a3 = h * A41, h * A42, h * A43
    at = [x + a1 * a + a2 * b + a3 * c for x, a, b, c in zip(motion, k1, k2, k3)]
    k4 = rates(t + C4 * h, at, modes)
    a1, a2, a3, a4 = h * A51, h * A52, h * A53, h * A54
    at = [x + a1 * a + a2 * b + a3 * c + a4 * d for x, a, b, c, d in zip(motion, k1, k2, k3, k4)]
    k5 = rates(t + h, at, modes)
    a1, a2, a3, a4, a5 = h * A61, h * A62, h * A63, h * A64, h * A65
    at = [
        x + a1 * a + a2 * b + a3 * c + a4 * d + a5 * e
        for x, a, b, c, d, e in zip(motion, k1, k2, k3, k4, k5)
    ]
    return k3, k4, k5, rates(t + C6 * h, at, modes)


def _stages_of_one(
    rates: Any, modes: list[int], t: float, y: list[float], k1: list[float], h: float
) -> Stages:
    """Return `_stages` of one coordinate: written out, they save a tenth of the time of a run."""
    q, v, q1, v1 = y[0], y[1], k1[0], k1[1]
    a = h * A21
    k2 = rates(t + C2 * h, [q + a * q1, v + a * v1], modes)
    q2, v2, a, b = k2[0], k2[1], h * A31, h * A32
    k3 = rates(t + C3 * h, [q + a * q1 + b * q2, v + a * v1 + b * v2], modes)
    q3, v3, a, b, c = k3[0], k3[1], h * A41, h * A42, h * A43
    motion = [q + a * q1 + b * q2 + c * q3, v + a * v1 + b * v2 + c * v3]
    k4 = rates(t + C4 * h, motion, modes)
    q4, v4, a, b, c, d = k4[0], k4[1], h * A51, h * A52, h * A53, h * A54
    motion = [q + a * q1 + b * q2 + c * q3 + d * q4, v + a * v1 + b * v2 + c * v3 + d * v4]
    k5 = rates(t + h, motion, modes)
    q5, v5, a, b, c, d, e = k5[0], k5[1], h * A61, h * A62, h * A63, h * A64, h * A65
    motion = [
        q + a * q1 + b * q2 + c * q3 + d * q4 + e * q5,
        v + a * v1 + b * v2 + c * v3 + d * v4 + e * v5,
    ]
    return k3, k4, k5, rates(t + C6 * h, motion, modes)


def _solution(y: list[float], k1: list[float], stages: Stages, h: float) -> list[float]:
    """Return the state after a step, of the fifth order."""
    b1, b3, b4, b5, b6 = h * B1, h * B3, h * B4, h * B5, h * B6
    return [
        x + (b1 * a + b3 * c + b4 * d + b5 * e + b6 * f) for x, a, c, d, e, f in zip(y, k1, *stages)
    ]
