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
    """Return the data that the scripts of a page read, with its arrays."""
    packed = re.search(r'id="packed-data">([^<]*)<', page)
    assert packed is not None
    return json.loads(gzip.decompress(b64decode(packed[1])), object_hook=_as_array)


def _as_array(data: dict[str, Any]) -> Any:
    if "array" not in data:
        return data
    values = np.frombuffer(b64decode(data["array"]), dtype=f"<{data['of']}")
    return values.reshape(data["shape"])
