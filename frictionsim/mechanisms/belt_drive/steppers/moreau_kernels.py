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
    PULL_X,
    PULL_Y,
    SIN,
    VX,
    VY,
    heat_of_acceleration,
)
from frictionsim.mechanisms.belt_drive.kernels.contact import (
    ALPHA,
    BEFORE,
    BODY_VX,
    BODY_VY,
    FRICTION,
    INERTIA,
    NORMAL,
    NX,
    NY,
    PER_R,
    PULLEY_RADIUS,
    RADIUS,
    SLIP,
    SPEED,
    TORQUE,
    WISH,
    deal_slots,
    drag,
    grip,
    limit_friction,
    meet,
    remember,
    share_friction,
)
from frictionsim.mechanisms.belt_drive.kernels.equations import act, copy, load, prescribe
from frictionsim.mechanisms.belt_drive.kernels.jit import entry, kernel
from frictionsim.mechanisms.belt_drive.steppers.moreau_damping import (
    damp_and_strike,
    expect_dampers,
    forget,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

# Bodies near pulleys are given their slots anew after so many steps, in which none gets through the
# margin, a body's length, unless it is faster than a sixteenth of the waves along the belt.
STEPS_OF_A_DEAL = 16

MOST_OBLIQUE = 2.0  # the sum of two sin^2: there is no more


class Walk(NamedTuple):
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
    motion: "Array"
    motion_middle: "Array"
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
    contact_damping,
    obliquity,
    undamped,
    laws,
    torques,
    loads,
    speeds,
    room,
    slots,
    pulleys,
):
    """Take so many steps of length h; return whether the state is still finite.

    `laws` have the dampers along the belt, `undamped` leave them to be solved for, as they are
    where a body has more of the obliquity than there may be.
    """
    counts = walk.counts
    for _ in range(steps):
        if counts[1] == 0:
            deal_slots(walk.motion, laws.chain.bodies, pulleys, margin, slots, friction)
            counts[2] = oblique(room, laws.chain, obliquity)
            if counts[2] == 0:
                forget(damping)
        t = counts[0] * h
        if counts[2] > 0:
            solve_step(
                t,
                h,
                walk,
                friction,
                damping,
                contact_damping,
                undamped,
                torques,
                loads,
                speeds,
                room,
                slots,
                pulleys,
            )
            counts[3] += 1
        else:
            step(
                t,
                h,
                walk,
                friction,
                None,
                contact_damping,
                laws,
                torques,
                loads,
                speeds,
                room,
                slots,
                pulleys,
            )
            add_heat_of_acceleration(h, walk, laws, room, pulleys)
        keep_in_mind(slots, hysteresis)
        counts[0] += 1
        counts[1] = (counts[1] + 1) % STEPS_OF_A_DEAL
    total = 0.0
    for i in range(len(walk.y)):
        total += abs(walk.y[i])
    return total < np.inf


@kernel
def oblique(room, chain, most):
    """Return whether the dampers of a body's joints turn it too fast for extrapolation.

    A joint without much tension may point anywhere; its damper then meets the small inertia of
    the bodies that it turns. sin^2 of the angle between joint and body is the share in that.
    """
    if most >= MOST_OBLIQUE:
        return 0
    cos, sin, pull_x, pull_y = room[COS], room[SIN], room[PULL_X], room[PULL_Y]
    count = 0.0
    for k in range(chain.bodies):
        x0, y0, x1, y1 = pull_x[k], pull_y[k], pull_x[k + 1], pull_y[k + 1]
        before, after = y0 * cos[k] - x0 * sin[k], y1 * cos[k] - x1 * sin[k]
        size0, size1 = x0 * x0 + y0 * y0, x1 * x1 + y1 * y1
        # before^2/size0 + after^2/size1 > most, without the divisions
        share = before * before * size1 + after * after * size0
        count += 1.0 if share > most * size0 * size1 else 0.0
    return 1 if count > 0.0 else 0


