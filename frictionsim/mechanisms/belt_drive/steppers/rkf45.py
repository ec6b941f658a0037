"""Adaptive RKF4(5) for belt drives, compiled, with exact stick in the right-hand side.

The method, its coefficients and its choice of steps are those of
`frictionsim.solvers.runge_kutta_fehlberg`; only the loop around them is written anew, for arrays
and without allocation. A step is never longer than the waves in the belt allow: error control
alone would hover at the stability limit, rejecting every other step.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.errors import NonFinite, StepUnderflow
from frictionsim.mechanisms.belt_drive.assembly import zero_state
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    ALPHA,
    FRICTION,
    SLIP,
    STICKING,
    find_contact_candidates,
    update_friction_coefficients,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    copy,
    kinematics_of,
    prescribed_speeds,
    rhs,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel
from frictionsim.solvers import runge_kutta_fehlberg
from frictionsim.solvers.runge_kutta_fehlberg import (
    C2,
    C3,
    C4,
    C6,
    MIN_ERROR_NORM,
    STEP_END_TOLERANCE,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.assembly import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

stage_2, stage_3 = (
    inline_kernel(runge_kutta_fehlberg.stage_2),
    inline_kernel(runge_kutta_fehlberg.stage_3),
)
stage_4, stage_5 = (
    inline_kernel(runge_kutta_fehlberg.stage_4),
    inline_kernel(runge_kutta_fehlberg.stage_5),
)
stage_6, solution_5 = (
    inline_kernel(runge_kutta_fehlberg.stage_6),
    inline_kernel(runge_kutta_fehlberg.solution_5),
)
error_estimate_5 = inline_kernel(runge_kutta_fehlberg.error_estimate_5)
reduced_step, next_step_size = (
    inline_kernel(runge_kutta_fehlberg.reduced_step),
    inline_kernel(runge_kutta_fehlberg.next_step_size),
)

# Bodies near pulleys are given their slots anew after so many steps. In that time a body does not
# get through the margin, a body's length, unless it is faster than an eighth of the waves.
CANDIDATE_UPDATE_INTERVAL = 8

FIRST_STEP_RATIO = 0.01  # of the longest

# Seconds on one core at about 3 GHz, with contact, damping, bending and friction; less with fewer
# effects. Only for whoever waits.
COMPILE_SECONDS = 20.0

RUNNING, NOT_FINITE, TOO_SHORT = 0, 1, 2

# On the imaginary axis the solution of order 5 is damped for 2.05 < omega h < 3.61; on the real
# one it is stable up to 3.67.
MAX_OMEGA_H, MAX_DECAY_H = 3.6, 3.5
# So the longest step damps the fast waves of bodies that turn against each other, which nothing
# else damps, and each shorter one makes them grow until the tolerance stops them: there they stay,
# and so does the short step. The longest step is therefore taken with an error of some
# tolerances; what is in excess is in those waves, and gone after a few steps. But not where it
# makes other waves grow, those of bending in a fine mesh (by 2e-5 a step at omega h = 0.55):
# these are kept small by a tighter tolerance.
MAX_ERROR_AT_MAX_STEP, MAX_BENDING_OMEGA_H, BENDING_TOLERANCE_FACTOR = 30.0, 0.55, 0.03
MAX_STEP_TRIAL_INTERVAL = 4  # of the longest step, while steps are shorter


class RKF45State(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y0, y : (n,)
        The states at the start and the end of the last step.
    k : six of (n,)
        The rates of its stages; k[0] are those at its start.
    rates1 : (n,)
        The rates at its end.
    stage, error, inside : (n,)
        Room to work in.
    per_tolerance : (n,)
        1 over the error that a step may make in each state, 0 for an energy.
    clock : (4,)
        t0, t, the length of the next step, the error of the last.
    counts : (5,)
        Steps, rejected steps, right-hand sides, steps since the slots were dealt, steps since the
        longest one was tried.
    """

    y0: "Array"
    y: "Array"
    k: tuple["Array", ...]
    f: "Array"
    stage: "Array"
    error: "Array"
    inside: "Array"
    inv_error_scale: "Array"
    clock: "Array"
    counts: "Indices"


