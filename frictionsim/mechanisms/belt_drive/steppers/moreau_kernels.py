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
    has_oblique_joints,
    joint_damping_correction,
)
from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    add_friction_forces,
    friction_limits,
    project_friction,
    solve_pulley_motion,
    total_friction,
)
from frictionsim.mechanisms.belt_drive.effects.contact import (
    ContactDamping,
    add_midpoint_contact_damping,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import (
    find_contact_candidates,
    predict_rim_turn,
    tangential_velocities,
    update_contact_modes,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    prescribed_speeds,
    pulley_torques,
    smooth_accelerations,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ALPHA,
    BODY_VX,
    BODY_VY,
    DAMPING_HEAT,
    FRICTION,
    FRICTION_HEAT,
    INERTIA,
    PULLEY_RADIUS,
    RIM_TURN,
    SLIP,
    SPEED,
    SPEED_OLD,
    STICK_BIAS,
    TORQUE,
    VX,
    VY,
    copy,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import update_wrap_rates
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    StiffDamping,
    add_predicted_damping,
    reset_damping_prediction,
    solve_damping_and_friction,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.kernels.signals import PrescribedSpeeds
    from frictionsim.mechanisms.belt_drive.kernels.system import Contacts, Pulleys, System

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

CANDIDATE_UPDATE_INTERVAL = 16  # steps from one search for contact candidates to the next

# The numbers in `counts`: steps, steps since the search for candidates, 1 if dampers along the belt
# are solved for now, and how many steps were taken so.
STEPS, SINCE_SEARCH, IMPLICIT_NOW, IMPLICIT_STEPS = range(4)

ENDED, NOT_FINITE, OTHER_FORM = range(3)  # why steps end


class MoreauState(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y_old, y : (size,)
        The states at the start and the end of the last step.
    middle, rate : (size,)
        Workspace.
    old, new, between : (6, width)
        The kinematics that y_old, y and middle begin with: views of them.
    spare : (6, width)
        The same of rate.
    counts : (4,)
        STEPS, SINCE_SEARCH, IMPLICIT_NOW, IMPLICIT_STEPS.
    """

    y_old: "Array"
    y: "Array"
    middle: "Array"
    rate: "Array"
    old: "Array"
    new: "Array"
    between: "Array"
    spare: "Array"
    counts: "Indices"


class StepTreatment(NamedTuple):
    """What is not left to the forces in the middle of a step.

    Attributes
    ----------
    contact : ContactDamping or None
        Solved for in each contact.
    max_obliquity : float
        Dampers along the belt are solved for where a body is more oblique to its joints.
    distinct_static_friction : bool
        Static and kinetic friction differ: who sticks has to be remembered.
    """

    contact: ContactDamping | None
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
    """Take up to so many steps of length h, s; return ENDED, NOT_FINITE or OTHER_FORM.

    There are two forms, each compiled when it is first needed: with `stiff` the dampers along the
    belt are solved for, and `system` has none; else `system` has them. Where a search for
    candidates finds that the other form is due, this one stops before the step.
    """
    counts = state.counts
    for _ in range(steps):
        if counts[SINCE_SEARCH] == 0:
            find_contact_candidates(system, state.new)
            implicit = has_oblique_joints(system.workspace, system.chain, treatment.max_obliquity)
            if implicit != counts[IMPLICIT_NOW]:
                counts[IMPLICIT_NOW] = implicit
                reset_damping_prediction(stiff)
                return OTHER_FORM
        step(counts[STEPS] * h, h, state, treatment.contact, stiff, system)
        correct_joint_damping(h, state, system.effects.axial_damping.damping, system)
        counts[IMPLICIT_STEPS] += counts[IMPLICIT_NOW]
        if treatment.distinct_static_friction:
            update_contact_modes(system.contacts)
        counts[STEPS] += 1
        counts[SINCE_SEARCH] = (counts[SINCE_SEARCH] + 1) % CANDIDATE_UPDATE_INTERVAL
    total = 0.0
    for i in range(len(state.y)):
        total += abs(state.y[i])
    return ENDED if total < np.inf else NOT_FINITE


@inline_kernel
def correct_joint_damping(
    h: float, state: MoreauState, damping: float | None, system: "System"
) -> None:
    """Add to the energies what dampers along the belt take beyond what was expected of them."""
    if damping is not None:
        heat = joint_damping_correction(
            system.chain, state.old, state.between, state.new, system.workspace, state.spare
        )
        state.y[system.layout.energies + DAMPING_HEAT] += h * heat


@inline_kernel
def step(
    t: float,
    h: float,
    state: MoreauState,
    contact_damping: ContactDamping | None,
    stiff: StiffDamping | None,
    system: "System",
) -> None:
    """Take one step from time t."""
    layout, contacts, pulleys = system.layout, system.contacts, system.pulleys
    y_old, y, middle, rate = state.y_old, state.y, state.middle, state.rate
    pulley, free, half, width = pulleys.table, pulleys.free, layout.velocities, layout.width
    predict_midpoint(h, y_old, y, middle, half)
    for k in range(layout.speeds, layout.energies):
        middle[k] = y[k] + 0.5 * (y[k] - y_old[k])
    copy(y, y_old)
    store_pulley_speeds(t, y[layout.speeds : layout.energies], pulleys, system.prescribed)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = middle[layout.speeds + k]
    prescribed_speeds(t + 0.5 * h, pulleys, system.prescribed)
    pulley_torques(t + 0.5 * h, system)
    ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
    aphi = rate[half + 2 * width : half + 3 * width]
    damped = smooth_accelerations(system, state.between, ax, ay, aphi)
    predict_contact_velocities(h, state.old, contacts, ax, ay)
    add_predicted_damping(contacts, stiff)
    damped += add_midpoint_contact_damping(h, system.chain.mass, contacts, contact_damping, ax, ay)
    prescribed_speeds(t + h, pulleys, system.prescribed)
    update_velocities(h, y[half : 2 * half], rate[half : 2 * half])
    rubbed, braked = solve_contact_impulses(h, state, stiff, system)
    update_positions(h, y, middle, half)
    for k in range(len(free)):
        y[layout.speeds + k] = pulley[ALPHA, free[k]]
    mean_reaction_torques(h, contacts, pulleys, system.prescribed)
    for j in range(pulley.shape[1]):
        mean = 0.5 * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        y[layout.angles + j] += h * mean
        y[layout.energies] += h * pulley[TORQUE, j] * mean
        pulley[SPEED, j] = pulley[ALPHA, j]
    y[layout.energies + FRICTION_HEAT] += rubbed
    y[layout.energies + DAMPING_HEAT] += h * damped + braked


@inline_kernel
def store_pulley_speeds(
    t: float, speeds: "Array", pulleys: "Pulleys", prescribed: "PrescribedSpeeds | None"
) -> None:
    """Write SPEED and SPEED_OLD of all pulleys at the start of a step."""
    prescribed_speeds(t, pulleys, prescribed)
    for k in range(len(pulleys.free)):
        pulleys.table[SPEED, pulleys.free[k]] = speeds[k]
    for j in range(pulleys.table.shape[1]):
        pulleys.table[SPEED_OLD, j] = pulleys.table[SPEED, j]


@inline_kernel
def predict_contact_velocities(
    h: float, old: "Array", contacts: "Contacts", ax: "Array", ay: "Array"
) -> None:
    """Write BODY_VX and BODY_VY as they are in the middle of the step, without friction."""
    body_vx, body_vy = contacts.table[BODY_VX], contacts.table[BODY_VY]
    for s in range(contacts.offsets[-1]):
        i = contacts.body[s]
        body_vx[s] = old[VX, i] + 0.5 * h * ax[i]
        body_vy[s] = old[VY, i] + 0.5 * h * ay[i]


@kernel
def evaluate_forces(state: MoreauState, system: "System") -> None:
    """Evaluate the forces without friction at the start."""
    rate, half, width = state.rate, system.layout.velocities, system.layout.width
    prescribed_speeds(0.0, system.pulleys, system.prescribed)
    find_contact_candidates(system, state.new)
    ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
    smooth_accelerations(system, state.new, ax, ay, rate[half + 2 * width : half + 3 * width])


@inline_kernel
def predict_midpoint(h: float, y_old: "Array", y: "Array", middle: "Array", size: int) -> None:
    """Write the positions half a step on, and the velocities there by extrapolation."""
    velocities = y[size : 2 * size]
    for i in range(size):
        middle[i] = y[i] + 0.5 * h * velocities[i]
    before, between = y_old[size : 2 * size], middle[size : 2 * size]
    for i in range(size):
        between[i] = velocities[i] + 0.5 * (velocities[i] - before[i])


@inline_kernel
def update_velocities(h: float, velocities: "Array", accelerations: "Array") -> None:
    """Add what the forces do to the velocities in a step."""
    for i in range(len(velocities)):
        velocities[i] += h * accelerations[i]


@inline_kernel
def update_positions(h: float, y: "Array", middle: "Array", size: int) -> None:
    """Write the positions at the end of a step."""
    velocities = y[size : 2 * size]
    for i in range(size):
        y[i] = middle[i] + 0.5 * h * velocities[i]


@inline_kernel
def solve_contact_impulses(
    h: float, state: MoreauState, stiff: StiffDamping | None, system: "System"
) -> tuple[float, float]:
    """Solve for the impulses and add them to the new velocities; write the new speeds into ALPHA.

    Return the heat of friction and of stiff dampers. Where a speed is prescribed SPEED is the new
    one already. SLIP is v . t before, and slip afterwards.
    """
    contacts, pulleys, inv_mass = system.contacts, system.pulleys, 1.0 / system.chain.mass
    pulley, table, old, new = pulleys.table, contacts.table, state.old, state.new
    for j in range(pulley.shape[1]):
        pulley[ALPHA, j] = pulley[SPEED, j]
    for j in pulleys.free:
        pulley[ALPHA, j] = pulley[SPEED_OLD, j] + h * pulley[TORQUE, j] / pulley[INERTIA, j]
    if system.friction is None:
        return 0.0, 0.0
    bias, slip, turn = table[STICK_BIAS], table[SLIP], table[RIM_TURN]
    update_wrap_rates(
        contacts.wrap, contacts.body, contacts.offsets[-1], system.chain, state.between
    )
    predict_rim_turn(h, contacts)
    tangential_velocities(old[VX], old[VY], contacts, slip)
    tangential_velocities(new[VX], new[VY], contacts, bias)
    for s in range(contacts.offsets[-1]):
        bias[s] = -bias[s] - turn[s]
    friction_limits(contacts, h)
    solve_friction_impulses(system.chain.mass, contacts, pulleys, stiff)
    damped = solve_stiff_damping(h, old, new, stiff, system)
    add_friction_forces(contacts, inv_mass, new[VX], new[VY])
    tangential_velocities(new[VX], new[VY], contacts, bias)
    rubbed = 0.0
    for j in range(pulley.shape[1]):
        mean = 0.5 * pulley[PULLEY_RADIUS, j] * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        rim = pulley[PULLEY_RADIUS, j] * pulley[ALPHA, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            rubbed += table[FRICTION, s] * (mean - 0.5 * (slip[s] + bias[s]))
            slip[s] = rim - bias[s] - turn[s]
    return rubbed, damped


@inline_kernel
def solve_friction_impulses(
    mass: float, contacts: "Contacts", pulleys: "Pulleys", stiff: StiffDamping | None
) -> None:
    """Solve for friction and the speeds of free pulleys, where no stiff damping couples them."""
    if stiff is None:
        pulley = pulleys.table
        for j in pulleys.free:
            external = pulley[INERTIA, j] * pulley[ALPHA, j]
            pulley[ALPHA, j] = solve_pulley_motion(
                j, pulley[SPEED_OLD, j], external, contacts, pulleys, mass
            )
        project_friction(contacts, pulleys, mass, pulley[ALPHA])


@inline_kernel
def solve_stiff_damping(
    h: float, old: "Array", new: "Array", stiff: StiffDamping | None, system: "System"
) -> float:
    """Solve for friction, speeds and stiff dampers together; return the heat of the dampers."""
    if stiff is not None:
        return solve_damping_and_friction(h, old, new, stiff, system)
    return 0.0


@inline_kernel
def mean_reaction_torques(
    h: float, contacts: "Contacts", pulleys: "Pulleys", prescribed: "PrescribedSpeeds | None"
) -> None:
    """Write the mean TORQUE that it took to keep a prescribed speed."""
    if prescribed is not None:
        pulley = pulleys.table
        for j in prescribed.pulleys:
            gained = pulley[INERTIA, j] * (pulley[ALPHA, j] - pulley[SPEED_OLD, j])
            pulley[TORQUE, j] = (
                gained + pulley[PULLEY_RADIUS, j] * total_friction(j, contacts)
            ) / h
