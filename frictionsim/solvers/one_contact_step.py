"""One step of a body that slides: the method of `runge_kutta_fehlberg` in scalars.

The derivatives of a state are a tuple: velocity, acceleration, power of each energy integral, of
which the last is the heat of the contact.
"""

from math import isfinite, ulp
from typing import Any

from frictionsim.solvers.compilation import compilable, inlined
from frictionsim.solvers.one_contact_state import (
    ERROR_BEFORE,
    EVALUATIONS,
    F_NEW,
    F_OLD,
    GRANTED,
    INSIDE,
    MODE,
    NON_FINITE,
    REJECTED,
    STEP,
    STEPS,
    T_NEW,
    T_OLD,
    TOO_MANY_STEPS,
    UNDERFLOW,
    Y_NEW,
    Y_OLD,
    Run,
    Y,
    copy,
    fail,
)
from frictionsim.solvers.runge_kutta_fehlberg import (
    A21,
    A31,
    A32,
    A41,
    A42,
    A43,
    A51,
    A52,
    A53,
    A54,
    A61,
    A62,
    A63,
    A64,
    A65,
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
    MIN_REPEATED_ULPS,
    MIN_TRIAL_STEP,
)
from frictionsim.solvers.stepper import (
    MIN_ERROR_NORM,
    STEP_END_TOLERANCE,
    clipped_step,
    next_step_size,
    reduced_step,
)

Derivatives = tuple[float, ...]


@compilable
@inlined
def derivatives(system: Any, t: float, q: float, v: float, direction: float) -> Derivatives:
    """Return the derivatives of a state while the contact slides in a direction."""
    u = system.drive.at(t)
    applied, limit, powers = system.torques_and_powers(u, q, v, direction)
    friction = -direction * limit
    return (v, (applied + friction) / system.inertia, *powers, -friction * v)


@compilable
@inlined
def stages(
    system: Any, s: Any, direction: float, h: float
) -> tuple[Derivatives, Derivatives, Derivatives, Derivatives, Derivatives]:
    """Return the derivatives at the stages 2 to 6 of a step of length h, s."""
    t, q, v = s[T_OLD], s[Y_OLD], s[Y_OLD + 1]
    v1, a1 = s[F_OLD], s[F_OLD + 1]
    k2 = derivatives(system, t + C2 * h, q + h * (A21 * v1), v + h * (A21 * a1), direction)
    v2, a2 = k2[0], k2[1]
    k3 = derivatives(
        system, t + C3 * h, q + h * (A31 * v1 + A32 * v2), v + h * (A31 * a1 + A32 * a2), direction
    )
    v3, a3 = k3[0], k3[1]
    k4 = derivatives(
        system,
        t + C4 * h,
        q + h * (A41 * v1 + A42 * v2 + A43 * v3),
        v + h * (A41 * a1 + A42 * a2 + A43 * a3),
        direction,
    )
    v4, a4 = k4[0], k4[1]
    k5 = derivatives(
        system,
        t + h,
        q + h * (A51 * v1 + A52 * v2) + h * (A53 * v3 + A54 * v4),
        v + h * (A51 * a1 + A52 * a2) + h * (A53 * a3 + A54 * a4),
        direction,
    )
    v5, a5 = k5[0], k5[1]
    k6 = derivatives(
        system,
        t + C6 * h,
        q + h * (A61 * v1 + A62 * v2 + A63 * v3) + h * (A64 * v4 + A65 * v5),
        v + h * (A61 * a1 + A62 * a2 + A63 * a3) + h * (A64 * a4 + A65 * a5),
        direction,
    )
    s[EVALUATIONS] += 5.0
    return k2, k3, k4, k5, k6


