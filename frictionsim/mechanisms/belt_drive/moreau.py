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

Dampers along the belt that are too stiff for v_m are solved for as well. With their impulses D_k as
unknowns, s_k the rate of stretch of joint k at the mean of old and new velocities, each joint meets
its two neighbours only, through the bodies between them [2]_:

    2 D_k/(h b) + (J M^-1 J^T D)_k = s_k(v) + s_k(v + h a + impulses of friction/m)

A body that sticks cannot give way along t: its inverse mass is n n^T/m, and its velocity along t
that of the rim, R omega+. The omega+ of free pulleys are unknown too, one column each. Who sticks
is as in the step before, corrected until it agrees with the limits of friction and the direction
of slip; then the friction is solved for as without dampers, with their impulses. Implicit midpoint
rule: of second order, stable at any stiffness.

On a line the tensions with their dampers press the points on the arcs: limits of friction follow
the impulses, and both are found together.

References
----------
.. [1] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988.
.. [2] W. H. Press et al., Numerical Recipes, 3rd ed., 2007, 2.7.2: cyclic tridiagonal systems.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError, NonFinite
from frictionsim.mechanisms.belt_drive import belt as row
from frictionsim.mechanisms.belt_drive.belt import Array, Belt, Indices, Line, aligned
from frictionsim.mechanisms.belt_drive.compilation import kernel, loop, part
from frictionsim.mechanisms.belt_drive.equilibrium import Rest
from frictionsim.mechanisms.belt_drive.kernels import (
    ONE,
    TINY,
    Accelerations,
    Bodies,
    Contact,
    Joints,
    Rim,
    arc_of,
    bodies_of,
    body_forces,
    contact_of,
    copy,
    drive,
    joints_of,
    point_forces,
    press_on_line,
    pulley_motion,
    rim_of,
    search,
    update_modes,
)
from frictionsim.mechanisms.belt_drive.limits import deepest_contact_stiffness, max_frequency

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltSolverSettings

SEARCH_INTERVAL = 16  # steps from one search for bodies near pulleys to the next
MAX_PASSES = 30  # of stiff dampers and friction by turns; one or two are the rule
TENSION_TOLERANCE = 1e-8  # of a correction of the tensions on a line, over their mean

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


class Body(NamedTuple):
    """What all bodies have in common: how many, also in full vectors, half a length, inertias."""

    n: int
    full: int
    half: float
    mass: float
    inertia: float


class Motion(NamedTuple):
    """Bodies at the start of a step and in its middle, and what they do there."""

    old: Bodies
    middle: Bodies
    acc: Accelerations
    joints: Joints


class Dampers(NamedTuple):
    """Rows to solve for dampers in, (width,) unless said.

    `corner` and `off` serve the elimination; `columns` are the impulses, N s, and by what they
    change with the speed of each free pulley, kg m.
    """

    ex: Array  # of joint k its direction
    ey: Array
    after: Array  # m, its lever about body k
    before: Array  # and about body k - 1
    main: Array  # 1/kg, the diagonal of the system, where nothing sticks
    link: Array  # the coupling of joints k and k + 1
    rate: Array  # m/s, twice the mean rate of stretch of joint k without its damper
    impulse: Array  # N s, of its damper
    used: Array  # that which the tensions on a line have
    p: Array  # of body k on a pulley, with t of its contact: e . t of joint k
    q: Array  # and of joint k + 1
    stuck: Array  # 1 where it sticks
    given: Array  # m/s, the velocity along t that friction adds
    inverse: Array
    off: Array
    corner: Array
    vx: Array  # m/s, what the dampers added to the velocities of bodies in the last step
    vy: Array
    spin: Array  # rad/s
    torsion: Array  # N m s, the impulses of the dampers of bending
    correction: Array  # and their change from the last step
    bias: Array  # (pulleys, width), m/s, of sticking without dampers
    columns: Array  # (1 + free, width)
    rims: Array  # (free, width), m, how the rim of each free pulley stretches the joints
    matrix: Array  # (free, free + 1), the equations of the free pulleys


