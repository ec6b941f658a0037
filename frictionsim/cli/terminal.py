"""What a command prints and hears: messages, text, JSON, progress, signals, and how it ends."""

import os
import signal
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from errno import ENOMEM
from time import monotonic
from traceback import walk_tb
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

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
from frictionsim.io.terminal import (
    ReaderGone,
    Stdout,
    is_terminal,
    print_on_stderr,
    visible,
    write_on_stderr,
)
from frictionsim.simulation.monitor import (
    Monitor,
    Monitors,
    StopSignals,
    SweepProgress,
    compilation_text,
)

if TYPE_CHECKING:
    from pathlib import Path

    from frictionsim.api.result import Result


def print_error(message: str) -> None:
    """Print a message on stderr, after the name of the program."""
    print_on_stderr(f"frictionsim: {message}")


def warn(warnings: Iterable[str], source: str = "") -> None:
    """Print warnings on stderr, each behind a prefix such as "file: "."""
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


def print_data(data: Any) -> None:
    """Print text as it is, and other data, without non-finite numbers, as JSON.

    It is discarded after the reader of a pipe has gone.
    """
    if not isinstance(data, str):
        from json import dumps

        data = dumps(data, indent=2, allow_nan=False)
    stdout = Stdout()
    with suppress(ReaderGone):
        stdout.write(f"{data}\n")
        stdout.flush()


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

    A quiet command prints no notes, which say that something is worth knowing and nothing is wrong.
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


def exit_message(error: BaseException) -> tuple[str, int]:
    """Return the message, empty for none, and the exit code of what ended a command."""
    if isinstance(error, ArgumentError):
        return f"--{error.argument.replace('_', '-')}: {error.text}", error.exit_code
    if isinstance(error, FrictionsimError):
        return str(error), error.exit_code
    if isinstance(error, typer.TyperException):
        return _usage(error), EXIT_BAD_INPUT
    if isinstance(error, Stopped):
        number = signal.Signals(error.number)
        return f"interrupted by {number.name}; no file was written", EXIT_SIGNAL + number
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return "", EXIT_SIGNAL + signal.SIGINT
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


# A lost connection sends SIGHUP, which Windows does not have.
STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
CLEAR_LINE = "\r\x1b[K"  # erases a status line that may be on the terminal
# `timeout` and shells signal both the process and its group: a signal may be delivered twice.
SECONDS_FOR_ONE_SIGNAL = 0.2


class CommandSignals(StopSignals):
    """Stops a command at a signal that the process does not ignore; a second one ends it.

    They are handled from the first step on: before it there is nothing to keep, and the default
    action also ends what C code does for a minute, such as the assembly of a large belt.
    """

    NUMBERS = STOP_SIGNALS

    def __init__(self) -> None:
        super().__init__()
        # Those of the program around it: within a run, that of `fs.solve` may be in the place.
        self._before = {number: signal.getsignal(number) for number in STOP_SIGNALS}

    def __enter__(self) -> Self:
        return self

    def __call__(self, progress: Any, /) -> None:
        """Stop the run after a signal; while combinations are checked no run is completed."""
        is_sweep = isinstance(progress, SweepProgress)
        if not is_sweep or progress.checked >= progress.total:
            self.handle(self._before)
            super().__call__(0.0 if is_sweep else progress)

    def replaces(self, handler: Any) -> bool:
        # What is ignored stays ignored, as by nohup; None is a handler that is not Python's.
        return handler not in (signal.SIG_IGN, None)

    def on_second(self, number: int) -> None:
        if monotonic() - self._first > SECONDS_FOR_ONE_SIGNAL:
            from frictionsim.io.output_file import discard_parts

            discard_parts()
            os._exit(EXIT_SIGNAL + number)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if not self.received:
            self._first = monotonic()
        super()._on_signal(number, frame)


class Stopped(BaseException):
    """Ends a command that keeps nothing of what it did; no library takes it for an error."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class StoppingSignals(CommandSignals):
    """Ends a command that keeps nothing at a signal, where a run does not handle it."""

    def replaces(self, handler: Any) -> bool:
        return handler is signal.SIG_DFL

    def __call__(self, progress: Any = None, /) -> None:
        """Handle signals from now on."""
        self.handle({number: signal.getsignal(number) for number in STOP_SIGNALS})

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        is_first = not self.received
        super()._on_signal(number, frame)
        if is_first:
            raise Stopped(number)


class CommandMonitor(Monitors[Any]):
    """Watches a command: stop signals, compilations, and with `shown` progress on a terminal.

    The progress is that of a run of this duration, s, or else of a sweep.
    """

    def __init__(
        self, duration: float | None = None, shown: bool = False, quiet: bool = False
    ) -> None:
        self.signals, self._quiet = CommandSignals(), quiet
        bar: list[Monitor[Any]] = []
        if shown and is_terminal(sys.stderr):
            from frictionsim.api.progress import RunProgress, SweepBar

            bar = [SweepBar() if duration is None else RunProgress(duration)]
        super().__init__(self.signals, *bar)

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        """Announce a compilation, with a sign of life on a terminal."""
        if not self._quiet:
            print_error(compilation_text(expected))
        if self._quiet or not is_terminal(sys.stderr):
            yield
            return
        from rich.console import Console

        with Console(stderr=True).status("compiling"):
            yield


class StatusLine:
    """Shows a text in one line of a terminal, after some seconds another; erased at the end.

    From the first text on, signals end the command by `Stopped` where nothing else handles them.
    """

    def __init__(self, seconds_between: float = 0.0) -> None:
        self._pause, self._signals = seconds_between, StoppingSignals()

    def __enter__(self) -> Self:
        self._is_shown, self._last = is_terminal(sys.stderr), 0.0
        return self

    def __call__(self, text: str) -> None:
        self._signals()
        if self._is_shown and monotonic() - self._last >= self._pause:
            self._last = monotonic()
            write_on_stderr(f"{CLEAR_LINE}{visible(text)}")

    def __exit__(self, *_: object) -> None:
        self._signals.restore()
        if self._is_shown:
            write_on_stderr(CLEAR_LINE)
        if self._signals.received:  # also if it was lost, or ended a program that was needed
            raise Stopped(self._signals.received)
