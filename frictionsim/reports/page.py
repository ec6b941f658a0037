"""The HTML file of a report: style, tables, data and scripts in one, and nothing from elsewhere."""

from collections.abc import Sequence
from functools import cache
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from frictionsim.io.terminal import visible
from frictionsim.reports.encoding import packed, packed_data

STYLES = ("report.css", "drawing.css", "study.css")
SCRIPTS = (
    "data.js",
    "elements.js",
    "theme.js",
    "colours.js",
    "clock.js",
    "controls.js",
    "drawing_parts.js",
    "drawing_band.js",
    "drawing_panel.js",
    "drawing.js",
    "plot.js",
    "key.js",
    "charts.js",
    "belt_chart.js",
    "report.js",
)


def text(content: object) -> str:
    """Return a text for HTML: markup, quotes and control characters stay text."""
    return escape(visible(str(content)), quote=True)


def page(title: str, body: str, data: Any, scripts: Sequence[str] = SCRIPTS) -> str:
    """Return the HTML of a report.

    Parameters
    ----------
    title : str
        As it is, not for HTML.
    body : str
        HTML, in which all texts have passed `text`.
    data
        For the scripts, as of `packed_data`.
    scripts : sequence of str
        Files of the folder `page`, in their order.
    """
    return Template(asset("report.html")).substitute(
        title=text(title),
        style="\n".join(map(asset, STYLES)),
        body=body,
        data=packed_data(data),
        plotly=_plotly(),
        scripts="\n".join(asset(name) for name in scripts),
    )


@cache
def asset(name: str) -> str:
    """Return a file of the folder `page`."""
    return files("frictionsim.reports").joinpath("page", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    return packed(get_plotlyjs().encode())
