"""Reports of runs in a real browser."""

from pathlib import Path
from typing import Any

import frictionsim as fs
from tests.support.browser import opened
from tests.support.scenarios import SCENARIOS


def test_a_report_opens_without_errors_and_requests(browser: Any, tmp_path: Path) -> None:
    result = fs.solve(SCENARIOS / "pulley.toml", {"solver.rtol": 1e-6})
    file = fs.report(result, tmp_path / "pulley.html")
    with opened(browser, file) as page:
        assert page.title() == "Pulley on a dry shaft"
        assert page.evaluate("frictionsim.data.results[0].kind") == "pulley"
        times = page.evaluate("Array.from(frictionsim.data.results[0].motion.time)")
        assert (times[0], times[-1]) == (0.0, 3.0)
