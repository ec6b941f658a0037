"""Dampers along a belt that fixed steps solve for, together with friction.

They are too stiff for the velocities that `moreau` extrapolates, whose symbols these are. With the
impulses D_k of the dampers as unknowns and s_k(v) the rate of stretch of joint k at velocities v,
each joint meets its two neighbours only, through the bodies between them [1]_:

    2 D_k/(h b) + (J M^-1 J^T D)_k = s_k(v) + s_k(v + h a + impulses of friction/m)

A body that sticks cannot yield along t: its inverse mass is n n^T/m, and its velocity along t
that of the rim, R omega+. The omega+ of free pulleys are unknown too, one column each. Who sticks
is as in the step before, corrected until it agrees with the limits of friction and the direction
of slip; then the friction is solved for as without dampers, with their impulses. Implicit midpoint
rule: of second order, stable at any stiffness.

On a line the tensions with their dampers press the points on the arcs: limits of friction follow
the impulses, and both are found together.

References
----------
.. [1] W. H. Press et al., Numerical Recipes, 3rd ed., 2007, 2.7.2: cyclic tridiagonal systems.
"""

from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive import belt as row
from frictionsim.mechanisms.belt_drive.belt import Array, Belt, Line, aligned
from frictionsim.mechanisms.belt_drive.compilation import loop, part
from frictionsim.mechanisms.belt_drive.kernels import (
    ONE,
    TINY,
    Accelerations,
    Bodies,
    Contact,
    Joints,
    arc_of,
    contact_of,
    copy,
    press_on_line,
    pulley_motion,
)

MAX_PASSES = 30  # of stiff dampers and friction by turns; one or two are the rule
TENSION_TOLERANCE = 1e-8  # of a correction of the tensions on a line, over their mean


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


@part
def solve_pulleys(b: Belt) -> None:
    """Write SPEED_NEW of free pulleys, with the friction of the bodies on them."""
    pul = b.pul
    for j in b.free:
        momentum = pul[row.INERTIA, j] * pul[row.ALPHA, j]
        pul[row.SPEED_NEW, j] = pulley_motion(j, pul[row.SPEED_NEW, j], momentum, b)


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


# --- the system -----------------------------------------------------------------------------------


@loop
def joint_rows(body: Body, joints: Joints, d: Dampers) -> None:
    """Write directions and levers of the joints, and the system where nothing sticks.

    But for the compliance of the damper itself, 2/(h b).
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
    """Solve the cyclic tridiagonal system for all columns [1]_.

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

        I omega+ + R sum m/kappa^2 (R omega+ + bias) + rim . D = I omega - R sum friction

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
    stiff, and a change that they do not see would return a step later.
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
    b: Belt,
    d: Dampers,
) -> bool:
    """Solve for dampers along the belt and for friction by turns; return whether both settled.

    Writes impulse and SPEED_NEW.
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
    solve_pulleys(b)
    return changed == 0.0


@loop
def add_dampers(body: Body, h: float, m: Motion, d: Dampers) -> None:
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
