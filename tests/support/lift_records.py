"""Changes of the contacts of a lift, as its results have them."""

from frictionsim.results import Record

CONTACTS = ("shaft", "cord", "car rope", "counterweight rope")
TAUT, SLACK = 3, 4  # modes of a rope


def changes(done: Record, contact: str) -> list[tuple[float, int, int, float]]:
    """Return the changes of one contact: time, mode before, mode after, angle in rad.

    A rope has mode 1 where it is slack. Impacts of a rope that stays slack are left out.
    """
    mode = {-1: -1, 0: 0, 1: 1, TAUT: 0, SLACK: 1}
    return [
        (e.time, mode[e.mode_from], mode[e.mode_to], e.position)
        for e in done.transitions
        if e.contact == contact.replace(" ", "_") and e.mode_from != e.mode_to
    ]
