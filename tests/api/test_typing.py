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


def mypy(path: Path, folder: Path) -> list[str]:
    """Return the lines that mypy prints on a file, without the configuration of this project."""
    own = folder / "mypy.ini"
    own.write_text("[mypy]\n")
    options = ["--strict", "--config-file", own, "--cache-dir", folder / "cache"]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, "--no-error-summary", path],
        capture_output=True,
        text=True,
        cwd=folder,
        env={"MYPYPATH": str(ROOT), "PATH": "", "PYTHONPATH": str(ROOT)},
        timeout=300,
        check=False,
    )
    assert done.stderr == ""
    return done.stdout.splitlines()


def test_a_users_program_is_well_typed(tmp_path: Path) -> None:
    assert mypy(HERE / "example.py", tmp_path) == []


def test_mistakes_of_a_users_program_are_found(tmp_path: Path) -> None:
    path = HERE / "wrong_example.py"
    marked = {
        n
        for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if "# wrong" in line
    }
    found = {
        int(match[1])
        for line in mypy(path, tmp_path)
        if (match := re.search(r"wrong_example\.py:(\d+): error", line))
    }
    assert found == marked


@pytest.mark.quick
def test_the_program_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example.main(tmp_path)
    assert "none.toml: cannot read this scenario" in capsys.readouterr().out


@pytest.mark.quick
def test_the_program_uses_every_public_name() -> None:
    text = (HERE / "example.py").read_text(encoding="utf-8")
    assert [name for name in (*fs.__all__, "open") if not re.search(rf"\bfs\.{name}\b", text)] == []
