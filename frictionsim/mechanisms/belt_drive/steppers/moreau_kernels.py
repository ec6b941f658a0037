"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives, compiled.

Moreau's scheme [1]_: half a step with the old velocities, the forces there, the impulses that the
set-valued law asks for, half a step with the new velocities.

    q_m = q + (h/2) v
    v+  = v + h a(q_m, v_m) + (impulses P along t)/m
    P   = clip(m (R omega+ - (v + h a) . t), -mu N h, mu N h)
    q+  = q_m + (h/2) v+

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

from frictionsim.mechanisms.belt_drive.kernels.chain import (
    COS,
    FORCE_X,
    FORCE_Y,
    SIN,
    VX,
    VY,
    joint_damping_correction,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    ALPHA,
    BODY_VX,
    BODY_VY,
    FRICTION,
    INERTIA,
    INV_DISTANCE,
    NORMAL,
    NX,
    NY,
    PULLEY_RADIUS,
    RADIUS,
    SLIP,
    SPEED,
    SPEED_OLD,
    STICK_BIAS,
    TORQUE,
    add_friction_forces,
    find_contact_candidates,
    friction_limits,
    project_friction,
    solve_pulley_motion,
    total_friction,
    update_friction_coefficients,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import (
    copy,
    prescribed_speeds,
    pulley_torques,
    smooth_accelerations,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, kernel
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    add_predicted_damping,
    reset_damping_prediction,
    solve_damping_and_friction,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

# Bodies near pulleys are given their slots anew after so many steps, in which none gets through the
# margin, a body's length, unless it is faster than a sixteenth of the waves along the belt.
CANDIDATE_UPDATE_INTERVAL = 16

MAX_OBLIQUITY = 2.0  # the sum of two sin^2: there is no more


class MoreauState(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y0, y : (n,)
        The states at the start and the end of the last step.
    middle, rate : (n,)
        Room to work in.
    motion0, motion, motion_middle : (6, width)
        The motions that y0, y and middle begin with: views of them.
    counts : (4,)
        Steps, steps since the slots were dealt, 1 if dampers along the belt are solved for now,
        and how many steps were taken so.
    """

    y0: "Array"
    y: "Array"
    middle: "Array"
    rate: "Array"
    motion0: "Array"
    kinematics: "Array"
    motion_middle: "Array"
    counts: "Indices"


@kernel
def integrate(
    steps,
    h,
    integrate,
    skin,
    friction,
    distinct_static_friction,
    damping,
    contact_damping,
    obliquity,
    undamped,
    laws,
    torques,
    loads,
    speeds,
    workspace,
    contacts,
    pulleys,
):
    """Take so many steps of length h; return whether the state is still finite.

    `laws` have the dampers along the belt, `undamped` leave them to be solved for, as they are
    where a body has more of the obliquity than there may be.
    """
    counts = integrate.counts
    for _ in range(steps):
        if counts[1] == 0:
            find_contact_candidates(
                integrate.kinematics, laws.chain.bodies, pulleys, skin, contacts, friction
            )
            counts[2] = has_oblique_joints(workspace, laws.chain, obliquity)
            if counts[2] == 0:
                reset_damping_prediction(damping)
        t = counts[0] * h
        if counts[2] > 0:
            solve_step(
                t,
                h,
                integrate,
                friction,
                damping,
                contact_damping,
                undamped,
                torques,
                loads,
                speeds,
                workspace,
                contacts,
                pulleys,
            )
            counts[3] += 1
        else:
            step(
                t,
                h,
                integrate,
                friction,
                None,
                contact_damping,
                laws,
                torques,
                loads,
                speeds,
                workspace,
                contacts,
                pulleys,
            )
            correct_joint_damping(h, integrate, laws, workspace, pulleys)
        update_contact_modes(contacts, distinct_static_friction)
        counts[0] += 1
        counts[1] = (counts[1] + 1) % CANDIDATE_UPDATE_INTERVAL
    total = 0.0
    for i in range(len(integrate.y)):
        total += abs(integrate.y[i])
    return total < np.inf


@inline_kernel
def has_oblique_joints(workspace, chain, max_obliquity):
    """Return whether the dampers of a body's joints turn it too fast for extrapolation.

    A joint without much tension may point anywhere; its damper then meets the small inertia of
    the bodies that it turns. sin^2 of the angle between joint and body is the share in that.
    """
    if max_obliquity >= MAX_OBLIQUITY:
        return 0
    cos, sin, force_x, force_y = (
        workspace[COS],
        workspace[SIN],
        workspace[FORCE_X],
        workspace[FORCE_Y],
    )
    count = 0.0
    for k in range(chain.bodies):
        x0, y0, x1, y1 = force_x[k], force_y[k], force_x[k + 1], force_y[k + 1]
        before, after = y0 * cos[k] - x0 * sin[k], y1 * cos[k] - x1 * sin[k]
        size0, size1 = x0 * x0 + y0 * y0, x1 * x1 + y1 * y1
        # before^2/size0 + after^2/size1 > most, without the divisions
        share = before * before * size1 + after * after * size0
        count += 1.0 if share > max_obliquity * size0 * size1 else 0.0
    return 1 if count > 0.0 else 0


@inline_kernel
def solve_step(
    t,
    h,
    integrate,
    friction,
    damping,
    contact_damping,
    laws,
    torques,
    loads,
    speeds,
    workspace,
    contacts,
    pulleys,
):
    """Take one step in which the dampers along the belt are solved for, if there are any."""
    if damping is not None:
        step(
            t,
            h,
            integrate,
            friction,
            damping,
            contact_damping,
            laws,
            torques,
            loads,
            speeds,
            workspace,
            contacts,
            pulleys,
        )


@inline_kernel
def correct_joint_damping(h, integrate, laws, workspace, pulleys):
    """Add to the energies what dampers along the belt take beyond what was expected of them."""
    if laws.axial_damping is not None:
        spare = integrate.rate[: 6 * workspace.shape[1]].reshape((6, workspace.shape[1]))
        heat = joint_damping_correction(
            laws.chain,
            integrate.motion0,
            integrate.motion_middle,
            integrate.kinematics,
            workspace,
            spare,
            laws.axial_damping,
        )
        integrate.y[6 * workspace.shape[1] + pulleys.table.shape[1] + len(pulleys.free) + 2] += (
            h * heat
        )


@inline_kernel
def update_contact_modes(contacts, distinct_static_friction):
    """Take over who sticks now, if static and kinetic friction differ."""
    if distinct_static_friction is not None:
        update_friction_coefficients(contacts)


@inline_kernel
def step(
    t,
    h,
    integrate,
    friction,
    damping,
    contact_damping,
    laws,
    torques,
    loads,
    speeds,
    workspace,
    contacts,
    pulleys,
):
    """Take one step from time t."""
    y0, y, middle, rate = integrate.y0, integrate.y, integrate.middle, integrate.rate
    pulley, free, width = pulleys.table, pulleys.free, workspace.shape[1]
    count = pulley.shape[1]
    angles, speed = 6 * width, 6 * width + count
    energies = speed + len(free)
    predict_midpoint(h, y0, y, middle, 3 * width)
    for k in range(speed, energies):
        middle[k] = y[k] + 0.5 * (y[k] - y0[k])
    copy(y, y0)
    store_pulley_speeds(t, y[speed:energies], pulleys, speeds)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = middle[speed + k]
    prescribed_speeds(t + 0.5 * h, pulleys, speeds)
    pulley_torques(t + 0.5 * h, pulleys, torques, loads)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    damped = smooth_accelerations(
        laws, integrate.motion_middle, workspace, contacts, ax, ay, rate[5 * width : 6 * width]
    )
    predict_contact_velocities(h, integrate.motion0, contacts, ax, ay)
    add_predicted_damping(contacts, damping)
    damped += add_midpoint_contact_damping(h, laws.chain.mass, contacts, ax, ay, contact_damping)
    prescribed_speeds(t + h, pulleys, speeds)
    update_velocities(h, y[3 * width : 6 * width], rate[3 * width : 6 * width])
    rubbed, braked = solve_contact_impulses(
        h,
        integrate.motion0,
        integrate.kinematics,
        laws.chain,
        workspace,
        contacts,
        pulleys,
        friction,
        damping,
    )
    update_positions(h, y, middle, 3 * width)
    for k in range(len(free)):
        y[speed + k] = pulley[ALPHA, free[k]]
    reaction_torques(h, contacts, pulleys, speeds)
    for j in range(count):
        mean = 0.5 * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        y[angles + j] += h * mean
        y[energies] += h * pulley[TORQUE, j] * mean
        pulley[SPEED, j] = pulley[ALPHA, j]
    y[energies + 1] += rubbed
    y[energies + 2] += h * damped + braked


@inline_kernel
def store_pulley_speeds(t, state, pulleys, speeds):
    """Write the speeds of all pulleys at the start of a step."""
    prescribed_speeds(t, pulleys, speeds)
    for k in range(len(pulleys.free)):
        pulleys.table[SPEED, pulleys.free[k]] = state[k]
    for j in range(pulleys.table.shape[1]):
        pulleys.table[SPEED_OLD, j] = pulleys.table[SPEED, j]


@inline_kernel
def predict_contact_velocities(h, before, contacts, ax, ay):
    """Write the velocities of the bodies at pulleys in the middle of the step, without friction."""
    body_vx, body_vy = contacts.table[BODY_VX], contacts.table[BODY_VY]
    for s in range(contacts.offsets[-1]):
        i = contacts.body[s]
        body_vx[s] = before[VX, i] + 0.5 * h * ax[i]
        body_vy[s] = before[VY, i] + 0.5 * h * ay[i]


@inline_kernel
def add_midpoint_contact_damping(h, mass, contacts, ax, ay, damping):
    """Add the dampers of the contacts, at the mean of the old and the new velocity along n.

    With the acceleration A along n without it and the coefficient b that mean is
    (v + h A/2)/(1 + h b/(2 m)): stable at any b. Return the power damped, W.
    """
    heat = 0.0
    if damping is not None:
        table = contacts.table
        normal, nx, ny, more = table[NORMAL], table[NX], table[NY], table[STICK_BIAS]
        vx, vy, radius, inv_distance = (
            table[BODY_VX],
            table[BODY_VY],
            table[RADIUS],
            table[INV_DISTANCE],
        )
        inv_mass, inv_full_depth, count = 1.0 / mass, 1.0 / damping.full_depth, contacts.offsets[-1]
        for s in range(count):
            more[s] = vx[s] * nx[s] + vy[s] * ny[s]
        for s in range(count):
            depth = min(max((radius[s] - 1.0 / inv_distance[s]) * inv_full_depth, 0.0), 1.0)
            b = damping.coefficient * depth * depth * (3.0 - 2.0 * depth)
            rate = -more[s] / (1.0 + 0.5 * h * b * inv_mass)
            more[s] = max(b * rate, -normal[s])
            heat += more[s] * rate
        for s in range(count):
            i = contacts.body[s]
            normal[s] += more[s]
            ax[i] += inv_mass * more[s] * nx[s]
            ay[i] += inv_mass * more[s] * ny[s]
    return heat


@kernel
def evaluate_forces(
    integrate, skin, friction, laws, torques, loads, speeds, workspace, contacts, pulleys
):
    """Evaluate the forces without friction at the start."""
    kinematics, rate, width = integrate.kinematics, integrate.rate, workspace.shape[1]
    prescribed_speeds(0.0, pulleys, speeds)
    find_contact_candidates(kinematics, laws.chain.bodies, pulleys, skin, contacts, friction)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    smooth_accelerations(laws, kinematics, workspace, contacts, ax, ay, rate[5 * width : 6 * width])


@inline_kernel
def predict_midpoint(h, y0, y, middle, size):
    """Write the positions half a step on, and the velocities there by extrapolation."""
    velocities = y[size : 2 * size]
    for i in range(size):
        middle[i] = y[i] + 0.5 * h * velocities[i]
    before, between = y0[size : 2 * size], middle[size : 2 * size]
    for i in range(size):
        between[i] = velocities[i] + 0.5 * (velocities[i] - before[i])


@inline_kernel
def update_velocities(h, velocities, accelerations):
    """Add what the forces do to the velocities in a step."""
    for i in range(len(velocities)):
        velocities[i] += h * accelerations[i]


@inline_kernel
def update_positions(h, y, middle, size):
    """Write the positions at the end of a step."""
    velocities = y[size : 2 * size]
    for i in range(size):
        y[i] = middle[i] + 0.5 * h * velocities[i]


@inline_kernel
def solve_contact_impulses(
    h, before, after, chain, workspace, contacts, pulleys, friction, damping
):
    """Solve for the impulses and add them; write the new speeds into ALPHA.

    Return the heat of friction and of stiff dampers. Where a speed is prescribed SPEED is the new
    one already.
    """
    pulley, table = pulleys.table, contacts.table
    for j in range(pulley.shape[1]):
        pulley[ALPHA, j] = pulley[SPEED, j]
    for j in pulleys.free:
        pulley[ALPHA, j] = pulley[SPEED_OLD, j] + h * pulley[TORQUE, j] / pulley[INERTIA, j]
    if friction is None:
        return 0.0, 0.0
    stick_bias, slip = table[STICK_BIAS], table[SLIP]
    tangential_velocities(before[VX], before[VY], contacts, slip)
    tangential_velocities(after[VX], after[VY], contacts, stick_bias)
    for s in range(contacts.offsets[-1]):
        stick_bias[s] = -stick_bias[s]
    friction_limits(contacts, h)
    solve_friction(chain.mass, contacts, pulleys, damping)
    damped = solve_stiff_damping(h, before, after, chain, workspace, contacts, pulleys, damping)
    add_friction_forces(contacts, 1.0 / chain.mass, after[VX], after[VY])
    tangential_velocities(after[VX], after[VY], contacts, stick_bias)
    rubbed = 0.0
    for j in range(pulley.shape[1]):
        mean = 0.5 * pulley[PULLEY_RADIUS, j] * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        rim = pulley[PULLEY_RADIUS, j] * pulley[ALPHA, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            rubbed += table[FRICTION, s] * (mean - 0.5 * (slip[s] + stick_bias[s]))
            slip[s] = rim - stick_bias[s]
    return rubbed, damped


@inline_kernel
def solve_friction(mass, contacts, pulleys, damping):
    """Solve for friction and the speeds of free pulleys, where no stiff damping couples them."""
    if damping is None:
        pulley = pulleys.table
        for j in pulleys.free:
            external = pulley[INERTIA, j] * pulley[ALPHA, j]
            pulley[ALPHA, j] = solve_pulley_motion(
                j, pulley[SPEED_OLD, j], external, contacts, pulleys, mass
            )
        project_friction(contacts, pulleys, mass, pulley[ALPHA])


@inline_kernel
def solve_stiff_damping(h, before, after, chain, workspace, contacts, pulleys, damping):
    """Solve for friction, speeds and stiff dampers together; return the heat of the dampers."""
    if damping is not None:
        return solve_damping_and_friction(
            h, before, after, chain, workspace, contacts, pulleys, damping
        )
    return 0.0


@inline_kernel
def tangential_velocities(vx, vy, contacts, along):
    """Write the velocities along t of the bodies that have a slot."""
    nx, ny, body = contacts.table[NX], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        i = body[s]
        along[s] = vy[i] * nx[s] - vx[i] * ny[s]


@inline_kernel
def reaction_torques(h, contacts, pulleys, speeds):
    """Write the mean torque that it took to keep a prescribed speed."""
    if speeds is not None:
        pulley = pulleys.table
        for j in speeds.targets:
            gained = pulley[INERTIA, j] * (pulley[ALPHA, j] - pulley[SPEED_OLD, j])
            pulley[TORQUE, j] = (
                gained + pulley[PULLEY_RADIUS, j] * total_friction(j, contacts)
            ) / h
