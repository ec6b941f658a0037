"""The table of a work-precision study in a file of `frictionsim cost`, in CSV or HDF5.

A table in CSV has a line for each setting below a heading with units. Lines above the heading that
begin with # are notes, for example about the machine.
"""

import csv
import os
import re
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from stat import S_ISREG
from typing import Any, NamedTuple

from frictionsim.errors import InputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.replaceable import COSTS, check_replaceable
from frictionsim.results import Column

MAX_BYTES = 64 * 2**20  # of a table in CSV; a study has some hundred lines
MAX_COLUMNS = 500
HEADING = re.compile(r"(.*?)(?: \[([^\]]*)\])?")
NOTE = "#"
FIRST = (b"law,backend,setting,", b"backend,setting,")  # starts of headings; older ones lack law
TEXTS = ("backend", "setting", "status")
NUMBERS = ("error", "wall_seconds", "steps", "rhs_evaluations")
STATUSES = ("done", "failed")


class CostTable(NamedTuple):
    """The table of a study."""

    attributes: dict[str, str]  # the known ones; none for a table in CSV
    columns: dict[str, Column]  # by name, of equal lengths; NaN where a value is unknown
    notes: tuple[str, ...] = ()  # lines above the table

    @property
    def rows(self) -> int:
        """The number of settings."""
        return len(self.columns["status"].values)


def is_costs_in_csv(path: Path) -> bool:
    """Return whether a file begins as a table of costs in CSV does; false if it cannot be read."""
    try:
        if not S_ISREG(os.stat(path).st_mode):
            return False
        with path.open("rb") as file:
            head = file.read(2**16)
    except (OSError, ValueError):
        return False
    lines = [line for line in head.split(b"\n") if not line.startswith(NOTE.encode())]
    return bool(lines) and lines[0].startswith(FIRST)


def write_csv(table: CostTable, path: Path) -> None:
    """Write a table of costs as CSV atomically, with units in the header line."""
    text, columns = StringIO(newline=""), table.columns.values()
    writer = csv.writer(text)
    writer.writerow([f"{c.name} [{c.unit}]" if c.unit else c.name for c in columns])
    writer.writerows(zip(*(c.values for c in columns), strict=True))
    check_replaceable(path, COSTS)
    write_atomically(text.getvalue().encode(), path, COSTS.word)


def read_csv(path: Path) -> CostTable:
    """Read a table of costs in CSV."""
    try:
        size = os.stat(path).st_size
        if size > MAX_BYTES:
            raise ValueError(f"it has {size} bytes, no such table has more than {MAX_BYTES}")
        text = path.read_text(encoding="utf-8")
        return _table(text)
    except OSError as error:
        reason = error.strerror or "it cannot be opened"
    except UnicodeDecodeError:
        reason = "it is not text in UTF-8"
    except (ValueError, csv.Error) as error:
        reason = str(error)
    raise InputError(f"{path}: cannot read this table of costs: {reason}")


def _table(text: str) -> CostTable:
    lines = text.splitlines(keepends=True)
    count = next((i for i, line in enumerate(lines) if not line.startswith(NOTE)), len(lines))
    notes = tuple(line[len(NOTE) :].strip() for line in lines[:count])
    reader = csv.reader(lines[count:], strict=True)
    cells = next(reader, [])
    if len(cells) > MAX_COLUMNS:
        raise ValueError(f"it has {len(cells)} columns, no such table has more than {MAX_COLUMNS}")
    headings = [(match[1], match[2] or "") for match in map(HEADING.fullmatch, cells) if match]
    if len({name for name, _ in headings}) < len(cells):
        raise ValueError("its heading names a column twice, or one that has a line break")
    rows = list(_rows(reader, len(headings), count))
    columns = {}
    for number, (name, unit) in enumerate(headings):
        values: list[Any] = [row[number] for _, row in rows]
        if unit:
            values = [_number(row[number], line, name) for line, row in rows]
        columns[name] = Column(name, unit, name.replace("_", " "), values)
    return checked(CostTable({}, columns, notes))


def _rows(reader: Any, length: int, before: int) -> Iterator[tuple[int, list[str]]]:
    """Yield the number of each line and its cells."""
    for row in reader:
        line = before + reader.line_num
        if row and len(row) != length:
            raise ValueError(f"line {line} has {len(row)} cells, the heading has {length}")
        if row:
            yield line, row


def _number(cell: str, line: int, name: str) -> float:
    try:
        return float(cell) if cell else float("nan")
    except ValueError:
        raise ValueError(
            f"line {line}, column '{name[:80]}': expected a number, got '{cell[:80]}'"
        ) from None


def checked(table: CostTable) -> CostTable:
    """Return a table if its columns are those of a study; else raise ValueError."""
    for name in (*TEXTS, *NUMBERS):
        if name not in table.columns:
            raise ValueError(f"it has no column '{name}'")
        if bool(table.columns[name].unit) is not (name in NUMBERS):
            wanted = "numbers with a unit" if name in NUMBERS else "text without a unit"
            raise ValueError(f"its column '{name}' does not hold {wanted}")
    if any(len(column.values) != table.rows for column in table.columns.values()):
        raise ValueError("its columns are not of equal lengths")
    odd = next((s for s in table.columns["status"].values if s not in STATUSES), None)
    if odd is not None:
        raise ValueError(f"a row has the status '{odd[:80]}', which is neither done nor failed")
    if not table.rows:
        raise ValueError("it has no rows")
    return table
