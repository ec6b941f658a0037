"""The list of candidates for a contact, bodies near pulleys, and their friction modes.

Only candidates are looked at in the steps between two searches, of which each kinematics has its
own. No body passes the skin round a pulley meanwhile, which is as thick as a body is long, unless
it is faster than a sixteenth of the waves along the belt, or an eighth, by how often a method
searches. A run is a part of the list in which neighbours are neighbours on the belt.
"""

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    BACKWARD,
    BACKWARD_LIMIT,
    FORWARD,
    FORWARD_LIMIT,
    FRICTION,
    KINETIC,
    MODE,
    NORMAL,
    RADIUS,
    SIMD_WIDTH,
    SLIP,
    STATIC,
    STICK_BIAS,
    STICKING,
    Bodies,
    Contacts,
    FrictionCoefficients,
)


@inline_kernel
def run_end(body: Bodies, start: int, count: int) -> int:
    """Return the end of the run that starts at a candidate: a loop over it needs no list.

    Candidates come in blocks of `SIMD_WIDTH` neighbours. Loops over a run count without a sign: an
    index that may be negative would be looked at for each number.
    """
    end = start + SIMD_WIDTH
    while end < count and body[end] == body[start] + np.uint64(end - start):
        end += SIMD_WIDTH
    return end


NEW_CONTACT = 2.0  # in the place of a mode: the body was no candidate


@inline_kernel
def save_modes(contacts: Contacts) -> None:
    """Save mode and sticking of the candidates by their bodies; NEW_CONTACT for all others."""
    table, body = contacts.table, contacts.body
    radius, mode, sticking = table[RADIUS], table[MODE], table[STICKING]
    saved_mode, saved_sticking = contacts.saved_modes[0], contacts.saved_modes[1]
    saved_mode[:] = NEW_CONTACT
    for s in range(contacts.offsets[-1]):
        if radius[s] > 0.0:
            saved_mode[body[s]], saved_sticking[body[s]] = mode[s], sticking[s]


@inline_kernel
def add_candidate(contacts: Contacts, s: int, body: int, radius: float) -> None:
    """Write the candidate number s, with the mode that the body had.

    One of no radius touches nothing, and has no mode.
    """
    table = contacts.table
    contacts.body[s], table[RADIUS, s] = body, radius
    saved = contacts.saved_modes
    table[MODE, s] = saved[0, body] if radius > 0.0 else 0.0
    table[STICKING, s] = saved[1, body] if radius > 0.0 else 0.0
    table[FRICTION, s] = 0.0


@inline_kernel
def fill_up(contacts: Contacts, first: int, s: int) -> int:
    """Fill the candidates of a pulley, first to s - 1, up to full vectors; return their end."""
    table = contacts.table
    end = s + -(s - first) % SIMD_WIDTH
    for k in range(s, end):
        contacts.body[k], table[RADIUS, k], table[MODE, k], table[STICKING, k] = 0, 0.0, 0.0, 0.0
        table[NORMAL, k] = table[SLIP, k] = table[STICK_BIAS, k] = table[FRICTION, k] = 0.0
    return end


@inline_kernel
def set_initial_mode(contacts: Contacts, s: int, slip: float) -> None:
    """Have a body that is new at a pulley stick if it has no slip, else slide."""
    table = contacts.table
    if table[MODE, s] == NEW_CONTACT:
        table[SLIP, s], table[MODE, s] = slip, np.sign(slip)
        table[STICKING, s] = 1.0 if slip == 0.0 else 0.0


@inline_kernel
def assign_friction_coefficients(
    contacts: Contacts, pulleys: int, friction: FrictionCoefficients | None
) -> None:
    """Write STATIC and KINETIC of each candidate, and the coefficients in force."""
    if friction is not None:
        for j in range(pulleys):
            for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
                i = min(contacts.body[s], np.uint64(friction.static.shape[1] - 1))
                contacts.table[STATIC, s] = friction.static[j, i]
                contacts.table[KINETIC, s] = friction.kinetic[j, i]
        select_friction_coefficients(contacts)


@inline_kernel
def select_friction_coefficients(contacts: Contacts) -> bool:
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
def update_contact_modes(contacts: Contacts) -> bool:
    """Write MODE from the last step.

    A body that sticks starts to slide in the direction of its friction; one that slides keeps its
    mode until its slip is zero. Reads STICKING, SLIP, FRICTION and its limits; writes MODE, the
    coefficients in force, and how far below its limit a body let go. Return whether that changes a
    limit.
    """
    table = contacts.table
    for s in range(contacts.offsets[-1]):
        mode, slip, friction = table[MODE, s], table[SLIP, s], table[FRICTION, s]
        if table[STICKING, s] > 0.0 or mode * slip < 0.0:
            mode = 0.0
        elif mode == 0.0:
            mode = np.sign(friction) if friction != 0.0 else np.sign(slip)
            limit = table[FORWARD_LIMIT if friction > 0.0 else BACKWARD_LIMIT, s]
            missing = limit - abs(friction)
            contacts.release[0] = max(contacts.release[0], missing / limit if limit > 0.0 else 0.0)
        table[MODE, s] = mode
    return select_friction_coefficients(contacts)
