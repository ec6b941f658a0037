"""Midpoint steps of a fixed length with exact impulses of friction, for belt drives.

Moreau's scheme [1]_: half a step with the old velocities, the forces there, the impulses that the
set-valued law asks for, half a step with the new velocities.

    q_m = q + (h/2) v
    v+  = v + h a(q_m, v_m) + (impulses P along t)/m
    P   = clip(m (R omega+ - (v + h a) . t - (h/2) t' . v_m), -mu N h, mu N h)
    q+  = q_m + (h/2) v+

with t in the middle of the step, and its rate: what sticks has no slip along the t of the end. That
of the middle would leave t' . v_m over half a step, an error of first order. The work of P is that
of the mean velocities, v . t with the t of the middle: the energy closes. The wrap factor kappa is
taken with t, and its rate with that of t.

One evaluation of the forces a step. They depend on the velocity through dampers and torques, for
which v_m = v + (v - v_before)/2 is the velocity at the middle to second order. The dampers of the
contacts, each of which meets one body only, are solved for instead. Of second order where the
motion is smooth, of first order at switches of friction or contact. Stick is exact: the slip that
is left is rounding.

Dampers along the belt that are too stiff for v_m are solved for as well, see `dampers`.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError, NonFinite
from frictionsim.mechanisms.belt_drive import belt as row
from frictionsim.mechanisms.belt_drive.belt import Array, Belt, Indices, Line, aligned
from frictionsim.mechanisms.belt_drive.compilation import kernel, loop, part
from frictionsim.mechanisms.belt_drive.dampers import (
    Body,
    Dampers,
    Motion,
    add_dampers,
    dampers_of,
    heat_of_dampers,
    joint_rows,
    line_rates,
    press_line,
    solve_bending,
    solve_dampers,
    solve_pulleys,
    stretch_rates,
    twist,
)
from frictionsim.mechanisms.belt_drive.equilibrium import Rest
from frictionsim.mechanisms.belt_drive.kernels import (
    ONE,
    TINY,
    Accelerations,
    Contact,
    Rim,
    bodies_of,
    body_forces,
    contact_of,
    copy,
    drive,
    joints_of,
    point_forces,
    rim_of,
    search,
    update_modes,
)
from frictionsim.mechanisms.belt_drive.limits import deepest_contact_stiffness, max_frequency

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

SEARCH_INTERVAL = 16  # steps from one search for bodies near pulleys to the next
# The numbers in `counts`: steps, and how many of them ended with another sticking set than their
# dampers were solved for with.
STEPS, UNSETTLED = range(2)


class Steps(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to."""

    y_old: Array  # (size,), the state at the start of the last step
    y: Array  # and at its end
    middle: Array  # (rows, width), the kinematics in the middle of the next step
    acc: Array  # (rows/2, width), accelerations; on a line the new velocities
    counts: Indices  # (2,): STEPS, UNSETTLED


# --- pulleys --------------------------------------------------------------------------------------


@part
def start_pulleys(t: float, h: float, y: Array, y_old: Array, b: Belt) -> None:
    """Write SPEED_OLD; SPEED and TORQUE in the middle of a step; SPEED_NEW, a guess where free.

    Speeds of free pulleys are extrapolated from `y_old`, of the step before; their ALPHA becomes
    the speed that they would have without friction.
    """
    pul = b.pul
    for ahead in (1.0, 0.0, 0.5):  # of a step
        if ahead == 0.5:
            for i in range(len(b.free)):
                j, new, before = b.free[i], y[b.speeds + i], y_old[b.speeds + i]
                pul[row.SPEED_OLD, j], pul[row.SPEED_NEW, j] = new, 2.0 * new - before
                pul[row.SPEED, j] = 1.5 * new - 0.5 * before
        elif len(b.prescribed) == 0:
            continue
        drive(t + ahead * h, b)
        for j in b.prescribed:
            if ahead == 1.0:
                pul[row.SPEED_NEW, j] = pul[row.SPEED, j]
            elif ahead == 0.0:
                pul[row.SPEED_OLD, j] = pul[row.SPEED, j]
    for j in range(pul.shape[1]):
        pul[row.PULL, j] = 0.0
    for j in b.free:
        pul[row.ALPHA, j] = pul[row.SPEED_OLD, j] + h * pul[row.TORQUE, j] / pul[row.INERTIA, j]
    for i in range(b.angles, b.size):
        y_old[i] = y[i]


