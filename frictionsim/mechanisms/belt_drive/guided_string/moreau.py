"""Midpoint steps of a fixed length with exact impulses of friction, for a guided string.

Moreau's scheme, as in `steppers.moreau_kernels` for bodies in the plane: half a step with the old
velocities, the forces there, the impulses of friction together with the speeds of the pulleys, half
a step with the new velocities.

Dampers along the belt that would shorten the steps are solved for together with the friction, by
the equations of `steppers.moreau_damping` with all joints along one line. Their impulses D are part
of the tension T + D/h that presses a point on its arc, so that the limits of the friction follow
them: both are corrected in turn until they agree.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    friction_limits,
    project_friction,
    solve_pulley_motion,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import (
    COUNT,
    FIRST_CANDIDATE,
    FIRST_POINT,
    PULLEY,
    assign_friction_coefficients,
    line_candidates,
    update_contact_modes,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    add_damping,
    normal_forces,
    prescribed_speeds,
    tensions,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ALPHA,
    DAMPING_HEAT,
    FRICTION,
    FRICTION_HEAT,
    INERTIA,
    POSITION,
    PULLEY_RADIUS,
    SLIP,
    SPEED_OLD,
    STICK_BIAS,
    STICKING,
    STRING_ROWS,
    TENSION,
    VELOCITY,
    aligned_zeros,
    copy,
    kinematics_of,
    zero_state,
)
from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import FixedSteps
from frictionsim.mechanisms.belt_drive.steppers.moreau import (
    DEFAULT_STEP_RATIO,
    MAX_OMEGA_H,
    stable_step,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_contacts import free_pulley_speeds
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    DAMPING_DVX,
    EX,
    MAX_ACTIVE_SET_ITERATIONS,
    MAX_BLOCK_ITERATIONS,
    RATE,
    StiffDamping,
    initial_friction,
    limit_towards,
    solve_with_active_set,
    stiff_damping,
    store_new_speeds,
    update_active_set,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_kernels import (
    ENDED,
    NON_FINITE,
    SINCE_SEARCH,
    STEPS,
    finish_pulleys,
    predict_pulleys,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.composition import BeltModel
    from frictionsim.mechanisms.belt_drive.kernels.system import PitchLine, System
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings
    from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import StiffDamping

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


CANDIDATE_UPDATE_INTERVAL = 16  # steps from one search for candidates to the next

# Row of the dampers' table: their impulses that the tensions have, N s, in the place of what they
# do to velocities in the plane.
IMPULSE = DAMPING_DVX
TENSION_TOLERANCE = 1e-8  # of a correction of the tensions, over their mean


class StringState(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y_old, y : (size,)
        The states at the start and the end of the last step.
    new : (2, width)
        The kinematics that y begins with: a view.
    middle : (2, width)
        Positions and velocities in the middle of a step.
    counts : (2,)
        STEPS, SINCE_SEARCH.
    """

    y_old: "Array"
    y: "Array"
    new: "Array"
    middle: "Array"
    counts: "Indices"


def string_damping(coefficient: float, width: int, pulleys: int) -> StiffDamping:
    """Return the damping, N s/m, of the joints of a string with arrays to solve for it."""
    damping = stiff_damping(coefficient, width, pulleys)
    damping.table[EX] = 1.0  # every joint points along the line, and has no lever
    return damping


@kernel
def integrate_string(
    steps: int,
    h: float,
    state: StringState,
    distinct_static_friction: bool,
    stiff: StiffDamping | None,
    line: "PitchLine",
    system: "System",
) -> int:
    """Take so many steps of length h, s; return ENDED or NON_FINITE.

    With no step it evaluates the forces without friction. With `stiff` the dampers along the belt
    are solved for, and `system` has none.
    """
    counts = state.counts
    if counts[STEPS] == 0 and steps == 0:
        prescribed_speeds(0.0, system)
        find_candidates(line, state.new, system)
        axial = system.effects.axial_damping
        tensions(line.length, axial, system.chain, state.new[POSITION], system.workspace)
        normal_forces(line, state.new[VELOCITY], system)
    for _ in range(steps):
        if counts[SINCE_SEARCH] == 0:
            find_candidates(line, state.new, system)
        step_string(counts[STEPS] * h, h, state, stiff, line, system)
        if distinct_static_friction:
            update_contact_modes(system.contacts)
        counts[STEPS] += 1
        counts[SINCE_SEARCH] = (counts[SINCE_SEARCH] + 1) % CANDIDATE_UPDATE_INTERVAL
    total = 0.0
    for i in range(len(state.y)):
        total += abs(state.y[i])
    return ENDED if total < np.inf else NON_FINITE


