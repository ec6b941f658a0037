"""The page on the papers: numbers without a remark agree in all printed digits, commands are there.

That the page has what its commands print now, the test of generated parts of pages says.
"""

import re
import shlex
import sys
from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import EXIT_BUDGET_EXCEEDED, EXIT_DONE
from tests.docs.pages import DOCS, INVENTORY

sys.path.insert(0, str(DOCS / "_ext"))
from papers import number_of, rows_of

ROWS = [row for name in ("shaft", "gear", "belt") for row in rows_of(name)]
PRINTED = [row for row in ROWS if "paper" in row and "note" not in row and "why" not in row]


@pytest.mark.parametrize("row", PRINTED, ids=lambda row: f"{row['where']}: {row['what']}")
def test_ours_agrees_in_all_digits_of_the_paper(row: dict) -> None:
    number = re.search(
        r"(-?\d+)\.?(\d*)[^\d]*$", row["paper"].partition(" mm = ")[2] or row["paper"]
    )
    assert number
    last_digit = 10.0 ** -len(number[2])
    ours = number_of(row)
    assert ours is not None
    # The papers round some numbers and cut others.
    assert abs(ours - float(f"{number[1]}.{number[2]}")) < last_digit


@pytest.mark.parametrize(
    "row", [row for row in ROWS if "command" in row], ids=lambda r: r["command"]
)
def test_commands_and_their_scenarios_and_views_are_there(row: dict) -> None:
    verb, of, *options = row["command"].split()
    assert verb in INVENTORY["commands"]
    name = of.removeprefix("results/").removesuffix(".h5")
    kind = fs.load(name).kind
    if "--view" in options:
        assert options[options.index("--view") + 1] in INVENTORY["views"][kind]
    for flag in [option for option in options if option.startswith("--")]:
        assert any(flag in known for known in INVENTORY["commands"][verb]), flag


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    sorted(
        {r["command"] for r in ROWS if "read" not in r and r.get("command", "").startswith("solve")}
    ),
)
def test_runs_without_a_number_begin(command: str, tmp_path: Path) -> None:
    """A belt takes half a minute or more: that it starts is what the page needs."""
    arguments = [*shlex.split(command), "-o", str(tmp_path / "a.h5"), "--max-steps", "2000"]
    assert fs.run_command_line(arguments) in (EXIT_DONE, EXIT_BUDGET_EXCEEDED)


def test_each_row_says_how_it_is_shown_or_why_not() -> None:
    for row in ROWS:
        assert ("command" in row) + ("measured" in row) + ("why" in row) == 1, row
