"""Compilation of kernels: announced, not counted as solving, ended by a signal at once."""

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.old_results import old_result
from tests.support.scenarios import ROOT, SCENARIOS, pulley, python, simulate

ANNOUNCED = "frictionsim: compiling the kernels for this combination of effects, once (about "
OLD = old_result()


def test_warm_up_names_combinations_and_compiles_nothing_twice(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of one scenario: all would take a minute."""
    only = {"belt_drive": SCENARIOS / "belt_drive.toml"}
    monkeypatch.setattr("frictionsim.api.scenarios.shipped_scenarios", lambda: only)
    first = fs.warm_up()
    combinations = [("belt_drive", "rkf45"), ("belt_drive", "moreau")]
    assert [(entry.scenario, entry.backend) for entry in first] == combinations
    assert [entry.seconds for entry in fs.warm_up("belt_drive")] == [0.0, 0.0]
    assert fs.run_command_line(["warm-up"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "belt_drive, rkf45: compiled already",
        "belt_drive, moreau: compiled already",
        "0.0 s of compilation",
    ]


# Runs that are the first of their process: cold, resumed, and with each form of a drive. Prints for
# each its seconds of compilation and of solving, by a clock that counts how often it is asked: no
# machine is too fast or too slow for it.
RUNS = """
import itertools
import sys
import time

asked = itertools.count()
time.perf_counter = lambda: 1e-3 * next(asked)
import frictionsim as fs

short = {"solver.duration": 4e-4, "output.interval": 1e-4, "solver.backend": sys.argv[1]}
forms = (
    {"torque": {"sine": {"amplitude": 5.0, "frequency_hz": 20.0}}},
    {"torque": {"speed": [-20.0, 20.0], "value": [5.0, -5.0]}},
    {"speed": {"time": [0.0, 0.02], "value": [0.0, -5.0]}},
)

def tell(run):
    print(run.statistics.compile_seconds, run.statistics.wall_seconds)

tell(fs.solve("belt_string", short))
fs.solve("belt_string", short, output="a.h5")
fs.solve("belt_string", short, output="b.h5", max_steps=2)
tell(fs.resume("b.partial.h5"))
for form in forms:
    tell(fs.solve("belt_string", {**short, "drive.driver": form}))
"""


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
def test_kernels_are_compiled_once_before_the_first_step(backend: str, tmp_path: Path) -> None:
    """For all forms of signals, in the user's own folder, and no bit depends on it."""
    folders = {
        "XDG_CACHE_HOME": str(tmp_path / "own"),
        "NUMBA_CACHE_DIR": str(tmp_path / "planted"),
    }
    done = python("-c", RUNS, backend, cwd=tmp_path, **folders)
    assert done.returncode == 0, done.stderr
    lines = [tuple(map(float, line.split())) for line in done.stdout.splitlines()]
    compiling, solving = zip(*lines, strict=True)
    assert compiling[0] > 0.0
    assert compiling[1:] == (0.0,) * 4
    # The clock is asked as solving begins and as it ends, and compilation is in no such interval.
    assert solving[0] == pytest.approx(1e-3)
    assert solving[2:] == pytest.approx(solving[:1] * 3)
    assert (tmp_path / "b.h5").read_bytes() == (tmp_path / "a.h5").read_bytes()
    assert list((tmp_path / "own" / "frictionsim").glob("kernels-*/*/*.nbi"))
    assert not (tmp_path / "planted").exists()
    again = python("-c", RUNS, backend, cwd=tmp_path, **folders)
    assert {line.split()[0] for line in again.stdout.splitlines()} == {"0.0"}


def test_the_table_has_the_seconds_of_compilation_where_there_was_one() -> None:
    done = simulate(pulley())
    statistics = done.statistics._replace(wall_seconds=2.1)
    assert "solved in 2.1 s: " in fs.Result(done._replace(statistics=statistics)).summary()
    compiled = statistics._replace(compile_seconds=24.0)
    text = fs.Result(done._replace(statistics=compiled)).summary()
    assert "solved in 2.1 s after 24 s of compilation: " in text


@pytest.mark.parametrize(
    ("number", "option"),
    [(signal.SIGINT, "-o"), pytest.param(signal.SIGTERM, "--json -o", marks=pytest.mark.slow)],
)
def test_a_signal_ends_a_compilation_at_once(
    number: signal.Signals, option: str, tmp_path: Path
) -> None:
    """By its default action: the compiler is in one call for seconds, in which no handler runs."""
    (tmp_path / "a.h5").write_bytes(OLD)
    cache = tmp_path / "cache"
    scenario = SCENARIOS / "belt_verification.toml"
    command = [sys.executable, "-m", "frictionsim", "solve", str(scenario), *shlex.split(option)]
    process = subprocess.Popen(
        [*command, "a.h5"],
        cwd=tmp_path,
        env={**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(ANNOUNCED)
        time.sleep(1.0)  # of the ten seconds and more that the kernels take
        process.send_signal(number)
        out, said = process.communicate()
    assert (process.returncode, out, said) == (-number, "", "")
    assert (tmp_path / "a.h5").read_bytes() == OLD
    assert sorted(os.listdir(tmp_path)) == ["a.h5", "cache"]
    # Had it been waited for, the kernels would be on the disk.
    assert not list(cache.rglob("*advance*"))
