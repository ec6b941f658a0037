"""Columns of numbers from CSV files: of a signal in a scenario, and of measured data.

Of a signal: `{csv = "log.csv", time = "t", value = "F_N", ...}`. With `csv` alone the file has two
columns, separated by comma, semicolon, space or tab. Any further key makes it a table of columns,
which Python's `csv` reads, with quotes around cells or without.

The first line that has all the wanted names is the header. In measured data a name may be followed
by its unit in brackets there, as in ``angular_velocity [rad/s]``, which is how results are printed
as CSV, or ``angular_velocity (rad/s)``.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import dropwhile, pairwise, takewhile
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, PlainValidator, model_validator
from pydantic_core import PydanticCustomError

from frictionsim.errors import InputError, unknown
from frictionsim.scenario.schema import Params, inconsistent

MAX_BYTES = 16 * 1024 * 1024  # more than a million points of a log
MAX_LINES = 1_000_000
MAX_TEXT = 60  # characters of a line or cell in a message
MAX_NAME, MAX_NAMES = 24, 20  # characters of a column's name in a message, and names
DELIMITERS = (";", "\t", ",")  # searched for in this order where none is given
UNITS = {"time": "s", "speed": "rad/s"}
HEADING = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^()]*)\))?")
NAN = float("nan")

NO_DELIMITERS = "\"'#+-.\r\n"  # signs of a number, of a comment, of a quotation


def _column(value: Any) -> str | int:
    if isinstance(value, str) and value.strip():
        return value.strip()
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise PydanticCustomError("column", "expected a column")  # worded in messages.py


def _delimiter(value: Any) -> str:
    one = isinstance(value, str) and len(value) == 1
    if one and not value.isalnum() and value not in NO_DELIMITERS:
        return str(value)
    raise PydanticCustomError("delimiter", "expected a delimiter")  # worded in messages.py


ColumnKey = Annotated[
    str | int,
    PlainValidator(
        _column,
        json_schema_input_type=Annotated[str, Field(pattern=r"\S")] | Annotated[int, Field(ge=1)],
    ),
]
Delimiter = Annotated[
    str,
    PlainValidator(
        _delimiter,
        json_schema_input_type=Annotated[str, Field(pattern=r"^[^0-9A-Za-z\"'#+.\r\n-]$")],
    ),
]


class CsvTable(Params):
    """`{csv = "log.csv", time = "t", value = "F_N"}`: points from columns of a file."""

    csv: str = Field(
        min_length=1, description="File, relative to the scenario; # begins a comment in it."
    )
    time: ColumnKey | None = Field(
        None, description="Column of the times, s, by name or number; the first if left out."
    )
    value: ColumnKey | None = Field(
        None, description="Column of the values, by name or number; the second if left out."
    )
    delimiter: Delimiter | None = Field(
        None, description="Character between cells; if left out `;`, tab, `,` or space, as found."
    )
    decimal: Literal[".", ","] = Field(".", description="Decimal mark of the numbers.")

    @property
    def has_columns(self) -> bool:
        """Whether any key but the file name is given."""
        return bool(self.model_fields_set - {"csv"})

    @property
    def abscissa(self) -> Literal["time", "speed"]:
        """The abscissa of the values."""
        return "time"

    @model_validator(mode="after")
    def _delimiter_is_not_the_decimal_mark(self) -> Self:
        if self.delimiter == self.decimal:
            raise inconsistent(
                ("delimiter",),
                f"'{self.delimiter}' is the decimal mark, too; give another delimiter, such as ';'",
            )
        return self


class CsvSpeedTable(CsvTable):
    """`{csv = "log.csv", speed = "w", value = "M_Nm"}`: points from columns, over a speed."""

    speed: ColumnKey | None = Field(
        None, description="Column of speeds, rad/s, by name or number, in the place of time."
    )

    @property
    def abscissa(self) -> Literal["time", "speed"]:
        return "time" if self.speed is None else "speed"

    @model_validator(mode="after")
    def _over_time_or_speed(self) -> Self:
        if self.speed is not None and self.time is not None:
            raise inconsistent(("speed",), "expected a column of time or of speed; found both")
        return self


class CsvRow(NamedTuple):
    """The cells of a line, without spaces around them; lines are counted from 1."""

    line: int
    cells: list[str]


class _SignalPoint(NamedTuple):
    """The line, time, s, or speed, rad/s, and value of a point."""

    line: int
    abscissa: Any
    value: Any


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


class ColumnError(InputError):
    """A name for which a file has no column, or several."""

    def __init__(self, column: str, message: str) -> None:
        super().__init__(message)
        self.column = column


class NoSuchColumn(ColumnError):
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

    values: dict[ColumnKey, list[float]]
    units: dict[ColumnKey, str]
    lines: list[int]


def read_points(table: CsvTable, folder: Path) -> dict[str, list[float]]:
    """Return the points of a signal in a CSV file, which is relative to a folder.

    `time`, s, or `speed`, rad/s, is strictly increasing; all numbers are finite. Raises a
    PydanticCustomError if the file cannot be read, or lacks a column or a number.
    """
    path = folder / table.csv
    wanted: dict[str, ColumnKey] = {
        table.abscissa: getattr(table, table.abscissa) or 1,
        "value": table.value or 2,
    }
    try:
        points = _points(table, wanted, path)
    except ColumnError as error:
        key = next(key for key, column in wanted.items() if column == error.column)
        raise inconsistent((key,), str(error)) from None
    except InputError as error:
        raise inconsistent(("csv",), str(error)) from None
    return {
        table.abscissa: [point.abscissa for point in points],
        "value": [point.value for point in points],
    }


def _points(table: CsvTable, wanted: dict[str, ColumnKey], path: Path) -> list[_SignalPoint]:
    text = read_text(path, "; the path is relative to the scenario")
    if table.has_columns:
        delimiter = table.delimiter or usual_delimiter(table.decimal, text.split("\n"))
        rows = list(separated(text, delimiter, path))
    else:
        rows = list(_plain(text))
    columns = _find_columns(path, list(wanted.values()), rows, table.decimal, has_units=False)
    if not columns.rows:
        what = "a speed" if table.abscissa == "speed" else "a time"
        raise InputError(f"'{path}' has no lines with {what} and a value")
    places = {key: columns.places[column] for key, column in wanted.items()}
    if places[table.abscissa] == places["value"]:
        raise inconsistent(
            ("value",), f"column {places['value'] + 1} is that of the {table.abscissa}, too"
        )
    points = []
    for row in columns.rows:
        if not table.has_columns and len(row.cells) != 2:
            raise InputError(f"line {row.line} of '{path}': {_line_fault(row)}")
        numbers = [_number(table, path, row, key, place) for key, place in places.items()]
        points.append(_SignalPoint(row.line, *numbers))
    if len(points) == 1:
        raise InputError(
            f"'{path}' has only one line with numbers, expected at least two; a constant signal is"
            f" given as a number, here {points[0].value!r}, in the place of the file"
        )
    _check_increasing(table.abscissa, points, path)
    return points


def _check_increasing(name: str, points: list[_SignalPoint], path: Path) -> None:
    for earlier, later in pairwise(points):
        if not later.abscissa > earlier.abscissa:
            raise InputError(
                f"line {later.line} of '{path}': {name}s must increase from line to line, but"
                f" {later.abscissa} {UNITS[name]} follows {earlier.abscissa} {UNITS[name]}"
            )


def _number(table: CsvTable, path: Path, row: CsvRow, key: str, place: int) -> float:
    """Return the number of a point, with advice if there is none."""
    try:
        return number_in(path, row, place, f" for {key}", table.decimal)
    except InputError as error:
        if not table.has_columns:
            raise InputError(f"line {row.line} of '{path}': {_line_fault(row)}") from None
        other = "," if table.decimal == "." else "."
        if place < len(row.cells) and finite_number(row.cells[place], other) is not None:
            raise InputError(
                f"{error}; if '{other}' is the decimal mark, give decimal = \"{other}\""
            ) from None
        raise


def _line_fault(row: CsvRow) -> str:
    """Return the fault of a row of a file of two columns."""
    finite = "" if any(not is_number(cell, ".") for cell in row.cells) else ", both finite"
    advice = "; of several columns, choose with time and value" if len(row.cells) > 2 else ""
    return f"expected a time and a value{finite}, got {quoted(' '.join(row.cells))}{advice}"


def read_columns(path: Path, wanted: Sequence[ColumnKey], no_gaps: Sequence[ColumnKey]) -> Columns:
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
    """
    text = read_text(path)
    delimiter = usual_delimiter(".", _lines_of_numbers(text))
    rows = list(separated(text, delimiter, path))
    if not text.strip():
        raise InputError(f"'{path}' is empty")
    decimal = "," if delimiter != "," and _has_commas(rows) else "."
    columns = _find_columns(path, wanted, rows, decimal, has_units=True)
    if not columns.rows:
        raise InputError(f"'{path}' has no lines of numbers")

    def number(row: CsvRow, column: ColumnKey, place: int) -> float:
        cell = row.cells[place] if 0 <= place < len(row.cells) else None
        if cell is not None and cell.lower() in ("", "nan") and column not in no_gaps:
            return NAN
        return number_in(path, row, place, f" ('{column}')" * isinstance(column, str), decimal)

    values = {
        c: [number(row, c, place) for row in columns.rows] for c, place in columns.places.items()
    }
    return Columns(values, columns.units, [row.line for row in columns.rows])


