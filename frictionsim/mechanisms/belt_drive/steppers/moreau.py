"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives.

The scheme is Moreau's; its equations and kernels are in `moreau_kernels` and `moreau_damping`.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError, NonFinite
from frictionsim.mechanisms.belt_drive.assembly import new_state
from frictionsim.mechanisms.belt_drive.kernels.chain import TINY
from frictionsim.mechanisms.belt_drive.kernels.contact import ALPHA, BEFORE, SPEED, Friction
from frictionsim.mechanisms.belt_drive.stability_limits import contact_stiffness
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import StiffDamping, stiff_damping
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import MOST_OBLIQUE, Walk, look, walk

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.assembly import Assembly
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

    Array = npt.NDArray[np.float64]

# The scheme is stable for omega h < 2; where a damper takes the share r h of a velocity in a step
# and its velocity is extrapolated, for (omega + 1.1 r) h < 2 (largest eigenvalue of a step).
LONGEST, LOST_TO_DAMPING = 2.0, 1.1
LONGEST_DECAY = 0.65  # r h; beyond it less than that
NEARLY = 0.935  # of it is taken by default
# Seconds, as of the adaptive method; with dampers along the belt a step is compiled in two forms.
COMPILES_IN, COMPILES_WITH_DAMPERS_IN = 12.0, 33.0
# Contacts open and close: a bounce takes pi/omega, and some steps are to fall into it.
LONGEST_OF_CONTACT = 0.4
# Dampers whose decay in a step is beyond this are solved for; the others are extrapolated.
STIFF = 0.5


def longest_step(assembly: "Assembly") -> float:
    """Return the length below which steps are stable, s."""
    bending, inertia = assembly.laws.bending, assembly.laws.chain.inertia
    decay = 4.0 * bending.damping / inertia if bending is not None else 0.0
    oscillating, _ = assembly.fastest
    return min(LONGEST / (oscillating + LOST_TO_DAMPING * decay), LONGEST_DECAY / (decay + TINY))


class Stepping:
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

    def __init__(self, assembly: "Assembly", settings: "BeltSolverSettings") -> None:
        self._assembly = assembly
        bodies, pulleys = assembly.laws.chain.bodies, assembly.pulleys
        longest = longest_step(assembly)
        pressed = np.sqrt(
            contact_stiffness(assembly.laws, assembly.rest) / assembly.laws.chain.mass
        )
        self._h = settings.step or min(
            NEARLY * longest, LONGEST_OF_CONTACT / pressed, settings.max_step or np.inf
        )
        if self._h >= longest:
            raise InputError(
                f"solver.step: {self._h:.4g} s is too large for the waves in the belt: 'moreau' is"
                f" stable below {longest:.4g} s here; give a smaller solver.step, or fewer bodies"
            )
        self._margin = assembly.laws.chain.length
        self._prepare_damping(longest)
        self.per_impulse = 1.0 / self._h
        y0, y, middle, rate = (new_state(bodies, pulleys) for _ in range(4))
        shape = 6, assembly.room.shape[1]
        before, motion, between = (v[: shape[0] * shape[1]].reshape(shape) for v in (y0, y, middle))
        counts = np.zeros(4, dtype=np.int64)
        self._walk = Walk(y0, y, middle, rate, before, motion, between, counts)
        self._walk.y0[:] = self._walk.y[:] = assembly.state
        self._inside = new_state(bodies, pulleys)
        # Speeds that are given stand in no state.
        table = assembly.pulleys
        self._given = np.setdiff1d(np.arange(table.table.shape[1]), table.free)

    def _prepare_damping(self, longest: float) -> None:
        """Find out when dampers along the belt are too stiff to extrapolate their velocities."""
        a = self._assembly
        self._friction, axial, mass = a.friction, a.laws.axial_damping, a.laws.chain.mass
        self._laws = a.laws._replace(contact_damping=None)
        self._undamped = self._laws._replace(axial_damping=None)
        self._damping: StiffDamping | None = None
        self._obliquity = MOST_OBLIQUE
        if axial is None:
            return
        width, pulleys = a.room.shape[1], a.pulleys.table.shape[1]
        self._damping = stiff_damping(axial.coefficient, width, pulleys)
        if self._friction is None:  # who sticks is part of that solution: nobody does
            none = np.zeros((pulleys, a.laws.chain.bodies))
            self._friction = Friction(none, none)
        along, turning = 4.0 * axial.coefficient / mass, 6.0 * axial.coefficient / mass
        spare = (LONGEST / self._h - LONGEST / longest) / LOST_TO_DAMPING
        stiff = self._h * along > STIFF
        self._obliquity = -1.0 if stiff else max(spare, 0.0) / turning

    @property
    def compiles_in(self) -> float:
        """What the compilation of its kernels is expected to take, s."""
        return COMPILES_IN if self._damping is None else COMPILES_WITH_DAMPERS_IN

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._walk.counts[0] * self._h)

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps = int(self._walk.counts[0])
        return steps, 0, steps

    def begin(self) -> None:
        """Evaluate the start."""
        look(self._walk, self._margin, self._friction, self._laws, *self._assembly.parts[1:])

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
        a, before = self._assembly, self.t
        finite = walk(
            steps,
            self._h,
            self._walk,
            self._margin,
            self._friction,
            a.hysteresis,
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

    def look(self, t: float) -> "Array":
        """Return the state at a time in the last step; the forces are those of the step."""
        share = min(max((t - self.t) / self._h + 1.0, 0.0), 1.0)
        w = self._walk
        self._inside[:] = w.y0 + share * (w.y - w.y0)
        if w.counts[0]:  # before the first step there is no speed but that of the start
            table = self._assembly.pulleys.table
            start, end = table[BEFORE, self._given], table[ALPHA, self._given]
            table[SPEED, self._given] = start + share * (end - start)
        return self._inside

    def arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        w = self._walk
        dampers = {} if self._damping is None else {"dampers": self._damping.table}
        own = {"y0": w.y0, "y": w.y, "counts": w.counts, **dampers}
        return {**own, **self._assembly.memory()}
