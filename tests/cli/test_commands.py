"""The commands: exit codes, stdout and stderr, files, signals, imports."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import h5py
import numpy as np
import pytest
import tomli_w

from frictionsim import __version__, errors
from frictionsim.api.progress import ProgressBar
from frictionsim.cli import commands, monitor
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import OutputError
from frictionsim.io import hdf5_reader
from frictionsim.io.atomic_write import check_place
from frictionsim.results import Check, Quantity, quantities_json
from tests.support.scenarios import ROOT, SCENARIOS, pulley

PULLEY = str(SCENARIOS / "pulley.toml")
LOAD = 2224.1  # N, of the shipped pulley
CHATTERING = [
    *["--set", "effects.shaft_friction.law=published", "--backend", "rkf45"],
    *["--set", "solver.duration=12"],
    *["--set", f"drive.force={{sine={{mean={LOAD}, amplitude=500, frequency_hz=0.2}}}}"],
]
FOLDER = ".: cannot read this result: this is a folder; give the name of a result file"
Cli = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def old(here: Path) -> Path:
    """An existing file at the output path, which must be kept."""
    path = here / "old.h5"
    path.write_bytes(b"the result of yesterday")
    return path


def json_of(capsys: pytest.CaptureFixture[str]) -> Any:
    """Return the JSON object on stdout; refuse NaN and Infinity."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(capsys.readouterr().out, parse_constant=refuse)


def test_help_and_version_print_to_stdout(cli: Cli) -> None:
    for arguments, answer in [(["--help"], "Usage: frictionsim"), (["--version"], __version__)]:
        done = cli(*arguments)
        assert done.returncode == 0
        assert answer in done.stdout
        assert done.stderr == ""


