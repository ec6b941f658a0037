"""`solve` and `resume`: what they return, write, raise and tell while they run."""

import itertools
import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim import errors
from frictionsim.api.progress import STEPS_BETWEEN_UPDATES
from frictionsim.results import Check
from tests.simulation.test_failures import FAILURES
from tests.support.scenarios import SCENARIOS, pulley

PULLEY, RETURN = SCENARIOS / "pulley.toml", SCENARIOS / "pulley_return.toml"
MU_S = "effects.shaft_friction.mu_s"


def stopping_at(time: float, number: int = 15) -> Callable[[float], None]:
    """Return a callback that stops a run as a signal does."""

    def on_step(t: float) -> None:
        if t >= time:
            raise fs.Interrupted(number, t)

    return on_step


def bytes_of(result: fs.Result, folder: Path) -> bytes:
    return result.save(folder / "bytes.h5").read_bytes()


def test_sources_of_one_origin_give_the_same_file_as_the_command(
    here: Path, cli: Callable[..., Any]
) -> None:
    result = fs.solve(PULLEY, {MU_S: 0.3}, output="a.h5")
    assert result.path == Path("a.h5")
    assert cli("solve", PULLEY, "-q", "-o", "b.h5", "--set", f"{MU_S}=0.3").returncode == 0
    written = Path("b.h5").read_bytes()
    assert Path("a.h5").read_bytes() == written
    assert bytes_of(result, here) == bytes_of(fs.open("a.h5"), here) == written
    assert bytes_of(fs.solve(str(PULLEY), [f"{MU_S}=0.3"]), here) == written
    assert bytes_of(fs.solve(fs.load(PULLEY), {MU_S: 0.3}), here) == written
    assert fs.solve(pulley(), {MU_S: 0.3}).dataset.equals(result.dataset)


# --- runs that fail -------------------------------------------------------------------------


@pytest.mark.parametrize("name", FAILURES)
def test_a_failed_run_raises_only_if_asked(name: str) -> None:
    data, where, advice = FAILURES[name]
    result, kind = fs.solve(data), errors.failure_class(name)
    assert (result.status, result.failure) == ("failed", name)
    assert where in result.reason
    assert result.exit_code == (5 if name == "budget_exceeded" else 1)
    for call in (lambda: fs.solve(data, check=True), result.check):
        with pytest.raises(fs.SolverError, match=r"^run failed: ") as caught:
            call()
        assert (type(caught.value), caught.value.exit_code) == (kind, result.exit_code)
        assert advice in str(caught.value)


def test_check_says_where_the_samples_are(tmp_path: Path) -> None:
    path, part = tmp_path / "a.h5", tmp_path / "a.partial.h5"
    with pytest.raises(errors.BudgetExceeded) as caught:
        fs.solve(PULLEY, {"solver.max_steps": 10}, output=path, check=True)
    assert str(caught.value).endswith(f" (samples up to this time are in {part})")
    with pytest.raises(errors.BudgetExceeded) as again:
        fs.open(path).check()
    assert str(again.value) == str(caught.value)


def test_an_interrupted_run_has_the_exit_code_of_its_signal(tmp_path: Path) -> None:
    result = fs.solve(PULLEY, progress=stopping_at(1.0))
    for each in (result, fs.open(result.save(tmp_path / "a.h5"))):
        assert (each.status, each.exit_code) == ("interrupted", 143)
        with pytest.raises(fs.SolverError, match=r"^run interrupted: by SIGTERM at t = ") as caught:
            each.check()
        assert caught.value.exit_code == 143


def test_a_failed_audit_is_an_error_only_if_asked(tmp_path: Path) -> None:
    done = fs.solve(PULLEY).record
    reason = "self-audit failed: energy_balance 0.5 above 0.01"
    failed = done._replace(
        checks=done.checks | {"energy_balance": Check(0.5, 0.01)},
        attributes=done.attributes | {"reason": reason},
    )
    result = fs.open(fs.Result(failed).save(tmp_path / "a.h5"))
    assert (result.status, result.exit_code, result.audit["energy_balance"].ok) == (
        "done",
        3,
        False,
    )
    with pytest.raises(fs.AuditError, match=f"^{reason}$") as caught:
        result.check()
    assert caught.value.exit_code == 3


# --- resuming -------------------------------------------------------------------------------


def test_a_run_is_resumed_in_memory_and_from_its_file_to_the_same_bytes(tmp_path: Path) -> None:
    whole, path = bytes_of(fs.solve(PULLEY), tmp_path), tmp_path / "a.h5"
    part = fs.solve(PULLEY, output=path, progress=stopping_at(0.3))
    assert part.path == tmp_path / "a.partial.h5"
    in_memory = fs.solve(PULLEY, progress=stopping_at(0.3))
    further = fs.resume(in_memory, progress=stopping_at(1.2))
    assert (further.status, further.path) == ("interrupted", None)
    assert bytes_of(fs.resume(further, check=True), tmp_path) == whole
    assert bytes_of(fs.resume(in_memory), tmp_path) == whole  # it is as it was
    copied = fs.open(path).save(tmp_path / "copy.h5")
    assert copied.read_bytes() == part.path.read_bytes()
    result = fs.resume(path)  # where only the unfinished one stands
    assert (result.status, result.path) == ("done", path)
    assert fs.resume(copied, output=tmp_path / "other.h5").path == tmp_path / "other.h5"
    assert path.read_bytes() == (tmp_path / "other.h5").read_bytes() == whole


def test_max_wall_counts_from_the_call() -> None:
    class Slow(dict[str, Any]):
        def items(self) -> Any:
            time.sleep(0.3)
            return super().items()

    assert fs.solve(Slow(pulley()), max_wall=0.25).exit_code == 5


