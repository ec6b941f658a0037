"""The table of a cost study, and its file in CSV.

The file has a line for each setting below a heading with units. Lines above the heading that begin
with # are notes, for example about the machine. What holds for the whole study (ABOUT) has columns
of its own at the end, with the same text in each line, so that the heading stays the first.
"""

import csv
import json
from collections.abc import Mapping
from contextlib import suppress
from io import StringIO
from itertools import takewhile
from math import isfinite, nan
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from frictionsim.errors import InputError
from frictionsim.io.output_file import COSTS, write_file
from frictionsim.results import finite
from frictionsim.scenario.csv_columns import read_text

NOTE = "#"
RELATIVE = "_relative"  # end of the names of columns of relative errors
ABOUT = ("kind", "title", "set", "references", "time_references", "reference_uncertainty")
TEXTS = (
    *("law", "backend", "setting", "model", "overrides", "status", "reason", "below_uncertainty"),
    *ABOUT,
)
COUNTS = ("bodies", "events", "repeats", "steps", "rejected", "rhs_evaluations", "states")
# Of diagrams.
WORK = {"wall_seconds": "wall time, s", "rhs_evaluations": "evaluations of the right-hand side"}
TARGETS = {1e-2: "1 %", 1e-3: "0.1 %"}
BELOW = "below the reference uncertainty"
MIN_ERROR = 1e-16  # smaller errors are drawn here
REQUIRED = ("backend", "setting", "status", "error", "wall_seconds", "steps", "rhs_evaluations")


class Error(NamedTuple):
    """An absolute error, None if undefined, and a relative error."""

    absolute: float | None
    relative: float


Row = dict[str, Any]  # the values of a setting by column; a number is NaN where it is not known


class CostPanel(NamedTuple):
    """A panel of the diagram."""

    work: str  # columns, of WORK and of errors
    error: str
    title: str
    band: float  # the reference uncertainty of these errors


class CostTable(NamedTuple):
    """The table of a cost study.

    Attributes
    ----------
    columns : dict of (str, str)
        Unit and words of each column, by name; those without a unit are texts.
    rows : list of dict
        The values of each setting, by column.
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

    columns: dict[str, tuple[str, str]]
    rows: list[Row]
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

    @property
    def panels(self) -> tuple[CostPanel, CostPanel]:
        """The panels of the diagram, side by side."""
        if not self.of_meshes:
            left, right = (CostPanel(work, "error", "", self.floor) for work in WORK)
            return left, right
        limit, own = "against the limit of fine meshes", "in time alone, on the scenario's own mesh"
        return (
            CostPanel("wall_seconds", "error", limit, self.floor),
            CostPanel("wall_seconds", "time_error", own, self.time_uncertainty or 0.0),
        )


def line_of(row: Row) -> str:
    """Return the method of a row with its law and model, the name of a line in the diagram."""
    return ", ".join(filter(None, (row["backend"], row.get("law"), row.get("model"))))


def write_csv(table: CostTable, path: Path) -> None:
    """Write a table of costs as CSV atomically, with units in the header line."""
    relative = {name: finite(error.relative) for name, error in table.uncertainty.items()}
    joined = (" and ".join(names) for names in (table.references, table.time_references))
    about = (table.kind, table.title, table.overrides, *joined, json.dumps(relative))
    text = StringIO(newline="")
    writer = csv.writer(text)
    heading = (f"{n} [{unit}]" if unit else n for n, (unit, _) in table.columns.items())
    writer.writerow([*heading, *ABOUT])
    writer.writerows((*row.values(), *about) for row in table.rows)
    write_file(path, text.getvalue().encode(), COSTS)


def read_csv(path: Path) -> CostTable:
    """Read a table of costs in CSV.

    Raises
    ------
    InputError
        If it is damaged.
    """
    lines = read_text(path).split("\n")
    notes = list(takewhile(lambda line: line.startswith(NOTE), lines))
    try:
        heading, *table = csv.reader(StringIO("\n".join(lines[len(notes) :])), strict=True)
        columns = (cell.removesuffix("]").partition(" [") for cell in heading)
        units = {name: unit for name, _, unit in columns}
        for name, unit in units.items():
            if bool(unit) == (name in TEXTS):
                wanted = "text without a unit" if unit else "numbers with a unit"
                raise ValueError(f"its column '{name[:80]}' does not hold {wanted}")
        if missing := [name for name in REQUIRED if name not in units]:
            raise ValueError(f"it has no column '{missing[0]}'")
        numbered = enumerate(table, len(notes) + 2)
        rows = [_row(units, number, cells) for number, cells in numbered if cells]
        if not rows:
            raise ValueError("it has no rows")
        about = {name: rows[0].get(name, "") for name in ABOUT}
        return CostTable(
            {name: (u, name.replace("_", " ")) for name, u in units.items() if name not in ABOUT},
            rows,
            about["title"],
            about["kind"],
            about["set"],
            tuple(filter(None, [about["references"]])),
            tuple(filter(None, [about["time_references"]])),
            _uncertainty(about["reference_uncertainty"] or "{}"),
            notes=tuple(note[len(NOTE) :].strip() for note in notes),
        )
    except (ValueError, csv.Error) as error:
        raise InputError(f"{path}: cannot read this table of costs: {error}") from None


def _row(units: dict[str, str], line: int, cells: list[str]) -> Row:
    if len(cells) != len(units):
        raise ValueError(f"line {line} has {len(cells)} cells, the heading has {len(units)}")
    row: Row = dict(zip(units, cells, strict=True))
    for name in filter(units.get, units):
        try:
            row[name] = float(row[name] or nan)
        except ValueError:
            raise ValueError(
                f"line {line}, column '{name[:80]}': expected a number, got '{row[name][:80]}'"
            ) from None
    if row["status"] not in ("done", "failed"):
        raise ValueError(
            f"a row has the status '{row['status'][:80]}', which is neither done nor failed"
        )
    return row


def _uncertainty(text: str) -> dict[str, Error]:
    """Return the relative difference of the references by measure, of the text in a table."""
    with suppress(ValueError, AttributeError, TypeError):
        known = {name: float(e) for name, e in json.loads(text).items() if e is not None}
        if all(map(isfinite, known.values())):
            return {name: Error(None, relative) for name, relative in known.items()}
    raise ValueError("its reference uncertainty is damaged")
