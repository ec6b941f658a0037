"""Closed, full and broken streams, and what foreign text may do to a terminal."""

import io
import os
import shlex
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import h5py
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.cases import one_in, slow
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
ODD = ["--set", "output.interval=9"]  # which is warned of
needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")


def shell(command: str, cwd: Path, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Run a line of bash in which `frictionsim` calls this package; $PULLEY is its scenario."""
    program = f'frictionsim() {{ {shlex.quote(sys.executable)} -m frictionsim "$@"; }}'
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", f"{program}; {command}"],
        cwd=cwd,
        env={**os.environ, "PULLEY": PULLEY, "SCENARIOS": str(SCENARIOS), **environment},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
        check=False,
    )


def test_a_closed_stdout_and_a_reader_that_leaves_are_accepted(tmp_path: Path) -> None:
    for command in ('solve "$PULLEY" -o a.h5 >&-', 'solve "$PULLEY" -o b.h5 | head -1'):
        done = shell(f"frictionsim {command}", tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
    assert fs.open(tmp_path / "b.h5").status == "done"


@pytest.mark.parametrize(
    ("option", "end"), [("", "| true"), slow("--csv", "| head -1"), slow("--json", ">&-")]
)
def test_a_result_may_be_shown_to_nobody(option: str, end: str, told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5", "--set", "output.interval=1e-3")
    done = shell(f"frictionsim show a.h5 {option} {end}", Path())
    assert (done.returncode, done.stderr) == (0, "")


def test_letters_missing_in_the_terminal_encoding_are_replaced(tmp_path: Path) -> None:
    title = r"""--set $'title="\xc3\x9cberlast \xce\xb8"'"""
    surroundings = {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "1"}
    done = shell(f'frictionsim solve "$PULLEY" {title}', tmp_path, **surroundings)
    assert done.returncode == 0
    assert done.stdout.startswith("?berlast ?: done")


@needs_full
@pytest.mark.parametrize(
    ("arguments", "code"), [("--help", 4), slow("schema", 4), ('solve "$PULLEY" -o a.h5', 0)]
)
def test_a_full_stdout_matters_to_those_who_only_print(
    arguments: str, code: int, tmp_path: Path
) -> None:
    done = shell(f"frictionsim {arguments} >/dev/full", tmp_path)
    warning = "" if code else "warning: "
    said = f"frictionsim: {warning}cannot print the output: No space left on device"
    assert (done.returncode, done.stderr.startswith(said)) == (code, True)
    assert (tmp_path / "a.h5").exists() == (code == 0)


@pytest.mark.parametrize(
    "redirection", one_in(3, ["2>&-", pytest.param("2>/dev/full", marks=needs_full), "2> >(exit)"])
)
def test_a_lost_stderr_keeps_json_pure(redirection: str, tmp_path: Path) -> None:
    options = " ".join(ODD)
    done = shell(f'frictionsim solve "$PULLEY" --json {options} {redirection}', tmp_path)
    assert done.returncode == 0
    assert strict_json(done.stdout)["status"] == "done"


class Failing(io.StringIO):
    """A stream to which nothing can be written."""

    def write(self, text: str) -> int:
        raise OSError(28, "No space left on device")

    def isatty(self) -> bool:
        return True


def test_stderr_changes_neither_run_nor_exit_code(told: Run) -> None:
    closed = io.StringIO()
    closed.close()
    for stream in (None, Failing(), closed):
        with redirect_stderr(stream):
            codes = [
                fs.run_command_line(["solve", PULLEY, "-o", "a.h5", "-vv", *ODD]),
                fs.run_command_line(["compare", "a.h5", "missing.h5"]),
            ]
        assert codes == [0, 2]
    assert "done" in told("show", "a.h5")[0]


def test_a_result_never_becomes_a_closed_standard_stream(tmp_path: Path) -> None:
    """What C code prints on stderr would be written into it."""
    program = (
        "import os, sys, frictionsim.__main__ as m; m._open_closed_streams();"
        " number = os.open('a', os.O_CREAT | os.O_WRONLY);"
        " os.write(number, b'%d %s' % (number, str(os.get_inheritable(2)).encode()))"
    )
    closed = subprocess.run(
        ["sh", "-c", 'exec "$0" -c "$1" <&- >&- 2>&-', sys.executable, program],
        cwd=tmp_path, check=False,
    )  # fmt: skip
    assert closed.returncode == 0
    number, inheritable = (tmp_path / "a").read_text(encoding="utf-8").split()
    assert (int(number) > 2, inheritable) == (True, "True")


def test_a_reader_that_leaves_ends_the_csv(told: Run) -> None:
    class Left(io.StringIO):
        calls = 0

        def write(self, text: str) -> int:
            Left.calls += 1
            raise BrokenPipeError(32, "Broken pipe")

        def fileno(self) -> int:
            raise OSError

    told("solve", PULLEY, "-q", "-o", "a.h5")
    for command in (["show", "a.h5", "--csv"], ["show", "a.h5"], ["--help"]):
        Left.calls = 0
        with redirect_stdout(Left()):
            assert fs.run_command_line(command) == 0
        assert Left.calls == 1


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b]0;title\x07", r"\x1b]0;title\x07"),
        ("a\rb\x7f\x9b\u202e\u2066\u200f\u2028", r"a\x0db\x7f\u009b\u202e\u2066\u200f\u2028"),
        ("\u03b8 \u00fc \u65e5\u672c\u8a9e", "\u03b8 \u00fc \u65e5\u672c\u8a9e"),
    ],
)
def test_control_characters_are_shown_as_escapes(text: str, shown: str, told: Run) -> None:
    """In a log, in a summary, in what is said of an error, and in a warning."""
    fs.solve(PULLEY, output="a.h5")
    with h5py.File("a.h5", "r+") as file:  # a scenario takes no such title
        file.attrs["title"] = text
    assert told("show", "a.h5")[0].startswith(f"{shown}: done\n")
    if sys.getfilesystemencoding() == "utf-8":  # else no file has such a name
        _, err = told("solve", PULLEY, "-v", "-q", "-o", f"b{text}.h5")
        assert f"result written: b{shown}.h5\n" in err
        _, err = told("compare", "a.h5", f"{text}.h5", code=2)
        assert err.startswith(f"frictionsim: {shown}.h5: ")
    if "\r" not in text:  # which is an end of line in the record of warnings
        with h5py.File("a.h5", "r+") as file:
            file.attrs["warnings"] = text
        assert f"frictionsim: warning: {shown}\n" in told("show", "a.h5")[1]


def test_a_printed_scenario_with_marks_of_direction_is_still_one(told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5", "--set", 'title="a\u202eb\u0085c"')
    out, _ = told("show", "a.h5", "--scenario")
    assert r"\u202e" in out
    Path("again.toml").write_text(out, encoding="utf-8")
    assert fs.load("again.toml").title == "a\u202eb\u0085c"
