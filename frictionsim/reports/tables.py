"""Tables of reports in HTML, with captions and headings that screen readers announce."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from frictionsim.display import with_minus
from frictionsim.reports.page import text


class Html(NamedTuple):
    """HTML in which all texts have passed `text`."""

    content: str


class Number(NamedTuple):
    """A number in a cell: how it is shown, and its value, by which the page sorts."""

    shown: str
    value: float


Cell = str | Html | Number
"""What is in a cell: a text as it is, HTML, or a number."""


def table(
    caption: str, headings: Sequence[str], rows: Iterable[Sequence[Cell]], attributes: str = ""
) -> str:
    """Return a table whose rows begin with their headings.

    Parameters
    ----------
    caption : str
    headings : sequence of str
        Of the columns; one with a leading '>' is that of numbers.
    rows : iterable of sequences of Cell
    attributes : str
        HTML attributes of the table, with a space before each.

    Returns
    -------
    str
        HTML.
    """
    numeric = [heading.startswith(">") for heading in headings]
    head = "".join(
        f'<th scope="col"{_class(right)}>{text(heading.lstrip(">"))}</th>'
        for heading, right in zip(headings, numeric, strict=True)
    )
    body = "".join(f"<tr>{_cells(row, numeric)}</tr>\n" for row in rows)
    return (
        f"<table{attributes}><caption>{text(caption)}</caption>\n"
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>\n"
    )


def _cells(row: Sequence[Cell], numeric: Sequence[bool]) -> str:
    first, *others = (
        _parsed(cell) if right and isinstance(cell, str) else cell
        for cell, right in zip(row, numeric, strict=True)
    )
    cells = [f'<th scope="row"{_class(numeric[0])}{_value(first)}>{_html(first)}</th>']
    cells += [
        f"<td{_class(right)}{_value(cell)}>{_html(cell)}</td>"
        for cell, right in zip(others, numeric[1:], strict=True)
    ]
    return "".join(cells)


def _parsed(cell: str) -> str | Number:
    """Return the cell of a column of numbers: a number, or a text such as "none"."""
    try:
        return Number(cell, float(cell))
    except ValueError:
        return cell


def _class(numeric: bool) -> str:
    return ' class="number"' if numeric else ""


def _value(cell: Cell) -> str:
    return f' data-value="{cell.value!r}"' if isinstance(cell, Number) else ""


def _html(cell: Cell) -> str:
    if isinstance(cell, Html):
        return cell.content
    return text(with_minus(cell.shown) if isinstance(cell, Number) else cell)


def with_unit(words: str, unit: str) -> str:
    """Return a heading of values with a unit, as that of an axis; 1 is no unit."""
    return f"{words}, {unit}" if unit and unit != "1" else words


def section(name: str, heading: str, content: str) -> str:
    """Return a section with a heading; empty without content.

    Parameters
    ----------
    name : str
        Its id in the page.
    heading : str
        A text as it is.
    content : str
        HTML.
    """
    if not content:
        return ""
    return (
        f'<section id="{name}" aria-labelledby="{name}-heading">\n'
        f'<h2 id="{name}-heading">{text(heading)}</h2>\n{content}\n</section>\n'
    )


def paragraph(content: str) -> str:
    """Return a paragraph of a text."""
    return f"<p>{text(content)}</p>\n"
