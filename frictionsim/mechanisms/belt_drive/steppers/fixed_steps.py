"""What integrations with steps of a fixed length have in common."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError, NonFinite
from frictionsim.mechanisms.belt_drive.kernels.layout import ALPHA, SPEED, SPEED_OLD
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import (
    CANDIDATE_UPDATE_INTERVAL,
    NON_FINITE,
    SINCE_SEARCH,
    STEPS,
)
from frictionsim.solvers.state_values import COUNT, NUMBER, Rows

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.solvers.state_values import Expected, Values

    Array = npt.NDArray[np.float64]

LAST_STEP = CANDIDATE_UPDATE_INTERVAL - 1  # after a search, before the next one


class FixedSteps:
    """An integration with steps of the length h, s, of which `state` has the last one.

    Parameters
    ----------
    model : BeltModel
    h, max_step : float, s
        The length of a step, and that below which steps are stable.
    """

    resumable = True

    def __init__(self, model: "BeltModel", h: float, max_step: float) -> None:
        if h >= max_step:
            raise InputError(
                f"solver.step: {h:.4g} s is too large for the waves in the belt: 'moreau' is"
                f" stable below {max_step:.4g} s here; give a smaller solver.step, or fewer bodies"
            )
        self._model, self._h = model, h
        self._state: Any = None  # y_old, y and counts are used here
        self.force_per_impulse = 1.0 / h

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._state.counts[STEPS] * self._h)

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps = int(self._state.counts[STEPS])
        return steps, 0, steps

    def _steps_to(self, limit: float, sample: float, max_steps: int) -> int:
        """Return how many steps reach or pass a limit or a sample time, s, at least one."""
        ahead = (min(limit, sample) - self.t) / self._h
        # A step that would be left over from rounding is none.
        return min(max_steps, max(1, int(np.ceil(ahead - 1e-6))))

    def _integrate(self, steps: int) -> None:
        before = self.t
        if self._take_steps(steps) == NON_FINITE:
            raise NonFinite(
                f"the state is not finite after t = {before:.9g} s; is a stiffness, a torque or a"
                f" speed of the scenario too large, or solver.step = {self._h:.3g} s too long?"
            )

    def _take_steps(self, steps: int) -> int:
        """Take at most so many steps; return why they end."""
        raise NotImplementedError

    @property
    def _dampers(self) -> "Array | None":
        """What the next step depends on of the dampers that are solved for, if any are."""
        raise NotImplementedError

    def checkpoint_arrays(self) -> "dict[str, Any]":
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        s, dampers = self._state, self._dampers
        own = {"y_old": s.y_old, "y": s.y, "counts": s.counts}
        solved_for = {} if dampers is None else {"dampers": dampers}
        return {**own, **solved_for, **self._model.contact_state()}

    def checkpoint_values(self, duration: float) -> "dict[str, Expected]":
        """Return the valid values of the arrays of a checkpoint, by name."""
        counts = Rows(self.count_values(duration))
        own: dict[str, Expected] = {"y_old": NUMBER, "y": NUMBER, "counts": counts}
        solved_for = {} if self._dampers is None else {"dampers": NUMBER}
        return {**own, **solved_for, **self._model.contact_values()}

    def count_values(self, duration: float) -> "dict[int, Values]":
        """Return the valid values of `counts`."""
        most = float(np.ceil(duration / self._h) + 1.0)  # the last step may go past the end
        return {STEPS: COUNT._replace(high=most), SINCE_SEARCH: COUNT._replace(high=LAST_STEP)}

    def restored_fault(self) -> str:
        """Return the array of a checkpoint that does not go with the others; empty if all do."""
        return self._model.contact_fault()

    def interpolate(self, t: float) -> "Array":
        """Return the state at a time in the last step; the forces are those of the step."""
        ratio = min(max((t - self.t) / self._h + 1.0, 0.0), 1.0)
        s = self._state
        inside: Array = s.y_old + ratio * (s.y - s.y_old)
        if s.counts[STEPS]:  # before the first step there is no speed but that of the start
            _, prescribed, table = self._model.system.pulleys  # prescribed speeds are in no state
            start, end = table[SPEED_OLD, prescribed], table[ALPHA, prescribed]
            table[SPEED, prescribed] = start + ratio * (end - start)
        return inside
