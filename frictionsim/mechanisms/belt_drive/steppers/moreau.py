"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives.

The scheme is Moreau's; its equations and kernels are in `moreau_kernels` and `moreau_damping`.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError, NonFinite
from frictionsim.mechanisms.belt_drive.assembly import zero_state
from frictionsim.mechanisms.belt_drive.kernels.chain import TINY
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    ALPHA,
    SPEED,
    SPEED_OLD,
    FrictionCoefficients,
)
from frictionsim.mechanisms.belt_drive.stability_limits import contact_stiffness
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import StiffDamping, stiff_damping
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import (
    MAX_OBLIQUITY,
    MoreauState,
    evaluate_forces,
    integrate,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.assembly import BeltModel
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

    Array = npt.NDArray[np.float64]

# The scheme is stable for omega h < 2; where a damper takes the share r h of a velocity in a step
# and its velocity is extrapolated, for (omega + 1.1 r) h < 2 (largest eigenvalue of a step).
MAX_OMEGA_H, LOST_TO_DAMPING = 2.0, 1.1
MAX_DECAY = 0.65  # r h; beyond it less than that
DEFAULT_STEP_RATIO = 0.935  # of it is taken by default
# Seconds, as of the adaptive method; with dampers along the belt a step is compiled in two forms.
COMPILE_SECONDS, COMPILE_SECONDS_WITH_DAMPERS = 12.0, 33.0
# Contacts open and close: a bounce takes pi/omega, and some steps are to fall into it.
MAX_OF_CONTACT = 0.4
# Dampers whose decay in a step is beyond this are solved for; the others are extrapolated.
STIFF = 0.5


def max_stable_step(model: "BeltModel") -> float:
    """Return the length below which steps are stable, s."""
    bending, inertia = model.laws.bending, model.laws.chain.inertia
    decay = 4.0 * bending.damping / inertia if bending is not None else 0.0
    frequency, _ = model.max_frequency_and_decay
    return min(MAX_OMEGA_H / (frequency + LOST_TO_DAMPING * decay), MAX_DECAY / (decay + TINY))


class BeltStepper:
    """A belt drive on its way, as the run of it sees it.

    Parameters
    ----------
    assembly : Assembly
    settings : BeltSolver
        `step` is the length of a step, s; left out, it is near the longest stable one.

    Raises
    ------
    InputError
        If the step is too long for the waves in the belt.
    """

    resumable = True

    def __init__(self, model: "BeltModel", settings: "BeltSolverSettings") -> None:
        self._model = model
        bodies, pulleys = model.laws.chain.bodies, model.pulleys
        max_step = max_stable_step(model)
        pressed = np.sqrt(contact_stiffness(model.laws, model.equilibrium) / model.laws.chain.mass)
        self._h = settings.step or min(
            DEFAULT_STEP_RATIO * max_step, MAX_OF_CONTACT / pressed, settings.max_step or np.inf
        )
        if self._h >= max_step:
            raise InputError(
                f"solver.step: {self._h:.4g} s is too large for the waves in the belt: 'moreau' is"
                f" stable below {max_step:.4g} s here; give a smaller solver.step, or fewer bodies"
            )
        self._skin = model.laws.chain.length
        self._choose_damping_treatment(max_step)
        self.force_per_impulse = 1.0 / self._h
        y0, y, middle, rate = (zero_state(bodies, pulleys) for _ in range(4))
        shape = 6, model.workspace.shape[1]
        before, kinematics, between = (
            v[: shape[0] * shape[1]].reshape(shape) for v in (y0, y, middle)
        )
        counts = np.zeros(4, dtype=np.int64)
        self._state = MoreauState(y0, y, middle, rate, before, kinematics, between, counts)
        self._state.y0[:] = self._state.y[:] = model.state
        self._inside = zero_state(bodies, pulleys)
        # Speeds that are given stand in no state.
        table = model.pulleys
        self._given = np.setdiff1d(np.arange(table.table.shape[1]), table.free)

    def _choose_damping_treatment(self, max_step: float) -> None:
        """Find out when dampers along the belt are too stiff to extrapolate their velocities."""
        a = self._model
        self._friction, axial, mass = a.friction, a.laws.axial_damping, a.laws.chain.mass
        self._laws = a.laws._replace(contact_damping=None)
        self._undamped = self._laws._replace(axial_damping=None)
        self._damping: StiffDamping | None = None
        self._obliquity = MAX_OBLIQUITY
        if axial is None:
            return
        width, pulleys = a.workspace.shape[1], a.pulleys.table.shape[1]
        self._damping = stiff_damping(axial.coefficient, width, pulleys)
        if self._friction is None:  # who sticks is part of that solution: nobody does
            none = np.zeros((pulleys, a.laws.chain.bodies))
            self._friction = FrictionCoefficients(none, none)
        along, turning = 4.0 * axial.coefficient / mass, 6.0 * axial.coefficient / mass
        spare = (MAX_OMEGA_H / self._h - MAX_OMEGA_H / max_step) / LOST_TO_DAMPING
        stiff = self._h * along > STIFF
        self._obliquity = -1.0 if stiff else max(spare, 0.0) / turning

    @property
    def compile_seconds(self) -> float:
        """What the compilation of its kernels is expected to take, s."""
        return COMPILE_SECONDS if self._damping is None else COMPILE_SECONDS_WITH_DAMPERS

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._state.counts[0] * self._h)

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps = int(self._state.counts[0])
        return steps, 0, steps

    def start(self) -> None:
        """Evaluate the start."""
        evaluate_forces(self._state, self._skin, self._friction, self._laws, *self._model.parts[1:])

    def prepare(self) -> None:
        """Have the kernels of a step compiled, by taking none."""
        self._go(0)

    def advance(self, limit: float, sample: float, most: int) -> None:
        """Step until a limit or a sample time, s, is reached or passed, or so many steps.

        Raises
        ------
        SolverError
        """
        ahead = (min(limit, sample) - self.t) / self._h
        # A step that would be left over from rounding is none.
        self._go(min(most, max(1, int(np.ceil(ahead - 1e-6)))))

    def _go(self, steps: int) -> None:
        a, before = self._model, self.t
        finite = integrate(
            steps,
            self._h,
            self._state,
            self._skin,
            self._friction,
            a.distinct_static_friction,
            self._damping,
            a.laws.contact_damping,
            self._obliquity,
            self._undamped,
            self._laws,
            *a.parts[1:],
        )
        if not finite:
            raise NonFinite(
                f"the state is not finite after t = {before:.9g} s; is a stiffness, a torque or a"
                f" speed of the scenario too large, or solver.step = {self._h:.3g} s too long?"
            )

    def interpolate(self, t: float) -> "Array":
        """Return the state at a time in the last step; the forces are those of the step."""
        share = min(max((t - self.t) / self._h + 1.0, 0.0), 1.0)
        s = self._state
        self._inside[:] = s.y0 + share * (s.y - s.y0)
        if s.counts[0]:  # before the first step there is no speed but that of the start
            table = self._model.pulleys.table
            start, end = table[SPEED_OLD, self._given], table[ALPHA, self._given]
            table[SPEED, self._given] = start + share * (end - start)
        return self._inside

    def checkpoint_arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        s = self._state
        dampers = {} if self._damping is None else {"dampers": self._damping.table}
        own = {"y0": s.y0, "y": s.y, "counts": s.counts, **dampers}
        return {**own, **self._model.contact_state()}
