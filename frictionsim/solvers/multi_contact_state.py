"""The state of a run of several coordinates and contacts: the array of `one_contact_state`, longer.

Position and velocity of all coordinates come first in a vector of the state, then the energy
integrals. Behind the layout of one contact are the numbers of the contacts and the stages of a
step, and what the balance of a mechanism finds: accelerations and forces.
"""

from typing import Any

from frictionsim.results import SLACK, STICK, TAUT
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.contacts import COORDINATE, FORMS, MARGIN, ROUNDOFF
from frictionsim.solvers.one_contact_state import LENGTH as END_OF_ONE_CONTACT
from frictionsim.solvers.one_contact_state import MAX_STATES

MAX_CONTACTS = MAX_STATES // 2
# Of each contact: its mode, and that before a switch; the direction in which it is released at the
# end of the last step, else 0; of those that give way at an event, the direction: of those whose
# force was located at its limit, and of those of an event before at the same time, which have not
# moved yet; the number of modes that are possible; the heat of an impact.
MODES, OLD_MODES, ENDS, RELEASED_NOW, RELEASED_BEFORE, CHOICES, HEATS = (
    END_OF_ONE_CONTACT + k * MAX_CONTACTS for k in range(7)
)
# What the balance finds: accelerations and, behind 1 and the drive, forces.
ACCELERATION = END_OF_ONE_CONTACT + 7 * MAX_CONTACTS
TERMS = ACCELERATION + MAX_CONTACTS
FORCES = TERMS + 2
# The derivatives at the stages 2 to 6 of a step, and the state of a stage.
K2, K3, K4, K5, K6, STAGE = (TERMS + (1 + k) * MAX_STATES for k in range(6))
# The margins of the present modes, in the order of the contacts: their number; of each the contact,
# the direction in which it is released, where its form is in the table (of the force of a contact
# that holds; else -1), and its sign and place in the state.
MARGINS = STAGE + MAX_STATES
CONTACT, DIRECTION, FORM, SIGN, COMPONENT = (MARGINS + 1 + k * 2 * MAX_CONTACTS for k in range(5))
# When each is used up, and the last time at which the contact held, s.
EVENT_TIME, EVENT_HELD = (COMPONENT + k * 2 * MAX_CONTACTS for k in (1, 2))
# Places within a step: their times, s, and the margins there.
PLACE_TIMES = COMPONENT + 3 * 2 * MAX_CONTACTS
PLACES = 9
SAMPLED_MARGINS = PLACE_TIMES + PLACES
RESTING = SAMPLED_MARGINS + PLACES * 2 * MAX_CONTACTS  # whether contacts hold all coordinates
LENGTH = RESTING + 1


@compilable
def coordinate_of(system: Any, i: int) -> int:
    """Return the coordinate of a contact."""
    return int(system.contacts.numbers[i * system.contacts.width + COORDINATE])


@compilable
def form_of(system: Any, i: int, form: int) -> int:
    """Return where a form of a contact is in the table."""
    return i * system.contacts.width + FORMS + form * system.contacts.terms


@compilable
def form_value(system: Any, s: Any, at: int) -> float:
    """Return the value of a form of the table, of the last balance."""
    numbers, value = system.contacts.numbers, 0.0
    for j in range(system.contacts.terms):
        value += numbers[at + j] * s[TERMS + j]
    return value


@compilable
def roundoff_of(system: Any, s: Any, i: int) -> float:
    """Return the roundoff of a contact, of the last balance."""
    at, numbers, value = form_of(system, i, ROUNDOFF), system.contacts.numbers, 0.0
    for j in range(system.contacts.terms):
        value += numbers[at + j] * abs(s[TERMS + j])
    return value


@compilable
def balance(system: Any, s: Any, u: float, y: int) -> None:
    """Write accelerations and forces of the state at s[y]."""
    s[TERMS], s[TERMS + 1] = 1.0, u
    system.balance(u, s, y)


@compilable
def holds(mode: float) -> bool:
    """Return whether a contact holds in a mode."""
    return mode in (STICK, TAUT)


@compilable
def write_phase(system: Any, s: Any) -> None:
    """Write the margins of the present modes, and whether contacts hold all coordinates."""
    n, k, holding = system.coordinates, 0, 0
    for i in range(system.contacts.size):
        mode, c = s[MODES + i], coordinate_of(system, i)
        s[CONTACT + k], s[DIRECTION + k] = float(i), 1.0
        if holds(mode):
            holding += 1
            s[FORM + k] = float(form_of(system, i, MARGIN))
            if mode == STICK:
                k += 1
                s[CONTACT + k], s[DIRECTION + k] = float(i), -1.0
                s[FORM + k] = float(form_of(system, i, MARGIN + 1))
        else:
            s[FORM + k] = -1.0
            s[SIGN + k] = 1.0 if mode == SLACK else mode
            s[COMPONENT + k] = float(c if mode == SLACK else n + c)
        k += 1
    s[MARGINS] = float(k)
    s[RESTING] = 1.0 if holding == n else 0.0
