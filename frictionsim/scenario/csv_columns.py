"""Columns of numbers from CSV files: of a signal in a scenario, and of measured data.

Of a signal: `{csv = "log.csv", time = "t", value = "F_N", ...}`. With `csv` alone the file has two
columns, separated by comma, semicolon, space or tab. Any further key makes it a table of columns,
which Python's `csv` reads, with quotes around cells or without.

The first line that has all the wanted names is the header. In measured data a name may be followed
by its unit in brackets there, as in ``angular_velocity [rad/s]``, which is how results are printed
as CSV, or ``angular_velocity (rad/s)``.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise, takewhile
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


Column = Annotated[
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
    time: Column | None = Field(
        None, description="Column of the times, s, by name or number; the first if left out."
    )
    value: Column | None = Field(
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

    speed: Column | None = Field(
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


class _Point(NamedTuple):
    """The line, time, s, or speed, rad/s, and value of a point."""

    line: int
    abscissa: Any
    value: Any


class _Source(NamedTuple):
    """A key that names a column, and the index of the column from 0."""

    key: str
    column: int


def read_points(table: CsvTable, folder: Path) -> dict[str, list[float]]:
    """Return the points of a signal in a CSV file, which is relative to a folder.

    `time`, s, or `speed`, rad/s, is strictly increasing; all numbers are finite. Raises a
    PydanticCustomError if the file cannot be read, or lacks a column or a number.
    """
    path = folder / table.csv
    text = read_text(path)
    if table.has_columns:
        delimiter = table.delimiter or usual_delimiter(table.decimal, text.split("\n"))
        rows = list(_separated(text, delimiter, path))
    else:
        rows = list(_plain(text))
    sources, rows = _find_columns(table, rows, path)
    points = list(_numbers(table, rows, sources, path))
    if not points:
        what = "a speed" if table.abscissa == "speed" else "a time"
        raise inconsistent(("csv",), f"'{path}' has no lines with {what} and a value")
    if len(points) == 1:
        raise inconsistent(
            ("csv",),
            f"'{path}' has only one line with numbers, expected at least two; a constant signal is"
            f" given as a number, here {points[0].value!r}, in the place of the file",
        )
    _check_increasing(table.abscissa, points, path)
    return {
        table.abscissa: [point.abscissa for point in points],
        "value": [point.value for point in points],
    }


def _check_increasing(name: str, points: list[_Point], path: Path) -> None:
    for earlier, later in pairwise(points):
        if not later.abscissa > earlier.abscissa:
            raise inconsistent(
                ("csv",),
                f"line {later.line} of '{path}': {name}s must increase from line to line, but"
                f" {later.abscissa} {UNITS[name]} follows {earlier.abscissa} {UNITS[name]}",
            )


def read_text(path: Path, relative_to: str = "; the path is relative to the scenario") -> str:
    """Return the text of a CSV file, with one kind of line end.

    `relative_to` ends the message about a file that cannot be read.
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
        raise inconsistent(("csv",), f"cannot read '{path}' ({reason}){relative_to}") from None
    if len(content) > MAX_BYTES or text.count("\n") > MAX_LINES:
        raise inconsistent(
            ("csv",),
            f"'{path}' has more than {MAX_BYTES >> 20} MiB or {MAX_LINES} lines; expected the"
            " points of a signal, give fewer of them",
        )
    return text


def _plain(text: str) -> Iterator[CsvRow]:
    """Yield the rows of a file of two columns, with any of the usual separators."""
    for number, line in enumerate(text.splitlines(), start=1):
        cells = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if cells:
            yield CsvRow(number, cells)


def _separated(text: str, delimiter: str, path: Path) -> Iterator[CsvRow]:
    """Yield the rows of a file with one delimiter; lines that begin with # are left out."""
    import csv  # imported here: few scenarios have such a signal

    lines = text.split("\n")
    shown = ("" if line.lstrip().startswith("#") else f"{line}\n" for line in lines)
    reader = csv.reader(shown, delimiter=delimiter, strict=True)
    line = 1
    try:
        for found in reader:
            cells = [cell.strip() for cell in found]
            if delimiter == " ":
                cells = [cell for cell in cells if cell]
            if any(cells):
                yield CsvRow(line, cells)
            line = reader.line_num + 1
    except csv.Error as error:
        raise inconsistent(
            ("csv",),
            f"line {line} of '{path}', separated by {quoted(delimiter)}: not valid CSV: {error}",
        ) from None


def usual_delimiter(decimal: str, lines: Sequence[str]) -> str:
    """Return the delimiter in the first line that begins with a number, or in the first line."""
    numeric = (line for line in lines if line.lstrip(' "+-.')[:1].isdecimal())
    sample = next(numeric, lines[0])
    return next((d for d in DELIMITERS if d in sample and d != decimal), " ")


def _find_columns(
    table: CsvTable, rows: list[CsvRow], path: Path
) -> tuple[list[_Source], list[CsvRow]]:
    """Return the two columns of the signal, and the rows below the line with their names."""
    wanted: dict[str, str | int] = {
        table.abscissa: getattr(table, table.abscissa) or 1,
        "value": table.value or 2,
    }
    header = CsvRow(0, [])
    if rows and any(isinstance(name, str) for name in wanted.values()):
        header, rows = _split_at_header(table, wanted, rows, path)
    sources = [
        _Source(key, column - 1 if isinstance(column, int) else header.cells.index(column))
        for key, column in wanted.items()
        if header.cells or isinstance(column, int)
    ]
    if sources and sources[0].column == sources[-1].column:
        raise inconsistent(
            ("value",), f"column {sources[0].column + 1} is that of the {table.abscissa}, too"
        )
    return sources, rows


