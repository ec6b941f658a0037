"""Monitoring of a run in progress: stop signals, wall-time limit, progress bar, status line."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

from frictionsim.cli.app import Process
from frictionsim.errors import EXIT_BUDGET_EXCEEDED, EXIT_SIGNAL, Interrupted
from frictionsim.io.output_file import discard_parts
from frictionsim.io.terminal import is_terminal, print_on_stderr, visible, write_on_stderr
from frictionsim.simulation.monitor import (
    Monitor,
    Monitors,
    Progress,
    RunMonitor,
    StopSignals,
    SweepProgress,
    compilation_text,
)

if TYPE_CHECKING:
    from socket import socket


# A lost connection sends SIGHUP, which Windows does not have.
STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
NO_SIGNAL = b"\0"
CLEAR_LINE = "\r\x1b[K"  # erases a status line that may be on the terminal
# `timeout` and shells signal both the process and its group: a signal may be delivered twice.
SECONDS_FOR_ONE_SIGNAL = 0.2
# The run itself checks the limit after each step, and keeps its samples.
SECONDS_AFTER_LIMIT = 0.1
SECONDS_OF_A_WAIT = 1e6  # threads cannot wait for years


def _end_process(code: int) -> None:
    """End the process at once, without the parts of files that are not whole."""
    discard_parts()
    os._exit(code)


class CommandSignals(StopSignals):
    """Stops a command at a stop signal that the process does not ignore; a second ends it."""

    NUMBERS = STOP_SIGNALS

    def __init__(self) -> None:
        super().__init__()
        # Those of the program around it: within a run, that of `fs.solve` may be in the place.
        self._before = {number: signal.getsignal(number) for number in STOP_SIGNALS}

    def __enter__(self) -> Self:
        return self  # a monitor begins once there are samples to keep

    def begin(self) -> None:
        """Handle the signals, as long as they are not restored."""
        self.handle(self._before)

    def replaces(self, handler: Any) -> bool:
        # What is ignored stays ignored, as by nohup; None is a handler that is not Python's.
        return handler not in (signal.SIG_IGN, None)

    def on_second(self, number: int) -> None:
        if monotonic() - self._first > SECONDS_FOR_ONE_SIGNAL:
            _end_process(EXIT_SIGNAL + number)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if not self.received:
            self._first = monotonic()
        super()._on_signal(number, frame)


class EndingSignals(CommandSignals):
    """Ends the process at once at a stop signal, and names the files written.

    Parameters
    ----------
    written : str
        The files that the command has written, for the message.
    before_exit : callable, optional
        Called after the message.
    activity : str
        What is interrupted, for the message.
    """

    def __init__(
        self,
        written: str,
        before_exit: Callable[[], Any] | None = None,
        activity: str = "printing the summary",
    ) -> None:
        super().__init__()
        self._written, self._before_exit, self._activity = written, before_exit, activity

    def __enter__(self) -> Self:
        self.begin()
        return self

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        name = signal.Signals(number).name
        print_on_stderr(
            f"frictionsim: interrupted by {name} while {self._activity}; {self._written}"
        )
        if self._before_exit is not None:
            self._before_exit()
        _end_process(EXIT_SIGNAL + number)


class CompilationMonitor(Monitor[Progress]):
    """Announces compilations; during one, a stop signal ends the process at once.

    Parameters
    ----------
    quiet : bool
        Do not announce them.
    unfinished : Path, optional
        File of a run that is interrupted.

    Attributes
    ----------
    signals : CommandSignals
    """

    def __init__(self, quiet: bool, unfinished: Path | None = None) -> None:
        self._quiet, self._unfinished, self.signals = quiet, unfinished, CommandSignals()
        self._stepped = self._compiling = False

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        """Announce the compilation of kernels; during it, a stop signal ends the process at once.

        Python runs a signal handler only when the compiler returns, after seconds. The signal's
        number is written to a socket at once, where a thread waits for it. (Windows can wake up
        sockets only.)

        Parameters
        ----------
        expected : float, s
            Expected duration of the compilation.
        """
        if not self._quiet:
            if is_terminal(sys.stderr):
                write_on_stderr(CLEAR_LINE)
            print_on_stderr(f"frictionsim: {compilation_text(expected)}")
        from socket import socketpair  # imported here: compilations are rare

        reader, writer = socketpair()
        writer.setblocking(False)
        previous = signal.set_wakeup_fd(writer.fileno())
        waiting = Thread(target=self._wait_for_signal, args=(reader,), daemon=True)
        waiting.start()
        self.signals.begin()
        self._compiling = True
        if self.signals.received:  # before the socket was set up
            self._exit_now(self.signals.received)
        try:
            yield
        finally:
            self._compiling = False
            if not self._stepped:
                self.signals.restore()
            signal.set_wakeup_fd(previous)
            writer.send(NO_SIGNAL)
            waiting.join()
            reader.close()
            writer.close()

    def _wait_for_signal(self, reader: "socket") -> None:
        while (byte := reader.recv(1)) != NO_SIGNAL:
            if byte[0] in STOP_SIGNALS:
                self._exit_now(byte[0])

    def _exit_now(self, number: int) -> None:
        """End the process during a compilation; there are no new samples to keep."""
        name = signal.Signals(number).name
        print_on_stderr(f"frictionsim: interrupted by {name} while compiling kernels; {self._kept}")
        _end_process(EXIT_SIGNAL + number)

    @property
    def _kept(self) -> str:
        if not self._stepped:
            return "nothing was written"
        path = self._unfinished
        if path is None or not path.exists():  # no run, or it is done
            return "files already written are kept"
        continued = f"'frictionsim resume {path}' continues the run"
        return f"samples up to this time are in {path}; {continued}"


class CommandMonitor(CompilationMonitor[float], Monitors[float]):
    """Watches the run of a command: stop signals, wall time, compilations, progress bar.

    Parameters
    ----------
    duration : float, s
        Duration of the simulation.
    with_progress : bool
        Show a progress bar if stderr is a terminal.
    quiet, unfinished
        As for `CompilationMonitor`.
    """

    def __init__(
        self,
        duration: float,
        with_progress: bool,
        quiet: bool = False,
        unfinished: Path | None = None,
    ) -> None:
        CompilationMonitor.__init__(self, quiet, unfinished)
        bar: list[RunMonitor] = []
        if with_progress and is_terminal(sys.stderr):
            from frictionsim.api.progress import RunProgress

            bar = [RunProgress(duration)]
        Monitors.__init__(self, self.signals, *bar)

    def __call__(self, t: float, /) -> None:
        """Stop the run at a signal; update the progress bar.

        Before the first step there is nothing to keep, and the default action stands: it also
        ends what C code does for a minute, such as the assembly of a large belt.
        """
        Monitors.__call__(self, t)
        if not self._stepped:
            self._stepped = True
            self.signals.begin()

    @contextmanager
    def limited(self, seconds: float | None, before_exit: Callable[[], Any]) -> Iterator[None]:
        """Return the context of a run that a wall-time limit also ends before its first step.

        After it, the run stops by itself between two steps, and what it has is written.

        Parameters
        ----------
        seconds : float or None, s
            The limit, which counts from now; None for no limit.
        before_exit : callable
            Called before the process ends.
        """
        if seconds is None or not Process.runs_one_command:
            yield
            return
        over = Event()
        watching = Thread(
            target=self._wait_for_limit, args=(seconds, over, before_exit), daemon=True
        )
        watching.start()
        try:
            yield
        finally:
            over.set()
            watching.join()

    def _wait_for_limit(self, seconds: float, over: Event, before_exit: Callable[[], Any]) -> None:
        if over.wait(min(seconds + SECONDS_AFTER_LIMIT, SECONDS_OF_A_WAIT)):
            return
        if self._stepped and not self._compiling:
            return
        where, help_ = "before the first step", "raise the limit"
        if self._compiling:
            where = "while compiling kernels"
            help_ = "'frictionsim warm-up' compiles them beforehand"
        print_on_stderr(
            f"frictionsim: wall-time limit of {seconds:g} s reached {where}; {self._kept}; {help_}"
        )
        before_exit()
        _end_process(EXIT_BUDGET_EXCEEDED)


class SweepMonitor(CompilationMonitor[SweepProgress]):
    """Watches the sweep of a command: shows a bar, and ends the sweep at a stop signal.

    A signal before all combinations are checked ends the process at once: no run is completed.
    """

    def __init__(self, with_bar: bool, quiet: bool) -> None:
        super().__init__(quiet)
        self._with_bar = with_bar and is_terminal(sys.stderr)
        self._bar: Any = None

    def __enter__(self) -> Self:
        if self._with_bar:
            from frictionsim.api.progress import SweepBar

            self._bar = SweepBar().__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self.signals.restore()
        if self._bar is not None:
            self._bar.__exit__()

    def __call__(self, progress: SweepProgress, /) -> None:
        if progress.checked >= progress.total:
            self._stepped = True
            self.signals.begin()
        if self.signals.received:
            raise Interrupted(self.signals.received, 0.0)
        if self._bar is not None:
            self._bar(progress)

    @property
    def _kept(self) -> str:
        return "'frictionsim resume' continues the sweep" if self._stepped else super()._kept


class StatusLine:
    """Shows a text in one line of a terminal; the line is erased at the end."""

    def __enter__(self) -> "StatusLine":
        self._shown = is_terminal(sys.stderr)
        return self

    def __call__(self, text: str) -> None:
        if self._shown:
            write_on_stderr(f"{CLEAR_LINE}{visible(text)}")

    def __exit__(self, *_: object) -> None:
        if self._shown:
            write_on_stderr(CLEAR_LINE)
