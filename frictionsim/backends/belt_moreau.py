"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives, compiled.

Moreau's scheme [1]_: half a step with the old velocities, the forces there, the impulses that the
set-valued law asks for, half a step with the new velocities.

    q_m = q + (h/2) v
    v+  = v + h a(q_m, v_m) + (impulses P along t)/m
    P   = clip(m (R omega+ - (v + h a) . t), -mu N h, mu N h)
    q+  = q_m + (h/2) v+

One evaluation of the forces a step. They depend on the velocity through dampers and torques, for
which v_m = v + (v - v_before)/2 is the velocity at the middle to second order; dampers along the
belt that are too stiff for that are solved for together with the friction. Of second order
where the motion is smooth, of first order at switches of friction or contact. Stick is exact: the
slip that is left is rounding.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.backends.belt_damping import StiffDamping, damp_and_strike, stiff_damping
from frictionsim.compiled import entry, kernel
from frictionsim.errors import SolverError
from frictionsim.mechanisms.belt.assembly import new_state
from frictionsim.mechanisms.belt.chain import VX, VY
from frictionsim.mechanisms.belt.contact import (
    ALPHA,
    COEFFICIENT,
    FRICTION,
    INERTIA,
    LIMIT,
    NORMAL,
    NX,
    NY,
    PULLEY_RADIUS,
    SLIP,
    SPEED,
    TORQUE,
    WISH,
    Friction,
    deal_slots,
    drag,
    grip,
    meet,
    remember,
    share_friction,
)
from frictionsim.mechanisms.belt.equations import act, drive, motion_in, prescribe, resist
from frictionsim.mechanisms.belt.waves import contact_stiffness

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt.assembly import Assembly
    from frictionsim.mechanisms.belt.parameters import BeltSolver

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

# Bodies near pulleys are given their slots anew after so many steps; see the adaptive backend.
STEPS_OF_A_DEAL = 8

# The scheme is stable for omega h < 2; dampers take a little of that.
LONGEST, LONGEST_BY_DEFAULT = 2.0, 1.9
# Contacts open and close: a bounce takes pi/omega, and some steps are to fall into it.
LONGEST_OF_CONTACT = 0.4
# Dampers whose decay in a step is beyond this are solved for; the others are extrapolated.
STIFF = 0.5


