"""Every error in the use of the command line is one sentence of ours: where, wanted, found, way."""

import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.main import get_command

from frictionsim.cli.app import app
from frictionsim.cli.usage import usage_message
from tests.cli.conftest import Run
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
COMMANDS = [
    "solve",
    "resume",
    "check",
    "static",
    "cost",
    "show",
    "compare",
    "plot",
    "new",
    "schema",
    "fit",
    "sweep",
    "report",
    "warm-up",
]
LONG = "a" * 300


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sovle"], "unknown command 'sovle' (did you mean 'solve'?); see frictionsim --help"),
        (["help"], f"unknown command 'help'; known: {', '.join(COMMANDS)}; see frictionsim --help"),
        (["solve"], "SCENARIO is missing; see frictionsim solve --help"),
        (["check"], "SCENARIO is missing; see frictionsim check --help"),
        (["show"], "RESULT is missing; see frictionsim show --help"),
        (["compare", "a.h5"], "GOLDEN is missing; see frictionsim compare --help"),
        (["show", "a.h5", "b.h5"], "unexpected argument 'b.h5'; see frictionsim show --help"),
        (
            ["schema", "pulley", "a.json"],
            "unexpected argument 'a.json'; see frictionsim schema --help",
        ),
        (
            ["solve", PULLEY, "--jsn"],
            "unknown option '--jsn' (did you mean '--json'?); see frictionsim solve --help",
        ),
        (
            ["show", PULLEY, "-x"],
            "unknown option '-x'; known: --json, --csv, --scenario, --study; see frictionsim show"
            " --help",
        ),
        (
            ["solve", PULLEY, "-qx"],
            "unknown option '-x'; known: --set, --output, --backend, --max-wall, --max-steps,"
            " --estimate-error, --no-clobber, --json, --quiet, --verbose; see frictionsim solve"
            " --help",
        ),
        (
            ["-v", "solve", PULLEY],
            "-v: expected after the command, as in 'frictionsim solve -v'; see frictionsim --help",
        ),
        (
            ["solve", PULLEY, "--debug"],
            "--debug: expected before the command: 'frictionsim --debug solve'; see frictionsim"
            " solve --help",
        ),
        (["solve", PULLEY, "--set"], "--set: expected a value; see frictionsim solve --help"),
        (["--debug", "solve", PULLEY, "-o"], "-o: expected a value; see frictionsim solve --help"),
        (
            ["solve", PULLEY, "--json=yes"],
            "--json: expected no value; see frictionsim solve --help",
        ),
        (
            ["solve", PULLEY, "--max-wall", "long"],
            "--max-wall: expected a number, got 'long'; see frictionsim solve --help",
        ),
        (["solve", PULLEY, "--max-wall", "0"], "--max-wall: expected a number above 0 s, got 0"),
        (["solve", PULLEY, "--max-wall=-1"], "--max-wall: expected a number above 0 s, got -1"),
        (
            ["solve", PULLEY, "--max-wall", "nan"],
            "--max-wall: expected a number above 0 s, got nan",
        ),
        (
            ["solve", PULLEY, "--max-steps", "1.5"],
            "--max-steps: expected a whole number, got '1.5'; see frictionsim solve --help",
        ),
        (
            ["solve", PULLEY, "--max-steps", "0"],
            "--max-steps: expected a whole number above 0, got 0",
        ),
        (
            ["plot", "a.h5", "--body", "three"],
            "--body: expected a whole number, got 'three'; see frictionsim plot --help",
        ),
        (
            ["cost", PULLEY, "--repeats", "0"],
            "--repeats: expected a number of at least 1, got '0'; see frictionsim cost --help",
        ),
        (
            ["compare", "a.h5", "b.h5", "--time-atol", "x"],
            "--time-atol: expected a number, got 'x'; see frictionsim compare --help",
        ),
        (
            ["solve", PULLEY, "--set", "mu_s 0.3"],
            "--set mu_s 0.3: expected KEY=VALUE, as in solver.rtol=1e-9",
        ),
        (
            ["solve", ""],
            "argument 2 is empty, as of a variable of the shell that is not set; expected a"
            " command, an option or a file",
        ),
        (["show", LONG], f"{LONG}: cannot read this result: there is no such file"),
        (["check", LONG], f"{LONG}: cannot read this scenario: File name too long"),
        (
            ["cost", PULLEY, "--tolerances", "a,b"],
            "--tolerances: expected numbers separated by commas, as 1e-3,1e-6, got 'a,b'",
        ),
        (
            ["cost", PULLEY, "--backends", "rkf4"],
            "--backends: unknown backend 'rkf4' (did you mean 'rkf45'?)",
        ),
    ],
)
def test_a_mistake_is_one_sentence(arguments: list[str], message: str, told: Run) -> None:
    assert told(*arguments, code=2) == ("", f"frictionsim: {message}\n")
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize(
    ("message", "wanted"),
    [
        ("'x' is not a valid float", "--rtol: expected a number, got 'x'"),
        ("'x' is not a valid integer.", "--rtol: expected a whole number, got 'x'"),
        (
            "-1.0 is not in the range x>=0.0",
            "--rtol: expected a number of at least 0.0, got '-1.0'",
        ),
        ("something else", "--rtol: something else"),
    ],
)
def test_judgements_of_other_versions_of_typer_are_worded_alike(message: str, wanted: str) -> None:
    """Those without pydantic have the messages of click."""

    class BadParameter(Exception):
        param = SimpleNamespace(param_type_name="option", opts=["--rtol"])
        ctx = SimpleNamespace(command_path="frictionsim compare")

        def format_message(self) -> str:
            return f"Invalid value for '--rtol': {self.message}"

        def __init__(self) -> None:
            self.message = message

    assert usage_message(BadParameter(), []) == f"{wanted}; see frictionsim compare --help"


