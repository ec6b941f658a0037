"""One step of several coordinates while their contacts keep their modes.

The stages are those of `runge_kutta_fehlberg`, the control of the step that of `one_contact_step`.
Position and velocity only are states of the stages: the powers of the energy integrals do not
depend on these.
"""

from typing import Any

from frictionsim.solvers import runge_kutta_fehlberg as rk
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.contacts import FORCE
from frictionsim.solvers.multi_contact_state import (
    ACCELERATION,
    K2,
    K3,
    K4,
    K5,
    K6,
    STAGE,
    balance,
    coordinate_of,
    form_of,
    form_value,
)
from frictionsim.solvers.one_contact_state import (
    EVALUATIONS,
    F_NEW,
    F_OLD,
    INSIDE,
    REJECTED,
    T_NEW,
    T_OLD,
    Y_NEW,
    Y_OLD,
    Run,
    copy,
)
from frictionsim.solvers.one_contact_step import (
    begin_segment,
    begin_step,
    end_step,
    is_accepted,
    set_first_step,
    trial_length,
    trial_of_first_step,
)


@compilable
def write_motion(system: Any, s: Any, u: float, y: int, f: int) -> None:
    """Write the velocities and accelerations of the state at s[y] into s[f]."""
    n = system.coordinates
    balance(system, s, u, y)
    copy(s, f, y + n, n)
    copy(s, f + n, ACCELERATION, n)


@compilable
def write_derivatives(system: Any, s: Any, t: float, y: int, f: int) -> None:
    """Write the derivatives of the state at s[y] into s[f]."""
    n, u = system.coordinates, system.drive.at(t)
    write_motion(system, s, u, y, f)
    powers = system.powers(u, s, y)
    at, frictions = f + 2 * n, system.contacts.frictions
    for i in range(len(powers)):
        s[at + i] = powers[i]
    at += len(powers)
    for i in range(frictions):
        force = form_value(system, s, form_of(system, i, FORCE))
        s[at + i] = -force * s[y + n + coordinate_of(system, i)]
    if frictions < system.contacts.size:
        s[at + frictions] = 0.0  # the heat of impacts


@compilable
def _write_solution(system: Any, run: Run, s: Any, h: float, y: int) -> None:
    """Write the state after a step of length h, s, from the start of the last one, into s[y].

    The derivatives at its stages 2 to 6 are in K2 to K6.
    """
    t, n = s[T_OLD], 2 * system.coordinates
    for i in range(n):
        s[STAGE + i] = s[Y_OLD + i] + h * (rk.A21 * s[F_OLD + i])
    write_motion(system, s, system.drive.at(t + rk.C2 * h), STAGE, K2)
    for i in range(n):
        s[STAGE + i] = s[Y_OLD + i] + h * (rk.A31 * s[F_OLD + i] + rk.A32 * s[K2 + i])
    write_derivatives(system, s, t + rk.C3 * h, STAGE, K3)
    for i in range(n):
        sum_3 = rk.A41 * s[F_OLD + i] + rk.A42 * s[K2 + i] + rk.A43 * s[K3 + i]
        s[STAGE + i] = s[Y_OLD + i] + h * sum_3
    write_derivatives(system, s, t + rk.C4 * h, STAGE, K4)
    for i in range(n):
        sum_2, sum_4 = (
            rk.A51 * s[F_OLD + i] + rk.A52 * s[K2 + i],
            rk.A53 * s[K3 + i] + rk.A54 * s[K4 + i],
        )
        s[STAGE + i] = s[Y_OLD + i] + h * sum_2 + h * sum_4
    write_derivatives(system, s, t + h, STAGE, K5)
    for i in range(n):
        sum_3 = rk.A61 * s[F_OLD + i] + rk.A62 * s[K2 + i] + rk.A63 * s[K3 + i]
        s[STAGE + i] = s[Y_OLD + i] + h * sum_3 + h * (rk.A64 * s[K4 + i] + rk.A65 * s[K5 + i])
    write_derivatives(system, s, t + rk.C6 * h, STAGE, K6)
    s[EVALUATIONS] += 5.0
    for i in range(run.states):
        sum_4 = rk.B1 * s[F_OLD + i] + rk.B3 * s[K3 + i] + rk.B4 * s[K4 + i]
        s[y + i] = s[Y_OLD + i] + h * sum_4 + h * (rk.B5 * s[K5 + i] + rk.B6 * s[K6 + i])


@compilable
def _trial_step(system: Any, run: Run, s: Any, h: float) -> float:
    """Write the state after a step of length h, s; return the norm of its error."""
    _write_solution(system, run, s, h, Y_NEW)
    rtol, atol, worst = run.rtol, run.atol, 0.0
    for i in range(run.states):
        sum_4 = rk.E1 * s[F_OLD + i] + rk.E3 * s[K3 + i] + rk.E4 * s[K4 + i]
        error = h * sum_4 + h * (rk.E5 * s[K5 + i] + rk.E6 * s[K6 + i])
        ratio = abs(error) / (atol + rtol * max(abs(s[Y_OLD + i]), abs(s[Y_NEW + i])))
        if not ratio <= worst:  # also true if it is NaN
            worst = ratio
    return worst


@compilable
def write_inside(system: Any, run: Run, s: Any, t: float) -> None:
    """Write the state at a time within the last step into INSIDE."""
    if t >= s[T_NEW]:
        copy(s, INSIDE, Y_NEW, run.states)
    elif t <= s[T_OLD]:
        copy(s, INSIDE, Y_OLD, run.states)
    else:
        _write_solution(system, run, s, t - s[T_OLD], INSIDE)


@compilable
def write_cubic(system: Any, s: Any, x: float) -> None:
    """Write the motion at a part x of the last step, by the cubic through its ends, into INSIDE."""
    h = s[T_NEW] - s[T_OLD]
    for i in range(2 * system.coordinates):
        y_old, change = s[Y_OLD + i], s[Y_NEW + i] - s[Y_OLD + i]
        rise, end_rise = h * s[F_OLD + i], h * s[F_NEW + i]
        rest, last = 3.0 * change - 2.0 * rise - end_rise, rise + end_rise - 2.0 * change
        s[INSIDE + i] = y_old + x * (rise + x * (rest + x * last))


@compilable
def start_segment(system: Any, run: Run, s: Any, t: float) -> None:
    """Start a segment at the state of the phase, with a new initial step."""
    begin_segment(run, s, t)
    _write_end(system, s)
    if run.fixed_step > 0.0:
        return
    h = trial_of_first_step(run, s)
    for i in range(2 * system.coordinates):
        s[STAGE + i] = s[Y_NEW + i] + h * s[F_NEW + i]
    write_derivatives(system, s, s[T_NEW] + h, STAGE, INSIDE)
    set_first_step(run, s, h)


@compilable
def _write_end(system: Any, s: Any) -> None:
    """Write the derivatives at the end of the last step."""
    write_derivatives(system, s, s[T_NEW], Y_NEW, F_NEW)
    s[EVALUATIONS] += 1.0


@compilable
def advance(system: Any, run: Run, s: Any, limit: float) -> None:
    """Take one accepted step that ends at `limit`, s, at the latest."""
    begin_step(run, s)
    rejected = s[REJECTED]
    while True:
        h = trial_length(run, s, limit)
        error = _trial_step(system, run, s, h)
        if is_accepted(run, s, h, error, limit):
            break
    s[T_NEW] = limit if h == limit - s[T_OLD] else s[T_OLD] + h
    _write_end(system, s)
    end_step(run, s, h, error, s[REJECTED] > rejected)
