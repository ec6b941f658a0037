"""The HTML file of a report: style, tables, charts, data and script, and nothing from elsewhere."""

import gzip
import json
from base64 import b64encode
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from string import Template
from typing import Any

from frictionsim.display import page_style
from frictionsim.reports.html import Html, escaped, short

CHART = {
    "displaylogo": False,
    "responsive": True,
    "modeBarButtonsToRemove": ["select2d", "lasso2d"],
}


def page(title: str, body: Html, data: Any) -> str:
    """Return the HTML of a report.

    Parameters
    ----------
    title : str
        As it is, not for HTML.
    data
        For the player, as JSON has it; empty for none.
    """
    content = json.dumps(data, allow_nan=False, separators=(",", ":")).encode()
    return Template(_asset("page.html")).substitute(
        title=escaped(title),
        style=page_style() + _asset("page.css"),
        plotly=_plotly() if 'class="plotly-graph-div"' in body else "",
        body=body,
        data=b64encode(gzip.compress(content, 6, mtime=0)).decode("ascii"),
        script=_asset("player.js"),
    )


def chart(figure: Any, name: str, folded: bool = False) -> Html:
    """Return a figure of Plotly for a page, with its id in it; one folded away is drawn later."""
    if not folded:
        return Html(
            figure.to_html(full_html=False, include_plotlyjs=False, div_id=name, config=CHART)
        )
    content = figure.to_json().replace("<", "\\u003c")
    return Html(
        f'<div id="{name}" class="plotly-graph-div"></div>'
        f'<script type="application/json" id="{name}-figure">{content}</script>'
    )


def study_page(title: str, lines: Sequence[str], sections: Iterable[Html]) -> str:
    """Return the HTML of the report of a study.

    Parameters
    ----------
    lines : sequence of str
        The heading, and lines below it.
    """
    heading, *below = (escaped(short(line, 2000)) for line in lines if line)
    faint = "\n".join(f'<p class="note">{line}</p>' for line in below)
    return page(
        title, Html(f"<header><h1>{heading}</h1>\n{faint}</header>\n{''.join(sections)}"), {}
    )


@cache
def _asset(name: str) -> str:
    return files("frictionsim.reports").joinpath("page", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    script: str = get_plotlyjs()
    return script
