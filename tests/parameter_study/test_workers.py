"""Worker processes: the same bytes whatever their number, and nothing lost when they die."""

import os
import signal
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.api import sweeping
from frictionsim.parameter_study import dispatch, executors
from frictionsim.parameter_study.executors import (
    InProcess,
    ProcessPool,
    available_cores,
    local_executor,
)
from tests.support.sweep_files import LOAD, LOOSE, PULLEY, die_in

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="workers are copies, on POSIX")

VARY = {LOAD: "lin(2000, 2400, 40)"}


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of a sweep in one process."""
    path = tmp_path_factory.mktemp("serial") / "s.h5"
    fs.sweep(PULLEY, VARY, LOOSE, output=path, workers=1)
    return path.read_bytes()


@pytest.fixture(autouse=True)
def copies(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers are copies of this process, with what a test has changed, whatever runs the tests."""
    monkeypatch.setattr(executors, "may_fork", lambda: True)


def _children() -> set[str]:
    """Return the processes that this one has started, on Linux."""
    threads = Path("/proc/self/task").glob("*/children")
    return {word for children in threads for word in children.read_text().split()}


def test_the_file_does_not_depend_on_the_workers_and_none_outlives_its_sweep(
    serial: bytes, tmp_path: Path
) -> None:
    before = _children()
    fs.sweep(PULLEY, VARY, LOOSE, output=tmp_path / "s.h5", workers=3)
    assert (tmp_path / "s.h5").read_bytes() == serial
    assert [path.name for path in tmp_path.iterdir()] == ["s.h5"]
    assert _children() <= before


def test_new_interpreters_do_the_same(
    serial: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executors, "may_fork", lambda: False)
    fs.sweep(PULLEY, VARY, LOOSE, output=tmp_path / "s.h5", workers=2)
    assert (tmp_path / "s.h5").read_bytes() == serial


def test_a_run_whose_worker_dies_is_run_again(
    serial: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = tmp_path / "times"
    times.write_text("xxx")  # in its block, in the same block alone, and in a half of it
    monkeypatch.setattr(dispatch, "run_task", die_in(17, times))
    fs.sweep(PULLEY, VARY, LOOSE, output=tmp_path / "s.h5", workers=2)
    assert times.read_text() == ""
    assert (tmp_path / "s.h5").read_bytes() == serial


def test_a_run_that_kills_its_workers_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = tmp_path / "times"
    times.write_text("x" * 20)
    monkeypatch.setattr(dispatch, "run_task", die_in(17, times))
    sweep = fs.sweep(PULLEY, VARY, LOOSE, workers=2)
    assert sweep["status"].values.tolist() == [1] * 17 + [2] + [1] * 22
    assert str(sweep["failure"][17].item()) == "worker_died"
    assert str(sweep["reason"][17].item()) == (
        "the worker process crashed in this run every time (SIGKILL)"
    )
    assert np.isnan(sweep["final_angle"][17])
    # In its block of at most 40 runs, in that alone, and in each half of a half down to itself.
    assert len(times.read_text()) >= 20 - 2 - 6


def test_workers_that_cannot_start_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "_isolate", lambda: os._exit(3))
    with pytest.raises(fs.InputError, match=r"no worker process can be started \(it ended with"):
        fs.sweep(PULLEY, VARY, LOOSE, workers=2)


@pytest.mark.parametrize("seconds_here", [-1.0, 60.0])
def test_the_first_invalid_combination_is_named_before_any_run(
    seconds_here: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatch, "SECONDS_OF_LOCAL_CHECKS", seconds_here)
    monkeypatch.delattr(sweeping, "run_blocks")  # no run begins
    loads = [*range(2000, 2070), -1.0, *range(2100, 2130), -2.0]
    with pytest.raises(fs.InputError, match=r"vary: mechanism.load=-1.0 is not valid"):
        fs.sweep(PULLEY, {LOAD: loads}, LOOSE, workers=2)


def test_an_error_of_the_progress_function_is_not_swallowed() -> None:
    def broken(progress: Any) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fs.sweep(PULLEY, {LOAD: "lin(2000, 2400, 400)"}, LOOSE, workers=2, progress=broken)


def test_workers_use_one_thread_of_linear_algebra_and_ignore_ctrl_c(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = tmp_path / "said"

    run_task = dispatch.run_task

    def tell(combinations: Any, task: Any, *more: Any) -> Any:
        from threadpoolctl import threadpool_info

        os.kill(os.getpid(), signal.SIGINT)
        threads = {library["num_threads"] for library in threadpool_info()}
        said.write_text(f"{threads or {1}} {threading.current_thread().name}")
        return run_task(combinations, task, *more)

    monkeypatch.setattr(dispatch, "run_task", tell)
    sweep = fs.sweep(PULLEY, {LOAD: [2000.0, 2100.0]}, LOOSE, workers=2)
    assert sweep["status"].values.tolist() == [1, 1]
    assert said.read_text() == "{1} MainThread"


def test_one_worker_or_one_run_needs_no_process() -> None:
    assert available_cores() >= 1
    assert isinstance(local_executor(1, 100), InProcess)
    assert isinstance(local_executor(8, 1), InProcess)
    assert isinstance(local_executor(8, 2), ProcessPool)
