"""Messages on stderr, text and JSON on stdout, and how an exception ends a command."""

from collections.abc import Iterable
from contextlib import suppress
from errno import ENOMEM
from signal import SIGINT
from traceback import walk_tb
from typing import TYPE_CHECKING, Any

import typer

from frictionsim.errors import (
    EXIT_BAD_INPUT,
    EXIT_DEFECT,
    EXIT_NOT_WRITTEN,
    EXIT_SIGNAL,
    EXIT_SOLVER_FAILED,
    ArgumentError,
    FrictionsimError,
    InputError,
    OutputError,
)
from frictionsim.io.terminal import ReaderGone, Stdout, print_on_stderr

if TYPE_CHECKING:
    from pathlib import Path

    from frictionsim.api.result import Result


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


def print_end(result: "Result", whole: "Path | None") -> None:
    """Print the end of a run that is not done and sound, and how it goes on.

    `whole` is the file of the complete run; None for a result that is shown again.
    """
    from frictionsim.api.result import checkpoint_of
    from frictionsim.scenario.methods import METHODS

    place = result.path
    if result.status == "done":
        if result.reason:
            print_error(f"{result.reason}; do not trust {place}")
        return
    print_error(f"run {result.status}: {result.reason}")
    if whole is not None and place is None:
        print_error(f"no samples were computed; {whole} is unchanged")
        return
    if whole is not None:
        unchanged = f"; {whole} is unchanged" if place != whole and whole.exists() else ""
        print_error(f"samples up to this time are in {place}, status '{result.status}'{unchanged}")
    backend = result.record.attributes["backend"]
    with suppress(InputError):
        if checkpoint_of(result):
            print_error(f"'frictionsim resume {place}' continues the run")
            return
    method = METHODS.get(backend)
    if method is not None and not method.resumable:
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
OUT_OF_MEMORY = (
    "out of memory: a longer output.interval or fewer output.channels record fewer numbers; else"
    " allow the process more (see 'ulimit -v')"
)


def ending_of(error: BaseException) -> tuple[str, int]:
    """Return the message, empty for none, and the exit code of what ended a command."""
    if isinstance(error, ArgumentError):
        return f"--{error.argument.replace('_', '-')}: {error.text}", error.exit_code
    if isinstance(error, FrictionsimError):
        return str(error), error.exit_code
    if isinstance(error, typer.TyperException):
        return _usage(error), EXIT_BAD_INPUT
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "", EXIT_SIGNAL + SIGINT
    if isinstance(error, SystemExit) and not _plugin_of(error)[0]:
        return "", error.code if isinstance(error.code, int) else EXIT_DEFECT
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == ENOMEM:
        return OUT_OF_MEMORY, EXIT_SOLVER_FAILED
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror or error or type(error).__name__}", EXIT_NOT_WRITTEN
    return _defect(error), EXIT_DEFECT


def _usage(error: Any) -> str:
    """Return what typer says of a wrong use of a command, and where its help is."""
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else PACKAGE
    return f"{error.format_message().rstrip('.')}; see {command} --help"


def _defect(error: BaseException) -> str:
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
    """Return the installed package of a kind in which an error arose, and file and line there.

    Empty without one. Code of ours, or of a library, that the package called may have raised it.
    """
    from importlib.metadata import entry_points

    from frictionsim.scenario.kinds import GROUP

    points = {_top(point.value): point for point in entry_points(group=GROUP)}
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        if point := points.get(_top(frame.f_globals.get("__name__", ""))):
            name = point.dist.name if point.dist else point.value
            return name, f"{frame.f_code.co_filename}:{line}"
    return "", ""


def _top(module: str) -> str:
    """Return the package that is imported for a module."""
    return module.partition(":")[0].partition(".")[0]