@kernel
def start(stepper, skin, friction, laws, torques, loads, speeds, workspace, contacts, pulleys):
    """Find who is near a pulley, and evaluate the rates at the start."""
    clock = stepper.clock
    prescribed_speeds(clock[1], pulleys, speeds)  # who has slip depends on it
    update_candidates(stepper, skin, friction, laws, workspace, contacts, pulleys)
    rhs(
        clock[1],
        clock[2],
        stepper.y,
        stepper.f,
        laws,
        torques,
        loads,
        speeds,
        workspace,
        contacts,
        pulleys,
    )
    stepper.counts[2] += 1


@inline_kernel
def update_candidates(stepper, skin, friction, laws, workspace, contacts, pulleys):
    """Give slots anew to the bodies near pulleys."""
    kinematics = kinematics_of(stepper.y, workspace)
    find_contact_candidates(kinematics, laws.chain.bodies, pulleys, skin, contacts, friction)
    stepper.counts[3] = 0


@kernel
def advance(
    stepper,
    limit,
    sample,
    max_step,
    error_limit_at_max_step,
    most,
    skin,
    friction,
    distinct_static_friction,
    laws,
    torques,
    loads,
    speeds,
    workspace,
    contacts,
    pulleys,
):
    """Step until the limit is reached, or a sample time passed, or `most` steps are done.

    Return RUNNING, or why no further step could be taken from (t, y).
    """
    clock, counts = stepper.clock, stepper.counts
    last = counts[0] + counts[1] + most
    while clock[1] < limit and clock[1] < sample and counts[0] + counts[1] < last:
        if counts[3] >= CANDIDATE_UPDATE_INTERVAL:
            update_candidates(stepper, skin, friction, laws, workspace, contacts, pulleys)
        trouble = step(
            stepper,
            limit,
            max_step,
            error_limit_at_max_step,
            laws,
            torques,
            loads,
            speeds,
            workspace,
            contacts,
            pulleys,
        )
        if trouble != RUNNING:
            return trouble
        counts[3] += 1
        update_contact_modes(
            stepper,
            distinct_static_friction,
            laws,
            torques,
            loads,
            speeds,
            workspace,
            contacts,
            pulleys,
        )
    return RUNNING


@inline_kernel
def update_contact_modes(
    stepper, distinct_static_friction, laws, torques, loads, speeds, workspace, contacts, pulleys
):
    """Take over who sticks now, if static and kinetic friction differ; the rates may jump then."""
    if distinct_static_friction is not None and update_friction_coefficients(contacts):
        clock = stepper.clock
        rhs(
            clock[1],
            clock[2],
            stepper.y,
            stepper.f,
            laws,
            torques,
            loads,
            speeds,
            workspace,
            contacts,
            pulleys,
        )
        stepper.counts[2] += 1