def _lines_of_numbers(text: str) -> list[str]:
    """Return the lines without comments, for the choice of the delimiter."""
    return [line for line in text.split("\n") if not line.lstrip().startswith("#")] or [""]


def _has_commas(rows: list[CsvRow]) -> bool:
    """Return whether numbers have a decimal comma, and none a point."""
    cells = [cell for row in rows for cell in row.cells]
    commas = any("," in cell and is_number(cell, ",") for cell in cells)
    return commas and not any("." in cell and is_number(cell, ".") for cell in cells)


def read_text(path: Path, advice: str = "") -> str:
    """Return the text of a CSV file, with one kind of line end.

    `advice` ends the message about a file that cannot be read.
    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise OSError(0, "this is a device or a pipe")  # which may have no end, or no writer
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        text = content[:MAX_BYTES].decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or (
            "it is not UTF-8 text" if isinstance(error, UnicodeError) else error
        )
        raise InputError(f"cannot read '{path}' ({reason}){advice}") from None
    if len(content) > MAX_BYTES or text.count("\n") > MAX_LINES:
        raise InputError(
            f"'{path}' has more than {MAX_BYTES >> 20} MiB or {MAX_LINES} lines; give fewer lines"
        )
    return text


def _plain(text: str) -> Iterator[CsvRow]:
    """Yield the rows of a file of two columns, with any of the usual separators."""
    for number, line in enumerate(text.splitlines(), start=1):
        cells = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if cells:
            yield CsvRow(number, cells)


def separated(text: str, delimiter: str, path: Path) -> Iterator[CsvRow]:
    """Yield the rows of a file with one delimiter; lines that begin with # are left out."""
    import csv  # imported here: few scenarios have such a signal

    lines = text.split("\n")
    shown = ("" if line.lstrip().startswith("#") else f"{line}\n" for line in lines)
    reader = csv.reader(shown, delimiter=delimiter, strict=True)
    line = 1
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if delimiter == " ":
                cells = [cell for cell in cells if cell]
            if any(cells):
                yield CsvRow(line, cells)
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(
            f"line {line} of '{path}', separated by {quoted(delimiter)}: not valid CSV: {error}"
        ) from None