@inline_kernel
def find_candidates(line: "PitchLine", kinematics: "Array", system: "System") -> None:
    """Make candidates of the points near the arcs, with their coefficients of friction."""
    line_candidates(line, system, kinematics)
    assign_friction_coefficients(system.contacts, system.pulleys.table.shape[1], system.friction)


@inline_kernel
def step_string(
    t: float,
    h: float,
    state: StringState,
    stiff: StiffDamping | None,
    line: "PitchLine",
    system: "System",
) -> None:
    """Take one step from time t."""
    layout, chain, axial = system.layout, system.chain, system.effects.axial_damping
    y_old, y, n = state.y_old, state.y, system.chain.bodies
    position, velocity = state.middle[POSITION], state.middle[VELOCITY]
    half = layout.velocities
    old, before = y[half : layout.angles], y_old[half : layout.angles]
    for i in range(n):
        position[i] = y[i] + 0.5 * h * old[i]
    for i in range(n):
        velocity[i] = old[i] + 0.5 * (old[i] - before[i])
    tension = system.workspace[TENSION]
    tensions(line.length, axial, chain, position, system.workspace)
    add_damping(axial.damping, velocity, tension, chain)
    normal_forces(line, velocity, system)
    predict_pulleys(t, h, y, y_old, system)
    prescribed_speeds(t + h, system)
    copy(y, y_old)
    new, gain = y[half : layout.angles], h / chain.mass
    for k in range(n):
        new[k] = before[k] + gain * (tension[k + 1] - tension[k])
    free_pulley_speeds(h, system.pulleys)
    taken = solve_dampers(h, velocity, before, new, stiff, line, system)
    rubbed = solve_friction_impulses(h, before, new, stiff, line, system)
    for i in range(n):
        y[i] = position[i] + 0.5 * h * new[i]
    finish_pulleys(h, y, system)
    y[layout.energies + FRICTION_HEAT] += rubbed
    taken += h * damping_power(axial.damping, n, velocity, before, new)
    y[layout.energies + DAMPING_HEAT] += taken


@inline_kernel
def solve_friction_impulses(
    h: float,
    old: "Array",
    new: "Array",
    stiff: StiffDamping | None,
    line: "PitchLine",
    system: "System",
) -> float:
    """Solve for the friction, unless that was done together with the dampers; return its heat, J.

    Adds its impulses to the new velocities, and writes new speeds into ALPHA, which has those
    without friction. Afterwards SLIP has the new slip.
    """
    contacts, pulleys = system.contacts, system.pulleys
    pulley, table, mass = pulleys.table, contacts.table, system.chain.mass
    if system.friction is None:
        return 0.0
    runs = line.runs
    if stiff is None:
        stick_biases(new, line, table)
        friction_limits(contacts, h)
        for j in pulleys.free:
            external, guess = pulley[INERTIA, j] * pulley[ALPHA, j], pulley[SPEED_OLD, j]
            pulley[ALPHA, j] = solve_pulley_motion(j, guess, external, contacts, pulleys, mass)
        project_friction(contacts, pulleys, mass, pulley[ALPHA])
    rubbed = 0.0
    for run in range(line.run_count[0]):
        i, s, count = runs[FIRST_POINT, run], runs[FIRST_CANDIDATE, run], runs[COUNT, run]
        j = runs[PULLEY, run]
        gain, sense = line.senses[j] / mass, line.senses[j]
        rim, radius = pulley[PULLEY_RADIUS, j] * pulley[ALPHA, j], pulley[PULLEY_RADIUS, j]
        mean_rim = 0.5 * (rim + radius * pulley[SPEED_OLD, j])
        friction, slip = table[FRICTION, s:], table[SLIP, s:]
        v, v_old = new[i:], old[i:]
        for k in range(count):
            v[k] += gain * friction[k]
        for k in range(count):
            slip[k] = rim - sense * v[k]
        for k in range(count):
            rubbed += friction[k] * (mean_rim - 0.5 * sense * (v_old[k] + v[k]))
    return rubbed


@inline_kernel
def stick_biases(new: "Array", line: "PitchLine", table: "Array") -> None:
    """Write STICK_BIAS of the new velocities without friction."""
    runs = line.runs
    for run in range(line.run_count[0]):
        i, s, count = runs[FIRST_POINT, run], runs[FIRST_CANDIDATE, run], runs[COUNT, run]
        sense, bias, v = line.senses[runs[PULLEY, run]], table[STICK_BIAS, s:], new[i:]
        for k in range(count):
            bias[k] = -sense * v[k]


