"""HTML pages: their elements, and the data that a report holds."""

import gzip
import json
import re
from base64 import b64decode
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import numpy as np

import frictionsim as fs


class Elements:
    """The tags of well-formed HTML in their order, its text, and what must not be in it."""

    def __init__(self, page: str) -> None:
        every = list(ElementTree.fromstring(page).iter())
        self.tags, self.text = [each.tag for each in every], "".join(every[0].itertext())
        self.faults = [key for each in every for key in each.attrib if key.startswith("on")]


def report_of(source: Any) -> str:
    """Return the page that `fs.report` writes of a source."""
    with TemporaryDirectory() as folder:
        return fs.report(source, Path(folder) / "a.html").read_text(encoding="utf-8")


def data_of(page: str) -> Any:
    """Return the data that the player of a page reads."""
    packed = re.search(r'id="data">([^<]*)<', page)
    assert packed is not None
    return json.loads(gzip.decompress(b64decode(packed[1])))


def charts_of(page: str) -> dict[str, Any]:
    """Return the traces and the layout of each chart of a page, by its id."""
    figures = data_of(page).get("charts", {})
    return {
        name: (list(map(_with_arrays, figure["data"])), figure["layout"])
        for name, figure in figures.items()
    }


def _with_arrays(trace: Any) -> Any:
    """Return a trace with its arrays, which Plotly writes as base64, and their shapes."""
    arrays = {name: v for name, v in trace.items() if isinstance(v, dict) and "bdata" in v}
    shapes = {f"{name}_shape": v["shape"].split(",") for name, v in arrays.items() if "shape" in v}
    numbers = {
        name: np.frombuffer(b64decode(v["bdata"]), dtype=f"<{v['dtype']}").astype(float)
        for name, v in arrays.items()
    }
    return trace | shapes | numbers


def panels_of(page: str, chart: str = "charts") -> dict[str, Any]:
    """Return the lines of each panel of a chart, by the title of the panel."""
    traces, layout = charts_of(page)[chart]
    titles = [each["text"] for each in layout["annotations"]]
    numbers = {f"y{number}": title for number, title in enumerate(titles, start=2)}
    panels: dict[str, Any] = {title: [] for title in titles}
    for trace in traces:
        if trace["mode"] == "lines":
            panels[numbers[trace["yaxis"]]].append(trace)
    return panels
