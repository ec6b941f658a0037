"""Midpoint steps of a fixed length with exact impulses of friction, for a guided string."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.guided_string.moreau_kernels import (
    StringState,
    integrate_string,
)
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    STRING_ROWS,
    aligned_zeros,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import FixedSteps
from frictionsim.mechanisms.belt_drive.steppers.moreau import (
    DEFAULT_STEP_RATIO,
    stable_step,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import NOT_FINITE

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings
    from frictionsim.solvers.state_values import Expected

    Array = npt.NDArray[np.float64]

COMPILE_SECONDS = 5.0


class BeltStepper(FixedSteps):
    """A guided string on its way, as the run of it sees it.

    Parameters
    ----------
    model : BeltModel
    settings : BeltSolverSettings
        `step` is the length of a step, s; left out, it is near the longest stable one.

    Raises
    ------
    InputError
        If the step is too long for the waves in the belt.
    """

    compile_seconds = COMPILE_SECONDS
    prepared = True  # once `prepare` was called: all steps are alike

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        frequency, _ = model.max_frequency_and_decay
        damping = model.system.effects.axial_damping.damping or 0.0
        max_step = stable_step(frequency, 4.0 * damping / model.system.chain.mass)
        h = settings.step or min(DEFAULT_STEP_RATIO * max_step, settings.max_step or np.inf)
        super().__init__(model, h, max_step)
        layout = model.system.layout
        y_old, y = zero_state(layout), zero_state(layout)
        y_old[:] = y[:] = model.state
        middle, counts = aligned_zeros(STRING_ROWS, layout.width), np.zeros(2, dtype=np.int64)
        self._state = StringState(y_old, y, kinematics_of(y, layout), middle, counts)

    def start(self) -> None:
        """Evaluate the start."""
        self._integrate(0)

    def prepare(self) -> None:
        """Have the kernel of a step compiled, by taking none."""
        self._integrate(0)

    def advance(self, limit: float, sample: float, max_steps: int) -> None:
        """Step until a limit or a sample time, s, is reached or passed, or so many steps.

        Raises
        ------
        SolverError
        """
        self._integrate(self._steps_to(limit, sample, max_steps))

    def _integrate(self, steps: int) -> None:
        before, model = self.t, self._model
        distinct, system = model.distinct_static_friction, model.system
        assert system.line is not None
        ended = integrate_string(steps, self._h, self._state, distinct, system.line, system)
        if ended == NOT_FINITE:
            raise self._not_finite(before)

    def checkpoint_arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        s = self._state
        own = {"y_old": s.y_old, "y": s.y, "counts": s.counts}
        return {**own, **self._model.contact_state()}

    def checkpoint_values(self, duration: float) -> "dict[str, Expected]":
        """Return what the arrays of a checkpoint may hold, by name."""
        return {**self.step_values(duration), **self._model.contact_values()}