@kernel
def solve_step(
    t,
    h,
    walk,
    friction,
    damping,
    contact_damping,
    laws,
    torques,
    loads,
    speeds,
    room,
    slots,
    pulleys,
):
    """Take one step in which the dampers along the belt are solved for, if there are any."""
    if damping is not None:
        step(
            t,
            h,
            walk,
            friction,
            damping,
            contact_damping,
            laws,
            torques,
            loads,
            speeds,
            room,
            slots,
            pulleys,
        )


@kernel
def add_heat_of_acceleration(h, walk, laws, room, pulleys):
    """Add to the energies what dampers along the belt take beyond what was expected of them."""
    if laws.axial_damping is not None:
        spare = walk.rate[: 6 * room.shape[1]].reshape((6, room.shape[1]))
        heat = heat_of_acceleration(
            laws.chain,
            walk.motion0,
            walk.motion_middle,
            walk.motion,
            room,
            spare,
            laws.axial_damping,
        )
        walk.y[6 * room.shape[1] + pulleys.table.shape[1] + len(pulleys.free) + 2] += h * heat


@kernel
def keep_in_mind(slots, hysteresis):
    """Take over who sticks now, if static and kinetic friction differ."""
    if hysteresis is not None:
        remember(slots)


@kernel
def step(
    t,
    h,
    walk,
    friction,
    damping,
    contact_damping,
    laws,
    torques,
    loads,
    speeds,
    room,
    slots,
    pulleys,
):
    """Take one step from time t."""
    y0, y, middle, rate = walk.y0, walk.y, walk.middle, walk.rate
    pulley, free, width = pulleys.table, pulleys.free, room.shape[1]
    count = pulley.shape[1]
    angles, speed = 6 * width, 6 * width + count
    ledger = speed + len(free)
    go_to_middle(h, y0, y, middle, 3 * width)
    for k in range(speed, ledger):
        middle[k] = y[k] + 0.5 * (y[k] - y0[k])
    copy(y, y0)
    note_speeds(t, y[speed:ledger], pulleys, speeds)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = middle[speed + k]
    prescribe(t + 0.5 * h, pulleys, speeds)
    load(t + 0.5 * h, pulleys, torques, loads)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    damped = act(laws, walk.motion_middle, room, slots, ax, ay, rate[5 * width : 6 * width])
    expect(h, walk.motion0, slots, ax, ay)
    expect_dampers(slots, damping)
    damped += damp_midway(h, laws.chain.mass, slots, ax, ay, contact_damping)
    prescribe(t + h, pulleys, speeds)
    accelerate(h, y[3 * width : 6 * width], rate[3 * width : 6 * width])
    rubbed, braked = strike(
        h, walk.motion0, walk.motion, laws.chain, room, slots, pulleys, friction, damping
    )
    go_on(h, y, middle, 3 * width)
    for k in range(len(free)):
        y[speed + k] = pulley[ALPHA, free[k]]
    react(h, slots, pulleys, speeds)
    for j in range(count):
        mean = 0.5 * (pulley[BEFORE, j] + pulley[ALPHA, j])
        y[angles + j] += h * mean
        y[ledger] += h * pulley[TORQUE, j] * mean
        pulley[SPEED, j] = pulley[ALPHA, j]
    y[ledger + 1] += rubbed
    y[ledger + 2] += h * damped + braked


@kernel
def note_speeds(t, state, pulleys, speeds):
    """Write the speeds of all pulleys at the start of a step."""
    prescribe(t, pulleys, speeds)
    for k in range(len(pulleys.free)):
        pulleys.table[SPEED, pulleys.free[k]] = state[k]
    for j in range(pulleys.table.shape[1]):
        pulleys.table[BEFORE, j] = pulleys.table[SPEED, j]


@kernel
def expect(h, before, slots, ax, ay):
    """Write the velocities of the bodies at pulleys in the middle of the step, without friction."""
    body_vx, body_vy = slots.table[BODY_VX], slots.table[BODY_VY]
    for s in range(slots.first[-1]):
        i = slots.body[s]
        body_vx[s] = before[VX, i] + 0.5 * h * ax[i]
        body_vy[s] = before[VY, i] + 0.5 * h * ay[i]


