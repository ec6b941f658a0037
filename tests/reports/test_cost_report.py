"""Reports of tables of costs in a real browser."""

import csv
import re
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from tests.support.browser import check_sorting, opened, without_scripts
from tests.support.cases import slow
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


def test_numbers_that_no_axis_shows_are_in_the_table_only(file: Path, tmp_path: Path) -> None:
    cells = [(1, "error", "1e300"), (2, "wall_seconds", "inf")]
    changed_file = rewritten(file, tmp_path / "a.csv", *cells)
    page = fs.report(changed_file, tmp_path / "a.html").read_text(encoding="utf-8")
    assert "2 settings have numbers that no axis shows; the table has them." in page
    assert "1e+300" in page


def test_the_table_is_sorted_by_numbers_with_the_keyboard(
    browser: Any, study: fs.Study, report: Path
) -> None:
    with opened(browser, report) as page:
        check_sorting(
            page, "#settings", "steps", [row["steps"] for row in study.to_json()["settings"]]
        )


def test_a_report_of_costs_is_complete_without_scripts(
    browser: Any, study: fs.Study, report: Path
) -> None:
    with without_scripts(browser, report) as page:
        shown = page.inner_text("body")
        for sentence in study.recommendations:
            assert sentence in shown
        # Wall time is in s, as in the diagram and the summary.
        assert not re.search(r"\d ms\b", shown)
        assert re.search(r"for 1 %.*: .*, [\d.e-]+ s, error", shown)
        assert "wall time [s]" in shown
        assert " / " not in page.inner_text("#settings thead")
        assert page.locator("#settings tbody tr").count() == len(study.to_json()["settings"])
        assert page.locator("th:not([scope]), table:not(:has(caption))").count() == 0


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


def test_a_table_without_uncertainty_says_so(file: Path, report: Path, tmp_path: Path) -> None:
    """As CSV tables of earlier versions are, which do not name their study either."""
    old = tmp_path / "old.csv"
    with file.open(newline="", encoding="utf-8") as read:
        rows = list(csv.reader(read))
    with old.open("w", newline="", encoding="utf-8") as write:
        csv.writer(write).writerows(row[: rows[0].index("kind")] for row in rows)
    text = fs.report(old, tmp_path / "old.html").read_text(encoding="utf-8")
    assert "old.csv: error against run time" in text
    assert "<title>:" not in text
    assert "reference uncertainty: unknown; errors may not be resolved so finely" in text
    text = report.read_text(encoding="utf-8")
    assert "the difference of the references" in text


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("steps", "line 2, column 'steps': expected a number, got 'x'"),
        ("status", "a row has the status 'x', which is neither done nor failed"),
    ],
)
def test_a_damaged_table_is_refused_by_line_and_column(
    column: str, message: str, file: Path, tmp_path: Path
) -> None:
    damaged = rewritten(file, tmp_path / "damaged.csv", (1, column, "x"))
    with pytest.raises(InputError) as caught:
        fs.report(damaged, tmp_path / "a.html")
    assert str(caught.value) == f"{damaged}: cannot read this table of costs: {message}"
    assert not (tmp_path / "a.html").exists()


def test_a_huge_table_is_refused_before_it_is_read(tmp_path: Path) -> None:
    huge = tmp_path / "huge.csv"
    with huge.open("wb") as file:
        file.write(b"law,backend,setting,overrides\n")
        file.truncate(2**31)
    with pytest.raises(InputError, match="has more than 16 MiB"):
        fs.report(huge, tmp_path / "a.html")


@pytest.mark.parametrize("name", [slow("pulley_cost.csv"), "belt_drive_cost.csv"])
def test_shipped_tables_have_reports(name: str, tmp_path: Path) -> None:
    table = ROOT / "results" / name
    with table.open(newline="", encoding="utf-8") as stream:
        rows = len(list(csv.DictReader(line for line in stream if not line.startswith("#"))))
    page = fs.report(table, tmp_path / "a.html").read_text(encoding="utf-8")
    settings = page[page.index('id="settings"') :]
    assert settings[: settings.index("</table>")].count("<tr") == rows + 1  # with the headings
    traces, _ = charts_of(page)["charts"]
    assert sum(len(trace["x"]) for trace in traces if trace["xaxis"] == "x") == rows
