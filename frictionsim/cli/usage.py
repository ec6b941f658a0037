"""Errors in the use of the command line, in the words of our other messages."""

from collections.abc import Sequence
from re import fullmatch
from typing import Any

from frictionsim.errors import unknown

# What is expected of a value: by the name of click's type, and by the error of pydantic, of which
# one or the other judges it, by the version of typer.
TYPES = {"float": "a number", "integer": "a whole number"}
ERRORS = {
    "float_parsing": "a number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "greater_than_equal": "a number of at least {ge}",
    "greater_than": "a number above {gt}",
}


def usage_message(error: Any, arguments: Sequence[str]) -> str:
    """Return the message for an error of typer: where, what was wanted and what was found.

    Parameters
    ----------
    error : typer.TyperException
    arguments : sequence of str
        The command line.
    """
    name = type(error).__name__
    context: Any = getattr(error, "ctx", None)
    text = error.format_message().rstrip(".")
    if name == "NoSuchOption":
        text = _unknown_option(error.option_name, context)
    elif name == "MissingParameter":
        text = f"{_parameter(error)} is missing"
    elif name == "BadParameter":
        text = f"{_parameter(error)}: {_expected(error)}"
    elif name == "BadOptionUsage":
        wanted = "no value" if "does not take a value" in text else "a value"
        text = f"{error.option_name}: expected {wanted}"
    elif found := fullmatch(r"No such command '(.*?)'.*", text):
        text = unknown("command", found[1], context.command.list_commands(context))
    elif found := fullmatch(r"Got unexpected extra argument\S* \((.*)\)", text):
        text = f"unexpected argument '{found[1]}'"
    return f"{text}; see {_command(context, arguments)} --help"


def _command(context: Any, arguments: Sequence[str]) -> str:
    """Return the command in which the error is; of some errors typer does not tell it."""
    if context is not None:
        return str(context.command_path)
    named = next((argument for argument in arguments if not argument.startswith("-")), "")
    return f"frictionsim {named}".rstrip()


def _unknown_option(option: str, context: Any) -> str:
    """Return the message for an option that a command does not have, where it stands."""
    if context is None:
        return f"unknown option '{option}'"
    command, program = context.command, context.find_root().command
    if command is not program and option in _options(program):
        return f"{option}: expected before the command: 'frictionsim {option} {context.info_name}'"
    for name, other in getattr(command, "commands", {}).items():
        if option in _options(other):
            return f"{option}: expected after the command, as in 'frictionsim {name} {option}'"
    return unknown("option", option, [name for name in _options(command) if name[:2] == "--"])


def _options(command: Any) -> list[str]:
    return [option for parameter in command.params for option in parameter.opts]


def _parameter(error: Any) -> str:
    """Return the name of an option, or of an argument as in the help."""
    parameter = error.param
    if parameter is None:
        return str(error.param_hint or "an argument")
    if parameter.param_type_name == "option":
        return str(max(parameter.opts, key=len))
    return str(parameter.metavar or parameter.name.upper()).rstrip(".")


def _expected(error: Any) -> str:
    """Return what is expected of a value, and what was found."""
    message = str(error.message).rstrip(".")
    judged = getattr(error.__cause__, "errors", None)
    if judged is not None:
        first = judged()[0]
        wanted = ERRORS.get(first["type"], "").format(**first.get("ctx", {}))
        return f"expected {wanted}, got '{first['input']}'" if wanted else message
    if found := fullmatch(r"'(.*)' is not a valid (.+)", message):
        return f"expected {TYPES.get(found[2], found[2])}, got '{found[1]}'"
    if found := fullmatch(r"(.+) is not in the range x>=(.+)", message):
        return f"expected a number of at least {found[2]}, got '{found[1]}'"
    return message
