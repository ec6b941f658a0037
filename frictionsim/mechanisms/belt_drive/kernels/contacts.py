"""The search for bodies near pulleys, the candidates for a contact, and who of them sticks.

Only these are looked at in the steps between two searches. No body gets through the skin round a
pulley meanwhile, which is as thick as a body is long, unless it is faster than a sixteenth of the
waves along the belt, or an eighth, by how often a method searches.

Points of a guided string do not overtake each other. Those near a pulley have numbers that follow
each other, but for one place where the last one is followed by the first: they are listed as runs,
over which a loop needs no table of indices.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.candidate_list import (
    add_candidate,
    fill_up,
    save_modes,
    set_initial_mode,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ARC_LENGTH,
    ARC_START,
    BACKWARD,
    BACKWARD_LIMIT,
    BODY_VY,
    CENTRE_X,
    CENTRE_Y,
    FORWARD,
    FORWARD_LIMIT,
    FRICTION,
    INV_DISTANCE,
    KINETIC,
    MODE,
    NORMAL,
    NX,
    NY,
    POSITION,
    PULLEY_RADIUS,
    PULLEY_X,
    PULLEY_Y,
    SIMD_WIDTH,
    SLIP,
    SPEED,
    STATIC,
    STICKING,
    VELOCITY,
    VX,
    VY,
    X,
    Y,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import (
    bend_joints,
    times_factor,
    update_wrap_factors,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.contact import ContactParameters
    from frictionsim.mechanisms.belt_drive.kernels.system import (
        Contacts,
        FrictionCoefficients,
        PitchLine,
        Pulleys,
        System,
    )

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
        bend_joints(chain, kinematics, system.workspace)
        update_wrap_factors(contacts.wrap, contacts, system.workspace)
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
        contacts.offsets[j] = s
        reach = (table[PULLEY_RADIUS, j] + skin) ** 2
        for first in range(0, bodies, SIMD_WIDTH):
            nearest = np.inf
            for i in range(first, min(first + SIMD_WIDTH, bodies)):
                dx, dy = x[i] - table[PULLEY_X, j], y[i] - table[PULLEY_Y, j]
                nearest = min(nearest, dx * dx + dy * dy)
            if nearest >= reach:
                continue
            for i in range(first, first + SIMD_WIDTH):
                dx, dy = x[i] - table[PULLEY_X, j], y[i] - table[PULLEY_Y, j]
                near = i < bodies and dx * dx + dy * dy < reach
                add_candidate(contacts, s + i - first, i, table[PULLEY_RADIUS, j] if near else 0.0)
            s += SIMD_WIDTH
        for k in range(contacts.offsets[j], s):
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
                i = min(contacts.body[s], np.uint64(friction.static.shape[1] - 1))
                contacts.table[STATIC, s] = friction.static[j, i]
                contacts.table[KINETIC, s] = friction.kinetic[j, i]
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
    slip has come to zero. Reads STICKING, SLIP, FRICTION and its limits; writes MODE, the
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


# A point is a candidate this many body lengths before its arc and after it: half a length, or more
# where it is stretched, touches first, and the rest is for the steps until the next search.
SKIN = 2.0

# Rows of the runs: number of the first point and of the first candidate, how many there are, and
# their pulley.
FIRST_POINT, FIRST_CANDIDATE, COUNT, PULLEY = range(4)
RUN_ROWS = 4


@inline_kernel
def line_candidates(line: "PitchLine | None", system: "System", kinematics: "Array") -> None:
    """Make candidates of the points on the arcs, and near their ends.

    NX and NY are the normal in the frame of the belt, whose first axis is along it.
    """
    if line is not None:
        contacts, pulley = system.contacts, system.pulleys.table
        position, velocity = kinematics[POSITION], kinematics[VELOCITY]
        table, runs, skin = contacts.table, line.runs, SKIN * system.chain.length
        save_modes(contacts)
        s, run = 0, -1
        for j in range(pulley.shape[1]):
            contacts.offsets[j] = first = s
            before = -2
            for i in range(system.chain.bodies):
                turns = np.floor((position[i] - line.starts[j] + skin) / line.length)
                start = line.starts[j] + turns * line.length
                if position[i] - start < line.arcs[j] + skin:
                    if i != before + 1:
                        run += 1
                        runs[FIRST_POINT, run], runs[FIRST_CANDIDATE, run] = i, s
                        runs[COUNT, run], runs[PULLEY, run] = 0, j
                    runs[COUNT, run] += 1
                    before = i
                    add_candidate(contacts, s, i, pulley[PULLEY_RADIUS, j])
                    rim = pulley[PULLEY_RADIUS, j] * pulley[SPEED, j]
                    set_initial_mode(contacts, s, rim - line.senses[j] * velocity[i])
                    table[ARC_START, s], table[ARC_LENGTH, s] = start, line.arcs[j]
                    s += 1
            s = fill_up(contacts, first, s)
            for k in range(first, s):
                table[NX, k], table[NY, k] = 0.0, -line.senses[j]
                table[BODY_VY, k] = table[INV_DISTANCE, k] = 0.0
        contacts.offsets[-1] = s
        line.run_count[0] = run + 1
