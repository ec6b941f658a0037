"""What the reports of costs and of sweeps share: sortable tables, pictures, the head.

The tables are complete without scripts; scripts sort them by the values of their numbers.
"""

from base64 import b64encode
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from frictionsim.display import STUDY_DIGITS, number_text
from frictionsim.reports.page import text
from frictionsim.reports.tables import Number, table

MAX_TEXT = 300  # characters of a cell
STUDY_SCRIPTS = ("data.js", "elements.js", "theme.js", "sortable.js")
PNG = b"\x89PNG"


def short(content: object, limit: int = MAX_TEXT) -> str:
    """Return a text for HTML, cut if it is longer than a limit; it says how long it is."""
    return text(cut(content, limit))


def cut(content: object, limit: int = MAX_TEXT) -> str:
    """Return a text, cut if it is longer than a limit; it says how long it is."""
    words = str(content)
    if len(words) > limit:
        words = f"{words[:limit]}… ({len(words)} characters in all)"
    return words


def number(value: float, digits: int = STUDY_DIGITS) -> Number:
    """Return a number for a cell; `none` if it is not a number."""
    return Number(number_text(value, digits), value)


def study_table(
    caption: str, headings: Sequence[str], rows: Iterable[Sequence[str | Number]], name: str = ""
) -> str:
    """Return a table as of `tables.table` with cut texts, which scrolls by itself.

    Parameters
    ----------
    caption, headings, rows
        As of `tables.table`; a text is cut at MAX_TEXT characters.
    name : str
        Its id in the page, if scripts sort it.
    """
    cells = ([cell if isinstance(cell, Number) else cut(cell) for cell in row] for row in rows)
    attributes = ' class="study"' + (f' id="{name}"' if name else "")
    # A table that is wider than the window is scrolled by itself, by the keyboard too.
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{text(caption)}">'
        f"{table(caption, headings, cells, attributes)}</div>"
    )


def study_section(heading: str, *content: str) -> str:
    """Return a section of a page, of parts in HTML."""
    return f"<section><h2>{text(heading)}</h2>\n" + "\n".join(content) + "\n</section>"


class Picture(NamedTuple):
    """A picture of a study.

    Attributes
    ----------
    title : str
    image : bytes
        SVG or PNG; empty if it could not be drawn.
    note : str
        What is to be said of it, as why it could not be drawn.
    """

    title: str
    image: bytes
    note: str = ""


def shown_pictures(pictures: Iterable[Picture]) -> Iterator[str]:
    """Yield pictures for a page, those after the first folded."""
    for number, picture in enumerate(pictures):
        title, note = short(picture.title), f"<p>{short(picture.note, 1000)}</p>"
        shown = note if picture.note else ""
        if picture.image:
            kind = "png" if picture.image.startswith(PNG) else "svg+xml"
            source = f"data:image/{kind};base64,{b64encode(picture.image).decode('ascii')}"
            shown = f'<img class="picture" src="{source}" alt="{title}">{shown}'
        yield f"<details{'' if number else ' open'}><summary>{title}</summary>{shown}</details>"


def head(title: str, *lines: str) -> str:
    """Return the heading of a page, with lines below it; and where messages of scripts go."""
    below = "\n".join(f'<p class="faint">{short(line, 2000)}</p>' for line in lines if line)
    return (
        f'<header><h1>{short(title)}</h1>\n{below}<div id="tools"></div></header>\n'
        '<p id="message" role="alert"></p>'
    )
