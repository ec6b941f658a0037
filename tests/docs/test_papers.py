"""The page on the papers: numbers without a remark agree in all printed digits, commands are there.

That the page has what its commands print now, the test of generated parts of pages says.
"""

import re
import sys

import pytest

import frictionsim as fs
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


def test_each_row_says_how_it_is_shown_or_why_not() -> None:
    for row in ROWS:
        assert ("command" in row) + ("measured" in row) + ("why" in row) == 1, row