def test_the_commands_are_all(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    # Whichever module was imported first.
    monkeypatch.setattr(app, "registered_commands", app.registered_commands[::-1])
    told("--version")  # which registers them
    assert list(get_command(app).commands) == COMMANDS  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["-h", "--help"])
def test_each_command_has_help(command: str, option: str, told: Run) -> None:
    out, err = told(command, option)
    assert out.startswith(f"Usage: frictionsim {command} [OPTIONS]")
    assert "-h, --help" in out
    assert err == ""


def test_the_program_has_help(told: Run) -> None:
    assert told("-h") == told("--help")
    assert all(f"\n  {command} " in told("-h")[0] for command in COMMANDS)


def test_without_a_command_the_help_is_an_error(told: Run) -> None:
    for arguments in ([], ["--debug"]):
        out, err = told(*arguments, code=2)
        assert (out, err.startswith("Usage: frictionsim")) == ("", True)


def test_colours_and_width_of_the_terminal_do_not_change_a_summary(
    told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    wide = told("static", PULLEY)[0]
    for name, value in (("COLUMNS", "20"), ("NO_COLOR", "1"), ("FORCE_COLOR", "1"), ("TERM", "")):
        monkeypatch.setenv(name, value)
        assert told("static", PULLEY)[0] == wide


def test_an_error_of_the_system_names_its_file(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", "some/file")

    monkeypatch.setattr("frictionsim.load", refuse)
    _, err = told("check", PULLEY, code=4)
    assert err == "frictionsim: some/file: Permission denied\n"


@pytest.mark.parametrize("stop", [KeyboardInterrupt, typer.Abort])
def test_an_interruption_has_its_exit_code(
    stop: type[BaseException], told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise stop

    monkeypatch.setattr("frictionsim.load", interrupt)
    assert told("check", PULLEY, code=128 + signal.SIGINT) == ("", "")


def test_a_check_of_many_survives_a_broken_pipe(here: Path) -> None:
    program = f"{sys.executable} -m frictionsim check {SCENARIOS}"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", f"{program} | true"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0
    assert all(line.startswith("frictionsim: warning: ") for line in done.stderr.splitlines())


@pytest.mark.parametrize(
    "arguments",
    [
        ["plot", "a.h5", "-o", "a.png", "--output", "b.png"],
        ["solve", PULLEY, "-o", "a.h5", "-o", "b.h5"],
        ["resume", "a.h5", "-o", "b.h5", "-o", "c.h5"],
        ["cost", PULLEY, "-o", "a.h5", "-o", "b.h5"],
        ["sweep", PULLEY, "-o", "a.h5", "-o", "b.h5"],
        ["fit", PULLEY, "-o", "a.toml", "-o", "b.toml"],
        ["report", "a.h5", "-o", "a.html", "-o", "b.html"],
    ],
)
def test_a_second_file_for_the_output_is_refused(arguments: list[str], told: Run) -> None:
    _, err = told(*arguments, code=2)
    assert err == "frictionsim: --output: expected once, got it 2 times; leave one out\n"


def test_options_of_one_value_are_given_once_and_others_often(told: Run, here: Path) -> None:
    _, err = told("plot", "a.h5", *("--dpi", "10") * 3, code=2)
    assert err == "frictionsim: --dpi: expected once, got it 3 times; leave one out\n"
    rest = ("--set", "solver.rtol=1e-5", "--set", "solver.duration=1", "--json", "--json")
    told("check", PULLEY, *rest)
