"""Midpoint steps of a fixed length with exact impulses of friction, for a guided string."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.guided_string.moreau_kernels import (
    IMPULSE,
    StringState,
    integrate_string,
    string_damping,
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
    MAX_OMEGA_H,
    stable_step,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import NOT_FINITE
from frictionsim.solvers.state_values import NUMBER

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings
    from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import StiffDamping
    from frictionsim.solvers.state_values import Expected

    Array = npt.NDArray[np.float64]

COMPILE_SECONDS, COMPILE_SECONDS_STIFF = 5.0, 9.0
# Dampers that would shorten the steps by more than this are solved for; a step that does takes
# about as much longer. The others are extrapolated.
SHORTENED = 4.0


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

    prepared = True  # once `prepare` was called: all steps are alike

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        system, layout = model.system, model.system.layout
        frequency, _ = model.max_frequency_and_decay
        axial = system.effects.axial_damping
        max_step = stable_step(frequency, 4.0 * (axial.damping or 0.0) / system.chain.mass)
        self._system = system
        self._stiff: StiffDamping | None = None
        if axial.damping and (settings.step or MAX_OMEGA_H / frequency / SHORTENED) >= max_step:
            max_step = MAX_OMEGA_H / frequency
            self._stiff = string_damping(axial.damping, layout.width, system.pulleys.table.shape[1])
            undamped = system.effects._replace(axial_damping=axial._replace(damping=None))
            self._system = system._replace(effects=undamped)
        h = settings.step or min(DEFAULT_STEP_RATIO * max_step, settings.max_step or np.inf)
        super().__init__(model, h, max_step)
        y_old, y = zero_state(layout), zero_state(layout)
        y_old[:] = y[:] = model.state
        middle, counts = aligned_zeros(STRING_ROWS, layout.width), np.zeros(2, dtype=np.int64)
        self._state = StringState(y_old, y, kinematics_of(y, layout), middle, counts)

    @property
    def compile_seconds(self) -> float:
        """What the compilation of its kernels is expected to take, s."""
        return COMPILE_SECONDS if self._stiff is None else COMPILE_SECONDS_STIFF

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
        before, distinct = self.t, self._model.distinct_static_friction
        stiff, system = self._stiff, self._system
        assert system.line is not None
        ended = integrate_string(steps, self._h, self._state, distinct, stiff, system.line, system)
        if ended == NOT_FINITE:
            raise self._not_finite(before)

    def checkpoint_arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        s, stiff = self._state, self._stiff
        dampers = {} if stiff is None else {"dampers": stiff.table[IMPULSE]}
        own = {"y_old": s.y_old, "y": s.y, "counts": s.counts, **dampers}
        return {**own, **self._model.contact_state()}

    def checkpoint_values(self, duration: float) -> "dict[str, Expected]":
        """Return what the arrays of a checkpoint may hold, by name."""
        dampers = {} if self._stiff is None else {"dampers": NUMBER}
        return {**self.step_values(duration), **dampers, **self._model.contact_values()}
