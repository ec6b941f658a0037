"""A midpoint step of a guided string: forces, impulses of friction and of dampers.

Dampers along the belt that would shorten the steps are solved for together with the friction, by
the equations of `steppers.moreau_damping` with all joints along one line. Their impulses D are part
of the tension T + D/h that presses a point on its arc, so that the limits of the friction follow
them: both are corrected in turn until they agree.
"""

from typing import TYPE_CHECKING

from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    friction_limits,
    project_friction,
    solve_pulley_motion,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.string import (
    COUNT,
    FIRST_CANDIDATE,
    FIRST_POINT,
    PULLEY,
    add_damping,
    string_normal_forces,
    tensions,
)
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    FRICTION,
    INERTIA,
    POSITION,
    PULLEY_RADIUS,
    SLIP,
    SPEED_OLD,
    STICK_BIAS,
    STICKING,
    TENSION,
    VELOCITY,
    Array,
    PitchLine,
    System,
    copy,
)
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

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.steppers.fixed_steps import MoreauState


# Row of the dampers' table: their impulses that the tensions have, N s, in the place of what they
# do to velocities in the plane.
IMPULSE = DAMPING_DVX
TENSION_TOLERANCE = 1e-8  # of a correction of the tensions, over their mean


def string_damping(coefficient: float, width: int, pulleys: int) -> StiffDamping:
    """Return the damping, N s/m, of the joints of a string with arrays to solve for it."""
    damping = stiff_damping(coefficient, width, pulleys)
    damping.table[EX] = 1.0  # every joint points along the line, and has no lever
    return damping


@inline_kernel
def initial_forces(line: PitchLine, state: "MoreauState", system: System) -> None:
    """Evaluate the forces without friction at the start."""
    axial = system.effects.axial_damping
    tensions(line.length, axial, system.chain, state.new[POSITION], system.workspace)
    string_normal_forces(line, state.new[VELOCITY], system)


@inline_kernel
def forces(
    line: PitchLine, h: float, state: "MoreauState", stiff: StiffDamping | None, system: System
) -> float:
    """Write the middle of a step and the forces there, and the new velocities without friction.

    Positions are half a step on, velocities extrapolated.
    """
    layout, chain, axial = system.layout, system.chain, system.effects.axial_damping
    position, velocity = state.middle[POSITION], state.middle[VELOCITY]
    old, earlier = state.new[VELOCITY], state.y_old[layout.velocities : layout.angles]
    for i in range(chain.bodies):
        position[i] = state.y[i] + 0.5 * h * old[i]
    for i in range(chain.bodies):
        velocity[i] = old[i] + 0.5 * (old[i] - earlier[i])
    tension = system.workspace[TENSION]
    tensions(line.length, axial, chain, position, system.workspace)
    add_damping(axial.damping, velocity, tension, chain)
    string_normal_forces(line, velocity, system)
    copy(state.y, state.y_old)
    before, new = state.y_old[layout.velocities : layout.angles], state.new[VELOCITY]
    gain = h / chain.mass
    for k in range(chain.bodies):
        new[k] = before[k] + gain * (tension[k + 1] - tension[k])
    return 0.0


@inline_kernel
def move(
    line: PitchLine, h: float, state: "MoreauState", stiff: StiffDamping | None, system: System
) -> tuple[float, float]:
    """Solve for the impulses and move on by them; return the heat of friction and of dampers."""
    layout, n, damping = system.layout, system.chain.bodies, system.effects.axial_damping.damping
    position, velocity = state.middle[POSITION], state.middle[VELOCITY]
    before, new = state.y_old[layout.velocities : layout.angles], state.new[VELOCITY]
    taken = solve_dampers(h, velocity, before, new, stiff, line, system)
    rubbed = solve_friction_impulses(h, before, new, stiff, line, system)
    for i in range(n):
        state.y[i] = position[i] + 0.5 * h * new[i]
    return rubbed, taken + h * damping_power(damping, n, velocity, before, new)


@inline_kernel
def finish(line: PitchLine, h: float, state: "MoreauState", system: System) -> None:
    """Do nothing: y_old has the start of the last step."""


@inline_kernel
def solve_friction_impulses(
    h: float, old: Array, new: Array, stiff: StiffDamping | None, line: PitchLine, system: System
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
def stick_biases(new: Array, line: PitchLine, table: Array) -> None:
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
    middle: Array,
    old: Array,
    new: Array,
    stiff: StiffDamping | None,
    line: PitchLine,
    system: System,
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
        string_normal_forces(line, middle, system)
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
def add_impulses(rate: float, impulse: Array, tension: Array, n: int) -> None:
    """Add the impulses of dampers in a step to the tensions; `rate` is one over its length, 1/s."""
    for k in range(n):
        tension[k] += rate * impulse[k]
    tension[n] = tension[0]


@inline_kernel
def update_tensions(
    h: float, middle: Array, stiff: StiffDamping, line: PitchLine, system: System
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
    string_normal_forces(line, middle, system)
    friction_limits(contacts, h)
    for s in range(contacts.offsets[-1]):
        if table[STICKING, s] == 0.0:
            table[FRICTION, s] = limit_towards(table, s, table[FRICTION, s])
    return True


@inline_kernel
def damping_power(damping: float | None, n: int, middle: Array, old: Array, new: Array) -> float:
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
