"""Stiff damping along the belt and friction on its pulleys, solved for together in one step.

Damping per section grows with the number of bodies until it is far stiffer than the waves. With
the damper impulses D_k = h b s_k as unknowns, s_k the rate of stretch of joint k at the mean of the
old and new velocities, each joint meets its two neighbours only, through the bodies between them:

    2 D_k/(h b) + (J M^-1 J^T D)_k = s_k(v) + s_k(v + h a + impulses of friction/m)

is a cyclic tridiagonal system [1]_. A body that sticks cannot give way along t: its inverse mass
is n n^T/m, and its velocity along t that of the rim, R omega+. The pulleys' omega+ stand in the
right-hand side, one column each, and follow from the equations of the pulleys. The set of sticking
bodies starts as that of the step before and is corrected until it agrees with |P| <= mu N h and
with the direction of the slip. Implicit midpoint rule: of second order, stable at any stiffness.

References
----------
.. [1] W. H. Press et al., Numerical Recipes, 3rd ed., 2007, 2.7.2: cyclic tridiagonal systems.
.. [2] K. G. Murty, "Note on a Bard-type scheme for solving the complementarity problem", Opsearch
   11, 1974.
"""

from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.axial import TINY
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, shared_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    BACKWARD_LIMIT,
    COS,
    FORCE_X,
    FORCE_Y,
    FORWARD_LIMIT,
    FRICTION,
    INERTIA,
    NX,
    NY,
    PULLEY_RADIUS,
    RADIUS,
    SIN,
    SPIN,
    STICK_BIAS,
    STICKING,
    VX,
    VY,
    Array,
    Chain,
    Contacts,
    Pulleys,
    System,
    aligned_zeros,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import mass_ratio, over_factor, times_factor

# Iterations of the sticking set, usually one or two. Changing all wrong bodies at once may cycle;
# changing only the first one, Murty's rule, terminates [2]_.
MAX_BLOCK_ITERATIONS, MAX_ACTIVE_SET_ITERATIONS = 10, 1000

# Rows over joints: direction, levers of the ends about the bodies before and after, the matrix,
# its elimination, the rates of stretch; then over bodies: t, 1 where it sticks, P/m.
EX, EY, LEVER_BEFORE, LEVER_AFTER, DIAGONAL, OFF_DIAGONAL, FACTOR, CORNER, RATE = range(9)
TX, TY, STICKING_BODY, IMPULSE_OVER_MASS = range(9, 13)
# ... and the velocities that the dampers gave the bodies in the last step, m/s.
DAMPING_DVX, DAMPING_DVY = range(13, 15)
ROWS = 15


class StiffDamping(NamedTuple):
    """The coefficient of a joint, N s/m, and arrays to solve the system in.

    `table` is (15, width); `columns` (1 + np, width) the right-hand sides and then the solutions;
    `matrix` (np, np + 1) the equations of the pulleys.
    """

    coefficient: float
    table: Array
    columns: Array
    matrix: Array


def stiff_damping(coefficient: float, width: int, pulleys: int) -> StiffDamping:
    """Return the damping of joints with arrays to solve for it."""
    return StiffDamping(
        coefficient,
        aligned_zeros(ROWS, width),
        aligned_zeros(1 + pulleys, width),
        np.zeros((pulleys, pulleys + 1)),
    )


@shared_kernel
def solve_damping_and_friction(
    h: float, old: Array, new: Array, damping: StiffDamping, system: System
) -> float:
    """Solve for the impulses of dampers and friction; add those of dampers to the new velocities.

    Reads SLIP, which is v . t before, STICK_BIAS, -v* . t, and the limits; ALPHA, the speeds that
    the pulleys would have, and writes it, FRICTION and STICKING. Return the heat of the dampers.
    """
    chain, contacts, pulleys = system.chain, system.contacts, system.pulleys
    joint_kinematics(old, new, chain, system.workspace, damping)
    initial_friction(contacts, pulleys)
    for i in range(MAX_ACTIVE_SET_ITERATIONS):
        solve_with_active_set(h, chain, contacts, pulleys, damping)
        if not update_active_set(i, chain, contacts, pulleys, damping):
            break
    store_new_speeds(pulleys, damping)
    return apply_impulses(h, new, chain, system.workspace, damping)


@inline_kernel
def solve_with_active_set(
    h: float, chain: Chain, contacts: Contacts, pulleys: Pulleys, damping: StiffDamping
) -> None:
    """Solve for the impulses of dampers and the speeds of pulleys, given the sticking set.

    Reads RATE, directions and levers of the joints. Writes the impulses into the first row of the
    columns, the speeds into the last column of the matrix.
    """
    count = pulleys.table.shape[1]
    assemble_contact_rows(contacts, count, chain, damping)
    assemble_system(h, chain, contacts, pulleys, damping)
    solve_cyclic(chain.bodies, 1 + count, damping)
    solve_pulley_speeds(chain, contacts, pulleys, damping)


