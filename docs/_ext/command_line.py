"""The reference of the command line, from the program's own arguments."""

from typing import Any

from markdown import table
from typer.main import get_command

from frictionsim.cli.commands import app_for


def commands() -> str:
    """Return a section for the program and for each command."""
    program: Any = get_command(app_for())
    parts = [
        "## frictionsim",
        "`frictionsim [OPTIONS] COMMAND [ARGUMENTS]`",
        program.help,
        _options(program),
    ]
    for name, command in sorted(program.commands.items()):
        usage = " ".join(["frictionsim", name, *map(_usage, _arguments(command)), "[OPTIONS]"])
        parts += [f"## frictionsim {name}", f"`{usage}`", command.help, _options(command)]
    return "\n\n".join(parts)


def _arguments(command: Any) -> list[Any]:
    return [p for p in command.params if not p.opts[0].startswith("-")]


def _usage(argument: Any) -> str:
    name = str(argument.metavar or argument.name.upper()).rstrip(".")
    text = f"{name}..." if argument.nargs == -1 else name
    return text if argument.required else f"[{text}]"


def _options(command: Any) -> str:
    arguments = [(f"`{_usage(p)}`", _help(p), "") for p in _arguments(command)]
    options = [
        (f"`{_spelling(p)}`", _help(p), _default(p))
        for p in command.params
        if p.opts[0].startswith("-")
    ]
    return table(("argument or option", "meaning", "default"), [*arguments, *options])


def _help(parameter: Any) -> str:
    """Return the help text, in which <name> is no tag of HTML."""
    return (parameter.help or "").replace("<", r"\<")


def _spelling(option: Any) -> str:
    spelling = ", ".join(option.opts)
    if getattr(option, "is_flag", False) or getattr(option, "count", False):
        return spelling
    return f"{spelling} {option.metavar or option.name.upper()}"


def _default(option: Any) -> str:
    default = option.default
    if isinstance(default, bool) or default is None or getattr(option, "count", False):
        return ""
    return f"{default:g}" if isinstance(default, float) else str(default)
