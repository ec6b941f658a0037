"""Faulty plug-ins are named where they are needed, and disturb nothing else."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.plugins import BRAKE, install, searched, write_metadata
from tests.support.scenarios import SCENARIOS, python

PULLEY = SCENARIOS / "pulley.toml"
BUILT_IN = "pulley, marble_machine, epicyclic, shaft, belt_drive"

# A module that is complete, of which the tests leave out or replace something.
COMPLETE = """
from typing import ClassVar, Literal

from frictionsim.mechanisms.extension import METRICS, Channel, SingleDofScenario


class Model(SingleDofScenario):
    CHANNELS: ClassVar[dict[str, Channel]] = {}
    kind: Literal["winch"]


SCENARIO, PANELS = Model, ()


def simulation(scenario): ...


def statics(scenario):
    return {}


def build(scenario): ...
"""

Add = Callable[..., None]
Refused = Callable[..., str]


@pytest.fixture
def add(here: Path) -> Iterator[Add]:
    """Return an installer of a package with the kind `winch`, or another, and a source text."""
    folder = here / "site"
    folder.mkdir()

    def install_source(package: str, source: str = COMPLETE, kind: str = "winch") -> None:
        module = package.replace("-", "_")
        (folder / f"{module}.py").write_text(source)
        write_metadata(folder, package, {kind: module})

    with searched(folder):
        yield install_source


@pytest.fixture
def refused(told: Callable[..., tuple[str, str]]) -> Refused:
    """Return a function that gives the error of a scenario, by default of the kind `winch`."""

    def error(text: str = 'kind = "winch"\n', command: str = "check") -> str:
        Path("s.toml").write_text(text)
        out, err = told(command, "s.toml", code=2)
        assert (out, err.count("\n")) == ("", 1)
        return err.removeprefix("frictionsim: ").removeprefix("s.toml:1: kind: ").removesuffix("\n")

    return error


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise ValueError('one two')", "ValueError: one two"),
        ("x = (", "SyntaxError: '(' was never closed (frictionsim_winch.py, line 1)"),
        (COMPLETE.replace("SCENARIO, PANELS =", "_, __ ="), "SCENARIO, PANELS"),
        (COMPLETE.replace("def build(", "def make("), "build (or ladders and references)"),
        (COMPLETE.replace("METRICS, Channel", "Channel"), "METRICS"),
    ],
)
def test_a_faulty_plugin_is_named_where_it_is_needed(
    source: str, fault: str, add: Add, refused: Refused, caplog: pytest.LogCaptureFixture
) -> None:
    add("frictionsim-winch", source)
    add("frictionsim-anvil", COMPLETE.replace("winch", "anvil"), kind="anvil")
    which = "the plug-in of the kind 'winch' (module frictionsim_winch of frictionsim-winch)"
    said = f"{which} is not complete: its module lacks {fault}; repair or uninstall"
    if "Error" in fault:
        said = f"{which} cannot be imported: {fault}; repair or uninstall"
    assert refused().startswith(f"{said} frictionsim-winch")
    assert fs.kinds()[-1] == "winch"  # which takes no import
    assert fs.run_command_line(["check", str(PULLEY)]) == 0
    # The schema of all kinds leaves it out.
    assert list(fs.schema()["$defs"]) == [*BUILT_IN.split(", "), "anvil"]
    assert [m.split(" (")[0] for m in caplog.messages] == ["the plug-in of the kind 'winch'"]
    with pytest.raises(fs.InputError, match="the plug-in of the kind 'winch'"):
        fs.schema("winch")


def test_an_entry_point_without_a_module(add: Add, refused: Refused) -> None:
    write_metadata(Path("site"), "frictionsim-winch", {"winch": "winch:Kind"})
    assert "(module winch:Kind of frictionsim-winch) cannot be imported: Mod" in refused()


def test_settings_of_a_study_stand_for_a_build(add: Add) -> None:
    add("frictionsim-winch", COMPLETE.replace("def build(s", "def ladders(s") + "references = 1")
    assert fs.schema("winch")["title"]


@pytest.mark.parametrize(
    ("statement", "reason"),
    [("raise ValueError('the rope is short')", "the rope is short"), ("assert 1 == 2", "invalid")],
)
def test_an_exception_of_a_validator_is_a_fault_of_the_scenario(
    statement: str, reason: str, add: Add, refused: Refused
) -> None:
    validator = f"""
    rope: float = 1.0

    @field_validator("rope")
    def _rope(cls, rope):
        {statement}
"""
    source = COMPLETE.replace("\n\n\nSCENARIO", f"{validator}\n\nSCENARIO")
    add("frictionsim-winch", f"from pydantic import field_validator\n{source}")
    assert refused('kind = "winch"\nrope = 3.0\n') == f"s.toml:2: rope: {reason}"


def test_an_unknown_kind_names_those_of_plugins_too(add: Add, refused: Refused) -> None:
    add("frictionsim-winch")
    add("frictionsim-anvil", kind="anvil")
    assert refused('kind = "wnich"') == "unknown kind 'wnich' (did you mean 'winch'?)"
    assert refused('kind = "x"') == f"unknown kind 'x'; known: {BUILT_IN}, anvil, winch"
    quoted = ", ".join(f"'{kind}'" for kind in [*BUILT_IN.split(", "), "anvil", "winch"])
    assert refused('title = "x"') == f"missing; expected one of {quoted}"


def test_a_result_of_a_kind_that_is_no_longer_installed(
    here: Path, told: Callable[..., tuple[str, str]]
) -> None:
    site = install(BRAKE, here / "site")
    with searched(site):
        scenario = site / "frictionsim_brake" / "block_brake.toml"
        told("solve", scenario, "-q", "-o", "a.h5", "--max-steps", "20", code=5)
    assert told("resume", "a.partial.h5", code=2)[1] == (
        "frictionsim: a.partial.h5: its scenario is not valid: kind: unknown kind 'block_brake';"
        f" known: {BUILT_IN}\n"
    )


def test_a_built_in_kind_does_not_search_the_installed_packages(tmp_path: Path) -> None:
    code = (
        "import importlib.metadata, shlex, sys\n"
        "def searched(**_): raise AssertionError\n"
        "importlib.metadata.entry_points = searched\n"
        "import frictionsim as fs\n"
        "for command in sys.argv[1:]:\n"
        "    assert fs.run_command_line(shlex.split(command)) == 0, command\n"
    )
    commands = [f"check '{PULLEY}'", f"solve '{PULLEY}' -q -o a.h5", f"static '{PULLEY}'"]
    commands.append("plot a.h5")
    done = python("-c", code, *commands, cwd=tmp_path, PYDANTIC_DISABLE_PLUGINS="__all__")
    assert done.returncode == 0, done.stderr


WITHOUT_A_DRIVE = COMPLETE.replace("Channel,", "Channel, OneCoordinate, Term,").replace(
    "def simulation(scenario): ...",
    """def simulation(scenario):
    return OneCoordinate(None, None, 1.0, [Term(lambda u, q, v: -v, "energy_damping")], None)""",
)


def test_an_equation_without_the_term_of_its_drive_is_told_in_a_sentence(
    add: Add, refused: Refused
) -> None:
    add("frictionsim-winch", WITHOUT_A_DRIVE)
    assert refused('kind = "winch"\n[solver]\nduration = 1.0\n', "solve") == (
        "the equation of motion of this kind of mechanism, which its author has to mend: one term"
        " has the energy 'energy_input', of a drive; found 0"
    )
