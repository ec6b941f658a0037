"""What happens in a run, in words and intervals: its events and its sticking phases."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from frictionsim.results import OPEN, SLACK, TAUT

if TYPE_CHECKING:
    from frictionsim.results import Record

BREAKAWAY, REST, REVERSAL = "breakaway", "comes to rest", "reverses"
# Of a pulley that no body touches, and of a span with and without tension.
ENGAGEMENT: dict[float, str] = {OPEN: "open", TAUT: "taut", SLACK: "slack"}


def sticking_phases(result: "Record") -> Iterator[tuple[float, float]]:
    """Yield start and end of each sticking phase."""
    if result.axes.get("mode") != "":  # no mode, or several contacts
        return
    time, events = result.channels["time"], result.events
    resting_since = time[0] if result.channels["mode"][0] == 0 else None
    columns = (events[name] for name in ("time", "mode_from", "mode_to"))
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
    if before == after:
        return contact
    if {before, after} & ENGAGEMENT.keys():
        return f"{contact}: {ENGAGEMENT.get(after, 'closed')}"
    if after == 0:
        return REST
    return BREAKAWAY if before == 0 else REVERSAL