def usual_delimiter(decimal: str, lines: Sequence[str]) -> str:
    """Return the delimiter in the first line that begins with a number, or in the first line."""
    numeric = (line for line in lines if line.lstrip(' "+-.')[:1].isdecimal())
    sample = next(numeric, lines[0])
    return next((d for d in DELIMITERS if d in sample and d != decimal), " ")


class _NumberRows(NamedTuple):
    """The places of columns from 0, their units, and the rows of numbers."""

    places: dict[ColumnKey, int]
    units: dict[ColumnKey, str]
    rows: list[CsvRow]


def _find_columns(
    path: Path, wanted: Sequence[ColumnKey], rows: list[CsvRow], decimal: str, *, has_units: bool
) -> _NumberRows:
    """Return where columns are, by the first row that has all names, and the rows of numbers below.

    `has_units` is for measured data: it accepts names that are followed by a unit there, and
    takes each row with a number as one of the data.
    """
    if not rows:
        return _NumberRows({}, {}, [])
    names = [column for column in wanted if isinstance(column, str)]
    header, line = list[Heading](), 0
    heading_of = heading if has_units else _plain_heading
    if names:
        headings = (([heading_of(cell) for cell in row.cells], i) for i, row in enumerate(rows))
        place = next(((h, i) for h, i in headings if set(names) <= _names(h)), None)
        if place is None:
            raise _no_such_column(path, names, rows, decimal, heading_of)
        header, above = place
        line, rows = rows[above].line, rows[above + 1 :]
    places: dict[ColumnKey, int] = {}
    for column in wanted:
        if isinstance(column, int):
            places[column] = column - 1
            continue
        equal = [i for i, one in enumerate(header) if one.cell == column] or [
            i for i, one in enumerate(header) if one.name == column
        ]
        if len(equal) > 1:
            numbers = ", ".join(str(i + 1) for i in equal)
            raise ColumnError(
                column,
                f"line {line} of '{path}': columns {numbers} are all named '{column}'; give the"
                " number of one of them",
            )
        places[column] = equal[0]

    def has_number(row: CsvRow) -> bool:
        cells = row.cells
        if not has_units:
            cells = [cells[place] for place in places.values() if place < len(cells)]
        return any(is_number(cell, decimal) for cell in cells)

    below = list(dropwhile(lambda row: not has_number(row), rows))
    if not names and len(below) < len(rows):
        header = [heading_of(cell) for cell in rows[-len(below) - 1].cells]
    units = {c: header[i].unit for c, i in places.items() if 0 <= i < len(header)}
    return _NumberRows(places, {column: unit for column, unit in units.items() if unit}, below)


