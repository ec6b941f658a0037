"""Lines of the charts of a report have all their samples: corners stay, curves are no polygons."""

from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_results import TWO, belt_run
from tests.support.browser import opened, wait_until
from tests.support.scenarios import SCENARIOS

# Whether Plotly leaves out samples that are near each other on the screen, line by line.
SIMPLIFIED = """async () => {
  for (const details of document.querySelectorAll("details.chart")) details.open = true;
  for (const chart of frictionsim.charts.charts) { chart.draw(); await chart.chartOf.work; }
  return [...document.querySelectorAll(".js-plotly-plot")]
    .flatMap(({ data }) => data.map(({ line }) => line.simplify));
}"""
ALL_DRAWN = "[...document.querySelectorAll('details.chart .plot')].every((plot) => plot.data)"
CASES: dict[str, dict[str, Any]] = {
    "pulley": {"effects.shaft_friction.mu_s": 0.3},
    "hoist_drum": {},
}


def lines_of(browser: Any, report: Path) -> list[bool]:
    with opened(browser, report) as page:
        page.evaluate(SIMPLIFIED)
        for plot in page.locator("details.chart .plot").all():
            plot.scroll_into_view_if_needed()  # that along a belt is drawn where it is seen
        wait_until(page, ALL_DRAWN)
        lines: list[bool] = page.evaluate(SIMPLIFIED)
    return lines


@pytest.mark.parametrize("name", CASES)
def test_no_line_of_a_report_is_simplified(name: str, browser: Any, tmp_path: Path) -> None:
    result = fs.solve(SCENARIOS / f"{name}.toml", CASES[name])
    assert set(lines_of(browser, fs.report(result, tmp_path / "report.html"))) == {False}


def test_nor_one_of_a_comparison_or_along_a_belt(browser: Any, tmp_path: Path) -> None:
    two = [fs.solve(SCENARIOS / "pulley.toml", {"solver.rtol": r}) for r in (1e-5, 1e-6)]
    assert set(lines_of(browser, fs.report(two, tmp_path / "two.html"))) == {False}
    belt = fs.report(fs.Result(belt_run(TWO)), tmp_path / "belt.html")
    assert set(lines_of(browser, belt)) == {False}
