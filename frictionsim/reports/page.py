"""The HTML file of a report: style, tables, data and scripts in one, and nothing from elsewhere."""

import gzip
import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from hashlib import sha256
from importlib.resources import files
from math import isfinite
from string import Template
from typing import Any

import numpy as np

from frictionsim.display import page_data, page_style
from frictionsim.reports.html import Html, escaped, short

ARRAY = "array"  # the key by which the scripts know an array


def packed(content: bytes) -> str:
    """Return bytes compressed, as base64; equal bytes give equal texts."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def packed_data(data: Any) -> str:
    """Return data as compressed JSON in base64.

    Parameters
    ----------
    data : dict, list, NamedTuple, array, str, number or None
        A NamedTuple becomes an object with its fields and the name of its type as `type`. A number
        that is not finite becomes null.
    """
    return packed(json.dumps(plain(data), allow_nan=False, separators=(",", ":")).encode())


def plain(data: Any) -> Any:
    """Return data as JSON has it."""
    if isinstance(data, np.ndarray):
        return array(data)
    if isinstance(data, tuple) and hasattr(data, "_fields"):
        fields = zip(data._fields, data, strict=True)
        return {"type": type(data).__name__, **{name: plain(value) for name, value in fields}}
    if isinstance(data, Mapping):
        return {str(name): plain(value) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value) for value in data]
    if isinstance(data, np.generic):
        return plain(data.item())
    return None if isinstance(data, float) and not isfinite(data) else data


def array(values: Any) -> dict[str, Any]:
    """Return an array for the scripts: little-endian numbers, whatever machine wrote them."""
    kind = {"f": "<f4" if values.dtype == np.float32 else "<f8", "b": "|u1"}.get(
        values.dtype.kind, "<i4"
    )
    content = np.ascontiguousarray(values, dtype=kind).tobytes()
    return {ARRAY: b64encode(content).decode("ascii"), "of": kind[1:], "shape": values.shape}


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
STUDY_SCRIPTS = ("data.js", "elements.js", "theme.js", "sortable.js")


def page(title: str, body: Html, data: Any, scripts: Sequence[str] = SCRIPTS) -> str:
    """Return the HTML of a report.

    Parameters
    ----------
    title : str
        As it is, not for HTML.
    data
        For the scripts, as of `packed_data`.
    scripts : sequence of str
        Files of the folder `page`, in their order.
    """
    display = f"const frictionsim = {{ display: {json.dumps(page_data())} }};"
    joined = "\n".join([display, *map(asset, scripts)])
    with_plotly = "plot.js" in scripts
    runnable = [joined, *([_plotly()] if with_plotly else [])]
    return Template(asset("report.html")).substitute(
        # A script that came in with a text of a result would not be one of these.
        hashes=" ".join(f"'sha256-{_sha256(script)}'" for script in runnable) or "'none'",
        title=escaped(title),
        style="\n".join([page_style(), *map(asset, STYLES)]),
        body=body,
        data=packed_data(data),
        plotly=_packed_plotly() if with_plotly else "",
        scripts=joined,
    )


def study_page(title: str, lines: Sequence[str], sections: Iterable[Html]) -> str:
    """Return the HTML of the report of a study.

    Parameters
    ----------
    lines : sequence of str
        The heading, and lines below it.
    """
    heading, *below = (escaped(short(line, 2000)) for line in lines if line)
    faint = "\n".join(f'<p class="faint">{line}</p>' for line in below)
    head = (
        f'<header><h1>{heading}</h1>\n{faint}<div id="tools"></div></header>\n'
        '<p id="message" role="alert"></p>\n'
    )
    return page(title, Html(head + "\n".join(sections)), None, STUDY_SCRIPTS)


@cache
def asset(name: str) -> str:
    """Return a file of the folder `page`."""
    return files("frictionsim.reports").joinpath("page", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    script: str = get_plotlyjs()
    return script


@cache
def _packed_plotly() -> str:
    return packed(_plotly().encode())


def _sha256(script: str) -> str:
    return b64encode(sha256(script.encode()).digest()).decode("ascii")
