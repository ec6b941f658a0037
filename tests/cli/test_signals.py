"""Signals before, in and after the steps of a run, and the wall-time limit of each stage."""

import functools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import pytest

import frictionsim as fs
from frictionsim import __main__ as entry
from frictionsim.api import fitting, solving
from frictionsim.cli import job, monitor, study_commands
from frictionsim.cli.job import Report
from frictionsim.cli.monitor import CommandMonitor
from frictionsim.errors import BudgetExceeded, Interrupted
from frictionsim.io.atomic_write import PartFile
from frictionsim.io.checksum import append_trailer
from frictionsim.io.destination import Destination
from frictionsim.simulation.monitor import Monitors, WallTimeLimit
from frictionsim.simulation.single_dof import RecordedSimulation
from frictionsim.solvers import event_driven
from tests.cli.conftest import Run, strict_json
from tests.support.cases import one_in
from tests.support.scenarios import ROOT, SCENARIOS

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs signals of POSIX")

PULLEY = str(SCENARIOS / "pulley.toml")
NUMBERS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
# The stage is replaced by C code that waits, in which no handler in Python would run.
STALLED = """
import signal, sys, time
from ctypes import CDLL
if sys.platform != "win32":
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which `nohup` has ignored
import frictionsim.__main__ as entry
from frictionsim.mechanisms import pulley
def wait(*_):
    print("waiting", flush=True)
    CDLL(None).usleep(60_000_000)
{place} = wait
sys.argv = ["frictionsim", *{arguments}]
entry.main()
"""


