"""The table of a cost study, and its file in CSV.

The file has a line for each setting below a heading with units. Lines above the heading that begin
with # are notes, for example about the machine. What holds for the whole study (ABOUT) has columns
of its own at the end, with the same text in each line, so that the heading stays the first.
"""

import csv
import json
from collections.abc import Mapping
from io import StringIO
from itertools import takewhile
from math import isfinite, nan
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from frictionsim.errors import InputError
from frictionsim.io.output_file import COSTS, write_file
from frictionsim.results import Column, finite
from frictionsim.scenario.csv_columns import read_text, separated
from frictionsim.scenario.toml_data import json_value

NOTE = "#"
MAX_COLUMNS = 500
RELATIVE = "_relative"  # end of the names of columns of relative errors
ABOUT = ("kind", "title", "set", "references", "time_references", "reference_uncertainty")
TEXTS = (
    *("law", "backend", "setting", "model", "overrides", "status", "reason", "below_uncertainty"),
    *ABOUT,
)
COUNTS = ("bodies", "events", "repeats", "steps", "rejected", "rhs_evaluations", "states")
NUMBERS = ("error", "time_error", "wall_seconds", "wall_spread", *COUNTS)
REQUIRED = ("backend", "setting", "status", "error", "wall_seconds", "steps", "rhs_evaluations")


class Error(NamedTuple):
    """An absolute error, None if undefined, and a relative error."""

    absolute: float | None
    relative: float


class CostTable(NamedTuple):
    """The table of a cost study.

    Attributes
    ----------
    columns : dict of Column
        By name, of equal lengths; a number is NaN where it is not known.
    title, kind : str
        Of the scenario.
    overrides : str
        The values that were set in the scenario, `KEY = VALUE` each, with commas.
    references, time_references : tuple of str
        Settings of the runs that errors are relative to; the latter for `time_error`.
    uncertainty : mapping of Error
        Difference of the two references, by measure; empty if there is only one.
    time_uncertainty : float or None
        The largest relative one of the references in time; a file does not have it.
    status, reason : str
        How the study ended; a file does not say.
    notes : tuple of str
        Lines above the table in its file.
    """

    columns: dict[str, Column]
    title: str = ""
    kind: str = ""
    overrides: str = ""
    references: tuple[str, ...] = ()
    time_references: tuple[str, ...] = ()
    uncertainty: Mapping[str, Error] = MappingProxyType({})
    time_uncertainty: float | None = None
    status: str = ""
    reason: str = ""
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The values of each setting, by name of the column."""
        values = zip(*(column.values for column in self.columns.values()), strict=True)
        return [dict(zip(self.columns, row, strict=True)) for row in values]

    @property
    def measures(self) -> list[str]:
        """The names of the errors that the settings are judged by."""
        return [name.removesuffix(RELATIVE) for name in self.columns if name.endswith(RELATIVE)]

    @property
    def of_meshes(self) -> bool:
        """Whether it compares meshes, by a common limit."""
        return "model" in self.columns

    @property
    def floor(self) -> float:
        """The reference uncertainty: the largest relative difference of the references."""
        return max((error.relative for error in self.uncertainty.values()), default=0.0)

    def of(self, rows: list[dict[str, Any]]) -> "CostTable":
        """Return the table with some of its rows."""
        columns = {
            name: column._replace(values=[row[name] for row in rows])
            for name, column in self.columns.items()
        }
        return self._replace(columns=columns)


def line_of(row: dict[str, Any]) -> str:
    """Return the method of a row with its law and model, the name of a line in the diagram."""
    return ", ".join(filter(None, (row["backend"], row.get("law"), row.get("model"))))


def write_csv(table: CostTable, path: Path) -> None:
    """Write a table of costs as CSV atomically, with units in the header line."""
    relative = {name: finite(error.relative) for name, error in table.uncertainty.items()}
    joined = (" and ".join(names) for names in (table.references, table.time_references))
    about = (table.kind, table.title, table.overrides, *joined, json.dumps(relative))
    text, columns = StringIO(newline=""), table.columns.values()
    writer = csv.writer(text)
    writer.writerow([*(f"{c.name} [{c.unit}]" if c.unit else c.name for c in columns), *ABOUT])
    writer.writerows((*row.values(), *about) for row in table.rows)
    write_file(path, text.getvalue().encode(), COSTS)


def read_csv(path: Path) -> CostTable:
    """Read a table of costs in CSV.

    Raises
    ------
    InputError
        If it is damaged.
    """
    text = read_text(path)
    notes = takewhile(lambda line: line.startswith(NOTE), text.split("\n"))
    try:
        heading, *lines = separated(text, ",", path)
        columns = _columns(heading.cells, [(line.line, line.cells) for line in lines])
        about = {name: columns.pop(name).values[0] for name in ABOUT if name in columns}
        return CostTable(
            columns,
            about.get("title", ""),
            about.get("kind", ""),
            about.get("set", ""),
            tuple(filter(None, [about.get("references", "")])),
            tuple(filter(None, [about.get("time_references", "")])),
            _uncertainty(about.get("reference_uncertainty", "{}")),
            notes=tuple(note[len(NOTE) :].strip() for note in notes),
        )
    except ValueError as error:
        raise InputError(f"{path}: cannot read this table of costs: {error}") from None


def _columns(headings: list[str], lines: list[tuple[int, list[str]]]) -> dict[str, Column]:
    if len(headings) > MAX_COLUMNS:
        raise ValueError(
            f"it has {len(headings)} columns, no such table has more than {MAX_COLUMNS}"
        )
    columns: dict[str, Column] = {}
    for line, cells in lines:
        if len(cells) != len(headings):
            raise ValueError(f"line {line} has {len(cells)} cells, the heading has {len(headings)}")
    for number, heading in enumerate(headings):
        name, _, unit = heading.removesuffix("]").partition(" [")
        if name in columns:
            raise ValueError(f"its heading names the column '{name[:80]}' twice")
        values: list[Any] = [cells[number] for _, cells in lines]
        if unit:
            values = [_number(cells[number], line, name) for line, cells in lines]
        columns[name] = Column(name, unit, name.replace("_", " "), values)
    for name, column in columns.items():
        if name in TEXTS and column.unit:
            raise ValueError(f"its column '{name}' does not hold text without a unit")
        if (name in NUMBERS or name.endswith(RELATIVE)) and not column.unit:
            raise ValueError(f"its column '{name}' does not hold numbers with a unit")
    if missing := [name for name in REQUIRED if name not in columns]:
        raise ValueError(f"it has no column '{missing[0]}'")
    for status in columns["status"].values:
        if status not in ("done", "failed"):
            raise ValueError(
                f"a row has the status '{status[:80]}', which is neither done nor failed"
            )
    if not lines:
        raise ValueError("it has no rows")
    return columns


def _number(cell: str, line: int, name: str) -> float:
    try:
        return float(cell) if cell else nan
    except ValueError:
        raise ValueError(
            f"line {line}, column '{name[:80]}': expected a number, got '{cell[:80]}'"
        ) from None


def _uncertainty(text: str) -> dict[str, Error]:
    """Return the relative difference of the references by measure, of the text in a table."""
    try:
        known = {name: float(e) for name, e in json_value(text).items() if e is not None}
    except (ValueError, AttributeError, TypeError):
        known = {"": nan}
    if not all(map(isfinite, known.values())):
        raise ValueError("its reference uncertainty is damaged")
    return {name: Error(None, relative) for name, relative in known.items()}
