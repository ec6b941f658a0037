"""Columns of numbers from CSV files: of a signal in a scenario, and of measured data.

The delimiter is that which the file is said to have, or the first of `;`, tab, `,` and blank that
stands outside quotes in the first line of numbers. With another one than a comma, a comma in a
number is the decimal mark. Cells may be in quotes; lines that begin with # are comments.

The header is the first line with all names that are asked for, or else the last line above the
numbers; also a comment right above these. A column may have its unit there, ``F [kN]``, ``F (kN)``,
``F/kN``, ``F in kN``, ``F, kN`` or ``F_kN``, or in a line below.
"""

import csv
import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from itertools import islice, pairwise, takewhile
from math import isfinite, nan
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, PlainValidator, model_validator
from pydantic_core import PydanticCustomError

from frictionsim.errors import InputError, unknown
from frictionsim.scenario.schema import Params, inconsistent
from frictionsim.scenario.units import WRITTEN, factor, fits, is_unit

MAX_BYTES = 16 * 1024 * 1024  # more than a million points of a log
MAX_LINES = 1_000_000
MAX_TEXT = 60  # characters of a line or cell in a message
MAX_NAME, MAX_NAMES = 24, 20  # characters of a column's name in a message, and names
DELIMITERS = (";", "\t", ",")  # searched for in this order where none is given
MAX_ABOVE = 1000  # lines in which the first one of numbers is searched for
QUOTED = re.compile(r'"[^"]*"')
IN_BRACKETS = re.compile(r"\s*(?:\[[^\[\]]*\]|\([^()]*\)|\{[^{}]*\}|<[^<>]*>)")
# What stands between a name and its unit; behind the last two another word may stand as well.
BEFORE_UNIT = re.compile(r"(.*?\S)(?:\s*(?P<sign>/|,)\s*|\s+(?P<word>in)\s+|_|\s+)")
BEHIND_NAME = re.compile(r"(?<=[^\s\])])\s*(?:\[[^\[\]]*\]|\([^()]*\))")
NO_UNIT = ("", "-")  # cells in a line of units
GAPS = ("", "nan")  # cells of data that were not measured

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
        None, description="Column of the times, by name or number; the first if left out."
    )
    value: ColumnKey | None = Field(
        None, description="Column of the values, by name or number; the second if left out."
    )
    delimiter: Delimiter | None = Field(
        None, description="Character between cells; if left out `;`, tab, `,` or blank, as found."
    )
    decimal: Literal[".", ","] | None = Field(
        None, description="Decimal mark of the numbers; if left out as found."
    )

    @property
    def argument(self) -> tuple[str, str]:
        """What the values depend on, and its unit."""
        return "time", "s"

    @model_validator(mode="after")
    def _delimiter_is_not_the_decimal_mark(self) -> Self:
        if self.delimiter is not None and self.delimiter == self.decimal:
            raise inconsistent(
                ("delimiter",),
                f"'{self.delimiter}' is the decimal mark, too; give another delimiter, such as ';'",
            )
        return self


class CsvSpeedTable(CsvTable):
    """`{csv = "log.csv", speed = "w", value = "M_Nm"}`: points from columns, over a speed."""

    speed: ColumnKey | None = Field(
        None, description="Column of speeds, by name or number, in the place of time."
    )

    @property
    def argument(self) -> tuple[str, str]:
        return ("time", "s") if self.speed is None else ("speed", "rad/s")

    @model_validator(mode="after")
    def _over_time_or_speed(self) -> Self:
        if self.speed is not None and self.time is not None:
            raise inconsistent(("speed",), "expected a column of time or of speed; found both")
        return self


class CsvRow(NamedTuple):
    """The cells of a line, without spaces around them; lines are counted from 1."""

    line: int
    cells: list[str]


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
            return factor(self.unit or model_unit, model_unit)
        except InputError as error:
            if not self.is_certain:
                return 1.0
            raise InputError(
                f"{self.where}: {error}; convert the numbers, or choose another column; if this is"
                " no unit, write the heading without it"
            ) from None

    def unit_in(self, model_unit: str) -> str:
        """Return its unit; empty if it has none, or may have none and that does not fit."""
        return self.unit if self.is_certain or fits(self.unit, model_unit) else ""

    def in_unit(self, model_unit: str) -> list[float]:
        """Return the numbers in the unit of the model."""
        size = self.factor(model_unit)
        return [number * size for number in self.values]


