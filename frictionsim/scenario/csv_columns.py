"""Columns of numbers from CSV files: of a signal in a scenario, and of measured data.

The delimiter is the first of `;`, tab and `,` that is in most of the lines, else blanks. With
another one than a comma, the decimal mark is that of the first number with a point or comma. Cells
may be in double quotes; # begins a comment at the start of a line, and behind numbers. The header
is the first line with all names that are asked for, or else the line above the numbers, also if it
is a comment. Units are in the header, see `units.heading`, or in a line of units below it.
"""

import csv
import re
from collections.abc import Collection, Sequence
from io import StringIO
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

from frictionsim.errors import InputError, counted, unknown
from frictionsim.scenario.arguments import ColumnKey
from frictionsim.scenario.units import bare, factor, fits, heading, is_unit

MAX_SIZE = 16 * 1024 * 1024  # characters, a million points of a log
MAX_TEXT, MAX_NAMES = 60, 20  # characters of a cell in a message, and names of columns
MAX_HEAD = 1000  # lines in which a header is searched for
GAPS = ("", "nan")  # cells of data that were not measured
DELIMITERS = (";", "\t", ",")
NUMBER = r'[ \t]*"?[-+]?[.,]?\d'  # what a line of numbers begins with
SEPARATED = re.compile(r"\d[.,' _]\d")  # of decimals or thousands
HEADER_IN_COMMENT = re.compile(rf"\A((?:\s*#.*\n)*?\s*)#+ *(.*\n{NUMBER})")
COMMENT = re.compile(rf"^([ \t]*|{NUMBER}[^#\n]*)#.*", re.MULTILINE)
BETWEEN_BLANKS = re.compile(r'"[^"]*"|[^\s("\[]*[ \t]*[(\[][^)\]]*[)\]]\S*|\S+')  # `F [N]` is one


class Row(NamedTuple):
    """The cells of a line, up to the last one that is not empty."""

    path: Path
    line: int  # from 1
    cells: list[str]

    @property
    def where(self) -> str:
        """The line in words."""
        return f"line {self.line} of '{self.path}'"

    def cell(self, place: int) -> str:
        """Return the cell at a place from 0; empty if there is none."""
        return self.cells[place] if 0 <= place < len(self.cells) else ""

    def places(self, name: str) -> list[int]:
        """Return the places of the columns with a name in a header, from 0."""
        whole = [i for i, cell in enumerate(self.cells) if name == cell]
        return whole or [i for i, cell in enumerate(self.cells) if name == heading(cell).name]

    def place(self, name: str) -> int:
        """Return the place of the only column with a name."""
        place, *others = self.places(name)
        if others:
            numbers = ", ".join(str(i + 1) for i in (place, *others))
            raise InputError(
                f"{self.where}: columns {numbers} are all named '{name}'; give the number of one of"
                " them"
            )
        return place


class NoSuchColumn(InputError):
    """A column that a file does not have."""


class CsvColumn(NamedTuple):
    """Numbers of a column, NaN where it has none; its place; its unit, and where this stands.

    What may be a part of the name, `N` in F_N, is its unit only if it fits (`is_certain`).
    """

    values: list[float]
    place: int
    unit: str = ""
    where: str = ""
    is_certain: bool = True

    def factor(self, model_unit: str) -> float:
        """Return the size of its unit in that of the model; raise InputError if it has none."""
        try:
            return factor(self.unit_in(model_unit) or model_unit, model_unit)
        except InputError as error:
            raise InputError(
                f"{self.where}: {error}; convert the numbers, or choose another column; if this is"
                " no unit, write the heading without it"
            ) from None

    def unit_in(self, model_unit: str) -> str:
        """Return its unit; empty if it has none, or may have none and that does not fit."""
        return self.unit if self.is_certain or fits(self.unit, model_unit) else ""


def read_columns(
    path: Path,
    wanted: Sequence[ColumnKey],
    no_gaps: Collection[ColumnKey],
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    are_all: bool = False,
) -> tuple[dict[ColumnKey, CsvColumn], list[int]]:
    """Return columns by name, or number from 1, and the line that each of their rows is from.

    In those without gaps each cell must have a number. Delimiter and decimal mark are as found if
    left out; `are_all` forbids further columns.
    """
    text = COMMENT.sub(r"\1", HEADER_IN_COMMENT.sub(r"\1\2", read_text(path)))
    if not delimiter:
        lines = [line for line in text.split("\n") if line.strip()]
        in_most = (d for d in DELIMITERS if 2 * sum(d in line for line in lines) > len(lines))
        delimiter = next((d for d in in_most if d != decimal), " ")
    rows = _separated(text, delimiter, path)
    head, body, places = _parts(path, rows, wanted)
    if not decimal:  # one in all numbers: beside 1.5 the comma of 1,234 may be that of thousands
        cells = (row.cell(place) for row in body for place in places.values())
        mark = next((mark for cell in cells for mark in ".," if mark in cell), ".")
        decimal = "." if delimiter == "," else mark
    columns = {c: CsvColumn([], place, *_unit(head, place)) for c, place in places.items()}
    is_named = any(isinstance(column, str) for column in wanted)
    width = len(wanted) if are_all else len(head[0].cells) if is_named else 0
    for row in body:
        count = len(row.cells)
        if width and (count > width or (are_all and count < width)):
            hint = "; with decimal commas another delimiter is needed" * (delimiter == ",")
            hint = "; of several columns, choose by name or number" if are_all else hint
            found = delimiter.join(row.cells)[:MAX_TEXT]
            raise InputError(f"{row.where}: expected {width} cells, got {count}: '{found}'{hint}")
        for column, (values, place, *_) in columns.items():
            cell = row.cell(place)
            number = _number(cell, decimal)
            if number is not None and isfinite(number):
                values.append(number)
            elif cell.lower() in GAPS and column not in no_gaps:
                values.append(nan)
            else:
                name = f" ('{column}')" * isinstance(column, str)
                mark = f"; the decimal mark is '{decimal}'; separators of thousands are not read"
                raise InputError(
                    f"{row.where}: expected a finite number in column {place + 1}{name}, got"
                    f" '{cell[:MAX_TEXT]}'{mark * bool(SEPARATED.search(cell))}"
                )
    return columns, [row.line for row in body]


