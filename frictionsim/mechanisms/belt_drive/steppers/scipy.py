"""SciPy's integrators on the equations of a belt drive, for comparison.

The right-hand side is that of the adaptive method, set-valued friction and all: with the slip of a
sticking body decaying in a short time it is continuous, which is all that these methods ask for.
They know nothing of the waves, and the implicit ones nothing of the structure of the equations.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.contacts import update_contact_modes
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    find_contact_candidates,
    prescribed_speeds,
    rhs,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import SPEED, zero_state
from frictionsim.scenario import methods
from frictionsim.solvers.scipy_stepper import ScipyStepper

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.kernels.system import System
    from frictionsim.mechanisms.belt_drive.model import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings
    from frictionsim.solvers.state_values import Expected

    Array = npt.NDArray[np.float64]

COMPILE_SECONDS = 10.0  # s, as of the adaptive method
LARGE = 1e30  # the tolerance of an energy: none
MIN_RTOL = 3e-14  # what SciPy takes without complaint; the error scales decide


@kernel
def rhs_with_candidates(t: float, state: "Array", rate: "Array", system: "System") -> None:
    """Write the rates of a state, wherever its bodies are: steps may be long."""
    pulleys, layout = system.pulleys, system.layout
    for k in range(len(pulleys.free)):
        pulleys.table[SPEED, pulleys.free[k]] = state[layout.speeds + k]
    prescribed_speeds(t, system)
    kinematics = state[: layout.angles].reshape((layout.angles // layout.width, layout.width))
    find_contact_candidates(system, kinematics)
    rhs(t, 0.0, state, rate, system)


class _BeltStepper(ScipyStepper):
    """A method of SciPy that evaluates a compiled right-hand side."""

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        method = methods.METHODS[settings.backend].scipy_class
        super().__init__(
            method,
            rtol=MIN_RTOL,
            atol=1.0,
            max_step=settings.max_step or np.inf,
            max_steps=settings.max_steps,
            what="the belt",
        )
        self._options["atol"] = np.minimum(settings.rtol * model.error_scales, LARGE)
        self._system = model.system
        self._state = zero_state(model.system.layout)
        self._rate = zero_state(model.system.layout)

    def _fun(self, t: float, y: Any) -> Any:
        self.nfev += 1
        self.evaluate(t, y)
        return self._rate.copy()

    def evaluate(self, t: float, y: Any) -> "Array":
        """Evaluate the equations at a state, and return it; the system has the forces then."""
        self._state[:] = y
        rhs_with_candidates(float(t), self._state, self._rate, self._system)
        return self._state


class BeltStepper:
    """A belt drive on its way, as the run of it sees it."""

    force_per_impulse = 1.0  # the contacts hold forces
    resumable = False  # what a method remembers of its steps is its own
    compile_seconds = COMPILE_SECONDS
    prepared = True  # once `prepare` was called: all steps are alike

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        self._model = model
        self._stepper = _BeltStepper(model, settings)

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return self._stepper.t

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        return self._stepper.steps, self._stepper.rejected, self._stepper.nfev

    def start(self) -> None:
        """Evaluate the start."""
        self._stepper.start(lambda t, y, dy: None, 0.0, self._model.state.tolist())
        self._stepper.evaluate(0.0, self._model.state)

    def prepare(self) -> None:
        """Have the one kernel compiled that the start does not call, on a copy."""
        if self._model.distinct_static_friction:
            contacts = self._model.system.contacts
            update_contact_modes(contacts._replace(table=contacts.table.copy()))

    def advance(self, limit: float, sample: float, max_steps: int) -> None:
        """Take one step, that ends at a limit, s, at the latest."""
        self._stepper.advance(limit)
        if self._model.distinct_static_friction:
            self.interpolate(self.t)
            update_contact_modes(self._model.system.contacts)

    def interpolate(self, t: float) -> "Array":
        """Return the state at a time in the last step; the system has the forces there."""
        return self._stepper.evaluate(t, self._stepper.interpolate(t))

    def checkpoint_arrays(self) -> dict[str, "Array"]:
        """Return nothing: there is no going on from it."""
        return {}

    def checkpoint_values(self, duration: float) -> "dict[str, Expected]":
        """Return nothing: there is no checkpoint."""
        return {}

    def restored_fault(self) -> str:
        """Return nothing: there is no checkpoint."""
        return ""