@kernel
def step(
    stepper,
    limit,
    max_step,
    error_limit_at_max_step,
    laws,
    torques,
    loads,
    speeds,
    workspace,
    contacts,
    pulleys,
):
    """Take one accepted step; return RUNNING or why there is none."""
    clock, counts = stepper.clock, stepper.counts
    y0, y, k = stepper.y0, stepper.y, stepper.k
    copy(y, y0)
    copy(stepper.f, k[0])
    t0 = clock[1]
    rejected_here = False
    while True:
        left = limit - t0
        h = min(clock[2], max_step)
        if h >= left * STEP_END_TOLERANCE:
            h = left
        elif h > 0.5 * left:
            h = 0.5 * left
        stages(
            t0,
            h,
            y0,
            k,
            stepper.stage,
            y,
            laws,
            torques,
            loads,
            speeds,
            workspace,
            contacts,
            pulleys,
        )
        error_estimate_5(h, k[0], k[2], k[3], k[4], k[5], stepper.error)
        counts[2] += 5
        error = error_norm(stepper.error, stepper.inv_error_scale)
        if error <= (error_limit_at_max_step if h >= max_step * STEP_END_TOLERANCE else 1.0):
            break
        counts[1] += 1
        if not error < np.inf and h < 1e-3 * max_step:
            copy(y0, y)
            return NOT_FINITE
        rejected_here = True
        clock[2] = reduced_step(h, min(error, 1e10)) if error == error else 0.2 * h
        if clock[2] < 4e-16 * limit:
            copy(y0, y)
            return TOO_SHORT
    clock[0], clock[1] = t0, limit if h == left else t0 + h
    rhs(clock[1], h, y, stepper.f, laws, torques, loads, speeds, workspace, contacts, pulleys)
    counts[2] += 1
    counts[0] += 1
    error = max(error, MIN_ERROR_NORM)
    due = clock[2] if not rejected_here and h < clock[2] else 0.0
    clock[2] = min(max(next_step_size(h, error, clock[3], rejected_here), due), max_step)
    clock[3] = error
    if error_limit_at_max_step > 1.0 and clock[2] < max_step:
        counts[4] = (counts[4] + 1) % MAX_STEP_TRIAL_INTERVAL
        if counts[4] == 0:
            clock[2] = max_step
    return RUNNING


@kernel
def stages(t, h, y, k, stage, y_new, laws, torques, loads, speeds, workspace, contacts, pulleys):
    """Write the solution of order 5 at the end of a step, and the rates of its stages.

    As `runge_kutta_fehlberg.stages`; but a kernel that were given the rates as an argument would
    have to be compiled anew in every process.
    """
    stage_2(h, y, k[0], stage)
    rhs(t + C2 * h, h, stage, k[1], laws, torques, loads, speeds, workspace, contacts, pulleys)
    stage_3(h, y, k[0], k[1], stage)
    rhs(t + C3 * h, h, stage, k[2], laws, torques, loads, speeds, workspace, contacts, pulleys)
    stage_4(h, y, k[0], k[1], k[2], stage)
    rhs(t + C4 * h, h, stage, k[3], laws, torques, loads, speeds, workspace, contacts, pulleys)
    stage_5(h, y, k[0], k[1], k[2], k[3], stage)
    rhs(t + h, h, stage, k[4], laws, torques, loads, speeds, workspace, contacts, pulleys)
    stage_6(h, y, k[0], k[1], k[2], k[3], k[4], stage)
    rhs(t + C6 * h, h, stage, k[5], laws, torques, loads, speeds, workspace, contacts, pulleys)
    solution_5(h, y, k[0], k[2], k[3], k[4], k[5], y_new)


@inline_kernel
def error_norm(error, inv_error_scale):
    """Return the length of the error, each state's in units of what it may be."""
    total = 0.0
    for i in range(len(error)):
        e = error[i] * inv_error_scale[i]
        total += e * e
    return np.sqrt(total)


@kernel
def interpolate_step(stepper, t, laws, torques, loads, speeds, workspace, contacts, pulleys):
    """Evaluate the last step at a time inside it: the state goes to `inside`, forces to `room`."""
    y, start = stepper.inside, stepper.clock[0]
    h = t - start
    if t < stepper.clock[1]:
        stages(
            start,
            h,
            stepper.y0,
            stepper.k,
            stepper.stage,
            y,
            laws,
            torques,
            loads,
            speeds,
            workspace,
            contacts,
            pulleys,
        )
    else:
        copy(stepper.y, y)
    rhs(t, h, y, stepper.stage, laws, torques, loads, speeds, workspace, contacts, pulleys)


