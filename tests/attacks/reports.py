"""Reports of files that are damaged, foreign, huge or hostile: a sentence, or HTML that parses.

Results, sweeps and tables of costs with changed bytes or content; markup, control characters and
megabytes in texts; values that are no numbers. What the data hold never becomes an element.
"""

import random
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import frictionsim as fs
from frictionsim.io.checksum import append_trailer
from tests.attacks import hdf5_bytes, sweeps
from tests.attacks.hdf5_bytes import Files, damaged_file, place
from tests.attacks.hdf5_structure import change
from tests.attacks.promise import BrokenPromise, outcome
from tests.attacks.toml import edited
from tests.support.html_elements import Elements
from tests.support.scenarios import SCENARIOS

TARGET, REPORT, TABLE = "a.h5", "a.html", "a.csv"
MAX_BYTES = 6e6
HUGE = 2**31
SCRIPTS = 3  # elements of a report: data, library and scripts
OF_HDF5 = ("DIMENSION_LIST", "REFERENCE_LIST", "CLASS")  # attributes of its own
# An element of this name is in no report: it would be of the data's making.
MARKUP = "<x-hostile onclick=alert(1)>"
TEXTS: list[Any] = [
    f"</script><script>{MARKUP}alert(1)</script>",
    f"{MARKUP}'\"&amp;\x00-->]]>",
    "\x1b]0;title\x07\u202egnp.exe\u2028\u0085" + MARKUP,
    "x" * 60_000,
    f"{MARKUP}\n" * 2000,
    "\ud7ff%{x}$\\frac{1}{2}$<b>",
    "__proto__",
    "array",
    b"\xff\xfe<",
]
PIECES = [
    MARKUP,
    "\n",
    "\0",
    *['"', ",", "nan", "inf", "-1", "1e400", "#", "\ufeff", "done", "[", "]"],
]


@cache
def originals() -> tuple[Files, ...]:
    """Return files that have reports: results of all states, sweeps, and tables of costs."""
    with tempfile.TemporaryDirectory() as name:
        costs = fs.cost(SCENARIOS / "pulley.toml", backends="events", tolerances=1e-3, repeats=1)
        table = Path(name) / TABLE
        tables = {
            path.suffix: path.read_bytes()
            for path in (table, table.with_suffix(".h5"))
            if costs.save(path)
        }
    files: list[Files] = [{TARGET: content} for content in sweeps.originals()]
    files += [{TARGET: tables[".h5"]}, {TABLE: tables[".csv"]}]
    return (*hdf5_bytes.originals(), *files)


def check_html(text: str) -> None:
    """Check that a report is balanced HTML without an element of its data's making."""
    elements = Elements(text)
    faults, tags = elements.faults, elements.tags
    if tags.count("script") != SCRIPTS or "x-hostile" in tags:
        faults.append(f"it has {tags.count('script')} scripts, {set(tags)}")
    if any(ord(sign) < 32 and sign not in "\n\t" for sign in text):
        faults.append("it has control characters")
    if len(text) > MAX_BYTES:
        faults.append(f"it has {len(text)} characters")
    if faults:
        raise BrokenPromise(f"the report is not sound: {'; '.join(faults[:5])}")


def attack(rng: random.Random, folder: Path) -> str:
    """Damage a file, and make a report of it."""
    files = dict(rng.choice(originals()))
    name = TARGET if TARGET in files else TABLE
    place(folder, files)
    way = rng.choice([_bytes, _structure, _texts, _texts, _numbers, _other])
    described = _table(rng, folder) if name == TABLE else way(rng, folder)
    arguments = ["report", name, "-o", REPORT]
    before = set(folder.rglob("*"))
    try:
        code = outcome(arguments, described)
        report = folder / REPORT
        if (code == "exit 0") is not report.exists():
            raise BrokenPromise(f"{code}, but the report is there: {report.exists()}")
        if left := set(folder.rglob("*")) - before - {report}:
            raise BrokenPromise(f"{left} are left over")
        if report.exists():
            check_html(report.read_text(encoding="utf-8"))
    except BrokenPromise as broken:
        raise BrokenPromise(f"{broken}\n{described}") from None
    return code


