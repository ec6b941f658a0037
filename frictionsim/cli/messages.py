"""Messages on stderr, text and JSON on stdout, and how an exception ends a command."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import ENOMEM
from io import StringIO
from re import fullmatch
from signal import SIGINT
from traceback import walk_tb
from typing import Any

import typer

from frictionsim.errors import (
    EXIT_BAD_INPUT,
    EXIT_DEFECT,
    EXIT_NOT_WRITTEN,
    EXIT_SIGNAL,
    EXIT_SOLVER_FAILED,
    ArgumentError,
    FrictionsimError,
    OutputError,
    unknown,
)
from frictionsim.io.terminal import ReaderGone, Stdout, print_on_stderr


def print_error(message: str) -> None:
    """Print a message on stderr, after the name of the program."""
    print_on_stderr(f"frictionsim: {message}")


def warn(warnings: Iterable[str], source: str = "") -> None:
    """Print warnings on stderr.

    Parameters
    ----------
    warnings : iterable of str
    source : str
        Prefix of each warning, such as "file: ".
    """
    for warning in warnings:
        print_error(f"warning: {source}{warning}")


def print_continuation(result: Any, has_checkpoint: bool) -> None:
    """Print how an unfinished run is continued, or that its method saves no state for that.

    Parameters
    ----------
    result : Result
    has_checkpoint : bool
    """
    from frictionsim.scenario.methods import METHODS

    backend = result.record.attributes["backend"]
    method = METHODS.get(backend)
    if has_checkpoint:
        print_error(f"'frictionsim resume {result.path}' continues the run")
    elif method is not None and not method.resumable:
        print_error(
            f"the run cannot be resumed: the backend {backend} is SciPy's and saves no state"
        )


def print_text(text: str) -> None:
    """Print text on stdout; it is discarded after the reader of a pipe has gone."""
    stdout = Stdout()
    with suppress(ReaderGone):
        stdout.write(f"{text}\n")
        stdout.flush()


def print_json(data: Any) -> None:
    """Print data on stdout; they must not contain non-finite numbers."""
    from json import dumps

    print_text(dumps(data, indent=2, allow_nan=False))


def print_data(data: Any) -> None:
    """Print text as it is, and other data as JSON."""
    if isinstance(data, str):
        print_text(data)
    else:
        print_json(data)


def print_beside_files(data: Any) -> None:
    """Print the summary of a command that writes files, as `print_data`.

    If stdout cannot be written, e.g. on a full disk, a warning on stderr says so, and the exit code
    stays that of the run.
    """
    try:
        print_data(data)
    except OutputError as error:
        print_error(f"warning: {error}; the files of this command are not affected")


def log_on_stderr(verbose: int, quiet: bool = False) -> None:
    """Print logged warnings; with -v also information, with -vv also details.

    Parameters
    ----------
    verbose : int
        How often -v was given.
    quiet : bool
        Print no notes, which are warnings that something is worth knowing and nothing is wrong.
    """
    import logging  # imported here: --help does without, which it would slow down by a tenth

    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it says where it keeps its fonts

    class Lines(logging.Handler):
        """Prints records as messages; an unprintable one does not end the run."""

        def emit(self, record: logging.LogRecord) -> None:
            level = "" if record.levelno <= logging.INFO else f"{record.levelname.lower()}: "
            if hasattr(record, "note"):
                if quiet:
                    return
                level = "note: "
            print_error(f"{level}{record.getMessage()}")

    logger = logging.getLogger("frictionsim")
    logger.handlers = [Lines()]
    logger.setLevel((logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)])


PACKAGE = "frictionsim"


def defect_message(error: BaseException) -> str:
    """Return the message for an internal error, which names the plug-in that it comes from."""
    plugin, place = _plugin_of(error)
    whose = f"error in the plug-in {plugin}" if plugin else "internal error"
    at = f"at {place}; " if plugin else ""
    to = f"to the authors of {plugin} " if plugin else ""
    return (
        f"{whose}: {type(error).__name__}: {error}\n"
        f"{at}please report it {to}with the scenario; --debug before the command shows the"
        " traceback"
    )


def _plugin_of(error: BaseException) -> tuple[str, str]:
    """Return the installed package whose call failed, and file and line; empty if it was ours."""
    from importlib.metadata import entry_points

    from frictionsim.scenario.kinds import GROUP

    frames = [
        (_top(frame.f_globals.get("__name__", "")), f"{frame.f_code.co_filename}:{line}")
        for frame, line in walk_tb(error.__traceback__)
    ]
    try:
        points = {_top(point.value): point for point in entry_points(group=GROUP)}
    except Exception:  # of any installed package: entry points are text without a check
        return "", ""
    calling = (frame for frame in reversed(frames) if frame[0] == PACKAGE or frame[0] in points)
    top, place = next(calling, ("", ""))
    point = points.get(top)
    return ("", "") if point is None else (point.dist.name if point.dist else point.value, place)


def _top(module: str) -> str:
    """Return the package that is imported for a module."""
    return module.partition(":")[0].partition(".")[0]


# What is expected of a value: by the name of click's type, and by the error of pydantic, of which
# one or the other judges it, by the version of typer.
TYPES = {"float": "a number", "integer": "a whole number"}
ERRORS = {
    "float_parsing": "a number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
}


def usage_message(error: Any, arguments: Sequence[str]) -> str:
    """Return the message for an error of typer: the place, the expected and the given value.

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
    elif match := fullmatch(r"No such command '(.*?)'.*", text):
        text = unknown("command", match[1], context.command.list_commands(context))
    elif match := fullmatch(r"Got unexpected extra argument\S* \((.*)\)", text):
        text = f"unexpected argument '{match[1]}'"
    return f"{text}; see {_command(context, arguments)} --help"