def heading(cell: str) -> Heading:
    """Return name and unit of a heading."""
    match = HEADING.fullmatch(cell)
    if not match or not match[1]:
        return _plain_heading(cell)
    return Heading(match[1], (match[2] or match[3] or "").strip(), cell)


def _plain_heading(cell: str) -> Heading:
    return Heading(cell, "", cell)


def _names(headings: list[Heading]) -> set[str]:
    """Return the accepted names of columns, with their units or without."""
    return {name for one in headings for name in (one.name, one.cell)}


def _no_such_column(
    path: Path,
    names: Sequence[str],
    rows: Sequence[CsvRow],
    decimal: str,
    heading_of: Callable[[str], Heading],
) -> NoSuchColumn:
    """Return the error for names that no row has, which compares with the likely header."""
    above = list(takewhile(lambda row: not _is_numeric(row, decimal), rows))
    if not above:
        return NoSuchColumn(
            names[0],
            f"'{path}' has no line with the names of its columns; give the number of"
            f" '{names[0]}', from 1",
        )
    lines = [(row, [heading_of(cell) for cell in row.cells]) for row in above]

    def likeness(line: tuple[CsvRow, list[Heading]]) -> tuple[int, int, int]:
        matches = len(_names(line[1]) & {*names})
        return matches, -sum(is_number(cell, decimal) for cell in line[0].cells), len(line[1])

    row, header = max(lines, key=likeness)
    missing = next(name for name in names if name not in _names(header))
    # Shortened: a file that was not meant may hold anything.
    known = [one.name[:MAX_NAME] for one in header if one.name][:MAX_NAMES]
    return NoSuchColumn(
        missing, f"line {row.line} of '{path}': {unknown('column', missing, known)}"
    )


def _is_numeric(row: CsvRow, decimal: str) -> bool:
    return all(is_number(cell, decimal) for cell in row.cells if cell)


def number_in(path: Path, row: CsvRow, place: int, of: str, decimal: str) -> float:
    """Return the finite number in a cell of a row; `of` names the quantity in messages."""
    where = f"line {row.line} of '{path}'"
    if not 0 <= place < len(row.cells):
        raise InputError(f"{where}: no column {place + 1}{of}, only {len(row.cells)}")
    number = finite_number(row.cells[place], decimal)
    if number is None:
        raise InputError(
            f"{where}: expected a finite number in column {place + 1}{of}, got"
            f" {quoted(row.cells[place])}"
        )
    return number


def finite_number(cell: str, decimal: str) -> float | None:
    """Return the number in a cell; None if it is not a finite one."""
    if not is_number(cell, decimal):
        return None
    number = float(cell.replace(decimal, "."))
    return number if isfinite(number) else None


def is_number(cell: str, decimal: str) -> bool:
    if "_" in cell or (decimal != "." and "." in cell):
        return False
    try:
        float(cell.replace(decimal, "."))
    except ValueError:
        return False
    return True


def quoted(text: str) -> str:
    return "a tab" if text == "\t" else f"'{text[:MAX_TEXT]}'"
