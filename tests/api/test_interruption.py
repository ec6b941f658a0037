"""Ctrl-C during a run in Python: the samples so far are written, and the run can be resumed."""

import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley_return.toml"


@pytest.fixture(autouse=True)
def handler_of_python() -> Iterator[None]:
    """A process of a parallel run of tests may ignore the signal."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt_at(call: int, signals: int = 1):  # type: ignore[no-untyped-def]
    """Return an `on_step` that sends SIGINT in its n-th call."""
    calls = iter(range(call, -1, -1))

    def on_step(t: float) -> None:
        if next(calls, None) == 0:
            for _ in range(signals):
                signal.raise_signal(signal.SIGINT)

    return on_step


def test_an_interrupted_run_is_written_and_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    whole, part = tmp_path / "whole.h5", tmp_path / "part.h5"
    fs.solve(PULLEY, output=whole)
    with pytest.raises(
        KeyboardInterrupt, match=r"run interrupted; its samples are in .*part\.partial\.h5"
    ):
        fs.solve(PULLEY, output=part, progress=interrupt_at(20))
    stopped = fs.open(part)
    assert stopped.status == "interrupted"
    assert stopped.reason.startswith("by SIGINT at t = ")
    assert fs.resume(part).status == "done"
    assert part.read_bytes() == whole.read_bytes()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_signal_does_not_wait(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        fs.solve(PULLEY, output=tmp_path / "a.h5", progress=interrupt_at(20, signals=2))
    assert not (tmp_path / "a.h5").exists()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_without_a_file_nothing_is_waited_for() -> None:
    calls: list[float] = []
    interrupt = interrupt_at(20)

    def on_step(t: float) -> None:
        calls.append(t)
        interrupt(t)

    with pytest.raises(KeyboardInterrupt):
        fs.solve(PULLEY, progress=on_step)
    assert len(calls) == 21


def test_a_handler_of_the_program_is_left_alone(tmp_path: Path) -> None:
    received: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: received.append(number))
    try:
        result = fs.solve(PULLEY, output=tmp_path / "a.h5", progress=interrupt_at(20))
    finally:
        signal.signal(signal.SIGINT, before)
    assert (result.status, received) == ("done", [signal.SIGINT])


def test_other_threads_install_no_handler(tmp_path: Path) -> None:
    statuses: list[str] = []

    def solve() -> None:
        statuses.append(fs.solve(PULLEY, output=tmp_path / "a.h5").status)

    thread = threading.Thread(target=solve)
    thread.start()
    thread.join()
    assert statuses == ["done"]


def test_a_function_of_the_progress_stops_a_run(tmp_path: Path) -> None:
    def stop(time: float) -> None:
        if time > 1.0:
            raise fs.Interrupted

    stopped = fs.solve("pulley", output=tmp_path / "a.h5", progress=stop)
    assert stopped.status == "interrupted"
    assert fs.resume(stopped).status == "done"
