"""Lines of the charts of a report have all their samples: corners stay, curves are no polygons."""

from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_results import TWO, belt_run
from tests.support.browser import opened, wait_until
from tests.support.scenarios import SCENARIOS

# Draws the charts that are open, and some that are not.
DRAW = """async (further) => {
  const closed = [...document.querySelectorAll("details.chart:not([open])")];
  for (const details of closed.slice(0, further)) details.open = true;
  for (const chart of frictionsim.charts.charts) { chart.draw(); await chart.chartOf.work; }
}"""
ALL_DRAWN = "[...document.querySelectorAll('[open] .plot')].every((plot) => plot.data)"
# Whether Plotly leaves out samples that are near each other on the screen, line by line.
LINES = """[...document.querySelectorAll('[open] .plot')]
  .flatMap(({ data }) => data.map(({ line }) => line.simplify))"""
CASES: dict[str, dict[str, Any]] = {
    "pulley": {"effects.shaft_friction.mu_s": 0.3},
    "hoist_drum": {},
}


def lines_of(browser: Any, report: Path, further: int) -> list[bool]:
    with opened(browser, report) as page:
        page.evaluate(DRAW, further)
        for plot in page.locator("[open] .plot").all():
            plot.scroll_into_view_if_needed()  # that along a belt is drawn where it is seen
        wait_until(page, ALL_DRAWN)
        lines: list[bool] = page.evaluate(LINES)
    return lines


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_no_line_of_a_report_is_simplified(name: str, browser: Any, tmp_path: Path) -> None:
    report = fs.report(fs.solve(SCENARIOS / f"{name}.toml", CASES[name]), tmp_path / "report.html")
    assert set(lines_of(browser, report, further=99)) == {False}  # more than there are


def test_nor_one_of_a_comparison_or_along_a_belt(browser: Any, tmp_path: Path) -> None:
    two = [fs.Result(belt_run(TWO, bodies=24, samples=n)) for n in (21, 31)]
    report = fs.report(two, tmp_path / "two.html")
    assert set(lines_of(browser, report, further=2)) == {False}
