"""Columns of numbers from a CSV file of measured data, by name or number.

The first line that has all the wanted names is the header. A name may be followed by its unit in
brackets there, as in ``angular_velocity [rad/s]``, which is how results are printed as CSV, or
``angular_velocity (rad/s)``.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic_core import PydanticCustomError

from frictionsim.errors import InputError, unknown
from frictionsim.scenario.csv_signals import (
    MAX_NAME,
    MAX_NAMES,
    CsvRow,
    CsvTable,
    finite_number,
    is_number,
    quoted,
    read_text,
    separated_rows,
    usual_delimiter,
)

Column = str | int
"""The name of a column, or its number from 1."""

HEADING = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^()]*)\))?")
NAN = float("nan")


class Heading(NamedTuple):
    """The heading of a column.

    Attributes
    ----------
    name, unit : str
        The unit is empty if it has none.
    cell : str
        Both, as they are in the file.
    """

    name: str
    unit: str
    cell: str


class NoSuchColumn(InputError):
    """A column that a file does not have."""


class Columns(NamedTuple):
    """Columns of a table of measured data.

    Attributes
    ----------
    values : dict of list of float
        By the column as it was asked for; NaN where a cell is empty.
    units : dict of str
        The unit in the heading of a column; none where it has none.
    lines : list of int
        The line of the file that each row is from.
    """

    values: dict[Column, list[float]]
    units: dict[Column, str]
    lines: list[int]


def read_columns(path: Path, wanted: Sequence[Column], no_gaps: Sequence[Column]) -> Columns:
    """Return columns of a CSV file.

    The delimiter is `;`, tab, `,` or space, as found. A comma is the decimal mark where it is not
    the delimiter and no number has a point.

    Parameters
    ----------
    path : Path
    wanted : sequence of str or int
        Names of columns, or numbers from 1.
    no_gaps : sequence of str or int
        Those of them in which each cell must have a number.

    Raises
    ------
    InputError
        If the file cannot be read, or lacks a column or a number.
    """
    try:
        text = read_text(path, "")
        delimiter = usual_delimiter(".", _lines_of_numbers(text))
        rows = list(separated_rows(CsvTable(csv=str(path), delimiter=delimiter), text, path))
    except PydanticCustomError as error:
        raise InputError((error.context or {})["message"]) from None
    if not text.strip():
        raise InputError(f"'{path}' is empty")
    decimal = "," if delimiter != "," and _has_commas(rows) else "."
    places, units, rows = _places(path, wanted, rows, decimal)
    if not rows:
        raise InputError(f"'{path}' has no lines of numbers")
    values = {
        column: [_number(path, row, column, places[column], decimal, no_gaps) for row in rows]
        for column in places
    }
    return Columns(values, units, [row.line for row in rows])


def _lines_of_numbers(text: str) -> list[str]:
    """Return the lines without comments, for the choice of the delimiter."""
    return [line for line in text.split("\n") if not line.lstrip().startswith("#")] or [""]


def _has_commas(rows: list[CsvRow]) -> bool:
    """Return whether numbers have a decimal comma, and none a point."""
    cells = [cell for row in rows for cell in row.cells]
    commas = any("," in cell and is_number(cell, ",") for cell in cells)
    return commas and not any("." in cell and is_number(cell, ".") for cell in cells)


def _places(
    path: Path, wanted: Sequence[Column], rows: list[CsvRow], decimal: str
) -> tuple[dict[Column, int], dict[Column, str], list[CsvRow]]:
    """Return the indices of the columns, their units, and the rows below the header."""
    names = [column for column in wanted if isinstance(column, str)]
    above = 0
    while above < len(rows) and not any(is_number(cell, decimal) for cell in rows[above].cells):
        above += 1
    headings = [[heading(cell) for cell in row.cells] for row in rows[:above]]
    header = next((h for h in reversed(headings) if set(names) <= _names(h)), None)
    if header is None and names:
        raise _no_such_column(path, names, rows[:above], headings)
    header = header or []
    places: dict[Column, int] = {}
    for column in wanted:
        if isinstance(column, int):
            places[column] = column - 1
            continue
        found = [i for i, one in enumerate(header) if one.cell == column] or [
            i for i, one in enumerate(header) if one.name == column
        ]
        if len(found) > 1:
            numbers = ", ".join(str(i + 1) for i in found)
            raise InputError(
                f"'{path}': columns {numbers} are all named '{column}'; give the number of one"
            )
        places[column] = found[0]
    units = {
        column: header[place].unit for column, place in places.items() if 0 <= place < len(header)
    }
    return places, {column: unit for column, unit in units.items() if unit}, rows[above:]


def heading(cell: str) -> Heading:
    """Return name and unit of a heading."""
    found = HEADING.fullmatch(cell)
    if not found or not found[1]:
        return Heading(cell, "", cell)
    return Heading(found[1], (found[2] or found[3] or "").strip(), cell)


def _names(headings: list[Heading]) -> set[str]:
    """Return the accepted names of columns, with their units or without."""
    return {name for one in headings for name in (one.name, one.cell)}


def _no_such_column(
    path: Path, names: list[str], rows: list[CsvRow], headings: list[list[Heading]]
) -> InputError:
    if not headings:
        return NoSuchColumn(
            f"'{path}' has no line with the names of its columns; give the number of"
            f" '{names[0]}', from 1"
        )
    found = [_names(line) for line in headings]
    best = max(range(len(found)), key=lambda i: (len(found[i] & set(names)), len(found[i])))
    missing = next(name for name in names if name not in found[best])
    known = [one.name[:MAX_NAME] for one in headings[best] if one.name][:MAX_NAMES]
    where = f"line {rows[best].line} of '{path}'"
    return NoSuchColumn(f"{where}: {unknown('column', missing, known)}")


def _number(
    path: Path, row: CsvRow, column: Column, place: int, decimal: str, no_gaps: Sequence[Column]
) -> float:
    where = f"line {row.line} of '{path}'"
    if not 0 <= place < len(row.cells):
        raise InputError(f"{where}: no column {place + 1}, only {len(row.cells)}")
    cell = row.cells[place]
    if (not cell or cell.lower() == "nan") and column not in no_gaps:
        return NAN
    number = finite_number(cell, decimal)
    if number is None:
        raise InputError(
            f"{where}: expected a finite number in column '{column}', got {quoted(cell)}"
        )
    return number
