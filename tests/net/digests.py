"""Digests of arrays, texts and data, by which two commits are compared."""

import csv
import hashlib
import io
import json
import re
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

import frictionsim as fs

ROOT = Path(__file__).parents[2]
SAMPLES = 14

# Keys of JSON and columns of tables that hold times of the wall clock, or follow from them.
TIMED = re.compile(r"wall|spread|compile_seconds|recommendations")
# In texts.
MASKS = (
    (re.compile(r"(solved in|wall time) \d[\d.e+-]*( s)?"), r"\1 <time>"),
    (re.compile(r"for [\d.e-]+ %: .*"), "for <limit>: <fastest>"),
    (re.compile(r"kernels-[0-9a-f]+"), "kernels-<hash>"),
    (re.compile(rf"\b{re.escape(fs.__version__)}\b"), "<version>"),
    (re.compile(r"\b20\d\d-\d\d-\d\d([T ]\d\d:\d\d(:\d\d)?)?"), "<date>"),
)


def digest(values: Any) -> dict[str, Any]:
    """Return the hash of an array, some of its values, and its extremes and means."""
    array = np.asarray(values)
    if array.dtype.kind in "OUS":
        texts = [str(text) for text in array.ravel().tolist()]
        content = json.dumps(texts).encode()
        return {"hash": _hash(content), "shape": list(array.shape), "texts": texts[:SAMPLES]}
    if array.dtype.kind == "M":
        array = array.view("i8")
    kept = array.ravel().astype(float)
    if kept.size > SAMPLES:  # drawn, so that no column of a table is left out each time
        drawn = np.random.default_rng(kept.size).choice(kept.size - 2, SAMPLES - 2, replace=False)
        kept = kept[np.sort([0, *(drawn + 1), kept.size - 1])]
    samples = [value if isfinite(value) else str(value) for value in kept.tolist()]
    finite = array[np.isfinite(array)].astype(float)
    whole = (
        (finite.min(), finite.max(), finite.mean(), np.abs(finite).mean()) if finite.size else ()
    )
    constant = array.size > 0 and bool((array == array.ravel()[0]).all())
    return {
        "hash": _hash(np.ascontiguousarray(array).tobytes()),
        "type": str(array.dtype),
        "shape": list(array.shape),
        "samples": samples[:1] if constant else samples,
        "whole": [] if constant else [float(value) for value in whole],
    }


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def text(said: str, folder: Path) -> list[str]:
    """Return the lines of a text without what differs from run to run."""
    for path, name in ((folder, "<folder>"), (ROOT, "<root>"), (Path.home(), "<home>")):
        said = said.replace(str(path), name)
    for mask, instead in MASKS:
        said = mask.sub(instead, said)
    return _without_column_of_times(said.splitlines())


def _without_column_of_times(lines: list[str]) -> list[str]:
    """Mask wall times and their spread in a cost study; their cells end where the heads do."""
    for at, head in enumerate(lines):
        timed = re.finditer(r"(?<=  )(wall time|spread) \[s\](?=  )", head)
        ends = [match.end() for match in timed]
        for i in range(at + 1, len(lines) if ends else 0):
            if lines[i].startswith("for "):  # the sentences below the table
                break
            for end in sorted(ends, reverse=True):
                lines[i] = re.sub(r"\S+$", "<time>", lines[i][:end]) + lines[i][end:]
            lines[i] = re.sub(r" +", " ", lines[i])
        if ends:
            lines[at] = re.sub(r" +", " ", head)
    return lines


def data(content: Any, folder: Path) -> Any:
    """Return JSON data without times; lists of numbers as digests."""
    if isinstance(content, dict) and "hash" in content:
        return content  # a digest
    if isinstance(content, dict):
        return {
            key: "<time>" if TIMED.search(key) else data(value, folder)
            for key, value in content.items()
        }
    if isinstance(content, list):
        if len(content) > 3 and all(isinstance(value, int | float) for value in content):
            return digest(content)
        return [data(value, folder) for value in content]
    if isinstance(content, str):
        lines = text(content, folder)
        return lines[0] if len(lines) == 1 else lines
    return content


def table(content: str) -> dict[str, Any]:
    """Return the columns of CSV as digests, and its comments."""
    comments = [line for line in content.splitlines() if line.startswith("#")]
    rows = list(csv.reader(io.StringIO("\n".join(content.splitlines()[len(comments) :]))))
    columns = zip(*rows[1:], strict=True) if rows else ()
    return {"comments": comments} | {
        name: "<time>" if TIMED.search(name) else _column(column)
        for name, column in zip(rows[0] if rows else (), columns, strict=False)
    }


def _column(cells: tuple[str, ...]) -> dict[str, Any]:
    try:
        return digest(np.array([cell or "nan" for cell in cells], dtype=float))
    except ValueError:
        return digest(cells)