@inline_kernel
def store_new_speeds(pulleys: Pulleys, damping: StiffDamping) -> None:
    """Write the speeds of the solution into ALPHA."""
    count = pulleys.table.shape[1]
    for j in range(count):
        pulleys.table[ALPHA, j] = damping.matrix[j, count]


@inline_kernel
def expected_damping(damping: StiffDamping | None, i: int) -> tuple[float, float]:
    """Return the expected change of the velocity of body i by the dampers in a step, m/s."""
    if damping is not None:
        return damping.table[DAMPING_DVX, i], damping.table[DAMPING_DVY, i]
    return 0.0, 0.0


@inline_kernel
def reset_damping_prediction(damping: StiffDamping | None) -> None:
    """Reset the expected damping to zero."""
    if damping is not None:
        damping.table[DAMPING_DVX, :] = 0.0
        damping.table[DAMPING_DVY, :] = 0.0


@inline_kernel
def joint_kinematics(
    before: Array, after: Array, chain: Chain, workspace: Array, damping: StiffDamping
) -> None:
    """Write directions, levers and rates of stretch of the joints."""
    n, half, table = chain.bodies, 0.5 * chain.length, damping.table
    cos, sin = workspace[COS], workspace[SIN]
    for k in range(n):
        x, y = workspace[FORCE_X, k], workspace[FORCE_Y, k]
        inv = 1.0 / np.sqrt(x * x + y * y + TINY)
        ex, ey = x * inv, y * inv
        b = k - 1 if k > 0 else n - 1
        table[EX, k], table[EY, k] = ex, ey
        table[LEVER_AFTER, k] = half * (ex * sin[k] - ey * cos[k])
        table[LEVER_BEFORE, k] = half * (ey * cos[b] - ex * sin[b])
        vx = before[VX, k] + after[VX, k] - before[VX, b] - after[VX, b]
        vy = before[VY, k] + after[VY, k] - before[VY, b] - after[VY, b]
        table[RATE, k] = (
            ex * vx
            + ey * vy
            + table[LEVER_AFTER, k] * (before[SPIN, k] + after[SPIN, k])
            - table[LEVER_BEFORE, k] * (before[SPIN, b] + after[SPIN, b])
        )