def read_points(table: CsvTable, folder: Path, unit: str) -> dict[str, list[float]]:
    """Return the points of a signal in a CSV file, which is relative to a folder.

    The values are in `unit`, whatever that in the file is. Raises a PydanticCustomError if the
    file cannot be read, or lacks a column or a number, or if a unit is not known or does not fit.
    """
    path, (argument, its_unit) = folder / table.csv, table.argument
    wanted: list[ColumnKey] = [getattr(table, argument) or 1, table.value or 2]
    try:
        columns, lines = read_columns(
            path,
            wanted,
            wanted,
            delimiter=table.delimiter,
            decimal=table.decimal,
            are_all=not table.model_fields_set - {"csv"},
            advice="; the path is relative to the scenario",
        )
        x, y = (columns[column] for column in wanted)
        if x.place == y.place:
            raise InputError(f"'{path}': column {y.place + 1} is that of the {argument}, too")
        points, values = x.in_unit(its_unit), y.in_unit(unit)
        if len(lines) == 1:
            raise InputError(
                f"'{path}' has only one line with numbers, expected at least two; a constant signal"
                f" is given as a number, here {values[0]!r}, in the place of the file"
            )
        for line, (earlier, later) in zip(lines[1:], pairwise(points), strict=True):
            if not later > earlier:
                raise InputError(
                    f"line {line} of '{path}': {argument}s must increase from line to line, but"
                    f" {later} {its_unit} follows {earlier} {its_unit}"
                )
    except InputError as error:
        raise inconsistent(("csv",), str(error)) from None
    return {argument: points, "value": values}


def read_columns(
    path: Path,
    wanted: Sequence[ColumnKey],
    no_gaps: Collection[ColumnKey],
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    are_all: bool = False,
    advice: str = "",
) -> tuple[dict[ColumnKey, CsvColumn], list[int]]:
    """Return columns by name, or number from 1, and the line that each of their rows is from.

    In those without gaps each cell must have a number. Delimiter and decimal mark are as found if
    left out; `are_all` forbids further columns; `advice` is for a file that cannot be read.
    """
    text = read_text(path, advice)
    if not text.strip():
        raise InputError(f"'{path}' is empty")
    delimiter = delimiter or find_delimiter(text, decimal)
    rows = list(separated(text, delimiter, path))
    names = [column for column in wanted if isinstance(column, str)]
    if rows and (comment := _heading_in_comment(text, delimiter, rows[0])):
        rows.insert(0, comment)
    header = _find_header(path, rows, names) if names else -1
    places = {c: c - 1 if isinstance(c, int) else _place(path, rows[header], c) for c in wanted}

    def numbers(row: CsvRow) -> list[str]:
        cells = [row.cells[i] for i in places.values() if 0 <= i < len(row.cells)]
        return [cell for cell in cells if number_in(cell) is not None]

    first = next((i for i in range(header + 1, len(rows)) if numbers(rows[i])), len(rows))
    if first == len(rows):
        raise InputError(f"'{path}' has no lines of numbers")
    # One mark in all numbers: beside 1.5 the comma of 1,234 may be that of the thousands.
    points = delimiter == "," or any(
        "." in "".join(numbers(row)) for row in rows[first:] if "." in "".join(row.cells)
    )
    decimal = decimal or ("." if points else ",")
    units = _units(path, rows[max(header, 0) : first], places, None if names else rows[first])
    columns = {c: CsvColumn([], place, *units.get(c, ())) for c, place in places.items()}
    for row in rows[first:]:
        if are_all and _width(row) != len(places):
            advice = "; of several columns, choose with time and value" * (len(row.cells) > 2)
            raise InputError(
                f"line {row.line} of '{path}': expected a time and a value, got"
                f" {quoted(' '.join(row.cells))}{advice}"
            )
        for column, place in places.items():
            cell = row.cells[place] if 0 <= place < len(row.cells) else ""
            number = number_in(cell, decimal)
            if column not in no_gaps and 0 <= place < len(row.cells) and cell.lower() in GAPS:
                number = nan
            elif number is None or not isfinite(number):
                raise InputError(_fault(path, row, column, place, decimal))
            columns[column].values.append(number)
    return columns, [row.line for row in rows[first:]]


