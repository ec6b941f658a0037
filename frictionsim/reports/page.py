"""The HTML file of a report: style, tables, charts, data and script, and nothing from elsewhere."""

import gzip
import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from string import Template
from typing import Any

from frictionsim.display import page_style
from frictionsim.reports.html import Html, escaped, short

LEVEL = 3  # of gzip: 6 takes three times as long for a page that is 3 % smaller


def page(title: str, body: Html, data: Mapping[str, Any]) -> str:
    """Return the HTML of a report.

    Parameters
    ----------
    title : str
        As it is, not for HTML.
    data : mapping
        For the player, as JSON has it: "charts" are figures of Plotly by the id of their place.
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


def study_page(
    title: str, lines: Sequence[str], sections: Iterable[Html], figure: Mapping[str, Any] | None
) -> str:
    """Return the HTML of the report of a study.

    Parameters
    ----------
    lines : sequence of str
        The heading, and lines below it.
    figure : mapping or None
        Of the place "charts".
    """
    heading, *below = (escaped(short(line, 2000)) for line in lines if line)
    faint = "\n".join(f'<p class="note">{line}</p>' for line in below)
    body = Html(f"<header><h1>{heading}</h1>\n{faint}</header>\n{''.join(sections)}")
    return page(title, body, {"charts": {"charts": figure}} if figure else {})


@cache
def _asset(name: str) -> str:
    return files("frictionsim.reports").joinpath("page", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    script = files("plotly").joinpath("package_data", "plotly.min.js")
    return script.read_text(encoding="utf-8")
