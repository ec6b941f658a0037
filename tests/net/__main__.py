"""Write what this commit does, or compare two commits; see `tests.net`."""

import argparse
import sys
from pathlib import Path

import tests.net
from tests.net.differences import compare
from tests.net.writing import PARTS, jobs, write


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
