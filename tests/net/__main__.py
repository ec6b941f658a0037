"""Write what this commit does, or compare two commits; see `tests.net`."""

import argparse
import json
import os
import sys
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import tests.net
from tests.net import channels, commands, faults
from tests.net.differences import compare

PARTS = ("channels", "commands", "faults", "reports", "files", "figures")
# The parts that a job of each module gives.
GIVES = {"channels": PARTS[:1], "faults": PARTS[2:3], "commands": (PARTS[1], *PARTS[3:])}
FIXED = {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb", "TZ": "UTC", "MPLBACKEND": "agg"}

Found = list[tuple[str, str, Any]]


def jobs(parts: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield what is to be done, a module and a name, what takes long first."""
    of = {"commands": commands.names(), "channels": channels.names(), "faults": faults.names()}
    for module, names in of.items():
        if set(GIVES[module]) & set(parts):
            yield from ((module, name) for name in names)


def do(module: str, name: str) -> Found:
    """Return what comes of a job in an empty folder: part, name and data."""
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
            os.chdir(tests.net.__path__[0])


def write(folder: Path, wanted: list[tuple[str, str]], parts: tuple[str, ...]) -> None:
    """Do jobs in two processes and write the parts."""
    found: dict[str, dict[str, Any]] = defaultdict(dict)
    with ProcessPoolExecutor(2) as pool:
        waiting = {pool.submit(do, *job): job for job in wanted}
        for count, done in enumerate(as_completed(waiting), 1):
            if sys.stderr.isatty():
                print(
                    f"\r{count} of {len(waiting)} {' '.join(waiting[done]):60}",
                    end="",
                    file=sys.stderr,
                )
            for part, name, content in done.result():
                found[part][name] = content
    folder.mkdir(parents=True, exist_ok=True)
    for part in parts:
        items = (f"{json.dumps(k)}: {json.dumps(v)}" for k, v in sorted(found[part].items()))
        (folder / f"{part}.json").write_text("{\n" + ",\n".join(items) + "\n}\n")


def main() -> int:
    """Read the arguments; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.net",
        description=tests.net.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", choices=("write", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--only", default=",".join(PARTS), help="parts, with commas between them")
    parser.add_argument("--all", action="store_true", help="say all differences")
    given = parser.parse_args()
    parts = tuple(given.only.split(","))
    if unknown := set(parts) - set(PARTS):
        parser.error(f"--only: unknown {', '.join(sorted(unknown))}; known: {', '.join(PARTS)}")
    if len(given.folders) != (1 if given.command == "write" else 2):
        parser.error("write takes one folder, compare two")
    first = given.folders[0].resolve()
    if given.command == "write":
        write(first, list(jobs(parts)), parts)
        return 0
    lines, same = compare(first, given.folders[1].resolve(), parts, whole=given.all)
    print("\n".join(lines))
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