class BeltStepper:
    """A belt drive on its way, as the run of it sees it.

    Parameters
    ----------
    assembly : Assembly
    settings : BeltSolver
    """

    force_per_impulse = 1.0  # the slots hold forces
    resumable = True
    compile_seconds = COMPILE_SECONDS

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        self._model = model
        bodies, pulleys = model.laws.chain.bodies, model.pulleys
        frequency, decay = model.max_frequency_and_decay
        stable = min(MAX_OMEGA_H / frequency, MAX_DECAY_H / max(decay, 1e-300))
        self._max_step = min(stable, settings.max_step or np.inf)
        self._skin = model.laws.chain.length
        tolerance, self._error_limit_at_max_step = (
            settings.rtol + settings.atol,
            MAX_ERROR_AT_MAX_STEP,
        )
        if model.laws.regularised is not None:  # what is stiff there is the law, not a wave
            self._error_limit_at_max_step = 1.0
        elif model.max_bending_frequency * self._max_step > MAX_BENDING_OMEGA_H:
            tolerance, self._error_limit_at_max_step = BENDING_TOLERANCE_FACTOR * tolerance, 1.0

        def vector() -> "Array":
            return zero_state(bodies, pulleys)

        self._stepper = RKF45State(
            y0=vector(),
            y=vector(),
            k=tuple(vector() for _ in range(6)),
            f=vector(),
            stage=vector(),
            error=vector(),
            inside=vector(),
            inv_error_scale=1.0 / (tolerance * model.error_scales),
            clock=np.array([0.0, 0.0, FIRST_STEP_RATIO * self._max_step, 1.0]),
            counts=np.zeros(5, dtype=np.int64),
        )
        self._stepper.y[:] = self._stepper.y0[:] = model.state
        self._contacts: Array | None = None  # as the last step left them, while a sample is seen

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._stepper.clock[1])

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps, rejected, evaluations = self._stepper.counts[:3]
        return int(steps), int(rejected), int(evaluations)

    def start(self) -> None:
        """Evaluate the start."""
        a = self._model
        start(self._stepper, self._skin, a.friction, *a.parts)

    def prepare(self) -> None:
        """Have the other kernels compiled, by no step and a look that changes nothing."""
        self.advance(self.t, self.t, 0)
        self.interpolate(self.t)

    def advance(self, limit: float, sample: float, most: int) -> None:
        """Step until a limit, s, at which a step ends, or past a sample time, or so many steps.

        Raises
        ------
        SolverError
        """
        a, stepper = self._model, self._stepper
        self._restore_contacts()
        trouble = advance(
            stepper,
            limit,
            sample,
            self._max_step,
            self._error_limit_at_max_step,
            most,
            self._skin,
            a.friction,
            a.distinct_static_friction,
            *a.parts,
        )
        if trouble == NOT_FINITE:
            raise NonFinite(
                f"the state is not finite after t = {self.t:.9g} s; is a stiffness, a torque or a"
                " speed of the scenario too large?"
            )
        if trouble == TOO_SHORT:
            raise StepUnderflow(
                f"at t = {self.t:.9g} s the tolerance asks for a step of {stepper.clock[2]:.2g} s,"
                " below what double precision resolves; give a larger solver.rtol"
            )

    def interpolate(self, t: float) -> "Array":
        """Return the state at a time in the last step; the forces are in the assembly's room.

        Whatever the next steps depend on is left as it is: samples do not change a run.
        """
        a = self._model
        alpha = a.pulleys.table[ALPHA].copy()
        if self._contacts is None:
            self._contacts = a.contacts.table[[SLIP, FRICTION, STICKING]]
        interpolate_step(self._stepper, t, *a.parts)
        a.pulleys.table[ALPHA] = alpha
        return self._stepper.inside

    def _restore_contacts(self) -> None:
        """Have the contacts slip and stick as the last step left them, whatever was looked at."""
        if self._contacts is not None:
            self._model.contacts.table[[SLIP, FRICTION, STICKING]] = self._contacts
            self._contacts = None

    def checkpoint_arrays(self) -> dict[str, "Array"]:
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        self._restore_contacts()
        s, a = self._stepper, self._model
        return {
            "y": s.y,
            "rates1": s.f,
            "clock": s.clock,
            "counts": s.counts,
            **a.contact_state(),
        }
