"""The progress bar of a sweep."""

import sys
from io import StringIO

import pytest

from frictionsim.api import progress
from frictionsim.api.progress import SweepBar
from frictionsim.simulation.monitor import SweepProgress


class Terminal(StringIO):
    """A text stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


def drawn(monkeypatch: pytest.MonkeyPatch, stream: StringIO, *steps: SweepProgress) -> str:
    """Return what a bar draws, a second between each two calls."""
    clock = iter(range(100))
    monkeypatch.setattr(progress, "monotonic", lambda: float(next(clock)))
    monkeypatch.setattr(sys, "stderr", stream)
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with SweepBar() as bar:
        for each in steps:
            bar(each)
    return stream.getvalue()


CHECKED = SweepProgress(done=0, total=100, failed=0, checked=60)
FIRST = SweepProgress(done=10, total=100, failed=0, checked=100)
NEXT = SweepProgress(done=30, total=100, failed=2, checked=100)


def test_the_bar_tells_rate_and_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    text = drawn(monkeypatch, Terminal(), CHECKED, FIRST, NEXT)
    assert "60 of 100" in text
    assert "combinations checked" in text
    assert "10 of 100" in text
    # A resumed sweep has not done the first ten now.
    assert "runs, 20 per second, 4 s left, 2 failed" in text


def test_there_is_no_bar_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    assert drawn(monkeypatch, StringIO(), CHECKED, FIRST, NEXT) == ""