@part
def end_pulleys(h: float, rubbed: float, damped: float, y: Array, b: Belt) -> None:
    """Write the state of the pulleys after a step, and its energies, J; reads PULL.

    TORQUE of a prescribed speed is the mean of what it took to keep it.
    """
    pul = b.pul
    for i in range(len(b.free)):
        y[b.speeds + i] = pul[row.SPEED_NEW, b.free[i]]
    for j in b.prescribed:
        gained = pul[row.INERTIA, j] * (pul[row.SPEED_NEW, j] - pul[row.SPEED_OLD, j])
        pul[row.TORQUE, j] = (gained + pul[row.RADIUS, j] * pul[row.PULL, j]) / h
    for j in range(pul.shape[1]):
        turned = 0.5 * h * (pul[row.SPEED_OLD, j] + pul[row.SPEED_NEW, j])
        y[b.angles + j] += turned
        y[b.energies + row.INPUT_ENERGY] += pul[row.TORQUE, j] * turned
        pul[row.SPEED, j] = pul[row.SPEED_NEW, j]
    y[b.energies + row.FRICTION_HEAT] += rubbed
    y[b.energies + row.DAMPING_HEAT] += damped


# --- bodies in the plane, points on a line --------------------------------------------------------


@loop
def begin(size: int, h: float, q: Array, v: Array, q_middle: Array, v_middle: Array) -> None:
    """Write the middle of the first step."""
    for i in range(size):
        q_middle[i], v_middle[i] = q[i] + 0.5 * h * v[i], v[i]


@loop
def gain(size: int, h: float, v: Array, new: Array) -> None:
    """Make of accelerations the velocities after a step."""
    for i in range(size):
        new[i] = v[i] + h * new[i]


@loop
def move(
    size: int,
    h: float,
    accelerated: bool | None,
    q: Array,
    v: Array,
    new: Array,
    q_middle: Array,
    v_middle: Array,
) -> None:
    """Write the end of a step with its new velocities, and the middle of the next.

    Where bodies are `accelerated`, `new` has their accelerations.
    """
    for i in range(size):
        after = new[i]
        if accelerated is not None:
            after = v[i] + h * new[i]
        place = q_middle[i] + 0.5 * h * after
        v_middle[i], v[i] = 1.5 * after - 0.5 * v[i], after
        q[i], q_middle[i] = place, place + 0.5 * h * after


@loop
def press_in_step(
    body: Body,
    a: int,
    e: int,
    h: float,
    rim: Rim,
    damping: bool | None,
    wrap: bool | None,
    m: Motion,
    d: Dampers | None,
    bias: Array,
    c: Contact,
) -> float:
    """Bodies a to e on one pulley: what contacts do in a step but friction; return the power, W.

    Places are those in the middle, velocities those at the start. The dampers of contacts work at
    the mean of the old and the new velocity along n: with the acceleration A along n without them
    that is (v + h A/2)/(1 + h b/(2 m)), stable at any b. Dampers d, solved for afterwards, are
    expected to add what they added in the last step; without that it would be of first order.
    `slip` becomes kappa v . t at the start, `bias` -kappa v . t at the end without friction, along
    the t of the end; forward and backward the limits of impulses, N s.

    Four loops: with all its arrays in one the compiler makes no vectors.
    """
    power, inv_mass, last = 0.0, 1.0 / body.mass, np.uint64(body.n)
    old, middle, acc, bend, rate = m.old, m.middle, m.acc, m.joints.bend, m.joints.rate
    for k in range(np.uint64(a), np.uint64(e)):  # 1/distance in turned, the damper's b in yields
        dx, dy = middle.x[k] - rim.x, middle.y[k] - rim.y
        square = dx * dx + dy * dy + TINY
        inv = 1.0 / np.sqrt(square)
        p = max(rim.radius - square * inv, 0.0) if k < last else 0.0
        share, force = min(p * rim.inv_full, 1.0), p * (rim.quadratic * p + rim.linear)
        c.nx[k], c.ny[k], c.normal[k], c.turned[k] = dx * inv, dy * inv, force, inv
        c.yields[k] = rim.damping * share * share * (3.0 - 2.0 * share)
    if wrap is not None:
        for k in range(np.uint64(a), np.uint64(e)):  # its rate in bias
            b0, b1 = bend[k], bend[k + ONE]
            c.kappa[k] = 1.0 + (b0 * b0 + b1 * b1) * (1.0 / 24.0)
            bias[k] = (b0 * rate[k] + b1 * rate[k + ONE]) * (1.0 / 12.0)
    for k in range(np.uint64(a), np.uint64(e)):
        ux, uy, gx, gy = old.vx[k], old.vy[k], h * acc.x[k], h * acc.y[k]
        cx, cy, force = c.nx[k], c.ny[k], c.normal[k]
        mx, my = ux + 0.5 * gx, uy + 0.5 * gy
        if d is not None:
            mx, my = mx + 0.5 * d.vx[k], my + 0.5 * d.vy[k]
        out, along = mx * cx + my * cy + 0.5 * h * inv_mass * force, my * cx - mx * cy
        factor, factor_rate = 1.0, 0.0
        if wrap is not None:
            factor, factor_rate = c.kappa[k], bias[k]
        t = 0.5 * h * (factor_rate * along - factor * along * out * c.turned[k])
        before = factor * (uy * cx - ux * cy)
        bias[k] = -before - factor * (gy * cx - gx * cy) - t
        c.slip[k], c.turned[k] = before, t
        if damping is not None:
            own = c.yields[k]
            inward = -out / (1.0 + 0.5 * h * own * inv_mass)
            braked = max(own * inward, -force)
            power += braked * inward
            c.normal[k] = force + braked
    for k in range(np.uint64(a), np.uint64(e)):
        force, factor = c.normal[k], 1.0
        if wrap is not None:
            factor = c.kappa[k]
        c.kappa[k], c.yields[k] = factor, body.mass / (factor * factor)
        c.forward[k], c.backward[k] = h * c.mu_forward[k] * force, h * c.mu_backward[k] * force
        acc.x[k] += inv_mass * force * c.nx[k]
        acc.y[k] += inv_mass * force * c.ny[k]
    return power


