"""The table of a work-precision study in a file of `frictionsim cost`, in CSV.

A table in CSV has a line for each setting below a heading with units. Lines above the heading that
begin with # are notes, for example about the machine. What holds for the whole study (ABOUT) has
columns of its own at the end, with the same text in each line, so that the heading stays the first.
"""

import csv
import os
import re
from io import StringIO
from itertools import takewhile
from pathlib import Path
from stat import S_ISREG
from typing import Any, NamedTuple

from frictionsim.errors import InputError
from frictionsim.io.output_file import COSTS, write_file
from frictionsim.results import Column
from frictionsim.scenario.csv_columns import CsvRow, read_text, separated

MAX_COLUMNS = 500
HEADING = re.compile(r"(.*?)(?: \[([^\]]*)\])?")
NOTE = "#"
FIRST = (b"law,backend,setting,", b"backend,setting,")  # starts of headings; older ones lack law
TEXTS = ("backend", "setting", "status")
NUMBERS = ("error", "wall_seconds", "steps", "rhs_evaluations")
STATUSES = ("done", "failed")
ABOUT = ("kind", "title", "references", "time_references", "reference_uncertainty", "quantities")
"""Attributes of a study that a table in CSV has as columns."""


class CostTable(NamedTuple):
    """The table of a study."""

    attributes: dict[str, str]  # the known ones; in CSV those of ABOUT, none in an older table
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
    about = {name: table.attributes.get(name, "").replace("\n", " and ") for name in ABOUT}
    texts = [Column(name, "", name, [about[name]] * table.rows) for name in ABOUT]
    text, columns = StringIO(newline=""), (*table.columns.values(), *texts)
    writer = csv.writer(text)
    writer.writerow([f"{c.name} [{c.unit}]" if c.unit else c.name for c in columns])
    writer.writerows(zip(*(c.values for c in columns), strict=True))
    write_file(path, text.getvalue().encode(), COSTS)


def read_csv(path: Path) -> CostTable:
    """Read a table of costs in CSV."""
    text = read_text(path)
    rows = list(separated(text, ",", path))
    notes = takewhile(lambda line: line.startswith(NOTE), text.split("\n"))
    try:
        return _table(rows, tuple(note[len(NOTE) :].strip() for note in notes))
    except ValueError as error:
        raise InputError(f"{path}: cannot read this table of costs: {error}") from None


def _table(rows: list[CsvRow], notes: tuple[str, ...]) -> CostTable:
    cells = rows[0].cells if rows else []
    if len(cells) > MAX_COLUMNS:
        raise ValueError(f"it has {len(cells)} columns, no such table has more than {MAX_COLUMNS}")
    headings = [(match[1], match[2] or "") for match in map(HEADING.fullmatch, cells) if match]
    if len({name for name, _ in headings}) < len(cells):
        raise ValueError("its heading names a column twice, or one that has a line break")
    for row in rows[1:]:
        if len(row.cells) != len(cells):
            raise ValueError(
                f"line {row.line} has {len(row.cells)} cells, the heading has {len(cells)}"
            )
    columns = {}
    for number, (name, unit) in enumerate(headings):
        values: list[Any] = [row.cells[number] for row in rows[1:]]
        if unit:
            values = [_number(row.cells[number], row.line, name) for row in rows[1:]]
        columns[name] = Column(name, unit, name.replace("_", " "), values)
    about = {name: columns.pop(name) for name in ABOUT if name in columns}
    same = {name: "".join(map(str, column.values[:1])) for name, column in about.items()}
    return checked(CostTable(same, columns, notes))


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