def test_help_lists_every_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    codes = {name: code for name, code in vars(errors).items() if name.startswith("EXIT_")}
    for name in ("EXIT_DEFECT", "EXIT_SIGNAL"):  # not listed as such
        del codes[name]
    assert sorted(set(codes.values())) == [0, 1, 2, 3, 4, 5]
    assert all(re.search(rf"\b{code} [a-z]", told) for code in codes.values())
    assert "5 step or time limit reached, 129/130/143 interrupted" in told


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Usage: frictionsim"),
        (["simulate"], "unknown command 'simulate'"),
        (["solve"], "SCENARIO is missing"),
        (["solve", PULLEY, "--speed"], "unknown option '--speed'"),
        (["solve", PULLEY, "--set"], "--set: expected a value"),
        (["solve", PULLEY, "another.toml"], "another.toml"),
        (["solve", PULLEY, "--backend", "rkf4"], "unknown backend 'rkf4' (did you mean 'rkf45'?)"),
        (["compare", PULLEY, PULLEY], "this is a scenario; 'frictionsim solve"),
        (
            ["compare", PULLEY, PULLEY, "--rtol", "-1"],
            "--rtol: expected a number of at least 0.0, got '-1'",
        ),
        (
            ["compare", PULLEY, PULLEY, "--rtol", "nan"],
            "--rtol: expected a number of at least 0.0, got 'nan'",
        ),
        (["compare", "none.h5", "none.h5"], "there is no such file"),
        (["compare", ".", "none.h5"], FOLDER),
        (["plot", "."], FOLDER),
        (["resume", "."], FOLDER),
    ],
)
def test_bad_usage_exits_2_with_a_message_on_stderr(
    arguments: list[str], message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message.casefold() in captured.err.casefold()
    assert list(here.iterdir()) == []


def test_invalid_scenario_exits_2_without_traceback(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('kind = "pulley"\nmechanism.load = -1\n')
    done = cli("solve", "s.toml")
    assert (done.returncode, done.stdout) == (2, "")
    assert "frictionsim: s.toml:1: drive: missing" in done.stderr
    assert "\ns.toml:2: mechanism.load: expected a number of at least 0 N, got -1" in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


NAME_OF_HDF5 = "names of HDF5 end in .h5, .hdf5 or .nc"
LOOSE = ["--set", "solver.rtol=1e-4", "-q"]


@pytest.mark.parametrize(
    "command",
    [
        ["solve", PULLEY, *LOOSE],
        ["sweep", PULLEY, "--vary", "mechanism.load=[2000.0, 2100.0]", *LOOSE],
        ["cost", PULLEY, "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"],
        ["resume", "incomplete.h5", "-q"],
    ],
    ids=lambda command: command[0],
)
@pytest.mark.parametrize(
    ("name", "is_told"),
    [("x.txt", True), ("x", True), ("x.h5.bak", True), ("x.h5", False), ("x.HDF5", False)],
)
def test_a_file_with_another_name_is_said_to_be_hdf5(
    command: list[str], name: str, is_told: bool, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if command[0] == "resume":
        run_command_line(["solve", PULLEY, *LOOSE, "--max-steps", "9", "-o", "incomplete.h5"])
        capsys.readouterr()
    assert run_command_line([*command, "-o", name]) == 0
    told = f"frictionsim: warning: {name}: the file is HDF5 whatever its name; {NAME_OF_HDF5}\n"
    assert capsys.readouterr().err == (told if is_told else "")
    assert h5py.is_hdf5(here / name)


def test_a_folder_for_several_results_is_no_name_of_hdf5(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "out").mkdir()
    other = str(SCENARIOS / "pulley_return.toml")
    assert run_command_line(["solve", PULLEY, other, "-q", "-o", "out"]) == 0
    assert capsys.readouterr().err == ""


def test_solve_prints_quantities_and_names_the_file_after_the_scenario(
    cli: Cli, tmp_path: Path
) -> None:
    done = cli("solve", PULLEY)
    assert (done.returncode, done.stderr) == (0, "")
    for quantity in ["force_to_lift", "2707.70308", "breakaway_time", "0.546448475", "slip +"]:
        assert quantity in done.stdout
    assert "result: results/pulley.h5" in done.stdout
    assert hdf5_reader.read(tmp_path / "results" / "pulley.h5").attributes["status"] == "done"


def test_solve_writes_only_the_named_output(here: Path) -> None:
    (here / "down").mkdir()
    assert run_command_line(["solve", PULLEY, "-o", "down/a.h5", "--quiet"]) == 0
    assert sorted(str(path.relative_to(here)) for path in here.rglob("*")) == ["down", "down/a.h5"]


def test_quiet_prints_nothing(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["solve", PULLEY, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_json_is_one_object_with_the_documented_keys(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["solve", PULLEY, "--json", "-o", "a.h5"]) == 0
    found = json_of(capsys)
    documented = {"scenario", "kind", "law", "backend", "status", "quantities", "solver", "effects"}
    assert found.keys() == documented | {
        "overrides",
        "audit",
        "output",
        "reason",
        "failure",
        "events",
        "warnings",
    }
    assert [
        found[key] for key in ("scenario", "kind", "backend", "status", "reason", "output")
    ] == [*[PULLEY, "pulley", "events", "done", "", "a.h5"]]
    assert {"force_to_lift", "force_to_hold", "breakaway_time", "final_angle"} <= set(
        found["quantities"]
    )
    for quantity in found["quantities"].values():
        assert quantity.keys() == {"value", "unit"}
        assert quantity["value"] is None or isinstance(quantity["value"], float)
    statistics = found["solver"]
    assert statistics.keys() == {
        *("steps", "rejected", "rhs_evaluations", "states"),
        *("wall_seconds", "compile_seconds"),
    }
    seconds = {"wall_seconds", "compile_seconds"}
    assert all(isinstance(statistics[key], int) for key in statistics.keys() - seconds)
    assert statistics["wall_seconds"] > 0.0
    assert statistics["compile_seconds"] == 0.0
    assert found["effects"] == ["shaft_friction", "viscous_damping"]
    assert found["audit"].keys() == {
        "energy_balance",
        "friction_law",
        "dissipation_sign",
        "stick_drift",
        "release",
    }
    for check in found["audit"].values():
        assert check["ok"] is True
        assert 0.0 <= check["value"] <= check["limit"]
    (event,) = found["events"]
    assert (event["contact"], event["mode_from"], event["mode_to"]) == ("shaft", 0, 1)
    assert event["time"] == found["quantities"]["breakaway_time"]["value"]


def test_breakaway_time_is_null_if_nothing_moves(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = ["--set", f"drive.force={LOAD}"]
    assert run_command_line(["solve", PULLEY, "--json", *still]) == 0
    found = json_of(capsys)
    assert found["quantities"]["breakaway_time"] == {"value": None, "unit": "s"}
    assert found["quantities"]["final_angle"]["value"] == 0.0
    assert found["events"] == []
    assert run_command_line(["solve", PULLEY, *still]) == 0
    assert "breakaway_time" in capsys.readouterr().out


def test_check_validates_all_files_and_writes_none(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.toml").write_text('kind = "puley"\n')
    assert run_command_line(["check", PULLEY, "bad.toml", "none.toml", PULLEY]) == 2
    captured = capsys.readouterr()
    assert (
        captured.out
        == f"{PULLEY}: ok; effects shaft_friction, viscous_damping; backend events\n" * 2
    )
    assert captured.err.splitlines() == [
        "frictionsim: bad.toml:1: kind: unknown kind 'puley' (did you mean 'pulley'?)",
        "frictionsim: none.toml: cannot read this scenario: No such file or directory",
    ]
    assert run_command_line(["check", PULLEY, PULLEY]) == 0
    assert os.listdir() == ["bad.toml"]


def test_warnings_agree_in_json_result_file_and_stderr(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Warnings of the scenario come first; resumed and quiet runs have them too."""
    data = pulley(output={"interval": 9.0, "channels": ["angle", "energy_friction"]})
    del data["effects"]["shaft_friction"]
    Path("s.toml").write_text(tomli_w.dumps(data))
    warnings = [
        "output.interval = 9.0 s is longer than the run: only its start and end are sampled",
        "output.channels: this scenario has no channel 'energy_friction'; it is left out",
    ]
    stderr = [f"frictionsim: warning: {warning}" for warning in warnings]

    def check(*arguments: str, code: int = 0) -> None:
        assert run_command_line([*arguments, "--json"]) == code
        captured = capsys.readouterr()
        assert json.loads(captured.out)["warnings"] == warnings
        assert captured.err.splitlines()[:2] == stderr
        assert hdf5_reader.read(Path("a.h5")).attributes["warnings"].splitlines() == warnings

    check("solve", "s.toml", "-o", "a.h5")
    Path("a.h5").unlink()
    check("solve", "s.toml", "-o", "a.h5", "--max-wall", "1e-9", code=5)
    check("resume", "a.h5")
    assert run_command_line(["solve", "s.toml", "-o", "a.h5", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "\n".join([*stderr, ""]))


def test_check_names_the_file_of_each_warning(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = pulley(output={"interval": 9.0})
    for name in ("a.toml", "b.toml"):
        Path(name).write_text(tomli_w.dumps(odd))
    assert run_command_line(["check", "a.toml", PULLEY, "b.toml"]) == 0
    warning = "output.interval = 9.0 s is longer than the run: only its start and end are sampled"
    assert capsys.readouterr().err.splitlines() == [
        f"frictionsim: warning: {name}: {warning}" for name in ("a.toml", "b.toml")
    ]


class Bar:
    """A progress bar that records its updates."""

    shown: ClassVar[list[tuple[float, float | None]]] = []

    def __init__(self, duration: float) -> None:
        self.shown.clear()

    def show(self, t: float, pace: float | None) -> None:
        self.shown.append((t, pace))

    def close(self) -> None:
        pass


@pytest.mark.parametrize("begin", [0.0, 6.0])
def test_pace_excludes_compilation_and_earlier_parts(
    begin: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither the simulated time before a resume nor compilation counts for the pace."""
    clock = 100.0
    monkeypatch.setattr(monitor, "monotonic", lambda: clock)
    monkeypatch.setattr(monitor, "STEPS_BETWEEN_UPDATES", 1)
    monkeypatch.setattr("frictionsim.api.progress.ProgressBar", Bar)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with monitor.monitor_run(10.0, with_progress=True) as on_step:
        clock += 30.0  # to compile
        on_step(begin)
        for step in range(1, 4):
            clock += 5.0
            on_step(begin + step)
        on_step(0.0)  # a second run, to estimate the error of the first
        clock += 7.0
        on_step(0.5)
    assert Bar.shown == [
        *[(begin, None), (begin + 1.0, 5.0), (begin + 2.0, 5.0), (begin + 3.0, 5.0)],
        *[(0.0, None), (0.5, 14.0)],
    ]


def test_progress_bar_shows_the_remaining_time(capsys: pytest.CaptureFixture[str]) -> None:
    bar = ProgressBar(10.0)
    bar.show(6.5, 4.0)
    bar.close()
    text = str(bar._progress.tasks[0].fields["pace"])
    assert text == ", 4 s per simulated second, 14 s left"


def test_static_prints_forces_and_writes_nothing(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["static", PULLEY, "--json"]) == 0
    found = json_of(capsys)
    assert found.keys() == {"scenario", "overrides", "kind", "quantities", "notes"}
    assert found["notes"] == []
    assert found["quantities"]["force_to_lift"]["unit"] == "N"
    # Eq 24 by hand: 2224.1 (0.0508 + r)/(0.0508 - r) with r = 0.0254 0.2/sqrt(1.04), 7 digits.
    assert found["quantities"]["force_to_lift"]["value"] == pytest.approx(2707.703, rel=1e-7)
    assert run_command_line(["static", PULLEY]) == 0
    table = capsys.readouterr().out
    assert all(name in table for name in found["quantities"])
    assert os.listdir() == []


def test_non_finite_quantities_are_null_in_json() -> None:
    quantities = {
        "a": Quantity(float("inf"), "N"),
        "b": Quantity(None, "s"),
        "c": Quantity(1.5, "m"),
    }
    assert quantities_json(quantities) == {
        "a": {"value": None, "unit": "N"},
        "b": {"value": None, "unit": "s"},
        "c": {"value": 1.5, "unit": "m"},
    }


def assert_not_written(target: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["solve", PULLEY, "-o", target]) == 4
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"frictionsim: {target}: cannot write the result: ")


@pytest.mark.parametrize("target", ["none/a.h5", "old.h5/a.h5", ".", "pipe"])
def test_solve_refuses_an_impossible_output_path(
    target: str, old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo("pipe")
    assert_not_written(target, capsys)
    assert sorted(os.listdir()) == ["old.h5", "pipe"]
    assert old.read_bytes() == b"the result of yesterday"
    assert Path("pipe").is_fifo()


@pytest.mark.parametrize("device", ["/dev/null", "/dev/full"])
def test_solve_refuses_a_device_as_output(device: str) -> None:
    # Test the check only: if it failed, a run by root would replace the device.
    if not Path(device).exists():
        pytest.skip(f"no {device} on this system")
    with pytest.raises(OutputError, match="this is a device; give a file name") as refused:
        check_place(Path(device))
    assert refused.value.exit_code == 4


@pytest.mark.parametrize("protected", [".", "old.h5"])
def test_solve_refuses_an_output_without_write_permission(
    protected: str, old: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def owner_may(path: Any, mode: int, **options: Any) -> bool:
        """Check the permission as for an ordinary user, even if root runs the tests."""
        return mode != os.W_OK or bool(os.stat(path).st_mode & 0o200)

    monkeypatch.setattr(os, "access", owner_may)
    mode = os.stat(protected).st_mode
    os.chmod(protected, mode & ~0o222)
    try:
        assert_not_written("old.h5", capsys)
    finally:
        os.chmod(protected, mode)
    assert old.read_bytes() == b"the result of yesterday"
    assert os.listdir() == ["old.h5"]


def test_a_file_named_results_blocks_the_default_output(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("results").touch()
    assert run_command_line(["solve", PULLEY]) == 4
    assert "give a result file with -o" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "reason", "code"),
    [
        (CHATTERING, "chattering at t = ", 1),
        (["--set", "solver.max_steps=10"], "limit of 10 steps reached", 5),
    ],
)
def test_a_solver_failure_has_its_exit_code_and_keeps_the_samples(
    options: list[str], reason: str, code: int, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["solve", PULLEY, *options, "-o", "a.h5", "--json"]) == code
    captured = capsys.readouterr()
    assert captured.err.startswith(f"frictionsim: run failed: {reason}")
    assert "samples up to this time are in a.h5, status 'failed'" in captured.err
    summary = json.loads(captured.out)
    assert (summary["status"], summary["reason"][: len(reason)]) == ("failed", reason)
    kept = hdf5_reader.read(Path("a.h5"))
    assert (kept.attributes["status"], kept.attributes["reason"]) == ("failed", summary["reason"])
    assert kept.channels["time"].size > 1
    assert all(np.isfinite(channel).all() for channel in kept.channels.values())


def test_a_failed_audit_exits_3_and_names_the_check(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = {"energy_balance": Check(0.5, 1e-7)}
    monkeypatch.setattr("frictionsim.simulation.single_dof.audit", lambda *run: failing)
    assert run_command_line(["solve", PULLEY, "-o", "a.h5", "--json"]) == 3
    captured = capsys.readouterr()
    assert "self-audit failed: energy_balance 0.5 above 1e-07; do not trust a.h5" in captured.err
    assert json.loads(captured.out)["audit"]["energy_balance"]["ok"] is False


def wait_for_run(process: "subprocess.Popen[str]") -> None:
    """Wait until a process logs that the run starts, and 0.6 s more."""
    assert process.stderr is not None
    assert any("the run starts" in line for line in process.stderr)
    time.sleep(0.6)  # to have more samples than the first


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("times", [1, 3])
def test_a_signal_keeps_the_samples_and_sets_the_exit_code(
    number: signal.Signals, times: int, tmp_path: Path
) -> None:
    """Also if a signal is delivered several times, as by `timeout` and shells."""
    force = 3000.0
    scenario = pulley(
        drive__force=force,
        effects__viscous_damping=None,
        solver={"backend": "rkf45", "duration": 1000.0, "max_step": 1e-5},
        output__interval=0.001,
    )
    (tmp_path / "long.toml").write_text(tomli_w.dumps(scenario))
    command = [sys.executable, "-m", "frictionsim", "solve", "long.toml", "-o", "a.h5", "-v"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=tmp_path, text=True, **pipes) as process:
        wait_for_run(process)
        for _ in range(times):
            process.send_signal(number)
            time.sleep(0.002)  # otherwise the system merges them
        _, errors = process.communicate()
    assert process.returncode == 128 + number
    assert "frictionsim: run interrupted: by SIG" in errors
    assert "Traceback" not in errors
    kept = hdf5_reader.read(tmp_path / "a.h5")
    assert kept.attributes["status"] == "interrupted"
    t = kept.channels["time"]
    np.testing.assert_array_equal(t, 0.001 * np.arange(t.size))
    # Constant torques: a = ((P - W) r_e - r_k (P + W))/I. The steps are exact but for rounding.
    friction_radius = 0.0254 * 0.1 / np.hypot(1.0, 0.1)
    acceleration = ((force - LOAD) * 0.0508 - friction_radius * (force + LOAD)) / 1.355
    np.testing.assert_allclose(kept.channels["angle"], 0.5 * acceleration * t**2, rtol=1e-9)


def test_a_second_signal_exits_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    left: list[int] = []
    monkeypatch.setattr("os._exit", left.append)
    monkeypatch.setattr(monitor, "SECONDS_FOR_ONE_SIGNAL", 0.01)
    with monitor.monitor_run(1.0, with_progress=False) as on_step:
        on_step(0.0)  # before it, one signal ends the process
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.02)
        signal.raise_signal(signal.SIGINT)
    assert left == [130]


HEAVY = {"numpy", "h5py", "scipy", "numba", "matplotlib", "xarray", "pandas", "h5netcdf"}


def loaded_by(program: str, cwd: Path) -> set[str]:
    """Return the modules that a program in Python loads."""
    command = [sys.executable, "-c", f"import sys\n{program}\nprint(*sys.modules, file=sys.stderr)"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=True
    )
    return set(done.stderr.split())


def test_the_package_imports_nothing_heavy(tmp_path: Path) -> None:
    loaded = loaded_by("import frictionsim", tmp_path)
    assert "frictionsim" in loaded
    assert not {*HEAVY, "pydantic", "typer", "rich"} & loaded


@pytest.mark.parametrize(
    ("arguments", "unwanted"),
    [
        (["--help"], {*HEAVY, "rich", "logging", "json"}),
        (["check", PULLEY], {*HEAVY, "rich", "logging"}),
        (["solve", PULLEY], HEAVY - {"numpy", "h5py"}),
    ],
)
def test_a_command_imports_no_more_than_it_needs(
    arguments: list[str], unwanted: set[str], tmp_path: Path
) -> None:
    program = (
        "from frictionsim.cli.commands import run_command_line\n"
        f"assert run_command_line({arguments!r}) == 0"
    )
    loaded = loaded_by(program, tmp_path)
    assert "frictionsim.cli.commands" in loaded
    assert not unwanted & loaded


def test_check_needs_no_arrays_for_any_mechanism_of_few_coordinates(tmp_path: Path) -> None:
    names = ["epicyclic", "lift", "marble_machine", "pulley", "shaft", "swing_door"]
    program = (
        "from frictionsim.cli.commands import run_command_line\n"
        f"for name in {names}:\n"
        f"    scenario = {str(SCENARIOS)!r} + '/' + name + '.toml'\n"
        "    assert run_command_line(['check', scenario]) == 0\n"
        "    assert 'numpy' not in sys.modules, name"
    )
    loaded = loaded_by(program, tmp_path)
    assert "frictionsim.mechanisms.shaft.stops" in loaded
    assert not {*HEAVY, "rich", "logging"} & loaded


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["--help"], 4), (["check", PULLEY], 4), (["solve", PULLEY, "-o", "a.h5"], 0)],
)
def test_a_full_stdout_matters_to_those_who_only_print(
    arguments: list[str], code: int, tmp_path: Path
) -> None:
    command = [sys.executable, "-m", "frictionsim", *arguments]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            command, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    warning = "" if code else "warning: "
    told = f"frictionsim: {warning}cannot print the output: No space left on device"
    assert done.stderr.startswith(told)
    assert done.returncode == code
    assert (tmp_path / "a.h5").exists() == (code == 0)


def test_commands_that_start_faster_are_those_of_their_module() -> None:
    names = {command.callback.__name__ for command in commands.app.registered_commands}
    here = {name for name in names if hasattr(commands, name)}
    assert set(commands.OF_THIS_MODULE) == here