DAMPER_ROWS = 21  # of one dimension


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
def solve_pulleys(b: Belt) -> None:
    """Write SPEED_NEW of free pulleys, with the friction of the bodies on them."""
    pul = b.pul
    for j in b.free:
        momentum = pul[row.INERTIA, j] * pul[row.ALPHA, j]
        pul[row.SPEED_NEW, j] = pulley_motion(j, pul[row.SPEED_NEW, j], momentum, b)


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


@part
def press_line(h: float, v: Array, new: Array, bias: Array, b: Belt, line: Line) -> None:
    """Write the normal forces of points on a line, limits of impulses, and the bias of sticking.

    v and new are the velocities in the middle of a step, and at its end without friction.
    """
    tension, middle = b.work[row.TENSION], b.work[row.MIDDLE]
    for r in range(b.n_runs[0]):
        j, a, e = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2]
        arc, c = arc_of(b, line, j, 0.0), contact_of(b.con, j)
        press_on_line(b.n, a, e, h, None, b.mass, arc, v, new, tension, middle, bias[j], c)


# --- dampers that are solved for ------------------------------------------------------------------


@loop
def joint_rows(body: Body, joints: Joints, d: Dampers) -> None:
    """Write directions and levers of the joints, and the system where nothing sticks.

    But for what a damper gives way by itself, 2/(h b).
    """
    ex, ey, after, before, cos, sin = d.ex, d.ey, d.after, d.before, joints.cos, joints.sin
    n, full, inv_mass, inv_inertia = body.n, body.full, 1.0 / body.mass, 1.0 / body.inertia
    for k in range(np.uint64(full)):
        x, y = joints.fx[k + ONE], joints.fy[k + ONE]
        inv = 1.0 / np.sqrt(x * x + y * y + TINY)
        ex[k + ONE], ey[k + ONE] = x * inv, y * inv
    ex[0], ey[0] = ex[n], ey[n]
    for k in range(np.uint64(full)):
        x, y = ex[k + ONE], ey[k + ONE]
        after[k + ONE] = body.half * (x * sin[k + ONE] - y * cos[k + ONE])
        before[k + ONE] = body.half * (y * cos[k] - x * sin[k])
    after[0], before[0] = after[n], before[n]
    for k in range(np.uint64(full)):
        d.main[k] = 2.0 * inv_mass + inv_inertia * (after[k] * after[k] + before[k] * before[k])
        lateral = inv_mass * (ex[k] * ex[k + ONE] + ey[k] * ey[k + ONE])
        d.link[k] = -lateral - inv_inertia * after[k] * before[k + ONE]
    d.main[n], d.link[n] = d.main[0], d.link[0]


@loop
def stretch_rates(body: Body, h: float, m: Motion, d: Dampers) -> None:
    """Write twice the mean rates of stretch; vx, vy, spin of d become twice the mean velocities."""
    vx, vy, spin, n, old, acc = d.vx, d.vy, d.spin, body.n, m.old, m.acc
    for k in range(np.uint64(body.full)):
        vx[k], vy[k] = 2.0 * old.vx[k] + h * acc.x[k], 2.0 * old.vy[k] + h * acc.y[k]
        spin[k] = 2.0 * old.spin[k] + h * acc.phi[k]
    vx[n], vy[n], spin[n] = vx[0], vy[0], spin[0]
    for k in range(np.uint64(body.full)):
        along = d.ex[k + ONE] * (vx[k + ONE] - vx[k]) + d.ey[k + ONE] * (vy[k + ONE] - vy[k])
        d.rate[k + ONE] = along + d.after[k + ONE] * spin[k + ONE] - d.before[k + ONE] * spin[k]


@loop
def line_rates(
    n: int, full: int, inv_h: float, old: Array, new: Array, tension: Array, d: Dampers
) -> None:
    """Write twice the mean rates of stretch; add the dampers of the last step to the tensions."""
    for k in range(np.uint64(full)):
        d.rate[k + ONE] = old[k + ONE] + new[k + ONE] - old[k] - new[k]
    for k in range(np.uint64(n) + ONE):
        tension[k] += inv_h * d.impulse[k]


