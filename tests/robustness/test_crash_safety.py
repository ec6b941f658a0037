"""Runs that are stopped, killed or out of disk space leave a complete, old or resumable file."""

import multiprocessing
import os
import signal
from collections.abc import Sequence
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.file_sizes import limited_files
from tests.support.old_results import old_result
from tests.support.scenarios import SCENARIOS, frictionsim
from tests.support.stopped_runs import stopped_at

PULLEY = str(SCENARIOS / "pulley.toml")
OLD = old_result()
PLAIN = ["solve", PULLEY, "-q", "-o", "a.h5"]
SHORT = [*PLAIN, "--set", "output.checkpoint=5e-3"]  # a few checkpoints


def state_of(target: Path, whole: bytes, before: bytes | None) -> str:
    """Check the file of an ended run, resume it if possible, and return its state."""
    content = target.read_bytes() if target.exists() else None
    if content == whole:
        return "done"
    assert content == before  # an unfinished result never stands there
    part = target.with_name("a.partial.h5")
    if not part.exists():
        return "absent" if content is None else "old"
    assert fs.open(part).status == "interrupted"
    assert fs.run_command_line(["resume", str(part), "-q"]) == 0
    assert (target.read_bytes(), os.listdir(target.parent)) == (whole, [target.name])
    return "interrupted"


@pytest.mark.parametrize(
    ("command", "number", "changes"),
    [
        pytest.param(PLAIN, signal.SIGKILL, range(1, 25), id="killed"),
        pytest.param(
            SHORT,
            signal.SIGKILL,
            (5, 6, 7, 8, 10, 12),
            id="killed with checkpoints",
            marks=pytest.mark.slow,
        ),
        # Other signals are heard between two steps, wherever they come; after the last, never.
        pytest.param(SHORT, signal.SIGTERM, (1, 4, 10), id="terminated", marks=pytest.mark.slow),
        pytest.param(SHORT, signal.SIGINT, (1, 4, 10), id="interrupted", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("before", [None, OLD], ids=["new", "old"])
def test_a_run_stopped_at_any_change_of_a_file_leaves_an_old_or_a_valid_one(
    before: bytes | None, command: list[str], number: int, changes: Sequence[int], here: Path
) -> None:
    assert fs.run_command_line(command) == 0
    whole, target, states = Path("a.h5").read_bytes(), here / "a.h5", [""]
    for change in changes:
        for path in here.iterdir():
            path.unlink()
        if before is not None:
            target.write_bytes(before)
        code = stopped_at(change, lambda: fs.run_command_line(command), here, number)
        assert code in (0, -number, 128 + number)  # without a step before it, by the signal itself
        states.append(state_of(target, whole, before))
        assert states[-1] == "done" or code != 0
        assert states[-1] != "absent" or "interrupted" not in states  # a checkpoint is not lost
        assert fs.run_command_line(command) == 0
        assert (target.read_bytes(), os.listdir(here)) == (whole, ["a.h5"])
        if code == 0:  # there were no more changes
            break
    assert {"absent", "old", "interrupted"} & {*states}
    assert command == SHORT or code == 0


@pytest.mark.parametrize(
    ("checkpoint", "limit"),
    [([], 4096), ([], 0), (["--set", "output.checkpoint=0.001"], 20_000)],
)
def test_a_file_size_limit_keeps_the_old_file(
    limit: int, checkpoint: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("a.h5").write_bytes(OLD)
    with limited_files(limit):
        assert fs.run_command_line(["solve", PULLEY, "-q", "-o", "a.h5", *checkpoint]) == 4
    captured = capsys.readouterr().err
    assert "a.h5: cannot write the result: File too large" in captured
    tried = bool(checkpoint and limit)  # with no room at all the run does not begin
    assert captured.count("warning: checkpoint not written") == tried
    assert Path("a.h5").read_bytes() == OLD
    assert os.listdir() == ["a.h5"]


def test_two_runs_into_one_file_leave_one_complete_result(here: Path) -> None:
    commands = [[*SHORT, "--set", f"solver.duration={t}"] for t in (2.0, 2.5)]
    expected = []
    for command in commands:
        assert fs.run_command_line(command) == 0
        expected.append(Path("a.h5").read_bytes())
    copied = multiprocessing.get_context("fork")
    for _ in range(3):
        at_once = [
            copied.Process(target=lambda c=c: os._exit(fs.run_command_line(c))) for c in commands
        ]
        for process in at_once:
            process.start()
        for process in at_once:
            process.join()
        # One that writes while the other does is told.
        assert {process.exitcode for process in at_once} in ({0}, {0, 4})
        assert Path("a.h5").read_bytes() in expected
    # The result of one that was told is beside it.
    assert all(path.name.startswith(("a.h5", "a.new")) for path in here.iterdir())


SURROUNDINGS: list[dict[str, str]] = [
    {"OMP_NUM_THREADS": "7", "NUMBA_NUM_THREADS": "2", "LC_ALL": "de_DE.UTF-8"},
    {
        **dict.fromkeys(("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
        "LC_ALL": "tr_TR.UTF-8",
        "LANG": "C",
        "TZ": "Asia/Kolkata",
        "PYTHONHASHSEED": "123",
    },
]


def test_results_do_not_depend_on_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outputs = set()
    scenarios = [SCENARIOS / "pulley.toml", SCENARIOS / "epicyclic.toml"]
    for number, surroundings in enumerate(SURROUNDINGS):
        folder = tmp_path / str(number)
        folder.mkdir()
        with monkeypatch.context() as patched:
            for key, value in surroundings.items():
                patched.setenv(key, value)
            assert frictionsim("solve", *scenarios, "-q", cwd=folder).returncode == 0
        outputs.add(
            tuple((folder / "results" / f"{path.stem}.h5").read_bytes() for path in scenarios)
        )
    assert len(outputs) == 1
