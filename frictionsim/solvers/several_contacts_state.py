"""The state of a run of several coordinates and contacts: the array of `one_contact_state`, longer.

Position and velocity of all coordinates come first in a vector of the state, then the energy
integrals. Behind the layout of one contact are the numbers of the contacts and the stages of a
step, and what the balance of a mechanism finds: accelerations and forces.
"""

from typing import Any

from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.contacts import COORDINATE, FORMS, ROUNDOFF
from frictionsim.solvers.one_contact_state import LENGTH as END_OF_ONE_CONTACT
from frictionsim.solvers.one_contact_state import MAX_STATES

MAX_CONTACTS = MAX_STATES // 2
# The modes; the modes before a switch; the direction in which a contact is released at the end of
# the last step, else 0; of those that give way at an event, the direction: of those whose force was
# located at its limit, and of those of an event before at the same time, which have not moved yet;
# the number of modes that are possible; the heat of an impact.
MODES, OLD_MODES, ENDS, RELEASED_NOW, RELEASED_BEFORE, CHOICES, HEATS = (
    END_OF_ONE_CONTACT + k * MAX_CONTACTS for k in range(7)
)
# What the balance finds: accelerations and, behind 1 and the drive, forces.
ACCELERATION = END_OF_ONE_CONTACT + 7 * MAX_CONTACTS
TERMS = ACCELERATION + MAX_CONTACTS
FORCES = TERMS + 2
# The derivatives at the stages 2 to 6 of a step, and the state of a stage.
K2, K3, K4, K5, K6, STAGE = (TERMS + (1 + k) * MAX_STATES for k in range(6))
# Margins at places within a step.
SEEN = STAGE + MAX_STATES
PLACES = 9
# Of each margin the time at which it is used up, and the last at which the contact held, s.
EVENT_TIME, EVENT_HELD = (SEEN + (PLACES + k) * 2 * MAX_CONTACTS for k in range(2))
RESTING = EVENT_HELD + 2 * MAX_CONTACTS  # whether contacts hold all coordinates
LENGTH = RESTING + 1


@compilable
def contact_count(system: Any) -> int:
    """Return the number of contacts."""
    return len(system.contacts) // row_width(system)


@compilable
def row_width(system: Any) -> int:
    """Return the length of a contact in the table of a system."""
    return FORMS + (ROUNDOFF + 1) * (system.forces + 2)


@compilable
def row_of(system: Any, i: int) -> int:
    """Return where a contact begins in the table of a system."""
    return i * row_width(system)


@compilable
def coordinate_of(system: Any, i: int) -> int:
    """Return the coordinate of a contact."""
    return int(system.contacts[row_of(system, i) + COORDINATE])


@compilable
def form_value(system: Any, s: Any, i: int, form: int) -> float:
    """Return the value of a form of a contact, of the last balance."""
    width = system.forces + 2
    at, contacts, value = row_of(system, i) + FORMS + form * width, system.contacts, 0.0
    for j in range(width):
        value += contacts[at + j] * s[TERMS + j]
    return value


@compilable
def roundoff_of(system: Any, s: Any, i: int) -> float:
    """Return the roundoff of a contact, of the last balance."""
    width = system.forces + 2
    at, contacts, value = row_of(system, i) + FORMS + ROUNDOFF * width, system.contacts, 0.0
    for j in range(width):
        value += contacts[at + j] * abs(s[TERMS + j])
    return value


@compilable
def balance(system: Any, s: Any, u: float, y: int) -> None:
    """Write accelerations and forces of the state at s[y]."""
    s[TERMS], s[TERMS + 1] = 1.0, u
    system.balance(u, s, y)
