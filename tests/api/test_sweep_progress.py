"""The progress bar of a sweep."""

import re

import pytest

import frictionsim as fs

# Half a second each but for the first, of which too few steps are allowed.
STEPS = {"solver.max_steps": [5, 100_001, 100_002, 100_003]}
LONG = {"solver.max_step": 1e-4, "output.channels": ["angle"]}


def drawn(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    fs.sweep("pulley", STEPS, LONG, workers=1, progress=True)
    assert capsys.readouterr() == ("", "")  # there is no bar but on a terminal
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes any stream for a terminal then
    monkeypatch.setenv("COLUMNS", "120")
    fs.sweep("pulley", STEPS, LONG, workers=1, progress=True)
    captured = capsys.readouterr()
    assert captured.out == ""
    return re.sub(r"\x1b\[[^a-zA-Z]*[a-zA-Z]", "", captured.err)


@pytest.mark.slow
def test_the_bar_tells_rate_and_time_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = drawn(monkeypatch, capsys)
    assert "of 4" in text
    assert re.search(r"runs, [\d.]+ per second, \d+ s left, 1 failed", text)
