"""The search for bodies near pulleys, the candidates for a contact, and who of them sticks.

Only these are looked at in the steps between two searches. No body gets through the skin round a
pulley meanwhile, which is as thick as a body is long, unless it is faster than a sixteenth of the
waves along the belt, or an eighth, by how often a method searches.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.guided_string.line import line_candidates
from frictionsim.mechanisms.belt_drive.kernels.candidate_list import (
    add_candidate,
    fill_up,
    save_modes,
    set_initial_mode,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    BACKWARD,
    BODY_VX,
    BODY_VY,
    CENTRE_X,
    CENTRE_Y,
    FORWARD,
    FRICTION,
    INV_DISTANCE,
    KINETIC,
    MODE,
    NORMAL,
    NX,
    NY,
    PULLEY_RADIUS,
    PULLEY_X,
    PULLEY_Y,
    RIM_TURN,
    SLIP,
    SPEED,
    STATIC,
    STICKING,
    VX,
    VY,
    X,
    Y,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import (
    factor_rate,
    times_factor,
    update_wrap_factors,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.belt_friction import FrictionCoefficients
    from frictionsim.mechanisms.belt_drive.effects.contact import ContactParameters
    from frictionsim.mechanisms.belt_drive.kernels.system import Contacts, Pulleys, System

    Array = npt.NDArray[np.float64]


@inline_kernel
def find_contact_candidates(system: "System", kinematics: "Array") -> None:
    """Make candidates of the bodies within the skin of a pulley's rim.

    Reads the kinematics, MODE and STICKING; writes all of the contacts but their forces.
    """
    plane_candidates(system.effects.contact, system, kinematics)
    line_candidates(system.line, system, kinematics)
    count = system.pulleys.table.shape[1]
    assign_friction_coefficients(system.contacts, count, system.friction)


@inline_kernel
def plane_candidates(
    contact: "ContactParameters | None", system: "System", kinematics: "Array"
) -> None:
    """Make candidates of bodies that move in the plane."""
    if contact is not None:
        contacts, pulleys, chain = system.contacts, system.pulleys, system.chain
        search(contacts, pulleys, chain.bodies, chain.length, kinematics)
        count = contacts.offsets[-1]
        update_wrap_factors(contacts.wrap, contacts.body, count, chain, kinematics)
        initial_contact_modes(kinematics, contacts, pulleys)


@inline_kernel
def search(
    contacts: "Contacts", pulleys: "Pulleys", bodies: int, skin: float, kinematics: "Array"
) -> None:
    """Write the candidates, with the modes that they had, or NEW_CONTACT."""
    x, y, table, count = kinematics[X], kinematics[Y], pulleys.table, pulleys.table.shape[1]
    save_modes(contacts)
    s = 0
    for j in range(count):
        contacts.offsets[j] = first = s
        reach = (table[PULLEY_RADIUS, j] + skin) ** 2
        for i in range(bodies):
            if (x[i] - table[PULLEY_X, j]) ** 2 + (y[i] - table[PULLEY_Y, j]) ** 2 < reach:
                add_candidate(contacts, s, i, table[PULLEY_RADIUS, j])
                s += 1
        s = fill_up(contacts, first, s)
        for k in range(first, s):
            contacts.table[CENTRE_X, k] = table[PULLEY_X, j]
            contacts.table[CENTRE_Y, k] = table[PULLEY_Y, j]
    contacts.offsets[count] = s


@inline_kernel
def initial_contact_modes(kinematics: "Array", contacts: "Contacts", pulleys: "Pulleys") -> None:
    """Have bodies that are new at a pulley stick if they have no slip, else slide."""
    table, pulley = contacts.table, pulleys.table
    for j in range(pulley.shape[1]):
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            i = contacts.body[s]
            dx, dy = kinematics[X, i] - table[CENTRE_X, s], kinematics[Y, i] - table[CENTRE_Y, s]
            moment = kinematics[VY, i] * dx - kinematics[VX, i] * dy
            along = times_factor(contacts.wrap, s, moment / np.sqrt(dx * dx + dy * dy))
            set_initial_mode(contacts, s, pulley[PULLEY_RADIUS, j] * pulley[SPEED, j] - along)


@inline_kernel
def assign_friction_coefficients(
    contacts: "Contacts", pulleys: int, friction: "FrictionCoefficients | None"
) -> None:
    """Write STATIC and KINETIC of each candidate, and the coefficients in force."""
    if friction is not None:
        for j in range(pulleys):
            for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
                contacts.table[STATIC, s] = friction.static[j, contacts.body[s]]
                contacts.table[KINETIC, s] = friction.kinetic[j, contacts.body[s]]
        select_friction_coefficients(contacts)


@inline_kernel
def select_friction_coefficients(contacts: "Contacts") -> bool:
    """Write FORWARD and BACKWARD, by MODE; return whether that changes a limit."""
    table = contacts.table
    changed = 0.0
    for s in range(contacts.offsets[-1]):
        static, kinetic, mode = table[STATIC, s], table[KINETIC, s], table[MODE, s]
        against = 0.0 if static > kinetic else static
        forward = static if mode == 0.0 else kinetic if mode > 0.0 else against
        backward = static if mode == 0.0 else kinetic if mode < 0.0 else against
        change = abs(forward - table[FORWARD, s]) + abs(backward - table[BACKWARD, s])
        changed += change * table[NORMAL, s]
        table[FORWARD, s], table[BACKWARD, s] = forward, backward
    return changed > 0.0


@inline_kernel
def update_contact_modes(contacts: "Contacts") -> bool:
    """Take over from the last step who sticks and who slides where to.

    A body that sticks lets go in the direction of its friction. One that slides goes on until its
    slip has come to zero. Reads STICKING, SLIP and FRICTION; writes MODE and the coefficients in
    force. Return whether that changes a limit.
    """
    table = contacts.table
    for s in range(contacts.offsets[-1]):
        mode, slip, friction = table[MODE, s], table[SLIP, s], table[FRICTION, s]
        if table[STICKING, s] > 0.0 or mode * slip < 0.0:
            mode = 0.0
        elif mode == 0.0:
            mode = np.sign(friction) if friction != 0.0 else np.sign(slip)
        table[MODE, s] = mode
    return select_friction_coefficients(contacts)


@inline_kernel
def tangential_velocities(vx: "Array", vy: "Array", contacts: "Contacts", along: "Array") -> None:
    """Write the velocities along t of the candidates, with their wrap factors."""
    nx, ny, body = contacts.table[NX], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        i = body[s]
        along[s] = times_factor(contacts.wrap, s, vy[i] * nx[s] - vx[i] * ny[s])


@inline_kernel
def predict_rim_turn(h: float, contacts: "Contacts") -> None:
    """Write RIM_TURN from the velocities that were expected in the middle of the step."""
    table, wrap = contacts.table, contacts.wrap
    nx, ny, vx, vy = table[NX], table[NY], table[BODY_VX], table[BODY_VY]
    inv_distance, turn = table[INV_DISTANCE], table[RIM_TURN]
    for s in range(contacts.offsets[-1]):
        along = vy[s] * nx[s] - vx[s] * ny[s]
        away = vx[s] * nx[s] + vy[s] * ny[s]
        turn[s] = -0.5 * h * times_factor(wrap, s, along * away * inv_distance[s])
        turn[s] += 0.5 * h * along * factor_rate(wrap, s)