@loop
def rub_in_step(
    a: int,
    e: int,
    h: float,
    mass: float,
    before: float,
    after: float,
    acc: Accelerations,
    c: Contact,
    worn: Array | None,
) -> tuple[float, float]:
    """Add the friction of bodies a to e on a rim; return its impulse, N s, and its heat, J.

    The velocities of the rim are m/s. `slip` becomes that at the end. Each body's heat adds to
    worn.
    """
    heat = force = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        needed = c.yields[k] * (after + c.bias[k])
        t = min(max(needed, -c.backward[k]), c.forward[k])
        left = after + c.bias[k] - t / c.yields[k]
        own = 0.5 * t * (before - c.slip[k] + left + c.turned[k])
        heat += own
        if worn is not None:
            worn[k] += own
        force += t
        c.slip[k], c.friction[k], c.sticking[k] = left, t, 1.0 if t == needed else 0.0
        along = c.kappa[k] * t * (1.0 / (mass * h))
        acc.x[k] -= along * c.ny[k]
        acc.y[k] += along * c.nx[k]
    return force, heat


@loop
def power_of_dampers(body: Body, h: float, m: Motion) -> float:
    """Return the power of dampers along the belt, W: their forces with the mean velocities.

    By bodies: (D_k - D_(k+1)) . v_k - (l/2) (e_k x (D_k + D_(k+1))) phi_k', D_k of the damper.
    """
    old, acc, dx, dy, power = m.old, m.acc, m.joints.dx, m.joints.dy, 0.0
    cos, sin = m.joints.cos, m.joints.sin
    for k in range(np.uint64(body.full)):
        vx = old.vx[k] + 0.5 * h * acc.x[k]
        vy = old.vy[k] + 0.5 * h * acc.y[k]
        spin = old.spin[k] + 0.5 * h * acc.phi[k]
        lever = sin[k] * (dx[k] + dx[k + ONE]) - cos[k] * (dy[k] + dy[k + ONE])
        taken = (dx[k] - dx[k + ONE]) * vx + (dy[k] - dy[k + ONE]) * vy + body.half * lever * spin
        power += taken * (1.0 if k < np.uint64(body.n) else 0.0)
    return power


