"""The commands, and the exit codes of all of them.

Every command is a thin layer over `import frictionsim`: it reads options, calls a function and
prints. Heavy imports happen when a function is called, so that --help is fast.
"""

from collections.abc import Sequence
from contextlib import nullcontext, redirect_stdout
from importlib import import_module
from io import StringIO
from typing import TYPE_CHECKING

from frictionsim.cli.options import app_with
from frictionsim.cli.printing import ending_of, print_error, print_text
from frictionsim.errors import EXIT_BAD_INPUT, EXIT_DEFECT, EXIT_DONE

if TYPE_CHECKING:
    import typer

# The commands of each module, in the order of the help.
MODULES = {
    "runs": ("solve", "resume", "check", "static"),
    "studies": ("cost", "fit", "sweep"),
    "files": ("show", "compare", "plot", "report", "new", "schema", "warm-up"),
}
HELP = {"-h", "--help", "--show-completion"}


def app_for(arguments: Sequence[str] = ()) -> "typer.Typer":
    """Return the application with the command that is called; with all if none is named."""
    called = next((argument for argument in arguments if argument != "--debug"), "")
    modules = [module for module, commands in MODULES.items() if called in commands]
    for module in modules or MODULES:
        import_module(f"frictionsim.cli.{module}")
    every = (command for commands in MODULES.values() for command in commands)
    return app_with([called] if modules else every)


def run_command_line(arguments: list[str]) -> int:
    """Run a command and return its exit code; errors are printed to stderr."""
    if "" in arguments:
        print_error(
            f"argument {arguments.index('') + 1} is empty: is a shell variable unset?"
            " Expected a command, an option or a file"
        )
        return EXIT_BAD_INPUT
    # Typer prints help itself, and would end with 1 after the reader of a pipe has gone.
    helped = StringIO()
    printed = redirect_stdout(helped) if HELP.intersection(arguments) else nullcontext()
    try:
        with printed:
            app = app_for(arguments)
            code = app(arguments, standalone_mode=False, prog_name="frictionsim")
        if helped.getvalue():
            print_text(helped.getvalue().removesuffix("\n"))
    except BaseException as error:
        message, code = ending_of(error)
        if code == EXIT_DEFECT and "--debug" in arguments:
            raise
        if message:
            print_error(message)
        return code
    return code if isinstance(code, int) else EXIT_DONE
