"""Reports of tables of costs in a real browser."""

import csv
import re
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.browser import opened
from tests.support.html_elements import charts_of
from tests.support.scenarios import ROOT, changed, pulley

HOSTILE = "<b>b</b></script><script>alert(1)</script> \"q\" 'p' & \x1b[31m \u202eend"


@pytest.fixture(scope="module")
def study() -> fs.Study:
    """A small study, whose title has markup."""
    scenario = changed(pulley(), title=HOSTILE.replace("\x1b", ""), solver__duration=1.0)
    backends, laws = ["events", "lsoda"], ["set-valued", "regularised"]
    tolerances = [1e-3, 1e-4, 1e-5]
    return fs.cost(scenario, backends=backends, laws=laws, tolerances=tolerances, repeats=1)


@pytest.fixture(scope="module")
def file(study: fs.Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return study.save(tmp_path_factory.mktemp("costs") / "costs.csv")


@pytest.fixture(scope="module")
def report(file: Path) -> Path:
    return fs.report(file, file.with_suffix(".html"))


def lines_of(file: Path, error: str, work: str) -> dict[str, list[tuple[float, float]]]:
    """Return the points of each line, read by others' readers."""
    rows = list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))
    plain = [{key.split(" [")[0]: value for key, value in row.items()} for row in rows]
    lines: dict[str, list[tuple[float, float]]] = {}
    for row in plain:
        if row["status"] == "done" and float(row[error]) > 0.0:
            name = f"{row['backend']}, {row['law']}"
            lines.setdefault(name, []).append((float(row[work]), float(row[error])))
    return lines


def test_the_chart_holds_the_numbers_of_the_table(file: Path, report: Path) -> None:
    traces, layout = charts_of(report.read_text(encoding="utf-8"))["charts"]
    assert layout["yaxis"]["type"] == layout["xaxis"]["type"] == "log"
    for work, axis in (("wall_seconds", "x"), ("rhs_evaluations", "x2")):
        drawn = {
            trace["name"]: list(zip(trace["x"], trace["y"], strict=True))
            for trace in traces
            if trace["xaxis"] == axis
        }
        assert drawn == lines_of(file, "error", work)


def rewritten(file: Path, target: Path, *cells: tuple[int, str, str]) -> Path:
    """Write a table of costs with other texts in cells: line, column and text of each."""
    with file.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    names = [cell.split(" [")[0] for cell in rows[0]]
    for line, column, text in cells:
        rows[line][names.index(column)] = text
    with target.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows(rows)
    return target


def test_markup_in_a_table_of_costs_stays_text(browser: Any, file: Path, tmp_path: Path) -> None:
    columns = ("law", "backend", "setting", "reason", "overrides")
    cells = [*((1, name, HOSTILE) for name in columns), (2, "status", "failed")]
    hostile = rewritten(file, tmp_path / "a.csv", *cells, (2, "reason", HOSTILE))
    with opened(browser, fs.report(hostile, tmp_path / "hostile.html")) as page:
        assert page.locator("body b, body script[src], #settings script").count() == 0
        settings = page.inner_text("#settings")
        for words in (r"\x1b[31m", "</script><script>alert(1)</script>", r"\u202eend"):
            assert words in settings
        assert re.search(r"\d+ settings, [1-9] failed", page.inner_text("body"))


def test_a_shipped_table_of_meshes_has_a_report(tmp_path: Path) -> None:
    table = ROOT / "results" / "belt_drive_cost.csv"
    with table.open(newline="", encoding="utf-8") as stream:
        rows = len(list(csv.DictReader(line for line in stream if not line.startswith("#"))))
    page = fs.report(table, tmp_path / "a.html").read_text(encoding="utf-8")
    settings = page[page.index('id="settings"') :]
    assert settings[: settings.index("</table>")].count("<tr") == rows + 1  # with the headings
    traces, _ = charts_of(page)["charts"]
    assert sum(len(trace["x"]) for trace in traces if trace["xaxis"] == "x") == rows