def test_a_copy_without_its_state_is_saved_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = fs.solve(PULLEY, progress=stopping_at(0.6)).save(tmp_path / "a.h5")
    part = fs.open(path)
    path.unlink()
    with caplog.at_level(logging.WARNING, "frictionsim"):
        part.save(tmp_path / "b.h5")
    (record,) = caplog.records
    assert record.getMessage().startswith(f"saved without the state to resume from: {path}: ")
    with pytest.raises(fs.InputError, match="it has no checkpoint"):
        fs.resume(tmp_path / "b.h5")


# --- Ctrl-C ---------------------------------------------------------------------------------


@pytest.fixture
def handler_of_python() -> Iterator[None]:
    """A process of a parallel run of tests may ignore the signal; it is in place afterwards."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def interrupt_at(call: int, signals: int = 1) -> Callable[[float], None]:
    """Return an `on_step` that sends SIGINT in its n-th call."""
    calls = iter(range(call, -1, -1))

    def on_step(t: float) -> None:
        if next(calls, None) == 0:
            for _ in range(signals):
                signal.raise_signal(signal.SIGINT)

    return on_step


def test_an_interrupted_run_is_written_and_goes_on_to_the_same_bytes(
    tmp_path: Path, handler_of_python: None
) -> None:
    whole, part = tmp_path / "whole.h5", tmp_path / "part.h5"
    fs.solve(RETURN, output=whole)
    with pytest.raises(
        KeyboardInterrupt, match=r"run interrupted; its samples are in .*part\.partial\.h5"
    ):
        fs.solve(RETURN, output=part, progress=interrupt_at(20))
    assert fs.open(part).reason.startswith("by SIGINT at t = ")
    assert fs.resume(part).status == "done"
    assert part.read_bytes() == whole.read_bytes()


def test_a_second_signal_and_one_without_a_file_do_not_wait(
    tmp_path: Path, handler_of_python: None
) -> None:
    for options, signals in (({"output": tmp_path / "a.h5"}, 2), ({}, 1)):
        with pytest.raises(KeyboardInterrupt):
            fs.solve(RETURN, progress=interrupt_at(20, signals), **options)
    assert not list(tmp_path.iterdir())


def test_a_handler_of_the_program_and_other_threads_are_left_alone(tmp_path: Path) -> None:
    received, statuses = list[int](), list[str]()
    before = signal.signal(signal.SIGINT, lambda number, frame: received.append(number))
    try:
        result = fs.solve(RETURN, output=tmp_path / "a.h5", progress=interrupt_at(20))
    finally:
        signal.signal(signal.SIGINT, before)
    assert (result.status, received) == ("done", [signal.SIGINT])
    output = tmp_path / "b.h5"
    thread = threading.Thread(
        target=lambda: statuses.append(fs.solve(RETURN, output=output).status)
    )
    thread.start()
    thread.join()
    assert statuses == ["done"]


# --- progress -------------------------------------------------------------------------------


def test_progress_calls_with_the_time_of_each_step() -> None:
    times: list[float] = []
    result = fs.solve(PULLEY, progress=times.append)
    assert times == sorted(times)
    assert len(times) >= result.statistics.steps
    assert times[-1] > 2.9


def test_progress_shows_a_bar_on_a_terminal_only(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    with monkeypatch.context() as without_limit:
        without_limit.setattr("frictionsim.api.progress.SECONDS_WITHOUT_BAR", 0.0)
        fs.solve(PULLEY, progress=True)
    assert capsys.readouterr() == ("", "")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes any stream for a terminal then
    with monkeypatch.context() as done_at_once:
        done_at_once.setattr("frictionsim.api.progress.monotonic", lambda: 1000.0)
        fs.solve(PULLEY, {"solver.max_step": 1e-3}, progress=True)
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("frictionsim.api.progress.SECONDS_WITHOUT_BAR", 0.0)
    fs.solve(PULLEY, {"solver.max_step": 1e-3}, progress=True)
    out, err = capsys.readouterr()
    assert (out, "t = " in err, "of 3 s" in err) == ("", True, True)
    failing = {"solver.max_steps": [5, 100_000, 100_001, 100_002]}
    fs.sweep("pulley", failing, {"solver.max_step": 1e-3}, workers=1, progress=True)
    out, err = capsys.readouterr()
    assert (out, "of 4" in err, "1 failed" in err) == ("", True, True)


def test_the_pace_of_a_resumed_run_excludes_earlier_parts(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that goes on by a second at each reading: at the start, and at each update."""
    step = 5e-4
    part = fs.solve(PULLEY, {"solver.max_step": step}, progress=stopping_at(1.0))
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    seconds = itertools.count()
    monkeypatch.setattr("frictionsim.api.progress.monotonic", lambda: float(next(seconds)))
    assert fs.resume(part, progress=True).status == "done"
    text = capsys.readouterr().err.rpartition(" s per simulated second")[0]
    # The first of these steps is not in that time, one of some 4000. Were the time before counted,
    # this were two thirds of it.
    pace = float(text.rpartition(", ")[2])
    assert pace == pytest.approx(1.0 / (STEPS_BETWEEN_UPDATES * step), rel=5e-3)  # of 3 digits


@pytest.mark.parametrize("run", [1, 2])
def test_an_exception_of_progress_ends_the_run(run: int) -> None:
    """Also the second one, of an estimate of errors."""
    error, times = ZeroDivisionError("mine"), [0.0]

    def broken(t: float) -> None:
        if run == 1 or t < times[-1]:
            raise error
        times.append(t)

    with pytest.raises(ZeroDivisionError) as raised:
        fs.solve(PULLEY, progress=broken, estimate_error=True)
    assert raised.value is error
