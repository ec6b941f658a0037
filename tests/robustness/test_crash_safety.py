"""Runs that are stopped, killed or out of disk space leave a complete, old or resumable file."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from frictionsim.cli.commands import run_command_line
from frictionsim.io import hdf5_reader
from tests.support.old_results import old_result
from tests.support.scenarios import SCENARIOS, frictionsim, pulley

PULLEY = str(SCENARIOS / "pulley.toml")
OLD = old_result()
# Hundreds of stick-slip cycles, two seconds of run time, a checkpoint every 0.1 s.
LONG = pulley(
    drive__force={"sine": {"mean": 2224.1, "amplitude": 1500.0, "frequency_hz": 20.0}},
    solver={"backend": "rkf45", "duration": 20.0},
    output={"interval": 0.01, "checkpoint": 0.1},
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, float]:
    """The scenario of a longer run, its result, and how long it takes, s."""
    folder = tmp_path_factory.mktemp("whole")
    scenario = folder / "long.toml"
    scenario.write_text(tomli_w.dumps(LONG))
    started = time.perf_counter()
    assert frictionsim("solve", scenario, "-q", "-o", "whole.h5", cwd=folder).returncode == 0
    return scenario, (folder / "whole.h5").read_bytes(), time.perf_counter() - started


def started(*arguments: str | Path, cwd: Path, **options: Any) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "frictionsim", *map(str, arguments)]
    return subprocess.Popen(
        command, cwd=cwd, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options
    )


def stop_at_random(
    number: int, whole: tuple[Path, bytes, float], folder: Path, seed: int, latest: float = 1.2
) -> tuple[int, str]:
    """Send a signal to a run at a random time; return its exit code and stderr."""
    scenario, _, seconds = whole
    with started("solve", scenario, "-q", "-o", "a.h5", cwd=folder) as process:
        time.sleep(random.Random(seed).uniform(0.0, latest * seconds))
        process.send_signal(number)
        _, captured = process.communicate()
    assert "Traceback" not in captured
    return process.returncode, captured


def assert_target_is_sound(target: Path, whole: bytes, before: bytes | None) -> str:
    """Check the file that a run has left, resume it if possible, and return its state."""
    if not target.exists():
        assert before is None
        return "absent"
    content = target.read_bytes()
    if content == before:
        part = target.with_name("a.partial.h5")
        if part.exists():
            # By -o: what is old there stands for the result of another scenario.
            assert run_command_line(["resume", str(part), "-q", "-o", str(target)]) == 0
            assert (target.read_bytes(), os.listdir(target.parent)) == (whole, [target.name])
        return "old"
    if content == whole:
        return "done"
    assert hdf5_reader.read(target).attributes["status"] == "interrupted"
    assert run_command_line(["resume", str(target), "-q"]) == 0
    assert target.read_bytes() == whole
    return "interrupted"


def kill_and_look(whole: tuple[Path, bytes, float], folder: Path, seed: int) -> str:
    before = OLD if seed % 2 else None
    if before is not None:
        (folder / "a.h5").write_bytes(before)
    code, _ = stop_at_random(signal.SIGKILL, whole, folder, seed)
    found = assert_target_is_sound(folder / "a.h5", whole[1], before)
    assert found == "done" or code == -signal.SIGKILL
    return found


@pytest.mark.parametrize("seed", range(3))
def test_a_killed_run_leaves_an_old_or_a_valid_file(
    seed: int, whole: tuple[Path, bytes, float], tmp_path: Path
) -> None:
    kill_and_look(whole, tmp_path, seed)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(100, 150))
def test_many_killed_runs_leave_an_old_or_a_valid_file(
    seed: int, whole: tuple[Path, bytes, float], tmp_path: Path, tally: dict[str, int]
) -> None:
    found = kill_and_look(whole, tmp_path, seed)
    for name in ("kills", f"kills that left the file {found}"):
        tally[name] = tally.get(name, 0) + 1


def signal_and_resume(whole: tuple[Path, bytes, float], folder: Path, seed: int) -> str:
    number = (signal.SIGINT, signal.SIGTERM)[seed % 2]
    code, captured = stop_at_random(number, whole, folder, seed)
    if code < 0:  # before the first step, when the scenario's warnings may be there already
        assert code == -number
        assert all(line.startswith("frictionsim: warning: ") for line in captured.splitlines())
    found = assert_target_is_sound(folder / "a.h5", whole[1], None)
    assert code in ((0, 128 + number) if found == "done" else (128 + number, -number, 1))
    return found


@pytest.mark.parametrize("seed", range(2))
def test_a_run_stopped_by_a_signal_resumes_to_identical_bytes(
    seed: int, whole: tuple[Path, bytes, float], tmp_path: Path
) -> None:
    signal_and_resume(whole, tmp_path, seed)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(100, 150))
def test_many_runs_stopped_by_signals_resume_to_identical_bytes(
    seed: int, whole: tuple[Path, bytes, float], tmp_path: Path, tally: dict[str, int]
) -> None:
    found = signal_and_resume(whole, tmp_path, seed)
    for name in ("signals", f"signals that left the file {found}"):
        tally[name] = tally.get(name, 0) + 1


def test_a_file_with_checkpoints_can_be_read_at_any_time(
    whole: tuple[Path, bytes, float], tmp_path: Path
) -> None:
    target = tmp_path / "a.h5"
    times = set()
    with started("solve", whole[0], "-q", "-o", "a.h5", cwd=tmp_path) as process:
        while process.poll() is None:
            if target.exists():
                found = hdf5_reader.read(target)
                assert np.all(np.isfinite(found.channels["angle"]))
                times.add(found.channels["time"].size)
            time.sleep(0.01)
        process.communicate()
    assert process.returncode == 0
    assert len(times) > 1
    assert target.read_bytes() == whole[1]


@pytest.mark.parametrize("checkpoint", [[], ["--set", "output.checkpoint=0.001"]])
@pytest.mark.parametrize("limit", [0, 4096, 20_000])
def test_a_file_size_limit_keeps_the_old_file(
    limit: int, checkpoint: list[str], tmp_path: Path
) -> None:
    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    (tmp_path / "a.h5").write_bytes(OLD)
    arguments = ["solve", PULLEY, "-q", "-o", "a.h5", *checkpoint]
    with started(*arguments, cwd=tmp_path, preexec_fn=limited) as process:
        _, captured = process.communicate()
    assert process.returncode == 4
    assert "a.h5: cannot write the result: File too large" in captured
    tried = bool(checkpoint and limit)  # with no room at all the run does not begin
    assert captured.count("warning: checkpoint not written") == tried
    assert (tmp_path / "a.h5").read_bytes() == OLD
    assert os.listdir(tmp_path) == ["a.h5"]


def test_a_full_file_system_keeps_the_old_file(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    (tmp_path / "old.h5").write_bytes(OLD)
    elsewhere = tmp_path / "tmp"
    elsewhere.mkdir()
    line = (
        f"mount -t tmpfs -o size=16k none {disk} || exit 99; cp {tmp_path}/old.h5 {disk}/a.h5;"
        f" {sys.executable} -m frictionsim solve {PULLEY} -q -o {disk}/a.h5;"
        f" echo $? $(cksum < {disk}/a.h5) $(cksum < {tmp_path}/old.h5) $(ls -A {disk})"
    )
    unshare = shutil.which("unshare")
    if unshare is None:
        pytest.skip("no way to have a mount of one's own")
    # In its own mount namespace, so that the mount ends with the process.
    done = subprocess.run(
        [unshare, "--mount", "sh", "-c", line],
        capture_output=True,
        text=True,
        env={**os.environ, "TMPDIR": str(elsewhere)},
        timeout=60,
        check=False,
    )
    if not done.stdout:
        pytest.skip("nothing can be mounted here")
    code, *checksums, name = done.stdout.split()
    assert (code, checksums[:2], name) == ("4", checksums[2:], "a.h5")
    (kept,) = elsewhere.glob("frictionsim-*/a.h5")
    assert hdf5_reader.read(kept).attributes["status"] == "done"
    assert done.stderr == (
        f"frictionsim: {disk}/a.h5: cannot write the result: No space left on device. The new"
        f" result is in {kept}: move it from there\n"
    )


def test_two_runs_into_one_file_leave_one_complete_result(tmp_path: Path) -> None:
    expected = []
    durations = ("2.0", "2.5")
    for name in durations:
        arguments = ["solve", PULLEY, "-q", "-o", f"{name}.h5"]
        arguments += ["--set", f"solver.duration={name}", "--set", "output.checkpoint=1e-3"]
        assert frictionsim(*arguments, cwd=tmp_path).returncode == 0
        expected.append((tmp_path / f"{name}.h5").read_bytes())
    for _ in range(3):
        at_once = [
            started(
                *("solve", PULLEY, "-q", "-o", "a.h5", "--set", f"solver.duration={name}"),
                *("--set", "output.checkpoint=1e-3"),
                cwd=tmp_path,
            )
            for name in durations
        ]
        for process in at_once:
            process.communicate()
            assert process.returncode == 0
        assert (tmp_path / "a.h5").read_bytes() in expected
    assert not list(tmp_path.glob(".*"))


SURROUNDINGS: list[dict[str, str]] = [
    {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    {"OMP_NUM_THREADS": "7", "NUMBA_NUM_THREADS": "2", "LC_ALL": "de_DE.UTF-8"},
    {"LC_ALL": "tr_TR.UTF-8", "LANG": "C", "TZ": "Asia/Kolkata", "PYTHONHASHSEED": "123"},
]


@pytest.mark.parametrize("name", ["pulley", "epicyclic"])
def test_results_do_not_depend_on_the_environment(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = set()
    for number, surroundings in enumerate(SURROUNDINGS):
        folder = tmp_path / str(number)
        folder.mkdir()
        with monkeypatch.context() as patched:
            for key, value in surroundings.items():
                patched.setenv(key, value)
            scenario = SCENARIOS / f"{name}.toml"
            done: Callable[..., Any] = frictionsim
            assert done("solve", scenario, "-q", "-o", "a.h5", cwd=folder).returncode == 0
        found.add((folder / "a.h5").read_bytes())
    assert len(found) == 1