@compilable
@inlined
def trial_step(system: Any, run: Run, s: Any, direction: float, h: float) -> float:
    """Write the state after a step of length h, s; return the norm of its error.

    It is the largest error, relative to its tolerance; NaN stays noticed.
    """
    _, k3, k4, k5, k6 = stages(system, s, direction, h)
    rtol, atol, worst = run.rtol, run.atol, 0.0
    for i in range(run.states):
        k1, x3, x4, x5, x6, y_old = s[F_OLD + i], k3[i], k4[i], k5[i], k6[i], s[Y_OLD + i]
        y = y_old + h * (B1 * k1 + B3 * x3 + B4 * x4) + h * (B5 * x5 + B6 * x6)
        s[Y_NEW + i] = y
        error = h * (E1 * k1 + E3 * x3 + E4 * x4) + h * (E5 * x5 + E6 * x6)
        ratio = abs(error) / (atol + rtol * max(abs(y_old), abs(y)))
        if not ratio <= worst:  # also true if it is NaN
            worst = ratio
    return worst


@compilable
def write_inside(system: Any, run: Run, s: Any, direction: float, t: float) -> None:
    """Write the state at a time within the last step into INSIDE."""
    n = run.states
    if t >= s[T_NEW]:
        copy(s, INSIDE, Y_NEW, n)
        return
    h = t - s[T_OLD]
    _, k3, k4, k5, k6 = stages(system, s, direction, h)
    for i in range(n):
        s[INSIDE + i] = (
            s[Y_OLD + i]
            + h * (B1 * s[F_OLD + i] + B3 * k3[i] + B4 * k4[i])
            + h * (B5 * k5[i] + B6 * k6[i])
        )


@compilable
def _write_derivatives(system: Any, run: Run, s: Any, direction: float) -> None:
    """Write the derivatives at the end of the last step."""
    k = derivatives(system, s[T_NEW], s[Y_NEW], s[Y_NEW + 1], direction)
    for i in range(run.states):
        s[F_NEW + i] = k[i]
    s[EVALUATIONS] += 1.0


@compilable
def start_segment(system: Any, run: Run, s: Any, t: float) -> None:
    """Start a segment at the state of the phase, with a new initial step."""
    direction = s[MODE]
    begin_segment(run, s, t)
    _write_derivatives(system, run, s, direction)
    if run.fixed_step > 0.0:
        return
    h = trial_of_first_step(run, s)
    q, v = s[Y_NEW] + h * s[F_NEW], s[Y_NEW + 1] + h * s[F_NEW + 1]
    k = derivatives(system, s[T_NEW] + h, q, v, direction)
    for i in range(run.states):
        s[INSIDE + i] = k[i]
    set_first_step(run, s, h)


@compilable
def begin_segment(run: Run, s: Any, t: float) -> None:
    """Begin a segment at the state of the phase, at t, s."""
    s[T_OLD] = s[T_NEW] = t
    copy(s, Y_OLD, Y, run.states)
    copy(s, Y_NEW, Y, run.states)
    s[STEP], s[ERROR_BEFORE] = run.fixed_step, 1.0


@compilable
def trial_of_first_step(run: Run, s: Any) -> float:
    """Return the length of a trial of the first step, s [1]_.

    .. [1] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.4.
    """
    size, rate = _size_and_rate(run, s)
    if not isfinite(rate):
        fail(NON_FINITE, s[T_NEW], 0.0, 0.0, 0.0)
    h = 0.01 * size / rate if size > 1e-5 and rate > 1e-5 else 1e-6
    return min(max(h, MIN_TRIAL_STEP), run.max_step)


@compilable
def _size_and_rate(run: Run, s: Any) -> tuple[float, float]:
    """Return the largest state and derivative, relative to tolerances."""
    size = rate = 0.0
    for i in range(run.states):
        tolerance = run.atol + run.rtol * abs(s[Y_NEW + i])
        size = max(size, abs(s[Y_NEW + i]) / tolerance)
        slope = abs(s[F_NEW + i]) / tolerance
        if not slope <= rate:  # also true if it is NaN
            rate = slope
    return size, rate


@compilable
def set_first_step(run: Run, s: Any, h: float) -> None:
    """Set the length of the first step from the derivatives in INSIDE, after a trial of h, s."""
    s[EVALUATIONS] += 1.0
    fastest = _size_and_rate(run, s)[1]
    for i in range(run.states):
        change = (s[INSIDE + i] - s[F_NEW + i]) / h
        fastest = max(fastest, abs(change) / (run.atol + run.rtol * abs(s[Y_NEW + i])))
    s[STEP] = h
    if isfinite(fastest):
        shorter = (0.01 / fastest) ** 0.2 if fastest > 1e-15 else max(1e-6, 1e-3 * h)
        s[STEP] = min(100.0 * h, shorter, run.max_step)


