"""Errors in the use of the command line, in the words of our other messages."""

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


def usage_message(error: Any) -> str:
    """Return the message for an error of typer: where, what was wanted and what was found.

    Parameters
    ----------
    error : typer.TyperException

    Returns
    -------
    str
    """
    name = type(error).__name__
    context: Any = getattr(error, "ctx", None)
    text = error.format_message().rstrip(".")
    if name == "NoSuchOption":
        known = [option for p in context.command.params for option in p.opts] if context else []
        text = unknown("option", error.option_name, [o for o in known if o.startswith("--")])
    elif name == "MissingParameter":
        text = f"{_parameter(error)} is missing"
    elif name == "BadParameter":
        text = f"{_parameter(error)}: {_expected(error)}"
    elif name == "BadOptionUsage":
        text = f"{error.option_name}: expected a value"
    elif found := fullmatch(r"No such command '(.*?)'.*", text):
        text = unknown("command", found[1], context.command.list_commands(context))
    elif found := fullmatch(r"Got unexpected extra argument\S* \((.*)\)", text):
        text = f"unexpected argument '{found[1]}'"
    return f"{text}; see {_command(context)} --help"


def _command(context: Any) -> str:
    return context.command_path if context is not None else "frictionsim"


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
