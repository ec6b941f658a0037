"""The report of a cost table in CSV says what the terminal said."""

import csv
import re
from collections.abc import Callable
from html import unescape
from pathlib import Path

import pytest

from tests.support.cases import slow

Told = Callable[..., tuple[str, str]]

STUDIES = {
    "titled": ("pulley", "--backends", "rkf45", "--tolerances", "1e-3", "--laws", "set-valued"),
    "marble": ("marble_machine", "--backends", "events", "--tolerances", "1e-2"),
    # Without a title a study is called by its kind.
    "untitled": ("untitled.toml", "--backends", "lsoda", "--tolerances", "1e-3"),
}


SHORT = ("--set", "solver.duration=0.6", "--repeats", "1")


def text_of(page: Path) -> str:
    return unescape(re.sub(r"<[^>]+>", " ", page.read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", [slow("titled"), "marble", "untitled"])
def test_the_report_of_a_csv_table_has_title_and_recommendations(
    name: str, told: Told, here: Path
) -> None:
    Path("untitled.toml").write_text(
        'kind = "shaft"\nmechanism = { inertia = 0.1, initial_angular_velocity = 2.0 }\n'
        "[effects.shaft_friction]\nshaft_radius = 0.01\nmu_s = 0.3\nmu_k = 0.2\n"
        '[[forces]]\nname = "load"\nsize = 50.0\npoint = [0.0, 0.0]\ndirection = [0.0, -1.0]\n'
        "[solver]\nduration = 0.3\n",
        encoding="utf-8",
    )
    said, _ = told("cost", *STUDIES[name], *SHORT, "--csv", "c.csv")
    told("report", "c.csv", "-o", "c.html")
    page = text_of(Path("c.html"))
    lines = said.splitlines()
    heading = lines[0].removesuffix(" (done)")
    assert re.fullmatch(r"\S.*: error against run time", heading)
    assert heading in page
    wanted = [line for line in lines if line.startswith(("for ", "reference"))]
    assert len(wanted) == 5  # references, their uncertainty, and three goals
    for line in wanted:
        assert line in page


@pytest.mark.parametrize("uncertainty", [1.2e-3, slow(3e-4), slow(2e-2)])
def test_a_goal_below_the_uncertainty_is_unknown_in_the_report_too(
    uncertainty: float, told: Told
) -> None:
    told("cost", *STUDIES["titled"], *SHORT, "--csv", "c.csv")
    with Path("c.csv").open(newline="", encoding="utf-8") as file:
        heading, *rows = csv.reader(file)
    for row in rows:
        row[heading.index("reference_uncertainty")] = f'{{"final_angle": {uncertainty!r}}}'
    with Path("u.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([heading, *rows])
    told("report", "u.csv", "-o", "u.html")
    page = text_of(Path("u.html"))
    for percent in (1.0, 0.1, 0.01):
        goal = f"for {percent:g} %: unknown, the reference uncertainty is {uncertainty:.1e}"
        assert (goal in page) == (uncertainty > percent / 100.0)
    assert "Pulley on a dry shaft: error against run time" in page
