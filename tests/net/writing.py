"""The jobs of the net, done in two processes, and the files of its parts."""

import json
import os
import sys
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.net import channels, commands, faults
from tests.net.digests import ROOT

PARTS = ("channels", "commands", "faults", "reports", "files", "figures")
# The parts that a job of each module gives.
GIVES = {"channels": PARTS[:1], "faults": PARTS[2:3], "commands": (PARTS[1], *PARTS[3:])}
FIXED = {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb", "TZ": "UTC", "MPLBACKEND": "agg"}

Entries = list[tuple[str, str, Any]]


def jobs(parts: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield the jobs, a module and a name, the longest first."""
    of = {"commands": commands.names(), "channels": channels.names(), "faults": faults.names()}
    for module, names in of.items():
        if set(GIVES[module]) & set(parts):
            yield from ((module, name) for name in names)


def do(module: str, name: str) -> Entries:
    """Return the entries of a job in an empty folder: part, name and data."""
    os.environ.update(FIXED)
    with TemporaryDirectory() as made:
        folder = Path(made).resolve()
        os.chdir(folder)
        try:
            if module == "channels":
                return [("channels", *one) for one in channels.of_scenario(name, folder)]
            if module == "faults":
                return [("faults", *one) for one in faults.of_batch(name, folder)]
            return list(commands.of_sequence(name, folder))
        finally:
            os.chdir(ROOT)


def write(folder: Path, wanted: list[tuple[str, str]], parts: tuple[str, ...]) -> None:
    """Do jobs in two processes and write the parts."""
    contents: dict[str, dict[str, Any]] = defaultdict(dict)
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        waiting = {pool.submit(do, *job): job for job in wanted}
        for count, done in enumerate(as_completed(waiting), 1):
            if sys.stderr.isatty():
                sys.stderr.write(f"\r{count} of {len(waiting)} {' '.join(waiting[done]):60}")
            for part, name, content in done.result():
                contents[part][name] = content
    folder.mkdir(parents=True, exist_ok=True)
    for part in parts:
        items = (f"{json.dumps(k)}: {json.dumps(v)}" for k, v in sorted(contents[part].items()))
        (folder / f"{part}.json").write_text("{\n" + ",\n".join(items) + "\n}\n")
