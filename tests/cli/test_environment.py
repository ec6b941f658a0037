"""The command line in unusual environments: broken streams, existing files, little memory."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from frictionsim.cli.commands import run_command_line
from frictionsim.io import hdf5_reader
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
RETURN = str(SCENARIOS / "pulley_return.toml")


def shell(command: str, cwd: Path, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Run a line of bash in which `frictionsim` calls this package."""
    program = f"{shlex.quote(sys.executable)} -m frictionsim"
    return subprocess.run(
        ["bash", "-c", command.replace("frictionsim", program)],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("name", ["scenario.toml", "force.csv", "notes"])
def test_a_file_that_is_not_a_result_is_never_replaced(
    name: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / name).write_text("precious")
    assert run_command_line(["solve", PULLEY, "-o", name]) == 4
    assert "the existing file is not a result and is not overwritten" in capsys.readouterr().err
    assert (here / name).read_text() == "precious"


def test_a_result_under_any_name_is_replaced(here: Path) -> None:
    for _ in range(2):
        assert run_command_line(["solve", PULLEY, "-o", "result", "-q"]) == 0


def test_a_file_name_that_is_too_long_is_reported(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["solve", PULLEY, "-o", "a" * 300 + ".h5"]) == 4
    assert "cannot write the result: File name too long" in capsys.readouterr().err


@pytest.mark.parametrize("command", [f"solve {PULLEY}", f"static {PULLEY}", f"check {PULLEY}"])
def test_a_closed_stdout_is_accepted(command: str, tmp_path: Path) -> None:
    done = shell(f"frictionsim {command} >&-", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_broken_pipe_is_accepted(tmp_path: Path) -> None:
    done = shell(f"set -o pipefail; frictionsim solve {PULLEY} | head -1", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert hdf5_reader.read(tmp_path / "results" / "pulley.h5").attributes["status"] == "done"


def test_letters_missing_in_the_terminal_encoding_are_replaced(tmp_path: Path) -> None:
    done = shell(
        f"frictionsim solve {PULLEY} --set 'title=\"Überlast θ\"'",
        tmp_path,
        PYTHONIOENCODING="ascii",
    )
    assert done.returncode == 0
    assert done.stdout.startswith("?berlast ?: done")


def test_a_failed_audit_is_marked_in_the_file(here: Path) -> None:
    """Fixed steps through the chattering of eq 30 lose energy."""
    force = "drive.force={time=[0,0.8,4,4.8],value=[1832.6,3113.75,3113.75,2224.1]}"
    law = ["--set", "effects.shaft_friction.law=published", "--backend", "rkf45"]
    arguments = [*law, "--set", "solver.step=1e-3", "--set", force]
    assert run_command_line(["solve", RETURN, "-q", "-o", "a.h5", *arguments]) == 3
    attributes = hdf5_reader.read(here / "a.h5").attributes
    assert attributes["status"] == "done"
    assert attributes["reason"].startswith("self-audit failed: energy")


def test_out_of_memory_is_not_an_internal_error(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("frictionsim.api.solving.run", run)
    assert run_command_line(["solve", PULLEY, "-o", "a.h5"]) == 1
    assert "out of memory; a larger output.interval" in capsys.readouterr().err
    assert not (here / "a.h5").exists()


@pytest.mark.parametrize(
    ("override", "warning"),
    [
        ("effects.shaft_friction.shaft_radius=0.06", "is not below cord_radius = 0.0508 m"),
        ("output.interval=9", "only its start and end are sampled"),
    ],
)
def test_check_warns_of_odd_scenarios(
    override: str, warning: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["check", PULLEY, "--set", override]) == 0
    assert warning in capsys.readouterr().err


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        ("energyinput", "unknown channel 'energyinput' (did you mean 'energy_input'?)"),
        ("*", "nothing is left to compare"),
    ],
)
def test_compare_refuses_patterns_that_leave_nothing(
    pattern: str, message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["solve", PULLEY, "-q", "-o", "a.h5"]) == 0
    assert run_command_line(["compare", "a.h5", "a.h5", "--ignore", pattern]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("title", ["$a_$", "bad $\\\\foo$ math", "日本語"])
def test_plot_draws_titles_verbatim(
    title: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["solve", PULLEY, "-q", "-o", "a.h5", "--set", f'title="{title}"']
    assert run_command_line(arguments) == 0
    assert run_command_line(["plot", "a.h5"]) == 0
    err = capsys.readouterr().err
    if title.isascii():
        assert err == ""
    elif err:  # on a machine whose fonts lack these characters
        assert err.startswith("frictionsim: warning: no font has 日 (U+65E5), ")
        assert err.count("\n") == 1


def test_a_toml_syntax_error_shows_its_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "bad.toml").write_text('kind = "pulley"\nload = 2224,1\n')
    assert run_command_line(["check", "bad.toml"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("frictionsim: bad.toml:2: not valid TOML: ")
    assert error.endswith("in 'load = 2224,1'\n")


def test_a_signal_given_as_text_lists_the_valid_forms(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["check", PULLEY, "--set", "drive.force=force"]) == 2
    assert '{csv = "file.csv"}' in capsys.readouterr().err


def test_absurdly_large_numbers_are_refused(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["check", PULLEY, "--set", "mechanism.load=1e308"]) == 2
    assert "mechanism.load: 1e+308 is too large" in capsys.readouterr().err


def test_a_run_with_a_non_finite_sample_fails(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The slope of the signal between two points overflows."""
    steep = "drive.force={time=[0, 5e-324], value=[1832.6, 3113.75]}"
    assert run_command_line(["solve", PULLEY, "-q", "-o", "a.h5", "--set", steep]) == 1
    assert "exceeds the range of double precision" in capsys.readouterr().err
    assert hdf5_reader.read(here / "a.h5").attributes["status"] == "failed"
