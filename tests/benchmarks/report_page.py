"""How large reports of results are, how fast a browser opens them, and how smoothly they play.

    python -m tests.benchmarks.report_page RESULT.h5...

A table: the size of the HTML file, the time to write it, the time from opening it until its charts
are there, the time of processors that this takes, and the frames in a second while it plays. It is
measured in headless Chromium, which draws without a graphics processor. On a machine with other
work the time of processors is the one to compare.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import frictionsim as fs
from tests.support.browser import browser, opened

SIZE = {"width": 1400, "height": 1000}
PLAY = 2.0  # s
# From the start of the navigation, in the page: the time that a reader waits for.
OPENED = "performance.getEntriesByName('ready')[0].startTime / 1000"


def measured(chromium: Any, results: list[Path], folder: Path) -> Iterator[tuple[str, ...]]:
    """Yield a row of the table for each result."""
    for path in results:
        begun = perf_counter()
        report = fs.report(path, folder / f"{path.stem}.html")
        written = perf_counter() - begun
        with opened(chromium, report, viewport=SIZE) as page:
            seconds, processors = page.evaluate(OPENED), _processor_time(page)
            frames = page.evaluate(f"frictionsim.frameRate({PLAY})")
        megabytes = report.stat().st_size / 1e6
        times = (written, seconds, processors)
        yield path.stem, f"{megabytes:.2f}", *(f"{time:.2f}" for time in times), f"{frames:.0f}"


def _processor_time(page: Any) -> float:
    """Return the time that processors have spent on a page, s."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    metrics = session.send("Performance.getMetrics")["metrics"]
    return float(next(metric["value"] for metric in metrics if metric["name"] == "ProcessTime"))


def main() -> None:
    """Print the table."""
    results = [Path(name) for name in sys.argv[1:]]
    print("| result | size, MB | to write, s | to open, s | processors, s | frames/s |")
    print("|---|---|---|---|---|---|")
    with browser() as chromium, TemporaryDirectory() as folder:
        for row in measured(chromium, results, Path(folder)):
            print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
