"""Commands killed at random: files are old, whole or resumable, and nothing else is left.

Runs of a pulley are killed at each change of a file in `test_crash_safety.py`; here are belts,
pictures and cost studies at random times, and sweeps with and without their workers.
`FRICTIONSIM_KILLS=300 pytest -m nightly tests/robustness/test_kills.py` kills 300 times.
"""

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.support.old_results import old_result
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import command, started

pytestmark = pytest.mark.nightly

PULLEY = str(SCENARIOS / "pulley.toml")
OFTEN = ("-q", "--set", "output.checkpoint=5e-3", "-o", "a.h5")  # s, between checkpoints


def run_of(name: str, *changes: str) -> list[str]:
    return ["solve", str(SCENARIOS / f"{name}.toml"), *changes, *OFTEN]


COMMANDS = {
    "run": run_of("pulley", "--set", "solver.duration=4", "--set", "output.interval=5e-3"),
    "belt": run_of("belt_drive", "--backend", "moreau", "--set", "solver.duration=0.05"),
    "picture": ["plot", "source.h5", "-o", "a.png"],
    "costs": [
        *("cost", PULLEY, "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"),
        *("--csv", "a.csv"),
    ],
}
OLD = {"a.h5": old_result(), "a.png": b"\x89PNG\r\n\x1a\nold", "a.csv": b"law,backend,setting,old"}
KILLS = int(os.environ.get("FRICTIONSIM_KILLS", "60"))  # one in three of a sweep
SOURCE = "source.h5"
SECONDS = 300.0  # that a command may take, kernels compiled anew on a busy machine
RUNS = 1200  # of a sweep


def finish(arguments: list[str], folder: Path) -> None:
    """Run a command to its end."""
    process = started(arguments, folder)
    said = process.communicate(timeout=SECONDS)
    assert process.returncode == 0, said


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What each command writes when it is left alone, and its sources, by name."""
    folder = tmp_path_factory.mktemp("whole")
    finish([*COMMANDS["run"][:-1], "source.h5"], folder)
    contents = {SOURCE: (folder / SOURCE).read_bytes()}
    for name, arguments in COMMANDS.items():
        finish(arguments, folder)
        contents[name] = (folder / arguments[-1]).read_bytes()
        (folder / arguments[-1]).unlink()
    return contents


def wait(rng: random.Random, process: "subprocess.Popen[bytes]", folder: Path) -> str:
    """Wait until some new files are there, and a little longer, or for any time; say how long."""
    if rng.random() < 0.2:
        seconds = rng.uniform(0.0, 1.5)
        time.sleep(seconds)
        return f"after {seconds:.3g} s"
    seen, latest = set(os.listdir(folder)), time.monotonic() + 20.0
    count = rng.choice((1, 1, 2, 3, 5))
    wanted = len(seen) + count
    while len(seen) < wanted and process.poll() is None and time.monotonic() < latest:
        seen.update(os.listdir(folder))
    pause = rng.choice((0.0, 1e-4, 1e-3, 1e-2, 2.0)) * rng.random()
    time.sleep(pause)
    return f"{pause:.2g} s after {count} new names"


@pytest.mark.parametrize("seed", range(KILLS - KILLS // 3))
def test_a_killed_command_leaves_an_old_or_a_whole_file(
    seed: int, whole: dict[str, bytes], tmp_path: Path
) -> None:
    rng = random.Random(f"kill {seed}")
    name = rng.choice(list(COMMANDS))
    arguments, target = COMMANDS[name], tmp_path / COMMANDS[name][-1]
    (tmp_path / SOURCE).write_bytes(whole[SOURCE])
    old = OLD.get(target.name) if rng.random() < 0.5 else None
    if old is not None:
        target.write_bytes(old)
    with started(arguments, tmp_path) as process:
        when = wait(rng, process, tmp_path)
        process.send_signal(signal.SIGKILL)
    content = target.read_bytes() if target.exists() else None
    # A table of costs has times in it, other ones each time.
    is_whole = content == whole[name] or (name == "costs" and content not in (old, None))
    assert is_whole or content == old, (name, when)
    if (tmp_path / "a.partial.h5").exists() and rng.random() < 0.7:
        assert fs.open(tmp_path / "a.partial.h5").status == "interrupted", (name, when)
        arguments = ["resume", "a.partial.h5", "-q"]
    finish(arguments, tmp_path)
    assert {*os.listdir(tmp_path)} == {target.name, SOURCE}, (name, when)
    assert (tmp_path / SOURCE).read_bytes() == whole[SOURCE]
    assert name == "costs" or target.read_bytes() == whole[name], (name, when)


@pytest.fixture(scope="module")
def whole_sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep")
    finish(command(RUNS, "s.h5", "-q"), folder)
    return folder / "s.h5"


@pytest.mark.parametrize("seed", range(KILLS // 3))
def test_a_killed_sweep_is_resumed_to_the_same_bytes(
    seed: int, whole_sweep: Path, tmp_path: Path
) -> None:
    """Up to three times in a row; what the file says of a run is what the run gives."""
    rng = random.Random(f"kill of a sweep {seed}")
    path, part = tmp_path / "s.h5", tmp_path / "s.partial.runs"
    expected = fs.open_sweep(whole_sweep)
    arguments = command(RUNS, "s.h5", "-q", "-j", rng.choice("12"))
    for _ in range(rng.choice((1, 1, 2, 3))):
        process = started(arguments, tmp_path)
        time.sleep(rng.uniform(0.3, 4.0))
        if rng.random() < 0.5 and process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)  # and its workers
        else:
            process.kill()
        process.communicate()
        time.sleep(0.2)  # for workers to see that they are alone
        if not part.exists() or not part.stat().st_size:
            break
        kept = fs.open_sweep(part)
        assert kept.status == "interrupted"
        # Before the first block is done there are no quantities.
        for name in {"final_angle", "breakaway_time"} & kept.table.values.keys():
            values, right = np.asarray(kept[name]), np.asarray(expected[name])
            there = np.isfinite(values)
            assert np.array_equal(values[there], right[there]), name
        arguments = ["resume", part.name, "-q"]
    if not path.exists() or part.exists():
        finish(arguments, tmp_path)
    assert path.read_bytes() == whole_sweep.read_bytes()
    if len(os.listdir(tmp_path)) > 1:  # killed just before the last removal: the next command's
        started(["resume", "s.h5"], tmp_path).communicate(timeout=SECONDS)
    assert os.listdir(tmp_path) == ["s.h5"]
