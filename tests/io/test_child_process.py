"""Work in a child process: what it returns and raises, and that it may crash and loop."""

import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections import deque
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.io import child_process
from frictionsim.io.child_process import ChildFailed, ChildLimits, EndedFromOutside, run_in_child
from tests.support.scenarios import ROOT

LIMITS = ChildLimits(300.0, 1.0, 1 << 30)  # so long that a busy machine does not matter
HARMFUL = "the file is corrupt or malicious"


def arrays(count: int) -> dict[str, Any]:
    return {"a": np.arange(float(count)), "b": np.zeros((0, 3)), "c": "text"}


def refuse(text: str) -> None:
    raise InputError(text)


def crash(number: int) -> None:
    os.write(2, b"noise of a library")
    os.kill(os.getpid(), number)


def loop_in_c() -> None:
    """Never return to the interpreter, so that no handler of Python would run."""
    deque(repeat(0), maxlen=0)


def sleep() -> None:
    time.sleep(600.0)


def fill_memory() -> None:
    np.ones(1 << 30)


def stop_group(numbers: list[int]) -> str:
    """Have what Ctrl-C and a closed terminal send arrive here, as in all processes of a group."""
    for number in numbers:
        os.kill(os.getpid(), number)
    return "read"


def exit_early() -> None:
    os._exit(0)


@pytest.fixture(params=["fork", "interpreter"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Have the child be a copy of this process, or a new interpreter."""
    if request.param == "fork" and not (hasattr(os, "fork") and sys.platform != "darwin"):
        pytest.skip("there is no fork, or it is not sound")
    monkeypatch.setattr(child_process, "only_one_thread", lambda: request.param == "fork")
    return str(request.param)


def test_what_is_returned_and_raised(way: str) -> None:
    found = run_in_child(arrays, (200_000,), LIMITS)
    assert np.array_equal(found["a"], np.arange(200_000.0))
    assert (found["b"].shape, found["c"]) == ((0, 3), "text")
    found["a"][0] = 1.0  # it is as any array
    with pytest.raises(InputError, match="because"):
        run_in_child(refuse, ("because",), LIMITS)


def crash_of(work: Any, *arguments: Any, **limits: Any) -> str:
    with pytest.raises(ChildFailed) as failed:
        run_in_child(work, arguments, LIMITS._replace(**limits))
    assert isinstance(failed.value, EndedFromOutside) is (HARMFUL not in str(failed.value))
    return str(failed.value)


def test_a_crash_is_an_error_with_the_name_of_the_signal(
    way: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert crash_of(crash, signal.SIGSEGV) == f"HDF5 crashed on it (SIGSEGV): {HARMFUL}"
    assert crash_of(exit_early) == f"HDF5 crashed on it: {HARMFUL}"  # without an answer
    assert crash_of(crash, signal.SIGKILL) == (
        "the process that reads it was ended from outside (SIGKILL), as by a system that is short"
        " of memory; try again"
    )
    assert capfd.readouterr() == ("", "")


def test_what_stops_the_parent_does_not_end_the_child(way: str) -> None:
    numbers = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
    assert run_in_child(stop_group, (numbers,), LIMITS) == "read"


def test_a_stop_while_the_child_starts_is_only_of_the_parent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(child_process, "only_one_thread", lambda: True)
    isolate = child_process._isolate

    def late(limits: ChildLimits) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        isolate(limits)

    monkeypatch.setattr(child_process, "_isolate", late)
    assert run_in_child(arrays, (1,), LIMITS)["c"] == "text"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_a_loop_in_c_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "only_one_thread", lambda: True)
    assert crash_of(loop_in_c) == f"HDF5 did not come to an end within 1 s: {HARMFUL}"


def test_time_and_memory_of_a_child_are_limited(way: str) -> None:
    assert crash_of(sleep, seconds=0.5).endswith(f"{HARMFUL}, or its disk does not answer")
    assert "it takes more than 1074 MB of memory" in crash_of(fill_memory)
    assert crash_of(arrays, 200_000, memory=1_000_000)  # an answer larger than its limit


def children() -> set[str]:
    """Return the processes that this one has started; of tests before, some are still there."""
    return {
        number
        for path in Path("/proc/self/task").glob("*/children")
        for number in path.read_text().split()
    }


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="/proc")
def test_waiting_is_interrupted_by_a_signal_and_the_child_ends(way: str) -> None:
    others = children()

    def interrupt(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        with pytest.raises(KeyboardInterrupt):
            run_in_child(sleep, (), LIMITS)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert children() <= others


def test_the_warning_of_a_fork_with_threads_of_libraries_is_not_shown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fork = os.fork

    def warning() -> int:
        warnings.warn("This process is multi-threaded", DeprecationWarning, stacklevel=2)
        return fork()

    monkeypatch.setattr(os, "fork", warning)
    monkeypatch.setattr(child_process, "only_one_thread", lambda: True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run_in_child(arrays, (1,), LIMITS)["c"] == "text"


def test_a_process_with_threads_is_not_copied(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "fork", None)
    monkeypatch.setattr(child_process, "only_one_thread", lambda: False)  # also under pytest-xdist
    found: list[Any] = []
    thread = threading.Thread(target=lambda: found.append(run_in_child(arrays, (3,), LIMITS)))
    thread.start()
    thread.join()
    assert len(found[0]["a"]) == 3


@pytest.mark.parametrize("closed", ["<&- >&- 2>&-", ">&-"])
def test_closed_streams_do_not_matter(closed: str, tmp_path: Path) -> None:
    code = (
        "from tests.io.test_child_process import *\n"
        "import pathlib\n"
        "text = run_in_child(arrays, (3,), LIMITS)['c']\n"
        f"pathlib.Path({str(tmp_path / 'said')!r}).write_text(text)"
    )
    command = f"exec '{sys.executable}' -c '{code.replace(chr(39), chr(34))}' {closed}"
    subprocess.run(command, shell=True, cwd=ROOT, check=True, timeout=60)
    assert (tmp_path / "said").read_text() == "text"