@inline_kernel
def initial_friction(contacts: Contacts, pulleys: Pulleys) -> None:
    """Write the friction of the bodies that slide: at its limit, against the slip so far.

    A contact without load does not stick.
    """
    contact = contacts.table
    for j in range(pulleys.table.shape[1]):
        rim = pulleys.table[PULLEY_RADIUS, j] * pulleys.table[ALPHA, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            contact[FRICTION, s] = limit_towards(contact, s, rim + contact[STICK_BIAS, s])
            if not is_loaded(contact, s):
                contact[STICKING, s] = 0.0


@inline_kernel
def is_loaded(contact: Array, s: int) -> bool:
    """Return whether a contact can have friction; a body may be a candidate of two pulleys."""
    return contact[FORWARD_LIMIT, s] + contact[BACKWARD_LIMIT, s] > 0.0


@inline_kernel
def limit_towards(contact: Array, s: int, direction: float) -> float:
    """Return the limit of the friction of a contact that has the sign of a direction."""
    return contact[FORWARD_LIMIT, s] if direction > 0.0 else -contact[BACKWARD_LIMIT, s]


@inline_kernel
def assemble_contact_rows(
    contacts: Contacts, count: int, chain: Chain, damping: StiffDamping
) -> None:
    """Write for every body whether it sticks, where t is, and its impulse over its mass."""
    table, contact = damping.table, contacts.table
    for row in (TX, TY, STICKING_BODY, IMPULSE_OVER_MASS):
        table[row, :] = 0.0
    for s in range(contacts.offsets[count]):
        if is_loaded(contact, s):
            i = contacts.body[s]
            table[TX, i], table[TY, i] = -contact[NY, s], contact[NX, s]
            table[STICKING_BODY, i] = contact[STICKING, s]
            # A body that sticks loses what it had along t; the rim's velocity comes by a column.
            table[IMPULSE_OVER_MASS, i] = (
                over_factor(contacts.wrap, s, contact[STICK_BIAS, s])
                if contact[STICKING, s] > 0.0
                else times_factor(contacts.wrap, s, contact[FRICTION, s]) / chain.mass
            )


@inline_kernel
def assemble_system(
    h: float, chain: Chain, contacts: Contacts, pulleys: Pulleys, damping: StiffDamping
) -> None:
    """Write the system: its matrix, and a right-hand side for the rest and one for each pulley."""
    n, table, columns = chain.bodies, damping.table, damping.columns
    ex, ey, tx, ty, sticking_body = table[EX], table[EY], table[TX], table[TY], table[STICKING_BODY]
    own = 2.0 / (h * damping.coefficient)
    inv_mass, inv_inertia = 1.0 / chain.mass, 1.0 / chain.inertia
    for k in range(n):
        b = k - 1 if k > 0 else n - 1
        a = k + 1 if k < n - 1 else 0
        own_end, other_end = ex[k] * tx[k] + ey[k] * ty[k], ex[k] * tx[b] + ey[k] * ty[b]
        after, before = table[LEVER_AFTER, k], table[LEVER_BEFORE, k]
        free = 2.0 - sticking_body[k] * own_end * own_end - sticking_body[b] * other_end * other_end
        table[DIAGONAL, k] = own + inv_mass * free
        table[DIAGONAL, k] += inv_inertia * (after * after + before * before)
        lateral = ex[k] * ex[a] + ey[k] * ey[a]
        lateral -= sticking_body[k] * own_end * (ex[a] * tx[k] + ey[a] * ty[k])
        table[OFF_DIAGONAL, k] = -inv_mass * lateral - inv_inertia * after * table[LEVER_BEFORE, a]
        columns[0, k] = (
            table[RATE, k]
            + own_end * table[IMPULSE_OVER_MASS, k]
            - other_end * table[IMPULSE_OVER_MASS, b]
        )
    columns[1:, :] = 0.0
    for j in range(pulleys.table.shape[1]):
        radius = pulleys.table[PULLEY_RADIUS, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            if contacts.table[RADIUS, s] > 0.0 and contacts.table[STICKING, s] > 0.0:
                i = contacts.body[s]
                a = i + 1 if i < n - 1 else 0
                rim = over_factor(contacts.wrap, s, radius)
                columns[1 + j, i] += rim * (ex[i] * tx[i] + ey[i] * ty[i])
                columns[1 + j, a] -= rim * (ex[a] * tx[i] + ey[a] * ty[i])


@inline_kernel
def solve_cyclic(n: int, count: int, damping: StiffDamping) -> None:
    """Solve the cyclic tridiagonal system for all right-hand sides, in their place."""
    table, columns = damping.table, damping.columns
    diagonal, off_diagonal, factor, corner = (
        table[DIAGONAL],
        table[OFF_DIAGONAL],
        table[FACTOR],
        table[CORNER],
    )
    # The corner couples the first and the last joint: a rank-one change of a plain system.
    edge, gamma = off_diagonal[n - 1], -diagonal[0]
    diagonal[0] -= gamma
    diagonal[n - 1] -= edge * edge / gamma
    corner[0:n] = 0.0
    corner[0], corner[n - 1] = gamma, edge
    diagonal[0] = 1.0 / diagonal[0]
    # All right-hand sides at a time: each waits for its own row before, not for the others.
    for k in range(1, n):
        factor[k] = off_diagonal[k - 1] * diagonal[k - 1]
        diagonal[k] = 1.0 / (diagonal[k] - factor[k] * off_diagonal[k - 1])
        corner[k] -= factor[k] * corner[k - 1]
        for c in range(count):
            columns[c, k] -= factor[k] * columns[c, k - 1]
    off_diagonal[n - 1] = 0.0
    for k in range(n - 1, -1, -1):
        corner[k] = (corner[k] - off_diagonal[k] * corner[k + 1]) * diagonal[k]
        for c in range(count):
            columns[c, k] = (columns[c, k] - off_diagonal[k] * columns[c, k + 1]) * diagonal[k]
    below = 1.0 + corner[0] + edge * corner[n - 1] / gamma
    for c in range(count):
        x = columns[c]
        share = (x[0] + edge * x[n - 1] / gamma) / below
        for k in range(n):
            x[k] -= share * corner[k]


@inline_kernel
def tangential_impulse(i: int, n: int, table: Array, x: Array) -> float:
    """Return the change of body i along t by the impulses x of its two joints."""
    a = i + 1 if i < n - 1 else 0
    return x[a] * (table[EX, a] * table[TX, i] + table[EY, a] * table[TY, i]) - x[i] * (
        table[EX, i] * table[TX, i] + table[EY, i] * table[TY, i]
    )


@inline_kernel
def solve_pulley_speeds(
    chain: Chain, contacts: Contacts, pulleys: Pulleys, damping: StiffDamping
) -> None:
    """Solve for the new speeds of the free pulleys, and gather the impulses of the dampers."""
    n, table, columns, matrix = chain.bodies, damping.table, damping.columns, damping.matrix
    pulley, count = pulleys.table, pulleys.table.shape[1]
    matrix[:, :] = 0.0
    for j in range(count):
        matrix[j, j] = 1.0
        matrix[j, count] = pulley[ALPHA, j]
    for j in pulleys.free:
        radius = pulley[PULLEY_RADIUS, j]
        inv = radius / pulley[INERTIA, j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            if contacts.table[STICKING, s] > 0.0:
                i = contacts.body[s]
                mass = chain.mass * mass_ratio(contacts.wrap, s)
                own = over_factor(contacts.wrap, s, inv)
                matrix[j, j] += inv * mass * radius
                matrix[j, count] -= inv * mass * contacts.table[STICK_BIAS, s]
                matrix[j, count] += own * tangential_impulse(i, n, table, columns[0])
                for other in range(count):
                    matrix[j, other] -= own * tangential_impulse(i, n, table, columns[1 + other])
            else:
                matrix[j, count] -= inv * contacts.table[FRICTION, s]
    for j in range(count):
        for row in range(j + 1, count):
            share = matrix[row, j] / matrix[j, j]
            for c in range(j, count + 1):
                matrix[row, c] -= share * matrix[j, c]
    for j in range(count - 1, -1, -1):
        for c in range(j + 1, count):
            matrix[j, count] -= matrix[j, c] * matrix[c, count]
        matrix[j, count] /= matrix[j, j]
    for j in range(count):
        for k in range(n):
            columns[0, k] += matrix[j, count] * columns[1 + j, k]


@inline_kernel
def update_active_set(
    iteration: int, chain: Chain, contacts: Contacts, pulleys: Pulleys, damping: StiffDamping
) -> bool:
    """Write the friction, release or hold bodies where it contradicts its law.

    Return whether it did: all of them, or the first one after many iterations. FRICTION of a body
    that slides is its limit in the direction that it was found to slide in.
    """
    n, table = chain.bodies, damping.table
    contact, changed = contacts.table, False
    count = pulleys.table.shape[1]
    for j in range(count):
        rim = pulleys.table[PULLEY_RADIUS, j] * damping.matrix[j, count]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            if contact[RADIUS, s] == 0.0:
                continue
            pulled = tangential_impulse(contacts.body[s], n, table, damping.columns[0])
            pulled = over_factor(contacts.wrap, s, pulled)
            mass = chain.mass * mass_ratio(contacts.wrap, s)
            if contact[STICKING, s] > 0.0:
                needed = mass * (rim + contact[STICK_BIAS, s]) - pulled
                if -contact[BACKWARD_LIMIT, s] <= needed <= contact[FORWARD_LIMIT, s]:
                    contact[FRICTION, s] = needed
                else:
                    contact[FRICTION, s] = limit_towards(contact, s, needed)
                    contact[STICKING, s] = 0.0
                    changed = True
            else:
                slip = rim + contact[STICK_BIAS, s] - (contact[FRICTION, s] + pulled) / mass
                if slip * contact[FRICTION, s] < 0.0:
                    contact[STICKING, s] = 1.0
                    changed = True
            if changed and iteration >= MAX_BLOCK_ITERATIONS:
                return True
    return changed


@inline_kernel
def apply_impulses(
    h: float, after: Array, chain: Chain, workspace: Array, damping: StiffDamping
) -> float:
    """Add the impulses of the dampers to velocities and pull; return their heat."""
    n, table, impulse = chain.bodies, damping.table, damping.columns[0]
    inv_mass, inv_inertia = 1.0 / chain.mass, 1.0 / chain.inertia
    heat = 0.0
    for k in range(n):
        a = k + 1 if k < n - 1 else 0
        table[DAMPING_DVX, k] = inv_mass * (impulse[a] * table[EX, a] - impulse[k] * table[EX, k])
        table[DAMPING_DVY, k] = inv_mass * (impulse[a] * table[EY, a] - impulse[k] * table[EY, k])
        after[VX, k] += table[DAMPING_DVX, k]
        after[VY, k] += table[DAMPING_DVY, k]
        workspace[FORCE_X, k] += impulse[k] * table[EX, k] / h
        workspace[FORCE_Y, k] += impulse[k] * table[EY, k] / h
        after[SPIN, k] += inv_inertia * (
            impulse[a] * table[LEVER_BEFORE, a] - impulse[k] * table[LEVER_AFTER, k]
        )
        heat += impulse[k] * impulse[k] / (h * damping.coefficient)
    return heat
