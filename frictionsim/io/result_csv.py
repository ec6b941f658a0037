"""The channels of a result as CSV: a line for each sample, under names with their units."""

import csv
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.options import as_list

if TYPE_CHECKING:
    from frictionsim.results import Record

SAMPLES_AT_ONCE = 1024


class Writable(Protocol):
    """A target for text."""

    def write(self, text: str, /) -> object:
        """Write text."""


def write_lines(
    record: "Record",
    file: Writable,
    channels: str | Sequence[str] | None = None,
    start: float | None = None,
    stop: float | None = None,
) -> None:
    """Write the lines of `Result.save_csv` to a text file; see there."""
    known, wanted = record.channels, [] if channels is None else as_list(channels)
    for name in wanted:
        if name not in known:
            raise ArgumentError("channels", unknown("channel", name, list(known)))
    time = record.time
    first = 0 if start is None else int(np.searchsorted(time, start, "left"))
    last = len(time) if stop is None else int(np.searchsorted(time, stop, "right"))
    if first >= last and time.size and (start, stop) != (None, None):
        ends = f"the samples are from {time[0]:.9g} s to {time[-1]:.9g} s"
        raise InputError(f"no sample is between the times that are given; {ends}")
    names = list(dict.fromkeys(("time", *(wanted or known))))
    headings: list[str] = []
    for name in names:
        axis = record.axes[name]
        members = [f".{member}" for member in record.members[axis]] if axis else [""]
        headings += [f"{name}{member} [{record.units[name]}]" for member in members]
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(headings)
    for begin in range(first, last, SAMPLES_AT_ONCE):
        part = slice(begin, min(begin + SAMPLES_AT_ONCE, last))
        columns = (column for name in names for column in _columns(known[name][part]))
        writer.writerows(zip(*columns, strict=True))


def _columns(values: Any) -> Iterator[list[Any]]:
    """Yield the numbers of each column."""
    for column in values.reshape(len(values), -1).T:
        yield column.tolist()
