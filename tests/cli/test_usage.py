"""Every error in the use of the command line is one sentence: where, wanted, found, way.

The sentences are in `tests/messages/command_line.txt`.
"""

import re

import pytest

from frictionsim import __version__, errors
from tests.cli.conftest import Run
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
COMMANDS = [
    *("solve", "resume", "check", "static", "cost", "fit", "sweep", "show", "compare", "plot"),
    *("report", "new", "schema", "warm-up"),
]


def commands_of(out: str) -> list[str]:
    """Return the commands of a help text, in their order."""
    listed = out.partition("\nCommands:\n")[2].partition("\n\n")[0]
    return re.findall(r"^  ([\w-]+) ", listed, re.MULTILINE)


def test_the_version_is_printed(told: Run) -> None:
    assert told("--version") == (f"{__version__}\n", "")


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_help(command: str, told: Run) -> None:
    out, err = told(command, "--help")
    assert out.startswith(f"Usage: frictionsim {command} [OPTIONS]")
    assert "-h, --help" in out
    assert err == ""
    # Placeholders look alike; of what an option does, the default is the last.
    usage = out.partition("\n")[0].partition("[OPTIONS]")[2]
    assert re.fullmatch(r"( [A-Z]+(\.\.\.)?| \[[A-Z]+\])*", usage)
    placeholders = [word.strip("[]") for word in usage.split()]
    arguments = out.partition("\nArguments:\n")[2].partition("\nOptions:\n")[0]
    # No types of Python are beside them.
    assert re.findall(r"^  (\S.*?)  ", arguments, re.MULTILINE) == placeholders
    assert "] May be repeated" not in " ".join(out.split())
    assert told(command, "-h") == (out, "")


def test_the_help_lists_every_command_and_exit_code(told: Run) -> None:
    out, err = told("--help")
    assert commands_of(out) == COMMANDS
    assert out.startswith("Usage: frictionsim")
    assert all(f"\n  {command} " in out for command in COMMANDS)
    assert (out, err) == (told("-h")[0], "")
    words = " ".join(out.split())
    codes = {name: code for name, code in vars(errors).items() if name.startswith("EXIT_")}
    for name in ("EXIT_DEFECT", "EXIT_SIGNAL"):  # not listed as such
        del codes[name]
    assert sorted(set(codes.values())) == [0, 1, 2, 3, 4, 5]
    assert all(re.search(rf"\b{code} [a-z]", words) for code in codes.values())
    assert "5 step or time limit reached, 129/130/143 interrupted" in words


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


@pytest.mark.parametrize(
    ("command", "repeated"),
    [
        ("sweep", "vary set"),
        ("plot", "view at channel unit"),
        ("fit", "free channel quantity over set sigma unit"),
    ],
)
def test_the_help_says_which_options_may_be_repeated(
    command: str, repeated: str, told: Run
) -> None:
    _, *options = re.split(r"\n  (?:-\w, )?--", told(command, "--help")[0])
    said = [text.split()[0] for text in options if "May be repeated." in " ".join(text.split())]
    assert said == repeated.split()
