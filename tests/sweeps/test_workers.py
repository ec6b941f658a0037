"""Worker processes: the same bytes whatever their number, and nothing lost when they die."""

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.plugins import searched
from tests.support.scenarios import frictionsim, python
from tests.support.sweep_files import LOAD, PULLEY, command
from tests.support.unreliable import ANGLE, SCENARIO, unreliable

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="workers are copies, on POSIX")

ANGLES = {ANGLE: "lin(0, 39, 40)"}
DIE = (
    "import os, pathlib, signal",
    "times = pathlib.Path({times!r})",
    "if left := times.read_text():",
    "    times.write_text(left[1:])",
    "    os.kill(os.getpid(), signal.SIGKILL)",
)


@contextmanager
def another_thread() -> Iterator[None]:
    """Let this process have another thread: a copy of it would not be safe."""
    done = threading.Event()
    thread = threading.Thread(target=done.wait)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def test_the_file_does_not_depend_on_the_workers_and_none_outlives_its_sweep(
    tmp_path: Path,
) -> None:
    def sweep(name: str, workers: int) -> bytes:
        vary = {LOAD: "lin(2000, 2400, 40)"}
        fs.sweep(PULLEY, vary, {"solver.rtol": 1e-4}, output=tmp_path / name, workers=workers)
        return (tmp_path / name).read_bytes()

    serial = sweep("serial.h5", 1)
    with another_thread():  # workers are new interpreters
        assert sweep("new.h5", 2) == serial
    assert not multiprocessing.active_children()
    # In a process of one thread they are its copies.
    done = frictionsim(*command(40, "copies.h5", "--workers", "3"), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "copies.h5").read_bytes() == serial
    assert sorted(os.listdir(tmp_path)) == ["copies.h5", "new.h5", "serial.h5"]


LATE = """import os, signal, sys, time
if "spawn_main" in " ".join(sys.orig_argv):
    try:
        os.mkdir({first!r})
    except FileExistsError:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # as workers do that have begun
        time.sleep(600.0)
"""


def test_a_worker_that_has_not_begun_ends_with_its_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two new interpreters one takes minutes to start."""
    (tmp_path / "sitecustomize.py").write_text(LATE.format(first=str(tmp_path / "first")))
    paths = [str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    with another_thread():
        sweep = fs.sweep(PULLEY, {LOAD: [2000.0, 2100.0]}, {"solver.rtol": 1e-4}, workers=2)
    assert sweep.status == "done"
    assert (tmp_path / "first").is_dir()
    assert not multiprocessing.active_children()


@pytest.fixture
def dying(tmp_path: Path) -> Iterator[Path]:
    """A kind whose run 17 kills its process as often as a file has characters."""
    times = tmp_path / "times"
    times.write_text("")
    body = [line.format(times=str(times)) for line in DIE]
    with searched(unreliable(tmp_path / "site", 17, *body)):
        yield times


def test_a_killed_worker_ends_the_sweep_which_goes_on(dying: Path, tmp_path: Path) -> None:
    serial, spread, part = (tmp_path / name for name in ("a.h5", "s.h5", "s.partial.runs"))
    fs.sweep(SCENARIO, ANGLES, output=serial, workers=1)
    dying.write_text("xx")
    with pytest.raises(fs.SolverError) as died:
        fs.sweep(SCENARIO, ANGLES, output=spread, workers=2)
    assert died.value.exit_code == 5
    done = int((fs.open_sweep(part).table.status == 1).sum())
    assert 0 < done < 40
    assert str(died.value) == (
        "a worker process was killed, perhaps for lack of memory. sweep interrupted:"
        f" {done} of 40 runs are saved in {part}; 'frictionsim resume {part}' continues the sweep"
    )
    with pytest.raises(fs.SolverError, match="a worker process was killed"):
        fs.resume_sweep(part, workers=2)
    fs.resume_sweep(part, workers=2)
    assert dying.read_text() == ""
    assert spread.read_bytes() == serial.read_bytes()


def test_long_runs_are_left_when_a_sweep_is_interrupted(tmp_path: Path) -> None:
    def stop(step: Any) -> None:
        if step.done:
            raise KeyboardInterrupt

    begun = time.monotonic()
    body = "import time", "time.sleep(600.0)"
    with searched(unreliable(tmp_path / "site", 1, *body)), pytest.raises(KeyboardInterrupt):
        fs.sweep(SCENARIO, {ANGLE: [0, 1, 2]}, output=tmp_path / "s.h5", workers=2, progress=stop)
    assert time.monotonic() - begun < 60.0
    assert not multiprocessing.active_children()
    status = fs.open_sweep(tmp_path / "s.h5").table.status
    assert status.any()
    assert status[1] == 0


@pytest.mark.slow  # three interpreters start
def test_workers_that_cannot_start_are_reported(tmp_path: Path) -> None:
    """Those of a script that would begin its sweep anew in each of them."""
    (tmp_path / "script.py").write_text(
        "import threading, frictionsim as fs\n"
        "threading.Thread(target=threading.Event().wait, daemon=True).start()\n"
        f"fs.sweep({str(PULLEY)!r}, {{'{LOAD}': [2000.0, 2100.0]}}, workers=2)\n"
    )
    done = python(tmp_path / "script.py")
    assert done.returncode == 1, done.stderr
    assert "no worker process can be started; a script" in done.stderr


def test_workers_use_one_thread_of_linear_algebra_and_ignore_ctrl_c(tmp_path: Path) -> None:
    said = tmp_path / "said"
    body = (
        "import os, signal, threading",
        "from threadpoolctl import threadpool_info",
        "os.kill(os.getpid(), signal.SIGINT)",
        "threads = {library['num_threads'] for library in threadpool_info()}",
        f"name = '{said}'",
        "open(name, 'w').write(f'{threads or {1}} {threading.current_thread().name}')",
    )
    with searched(unreliable(tmp_path / "site", 1, *body)):
        sweep = fs.sweep(SCENARIO, {ANGLE: [0.0, 1.0]}, workers=2)
    assert sweep["status"].values.tolist() == [1, 1]
    assert said.read_text() == "{1} MainThread"
