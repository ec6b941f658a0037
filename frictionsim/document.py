"""A document: what there is to say of a result, sweep, study or fit, block by block.

Texts and tables are written as text for a terminal (`as_text`) and as HTML for a notebook or the
page of a report (`frictionsim.reports.html`), data as JSON (`as_json`).
"""

from collections.abc import Iterable, Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple
from unicodedata import combining, east_asian_width

MAX_WIDTH, GAP = 100, 2  # characters of a line of a table, and between its columns
ABSENT = "\N{EM DASH}"
NOTHING = ("", ABSENT)  # cells
MIN_HEADING = 14  # characters of a line of a heading that is broken


class Number(NamedTuple):
    """A number in a cell: its text, and its value, by which a page sorts."""

    shown: str
    value: float


Cell = str | Number


class Table(NamedTuple):
    """A table. A heading with a leading '>' is that of a column of numbers.

    A row, such as one of dots, may be shorter than the headings. Caption and name, by which scripts
    find the table, are those of a page.
    """

    headings: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    name: str = ""


class Data(NamedTuple):
    """Values by name for JSON, which no text shows."""

    values: Mapping[str, Any]


Block = str | Table | Data
Document = Iterable[Block]
"""Blocks from top to bottom; a text is a line or paragraph."""


def as_json(document: Document) -> dict[str, Any]:
    """Return the data of a document as one object."""
    data = (block.values for block in document if isinstance(block, Data))
    return {name: value for values in data for name, value in values.items()}


def as_text(document: Document) -> str:
    """Return lines and tables as text without trailing blanks."""
    return "\n".join(line for block in document for line in _lines(block))


def _lines(block: Block) -> list[str]:
    if isinstance(block, str):
        return [block]
    return _lines_of_table(block) if isinstance(block, Table) else []


def _lines_of_table(table: Table) -> list[str]:
    """Return a table; a wide one with broken headings, or in parts below each other.

    Each part begins with the columns that name the rows, those of text at the left, and has the
    rows for which it says something.
    """
    headings = list(table.headings)
    rows = [[*map(shown, row)] + [""] * (len(headings) - len(row)) for row in table.rows]
    lines = _aligned(headings, rows)
    if _widest(lines) > MAX_WIDTH:
        headings = [
            _broken(heading, [row[i] for row in rows]) for i, heading in enumerate(headings)
        ]
        lines = _aligned(headings, rows)
    if _widest(lines) <= MAX_WIDTH:
        return lines
    names_of_rows = next((i for i, text in enumerate(headings) if text.startswith(">")), 0) or 1
    widths = [
        _widest([*heading.split("\n"), *(row[i] for row in rows)])
        for i, heading in enumerate(headings)
    ]
    parts, width = list[list[int]](), MAX_WIDTH
    for column in range(names_of_rows, len(headings)):
        width += GAP + widths[column]
        if width > MAX_WIDTH:
            parts.append([*range(names_of_rows)])
            width = sum(GAP + widths[i] for i in parts[-1]) + widths[column]
        parts[-1].append(column)
    lines = []
    for part in parts:
        of_part = [[row[i] for i in part] for row in rows]
        filled = [
            row for row in of_part if any(cell not in NOTHING for cell in row[names_of_rows:])
        ]
        lines += _aligned([headings[i] for i in part], filled)
    return lines


def _broken(heading: str, cells: Sequence[str]) -> str:
    """Return a heading in lines that are about as long as its cells."""
    return "\n".join(wrap(heading, max(_widest(cells), MIN_HEADING), break_long_words=False))


def _aligned(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table whose rows are as long as the headings."""
    heads = [heading.removeprefix(">").split("\n") for heading in headings]
    height = max(map(len, heads))
    # The last line of a heading is above its cells.
    lines = [*zip(*([""] * (height - len(head)) + head for head in heads), strict=True), *rows]
    widths = [_widest(column) for column in zip(*lines, strict=True)]
    at_right = [heading.startswith(">") for heading in headings]
    return [(" " * GAP).join(map(_padded, line, widths, at_right)).rstrip() for line in lines]


def _padded(cell: str, width: int, at_right: bool) -> str:
    blanks = " " * (width - _width(cell))
    return blanks + cell if at_right else cell + blanks


def _widest(texts: Iterable[str]) -> int:
    return max(map(_width, texts), default=0)


def shown(cell: Cell) -> str:
    """Return the text of a cell."""
    return cell if isinstance(cell, str) else cell.shown


def _width(text: str) -> int:
    """Return the width of a text on a terminal, in characters."""
    if text.isascii():
        return len(text)
    wide = sum(east_asian_width(character) in "WF" for character in text)
    return len(text) + wide - sum(map(bool, map(combining, text)))