@loop
def take_contacts(
    a: int, e: int, inv_mass: float, rim: float, bias: Array, c: Contact, d: Dampers
) -> None:
    """Write p, q, stuck and given of bodies a to e on one pulley.

    A body that sticks loses what it had along t and takes up `rim`, that of a prescribed speed.
    One near two pulleys is pressed by one of them: only that may write.
    """
    p, q, stuck, given, ex, ey = d.p, d.q, d.stuck, d.given, d.ex, d.ey
    for k in range(np.uint64(a), np.uint64(e)):
        pressed, hold, kappa = c.forward[k] + c.backward[k] > 0.0, c.sticking[k] > 0.0, c.kappa[k]
        x, y = ey[k] * c.nx[k] - ex[k] * c.ny[k], ey[k + ONE] * c.nx[k] - ex[k + ONE] * c.ny[k]
        g = (rim + bias[k]) / kappa if hold else kappa * c.friction[k] * inv_mass
        p[k], q[k] = x if pressed else p[k], y if pressed else q[k]
        stuck[k], given[k] = c.sticking[k] if pressed else stuck[k], g if pressed else given[k]


@loop
def pulled(a: int, e: int, inv_mass: float, bias: Array, c: Contact, d: Dampers) -> None:
    """Write the bias of sticking with dampers, from that without."""
    for k in range(np.uint64(a), np.uint64(e)):
        along = d.impulse[k + ONE] * d.q[k] - d.impulse[k] * d.p[k]
        c.bias[k] = bias[k] - c.kappa[k] * inv_mass * along


@loop
def guess(a: int, e: int, rim: float, bias: Array, c: Contact) -> None:
    """Have bodies a to e stick if they did and are pressed, or slide as they did, at the limit."""
    for k in range(np.uint64(a), np.uint64(e)):
        way = rim + bias[k] if c.friction[k] == 0.0 else c.friction[k]
        c.friction[k] = c.forward[k] if way > 0.0 else -c.backward[k]
        c.sticking[k] *= 1.0 if c.forward[k] + c.backward[k] > 0.0 else 0.0


@loop
def correct(a: int, e: int, rim: float, c: Contact) -> float:
    """Correct who sticks of bodies a to e, and their friction; return how many change.

    What sticks and needs more than its limit slides; what was to slide and did so along its
    friction sticks: it may not turn round, or bodies that are tied by stiff dampers went to and
    fro for ever. What is not pressed does not stick, though its friction, none, is within limits.
    """
    changed = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        needed, low, high = c.yields[k] * (rim + c.bias[k]), -c.backward[k], c.forward[k]
        friction = c.friction[k]
        limited = min(max(needed, low), high)
        within = 1.0 if limited == needed and high - low > 0.0 else 0.0
        turned = 1.0 if (needed - friction) * friction < 0.0 else 0.0
        way = needed if friction == 0.0 else friction
        limit = high if way > 0.0 else low
        stuck = c.sticking[k] > 0.0
        sticking = within if stuck else turned
        changed += abs(sticking - c.sticking[k])
        c.friction[k], c.sticking[k] = limited if stuck else limit, sticking
    return changed


@loop
def rim_rows(a: int, e: int, radius: float, c: Contact, d: Dampers, rim: Array) -> None:
    """Add how the rim of a pulley stretches the joints of bodies a to e, which stick to it."""
    for k in range(np.uint64(a), np.uint64(e)):
        rim[k] += c.sticking[k] * radius / c.kappa[k] * d.p[k]
    for k in range(np.uint64(a), np.uint64(e)):
        rim[k + ONE] -= c.sticking[k] * radius / c.kappa[k] * d.q[k]


@loop
def held(a: int, e: int, bias: Array, c: Contact) -> tuple[float, float]:
    """Return the mass of what sticks, kg, and what it and what slides takes from a pulley, N s."""
    mass = need = 0.0
    for k in range(np.uint64(a), np.uint64(e)):
        own = c.sticking[k]
        mass += own * c.yields[k]
        need += own * c.yields[k] * bias[k] + (1.0 - own) * c.friction[k]
    return mass, need


@loop
def dot(n: int, u: Array, v: Array) -> float:
    """Return the sum of products over the joints."""
    total = 0.0
    for k in range(ONE, np.uint64(n) + ONE):
        total += u[k] * v[k]
    return total


@loop
def add_times(n: int, factor: float, u: Array, v: Array) -> None:
    """Add a multiple of u to v."""
    for k in range(np.uint64(n) + ONE):
        v[k] += factor * u[k]


