"""An error that ends a command is reported by its origin: a bug of ours or of a plug-in."""

from pathlib import Path

import pytest
import typer

from frictionsim.cli.commands import run_command_line
from tests.cli.conftest import Run
from tests.support.plugins import BRAKE, install, searched
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")


NO_MEMORY = [
    *(MemoryError(), OSError(12, "Cannot allocate memory")),
    RuntimeError("can't start new thread"),
]
RECORD_LESS = "out of memory; a larger output.interval, or fewer output.channels, records"
ENDINGS = [
    ("load", KeyboardInterrupt(), 130, ""),
    ("load", typer.Abort(), 130, ""),
    ("load", PermissionError(13, "Permission denied", "a/file"), 4, "a/file: Permission denied\n"),
    # An error of a file is not one of printing.
    ("static", OSError(5, "Input/output error"), 4, "Input/output error\n"),
    *(
        ("static", error, 1, "out of memory; allow the process more (see 'ulimit -v')")
        for error in NO_MEMORY
    ),
    *(("api.solving.solve_with", error, 1, RECORD_LESS) for error in NO_MEMORY),
    ("api.solving.run", MemoryError(), 1, RECORD_LESS),
    (
        "load",
        ImportError("libx.so: failed to map segment from shared object"),
        1,
        "out of memory while loading a library; allow the process more (see 'ulimit -v' and"
        " 'ulimit -u')\n",
    ),
    ("load", ImportError("no module named x"), 70, "internal error: ImportError: no module named"),
    (
        "mechanisms.pulley.statics",
        ZeroDivisionError("division by zero"),
        70,
        "internal error: ZeroDivisionError: division by zero\n"
        "please report it with the scenario; --debug before the command shows the traceback\n",
    ),
]


@pytest.mark.parametrize(("place", "error", "code", "said"), ENDINGS)
def test_an_error_has_its_exit_code_and_is_reported_in_the_words_of_the_command(
    place: str, error: BaseException, code: int, said: str, told: Run,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(f"frictionsim.{place}", fail)
    command = {"load": "check", "static": "static", "mechanisms.pulley.statics": "static"}
    out, err = told(command.get(place, "solve"), PULLEY, code=code)
    assert (out, err.startswith(f"frictionsim: {said}" if said else "")) == ("", True)
    assert err.endswith("\n") == bool(said)
    assert not Path("results/pulley.h5").exists()


def test_debug_shows_the_traceback(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionsim.mechanisms.pulley.statics", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run_command_line(["--debug", "static", PULLEY])


@pytest.mark.parametrize("fault", ["1 / 0", "__import__('numpy').linalg.inv([[0.0]])"])
def test_a_bug_of_a_plug_in_names_it(fault: str, told: Run) -> None:
    """Also if a library that it calls fails."""
    site = install(BRAKE, Path("site").resolve())
    module = next(site.glob("*/block_brake.py"))
    source = module.read_text(encoding="utf-8")
    summary = '"""Return the limits of the torque and of the force of the block."""'
    assert summary in source
    module.write_text(source.replace(summary, f"{summary}\n    {fault}"), encoding="utf-8")
    with searched(site):
        told("new", "block_brake", "s.toml")
        _, err = told("static", "s.toml", code=70)
    kind = "ZeroDivisionError" if fault == "1 / 0" else "LinAlgError"
    assert err.startswith(f"frictionsim: error in the plug-in frictionsim-brake: {kind}: ")
    assert err.endswith(
        "please report it to the authors of frictionsim-brake with the scenario; --debug before"
        " the command shows the traceback\n"
    )
