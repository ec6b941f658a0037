"""What three papers print, and what frictionsim shows of it: the rows of `docs/papers.toml`.

A row has `where` and `what`; and a `command`, of which `read` names a quantity, or `event N` the
time of one, in the unit of the row after multiplication with `scale`; or a `measured` row and
column of the table that `python -m tests.benchmarks.results` writes; or `why` it is not shown.
`paper` is what is printed there, and `note` what makes the difference.
"""

import re
import shlex
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from markdown import table

import frictionsim as fs
from frictionsim.display import number_text

DOCS = Path(__file__).parents[1]
MEASURED = DOCS.parent / "results" / "belt_paper.md"
DIGITS = 7


def papers(name: str) -> str:
    """Return the table of a paper."""
    rows = [(row["where"], row["what"], *_shown(row), _theirs(row)) for row in rows_of(name)]
    return table(("where", "what", "shown by", "here", "there"), rows)


@cache
def rows_of(name: str) -> list[dict[str, Any]]:
    """Return the rows of a paper."""
    rows: list[dict[str, Any]] = tomllib.loads((DOCS / "papers.toml").read_text("utf-8"))[name]
    return rows


def number_of(row: dict[str, Any]) -> float | None:
    """Return the number of a row in its unit; None if it has none."""
    if "measured" in row:
        return float(_measured(*row["measured"]))
    if "read" not in row:
        return None
    value = _result(row["command"], row["read"])
    return None if value is None else value * row.get("scale", 1.0)


def _shown(row: dict[str, Any]) -> tuple[str, str]:
    """Return what shows a row, and its number."""
    if "why" in row:
        return "", row["why"]
    shown = "python -m tests.benchmarks.results" if "measured" in row else row["command"]
    program = "" if shown.startswith("python") else "frictionsim "
    number = number_of(row)
    read = f": {row['read']}" if "read" in row else ""
    text = row.get("here", "")
    if number is not None:
        text = f"{number_text(number, row.get('digits', DIGITS))} {row.get('unit', '')}".rstrip()
    return f"`{program}{shown}`{read}", text


def _theirs(row: dict[str, Any]) -> str:
    return "; ".join(filter(None, (row.get("paper", ""), row.get("note", ""))))


@cache
def _run(command: str) -> Any:
    """Return the quantities of statics, or the result of a run."""
    verb, scenario, *options = shlex.split(command)
    overrides = [
        text for flag, text in zip(options[::2], options[1::2], strict=True) if flag == "--set"
    ]
    return getattr(fs, verb)(scenario, overrides)


def _result(command: str, read: str) -> float | None:
    done = _run(command)
    if event := re.fullmatch(r"event (\d+)", read):
        time: float = done.transitions[int(event[1]) - 1].time
        return time
    quantities = done if command.startswith("static") else done.quantities
    value: float | None = quantities[read].value
    return value


@cache
def _measured(row: str, column: str) -> str:
    """Return a cell of the table of the belt of the paper."""
    lines = [line for line in MEASURED.read_text("utf-8").splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines]
    found = next(line for line in cells if line[0] == row)
    return found[cells[0].index(column)]