def _split_at_header(
    table: CsvTable, wanted: dict[str, str | int], rows: list[CsvRow], path: Path
) -> tuple[CsvRow, list[CsvRow]]:
    """Return the first row with all names, and the rows below it."""
    names = {name for name in wanted.values() if isinstance(name, str)}
    place = next((i for i, row in enumerate(rows) if names <= set(row.cells)), None)
    if place is None:
        raise _unnamed(table, wanted, rows, path)
    header = rows[place]
    for key, name in wanted.items():
        numbers = [i for i, cell in enumerate(header.cells, start=1) if cell == name]
        if len(numbers) > 1:
            raise inconsistent(
                (key,),
                f"line {header.line} of '{path}': columns {', '.join(map(str, numbers))} are all"
                f" named '{name}'; give the number of one of them",
            )
    return header, rows[place + 1 :]


def _unnamed(
    table: CsvTable, wanted: dict[str, str | int], rows: list[CsvRow], path: Path
) -> PydanticCustomError:
    """Return the error for names that no line has."""
    keys = {name: key for key, name in reversed(wanted.items()) if isinstance(name, str)}
    above = takewhile(lambda row: not _is_numeric(row, table.decimal), rows)
    accepted = [(row, set(row.cells), row.cells) for row in above]
    name, message = _no_such_column(path, [n for n in wanted.values() if n in keys], accepted)
    return inconsistent((keys[name],), message)


def _is_numeric(row: CsvRow, decimal: str) -> bool:
    return all(is_number(cell, decimal) for cell in row.cells if cell)


def _numbers(
    table: CsvTable, rows: list[CsvRow], sources: list[_Source], path: Path
) -> Iterator[_Point]:
    """Yield a point of each row, without header lines, in which none of the cells is a number."""
    begun = False
    for row in rows:
        cells = row.cells
        if table.has_columns:
            cells = [cells[s.column] if s.column < len(cells) else "" for s in sources]
        if not begun and not any(is_number(cell, table.decimal) for cell in cells):
            continue
        begun = True
        numbers = [finite_number(cell, table.decimal) for cell in cells]
        if len(cells) != len(sources) or None in numbers:
            fault = _cell_fault(table, row, sources) if table.has_columns else _line_fault(row)
            raise inconsistent(("csv",), f"line {row.line} of '{path}': {fault}")
        abscissa, value = numbers
        yield _Point(row.line, abscissa, value)


def _line_fault(row: CsvRow) -> str:
    """Return the fault of a row of a file of two columns."""
    finite = "" if any(not is_number(cell, ".") for cell in row.cells) else ", both finite"
    advice = "; of several columns, choose with time and value" if len(row.cells) > 2 else ""
    return f"expected a time and a value{finite}, got {quoted(' '.join(row.cells))}{advice}"


def _cell_fault(table: CsvTable, row: CsvRow, sources: list[_Source]) -> str:
    """Return the fault of the first cell that is no finite number."""
    for source in sources:
        if source.column >= len(row.cells):
            return f"no column {source.column + 1} for {source.key}, only {len(row.cells)}"
        cell = row.cells[source.column]
        if finite_number(cell, table.decimal) is None:
            break
    other = "," if table.decimal == "." else "."
    advice = ""
    if finite_number(cell, other) is not None:
        advice = f"; if '{other}' is the decimal mark, give decimal = \"{other}\""
    return (
        f"expected a finite number in column {source.column + 1} for {source.key}, got"
        f" {quoted(cell)}{advice}"
    )


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
    """
    try:
        text = read_text(path, "")
        delimiter = usual_delimiter(".", _lines_of_numbers(text))
        rows = list(_separated(text, delimiter, path))
    except PydanticCustomError as error:
        raise InputError((error.context or {})["message"]) from None
    if not text.strip():
        raise InputError(f"'{path}' is empty")
    decimal = "," if delimiter != "," and _has_commas(rows) else "."
    places, units, rows = _places(path, wanted, rows, decimal)
    if not rows:
        raise InputError(f"'{path}' has no lines of numbers")
    values = {
        column: [_measured(path, row, column, places[column], decimal, no_gaps) for row in rows]
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
        accepted = [
            (row, _names(line), [one.name for one in line])
            for row, line in zip(rows, headings, strict=False)
        ]
        raise NoSuchColumn(_no_such_column(path, names, accepted)[1])
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


def _measured(
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


def _no_such_column(
    path: Path, names: Sequence[str], above: Sequence[tuple[CsvRow, set[str], list[str]]]
) -> tuple[str, str]:
    """Return a name that no line has, and the message, which compares with the likely header.

    `above` are the lines that may be the header, each with the names that it has and
    those of them that a message shows.
    """
    if not above:
        return names[0], (
            f"'{path}' has no line with the names of its columns; give the number of"
            f" '{names[0]}', from 1"
        )
    row, found, shown = max(above, key=lambda line: (len(line[1] & set(names)), len(line[0].cells)))
    missing = next(name for name in names if name not in found)
    # Shortened: a file that was not meant may hold anything.
    known = [name[:MAX_NAME] for name in shown if name][:MAX_NAMES]
    return missing, f"line {row.line} of '{path}': {unknown('column', missing, known)}"


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
