"""Signals before, in and after the steps of a run.

The signals are real ones: sent by this process, or by a program to itself at a place in its work.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, long_run, strict_json
from tests.support.cases import one_in, slow
from tests.support.scenarios import SCENARIOS, python

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs signals of POSIX")

PULLEY, RETURN = str(SCENARIOS / "pulley.toml"), str(SCENARIOS / "pulley_return.toml")
LOAD = 2224.1  # N, of the shipped pulley
NUMBERS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
# It is written, and about to have its name: the first checkpoint of a run, and a result.
CHECKPOINT, WHOLE = "os.rename /a.partial.h5 1", "os.rename /pulley.h5 1"
# Runs the command line, and acts once: when Python opens or renames a file, or imports.
ACTING = """
import os, runpy, signal, sys, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which `nohup` has ignored
for number in {ignored}:
    signal.signal(number, signal.SIG_IGN)
seen = []
def act(event, arguments):
    place = arguments[event == "os.rename"] if event == {event!r} else ""
    if place and os.fsdecode(str(place)).endswith({ending!r}):
        seen.append(event)
        if len(seen) == {occurrence}:
            {action}
sys.addaudithook(act)
sys.argv = ["frictionsim", *{arguments}]
runpy.run_module("frictionsim", run_name="__main__", alter_sys=True)
"""


def acting(
    action: str, place: str, arguments: list[str], folder: Path, ignored: Sequence[int] = ()
) -> "subprocess.CompletedProcess[str]":  # fmt: skip
    """Run the command line in a process that acts at a place: the event, of what, which one."""
    event, ending, occurrence = place.split()
    program = ACTING.format(
        event=event, ending=ending, occurrence=occurrence, action=action, arguments=arguments,
        ignored=[int(number) for number in ignored],
    )  # fmt: skip
    return python("-c", program, cwd=folder)


def sent(number: int, times: int = 1, pause: float = 0.0) -> str:
    """Return the action that sends a signal to the process itself."""
    return f"[(os.kill(os.getpid(), {int(number)}), time.sleep({pause})) for _ in range({times})]"


# --- before the first step ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "place"),
    [
        (signal.SIGINT, "open pulley.toml 1"),
        slow(signal.SIGTERM, "import numpy 1"),
        slow(signal.SIGHUP, "import numpy 1"),
    ],
)
def test_before_the_first_step_a_signal_has_its_default_action(
    number: signal.Signals, place: str, tmp_path: Path
) -> None:
    """It ends C code as well, such as the assembly of a belt; shells see 130, 143 and 129."""
    done = acting(sent(number), place, ["solve", PULLEY, "-o", "a.h5"], tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (-number, "", "")
    assert os.listdir(tmp_path) == []


# --- in a run -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "times", "after"),
    [(signal.SIGINT, 1, [RETURN]), (signal.SIGTERM, 3, []), slow(signal.SIGHUP, 1, [])],
)
def test_a_signal_keeps_the_samples_and_sets_the_exit_code(
    number: signal.Signals, times: int, after: list[str], here: Path, told: Run
) -> None:
    """Also if a signal is delivered several times, as by `timeout` and shells.

    A scenario after this one is not begun.
    """
    with long_run(here, *after) as process:
        for _ in range(times):
            process.send_signal(number)
            time.sleep(0.002)  # otherwise the system merges them
        out, errors = process.communicate()
    assert process.returncode == 128 + number
    assert f"frictionsim: run interrupted: by {number.name} at t = " in errors
    left = "frictionsim: not solved: 1 of the scenarios, after this one\n"
    assert (left in errors) == bool(after)
    assert "pulley_return" not in out + errors
    assert "Traceback" not in errors
    kept = fs.open("results/long.partial.h5")
    assert (kept.status, kept.exit_code) == ("interrupted", 128 + number)
    t = kept.dataset["time"].values
    assert t.size > 1
    np.testing.assert_array_equal(t, 0.001 * np.arange(t.size))
    # Constant torques: a = ((P - W) r_e - r_k (P + W))/I. The steps are exact but for rounding.
    force, friction_radius = 3000.0, 0.0254 * 0.1 / np.hypot(1.0, 0.1)
    acceleration = ((force - LOAD) * 0.0508 - friction_radius * (force + LOAD)) / 1.355
    np.testing.assert_allclose(kept.dataset["angle"], 0.5 * acceleration * t**2, rtol=1e-9)
    told("resume", "results/long.h5", "-q", "--max-steps", "500", code=5)
    further = fs.open("results/long.h5").dataset["time"].values
    assert further.size > t.size


# The first is due after the first step, and long before the end of the run.
CHECKPOINTS = ["--set", "output.checkpoint=1e-9"]


def test_what_keeps_nothing_says_so(tmp_path: Path) -> None:
    """Of fits and animations, and of costs before the first run; here of a fit."""
    program = (
        "import os, signal, sys, frictionsim, frictionsim.__main__ as program\n"
        "def fit(*_, progress, **options):\n"
        "    progress(1)\n"
        "    try:\n"
        f"        {sent(signal.SIGINT, 2)}\n"  # as by `timeout` and shells
        "    finally:\n"
        "        raise OSError('ffmpeg has ended')\n"
        "frictionsim.fit = fit\n"
        f"sys.argv = ['frictionsim', 'fit', {PULLEY!r}]\n"
        "program.main()"
    )
    done = python("-c", program, cwd=tmp_path)
    said = "frictionsim: interrupted by SIGINT; no file was written\n"
    assert (done.returncode, done.stdout, done.stderr) == (130, "", said)


def test_a_second_signal_exits_at_once(tmp_path: Path) -> None:
    """Where the first is not heard for a while, as on a slow disk."""
    arguments = ["solve", PULLEY, "-o", "a.h5", *CHECKPOINTS]
    done = acting(sent(signal.SIGINT, times=2, pause=0.3), CHECKPOINT, arguments, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("number", one_in(3, NUMBERS))
def test_a_signal_that_the_process_ignores_stays_ignored(
    number: signal.Signals, tmp_path: Path
) -> None:
    arguments = ["solve", PULLEY, "-o", "a.h5", "-q", *CHECKPOINTS]
    done = acting(sent(number), CHECKPOINT, arguments, tmp_path, [number])
    assert (done.returncode, done.stderr) == (0, "")
    assert fs.open(tmp_path / "a.h5").status == "done"


# --- when there is something to keep --------------------------------------------------------


def test_a_signal_while_a_result_is_written_keeps_it_and_stops_the_others(tmp_path: Path) -> None:
    arguments = ["solve", PULLEY, RETURN, "--json"]
    done = acting(sent(signal.SIGTERM), WHOLE, arguments, tmp_path)
    assert done.returncode == 143
    assert [item["status"] for item in strict_json(done.stdout)] == ["done"]
    assert done.stderr == "frictionsim: not solved: 1 of the scenarios, after this one\n"
    assert os.listdir(tmp_path / "results") == ["pulley.h5"]


@pytest.mark.parametrize(
    ("command", "written"), [("plot a.h5", "a.png"), slow("report a.h5", "a.html")]
)
def test_a_signal_during_a_picture_or_report_has_its_default_action(
    command: str, written: str, here: Path
) -> None:
    """A part is left, which the next write of the name removes."""
    fs.solve(PULLEY, {"solver.duration": 1.0}, output="a.h5")
    done = acting(sent(signal.SIGTERM), f"os.rename /{written} 1", command.split(), here)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGTERM, "", "")
    assert [".part" in name for name in sorted(os.listdir())] == [True, False]
    assert fs.run_command_line(command.split()) == 0
    assert sorted(os.listdir()) == ["a.h5", written]
