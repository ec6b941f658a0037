"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives, compiled.

Moreau's scheme [1]_: half a step with the old velocities, the forces there, the impulses that the
set-valued law asks for, half a step with the new velocities.

    q_m = q + (h/2) v
    v+  = v + h a(q_m, v_m) + (impulses P along t)/m
    P   = clip(m (R omega+ - (v + h a) . t - (h/2) t' . v_m), -mu N h, mu N h)
    q+  = q_m + (h/2) v+

with t in the middle of the step, and its rate: what sticks has no slip along the t of the end. That
of the middle would leave t' . v_m over half a step, an error of first order. The work of P is that
of the mean velocities, v . t with the t of the middle: the energy closes. The wrap factor of
`kernels.wrap` is taken with t, and its rate with that of t.

One evaluation of the forces a step. They depend on the velocity through dampers and torques, for
which v_m = v + (v - v_before)/2 is the velocity at the middle to second order. The dampers of the
contacts, each of which meets one body only, are solved for instead, and so are dampers along the
belt if they are too stiff for v_m, together with the friction. Of second order
where the motion is smooth, of first order at switches of friction or contact. Stick is exact: the
slip that is left is rounding.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.axial import (
    Directions,
    JointForces,
    damper_power,
    directions_of,
    has_oblique_joints,
    joint_forces_of,
)
from frictionsim.mechanisms.belt_drive.effects.belt_friction import total_friction
from frictionsim.mechanisms.belt_drive.effects.contact import (
    add_normal_forces,
    contact_forces,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import (
    find_contact_candidates,
    update_contact_modes,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    contactless_accelerations,
    prescribed_speeds,
    pulley_torques,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ALPHA,
    DAMPING_HEAT,
    FRICTION_HEAT,
    INERTIA,
    PULLEY_RADIUS,
    SPEED,
    SPEED_OLD,
    TORQUE,
    Accelerations,
    BodyRows,
    body_rows,
    clear_padding,
    full_vectors,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import update_wrap_factors
from frictionsim.mechanisms.belt_drive.steppers.moreau_contacts import (
    free_pulley_speeds,
    midpoint_contacts,
    solve_impulses,
    solve_with_stiff_damping,
)
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    StiffDamping,
    reset_damping_prediction,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.base import Chain
    from frictionsim.mechanisms.belt_drive.kernels.system import Contacts, Pulleys, System

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

CANDIDATE_UPDATE_INTERVAL = 16  # steps from one search for contact candidates to the next

# The numbers in `counts`: steps, steps since the search for candidates, 1 if dampers along the belt
# are solved for now, and how many steps were taken so.
STEPS, SINCE_SEARCH, IMPLICIT_NOW, IMPLICIT_STEPS = range(4)

ENDED, NON_FINITE, OTHER_FORM = range(3)  # why steps end


class MoreauState(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y_old, y : (size,)
        The states at the start and the end of the last step. Within one y_old has its middle.
    rate : (size,)
        Workspace.
    old, new : (6, width)
        The kinematics that y_old and y begin with: views of them.
    counts : (4,)
        STEPS, SINCE_SEARCH, IMPLICIT_NOW, IMPLICIT_STEPS.
    """

    y_old: "Array"
    y: "Array"
    rate: "Array"
    old: "Array"
    new: "Array"
    counts: "Indices"


class StepTreatment(NamedTuple):
    """What is not left to the forces in the middle of a step.

    Attributes
    ----------
    max_obliquity : float
        Dampers along the belt are solved for where a body is more oblique to its joints.
    distinct_static_friction : bool
        Static and kinetic friction differ: who sticks has to be remembered.
    """

    max_obliquity: float
    distinct_static_friction: bool


@kernel
def integrate(
    steps: int,
    h: float,
    state: MoreauState,
    treatment: StepTreatment,
    stiff: StiffDamping | None,
    system: "System",
) -> int:
    """Take at most `steps` steps of length h, s; return ENDED, NON_FINITE or OTHER_FORM.

    There are two forms, each compiled when it is first needed: with `stiff` the dampers along the
    belt are solved for, and `system` has none; else `system` has them. Where a search for
    candidates finds that the other form is due, this one stops before the step.
    """
    counts, end = state.counts, ENDED
    last = counts[STEPS] + steps
    before = counts[STEPS]
    while counts[STEPS] < last:
        if counts[SINCE_SEARCH] == 0:
            find_contact_candidates(system, state.new)
            implicit = has_oblique_joints(system.workspace, system.chain, treatment.max_obliquity)
            if implicit != counts[IMPLICIT_NOW]:
                counts[IMPLICIT_NOW] = implicit
                reset_damping_prediction(stiff)
                end = OTHER_FORM
                break
        step(counts[STEPS] * h, h, state, stiff, system)
        counts[IMPLICIT_STEPS] += counts[IMPLICIT_NOW]
        if treatment.distinct_static_friction:
            update_contact_modes(system.contacts)
        counts[STEPS] += 1
        counts[SINCE_SEARCH] = (counts[SINCE_SEARCH] + 1) % CANDIDATE_UPDATE_INTERVAL
    if counts[STEPS] > before:
        positions_before(h, state, system.layout.velocities)
    total = 0.0
    for i in range(len(state.y)):
        total += abs(state.y[i])
    return end if total < np.inf else NON_FINITE


@inline_kernel
def step(
    t: float,
    h: float,
    state: MoreauState,
    stiff: StiffDamping | None,
    system: "System",
) -> None:
    """Take one step from time t."""
    layout, y_old, y, rate, middle = system.layout, state.y_old, state.y, state.rate, state.old
    half, width = layout.velocities, layout.width
    predict_midpoint(h, y, y_old, half)
    predict_pulleys(t, h, y, y_old, system)
    for k in range(layout.angles, layout.end):
        y_old[k] = y[k]
    ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
    aphi = rate[half + 2 * width : half + 3 * width]
    damped = contactless_accelerations(system, middle, ax, ay, aphi)
    clear_padding(system.chain.bodies, ax, ay, aphi)
    a = Accelerations(ax, ay, aphi)
    damped += midpoint_contacts(h, middle, state.new, a, stiff, system)
    prescribed_speeds(t + h, system)
    rubbed, braked = move(h, state, a, stiff, system)
    finish_pulleys(h, y, system)
    y[layout.energies + FRICTION_HEAT] += rubbed
    y[layout.energies + DAMPING_HEAT] += h * damped + braked


@inline_kernel
def move(
    h: float,
    state: MoreauState,
    a: Accelerations,
    stiff: StiffDamping | None,
    system: "System",
) -> tuple[float, float]:
    """Solve for the impulses and move on by them; return the heat of friction and of dampers.

    Of the dampers along the belt it is what they take beyond what was expected of them, or all of
    it where they are solved for.
    """
    chain, damping = system.chain, system.effects.axial_damping.damping
    free_pulley_speeds(h, system.pulleys)
    if stiff is None:
        rubbed = solve_impulses(h, a, system)
        return rubbed, end_step(h, state, a, damping, system)
    add_normal_forces(system.contacts, 1.0 / chain.mass, a.x, a.y)
    end_step(h, state, a, None, system)
    heat = solve_with_stiff_damping(h, state.old, state.new, stiff, system)
    finish_positions(h, state, system.layout.velocities)
    return heat


@inline_kernel
def predict_pulleys(t: float, h: float, y: "Array", y_old: "Array", system: "System") -> None:
    """Write SPEED_OLD at the start of a step, and SPEED and TORQUE in its middle.

    The speeds of free pulleys there are extrapolated from `y_old`, of the start of the step before.
    """
    pulley, free, speeds = system.pulleys.table, system.pulleys.free, system.layout.speeds
    prescribed_speeds(t, system)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = y[speeds + k]
    for j in range(pulley.shape[1]):
        pulley[SPEED_OLD, j] = pulley[SPEED, j]
    for k in range(len(free)):
        speed, before = y[speeds + k], y_old[speeds + k]
        pulley[SPEED, free[k]] = speed + 0.5 * (speed - before)
    prescribed_speeds(t + 0.5 * h, system)
    pulley_torques(t + 0.5 * h, system)


@inline_kernel
def finish_pulleys(h: float, y: "Array", system: "System") -> None:
    """Write the state of the pulleys after a step and the energy that was put in; reads ALPHA."""
    pulley, free, layout = system.pulleys.table, system.pulleys.free, system.layout
    for k in range(len(free)):
        y[layout.speeds + k] = pulley[ALPHA, free[k]]
    mean_reaction_torques(h, system.contacts, system.pulleys)
    for j in range(pulley.shape[1]):
        mean = 0.5 * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        y[layout.angles + j] += h * mean
        y[layout.energies] += h * pulley[TORQUE, j] * mean
        pulley[SPEED, j] = pulley[ALPHA, j]


@kernel
def evaluate_forces(state: MoreauState, system: "System") -> None:
    """Evaluate the forces without friction at the start."""
    rate, half, width = state.rate, system.layout.velocities, system.layout.width
    prescribed_speeds(0.0, system)
    find_contact_candidates(system, state.new)
    ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
    contactless_accelerations(system, state.new, ax, ay, rate[half + 2 * width : half + 3 * width])
    contact_forces(state.new, system.contacts, system.effects.contact)
    update_wrap_factors(system.contacts.wrap, system.contacts, system.workspace)


@loop_kernel
def predict_midpoint(h: float, y: "Array", middle: "Array", size: int) -> None:
    """Make of the state before, which `middle` has, the one in the middle of the step.

    That is, the positions half a step on, and the velocities there by extrapolation.
    """
    for i in range(full_vectors(size)):
        middle[i] = y[i] + 0.5 * h * y[size + i]
        middle[size + i] = y[size + i] + 0.5 * (y[size + i] - middle[size + i])


@inline_kernel
def end_step(
    h: float,
    state: MoreauState,
    a: Accelerations,
    damping: float | None,
    system: "System",
) -> float:
    """Move on by the accelerations a; return the heat that dampers were not expected to take.

    `old` had the middle of the step. Its velocities become those at the start.
    """
    old, new = body_rows(state.old), body_rows(state.new)
    directions, forces = directions_of(system.workspace), joint_forces_of(system.workspace)
    return h * move_bodies(h, system.chain, old, new, a, damping, directions, forces)


@loop_kernel
def move_bodies(
    h: float,
    chain: "Chain",
    old: BodyRows,
    new: BodyRows,
    a: Accelerations,
    damping: float | None,
    directions: Directions,
    forces: JointForces,
) -> float:
    """Write the rows of `end_step`; return the power, W."""
    power, half = 0.0, 0.5 * chain.length
    for k in range(full_vectors(chain.bodies)):
        vx, vy, spin = new.vx[k], new.vy[k], new.spin[k]
        new_vx, new_vy, new_spin = vx + h * a.x[k], vy + h * a.y[k], spin + h * a.angle[k]
        if damping is not None:
            missed_x = 0.5 * (vx + new_vx) - old.vx[k]
            missed_y = 0.5 * (vy + new_vy) - old.vy[k]
            missed_spin = 0.5 * (spin + new_spin) - old.spin[k]
            taken = damper_power(half, directions, forces, k, missed_x, missed_y, missed_spin)
            power += taken if k < chain.bodies else 0.0
        old.vx[k], old.vy[k], old.spin[k] = vx, vy, spin
        new.vx[k], new.vy[k], new.spin[k] = new_vx, new_vy, new_spin
        new.x[k] = old.x[k] + 0.5 * h * new_vx
        new.y[k] = old.y[k] + 0.5 * h * new_vy
        new.angle[k] = old.angle[k] + 0.5 * h * new_spin
    return power


@inline_kernel
def finish_positions(h: float, state: MoreauState, size: int) -> None:
    """Write the positions at the end of a step, from those in the middle."""
    for i in range(size):
        state.y[i] = state.y_old[i] + 0.5 * h * state.y[size + i]


@inline_kernel
def positions_before(h: float, state: MoreauState, size: int) -> None:
    """Write the positions at the start of the last step, from those in its middle."""
    for i in range(size):
        state.y_old[i] -= 0.5 * h * state.y_old[size + i]


@inline_kernel
def mean_reaction_torques(h: float, contacts: "Contacts", pulleys: "Pulleys") -> None:
    """Write the mean TORQUE that it took to keep a prescribed speed."""
    pulley = pulleys.table
    for j in pulleys.prescribed:
        gained = pulley[INERTIA, j] * (pulley[ALPHA, j] - pulley[SPEED_OLD, j])
        pulley[TORQUE, j] = (gained + pulley[PULLEY_RADIUS, j] * total_friction(j, contacts)) / h
