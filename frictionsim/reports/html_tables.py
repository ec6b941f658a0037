"""Tables of reports as HTML that is complete without scripts: captions, scopes, aligned numbers."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from frictionsim.reports.page import text

MAX_TEXT = 300  # characters of a cell


class Number(NamedTuple):
    """A number in a cell: how it is shown, and its value, by which the page sorts."""

    shown: str
    value: float


def short(content: object, limit: int = MAX_TEXT) -> str:
    """Return a text for HTML, cut if it is longer than a limit; it says how long it is."""
    words = str(content)
    if len(words) > limit:
        words = f"{words[:limit]}… ({len(words)} characters in all)"
    return text(words)


def number(value: float, digits: int = 6) -> Number:
    """Return a number for a cell; `none` if it is not a number."""
    return Number(f"{value:.{digits}g}" if value == value else "none", value)


def table(
    caption: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[str | Number]],
    name: str = "",
) -> str:
    """Return a table as HTML.

    Parameters
    ----------
    caption : str
    headings : sequence of str
        That of a column of numbers begins with '>'.
    rows : iterable of sequence
        Of texts and numbers; the first cell names its row.
    name : str
        For the scripts of the page; that of a sortable table.
    """
    sides = ["number" if heading.startswith(">") else "words" for heading in headings]
    head = "".join(
        f'<th scope="col" class="{side}">{short(heading.lstrip(">"))}</th>'
        for heading, side in zip(headings, sides, strict=True)
    )
    body = "\n".join(_row(row, sides) for row in rows)
    mark = f' id="{name}"' if name else ""
    # A table that is wider than the window is scrolled by itself, by the keyboard too.
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{short(caption)}">'
        f'<table class="study"{mark}><caption>{short(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>"
    )


def _row(row: Sequence[str | Number], sides: Sequence[str]) -> str:
    cells = []
    for place, cell in enumerate(row):
        tag, scope = ("th", ' scope="row"') if place == 0 else ("td", "")
        value = f' data-value="{cell.value!r}"' if isinstance(cell, Number) else ""
        shown = cell.shown if isinstance(cell, Number) else cell
        cells.append(f'<{tag}{scope} class="{sides[place]}"{value}>{short(shown)}</{tag}>')
    return f"<tr>{''.join(cells)}</tr>"


def section(heading: str, *parts: str) -> str:
    """Return a section of a page, of parts in HTML."""
    return f"<section><h2>{text(heading)}</h2>\n" + "\n".join(parts) + "\n</section>"


def chart(label: str) -> str:
    """Return the place where the scripts of a page put a chart with its controls."""
    return (
        '<form class="controls" id="controls" hidden></form>\n'
        f'<div class="chart" id="chart" role="img" aria-label="{short(label)}"></div>\n'
        '<p id="note" class="faint"></p>\n'
        "<noscript><p>The chart needs the scripts of this page; the tables have its numbers.</p>"
        "</noscript>"
    )


def head(title: str, *lines: str) -> str:
    """Return the heading of a page, with lines below it; and where messages of scripts go."""
    below = "\n".join(f'<p class="faint">{short(line, 2000)}</p>' for line in lines if line)
    return f'<header><h1>{short(title)}</h1>\n{below}</header>\n<p id="message" role="alert"></p>'