@part
def eliminate(n: int, own: float, inv_mass: float, d: Dampers) -> None:
    """Solve the cyclic tridiagonal system for all columns [2]_.

    Body 0, which couples joints n and 1, is a change of rank one of a plain system. The rows are
    made on the way: each division waits for the one before it, and there is time.
    """
    main, link, p, q, stuck, given, rate = d.main, d.link, d.p, d.q, d.stuck, d.given, d.rate
    inverse, off, corner, columns = d.inverse, d.off, d.corner, d.columns
    x, last = columns[0], np.uint64(n)
    edge = link[0] + inv_mass * stuck[0] * p[0] * q[0]
    diagonal = own + (main[1] - inv_mass * (stuck[1] * p[1] * p[1] + stuck[0] * q[0] * q[0]))
    inverse[1], corner[1], gamma = 0.5 / diagonal, -diagonal, -diagonal
    x[1] = rate[1] + p[1] * given[1] - q[0] * given[0]
    for k in range(np.uint64(2), last + ONE):
        b = k - ONE
        o = link[b] + inv_mass * stuck[b] * p[b] * q[b]
        free = stuck[k] * p[k] * p[k] + stuck[b] * q[b] * q[b]
        diagonal = own + (main[k] - inv_mass * free)
        diagonal -= edge * edge / gamma if k == last else 0.0
        factor = o * inverse[b]
        inverse[k], off[b] = 1.0 / (diagonal - o * o * inverse[b]), o
        corner[k] = (edge if k == last else 0.0) - factor * corner[b]
        x[k] = rate[k] + p[k] * given[k] - q[b] * given[b] - factor * x[b]
        for i in range(1, len(columns)):
            columns[i, k] -= factor * columns[i, b]
    corner[n] *= inverse[n]
    for i in range(len(columns)):
        columns[i, n] *= inverse[n]
    for back in range(ONE, last):
        b = last - back
        corner[b] = (corner[b] - off[b] * corner[b + ONE]) * inverse[b]
        for i in range(len(columns)):
            columns[i, b] = (columns[i, b] - off[b] * columns[i, b + ONE]) * inverse[b]
    below = 1.0 + corner[1] + edge * corner[n] / gamma
    for i in range(len(columns)):
        share = (columns[i, 1] + edge * columns[i, n] / gamma) / below
        for k in range(ONE, last + ONE):
            columns[i, k] -= share * corner[k]
        columns[i, 0] = columns[i, n]


@part
def rim_columns(b: Belt, d: Dampers) -> None:
    """Write how the rims of free pulleys stretch the joints of what sticks to them."""
    for i in range(len(b.free)):
        j, rim = b.free[i], d.rims[i]
        for k in range(b.width):
            rim[k] = 0.0
        for r in range(b.n_runs[0]):
            if b.runs[r, 0] == j:
                rim_rows(
                    b.runs[r, 1], b.runs[r, 2], b.pul[row.RADIUS, j], contact_of(b.con, j), d, rim
                )
        rim[b.n] += rim[0]
        copy(rim, d.columns[1 + i])


@part
def solve_rims(b: Belt, d: Dampers) -> None:
    """Write SPEED_NEW of free pulleys with what sticks to them; add their columns to the first.

        I omega+ + R sum m/kappa^2 (R omega+ + bias) - rim . D = I omega - R sum friction

    The system is symmetric and positive definite: it needs no pivots.
    """
    pul, m, free = b.pul, d.matrix, len(b.free)
    for i in range(free):
        j = b.free[i]
        for c in range(free):
            m[i, c] = dot(b.n, d.rims[i], d.columns[1 + c])
        m[i, i] += pul[row.INERTIA, j]
        m[i, free] = pul[row.INERTIA, j] * pul[row.ALPHA, j] - dot(b.n, d.rims[i], d.columns[0])
        for r in range(b.n_runs[0]):
            if b.runs[r, 0] == j:
                mass, need = held(b.runs[r, 1], b.runs[r, 2], d.bias[j], contact_of(b.con, j))
                m[i, i] += pul[row.RADIUS, j] ** 2 * mass
                m[i, free] -= pul[row.RADIUS, j] * need
    for i in range(free):
        for below in range(i + 1, free):
            share = m[below, i] / m[i, i]
            for c in range(i, free + 1):
                m[below, c] -= share * m[i, c]
    for i in range(free - 1, -1, -1):
        for c in range(i + 1, free):
            m[i, free] -= m[i, c] * m[c, free]
        m[i, free] /= m[i, i]
        pul[row.SPEED_NEW, b.free[i]] = m[i, free]
        add_times(b.n, m[i, free], d.columns[1 + i], d.columns[0])


