"""An error that ends a command is reported by its origin: a bug of ours or of a plug-in."""

import re
from pathlib import Path

import pytest

import frictionsim as fs
from tests.cli.conftest import Run
from tests.support.plugins import BRAKE, install, searched

STATICS = '"""Return the limits of the torque and of the force of the block."""'


def fail(told: Run, fault: str, code: int) -> tuple[str, str]:
    """Ask for the statics of a kind that end in a fault; return what is printed."""
    site = install(BRAKE, Path("site").resolve())
    module = next(site.glob("*/block_brake.py"))
    source = module.read_text(encoding="utf-8")
    assert STATICS in source
    module.write_text(source.replace(STATICS, f"{STATICS}\n    {fault}"), encoding="utf-8")
    with searched(site):
        told("new", "block_brake", "s.toml")
        printed = told("static", "s.toml", code=code)
        if code == 70:  # whose traceback is shown with --debug
            with pytest.raises(Exception, match=r"\w"):
                fs.run_command_line(["--debug", "static", "s.toml"])
        return printed


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        ("KeyboardInterrupt()", 130, ""),
        ("PermissionError(13, 'Permission denied', 'a/file')", 4, "a/file: Permission denied\n"),
        # An error of a file is not one of printing.
        ("OSError(5, 'Input/output error')", 4, "Input/output error\n"),
        ("MemoryError()", 1, "out of memory: a longer output.interval or fewer output.channels"),
        ("OSError(12, 'Cannot allocate memory')", 1, "out of memory: "),
    ],
)
def test_an_error_has_its_exit_code_and_the_words_of_the_command(
    error: str, code: int, said: str, told: Run
) -> None:
    """Raised by a kind, as by the system anywhere."""
    out, err = fail(told, f"raise {error}", code)
    assert (out, err.startswith(f"frictionsim: {said}" if said else "")) == ("", True)
    assert err.endswith("\n") == bool(said)


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("1 / 0", "ZeroDivisionError"),
        ("__import__('numpy').linalg.inv([[0.0]])", "LinAlgError"),
        ("start_of(None)", "AttributeError"),
    ],
)
def test_a_bug_of_a_plug_in_names_it(fault: str, kind: str, told: Run) -> None:
    """Also if a library, or a function of ours, fails that it calls."""
    _, err = fail(told, fault, 70)
    assert err.startswith(f"frictionsim: error in the plug-in frictionsim-brake: {kind}: ")
    assert re.search(r"\nat .*block_brake\.py:\d+; ", err)
    assert err.endswith(
        "please report it to the authors of frictionsim-brake with the scenario; --debug before"
        " the command shows the traceback\n"
    )


def test_a_bug_of_ours_is_to_be_reported(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fs, "static", lambda *_: 1 / 0)
    assert told("static", "pulley", code=70)[1] == (
        "frictionsim: internal error: ZeroDivisionError: division by zero\n"
        "please report it with the scenario; --debug before the command shows the traceback\n"
    )