@loop
def slide_in_step(
    a: int,
    e: int,
    mass: float,
    sense: float,
    before: float,
    after: float,
    old: Array,
    new: Array,
    c: Contact,
    worn: Array | None,
) -> tuple[float, float]:
    """Add the friction of points a to e on a line; return its impulse, N s, and its heat, J."""
    force = heat = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        needed = mass * (after + c.bias[k])
        t = min(max(needed, -c.backward[k]), c.forward[k])
        v = new[k] + sense * t / mass
        left = after - sense * v
        own = 0.5 * t * (before - sense * old[k] + left)
        heat += own
        if worn is not None:
            worn[k] += own
        force += t
        new[k], c.slip[k], c.friction[k] = v, left, t
        c.sticking[k] = 1.0 if t == needed else 0.0
    return force, heat


@loop
def power_on_line(n: int, full: int, b: float, v_middle: Array, old: Array, new: Array) -> float:
    """Return the power of dampers of the velocities `v_middle`, at the mean ones, W."""
    power = 0.0
    for k in range(np.uint64(full)):
        twice = old[k + ONE] + new[k + ONE] - old[k] - new[k]
        taken = 0.5 * b * (v_middle[k + ONE] - v_middle[k]) * twice
        power += taken * (1.0 if k < np.uint64(n) else 0.0)
    return power


# --- steps ----------------------------------------------------------------------------------------


@part
def end_steps(y: Array, y_old: Array, b: Belt) -> bool:
    """Clear what closes the ring behind the last body; return whether all numbers are finite."""
    for first in range(0, b.angles, b.width):
        for k in range(first + b.n, first + b.width):
            y[k] = y_old[k] = 0.0
    total = 0.0
    for i in range(len(y)):
        total += abs(y[i])
    return total < np.inf


@kernel
def integrate(
    steps: int,
    h: float,
    distinct: bool,
    s: Steps,
    b: Belt,
    d: Any,  # Dampers or None
    damping: float | None,
    axial: float | None,
    bending: float | None,
    plane: bool | None,
    line: Line | None,
    wear: bool | None,
) -> bool:
    """Take steps of length h, s; return whether the state is finite.

    `axial` and `bending` are the dampers that are solved for, N s/m and N m s: b has none of them,
    and d room for them. `damping`, `plane`, `line` and `wear` are those of b. With `distinct`
    static friction the modes of contacts follow each step. Without a step, at the start, it
    searches for bodies near pulleys. All is written out here, as in `rhs`.
    """
    counts, y, y_old, n, w, half = s.counts, s.y, s.y_old, b.n, b.width, b.angles // 2
    kin, middle, new = y[: b.angles].reshape((b.angles // w, w)), s.middle, s.acc.reshape(half)
    q, v, works = y[:half], y[half : b.angles], b.size - b.pul.shape[1] * w
    q_middle, v_middle = middle.reshape(b.angles)[:half], middle.reshape(b.angles)[half:]
    body = Body(n, b.full, b.half, b.mass, b.inertia)
    if plane is not None:
        acc = Accelerations(s.acc[0], s.acc[1], s.acc[2])
        m = Motion(bodies_of(kin), bodies_of(middle), acc, joints_of(b.work))
    more, bias = None, b.con[row.BIAS]
    if axial is not None:
        more, bias = d, d.bias
    starts = steps == 0 and counts[STEPS] == 0
    for number in range(1 if starts else steps):
        if starts:  # modes of contacts follow the speeds
            drive(0.0, b)
        if counts[STEPS] % SEARCH_INTERVAL == 0:
            search(b, kin, plane, line, b.wrap)
        if starts:
            begin(half, h, q, v, q_middle, v_middle)
            break
        if number == steps - 1:
            copy(y[: b.angles], y_old[: b.angles])
        start_pulleys(counts[STEPS] * h, h, y, y_old, b)
        rubbed = damped = 0.0
        if plane is not None:
            damped += body_forces(middle, acc, True, b)
            for r in range(b.n_runs[0]):
                j, a, e = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2]
                rim, c, pressed = rim_of(b.pul, j), contact_of(b.con, j), b.contact_damping
                damped += press_in_step(body, a, e, h, rim, pressed, b.wrap, m, more, bias[j], c)
            damped *= h
            if bending is not None:
                twist(b.full, 1.0 / (h * b.inertia), d.torsion, acc.phi)
            if axial is not None:
                joint_rows(body, m.joints, d)
                stretch_rates(body, h, m, d)
        if line is not None:
            point_forces(middle, new, b, line)
            gain(w, h, v, new)
            if axial is None:
                press_line(h, v_middle, new, bias, b, line)
            else:
                v[n], new[n] = v[0], new[0]
                line_rates(n, b.full, 1.0 / h, v, new, b.work[row.TENSION], d)
        if axial is None:
            solve_pulleys(b)
        else:
            if not solve_dampers(h, axial, line, v_middle, new, b, d):
                counts[UNSETTLED] += 1
            damped += heat_of_dampers(n, h * axial, d.impulse)
            if plane is not None:
                add_dampers(body, h, m, d)
            if line is not None:
                twist(b.full, 1.0 / b.mass, d.impulse, new)
        if bending is not None:
            solve_bending(n, h, bending, b.inertia, m.old.spin, acc.phi, d)
            twist(b.full, 1.0 / (h * b.inertia), d.correction, acc.phi)
            damped += heat_of_dampers(n, h * bending, d.torsion)
        for r in range(b.n_runs[0]):
            j, a, e = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2]
            c, radius, worn = contact_of(b.con, j), b.pul[row.RADIUS, j], None
            before, after = radius * b.pul[row.SPEED_OLD, j], radius * b.pul[row.SPEED_NEW, j]
            if wear is not None:
                worn = y[works + j * w : works + (j + 1) * w]
            if plane is not None:
                force, heat = rub_in_step(a, e, h, b.mass, before, after, acc, c, worn)
            if line is not None:
                sense = line.senses[j]
                force, heat = slide_in_step(a, e, b.mass, sense, before, after, v, new, c, worn)
            b.pul[row.PULL, j] += force
            rubbed += heat
        if damping is not None:
            if plane is not None:
                damped += h * power_of_dampers(body, h, m)
            if line is not None:
                v[n], new[n] = v[0], new[0]
                damped += h * power_on_line(n, b.full, damping, v_middle, v, new)
        for first in range(0, half, w):  # nothing behind the last body ever moves
            for k in range(first + n, first + w):
                new[k] = v[k] = 0.0
        move(half, h, plane, q, v, new, q_middle, v_middle)
        end_pulleys(h, rubbed, damped, y, b)
        if distinct:
            update_modes(b)
        counts[STEPS] += 1
    return end_steps(y, y_old, b)


