"""Faulty plug-ins are named where they are needed, and disturb nothing else."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import InputError
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
Complain = Callable[..., str]


@pytest.fixture
def add(tmp_path: Path) -> Iterator[Add]:
    """Return an installer of a package with the kind `winch`, or another, and a source text."""
    folder = tmp_path / "site"
    folder.mkdir()

    def install_source(package: str, source: str = COMPLETE, kind: str = "winch") -> None:
        module = package.replace("-", "_")
        (folder / f"{module}.py").write_text(source)
        write_metadata(folder, package, {kind: module})

    with searched(folder):
        yield install_source


@pytest.fixture
def complaint(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Complain:
    """Return a checker of a scenario that returns the error of the key `kind`."""

    def check(text: str = 'kind = "winch"\n') -> str:
        path = tmp_path / "s.toml"
        path.write_text(text)
        capsys.readouterr()  # warnings, which an earlier command in this process may have shown
        assert fs.run_command_line(["check", str(path)]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert said.err.count("\n") == 1
        return said.err.removeprefix(f"frictionsim: {path}:1: kind: ").removesuffix("\n")

    return check


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise ValueError('one two')", "ValueError: one two"),
        ("x = (", "SyntaxError: '(' was never closed (frictionsim_winch.py, line 1)"),
        ("assert 1 == 2", "AssertionError: "),
    ],
)
def test_a_plugin_that_cannot_be_imported(
    source: str, reason: str, add: Add, complaint: Complain
) -> None:
    add("frictionsim-winch", source)
    assert complaint() == (
        "the plug-in of the kind 'winch' (module frictionsim_winch of frictionsim-winch) cannot"
        f" be imported: {reason}; repair or uninstall frictionsim-winch"
        ' (python -c "import frictionsim_winch" shows where it fails)'
    )
    assert [*fs.kinds()][-1] == "winch"  # which takes no import
    assert fs.run_command_line(["check", str(PULLEY)]) == 0


@pytest.mark.parametrize("source", ["import no_such_module", "raise ValueError", ""])
def test_the_schema_of_all_kinds_leaves_a_faulty_one_out(
    source: str, add: Add, caplog: pytest.LogCaptureFixture
) -> None:
    add("frictionsim-winch", source)
    add("frictionsim-anvil", COMPLETE.replace("winch", "anvil"), kind="anvil")
    assert list(fs.schema()["$defs"]) == [*BUILT_IN.split(", "), "anvil"]
    assert [m.split(" (")[0] for m in caplog.messages] == ["the plug-in of the kind 'winch'"]
    with pytest.raises(InputError, match="the plug-in of the kind 'winch'"):
        fs.schema("winch")


def test_an_entry_point_without_a_module(add: Add, complaint: Complain, tmp_path: Path) -> None:
    write_metadata(tmp_path / "site", "frictionsim-winch", {"winch": "winch:Kind"})
    assert "(module winch:Kind of frictionsim-winch) cannot be imported: Mod" in complaint()


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("SCENARIO, PANELS =", "_, __ =", "its module lacks SCENARIO, PANELS"),
        ("def statics(", "def dynamics(", "its module lacks statics"),
        ("def build(", "def make(", "its module lacks build (or ladders and references)"),
        ("METRICS, Channel", "Channel", "its module lacks METRICS"),
    ],
)
def test_a_plugin_that_is_not_complete(
    old: str, new: str, fault: str, add: Add, complaint: Complain
) -> None:
    assert old in COMPLETE
    add("frictionsim-winch", COMPLETE.replace(old, new))
    assert complaint() == (
        "the plug-in of the kind 'winch' (module frictionsim_winch of frictionsim-winch) is not"
        f" complete: {fault}; repair or uninstall frictionsim-winch"
    )


def test_settings_of_a_study_stand_for_a_build(add: Add) -> None:
    add("frictionsim-winch", COMPLETE.replace("def build(s", "def ladders(s") + "references = 1")
    assert fs.schema("winch")["title"]


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("raise ValueError('the rope is too short')", "the rope is too short"),
        ("assert False, 'the rope is too long'", "the rope is too long"),
        ("assert 1 == 2", "invalid"),
    ],
)
def test_an_exception_of_a_validator_is_a_fault_of_the_scenario(
    statement: str, reason: str, add: Add, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    validator = f"""
    rope: float = 1.0

    @field_validator("rope")
    def _rope(cls, rope):
        {statement}
"""
    source = COMPLETE.replace("\n\n\nSCENARIO", f"{validator}\n\nSCENARIO")
    add("frictionsim-winch", f"from pydantic import field_validator\n{source}")
    path = tmp_path / "s.toml"
    path.write_text('kind = "winch"\nrope = 3.0\n')
    assert fs.run_command_line(["check", str(path)]) == 2
    assert capsys.readouterr().err == f"frictionsim: {path}:2: rope: {reason}\n"


def test_an_unknown_kind_names_those_of_plugins_too(add: Add, complaint: Complain) -> None:
    add("frictionsim-winch")
    add("frictionsim-anvil", kind="anvil")
    assert complaint('kind = "wnich"') == "unknown kind 'wnich' (did you mean 'winch'?)"
    assert complaint('kind = "x"') == f"unknown kind 'x'; known: {BUILT_IN}, anvil, winch"
    quoted = ", ".join(f"'{kind}'" for kind in [*BUILT_IN.split(", "), "anvil", "winch"])
    assert complaint('title = "x"') == f"missing; expected one of {quoted}"
    assert complaint("kind = 3") == f"expected one of {quoted}, got 3"


def test_a_result_of_a_kind_that_is_no_longer_installed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = install(BRAKE, tmp_path / "site")
    result = str(tmp_path / "a.h5")
    scenario = str(site / "frictionsim_brake" / "block_brake.toml")
    with searched(site):
        arguments = ["solve", scenario, "-q", "-o", result, "--max-steps", "20"]
        assert fs.run_command_line(arguments) == 5
    capsys.readouterr()
    part = str(tmp_path / "a.partial.h5")
    assert fs.run_command_line(["resume", part]) == 2
    assert capsys.readouterr().err == (
        f"frictionsim: {part}: its scenario is not valid: kind: unknown kind 'block_brake';"
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
    add: Add, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    add("frictionsim-winch", WITHOUT_A_DRIVE)
    path = tmp_path / "s.toml"
    path.write_text('kind = "winch"\n[solver]\nduration = 1.0\n')
    capsys.readouterr()
    assert fs.run_command_line(["solve", str(path), "--output", str(tmp_path / "s.h5")]) == 2
    assert capsys.readouterr().err == (
        "frictionsim: the equation of motion of this kind of mechanism, which its author has to"
        " mend: one term has the energy 'energy_input', of a drive; found 0\n"
    )