def _fault(path: Path, row: CsvRow, column: ColumnKey, place: int, decimal: str) -> str:
    """Return the message for a cell without a finite number, or that is not there."""
    where = f"line {row.line} of '{path}'"
    of = f"column {place + 1}" + f" ('{column}')" * isinstance(column, str)
    if not 0 <= place < len(row.cells):
        return f"{where}: no {of}, only {len(row.cells)}"
    cell = row.cells[place]
    other = number_in(cell, decimal) is None and number_in(cell) is not None
    advice = f"; the decimal mark is '{decimal}' here" * other
    return f"{where}: expected a finite number in {of}, got {quoted(cell)}{advice}"


def number_in(cell: str, *marks: str) -> float | None:
    """Return the number in a cell, behind which a comment may stand; None if there is none.

    It has one of the decimal marks; any if none is given.
    """
    text = cell.partition("#")[0] if "#" in cell else cell
    for mark in marks or (".", ","):
        if "_" not in text and (mark == "." or "." not in text):
            try:
                return float(text if mark == "." else text.replace(mark, "."))
            except ValueError:
                pass
    return None


def _width(row: CsvRow) -> int:
    """Return the number of cells of a row, without empty ones and a comment at its end."""
    cells = [*takewhile(lambda cell: not cell.startswith("#"), row.cells)]
    ends = (i + 1 for i, cell in enumerate(cells) if "#" in cell)
    return next(ends, max((i + 1 for i, cell in enumerate(cells) if cell), default=0))


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


def find_delimiter(text: str, decimal: str | None) -> str:
    """Return the first usual delimiter outside quotes in the first line of numbers.

    That is one with numbers alone, or else one with some, or else the first line.
    """

    def delimiter_in(line: str) -> str:
        bare = QUOTED.sub("", line)
        return next((d for d in DELIMITERS if d in bare and d != decimal), " ")

    def likeness(line: str) -> int:
        cells = [cell.strip(' "') for cell in line.split(delimiter_in(line)) if cell]
        numbers = sum(number_in(cell) is not None for cell in cells)
        return 3 if 1 < numbers == len(cells) else min(numbers, 2)

    lines = (line.partition("#")[0].strip(" ") for line in text.split("\n"))
    return delimiter_in(max(islice(filter(None, lines), MAX_ABOVE), key=likeness, default=""))


def separated(text: str, delimiter: str, path: Path) -> Iterator[CsvRow]:
    """Yield the rows of a file with one delimiter; lines that begin with # are left out."""
    is_blank = delimiter == " "  # of which there may be several
    behind_quotes = re.compile(f'" +(?={re.escape(delimiter)}|$)')

    def prepared(line: str) -> str:
        if line.lstrip().startswith("#"):
            return "\n"
        if is_blank:  # a unit belongs to the name before it, which another kind of blank tells
            line = BEHIND_NAME.sub(lambda m: m[0].replace(" ", "\xa0"), line.replace("\t", " "))
        return (behind_quotes.sub('"', line) if '"' in line else line) + "\n"

    reader = csv.reader(
        map(prepared, text.split("\n")),
        delimiter=delimiter,
        strict=True,
        skipinitialspace=not is_blank,
    )
    line = 1
    try:
        for row in reader:
            cells = [cell.strip().replace("\xa0", " ") for cell in row if cell or not is_blank]
            if any(cells):
                yield CsvRow(line, cells)
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(
            f"line {line} of '{path}', separated by {quoted(delimiter)}: not valid CSV: {error}"
        ) from None


class Heading(NamedTuple):
    """The name of a column and its unit, which may be a part of the name if not certain."""

    name: str
    unit: str = ""
    is_certain: bool = True


def heading(cell: str) -> Heading:
    """Return name and unit of a heading.

    The unit is a known one in brackets, or else what ends the heading in brackets, or a known one
    at its end behind `/`, `,`, `in`, `_` or a blank, or alone.
    """
    found = [m for m in IN_BRACKETS.finditer(cell) if _bare(m[0])]
    units = [m for m in found if is_unit(_bare(m[0]))] or [m for m in found if m.end() == len(cell)]
    for match in units[-1:]:
        name = f"{cell[: match.start()]} {cell[match.end() :]}".strip()
        return Heading(name or cell, _bare(match[0]))
    for unit in WRITTEN:
        if cell == unit:
            return Heading(cell, unit, is_certain=False)
        if cell.endswith(unit) and (before := BEFORE_UNIT.fullmatch(cell[: -len(unit)])):
            return Heading(before[1], unit, bool(before["sign"] or before["word"]))
    return Heading(cell)


