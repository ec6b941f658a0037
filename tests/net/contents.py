"""Contents of the files that commands write: HDF5 and reports."""

import gzip
import json
import re
from base64 import b64decode
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import h5py

from tests.net.digests import data, digest, text

PACKED = re.compile(r'<script type="text/plain" id="data">([^<]*)</script>')
# Attributes in which HDF5 itself keeps what belongs together.
OF_HDF5 = ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME")


def structure(path: Path) -> dict[str, Any]:
    """Return groups, datasets, types, shapes and attributes of a file, as `h5dump -A` does."""
    with h5py.File(path) as file:
        members: dict[str, Any] = {"/": _attributes(file)}
        file.visititems(lambda name, item: members.__setitem__(name, _item(item)))
        return members


def _item(item: Any) -> dict[str, Any]:
    if isinstance(item, h5py.Group):
        return {"group": len(item), **_attributes(item)}
    kind = h5py.check_string_dtype(item.dtype)
    named = f"text {kind.encoding}" if kind else item.dtype.str
    layout = {"compression": item.compression, "chunked": item.chunks is not None}
    return {"type": named, "shape": list(item.shape), **layout, **_attributes(item)}


def _attributes(item: Any) -> dict[str, Any]:
    """Return the attributes: their text, or their type and shape where they are numbers."""
    values: dict[str, Any] = {}
    for name, value in sorted(item.attrs.items()):
        if name in OF_HDF5:
            values[f"@{name}"] = "HDF5"
        elif name == "digest":  # of a checkpoint, with the wall time that is in it
            values["@digest"] = f"{len(value)} digits"
        elif isinstance(value, str):
            said = text(value, Path(item.file.filename).parent)
            values[f"@{name}"] = said if len(value) < 500 else {"lines": len(value.splitlines())}
        else:
            values[f"@{name}"] = digest(value)
    return values


def report(path: Path, folder: Path) -> dict[str, Any]:
    """Return the data of the scripts of a report, and the text of its page."""
    page = path.read_text(encoding="utf-8")
    packed = PACKED.search(page)
    inner = json.loads(gzip.decompress(b64decode(packed[1]))) if packed else None
    reader = _Texts()
    reader.feed(page)
    return {"data": data(inner, folder), "text": text("\n".join(reader.lines()), folder)}


class _Texts(HTMLParser):
    """The text of a page: a line for each row of a table and for each other piece."""

    def __init__(self) -> None:
        super().__init__()
        self._rows: list[list[str]] = []
        self._in_row = self._silent = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._silent = tag in ("script", "style")
        if tag == "tr":
            self._in_row = True
            self._rows.append([])
        elif tag in ("td", "th") and self._in_row:
            self._rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        self._silent = False
        self._in_row = self._in_row and tag != "tr"

    def handle_data(self, data: str) -> None:
        said = " ".join(data.split())
        if self._silent or not said:
            return
        if self._in_row and self._rows[-1]:
            self._rows[-1][-1] += said
        else:
            self._rows.append([said])

    def lines(self) -> list[str]:
        timed: list[int] = []
        lines = []
        for row in self._rows:
            heads = [i for i, cell in enumerate(row) if re.search(r"wall time|its spread", cell)]
            timed = heads if len(row) > 2 and heads else timed if len(row) > 2 else []
            cells = ["<time>" if i in timed and not heads else cell for i, cell in enumerate(row)]
            lines.append(" | ".join(cells))
        return lines