@inline_kernel
def solve_dampers(
    h: float,
    middle: "Array",
    old: "Array",
    new: "Array",
    stiff: StiffDamping | None,
    line: "PitchLine",
    system: "System",
) -> float:
    """Solve for the impulses of stiff dampers and of friction; return the heat of the dampers, J.

    `new` are the velocities without both, to which those of the dampers are added; `middle` press
    the points on their arcs less. Reads the TENSION of the springs and adds that of the dampers.
    """
    heat = 0.0
    if stiff is not None:
        chain, contacts, pulleys = system.chain, system.contacts, system.pulleys
        n, rate, impulse = chain.bodies, stiff.table[RATE], stiff.columns[0]
        for k in range(n):
            b = k - 1 if k > 0 else n - 1
            rate[k] = old[k] + new[k] - old[b] - new[b]
        stick_biases(new, line, contacts.table)
        add_impulses(1.0 / h, stiff.table[IMPULSE], system.workspace[TENSION], n)
        normal_forces(line, middle, system)
        friction_limits(contacts, h)
        initial_friction(contacts, pulleys)
        for i in range(MAX_ACTIVE_SET_ITERATIONS):
            solve_with_active_set(h, chain, contacts, pulleys, stiff)
            changed = update_active_set(i, chain, contacts, pulleys, stiff)
            if not changed or i < MAX_BLOCK_ITERATIONS:
                changed = update_tensions(h, middle, stiff, line, system) or changed
            if not changed:
                break
        store_new_speeds(pulleys, stiff)
        for k in range(n):
            a = k + 1 if k < n - 1 else 0
            new[k] += (impulse[a] - impulse[k]) / chain.mass
            heat += impulse[k] * impulse[k] / (h * stiff.coefficient)
    return heat


@inline_kernel
def add_impulses(rate: float, impulse: "Array", tension: "Array", n: int) -> None:
    """Add the impulses of dampers in a step to the tensions; `rate` is one over its length, 1/s."""
    for k in range(n):
        tension[k] += rate * impulse[k]
    tension[n] = tension[0]


@inline_kernel
def update_tensions(
    h: float, middle: "Array", stiff: StiffDamping, line: "PitchLine", system: "System"
) -> bool:
    """Correct tensions, normal forces and limits by the impulses of the dampers that were found.

    Return whether they were off; friction that is at its limit follows it.
    """
    contacts, table, n = system.contacts, system.contacts.table, system.chain.bodies
    impulse, used = stiff.columns[0], stiff.table[IMPULSE]
    tension = system.workspace[TENSION]
    off = size = 0.0
    for k in range(n):
        off += abs(impulse[k] - used[k])
        size += h * abs(tension[k])
    if not off > TENSION_TOLERANCE * size:
        return False
    for k in range(n):
        tension[k] += (impulse[k] - used[k]) / h
        used[k] = impulse[k]
    tension[n] = tension[0]
    normal_forces(line, middle, system)
    friction_limits(contacts, h)
    for s in range(contacts.offsets[-1]):
        if table[STICKING, s] == 0.0:
            table[FRICTION, s] = limit_towards(table, s, table[FRICTION, s])
    return True


@inline_kernel
def damping_power(
    damping: float | None, n: int, middle: "Array", old: "Array", new: "Array"
) -> float:
    """Return the power that the dampers along the belt take in a step, W.

    Their forces are those of the velocities `middle`, which are extrapolated; what they take goes
    by the mean of the velocities before and after.
    """
    power = 0.0
    if damping is not None:
        for k in range(1, n):
            force = damping * (middle[k] - middle[k - 1])
            power += 0.5 * force * (old[k] + new[k] - old[k - 1] - new[k - 1])
        force = damping * (middle[0] - middle[n - 1])
        power += 0.5 * force * (old[0] + new[0] - old[n - 1] - new[n - 1])
    return power


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
        """Step until a limit or a sample time, s, is reached or passed, or so many steps."""
        self._integrate(self._steps_to(limit, sample, max_steps))

    def _take_steps(self, steps: int) -> int:
        stiff, system, distinct = self._stiff, self._system, self._model.distinct_static_friction
        line, state = system.line, self._state
        assert line is not None
        ended: int = integrate_string(steps, self._h, state, distinct, stiff, line, system)
        return ended

    @property
    def _dampers(self) -> "Array | None":
        return None if self._stiff is None else self._stiff.table[IMPULSE]
