"""Documents as HTML, for notebooks and pages, and the one file of a report."""

import gzip
import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from frictionsim.display import STUDY_DIGITS, number_text, page_style, with_minus
from frictionsim.document import Block, Cell, Document, Number, Table
from frictionsim.io.terminal import visible

MAX_TEXT = 300  # characters of a cell of a study


class Html(str):
    """HTML in which all texts of files have passed `escaped`."""

    __slots__ = ()


def escaped(content: object) -> Html:
    """Return a text for HTML: markup, quotes and control characters stay text."""
    return Html(escape(visible(str(content)), quote=True))


def chart_text(content: object) -> str:
    """Return a text for a chart: Plotly knows few names of characters, and takes $ for maths."""
    return escape(visible(str(content)), quote=False).replace("$", "&#36;")


def short(content: object) -> str:
    """Return a text, cut with a note of its length if it is longer than MAX_TEXT."""
    words = str(content)
    if len(words) > MAX_TEXT:
        words = f"{words[:MAX_TEXT]}… ({len(words)} characters in all)"
    return words


def number(value: float, digits: int = STUDY_DIGITS) -> Number:
    """Return the cell of a number; `none` if it is not a number."""
    return Number(number_text(value, digits), value)


def notebook(document: Document) -> str:
    """Return a document as HTML for a notebook, which has no style sheet."""
    style = "<style>.frictionsim .number { text-align: right }</style>"
    return f'<div class="frictionsim">{style}{"".join(map(html, document))}</div>'


def html(block: Block) -> Html:
    """Return a block as HTML for a page; `Html` as it is."""
    if isinstance(block, Html):
        return block
    if isinstance(block, str):
        return Html(f"<p>{escaped(block)}</p>\n")
    if isinstance(block, Table):
        return table(block)
    return Html()


def section(heading: str, *content: Block, name: str = "") -> Html:
    """Return a section of a page with a heading, and its name as id; empty without content."""
    inner = "".join(map(html, content))
    if not inner:
        return Html()
    own, heading_id = "", ""
    if name:
        own = f' id="{name}" aria-labelledby="{name}-heading"'
        heading_id = f' id="{name}-heading"'
    return Html(f"<section{own}>\n<h2{heading_id}>{escaped(heading)}</h2>\n{inner}\n</section>\n")


def listed(items: Iterable[str]) -> Html:
    """Return a list of texts; empty without any."""
    inner = "".join(f"<li>{escaped(item)}</li>\n" for item in items)
    return Html(inner and f"<ul>\n{inner}</ul>")


def folded(summary: str, content: str) -> Html:
    """Return a text of several lines, such as TOML, that can be folded away."""
    inner = f'<pre tabindex="0"><code>{escaped(content)}</code></pre>'
    return Html(f"<details open><summary>{escaped(summary)}</summary>{inner}</details>\n")


def region(style: str, label: str, content: Html) -> Html:
    """Return HTML that scrolls by itself, also by the keyboard, such as a wide table."""
    attributes = f'class="{style}" tabindex="0" role="region" aria-label="{escaped(label)}"'
    return Html(f"<div {attributes}>{content}</div>\n")


def study_table(block: Table) -> Html:
    """Return a table whose long texts are cut, which scripts sort and which scrolls by itself."""
    rows = [[c if isinstance(c, Number | Html) else short(c) for c in row] for row in block.rows]
    return region("wide", block.caption, table(block._replace(rows=rows), "study"))


def table(block: Table, style: str = "") -> Html:
    """Return a table for a page; its rows begin with their headings."""
    numeric = [heading.startswith(">") for heading in block.headings]
    head = "".join(
        f'<th scope="col"{_class(right)}>{escaped(heading.removeprefix(">"))}</th>'
        for heading, right in zip(block.headings, numeric, strict=True)
    )
    body = "".join(f"<tr>{_cells(row, numeric)}</tr>\n" for row in block.rows)
    attributes = f' class="{style}"' if style else ""
    attributes += f' id="{block.name}"' if block.name else ""
    caption = f"<caption>{escaped(block.caption)}</caption>" if block.caption else ""
    return Html(
        f"<table{attributes}>{caption}\n"
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>\n"
    )


def _cells(row: Sequence[Cell], numeric: Sequence[bool]) -> str:
    filled = [*row, *[""] * (len(numeric) - len(row))]  # a row of dots is shorter
    tags = ('th scope="row"', *["td"] * (len(numeric) - 1))
    cells = []
    for tag, cell, right in zip(tags, filled, numeric, strict=True):
        content = _parsed(cell) if right and isinstance(cell, str) else cell
        value = f' data-value="{content.value!r}"' if isinstance(content, Number) else ""
        cells.append(f"<{tag}{_class(right)}{value}>{_content(content)}</{tag[:2]}>")
    return "".join(cells)


def _parsed(cell: str) -> Cell:
    """Return the cell of a column of numbers: a number, or a text such as "none"."""
    try:
        return Number(cell, float(cell))
    except ValueError:
        return cell


def _class(numeric: bool) -> str:
    return ' class="number"' if numeric else ""


def _content(cell: Cell) -> str:
    if isinstance(cell, Html):
        return cell
    return escaped(with_minus(cell.shown) if isinstance(cell, Number) else cell)


# The page of a report.

LEVEL = 3  # of gzip: 6 takes three times as long for a page that is 3 % smaller


def page(title: str, body: Html, data: Mapping[str, Any]) -> str:
    """Return the HTML of a report; the title is as it is, not for HTML.

    The data are for the player: "charts" are figures of Plotly by the id of their place.
    """
    content = json.dumps(data, allow_nan=False, separators=(",", ":")).encode()
    return Template(_asset("page.html")).substitute(
        title=escaped(title),
        style=page_style() + _asset("page.css"),
        plotly=_plotly() if data.get("charts") else "",
        body=body,
        data=b64encode(gzip.compress(content, LEVEL, mtime=0)).decode("ascii"),
        script=_asset("player.js"),
    )


@cache
def _asset(name: str) -> str:
    return files("frictionsim.reports").joinpath("page", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    script = files("plotly").joinpath("package_data", "plotly.min.js")
    return script.read_text(encoding="utf-8")