@compilable
@inlined
def advance(system: Any, run: Run, s: Any, direction: float, limit: float) -> None:
    """Take one accepted step that ends at `limit`, s, at the latest."""
    begin_step(run, s)
    rejected = s[REJECTED]
    while True:
        h = trial_length(run, s, limit)
        error = trial_step(system, run, s, direction, h)
        if is_accepted(run, s, h, error, limit):
            break
    s[T_NEW] = limit if h == limit - s[T_OLD] else s[T_OLD] + h
    _write_derivatives(system, run, s, direction)
    end_step(run, s, h, error, s[REJECTED] > rejected)


@compilable
def begin_step(run: Run, s: Any) -> None:
    """Begin a step at the end of the last one, unless the limit of steps is reached."""
    taken = s[STEPS] + s[REJECTED]
    if taken - s[GRANTED] >= run.max_steps:
        s[GRANTED] = taken  # a resumed run may take max_steps again
        fail(TOO_MANY_STEPS, s[T_NEW], 0.0, 0.0, 0.0)
    s[T_OLD] = s[T_NEW]
    copy(s, Y_OLD, Y_NEW, run.states)
    copy(s, F_OLD, F_NEW, run.states)


@compilable
def trial_length(run: Run, s: Any, limit: float) -> float:
    """Return the length of the next trial of a step, s."""
    left, planned = limit - s[T_OLD], s[STEP]
    if run.fixed_step > 0.0:
        return left if planned >= left * STEP_END_TOLERANCE else planned
    return clipped_step(planned, left)


@compilable
def is_accepted(run: Run, s: Any, h: float, error: float, limit: float) -> bool:
    """Return whether a trial is accepted; if not, set a shorter length."""
    if not isfinite(error):
        fail(NON_FINITE, s[T_OLD], 0.0, 0.0, 0.0)
    shortest = run.jump_ulps * ulp(s[T_OLD])
    if run.fixed_step > 0.0 or error <= 1.0 or h <= shortest:
        return True
    s[REJECTED] += 1.0
    s[STEP] = max(shortest, reduced_step(h, error))
    if s[STEP] < 4.0 * ulp(limit):
        fail(UNDERFLOW, s[T_OLD], s[STEP], 0.0, 0.0)
    return False


@compilable
def end_step(run: Run, s: Any, h: float, error: float, rejected_here: bool) -> None:
    """Count an accepted step, and set the length of the next."""
    s[STEPS] += 1.0
    if run.fixed_step > 0.0:
        return
    error = max(error, MIN_ERROR_NORM)
    last, limit = s[ERROR_BEFORE], run.max_step
    s[STEP] = next_step_size(h, s[STEP], error, last, rejected_here, limit)
    s[ERROR_BEFORE] = error


@compilable
def truncate(system: Any, run: Run, s: Any, direction: float, t: float) -> None:
    """End the last step at a time inside it."""
    n = run.states
    write_inside(system, run, s, direction, t)
    copy(s, Y_NEW, INSIDE, n)
    s[T_NEW] = t
    _write_derivatives(system, run, s, direction)


@compilable
def repeats_shorter(system: Any, run: Run, s: Any, direction: float) -> bool:
    """Undo the last step, which was truncated, if its error is too large; return whether it is.

    The stages of the whole step may have passed over what those of the truncated one meet.
    """
    n, h = run.states, s[T_NEW] - s[T_OLD]
    error = trial_step(system, run, s, direction, h)
    if run.fixed_step > 0.0 or error <= 1.0 or h <= MIN_REPEATED_ULPS * ulp(s[T_NEW]):
        return False
    s[T_NEW] = s[T_OLD]
    s[STEP] = max(run.jump_ulps * ulp(s[T_OLD]), reduced_step(h, error))
    copy(s, Y_NEW, Y_OLD, n)
    copy(s, F_NEW, F_OLD, n)
    s[STEPS] -= 1.0
    s[REJECTED] += 1.0
    return True
