"""What all tests share: settings, compiled kernels, and the command line."""

import gc
import os
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock
from hypothesis import HealthCheck, Phase, settings

import frictionsim as fs
from tests.cases import CASES, Case, SolvedCase
from tests.support import scenarios
from tests.support.examples import FEW, MANY
from tests.support.scenarios import in_this_process

# Always the same examples by default, so that no chance decides; many and new ones every night.
SHARED_SETTINGS: dict[str, Any] = {
    "deadline": None,
    "database": None,
    "suppress_health_check": list(HealthCheck),
    "phases": (Phase.explicit, Phase.generate, Phase.shrink),  # explaining takes minutes
}
settings.register_profile("few", max_examples=FEW, derandomize=True, **SHARED_SETTINGS)
settings.register_profile("many", max_examples=MANY, **SHARED_SETTINGS)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "few"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write the golden files anew from this run"
    )
    parser.addoption(
        "--update-messages", action="store_true", help="write the stored messages anew"
    )


def pytest_configure() -> None:
    """Let tests be interrupted.

    Background processes of a script ignore SIGINT, and so would processes that tests start.

    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip what only root can run."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        for item in items:
            if item.get_closest_marker("root"):
                item.add_marker(pytest.mark.skip(reason="only root can"))


BY_NAME = {str(case): case for case in CASES}

# The belts with whose effects tests of belts run: in the plane and guided, with dampers that are
# stiffer than the waves and those that are not.
STIFF = "hard/belt_stiff_damping"
COMPILED_FIRST: list[tuple[str, dict[str, Any]]] = [
    ("belt_drive", {"solver.backend": "rkf45"}),
    ("belt_drive", {"solver.backend": "moreau"}),
    (STIFF, {}),
    (STIFF, {"effects.contact": None, "effects.bending": None}),
    ("belt_string", {"solver.backend": "moreau"}),
    ("belt_string", {"solver.backend": "rkf45"}),
]


def pytest_collection_finish(session: pytest.Session) -> None:
    """Have workers of pytest-xdist compile belts beside each other, before the first test.

    They begin at both ends of the list, and one waits for what another one compiles. Without
    workers a test compiles what it needs. Imported objects are excluded from all later searches for
    garbage.

    """
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    if worker and any(item.path.parent.name == "belt_drive" for item in session.items):
        # The folder of the workers' own ones, of which pytest removes all but the latest.
        folder = session.config._tmp_path_factory.getbasetemp().parent  # type: ignore[attr-defined]
        numbers = range(len(COMPILED_FIRST))
        for number in reversed(numbers) if int(worker.removeprefix("gw")) % 2 else numbers:
            # What cannot be compiled or loaded is told by the tests that need it.
            with FileLock(folder / f"kernels-{number}.lock"), suppress(Exception):
                name, changes = COMPILED_FIRST[number]
                data = fs.load(name).to_dict()
                for key, value in {"solver.duration": 1e-6, **changes}.items():
                    data = scenarios.changed(data, **{key.replace(".", "__"): value})
                fs.solve(data)
    _keep_what_is_there()


def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Do so after each file as well: the program collects garbage before it times a run."""
    if nextitem is not None and nextitem.path != item.path:
        _keep_what_is_there()


def _keep_what_is_there() -> None:
    gc.collect()
    gc.freeze()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Have a test that patches the program run scenarios anew."""
    scenarios.program_is_patched = "monkeypatch" in getattr(item, "fixturenames", ())


@pytest.fixture(scope="session")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Case], SolvedCase]:
    """Return a function that gives the result of a case, solved once for all workers."""
    folder = tmp_path_factory.getbasetemp()
    if os.environ.get("PYTEST_XDIST_WORKER"):
        folder = folder.parent  # of the session

    @cache
    def result(name: str) -> SolvedCase:
        path, calls = folder / f"{name}.h5", folder / f"{name}.calls"
        with FileLock(folder / f"{name}.lock"):
            if not calls.exists():
                times: list[float] = []
                fs.solve(BY_NAME[name].load(), output=path, progress=times.append)
                calls.write_text(str(len(times)))
        return SolvedCase(fs.open(path), int(calls.read_text()))

    return lambda case: result(str(case))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def cli(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> Callable[..., "subprocess.CompletedProcess[str]"]:
    """Run the command line in an empty folder, in this process."""
    return lambda *arguments: in_this_process(capsys, *arguments)


@pytest.fixture
def told(cli: Callable[..., "subprocess.CompletedProcess[str]"]) -> Callable[..., tuple[str, str]]:
    """Return a function that runs a command in an empty folder and returns stdout and stderr."""

    def run(*arguments: str | Path, code: int = 0) -> tuple[str, str]:
        done = cli(*arguments)
        assert done.returncode == code, done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout, done.stderr

    return run
