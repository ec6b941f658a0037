"""A document: what there is to say of a result, sweep, study or fit, block by block.

Texts and tables are written as text for a terminal (`as_text`) and as HTML for a notebook or the
page of a report (`frictionsim.reports.html`), data as JSON (`as_json`).
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple
from unicodedata import combining, east_asian_width


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
    headings = [heading.removeprefix(">") for heading in table.headings]
    rows = [headings, *([shown(cell) for cell in row] for row in table.rows)]
    widths = [max(_width(row[i]) for row in rows if i < len(row)) for i in range(len(headings))]
    lines = []
    for row in rows:
        cells = []
        for heading, width, cell in zip(table.headings, widths, row, strict=False):
            blanks = " " * (width - _width(cell))
            cells.append(blanks + cell if heading.startswith(">") else cell + blanks)
        lines.append("  ".join(cells).rstrip())
    return lines


def shown(cell: Cell) -> str:
    """Return the text of a cell."""
    return cell if isinstance(cell, str) else cell.shown


def _width(text: str) -> int:
    """Return the width of a text on a terminal, in characters."""
    if text.isascii():
        return len(text)
    wide = sum(east_asian_width(character) in "WF" for character in text)
    return len(text) + wide - sum(map(bool, map(combining, text)))
