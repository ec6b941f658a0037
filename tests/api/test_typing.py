"""The types of the public names, as mypy sees them in a user's program."""

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
    (tmp_path / "mypy.ini").write_text("[mypy]\n", encoding="utf-8")
    options = [
        "--strict",
        "--config-file",
        "mypy.ini",
        "--cache-dir",
        "cache",
        "--no-error-summary",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, HERE / "example.py", wrong],
        capture_output=True, text=True, cwd=tmp_path, timeout=300, check=False,
        env={"MYPYPATH": str(ROOT), "PATH": "", "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.stderr == ""
    assert [one for one in done.stdout.splitlines() if "wrong_example.py" not in one] == []
    errors = set(map(int, re.findall(r"wrong_example\.py:(\d+): error", done.stdout)))
    assert errors == {n for n, line in enumerate(lines, 1) if "# wrong" in line}


def test_the_example_program_runs_and_uses_every_public_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example.main(tmp_path)
    assert "none.toml: cannot read this scenario" in capsys.readouterr().out
    text = (HERE / "example.py").read_text(encoding="utf-8")
    assert [name for name in (*fs.__all__, "open") if not re.search(rf"\bfs\.{name}\b", text)] == []
