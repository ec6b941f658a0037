"""The channels of a result as CSV."""

import csv
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

from frictionsim.simulation.stored_channel import blocks_of

if TYPE_CHECKING:
    from frictionsim.results import Record


class Writable(Protocol):
    """What text can be written to."""

    def write(self, text: str, /) -> object:
        """Write text."""


BYTES_OF_NUMBER = 40  # with its place in a list


def write_channels(record: "Record", file: Writable) -> None:
    """Write one line for each sample; the first line has the names with their units.

    A channel with columns has one for each member of its axis: ``pulley_speed.driver [rad/s]``.
    Numbers have as many digits as they need to be read back exactly.
    """
    headings, row_bytes = [], 0
    # A file of format version 1 has its channels in the order of their names.
    names = ["time", *(name for name in record.channels if name != "time")]
    for name in names:
        axis = record.axes[name]
        unit = f" [{record.units[name]}]"
        members = [f".{member}" for member in record.members[axis]] if axis else [""]
        headings += [f"{name}{member}{unit}" for member in members]
        row_bytes += BYTES_OF_NUMBER * len(members)
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(headings)
    for start, stop in blocks_of(len(record.channels["time"]), row_bytes):
        parts = (record.channels[name][start:stop] for name in names)
        columns = (column for part in parts for column in _columns(part))
        writer.writerows(zip(*columns, strict=True))


def _columns(values: Any) -> Iterator[list[Any]]:
    """Yield the numbers of each column."""
    for column in values.reshape(len(values), -1).T:
        yield column.tolist()