# --- the choice of a step -------------------------------------------------------------------------

# The scheme is stable for omega h < 2; where a damper takes the share r h of a velocity in a step
# and its velocity is extrapolated, for (omega + 1.1 r) h < 2 (largest eigenvalue of a step).
MAX_OMEGA_H, LOST_TO_DAMPING = 2.0, 1.1
MAX_DECAY = 0.65  # r h; beyond it less than that
DEFAULT_STEP_RATIO = 0.935  # of it is taken by default
# Contacts open and close: a bounce takes pi/omega, and some steps are to fall into it.
MAX_CONTACT_PHASE = 0.4
# Dampers whose decay in a step is beyond this are solved for; the others are extrapolated.
STIFF = 0.5
# A joint without much tension may point anywhere; its damper then meets the small inertia of the
# bodies that it turns, too much for extrapolation. Twice sin^2 of its angle with their mean
# direction measures that, 2 at most. Beyond what a step allows a damper is weakened by as much;
# where a step allows less than the other number, dampers are solved for.
ALL_OBLIQUITIES, LEAST_OBLIQUITY = 2.0, 0.1
# A damper that pulls with the force D along a joint of the tension T stiffens it across by D/T: its
# direction turns. Steps are stable for omega h sqrt(1 + D/T) < 2, so the default ratio takes
# D/T = 0.14. Dampers whose decay in a step is beyond VERY_STIFF pull harder in violent overload
# (measured 0.2 at 180, 0.9 at 3600, with up to 40 % of the energy from nowhere, and at 40 and 60
# bodies more): theirs takes 7.
VERY_STIFF, VERY_STIFF_STEP_RATIO = 100.0, 0.35
# A pulley that is lighter than a body of a line, by inertia/radius^2, follows its dampers at once:
# in overload such drives ended with speeds up to 40 % off, with a quarter of the step 0.4 %.
LIGHT_PULLEY_SHARE = 0.25
# Dampers of a line are solved for if they would shorten the steps by more than this: a step that
# does takes about as much longer.
SHORTENED = 4.0
# Seconds on one core at about 3 GHz, and more to solve for dampers; shown to users only.
COMPILE_SECONDS, COMPILE_SECONDS_OF_DAMPERS = 6.0, 4.0


