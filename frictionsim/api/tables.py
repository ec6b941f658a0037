"""Results as tables, in text and HTML."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple
from unicodedata import combining, east_asian_width

from frictionsim.display import error_text, number_text
from frictionsim.io.terminal import visible

if TYPE_CHECKING:
    from frictionsim.results import Quantities


class Cells(NamedTuple):
    """A table of text; a heading with a leading '>' is that of a column of numbers."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


Parts = Iterator[str | Cells]
"""Lines and tables, from top to bottom."""


def as_text(parts: "Iterator[str | Cells]") -> str:
    """Return lines and tables as text without trailing blanks."""
    return "\n".join(line for part in parts for line in _lines(part))


def _lines(part: str | Cells) -> list[str]:
    if isinstance(part, str):
        return [part]
    rows = [[heading.lstrip(">") for heading in part.headings], *part.rows]
    columns = range(len(part.headings))
    widths = [max(_width(row[i]) for row in rows if i < len(row)) for i in columns]
    lines = []
    for row in rows:
        cells = []
        for heading, width, cell in zip(part.headings, widths, row, strict=False):
            blanks = " " * (width - _width(cell))
            cells.append(blanks + cell if heading.startswith(">") else cell + blanks)
        lines.append("  ".join(cells).rstrip())
    return lines


def _width(text: str) -> int:
    """Return the width of a text on a terminal, in characters."""
    if text.isascii():
        return len(text)
    wide = sum(east_asian_width(character) in "WF" for character in text)
    return len(text) + wide - sum(map(bool, map(combining, text)))


def _escaped(text: str) -> str:
    from html import escape  # imported here: a run on the command line needs none

    return escape(visible(text))


def as_html(parts: "Iterator[str | Cells]") -> str:
    """Return lines and tables as HTML, for notebooks."""
    return "<div>" + "".join(map(_html, parts)) + "</div>"


def _html(part: str | Cells) -> str:
    if isinstance(part, str):
        return f"<p>{_escaped(part)}</p>"
    aligned = ["right" if heading.startswith(">") else "left" for heading in part.headings]
    rows = [
        _row("th", [heading.lstrip(">") for heading in part.headings], aligned),
        *(_row("td", cells, aligned) for cells in part.rows),
    ]
    return f"<table>{''.join(rows)}</table>"


def _row(tag: str, cells: Sequence[str], aligned: Sequence[str]) -> str:
    # A short row, as that of dots, is filled up.
    filled = [*cells, *[""] * (len(aligned) - len(cells))]
    inner = "".join(
        f'<{tag} style="text-align: {side}">{_escaped(cell)}</{tag}>'
        for cell, side in zip(filled, aligned, strict=True)
    )
    return f"<tr>{inner}</tr>"


def quantities_table(
    quantities: "Quantities", errors: "dict[str, float | None] | None" = None
) -> Cells:
    """Return quantities with their units, and their errors if there are any."""
    headings = ["quantity", ">value", *((">error",) if errors else ()), "unit"]
    rows = [
        (name, number_text(q.value), *((error_text(errors.get(name)),) if errors else ()), q.unit)
        for name, q in quantities.items()
    ]
    return Cells(headings, rows)