def stalled(place: str, arguments: list[str], folder: Path) -> "subprocess.Popen[str]":
    program = STALLED.format(place=place, arguments=arguments)
    return subprocess.Popen(
        [sys.executable, "-c", program], cwd=folder, text=True, stdout=-1, stderr=-1,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


@pytest.mark.parametrize("number", one_in(2, NUMBERS))
def test_a_signal_ends_an_assembly_in_c(number: signal.Signals, tmp_path: Path) -> None:
    with stalled("pulley.simulation", ["solve", PULLEY, "-o", "a.h5"], tmp_path) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "waiting\n"
        process.send_signal(number)
        process.communicate(timeout=20)
    assert process.returncode == -number  # 130, 143 and 129 in a shell
    assert os.listdir(tmp_path) == []


def test_ctrl_c_in_the_first_import_of_the_package_ends_without_a_traceback() -> None:
    program = (
        "import signal, sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'frictionsim.io': signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from frictionsim.__main__ import main\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, b"")


def test_max_wall_ends_an_assembly(tmp_path: Path) -> None:
    arguments = ["solve", PULLEY, "-o", "a.h5", "--max-wall", "0.2"]
    with stalled("pulley.simulation", arguments, tmp_path) as process:
        _, err = process.communicate(timeout=20)
    assert process.returncode == 5
    assert err == (
        "frictionsim: wall-time limit of 0.2 s reached before the first step; nothing was"
        " written; raise the limit\n"
    )
    assert os.listdir(tmp_path) == []


@pytest.fixture
def left(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The exit codes with which the process would have ended."""
    codes: list[int] = []
    monkeypatch.setattr("os._exit", codes.append)
    monkeypatch.setattr("frictionsim.cli.app.Process.runs_one_command", True)
    return codes


def wait_for(condition: Callable[[], Any]) -> None:
    end = time.monotonic() + 10.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)


def test_max_wall_ends_a_compilation_and_prints_what_there_is(
    left: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    printed: list[int] = []
    with (
        CommandMonitor(1.0, with_progress=False, quiet=True) as on_step,
        on_step.limited(0.01, lambda: printed.append(1)),
        on_step.compiling(20.0),
    ):
        wait_for(lambda: left)
    assert (left, printed) == ([5], [1])
    assert capsys.readouterr().err == (
        "frictionsim: wall-time limit of 0.01 s reached while compiling kernels; nothing"
        " was written; 'frictionsim warm-up' compiles them beforehand\n"
    )


def test_a_run_with_steps_is_not_ended_by_the_clock(left: list[int]) -> None:
    with CommandMonitor(1.0, with_progress=False) as on_step, on_step.limited(0.01, lambda: None):
        on_step(0.0)
        time.sleep(monitor.SECONDS_AFTER_LIMIT + 0.2)
    assert left == []


@pytest.fixture
def defaults() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in NUMBERS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", NUMBERS)
def test_signals_are_handled_from_the_first_step_to_the_end(
    number: signal.Signals, defaults: None
) -> None:
    signal.signal(number, signal.SIG_DFL)
    with CommandMonitor(1.0, with_progress=False) as on_step:
        assert signal.getsignal(number) is signal.SIG_DFL
        on_step(0.0)
        signal.raise_signal(number)
        with pytest.raises(Interrupted, match=f"by {number.name} at t = 0.5 s") as stop:
            on_step(0.5)
    assert stop.value.exit_code == 128 + number
    assert signal.getsignal(number) is signal.SIG_DFL


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_that_the_process_ignores_stays_ignored(
    number: signal.Signals, defaults: None
) -> None:
    signal.signal(number, signal.SIG_IGN)
    with CommandMonitor(1.0, with_progress=False, quiet=True) as on_step, on_step.compiling(1.0):
        on_step(0.0)
        assert signal.getsignal(number) is signal.SIG_IGN


def test_the_entry_point_leaves_an_ignored_sigint(defaults: None) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    entry._restore_default_of_sigint()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    signal.signal(signal.SIGINT, signal.default_int_handler)
    entry._restore_default_of_sigint()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL


def test_a_signal_while_a_result_is_written_keeps_it_and_stops_the_others(
    told: Run, monkeypatch: pytest.MonkeyPatch, defaults: None
) -> None:
    write = Destination.write

    def interrupted(self: Destination, run: object) -> object:
        signal.raise_signal(signal.SIGTERM)
        return write(self, run)  # type: ignore[arg-type]

    monkeypatch.setattr(Destination, "write", interrupted)
    other = str(SCENARIOS / "pulley_return.toml")
    out, err = told("solve", PULLEY, other, "--json", code=143)
    assert [item["status"] for item in strict_json(out)] == ["done"]
    assert err == "frictionsim: not solved: 1 of the scenarios, after this one\n"
    assert os.listdir("results") == ["pulley.h5"]
    assert told("solve", PULLEY, "-q", code=0) == ("", "")


def test_what_was_solved_is_printed_before_the_clock_ends_the_process(
    told: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    report = Report(as_json=True, quiet=False, verbose=0, several=True)
    report.add(fs.solve(PULLEY), PULLEY, (), Path("a.h5"))
    report.waiting = 2
    report._give_up()
    captured = capsys.readouterr()
    assert [item["status"] for item in strict_json(captured.out)] == ["done"]
    assert captured.err == "frictionsim: not solved: 2 of the scenarios, after this one\n"


@pytest.mark.parametrize("option", ["--max-steps=100000", "--json"])
def test_a_signal_while_the_summary_is_printed_names_the_result(
    option: str, left: list[int], told: Run, monkeypatch: pytest.MonkeyPatch, defaults: None
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    monkeypatch.setattr(job, "print_beside_files", lambda data: signal.raise_signal(signal.SIGINT))
    _, err = told("solve", PULLEY, "-o", "a.h5", option, code=0)
    assert left == [130]
    assert err == (
        "frictionsim: interrupted by SIGINT while printing the summary; the result is in a.h5\n"
    )
    assert fs.open("a.h5").status == "done"


def test_a_signal_while_the_summary_of_a_sweep_is_printed_names_the_sweep(
    left: list[int], told: Run, monkeypatch: pytest.MonkeyPatch, defaults: None
) -> None:
    raised = functools.partial(signal.raise_signal, signal.SIGTERM)
    monkeypatch.setattr(study_commands, "print_beside_files", lambda data: raised())
    vary = "mechanism.load=lin(2000, 2200, 2)"
    _, err = told("sweep", PULLEY, "--vary", vary, "-j1", "-o", "s.h5", code=0)
    assert left == [143]
    assert err == (
        "frictionsim: interrupted by SIGTERM while printing the summary; the sweep is in s.h5\n"
    )


def test_a_signal_in_a_later_compilation_names_the_checkpoint(
    left: list[int], told: Run, monkeypatch: pytest.MonkeyPatch, defaults: None
) -> None:
    """A run compiles its kernels after some steps, when a checkpoint is on the disk."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)

    def compiling(self: RecordedSimulation, on_step: Any) -> float:
        if self._solver.started:
            with on_step.compiling(10.0):
                signal.raise_signal(signal.SIGINT)
                wait_for(lambda: left)
        return 0.0

    monkeypatch.setattr(RecordedSimulation, "prepare", compiling)
    monkeypatch.setattr(event_driven.EventDrivenSolver, "_pays", lambda self, *_: True)
    monkeypatch.setattr(event_driven, "PATIENCE", 20)
    _, err = told("solve", PULLEY, "-o", "a.h5", code=130)
    assert left == [130]
    assert "compiling the kernels" in err
    assert (
        "interrupted by SIGINT while compiling kernels; samples up to this time are in"
        " a.partial.h5; 'frictionsim resume a.partial.h5' continues the run\n"
    ) in err
    assert fs.open("a.partial.h5").status == "interrupted"


def test_an_unfinished_run_of_a_method_of_scipy_says_that_it_cannot_be_resumed(told: Run) -> None:
    law = "effects.shaft_friction.law=regularised"
    arguments = ["--backend", "dop853", "--set", law, "--max-steps", "50", "-q"]
    cannot = (
        "frictionsim: the run cannot be resumed: the backend dop853 is SciPy's and saves no state"
    )
    _, err = told("solve", PULLEY, "-o", "a.h5", *arguments, code=5)
    assert err.splitlines()[-1] == cannot
    _, err = told("show", "a.partial.h5", code=0)
    assert err.splitlines()[-1] == cannot
    # No more is told where the scenario in it is none.
    with h5py.File("a.partial.h5", "r+") as file:
        file.attrs["scenario"] = ""
    append_trailer(Path("a.partial.h5"))
    assert told("show", "a.partial.h5", code=0)[1] == err


def test_max_wall_counts_from_the_call(monkeypatch: pytest.MonkeyPatch) -> None:
    """In Python, too: what is read and assembled is a part of it."""
    load = solving.with_overrides

    def slow(*arguments: Any) -> Any:
        time.sleep(0.3)
        return load(*arguments)

    monkeypatch.setattr(solving, "with_overrides", slow)
    result = fs.solve(PULLEY, max_wall=0.25)
    assert (result.status, result.exit_code) == ("failed", 5)


def test_a_compilation_does_not_begin_after_the_limit() -> None:
    limited = Monitors(lambda t: None, WallTimeLimit(1e-9, 1.0, "raise it"))
    with (
        pytest.raises(BudgetExceeded, match="reached before kernels were compiled"),
        limited.compiling(20.0),
    ):
        pytest.fail("the compilation began")


def test_a_signal_during_a_fit_says_that_nothing_was_written(
    left: list[int], told: Run, monkeypatch: pytest.MonkeyPatch, defaults: None
) -> None:
    fit_with = fitting.fit_with

    def interrupted(*arguments: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return fit_with(*arguments)

    monkeypatch.setattr(fitting, "fit_with", interrupted)
    free = "effects.shaft_friction.mu_s=0.1:0.4"
    _, err = told("fit", PULLEY, "--quantity", "breakaway_time=0.6", "--free", free, code=0)
    assert left == [130]
    first = err.splitlines()[0]
    assert first == "frictionsim: interrupted by SIGINT while fitting; nothing was written"


@pytest.mark.parametrize("number", one_in(3, NUMBERS))
@pytest.mark.parametrize(
    ("command", "activity"),
    [
        ("plot a.h5", "drawing"),
        ("plot a.h5 --animate b.gif --fps 2", "drawing"),
        ("report a.h5", "writing the report"),
    ],
)
def test_a_signal_during_a_picture_or_report_is_told_and_leaves_no_part(
    command: str, activity: str, number: signal.Signals, told: Run, defaults: None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    signal.signal(number, signal.SIG_DFL)
    told("solve", PULLEY, "-o", "a.h5", "--set", "solver.duration=1.0", code=0)

    def interrupted(*_: Any) -> None:
        assert [*Path().glob(".*.part")]
        signal.raise_signal(number)

    monkeypatch.setattr(PartFile, "rename", interrupted)
    monkeypatch.setattr("os._exit", sys.exit)
    _, err = told(*command.split(), code=128 + number)
    assert err == (
        f"frictionsim: interrupted by {number.name} while {activity}; files already written are"
        " kept\n"
    )
    assert os.listdir() == ["a.h5"]