class StepPlan(NamedTuple):
    """How a belt is stepped."""

    h: float  # s, the length of a step
    max_step: float  # s, below which steps are stable
    axial: float | None  # N s/m, the dampers that steps solve for
    bending: float | None  # N m s
    obliquity: float | None  # of `Belt`


def stable_step(frequency: float, decay: float) -> float:
    """Return the length below which steps are stable, s, where velocities are extrapolated."""
    return min(MAX_OMEGA_H / (frequency + LOST_TO_DAMPING * decay), MAX_DECAY / (decay + TINY))


def step_plan(belt: Belt, settings: "BeltSolverSettings", rest: Rest) -> StepPlan:
    """Return how a belt that is at rest so is stepped."""
    frequency = max_frequency(belt, rest)
    longest, axial, bending = settings.max_step or np.inf, belt.damping, belt.bend_damping
    along = 4.0 * (axial or 0.0) / belt.mass
    if belt.line is not None:
        max_step = stable_step(frequency, along)
        if axial and (settings.step or MAX_OMEGA_H / frequency / SHORTENED) >= max_step:
            max_step = MAX_OMEGA_H / frequency
        else:
            axial = None
        ratio, free = DEFAULT_STEP_RATIO, belt.pul[:, belt.free]
        if axial and np.any(free[row.INERTIA] < belt.mass * free[row.RADIUS] ** 2):
            ratio *= LIGHT_PULLEY_SHARE
        h = settings.step or min(ratio * max_step, longest)
        return StepPlan(h, max_step, axial, None, None)
    max_step, turning = MAX_OMEGA_H / frequency, 4.0 * (bending or 0.0)
    if bending and (settings.step or DEFAULT_STEP_RATIO * max_step) * turning < STIFF:
        max_step, bending = stable_step(frequency, turning), None
    very_stiff = DEFAULT_STEP_RATIO * max_step * along > VERY_STIFF
    h = settings.step or min(
        (VERY_STIFF_STEP_RATIO if very_stiff else DEFAULT_STEP_RATIO) * max_step,
        MAX_CONTACT_PHASE / float(np.sqrt(deepest_contact_stiffness(belt, rest) / belt.mass)),
        longest,
    )
    # Dampers of a body that is steep to both of its joints turn it with 6 b/m a unit of obliquity.
    spare = (MAX_OMEGA_H / h - MAX_OMEGA_H / max_step) / LOST_TO_DAMPING
    obliquity = spare / (1.5 * along + TINY)
    if h * along <= STIFF and obliquity >= LEAST_OBLIQUITY:
        axial = None
    extrapolated = axial is None and belt.damping is not None
    oblique = min(obliquity, ALL_OBLIQUITIES) if extrapolated else None
    return StepPlan(h, max_step, axial, bending * belt.inertia if bending else None, oblique)