def _heading_in_comment(text: str, delimiter: str, first: CsvRow) -> CsvRow | None:
    """Return the comment right above the first row, if this is of numbers, with as many cells."""
    lines = text.split("\n")[: first.line - 1]
    above = lines[-1].strip() if lines else ""
    if not above.startswith("#") or None in map(number_in, filter(None, first.cells)):
        return None
    with suppress(InputError):
        for row in separated(above.lstrip("# "), delimiter, Path()):
            if len(row.cells) == len(first.cells):
                return CsvRow(first.line - 1, row.cells)
    return None


def _bare(cell: str) -> str:
    """Return a unit without the brackets that may be around it."""
    return cell.strip(" []()<>{}")


def _units(
    path: Path, head: list[CsvRow], places: dict[ColumnKey, int], data: CsvRow | None
) -> dict[ColumnKey, tuple[str, str, bool]]:
    """Return the units of columns, where they stand, and whether they are certain to be units.

    `head` are the lines from the header to the numbers. Without names it may have lines above the
    header, which has as many cells as `data`, the first line of numbers.
    """

    def has_units(row: CsvRow, *, alone: bool = False) -> bool:
        units = [unit for unit in map(_bare, row.cells) if unit not in NO_UNIT]
        return all(map(is_unit, units)) if alone else any(is_unit(u) for u in units if u != "1")

    if data is not None:
        widths = {len(data.cells), _width(data)}
        fitting = [i for i, row in enumerate(head) if widths & {len(row.cells), _width(row)}][-2:]
        for row in head[fitting[-1] + 1 if fitting else 0 :]:
            for unit in map(_bare, re.findall(r"\[.*?\]|\(.*?\)", " ".join(row.cells))):
                if is_unit(unit) and unit != "1":
                    raise InputError(
                        f"line {row.line} of '{path}': unit '{unit}' in one of {_width(row)} cells"
                        f" above {_width(data)} columns; give each column a cell of its own"
                    )
        head = [head[i] for i in fitting]
        head = head if len(head) == 2 and has_units(head[1]) else head[-1:]
    units: dict[ColumnKey, tuple[str, str, bool]] = {}
    for row in head:
        is_header = row is head[0]
        of_units = has_units(row, alone=is_header) and not (is_header and data is None)
        for column, place in places.items():
            cell = row.cells[place] if 0 <= place < len(row.cells) else ""
            _, unit, is_certain = heading(cell) if is_header else Heading("")
            if of_units:
                unit, is_certain = _bare(cell), True
            where = f"line {row.line} of '{path}', unit of column {place + 1}, {quoted(cell)}"
            known, known_where, known_is_certain = units.get(column, ("", "", False))
            if not unit or (of_units and unit in NO_UNIT):
                continue
            if known_is_certain and is_certain and known != unit:
                raise InputError(f"{where}: another unit than in {known_where}")
            if not known_is_certain:
                units[column] = unit, where, is_certain
    return units


def _find_header(path: Path, rows: list[CsvRow], names: Sequence[str]) -> int:
    """Return the number of the first row that has all names."""

    def missing(row: CsvRow) -> list[str]:
        known = {name for cell in row.cells for name in (cell, heading(cell)[0])}
        return [name for name in names if name not in known]

    place = next((i for i, row in enumerate(rows) if not missing(row)), None)
    if place is not None:
        return place
    above = [*takewhile(lambda row: None in map(number_in, filter(None, row.cells)), rows)]
    if not above:
        raise NoSuchColumn(
            f"'{path}' has no line with the names of its columns; give the number of"
            f" '{names[0]}', from 1"
        )
    likely = min(above, key=lambda row: (len(missing(row)), -len(row.cells)))
    # Shortened: a file that was not meant may hold anything.
    listed = [heading(cell)[0][:MAX_NAME] for cell in likely.cells if cell][:MAX_NAMES]
    fault = unknown("column", missing(likely)[0], listed)
    raise NoSuchColumn(f"line {likely.line} of '{path}': {fault}")


def _place(path: Path, header: CsvRow, column: str) -> int:
    """Return the place of a named column, from 0."""
    cells = header.cells
    names = cells if column in cells else [heading(cell)[0] for cell in cells]
    if names.count(column) > 1:
        numbers = ", ".join(str(i) for i, name in enumerate(names, start=1) if name == column)
        raise InputError(
            f"line {header.line} of '{path}': columns {numbers} are all named '{column}'; give the"
            " number of one of them"
        )
    return names.index(column)


def quoted(text: str) -> str:
    return "a tab" if text == "\t" else f"'{text[:MAX_TEXT]}'"