@part
def gather_contacts(b: Belt, d: Dampers) -> None:
    """Write what the system takes of the contacts, by bodies."""
    pul, n = b.pul, b.n
    for k in range(b.width):
        d.p[k] = d.q[k] = d.stuck[k] = d.given[k] = 0.0
    for r in range(b.n_runs[0]):
        j, a, e = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2]
        rim = pul[row.FIXED, j] * pul[row.RADIUS, j] * pul[row.SPEED_NEW, j]
        take_contacts(a, e, 1.0 / b.mass, rim, d.bias[j], contact_of(b.con, j), d)
    d.p[n], d.q[n], d.stuck[n], d.given[n] = d.p[0], d.q[0], d.stuck[0], d.given[0]


@loop
def correct_tensions(n: int, inv_h: float, new: Array, used: Array, tension: Array) -> bool:
    """Have the tensions the new impulses of dampers if these are off; return whether they were.

    If not, the limits of friction stay those that the impulses were found with: the dampers are
    stiff, and what they are not told of would come back to them a step later.
    """
    off = size = 0.0
    for k in range(np.uint64(n)):
        off += abs(new[k] - used[k])
        size += abs(tension[k])
    anew = inv_h * off > TENSION_TOLERANCE * size
    if anew:
        for k in range(np.uint64(n) + ONE):
            tension[k] += inv_h * (new[k] - used[k])
            used[k] = new[k]
    return anew


@part
def solve_dampers(
    h: float,
    axial: float,
    line: Line | None,
    v_middle: Array,
    v_new: Array,
    s: Steps,
    b: Belt,
    d: Dampers,
) -> None:
    """Solve for dampers along the belt and for friction by turns; write impulse and SPEED_NEW.

    Reads the rows of the joints, `bias` and, in the plane, the limits of the friction. On a `line`
    these follow the tensions, which have the impulses that are known. The friction comes last: the
    momentum of pulleys and bodies is kept whatever became of the dampers.
    """
    pul, anew, changed = b.pul, True, 1.0
    copy(d.impulse, d.used)
    for number in range(MAX_PASSES + 1):
        if number > 0:
            gather_contacts(b, d)
            rim_columns(b, d)
            eliminate(b.n, 2.0 / (h * axial), 1.0 / b.mass, d)
            solve_rims(b, d)
            if line is not None:
                anew = correct_tensions(b.n, 1.0 / h, d.columns[0], d.used, b.work[row.TENSION])
            copy(d.columns[0], d.impulse)
        changed = 1.0 if number == 0 else 0.0
        if line is not None and anew:
            press_line(h, v_middle, v_new, d.bias, b, line)
            changed = 1.0
        for r in range(b.n_runs[0]):
            j, a, e, c = b.runs[r, 0], b.runs[r, 1], b.runs[r, 2], contact_of(b.con, b.runs[r, 0])
            rim = pul[row.RADIUS, j] * pul[row.SPEED_NEW, j]
            if number == 0:
                guess(a, e, rim, d.bias[j], c)
            else:
                pulled(a, e, 1.0 / b.mass, d.bias[j], c, d)
                changed += correct(a, e, rim, c)
        if changed == 0.0:
            break
    if changed > 0.0:
        s.counts[UNSETTLED] += 1
    solve_pulleys(b)