class MoreauStepper:
    """A belt drive between two steps of a fixed length.

    Parameters
    ----------
    belt : Belt
    state : (size,)
        At the start.
    rest : Rest
        The belt at rest.
    settings : BeltSolverSettings
        `step` is the length of a step, s; left out, it is near the longest stable one.
    """

    def __init__(
        self,
        belt: Belt,
        state: Array,
        rest: Rest,
        settings: "BeltSolverSettings",
    ) -> None:
        self._plan = plan = step_plan(belt, settings, rest)
        if plan.h >= plan.max_step:
            raise InputError(
                f"solver.step: {plan.h:.4g} s is too large for the waves in the belt: 'moreau' is"
                f" stable below {plan.max_step:.4g} s here; give a smaller solver.step, or fewer"
                " bodies"
            )
        self.force_per_impulse = 1.0 / plan.h
        self._rest, self._distinct = rest, belt.distinct
        self._belt = belt
        stiff = plan.axial is not None or plan.bending is not None
        self.compile_seconds = COMPILE_SECONDS + stiff * COMPILE_SECONDS_OF_DAMPERS
        # What is solved for is no damper of the forces.
        self._stepped = belt._replace(
            damping=None if plan.axial is not None else belt.damping,
            bend_damping=None if plan.bending is not None else belt.bend_damping,
            obliquity=plan.obliquity,
        )
        rows = belt.angles // belt.width
        self._state = Steps(
            aligned(belt.size),
            aligned(belt.size),
            aligned(rows, belt.width),
            aligned(rows // 2, belt.width),
            np.zeros(2, dtype=np.int64),
        )
        self._state.y_old[:] = self._state.y[:] = state
        self._dampers = dampers_of(belt) if stiff else None

    @property
    def t(self) -> float:
        """The end of the last step, s."""
        return float(self._state.counts[STEPS] * self._plan.h)

    @property
    def statistics(self) -> tuple[int, int, int]:
        """Steps, rejected steps, right-hand sides."""
        steps = int(self._state.counts[STEPS])
        return steps, 0, steps

    @property
    def warnings(self) -> list[str]:
        """A step that is too long for dampers which pull harder than the belt; unsettled steps."""
        warnings, (h, longest, *_), belt = [], self._plan, self._belt
        stiff = 4.0 * (belt.damping or 0.0) * h / belt.mass
        if belt.line is None and stiff > VERY_STIFF and h > VERY_STIFF_STEP_RATIO * longest:
            warnings.append(
                f"solver.step = {h:.3g} s is {h / longest:.2g} of the longest stable one, and the"
                f" dampers along the belt are very stiff, 4 b h/m = {stiff:.3g}: in a violent"
                " overload the energy may be off by tens of per cent; give at most"
                f" {VERY_STIFF_STEP_RATIO * longest:.2g} s, or leave solver.step out"
            )
        unsettled = int(self._state.counts[UNSETTLED])
        if unsettled:
            warnings.append(
                f"in {unsettled} of {self._state.counts[STEPS]} steps friction and the stiff"
                " dampers along the belt did not settle; compare with solver.step ="
                f" {0.5 * h:.2g}"
            )
        return warnings

    def start(self) -> None:
        """Search for bodies near pulleys, and write the forces at rest."""
        self.compile()
        belt, rest, bodies = self._belt, self._rest, np.arange(self._belt.n)
        on = rest.pulley >= 0
        belt.con[row.NORMAL, rest.pulley[on], bodies[on]] = rest.normal_force[on]
        if belt.line is not None:
            belt.work[row.TENSION, : belt.n] = rest.tension
            belt.work[row.MIDDLE, : belt.n + 1] = np.linspace(0.0, belt.line.length, belt.n + 1)
            return
        cos, sin = np.cos(rest.angle), np.sin(rest.angle)
        for force, place, along in ((row.FX, rest.x, cos), (row.FY, rest.y, sin)):
            gap = place - np.roll(place, 1) - belt.half * (along + np.roll(along, 1))
            belt.work[force, : belt.n] = belt.stiffness * gap

    def compile(self) -> None:
        """Have the kernel compiled, by taking no step."""
        self._integrate(0)

    def advance(self, limit: float, sample: float, steps: int) -> None:
        """Step until a limit or a sample time, s, is reached or passed, or `steps` are taken."""
        ahead = (min(limit, sample) - self.t) / self._plan.h
        # A remainder of a step from rounding is no step.
        self._integrate(min(steps, max(1, int(np.ceil(ahead - 1e-6)))))

    def _integrate(self, steps: int) -> None:
        before, (h, _, axial, bending, _) = self.t, self._plan
        b, own = self._stepped, (self._distinct, self._state, self._stepped, self._dampers)
        sound = integrate(steps, h, *own, b.damping, axial, bending, b.plane, b.line, b.wear)
        if not sound:
            raise NonFinite(
                f"the state is not finite after t = {before:.9g} s; is a stiffness, a torque or a"
                f" speed of the scenario too large, or solver.step = {h:.3g} s too long?"
            )

    def interpolate(self, t: float) -> Array:
        """Return the state at a time in the last step; the forces are those of the step."""
        ratio = min(max((t - self.t) / self._plan.h + 1.0, 0.0), 1.0)
        s, pul, given = self._state, self._belt.pul, self._belt.prescribed
        if s.counts[STEPS]:  # before the first step there is no speed but that of the start
            start, end = pul[row.SPEED_OLD, given], pul[row.SPEED_NEW, given]
            pul[row.SPEED, given] = start + ratio * (end - start)
        inside: Array = s.y_old + ratio * (s.y - s.y_old)
        return inside

    def arrays(self) -> dict[str, Any]:
        """Return all that the next steps depend on, by name; writing to them restores it."""
        s, d = self._state, self._dampers
        own = {"y_old": s.y_old, "y": s.y, "middle": s.middle, "counts": s.counts}
        dampers = {"impulse": d.impulse, "vx": d.vx, "vy": d.vy, "torsion": d.torsion} if d else {}
        return {**own, **self._belt.arrays(), **dampers}
