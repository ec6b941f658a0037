"""The commands, and the exit codes of all of them.

Every command is a thin layer over `import frictionsim`: it reads options, calls a function and
prints. Heavy imports happen when a function is called, so that --help is fast.
"""

from contextlib import nullcontext, redirect_stdout
from io import StringIO

# These register their commands, in the order of the help.
from frictionsim.cli import runs, studies, files  # isort: skip

from frictionsim.cli.options import app as app
from frictionsim.cli.printing import ending_of, print_error, print_text
from frictionsim.errors import EXIT_BAD_INPUT, EXIT_DEFECT, EXIT_DONE

__all__ = ["app", "files", "run_command_line", "runs", "studies"]

HELP = {"-h", "--help", "--show-completion"}


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