def _command(context: Any, arguments: Sequence[str]) -> str:
    """Return the failed command, which typer does not report for all errors."""
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
    """Return the expected and the found value."""
    message = str(error.message).rstrip(".")
    judged = getattr(error.__cause__, "errors", None)
    if judged is not None:
        first = judged()[0]
        wanted = ERRORS.get(first["type"], "")
        return f"expected {wanted}, got '{first['input']}'" if wanted else message
    if match := fullmatch(r"'(.*)' is not a valid (.+)", message):
        return f"expected {TYPES.get(match[2], match[2])}, got '{match[1]}'"
    return message


# Options whose output typer prints itself.
PRINTED_BY_TYPER = {"-h", "--help", "--version", "--show-completion", "--install-completion"}
# Words for a lack of memory in errors of the loader of libraries and of threads.
OUT_OF_MEMORY = (
    "cannot allocate memory",
    "failed to map segment",
    "can't start new thread",
    "out of memory",
)
RUN_COMMANDS = ("solve", "resume")


def ending_of(error: BaseException, arguments: Sequence[str]) -> tuple[str, int]:
    """Return the message and the exit code for the exception that ended a command.

    Parameters
    ----------
    error : BaseException
    arguments : sequence of str
        The command line.

    Returns
    -------
    str
        Empty for none.
    int
    """
    if isinstance(error, ArgumentError):
        return f"--{error.argument.replace('_', '-')}: {error.text}", error.exit_code
    if isinstance(error, FrictionsimError):
        return str(error), error.exit_code
    if isinstance(error, typer.TyperException):
        return usage_message(error, arguments), EXIT_BAD_INPUT
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "", EXIT_SIGNAL + SIGINT
    if isinstance(error, SystemExit) and not _plugin_of(error)[0]:
        return "", error.code if isinstance(error.code, int) else EXIT_DEFECT
    if is_lack_of_memory(error):
        return _memory_message(error, arguments), EXIT_SOLVER_FAILED
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror or error or type(error).__name__}", EXIT_NOT_WRITTEN
    return defect_message(error), EXIT_DEFECT


def is_lack_of_memory(error: BaseException) -> bool:
    """Return whether an exception means a lack of memory."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == ENOMEM):
        return True
    chain: BaseException | None = error
    while chain is not None and isinstance(chain, ImportError | OSError | RuntimeError):
        if any(words in str(chain).lower() for words in OUT_OF_MEMORY):
            return True
        chain = chain.__cause__ or chain.__context__
    return isinstance(chain, MemoryError)


def _memory_message(error: BaseException, arguments: Sequence[str]) -> str:
    """Return the advice for a lack of memory, by command."""
    if isinstance(error, ImportError):
        return (
            "out of memory while loading a library; allow the process more (see 'ulimit -v' and"
            " 'ulimit -u')"
        )
    if any(command in arguments for command in RUN_COMMANDS):
        return (
            "out of memory; a larger output.interval, or fewer output.channels, records fewer"
            " numbers"
        )
    return "out of memory; allow the process more (see 'ulimit -v')"


@contextmanager
def printed_by_typer(arguments: Sequence[str]) -> Iterator[None]:
    """Return the context of a command whose help typer prints; it is printed as other output.

    Typer would end the process with 1 after the reader of a pipe has gone.
    """
    if not PRINTED_BY_TYPER.intersection(arguments) or sys.stdout is None:
        yield
        return
    stdout, sys.stdout = sys.stdout, StringIO()
    text = ""
    try:
        yield
    finally:
        text, sys.stdout = sys.stdout.getvalue(), stdout
        if text:
            print_text(text.removesuffix("\n"))
