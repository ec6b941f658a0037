"""What happens in a run, in words and intervals: its events and its sticking phases."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from frictionsim.results import OPEN, OTHER_MODES, SLACK, STICK, TAUT
from frictionsim.solvers.end_stops import EVENT as END_STOP

if TYPE_CHECKING:
    from frictionsim.results import Record

BREAKAWAY, REST, REVERSAL = "breakaway", "comes to rest", "reverses"
# Of a pulley that no body touches, and of a span with and without tension.
ENGAGEMENT: dict[float, str] = {OPEN: "open", TAUT: "taut", SLACK: "slack"}
SLIPS, STICKS, IMPACT, LEFT = "slips", "sticks", "impact", "left"


def sticking_phases(result: "Record", contact: str | None = None) -> Iterator[tuple[float, float]]:
    """Yield start and end of each sticking phase of a contact, as of `Record.events_of`."""
    channel = "mode" if contact is None else OTHER_MODES[contact]
    if result.axes.get(channel) != "":  # no mode, or several contacts
        return
    time, chosen = result.channels["time"], result.events_of(contact)
    resting_since = time[0] if result.channels[channel][0] == 0 else None
    columns = (result.events[name][chosen] for name in ("time", "mode_from", "mode_to"))
    for at, before, mode in zip(*columns, strict=True):
        if mode == before:  # a switching surface was crossed, perhaps in creep
            continue
        if mode == 0:
            resting_since = at
        elif resting_since is not None:
            yield resting_since, at
            resting_since = None
    # A run that was stopped may have events after its last sample.
    if resting_since is not None and resting_since <= time[-1]:
        yield resting_since, time[-1]


def event_names(result: "Record") -> list[str]:
    """Return the label of each event: by its change of mode, or with the name of its contact."""
    columns = (result.events[name] for name in ("contact", "mode_from", "mode_to"))
    return [
        _event_name(result.contacts[int(contact)], before, after)
        for contact, before, after in zip(*columns, strict=True)
    ]


def _event_name(contact: str, before: float, after: float) -> str:
    if {before, after} & ENGAGEMENT.keys():
        name = contact.replace("_rope", " rope")
        return f"{name}: {IMPACT if before == after else ENGAGEMENT.get(after, 'closed')}"
    if contact == END_STOP:
        return f"{contact}: {LEFT if before == STICK else IMPACT if after != STICK else REST}"
    if before == after:
        return contact
    if contact in OTHER_MODES:
        return f"{contact}: {_of_slip(before, after)}"
    if after == 0:
        return REST
    return BREAKAWAY if before == 0 else REVERSAL


def _of_slip(before: float, after: float) -> str:
    if after == STICK:
        return STICKS
    return SLIPS if before == STICK else REVERSAL
