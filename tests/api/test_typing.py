"""`mypy --strict` on a user's program: the right one passes, mistakes are found."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import frictionsim as fs
from tests.api import example
from tests.support.scenarios import ROOT

HERE = Path(__file__).parent


@pytest.mark.slow
def test_a_users_program_is_well_typed_and_mistakes_in_one_are_found(tmp_path: Path) -> None:
    """Both at once, as the package takes most of the time; without this project's configuration."""
    wrong = HERE / "wrong_example.py"
    lines = wrong.read_text(encoding="utf-8").splitlines()
    marked = {n for n, line in enumerate(lines, 1) if "# wrong" in line}
    own = tmp_path / "mypy.ini"
    own.write_text("[mypy]\n", encoding="utf-8")
    options = ["--strict", "--config-file", own, "--cache-dir", tmp_path / "cache"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, "--no-error-summary", HERE / "example.py", wrong],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={"MYPYPATH": str(ROOT), "PATH": "", "PYTHONPATH": str(ROOT)},
        timeout=300,
        check=False,
    )
    assert done.stderr == ""
    said = [line for line in done.stdout.splitlines() if "wrong_example.py" not in line]
    assert said == []
    errors = set(map(int, re.findall(r"wrong_example\.py:(\d+): error", done.stdout)))
    assert errors == marked


def test_the_example_program_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example.main(tmp_path)
    assert "none.toml: cannot read this scenario" in capsys.readouterr().out


def test_the_program_uses_every_public_name() -> None:
    text = (HERE / "example.py").read_text(encoding="utf-8")
    assert [name for name in (*fs.__all__, "open") if not re.search(rf"\bfs\.{name}\b", text)] == []
