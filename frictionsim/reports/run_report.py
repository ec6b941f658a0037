"""The data of a report of runs: channels, events and the mechanism in motion."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError
from frictionsim.motion import motion_of

if TYPE_CHECKING:
    from frictionsim.results import Record


def data_of(records: "Sequence[Record]") -> dict[str, Any]:
    """Return the data of a report of results of one kind, for the scripts of its page."""
    return {"results": [_of_one(record) for record in records]}


def _of_one(record: "Record") -> dict[str, Any]:
    try:
        motion = motion_of(record)
    except InputError:
        motion = None
    return {"kind": record.attributes["kind"], "motion": motion}