@loop
def give_way(body: Body, h: float, m: Motion, d: Dampers) -> None:
    """Add the dampers along the belt to the forces of joints and to the accelerations."""
    impulse, inv_h, full, acc, joints = d.impulse, 1.0 / h, body.full, m.acc, m.joints
    inv_mass, inv_inertia = 1.0 / body.mass, 1.0 / body.inertia
    for k in range(np.uint64(full)):
        d0, d1 = impulse[k], impulse[k + ONE]
        d.vx[k] = inv_mass * (d1 * d.ex[k + ONE] - d0 * d.ex[k])
        d.vy[k] = inv_mass * (d1 * d.ey[k + ONE] - d0 * d.ey[k])
        d.spin[k] = inv_inertia * (d1 * d.before[k + ONE] - d0 * d.after[k])
    for k in range(np.uint64(full)):
        acc.x[k] += inv_h * d.vx[k]
        acc.y[k] += inv_h * d.vy[k]
        acc.phi[k] += inv_h * d.spin[k]
    for k in range(np.uint64(body.n) + ONE):
        joints.fx[k] += inv_h * impulse[k] * d.ex[k]
        joints.fy[k] += inv_h * impulse[k] * d.ey[k]


@loop
def twist(full: int, by: float, torsion: Array, spin: Array) -> None:
    """Add to bodies what torsion does to them."""
    for k in range(np.uint64(full)):
        spin[k] += by * (torsion[k + ONE] - torsion[k])


@loop
def solve_bending(
    n: int, h: float, bending: float, inertia: float, spin: Array, aphi: Array, d: Dampers
) -> None:
    """Correct the impulses of the dampers of bending by what was not known of the spins.

        2 T_k/(h b) + (2 T_k - T_(k-1) - T_(k+1))/I = phi'_k - phi'_(k-1), twice the mean

    is solved for the change of T by two recursions: with E T_k = T_(k+1) the left side is
    (1 - z/E) (1 - z E) T/(z I), z < 1. Each begins with what a whole round leaves.
    """
    x, twice, last = d.correction, d.given, np.uint64(n)
    for k in range(last):
        twice[k] = 2.0 * spin[k] + h * aphi[k]
    twice[n] = twice[0]
    own = 2.0 / (h * bending)
    middle = 1.0 + 0.5 * own * inertia
    z = 1.0 / (middle + np.sqrt(middle * middle - 1.0))
    for k in range(last):
        x[k + ONE] = z * inertia * (twice[k + ONE] - twice[k] - own * d.torsion[k + ONE])
    before = after = 0.0
    for k in range(ONE, last + ONE):
        before = z * before + x[k]
    before /= 1.0 - z**n
    for k in range(ONE, last + ONE):
        before = z * before + x[k]
        x[k] = before
    for k in range(last):
        after = z * after + x[last - k]
    after /= 1.0 - z**n
    for k in range(last):
        after = z * after + x[last - k]
        x[last - k] = after
    x[0] = x[n]
    for k in range(last + ONE):
        d.torsion[k] += x[k]


@loop
def heat_of_dampers(n: int, coefficient: float, impulse: Array) -> float:
    """Return the heat of dampers of these impulses in a step, D^2/(h b), J, for h b."""
    heat = 0.0
    for k in range(np.uint64(n)):
        heat += impulse[k] * impulse[k]
    return heat / coefficient


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
            solve_dampers(h, axial, line, v_middle, new, s, b, d)
            damped += heat_of_dampers(n, h * axial, d.impulse)
            if plane is not None:
                give_way(body, h, m, d)
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
        b, s, d = self._belt, self._state, self._dampers
        own = {"y_old": s.y_old, "y": s.y, "middle": s.middle, "counts": s.counts}
        contacts = {"contacts": b.con, "pulleys": b.pul, "runs": b.runs, "run_count": b.n_runs}
        if d is None:
            return {**own, **contacts}
        dampers = {"impulse": d.impulse, "vx": d.vx, "vy": d.vy, "torsion": d.torsion}
        return {**own, **contacts, **dampers}


def dampers_of(belt: Belt) -> Dampers:
    """Return room to solve for dampers in; that of a line has joints of one direction."""
    pulleys, free, width = belt.pul.shape[1], len(belt.free), belt.width
    tables = aligned(pulleys, width), aligned(1 + free, width), aligned(free, width)
    d = Dampers._make([*aligned(DAMPER_ROWS, width), *tables, np.zeros((free, free + 1))])
    if belt.line is not None:
        d.ex[:], d.main[:], d.link[:] = 1.0, 2.0 / belt.mass, -1.0 / belt.mass
        # In the frame of the belt, whose first axis is along it: t points along it or against.
        belt.con[row.NY], belt.con[row.KAPPA] = -belt.line.senses[:, None], 1.0
    return d
