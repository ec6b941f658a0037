"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives.

Moreau's scheme [1]_: half a step with the old velocities, the forces there, the impulses that the
set-valued law asks for, half a step with the new velocities.

    q_m = q + (h/2) v
    v+  = v + h a(q_m, v_m) + (impulses P along t)/m
    P   = clip(m (R omega+ - (v + h a) . t - (h/2) t' . v_m), -mu N h, mu N h)
    q+  = q_m + (h/2) v+

with t in the middle of the step, and its rate: what sticks has no slip along the t of the end. That
of the middle would leave t' . v_m over half a step, an error of first order. The work of P is that
of the mean velocities, v . t with the t of the middle: the energy closes. The wrap factor of
`kernels.wrap` is taken with t, and its rate with that of t.

One evaluation of the forces a step. They depend on the velocity through dampers and torques, for
which v_m = v + (v - v_before)/2 is the velocity at the middle to second order. The dampers of the
contacts, each of which meets one body only, are solved for instead, and so are dampers along the
belt if they are too stiff for v_m, together with the friction. Of second order where the motion is
smooth, of first order at switches of friction or contact. Stick is exact: the slip that is left is
rounding.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError, NonFinite
from frictionsim.mechanisms.belt_drive.effects.axial import MAX_OBLIQUITY, TINY, has_oblique_joints
from frictionsim.mechanisms.belt_drive.equation import find_contact_candidates, prescribed_speeds
from frictionsim.mechanisms.belt_drive.kernels.contacts import update_contact_modes
from frictionsim.mechanisms.belt_drive.kernels.jit import KernelChoice, inline_kernel, kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    DAMPING_HEAT,
    FRICTION_HEAT,
    SPEED,
    SPEED_OLD,
    Array,
    FrictionCoefficients,
    PitchLine,
    Plane,
    System,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.steppers import moreau_plane as plane
from frictionsim.mechanisms.belt_drive.steppers import moreau_string as string
from frictionsim.mechanisms.belt_drive.steppers.base import Stepper
from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import (
    IMPLICIT_NOW,
    IMPLICIT_STEPS,
    SINCE_SEARCH,
    STEPS,
    MoreauState,
    finish_pulleys,
    free_pulley_speeds,
    predict_pulleys,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    StiffDamping,
    reset_damping_prediction,
    stiff_damping,
)

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings


CANDIDATE_UPDATE_INTERVAL = 16  # steps from one search for contact candidates to the next
ENDED, NON_FINITE, TOO_OBLIQUE = range(3)  # why steps end

# The parts of a step, each for bodies in the plane and for points on a line.
initial_forces = KernelChoice({Plane: plane.initial_forces, PitchLine: string.initial_forces})
forces = KernelChoice({Plane: plane.forces, PitchLine: string.forces})
move = KernelChoice({Plane: plane.move, PitchLine: string.move})
finish = KernelChoice({Plane: plane.finish, PitchLine: string.finish})


@kernel
def integrate(
    steps: int,
    h: float,
    state: MoreauState,
    max_obliquity: float | None,
    distinct_static_friction: bool,
    stiff: StiffDamping | None,
    system: System,
) -> int:
    """Take at most `steps` steps of length h, s; return ENDED, NON_FINITE or TOO_OBLIQUE.

    There are two forms, each compiled when it is first needed: with `stiff` the dampers along the
    belt are solved for, and `system` has none; else `system` has them. Where a body is more oblique
    to its joints than `max_obliquity` after the last step before a search for candidates, or no
    more, the other form is due, and this one stops; None: the form never changes. With
    distinct static friction the modes of contacts are updated after each step. With no step at
    the start it evaluates the forces there, without friction.
    """
    counts, end = state.counts, ENDED
    before = counts[STEPS]
    starts = before == 0 and steps == 0
    if starts:
        prescribed_speeds(0.0, system)
    while starts or counts[STEPS] < before + steps:
        if counts[SINCE_SEARCH] == 0:
            find_contact_candidates(system, state.new)
        if starts:
            initial_forces(system.kinematics, state, system)
        else:
            step(counts[STEPS] * h, h, state, stiff, system)
            if distinct_static_friction:
                update_contact_modes(system.contacts)
            counts[IMPLICIT_STEPS] += counts[IMPLICIT_NOW]
            counts[STEPS] += 1
            counts[SINCE_SEARCH] = (counts[SINCE_SEARCH] + 1) % CANDIDATE_UPDATE_INTERVAL
        if max_obliquity is not None and counts[SINCE_SEARCH] == 0:
            # Now, as the workspace of this step is in no checkpoint.
            implicit = has_oblique_joints(system.workspace, system.chain, max_obliquity)
            if implicit != counts[IMPLICIT_NOW]:
                counts[IMPLICIT_NOW] = implicit
                reset_damping_prediction(stiff)
                end = TOO_OBLIQUE
                break
        if starts:
            break
    if counts[STEPS] > before:
        finish(system.kinematics, h, state, system)
    total = 0.0
    for i in range(len(state.y)):
        total += abs(state.y[i])
    return end if total < np.inf else NON_FINITE


@inline_kernel
def step(
    t: float, h: float, state: MoreauState, stiff: StiffDamping | None, system: System
) -> None:
    """Take one step from time t."""
    y, kinematics, energies = state.y, system.kinematics, system.layout.energies
    predict_pulleys(t, h, y, state.y_old, system)
    damped = forces(kinematics, h, state, stiff, system)
    prescribed_speeds(t + h, system)
    free_pulley_speeds(h, system.pulleys)
    rubbed, braked = move(kinematics, h, state, stiff, system)
    finish_pulleys(h, y, system)
    y[energies + FRICTION_HEAT] += rubbed
    y[energies + DAMPING_HEAT] += h * damped + braked


# The scheme is stable for omega h < 2; where a damper takes the share r h of a velocity in a step
# and its velocity is extrapolated, for (omega + 1.1 r) h < 2 (largest eigenvalue of a step).
MAX_OMEGA_H, LOST_TO_DAMPING = 2.0, 1.1
MAX_DECAY = 0.65  # r h; beyond it less than that
DEFAULT_STEP_RATIO = 0.935  # of it is taken by default
# Seconds, as of the adaptive method; of steps that solve for dampers along the belt.
COMPILE_SECONDS, COMPILE_SECONDS_STIFF = 12.0, 18.0
STRING_COMPILE_SECONDS, STRING_COMPILE_SECONDS_STIFF = 5.0, 9.0
# Contacts open and close: a bounce takes pi/omega, and some steps are to fall into it.
MAX_CONTACT_PHASE = 0.4
# Dampers whose decay in a step is beyond this are solved for; the others are extrapolated.
STIFF = 0.5
# Dampers of a string are solved for if they would shorten the steps by more than this: a step that
# does takes about as much longer.
SHORTENED = 4.0
LAST_STEP = CANDIDATE_UPDATE_INTERVAL - 1  # after a search, before the next one


def max_stable_step(model: "BeltModel") -> float:
    """Return the length below which steps of bodies in the plane are stable, s."""
    return stable_step(model.max_frequency, 4.0 * (model.belt.bend_damping or 0.0))


def stable_step(frequency: float, decay: float) -> float:
    """Return the length below which steps are stable, s, where velocities are extrapolated."""
    return min(MAX_OMEGA_H / (frequency + LOST_TO_DAMPING * decay), MAX_DECAY / (decay + TINY))


class StepPlan(NamedTuple):
    """How a belt is stepped.

    Attributes
    ----------
    h, max_step : float, s
        The length of a step, and that below which steps are stable.
    stiff : StiffDamping or None
        The dampers along the belt, where steps may solve for them.
    implicit : bool
        They do so at the start.
    max_obliquity : float or None
        Of `integrate`.
    dampers : array or None
        What the next step depends on of them.
    compile_seconds : (2,), s
        Without and with them solved for.
    """

    h: float
    max_step: float
    stiff: StiffDamping | None
    implicit: bool
    max_obliquity: float | None
    dampers: Array | None
    compile_seconds: tuple[float, float]


def plane_plan(model: "BeltModel", settings: "BeltSolverSettings") -> StepPlan:
    """Return the step plan of bodies in the plane; oblique joints need implicit damping."""
    system = model.system
    max_step, damping = max_stable_step(model), system.effects.axial_damping.damping
    contact_frequency = np.sqrt(model.contact_stiffness / system.chain.mass)
    h = settings.step or min(
        DEFAULT_STEP_RATIO * max_step,
        MAX_CONTACT_PHASE / contact_frequency,
        settings.max_step or np.inf,
    )
    stiff, obliquity = None, MAX_OBLIQUITY
    if damping is not None:
        stiff = stiff_damping(damping, system.layout.width, system.pulleys.table.shape[1])
        along, turning = 4.0 * damping / system.chain.mass, 6.0 * damping / system.chain.mass
        spare = (MAX_OMEGA_H / h - MAX_OMEGA_H / max_step) / LOST_TO_DAMPING
        obliquity = -1.0 if h * along > STIFF else max(spare, 0.0) / turning
    dampers = None if stiff is None else stiff.table
    seconds = COMPILE_SECONDS, COMPILE_SECONDS_STIFF
    return StepPlan(h, max_step, stiff, obliquity < 0.0, obliquity, dampers, seconds)


def string_plan(model: "BeltModel", settings: "BeltSolverSettings") -> StepPlan:
    """Return how a guided string is stepped: with its dampers solved for throughout, or never."""
    system = model.system
    damping, frequency = system.effects.axial_damping.damping, model.max_frequency
    max_step = stable_step(frequency, 4.0 * (damping or 0.0) / system.chain.mass)
    stiff = None
    if damping and (settings.step or MAX_OMEGA_H / frequency / SHORTENED) >= max_step:
        max_step = MAX_OMEGA_H / frequency
        stiff = string.string_damping(damping, system.layout.width, system.pulleys.table.shape[1])
    h = settings.step or min(DEFAULT_STEP_RATIO * max_step, settings.max_step or np.inf)
    dampers = None if stiff is None else stiff.table[string.IMPULSE]
    seconds = STRING_COMPILE_SECONDS, STRING_COMPILE_SECONDS_STIFF
    return StepPlan(h, max_step, stiff, stiff is not None, None, dampers, seconds)


class MoreauStepper(Stepper):
    """A belt drive between two steps of a fixed length.

    Parameters
    ----------
    model : BeltModel
    settings : BeltSolverSettings
        `step` is the length of a step, s; left out, it is near the longest stable one.
    """

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        super().__init__(model)
        on_line = isinstance(model.system.kinematics, PitchLine)
        self._plan = plan = (string_plan if on_line else plane_plan)(model, settings)
        if plan.h >= plan.max_step:
            raise InputError(
                f"solver.step: {plan.h:.4g} s is too large for the waves in the belt: 'moreau' is"
                f" stable below {plan.max_step:.4g} s here; give a smaller solver.step, or fewer"
                " bodies"
            )
        self.force_per_impulse = 1.0 / plan.h
        self._distinct_static_friction = model.distinct_static_friction
        self._ready: set[bool] = set()  # the forms of a step that are compiled
        system, layout = model.system, model.system.layout
        if plan.stiff is not None and system.friction is None and not on_line:
            # The set of sticking bodies is part of that solution: it is empty.
            none = np.zeros((system.pulleys.table.shape[1], layout.bodies))
            system = system._replace(friction=FrictionCoefficients(none, none))
        axial = system.effects.axial_damping._replace(damping=None)
        undamped = system._replace(effects=system.effects._replace(axial_damping=axial))
        # The dampers that are solved for and the system with the others, by the form of a step.
        self._forms = {False: (None, system), True: (plan.stiff, undamped)}
        y_old, y, rate = (zero_state(layout) for _ in range(3))
        middle = kinematics_of(rate if on_line else y_old, layout)
        counts = np.zeros(4, dtype=np.int64)
        counts[IMPLICIT_NOW] = plan.implicit
        self._state = MoreauState(y_old, y, rate, kinematics_of(y, layout), middle, counts)
        self._saved_counts = counts[: IMPLICIT_NOW if on_line else len(counts)]
        y_old[:] = y[:] = model.state

    @property
    def compile_seconds(self) -> float:
        """The expected time of the compilation of its kernels, s."""
        return self._plan.compile_seconds[self._form]

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._state.counts[STEPS] * self._plan.h)

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps = int(self._state.counts[STEPS])
        return steps, 0, steps

    def start(self) -> None:
        """Evaluate the start."""
        self._integrate(0)

    def prepare(self) -> None:
        """Have the kernels of a step compiled, in the form that is due, by taking none."""
        self._ready.add(self._form)
        self._integrate(0)

    @property
    def prepared(self) -> bool:
        """Whether the kernels of the next step are compiled."""
        return self._form in self._ready

    @property
    def _form(self) -> bool:
        """Whether the next step solves for the dampers along the belt."""
        return bool(self._state.counts[IMPLICIT_NOW])

    def advance(self, limit: float, sample: float, max_steps: int) -> None:
        """Step until a limit or a sample time, s, is reached or passed, or `max_steps` are taken.

        After `prepare` it stops before the first step whose kernels are not compiled.
        """
        ahead = (min(limit, sample) - self.t) / self._plan.h
        # A remainder of a step from rounding is no step.
        end = self._state.counts[STEPS] + min(max_steps, max(1, int(np.ceil(ahead - 1e-6))))
        while (left := int(end - self._state.counts[STEPS])) > 0:
            self._integrate(left)
            if self._ready and not self.prepared:
                return

    def _integrate(self, steps: int) -> None:
        before, h, obliquity = self.t, self._plan.h, self._plan.max_obliquity
        distinct, (stiff, system) = self._distinct_static_friction, self._forms[self._form]
        ended = integrate(steps, h, self._state, obliquity, distinct, stiff, system)
        if ended == NON_FINITE:
            raise NonFinite(
                f"the state is not finite after t = {before:.9g} s; is a stiffness, a torque or a"
                f" speed of the scenario too large, or solver.step = {h:.3g} s too long?"
            )

    def _own_arrays(self) -> dict[str, Any]:
        s, dampers = self._state, self._plan.dampers
        own = {"y_old": s.y_old, "y": s.y, "counts": self._saved_counts}
        return own if dampers is None else {**own, "dampers": dampers}

    def interpolate(self, t: float) -> Array:
        """Return the state at a time in the last step; the forces are those of the step."""
        ratio = min(max((t - self.t) / self._plan.h + 1.0, 0.0), 1.0)
        s = self._state
        inside: Array = s.y_old + ratio * (s.y - s.y_old)
        if s.counts[STEPS]:  # before the first step there is no speed but that of the start
            _, prescribed, table = self._model.system.pulleys  # prescribed speeds are in no state
            start, end = table[SPEED_OLD, prescribed], table[ALPHA, prescribed]
            table[SPEED, prescribed] = start + ratio * (end - start)
        return inside


STEPPER = MoreauStepper
