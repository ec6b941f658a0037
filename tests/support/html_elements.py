"""HTML pages: their elements, whether these are balanced, and the data that a report holds."""

import gzip
import json
import re
from base64 import b64decode
from html.parser import HTMLParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import frictionsim as fs

VOID = {"meta", "link", "br", "hr", "img", "input", "col", "wbr"}


class Elements(HTMLParser):
    """The elements of a page in their order, those that have no end, its text and its faults."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.faults: list[str] = []
        self._texts: list[str] = []
        self.feed(page)
        self.close()
        self.text = "".join(self._texts)
        self.faults += [f"{tag} has no end" for tag in self.open]

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        self.faults += [f"{tag} has {key}" for key, _ in attrs if key.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"an end of {tag} that has no begin")

    def handle_data(self, data: str) -> None:
        self._texts.append(data)


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