def _parts(
    path: Path, rows: list[Row], wanted: Sequence[ColumnKey]
) -> tuple[list[Row], list[Row], dict[ColumnKey, int]]:
    """Return the rows of the header, those of numbers, and the places of the columns."""
    if not rows:
        raise InputError(f"'{path}' is empty")
    names = [column for column in wanted if isinstance(column, str)]
    header = _header(path, rows[:MAX_HEAD], names) if names else -1
    places = {c: c - 1 if isinstance(c, int) else rows[header].place(c) for c in wanted}
    most = max(len(row.cells) for row in rows)
    if over := [column for column, place in places.items() if place >= most]:
        raise InputError(f"'{path}' has {counted(most, 'column')}, and no number {over[0]}")
    first = header + 1
    while first < len(rows) and not any(_is_number(rows[first].cell(i)) for i in places.values()):
        first += 1
    if first == len(rows):
        raise InputError(f"'{path}' has no lines of numbers")
    if not names:  # the line above the numbers, or the one above that of units
        above = rows[max(first - 1, 0) : first]
        header = max(first - 1 - any(is_unit(bare(c)) for row in above for c in row.cells), 0)
    return rows[header:first], rows[first:], places


def _number(cell: str, mark: str) -> float | None:
    """Return the number in a cell, with a decimal mark; None if there is none."""
    if "_" in cell or (mark == "," and "." in cell):
        return None
    try:
        return float(cell.replace(mark, "."))
    except ValueError:
        return None


def _is_number(cell: str) -> bool:
    return _number(cell, ".") is not None or _number(cell, ",") is not None


def read_text(path: Path) -> str:
    """Return the text of a CSV file."""
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise OSError(0, "this is a device or a pipe")  # which may have no end, or no writer
        with path.open(encoding="utf-8-sig") as file:
            text = file.read(MAX_SIZE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        if isinstance(error, UnicodeError):
            reason = "it is not UTF-8 text; save it as UTF-8"
        raise InputError(f"cannot read '{path}' ({reason})") from None
    if len(text) > MAX_SIZE:
        raise InputError(f"'{path}' has more than {MAX_SIZE >> 20} MiB; give fewer lines")
    return text


def _separated(text: str, delimiter: str, path: Path) -> list[Row]:
    """Return the rows of a text without comments that are not empty."""
    if delimiter == " ":  # of which there may be several, and tabs
        lines = text.split("\n")
        table = [(n, BETWEEN_BLANKS.findall(line)) for n, line in enumerate(lines, 1)]
    else:
        reader = csv.reader(StringIO(text), delimiter=delimiter, strict=True, skipinitialspace=True)
        table, line = [], 1
        try:
            for cells in reader:
                table.append((line, cells))
                line = reader.line_num + 1
        except csv.Error as error:
            raise InputError(f"line {line} of '{path}': not valid CSV: {error}") from None
    rows = []
    for number, cells in table:
        cells = [cell.strip(' "' if delimiter == " " else None) for cell in cells]
        if count := max((place for place, cell in enumerate(cells, 1) if cell), default=0):
            rows.append(Row(path, number, cells[:count]))
    return rows


def _header(path: Path, rows: list[Row], names: list[str]) -> int:
    """Return the number of the first row that has all names."""
    for number, row in enumerate(rows):
        if all(row.places(name) for name in names):
            return number
    texts = [row for row in rows if not any(map(_is_number, row.cells))]
    if not texts:
        raise NoSuchColumn(
            f"'{path}' has no line with the names of its columns; give the number of"
            f" '{names[0]}', from 1"
        )
    # Above it may stand a title, with empty cells behind.
    likely = max(texts, key=lambda row: sum(map(bool, row.cells)))
    missing = next(name for name in names if not likely.places(name))
    known = [heading(cell).name[:MAX_TEXT] for cell in likely.cells if cell]
    raise NoSuchColumn(f"{likely.where}: {unknown('column', missing, known[:MAX_NAMES])}")


def _unit(head: list[Row], place: int) -> tuple[str, str, bool]:
    """Return the unit of a column, where it stands, and whether it is certain to be one."""
    unit, where, is_certain = "", "", True
    for row in head:
        cell = row.cell(place)
        here = f"{row.where}, unit of column {place + 1}, '{cell[:MAX_TEXT]}'"
        _, found, certain = heading(cell) if row is head[0] else ("", bare(cell).strip("-"), True)
        if unit and is_certain and found not in ("", unit):
            raise InputError(f"{here}: another unit than in {where}")
        if found or not where:
            unit, where, is_certain = found, here, certain
    return unit, where, is_certain