@kernel
def damp_midway(h, mass, slots, ax, ay, damping):
    """Add the dampers of the contacts, at the mean of the old and the new velocity along n.

    With the acceleration A along n without it and the coefficient b that mean is
    (v + h A/2)/(1 + h b/(2 m)): stable at any b. Return the power damped, W.
    """
    heat = 0.0
    if damping is not None:
        table = slots.table
        normal, nx, ny, more = table[NORMAL], table[NX], table[NY], table[WISH]
        vx, vy, radius, per_r = table[BODY_VX], table[BODY_VY], table[RADIUS], table[PER_R]
        per_mass, per_depth, count = 1.0 / mass, 1.0 / damping.full_depth, slots.first[-1]
        for s in range(count):
            more[s] = vx[s] * nx[s] + vy[s] * ny[s]
        for s in range(count):
            depth = min(max((radius[s] - 1.0 / per_r[s]) * per_depth, 0.0), 1.0)
            b = damping.coefficient * depth * depth * (3.0 - 2.0 * depth)
            rate = -more[s] / (1.0 + 0.5 * h * b * per_mass)
            more[s] = max(b * rate, -normal[s])
            heat += more[s] * rate
        for s in range(count):
            i = slots.body[s]
            normal[s] += more[s]
            ax[i] += per_mass * more[s] * nx[s]
            ay[i] += per_mass * more[s] * ny[s]
    return heat


@entry
def look(walk, margin, friction, laws, torques, loads, speeds, room, slots, pulleys):
    """Evaluate the forces without friction at the start."""
    motion, rate, width = walk.motion, walk.rate, room.shape[1]
    prescribe(0.0, pulleys, speeds)
    deal_slots(motion, laws.chain.bodies, pulleys, margin, slots, friction)
    ax, ay = rate[3 * width : 4 * width], rate[4 * width : 5 * width]
    act(laws, motion, room, slots, ax, ay, rate[5 * width : 6 * width])


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
def strike(h, before, after, chain, room, slots, pulleys, friction, damping):
    """Solve for the impulses and add them; write the new speeds into ALPHA.

    Return the heat of friction and of stiff dampers. Where a speed is prescribed SPEED is the new
    one already.
    """
    pulley, table = pulleys.table, slots.table
    for j in range(pulley.shape[1]):
        pulley[ALPHA, j] = pulley[SPEED, j]
    for j in pulleys.free:
        pulley[ALPHA, j] = pulley[BEFORE, j] + h * pulley[TORQUE, j] / pulley[INERTIA, j]
    if friction is None:
        return 0.0, 0.0
    wish, slip = table[WISH], table[SLIP]
    along_of(before[VX], before[VY], slots, slip)
    along_of(after[VX], after[VY], slots, wish)
    for s in range(slots.first[-1]):
        wish[s] = -wish[s]
    limit_friction(slots, h)
    settle(chain.mass, slots, pulleys, damping)
    damped = damp(h, before, after, chain, room, slots, pulleys, damping)
    drag(slots, 1.0 / chain.mass, after[VX], after[VY])
    along_of(after[VX], after[VY], slots, wish)
    rubbed = 0.0
    for j in range(pulley.shape[1]):
        mean = 0.5 * pulley[PULLEY_RADIUS, j] * (pulley[BEFORE, j] + pulley[ALPHA, j])
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
            pulley[ALPHA, j] = meet(j, pulley[BEFORE, j], offer, slots, pulleys, mass)
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
def react(h, slots, pulleys, speeds):
    """Write the mean torque that it took to keep a prescribed speed."""
    if speeds is not None:
        pulley = pulleys.table
        for j in speeds.which:
            gained = pulley[INERTIA, j] * (pulley[ALPHA, j] - pulley[BEFORE, j])
            pulley[TORQUE, j] = (gained + pulley[PULLEY_RADIUS, j] * grip(j, slots)) / h