def _bytes(rng: random.Random, folder: Path) -> str:
    path = folder / TARGET
    raw, way = damaged_file(rng, path.read_bytes())
    path.write_bytes(raw)
    return way


def _structure(rng: random.Random, folder: Path) -> str:
    return change(rng, folder / TARGET)


def _texts(rng: random.Random, folder: Path) -> str:
    """Put markup, control characters and megabytes into attributes and texts."""
    done = []
    with h5py.File(folder / TARGET, "r+") as file:
        datasets = [file[name] for name in _datasets(file)]
        texts = [item for item in datasets if h5py.check_string_dtype(item.dtype) is not None]
        for _ in range(rng.choice([1, 2, 5, 20])):
            text = rng.choice(TEXTS)
            written = text if isinstance(text, bytes) else text.replace("\0", "0")
            item = rng.choice([file, rng.choice(datasets)])
            if texts and rng.random() < 0.3:
                item = rng.choice(texts)
                with suppress(UnicodeError):  # of a type for ASCII
                    item[...] = written
                done.append(f"{item.name} = {text!r:.40}")
                continue
            key = rng.choice([*item.attrs] or ["units"])
            if key not in OF_HDF5:
                item.attrs[key] = np.bytes_(text) if isinstance(text, bytes) else written
                done.append(f"{item.name} @{key} = {text!r:.40}")
    append_trailer(folder / TARGET)
    return ", ".join(done)


def _numbers(rng: random.Random, folder: Path) -> str:
    """Put numbers into datasets that are none, or are extreme."""
    done = []
    with h5py.File(folder / TARGET, "r+") as file:
        numeric = [
            name for name in _datasets(file) if file[name].dtype.kind == "f" and file[name].size
        ]
        for _ in range(rng.choice([1, 3, 10])):
            name = rng.choice(numeric)
            values = file[name][...]
            chosen = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, -1.0])
            if rng.random() < 0.5:
                values = np.full_like(values, chosen)
            else:
                values.reshape(-1)[rng.randrange(values.size)] = chosen
            file[name][...] = values
            done.append(f"{name} with {chosen}")
    append_trailer(folder / TARGET)
    return ", ".join(done)


def _other(rng: random.Random, folder: Path) -> str:
    """Put another file there: empty, foreign, a folder, none, or two gigabytes of nothing."""
    path = folder / TARGET
    kind = rng.choice(["empty", "text", "foreign", "folder", "none", "huge", "huge HDF5", "report"])
    whole = path.read_bytes()
    path.unlink()
    if kind == "folder":
        path.mkdir()
    elif kind == "foreign":
        with h5py.File(path, "w") as file:
            file.attrs["kind"], file["time"] = "pulley", [0.0, 1.0]
    elif kind.startswith("huge"):
        with path.open("wb") as sparse:
            sparse.write(whole if kind == "huge HDF5" else b"")
            sparse.truncate(HUGE)
    elif kind != "none":
        path.write_bytes({"empty": b"", "text": b"x = 1\n"}.get(kind, b"<!doctype html>"))
    return kind


def _table(rng: random.Random, folder: Path) -> str:
    text = (folder / TABLE).read_text(encoding="utf-8")
    changed = edited(rng, text, PIECES) if rng.random() < 0.8 else text.replace("done", MARKUP)
    (folder / TABLE).write_text(changed, encoding="utf-8", errors="replace")
    return changed


def _datasets(file: Any) -> list[str]:
    names: list[str] = []
    file.visit(names.append)
    return [name for name in names if isinstance(file[name], h5py.Dataset)]


def warm_up() -> None:
    """Make the files that are damaged, and a report."""
    from frictionsim.reports.page import page

    originals()
    page("", "", {})