class Walk(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y0, y : (n,)
        The states at the start and the end of the last step.
    middle, rate : (n,)
        Room to work in.
    counts : (2,)
        Steps, and steps since the slots were dealt.
    """

    y0: "Array"
    y: "Array"
    middle: "Array"
    rate: "Array"
    counts: "Indices"


@entry
def walk(
    steps,
    h,
    walk,
    margin,
    friction,
    hysteresis,
    damping,
    laws,
    torques,
    loads,
    speeds,
    room,
    slots,
    pulleys,
):
    """Take so many steps of length h; return whether the state is still finite."""
    counts = walk.counts
    for _ in range(steps):
        if counts[1] == 0:
            motion = motion_in(walk.y, room)
            deal_slots(motion, laws.chain.bodies, pulleys, margin, slots, friction)
        t = counts[0] * h
        step(t, h, walk, friction, damping, laws, torques, loads, speeds, room, slots, pulleys)
        keep_in_mind(slots, hysteresis)
        counts[0] += 1
        counts[1] = (counts[1] + 1) % STEPS_OF_A_DEAL
    total = 0.0
    for i in range(len(walk.y)):
        total += abs(walk.y[i])
    return total < np.inf


@kernel
def keep_in_mind(slots, hysteresis):
    """Take over who sticks now, if static and kinetic friction differ."""
    if hysteresis is not None:
        remember(slots)


@kernel
def step(t, h, walk, friction, damping, laws, torques, loads, speeds, room, slots, pulleys):
    """Take one step from time t."""
    y0, y, middle, rate = walk.y0, walk.y, walk.middle, walk.rate
    pulley, free, width = pulleys.table, pulleys.free, room.shape[1]
    count = pulley.shape[1]
    angles, speed = 6 * width, 6 * width + count
    ledger = speed + len(free)
    go_to_middle(h, y0, y, middle, 3 * width)
    for k in range(speed, ledger):
        middle[k] = y[k] + 0.5 * (y[k] - y0[k])
    y0[:] = y
    for k in range(len(free)):
        pulley[SPEED, free[k]] = middle[speed + k]
    prescribe(t + 0.5 * h, pulleys, speeds)
    pulley[TORQUE, :] = 0.0
    drive(t + 0.5 * h, pulley[TORQUE], torques)
    resist(pulley[SPEED], pulley[TORQUE], loads)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    damped = act(laws, motion_in(middle, room), room, slots, ax, ay, rate[5 * width : 6 * width])
    for k in range(len(free)):
        pulley[SPEED, free[k]] = y[speed + k]
    prescribe(t + h, pulleys, speeds)
    accelerate(h, y[3 * width : 6 * width], rate[3 * width : 6 * width])
    rubbed, braked = strike(h, y0, y, laws.chain, room, slots, pulleys, friction, damping)
    go_on(h, y, middle, 3 * width)
    for k in range(len(free)):
        y[speed + k] = pulley[ALPHA, free[k]]
    react(h, t, slots, pulleys, speeds)
    for j in range(count):
        mean = 0.5 * (pulley[SPEED, j] + pulley[ALPHA, j])
        y[angles + j] += h * mean
        y[ledger] += h * pulley[TORQUE, j] * mean
    y[ledger + 1] += rubbed
    y[ledger + 2] += h * damped + braked


@kernel
def go_to_middle(h, y0, y, middle, size):
    """Write the positions half a step on, and the velocities there by extrapolation."""
    velocities = y[size : 2 * size]
    for i in range(size):
        middle[i] = y[i] + 0.5 * h * velocities[i]
    before, between = y0[size : 2 * size], middle[size : 2 * size]
    for i in range(size):
        between[i] = velocities[i] + 0.5 * (velocities[i] - before[i])


@kernel
def accelerate(h, velocities, accelerations):
    """Add what the forces do to the velocities in a step."""
    for i in range(len(velocities)):
        velocities[i] += h * accelerations[i]


@kernel
def go_on(h, y, middle, size):
    """Write the positions at the end of a step."""
    velocities = y[size : 2 * size]
    for i in range(size):
        y[i] = middle[i] + 0.5 * h * velocities[i]


@kernel
def strike(h, y0, y, chain, room, slots, pulleys, friction, damping):
    """Solve for the impulses and add them; write the new speeds into ALPHA.

    Return the heat of friction and of stiff dampers. SPEED keeps the old speeds of free pulleys;
    those that are prescribed have their new one there already.
    """
    pulley, table = pulleys.table, slots.table
    for j in range(pulley.shape[1]):
        pulley[ALPHA, j] = pulley[SPEED, j]
    for j in pulleys.free:
        pulley[ALPHA, j] += h * pulley[TORQUE, j] / pulley[INERTIA, j]
    if friction is None:
        return 0.0, 0.0
    wish, limit, slip = table[WISH], table[LIMIT], table[SLIP]
    before, after = motion_in(y0, room), motion_in(y, room)
    along_of(before[VX], before[VY], slots, slip)
    along_of(after[VX], after[VY], slots, wish)
    for s in range(slots.first[-1]):
        wish[s] = -wish[s]
    for s in range(slots.first[-1]):
        limit[s] = h * table[COEFFICIENT, s] * table[NORMAL, s]
    settle(chain.mass, slots, pulleys, damping)
    damped = damp(h, before, after, chain, room, slots, pulleys, damping)
    drag(slots, 1.0 / chain.mass, after[VX], after[VY])
    along_of(after[VX], after[VY], slots, wish)
    rubbed = 0.0
    for j in range(pulley.shape[1]):
        mean = 0.5 * pulley[PULLEY_RADIUS, j] * (pulley[SPEED, j] + pulley[ALPHA, j])
        rim = pulley[PULLEY_RADIUS, j] * pulley[ALPHA, j]
        for s in range(slots.first[j], slots.first[j + 1]):
            rubbed += table[FRICTION, s] * (mean - 0.5 * (slip[s] + wish[s]))
            slip[s] = rim - wish[s]
    return rubbed, damped


@kernel
def settle(mass, slots, pulleys, damping):
    """Solve for friction and the speeds of free pulleys, where no stiff damping couples them."""
    if damping is None:
        pulley = pulleys.table
        for j in pulleys.free:
            offer = pulley[INERTIA, j] * pulley[ALPHA, j]
            pulley[ALPHA, j] = meet(j, pulley[SPEED, j], offer, slots, pulleys, mass)
        share_friction(slots, pulleys, mass, pulley[ALPHA])


@kernel
def damp(h, before, after, chain, room, slots, pulleys, damping):
    """Solve for friction, speeds and stiff dampers together; return the heat of the dampers."""
    if damping is not None:
        return damp_and_strike(h, before, after, chain, room, slots, pulleys, damping)
    return 0.0


@kernel
def along_of(vx, vy, slots, along):
    """Write the velocities along t of the bodies that have a slot."""
    nx, ny, body = slots.table[NX], slots.table[NY], slots.body
    for s in range(slots.first[-1]):
        i = body[s]
        along[s] = vy[i] * nx[s] - vx[i] * ny[s]


@kernel
def react(h, t, slots, pulleys, speeds):
    """Write the mean torque that it took to keep a prescribed speed."""
    if speeds is not None:
        pulley = pulleys.table
        prescribe(t, pulleys, speeds)
        for j in speeds.which:
            before = pulley[SPEED, j]
            pulley[TORQUE, j] = before
        prescribe(t + h, pulleys, speeds)
        for j in speeds.which:
            before, after = pulley[TORQUE, j], pulley[SPEED, j]
            pulley[TORQUE, j] = (
                pulley[INERTIA, j] * (after - before) + pulley[PULLEY_RADIUS, j] * grip(j, slots)
            ) / h
            pulley[SPEED, j], pulley[ALPHA, j] = before, after


class Stepping:
    """A belt drive on its way, as the run of it sees it.

    Parameters
    ----------
    assembly : Assembly
    settings : BeltSolver
        `step` is the length of a step, s; left out, it is near the longest stable one.

    Raises
    ------
    SolverError
        If the step is too long for the waves in the belt.
    """

    def __init__(self, assembly: "Assembly", settings: "BeltSolver") -> None:
        self._assembly = assembly
        bodies, pulleys = assembly.laws.chain.bodies, assembly.pulleys
        oscillating, _ = assembly.fastest
        pressed = np.sqrt(
            contact_stiffness(assembly.laws, assembly.rest) / assembly.laws.chain.mass
        )
        self._h = settings.step or min(
            LONGEST_BY_DEFAULT / oscillating,
            LONGEST_OF_CONTACT / pressed,
            settings.max_step or np.inf,
        )
        if self._h * oscillating >= LONGEST:
            raise SolverError(
                f"a step of {self._h:.4g} s is too large for the waves in the belt: 'moreau' is"
                f" stable below {LONGEST / oscillating:.4g} s here; give a smaller solver.step, or"
                " fewer bodies"
            )
        self._margin = assembly.laws.chain.length
        self._take_out_stiff_damping()
        self.per_impulse = 1.0 / self._h
        y0, y, middle, rate = (new_state(bodies, pulleys) for _ in range(4))
        self._walk = Walk(y0, y, middle, rate, np.zeros(2, dtype=np.int64))
        self._walk.y0[:] = self._walk.y[:] = assembly.state
        self._inside = new_state(bodies, pulleys)

    def _take_out_stiff_damping(self) -> None:
        """Leave dampers along the belt that a step cannot follow to the implicit solution."""
        self._laws, self._friction = self._assembly.laws, self._assembly.friction
        self._damping: StiffDamping | None = None
        axial, mass = self._laws.axial_damping, self._laws.chain.mass
        if axial is None or self._h * 4.0 * axial.coefficient / mass < STIFF:
            return
        width, pulleys = self._assembly.room.shape[1], self._assembly.pulleys.table.shape[1]
        self._damping = stiff_damping(axial.coefficient, width, pulleys)
        self._laws = self._laws._replace(axial_damping=None)
        if self._friction is None:  # who sticks is part of that solution: nobody does
            none = np.zeros((pulleys, self._laws.chain.bodies))
            self._friction = Friction(none, none)

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._walk.counts[0] * self._h)

    @property
    def counts(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps = int(self._walk.counts[0])
        return steps, 0, steps

    def begin(self) -> None:
        """Take no step."""
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
            self._laws,
            *a.parts[1:],
        )
        if not finite:
            raise SolverError(
                f"the state is not finite after t = {before:.9g} s; is a stiffness, a torque or a"
                f" speed of the scenario too large, or solver.step = {self._h:.3g} s too long?"
            )

    def look(self, t: float) -> "Array":
        """Return the state at a time in the last step; the forces are those of the step."""
        share = min(max((t - self.t) / self._h + 1.0, 0.0), 1.0)
        w = self._walk
        self._inside[:] = w.y0 + share * (w.y - w.y0)
        return self._inside

    def arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; written to, it is taken up."""
        w = self._walk
        return {"y0": w.y0, "y": w.y, "counts": w.counts, **self._assembly.memory()}
