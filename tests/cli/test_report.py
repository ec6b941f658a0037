"""`frictionsim report`: its output file and its refusals."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import frictionsim as fs
from tests.cli.conftest import Run
from tests.support.scenarios import SCENARIOS

FAST = {"solver.rtol": 1e-6, "solver.duration": 0.1}


def test_a_report_is_written_beside_the_first_result(told: Run, here: Path) -> None:
    paths = [here / name for name in ("a.h5", "b.h5")]
    for path in paths:
        fs.solve(SCENARIOS / "pulley.toml", FAST, output=path)
    out, _ = told("report", *paths)
    assert out == f"{here / 'a.html'}\n"
    assert "<h1>Comparison: Pulley on a dry shaft</h1>" in (here / "a.html").read_text(
        encoding="utf-8"
    )
    target = here / "other.html"
    assert told("report", paths[1], "-o", target) == (f"{target}\n", "")
    for quiet in ("-q", "--quiet"):
        target.unlink()
        assert told("report", paths[1], "-o", target, quiet) == ("", "")
        assert target.exists()
    # A report is replaced by another one.
    assert fs.report([paths[0], fs.open(paths[1])], target) == target
    assert "<h1>Comparison: Pulley on a dry shaft</h1>" in target.read_text(encoding="utf-8")
    fs.report(fs.open(paths[0]), target)
    assert "<h1>Pulley on a dry shaft</h1>" in target.read_text(encoding="utf-8")


def test_too_many_results_are_refused_before_any_is_read(cli: Callable[..., Any]) -> None:
    for command in ("plot", "report"):
        done = cli(command, *(f"none{number}.h5" for number in range(9)))
        assert (done.returncode, done.stdout) == (2, "")
        assert re.search(r"\b9\b.* give fewer, or run them as a sweep", done.stderr)
