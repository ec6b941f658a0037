"""The channels of a result as CSV."""

import csv
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from frictionsim.results import Record


def write_channels(record: "Record", file: TextIO) -> None:
    """Write one line for each sample; the first line has the names with their units.

    A channel with columns has one for each member of its axis: ``pulley_speed.driver [rad/s]``.
    Numbers have as many digits as they need to be read back exactly.

    Parameters
    ----------
    record : Record
    file : text file
    """
    headings, columns = [], []
    # A file of format version 1 has its channels in the order of their names.
    names = ["time", *(name for name in record.channels if name != "time")]
    for name in names:
        values = record.channels[name]
        axis = record.axes[name]
        unit = f" [{record.units[name]}]"
        if not axis:
            headings.append(name + unit)
            columns.append(_numbers(values))
            continue
        for member, column in zip(record.members[axis], values.T, strict=True):
            headings.append(f"{name}.{member}{unit}")
            columns.append(_numbers(column))
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(headings)
    writer.writerows(zip(*columns, strict=True))


def _numbers(values: Any) -> list[Any]:
    found: list[Any] = values.tolist()
    return found
