"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives.

The scheme is Moreau's; its equations and kernels are in `moreau_kernels` and `moreau_damping`.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.axial import MAX_OBLIQUITY, TINY
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.kernels.system import FrictionCoefficients
from frictionsim.mechanisms.belt_drive.stability_limits import explicit_decay
from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import FixedSteps
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import StiffDamping, stiff_damping
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import (
    IMPLICIT_NOW,
    IMPLICIT_STEPS,
    STEPS,
    MoreauState,
    StepTreatment,
    evaluate_forces,
    integrate,
)
from frictionsim.solvers.state_values import COUNT, Values

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

    Array = npt.NDArray[np.float64]

# The scheme is stable for omega h < 2; where a damper takes the share r h of a velocity in a step
# and its velocity is extrapolated, for (omega + 1.1 r) h < 2 (largest eigenvalue of a step).
MAX_OMEGA_H, LOST_TO_DAMPING = 2.0, 1.1
MAX_DECAY = 0.65  # r h; beyond it less than that
DEFAULT_STEP_RATIO = 0.935  # of it is taken by default
# Seconds, as of the adaptive method; of steps that solve for dampers along the belt.
COMPILE_SECONDS, COMPILE_SECONDS_STIFF = 12.0, 18.0
# Contacts open and close: a bounce takes pi/omega, and some steps are to fall into it.
MAX_OF_CONTACT = 0.4
# Dampers whose decay in a step is beyond this are solved for; the others are extrapolated.
STIFF = 0.5


def max_stable_step(model: "BeltModel") -> float:
    """Return the length below which steps are stable, s."""
    frequency, _ = model.max_frequency_and_decay
    return stable_step(frequency, explicit_decay(model.system))


def stable_step(frequency: float, decay: float) -> float:
    """Return the length below which steps are stable, s, where velocities are extrapolated."""
    return min(MAX_OMEGA_H / (frequency + LOST_TO_DAMPING * decay), MAX_DECAY / (decay + TINY))


class BeltStepper(FixedSteps):
    """A belt drive on its way, as the run of it sees it.

    Parameters
    ----------
    model : BeltModel
    settings : BeltSolverSettings
        `step` is the length of a step, s; left out, it is near the longest stable one.
    """

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        max_step = max_stable_step(model)
        contact_frequency = np.sqrt(model.contact_stiffness / model.system.chain.mass)
        h = settings.step or min(
            DEFAULT_STEP_RATIO * max_step,
            MAX_OF_CONTACT / contact_frequency,
            settings.max_step or np.inf,
        )
        super().__init__(model, h, max_step)
        self._choose_damping_treatment(max_step)
        layout = model.system.layout
        y_old, y, rate = (zero_state(layout) for _ in range(3))
        old, new = (kinematics_of(v, layout) for v in (y_old, y))
        counts = np.zeros(4, dtype=np.int64)
        self._state = MoreauState(y_old, y, rate, old, new, counts)
        counts[IMPLICIT_NOW] = self._treatment.max_obliquity < 0.0  # they are solved for always
        self._ready: set[bool] = set()  # the forms of a step that are compiled
        y_old[:] = y[:] = model.state

    def _choose_damping_treatment(self, max_step: float) -> None:
        """Find out when dampers along the belt are too stiff to extrapolate their velocities."""
        system, effects = self._model.system, self._model.system.effects
        axial, mass = effects.axial_damping, system.chain.mass
        undamped = effects._replace(axial_damping=axial._replace(damping=None))
        self._system = system
        self._stiff: StiffDamping | None = None
        obliquity = MAX_OBLIQUITY
        if axial.damping is not None:
            layout, pulleys = system.layout, system.pulleys.table.shape[1]
            self._stiff = stiff_damping(axial.damping, layout.width, pulleys)
            if system.friction is None:  # who sticks is part of that solution: nobody does
                none = np.zeros((pulleys, layout.bodies))
                self._system = self._system._replace(friction=FrictionCoefficients(none, none))
            along, turning = 4.0 * axial.damping / mass, 6.0 * axial.damping / mass
            spare = (MAX_OMEGA_H / self._h - MAX_OMEGA_H / max_step) / LOST_TO_DAMPING
            obliquity = -1.0 if self._h * along > STIFF else max(spare, 0.0) / turning
        self._undamped = self._system._replace(effects=undamped)
        self._treatment = StepTreatment(obliquity, self._model.distinct_static_friction)

    @property
    def compile_seconds(self) -> float:
        """What the compilation of its kernels is expected to take, s."""
        return COMPILE_SECONDS_STIFF if self._form else COMPILE_SECONDS

    def start(self) -> None:
        """Evaluate the start."""
        evaluate_forces(self._state, self._system)

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
        """Step until a limit or a sample time, s, is reached or passed, or so many steps.

        Who has called `prepare` finds it stopped where the other form of a step is due first.
        """
        steps = self._steps_to(limit, sample, max_steps)
        end = self._state.counts[STEPS] + steps
        while (left := int(end - self._state.counts[STEPS])) > 0:
            self._integrate(left)
            if self._ready and not self.prepared:
                return

    def _take_steps(self, steps: int) -> int:
        stiff, system = (self._stiff, self._undamped) if self._form else (None, self._system)
        ended: int = integrate(steps, self._h, self._state, self._treatment, stiff, system)
        return ended

    @property
    def _dampers(self) -> "Array | None":
        return None if self._stiff is None else self._stiff.table

    def count_values(self, duration: float) -> "dict[int, Values]":
        """Return the valid values of `counts`."""
        implicit = Values(0.0, float(self._stiff is not None), whole=True)
        forms = {IMPLICIT_NOW: implicit, IMPLICIT_STEPS: COUNT}
        return {**super().count_values(duration), **forms}
