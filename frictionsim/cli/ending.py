"""How an exception ends a command: its message and its exit code."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from errno import ENOMEM
from io import StringIO
from signal import SIGINT

import typer

from frictionsim.cli.messages import print_text
from frictionsim.errors import (
    EXIT_BAD_INPUT,
    EXIT_DEFECT,
    EXIT_NOT_WRITTEN,
    EXIT_SIGNAL,
    EXIT_SOLVER_FAILED,
    ArgumentError,
    FrictionsimError,
)

# What typer prints by itself, past our messages.
PRINTED_BY_TYPER = {"-h", "--help", "--version", "--show-completion", "--install-completion"}
# Words by which the loader of libraries and the starter of threads say that memory is lacking.
OUT_OF_MEMORY = (
    "cannot allocate memory",
    "failed to map segment",
    "can't start new thread",
    "out of memory",
)
OF_RUNS = ("solve", "resume")


def ending_of(error: BaseException, arguments: Sequence[str]) -> tuple[str, int]:
    """Return the message for what ended a command, and the exit code.

    Parameters
    ----------
    error : BaseException
    arguments : sequence of str
        The command line.

    Returns
    -------
    str
        Empty if there is nothing to say.
    int
    """
    if isinstance(error, ArgumentError):
        return f"--{error.argument.replace('_', '-')}: {error.text}", error.exit_code
    if isinstance(error, FrictionsimError):
        return str(error), error.exit_code
    if isinstance(error, typer.TyperException):
        from frictionsim.cli.usage import usage_message

        return usage_message(error, arguments), EXIT_BAD_INPUT
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "", EXIT_SIGNAL + SIGINT
    if isinstance(error, SystemExit):
        return "", error.code if isinstance(error.code, int) else EXIT_DEFECT
    if is_lack_of_memory(error):
        return _memory_message(error, arguments), EXIT_SOLVER_FAILED
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror or error or type(error).__name__}", EXIT_NOT_WRITTEN
    if not isinstance(error, Exception):
        raise error
    from frictionsim.cli.defect import defect_message

    return defect_message(error), EXIT_DEFECT


def is_lack_of_memory(error: BaseException) -> bool:
    """Return whether an exception says, in one of many ways, that there is too little memory."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == ENOMEM):
        return True
    chain: BaseException | None = error
    while chain is not None and isinstance(chain, ImportError | OSError | RuntimeError):
        if any(words in str(chain).lower() for words in OUT_OF_MEMORY):
            return True
        chain = chain.__cause__ or chain.__context__
    return isinstance(chain, MemoryError)


def _memory_message(error: BaseException, arguments: Sequence[str]) -> str:
    """Return what is true of any command, and of runs what helps."""
    if isinstance(error, ImportError):
        return (
            "out of memory while loading a library; allow the process more (see 'ulimit -v' and"
            " 'ulimit -u')"
        )
    if any(command in arguments for command in OF_RUNS):
        return (
            "out of memory; a larger output.interval, or fewer output.channels, records fewer"
            " numbers"
        )
    return "out of memory; allow the process more (see 'ulimit -v')"


@contextmanager
def printed_by_typer(arguments: Sequence[str]) -> Iterator[None]:
    """Return the context of a command whose help typer prints: it is printed as all output is.

    Typer would end the process with 1 where the reader of a pipe has gone.
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
