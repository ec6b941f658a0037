"""What all tests share: the shipped scenario as data, runs of it, and the command line."""

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from frictionsim.io import child_process
from tests.support.scenarios import ROOT, frictionsim


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write the golden files anew from this run"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Have results read in a copy of a worker of pytest-xdist, whose other thread only waits.

    A process with threads starts a new interpreter else, which takes a fifth of a second.
    """
    if hasattr(config, "workerinput"):
        child_process.only_one_thread = lambda: True


@pytest.fixture
def cli(tmp_path: Path) -> Callable[..., "subprocess.CompletedProcess[str]"]:
    """Run the command line in a folder of its own."""
    return lambda *arguments: frictionsim(*arguments, cwd=tmp_path)


@pytest.fixture(scope="session")
def tally(request: pytest.FixtureRequest) -> Iterator[dict[str, int]]:
    """Count cases by name; a long run writes the counts down."""
    counts: dict[str, int] = {}
    yield counts
    if request.config.option.markexpr == "long":
        path = ROOT / "results" / "hard.json"
        before = json.loads(path.read_text()) if path.exists() else {}
        path.write_text(json.dumps(dict(sorted({**before, **counts}.items())), indent=2) + "\n")
