"""SciPy's integrators on the equations of a belt drive, for comparison.

The right-hand side is that of the adaptive method, exact stick and all: with the slip of a sticking
body decaying in a short time it is continuous, which is all that these methods ask for. They know
nothing of the waves, and the implicit ones nothing of the structure of the equations.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.assembly import zero_state
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    SPEED,
    find_contact_candidates,
    update_friction_coefficients,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    kinematics_of,
    prescribed_speeds,
    rhs,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import kernel
from frictionsim.scenario import methods
from frictionsim.solvers.scipy_stepper import ScipyStepper

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.assembly import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

    Array = npt.NDArray[np.float64]

COMPILE_SECONDS = 10.0  # s, as of the adaptive method
LARGE = 1e30  # the tolerance of an energy: none
MIN_RTOL = 3e-14  # what SciPy takes without complaint; the sizes of the states decide


@kernel
def rhs_with_candidates(
    t, state, rate, skin, friction, laws, torques, loads, speeds, workspace, contacts, pulleys
):
    """Write the rates of a state, wherever its bodies are: steps may be long."""
    first = 6 * workspace.shape[1] + pulleys.table.shape[1]
    for k in range(len(pulleys.free)):
        pulleys.table[SPEED, pulleys.free[k]] = state[first + k]
    prescribed_speeds(t, pulleys, speeds)
    find_contact_candidates(
        kinematics_of(state, workspace), laws.chain.bodies, pulleys, skin, contacts, friction
    )
    rhs(t, 0.0, state, rate, laws, torques, loads, speeds, workspace, contacts, pulleys)


class _BeltStepper(ScipyStepper):
    """A method of SciPy that evaluates a compiled right-hand side."""

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        method = methods.BACKENDS[settings.backend].integrator
        super().__init__(
            method,
            rtol=MIN_RTOL,
            atol=1.0,
            max_step=settings.max_step or np.inf,
            max_steps=settings.max_steps,
            what="the belt",
        )
        tolerance = (settings.rtol + settings.atol) * model.error_scales
        self._options["atol"] = np.minimum(tolerance, LARGE)
        self._model = model
        self._state = zero_state(model.laws.chain.bodies, model.pulleys)
        self._rate = zero_state(model.laws.chain.bodies, model.pulleys)

    def _rates_of(self, t: float, y: Any) -> Any:
        self.nfev += 1
        self.evaluate(t, y)
        return self._rate.copy()

    def evaluate(self, t: float, y: Any) -> "Array":
        """Evaluate the equations at a state, and return it; the room has the forces then."""
        a = self._model
        self._state[:] = y
        rhs_with_candidates(t, self._state, self._rate, a.laws.chain.length, a.friction, *a.parts)
        return self._state


class BeltStepper:
    """A belt drive on its way, as the run of it sees it."""

    force_per_impulse = 1.0  # the slots hold forces
    resumable = False  # what a method remembers of its steps is its own
    compile_seconds = COMPILE_SECONDS

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
        if self._model.distinct_static_friction is not None:
            contacts = self._model.contacts
            update_friction_coefficients(contacts._replace(table=contacts.table.copy()))

    def advance(self, limit: float, sample: float, most: int) -> None:
        """Take one step, that ends at a limit, s, at the latest.

        Raises
        ------
        SolverError
        """
        self._stepper.advance(limit)
        if self._model.distinct_static_friction is not None:
            self.interpolate(self.t)
            update_friction_coefficients(self._model.contacts)

    def interpolate(self, t: float) -> "Array":
        """Return the state at a time in the last step; the forces are in the assembly's room."""
        return self._stepper.evaluate(t, self._stepper.interpolate(t))

    def checkpoint_arrays(self) -> dict[str, "Array"]:
        """Return nothing: there is no going on from it."""
        return {}
