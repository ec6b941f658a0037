"""Every error in the use of the command line is one sentence of ours: where, wanted, found, way.

The sentences are in `tests/messages/command_line.txt`.
"""

import re
from types import SimpleNamespace

import pytest
from typer.main import get_command

from frictionsim import __version__, errors
from frictionsim.api.comparing import CompareOptions
from frictionsim.api.fitting import FitOptions
from frictionsim.api.studies import CostOptions
from frictionsim.api.sweeping import SweepOptions
from frictionsim.cli.app import app
from frictionsim.cli.messages import usage_message
from frictionsim.scenario.options import Options
from tests.cli.conftest import Run
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
COMMANDS = [
    *("solve", "resume", "check", "static", "cost", "show", "compare", "plot", "new", "schema"),
    *("fit", "sweep", "report", "warm-up"),
]


@pytest.mark.parametrize(
    ("message", "wanted"),
    [
        ("'x' is not a valid float", "--rtol: expected a number, got 'x'"),
        ("'x' is not a valid integer.", "--rtol: expected a whole number, got 'x'"),
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
    told("--version")  # which registers them, else in the list that is here for this test alone
    # Whichever module was imported first.
    monkeypatch.setattr(app, "registered_commands", app.registered_commands[::-1])
    assert told("--version") == (f"{__version__}\n", "")
    assert list(get_command(app).commands) == COMMANDS  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_help(command: str, told: Run) -> None:
    out, err = told(command, "--help")
    assert out.startswith(f"Usage: frictionsim {command} [OPTIONS]")
    assert "-h, --help" in out
    assert err == ""
    assert told(command, "-h") == (out, "")


@pytest.mark.parametrize(
    ("command", "options"),
    [
        ("fit", FitOptions),
        ("cost", CostOptions),
        ("compare", CompareOptions),
        ("sweep", SweepOptions),
    ],
)
def test_defaults_in_the_help_are_those_of_the_options(
    command: str, options: type[Options]
) -> None:
    compared = 0
    for parameter in get_command(app).commands[command].params:  # type: ignore[attr-defined]
        shown = re.search(r"\[([\w.-]+)\]$", getattr(parameter, "help", None) or "")
        default = getattr(options.model_fields.get(parameter.name), "default", None)
        if shown and isinstance(default, int | float | str):
            assert type(default)(shown[1]) == default, parameter.name
            assert parameter.default is None, parameter.name
            compared += 1
    assert compared >= 2


def test_the_help_lists_every_command_and_exit_code(told: Run) -> None:
    out, err = told("--help")
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
        ("plot", "view at"),
        ("fit", "free channel quantity over set sigma unit"),
    ],
)
def test_the_help_says_which_options_may_be_repeated(
    command: str, repeated: str, told: Run
) -> None:
    _, *options = re.split(r"\n  (?:-\w, )?--", told(command, "--help")[0])
    said = [text.split()[0] for text in options if "May be repeated." in " ".join(text.split())]
    assert said == repeated.split()
