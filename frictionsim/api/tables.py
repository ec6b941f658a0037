"""Results as tables, in text and HTML; the only module beside `progress` that imports rich."""

from collections.abc import Iterator, Sequence
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.io.terminal import visible

if TYPE_CHECKING:
    from frictionsim.results import Quantities

DIGITS = 10
WIDTH = 1000  # characters of a line: numbers are never truncated


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
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style=None)
    for heading in part.headings:
        right = heading.startswith(">")
        table.add_column(heading.lstrip(">"), justify="right" if right else "left", no_wrap=True)
    for row in part.rows:
        table.add_row(*row)
    text = StringIO()
    # No markup: titles and paths may contain brackets.
    Console(
        file=text, highlight=False, markup=False, emoji=False, width=WIDTH, no_color=True
    ).print(table)
    return [line.rstrip() for line in text.getvalue().splitlines()]


def as_html(parts: "Iterator[str | Cells]") -> str:
    """Return lines and tables as HTML, for notebooks."""
    return "<div>" + "".join(map(_html, parts)) + "</div>"


def _html(part: str | Cells) -> str:
    if isinstance(part, str):
        return f"<p>{escape(visible(part))}</p>"
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
        f'<{tag} style="text-align: {side}">{escape(visible(cell))}</{tag}>'
        for cell, side in zip(filled, aligned, strict=True)
    )
    return f"<tr>{inner}</tr>"


def quantities_table(
    quantities: "Quantities", errors: "dict[str, float | None] | None" = None
) -> Cells:
    """Return quantities with their units, and their errors if there are any."""
    headings = ["quantity", ">value", *((">error",) if errors else ()), "unit"]
    rows = [
        (name, number_text(q.value), *((_error(errors.get(name)),) if errors else ()), q.unit)
        for name, q in quantities.items()
    ]
    return Cells(headings, rows)


def number_text(value: float | None) -> str:
    return "none" if value is None else f"{value:.{DIGITS}g}"


def _error(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def short_text(value: float | None) -> str:
    return "" if value is None else f"{value + 0.0:.3g}"  # no -0
