"""A bug is reported as what it is: ours, or that of a plug-in."""

from pathlib import Path

import pytest

from frictionsim.cli.commands import run_command_line
from tests.cli.conftest import Run
from tests.support.plugins import BRAKE, install, searched
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")


def fail(*_: object) -> None:
    raise ZeroDivisionError("division by zero")


def test_a_bug_of_ours(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionsim.mechanisms.pulley.statics", fail)
    assert told("static", PULLEY, code=70)[1] == (
        "frictionsim: internal error: ZeroDivisionError: division by zero\n"
        "please report it with the scenario; --debug before the command shows the traceback\n"
    )


def test_debug_shows_the_traceback(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionsim.mechanisms.pulley.statics", fail)
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
