"""Monitoring of a run in progress: stop signals, wall-time limit, progress bar, status line."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Any

from frictionsim.cli.app import Process
from frictionsim.errors import EXIT_BUDGET_EXCEEDED, EXIT_SIGNAL, Interrupted
from frictionsim.io.terminal import is_terminal, print_on_stderr, visible, write_on_stderr

if TYPE_CHECKING:
    from socket import socket

    from frictionsim.api.progress import ProgressBar


# A lost connection sends SIGHUP, which Windows does not have.
STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
NO_SIGNAL = b"\0"
CLEAR_LINE = "\r\x1b[K"  # erases a status line that may be on the terminal
STEPS_BETWEEN_UPDATES = 256  # of the bar; reading the clock costs a tenth of a step
SECONDS_WITHOUT_BAR = 1.0
# `timeout` and shells signal both the process and its group: a signal may be delivered twice.
SECONDS_FOR_ONE_SIGNAL = 0.2
# The limit is looked at after each step, too, which has something to keep.
SECONDS_AFTER_LIMIT = 0.1
SECONDS_OF_A_WAIT = 1e6  # threads cannot wait for years


class CommandMonitor:
    """The `on_step` callback of a run: called with the simulated time after each step.

    Parameters
    ----------
    duration : float, s
        Duration of the simulation.
    with_progress : bool
        Show a progress bar if stderr is a terminal.
    quiet : bool
        Do not announce compilation.

    Attributes
    ----------
    signal : int
        The first stop signal since the first step; 0 if there was none.
    """

    def __init__(self, duration: float, with_progress: bool, quiet: bool) -> None:
        self._duration = duration
        self._quiet = quiet
        self._with_progress = with_progress and is_terminal(sys.stderr)
        self._started = monotonic()
        # Origin of the pace shown: a resumed run does not start at t = 0.
        self._pace_clock, self._pace_t = self._started, 0.0
        self._last_t = 0.0
        self._calls = 0
        self.signal = 0
        self._signalled = 0.0
        self._compiling = False
        # Those of the program around it: within a run, that of `fs.solve` may be in the place.
        self._before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
        self._replaced: dict[int, Any] = {}
        self._bar: ProgressBar | None = None

    def __call__(self, t: float) -> None:
        """Update the progress bar; stop the run on a signal.

        Parameters
        ----------
        t : float, s
            Simulated time.
        """
        if self.signal:
            raise Interrupted(self.signal, t)
        if self._calls == 0:
            self._handle_signals()
            self._reset_pace(t)
        self._calls += 1
        if self._with_progress and self._calls % STEPS_BETWEEN_UPDATES == 0:
            self._show(t)

    def _handle_signals(self) -> None:
        """Have the first signal wait for the end of the step, and for a result being written.

        Before the first step there is nothing to keep, and the default action stands: it also
        ends what C code does for a minute, such as the assembly of a large belt.
        """
        for number in STOP_SIGNALS:
            before = self._before[number]
            # What is ignored stays ignored, as by nohup; None is a handler that is not Python's.
            if number not in self._replaced and before not in (signal.SIG_IGN, None):
                signal.signal(number, self._on_signal)
                self._replaced[number] = before

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
            print_on_stderr(
                "frictionsim: compiling the kernels for this combination of effects, once"
                f" (about {expected:.0f} s)"
            )
        from socket import socketpair  # imported here: compilations are rare

        reader, writer = socketpair()
        writer.setblocking(False)
        previous = signal.set_wakeup_fd(writer.fileno())
        waiting = Thread(target=self._wait_for_signal, args=(reader,), daemon=True)
        waiting.start()
        self._handle_signals()
        self._compiling = True
        if self.signal:  # received before the socket was set up
            self._exit_now(self.signal)
        try:
            yield
        finally:
            self._compiling = False
            if self._calls == 0:
                self._restore_signals()
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
        os._exit(EXIT_SIGNAL + number)

    @property
    def _kept(self) -> str:
        return "files already written are kept" if self._calls else "nothing was written"

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
        if self._calls and not self._compiling:
            return
        where, help_ = "before the first step", "raise the limit"
        if self._compiling:
            where = "while compiling kernels"
            help_ = "'frictionsim warm-up' compiles them beforehand"
        print_on_stderr(
            f"frictionsim: wall-time limit --max-wall {seconds:g} s reached {where}; {self._kept};"
            f" {help_}"
        )
        before_exit()
        os._exit(EXIT_BUDGET_EXCEEDED)

    def _reset_pace(self, t: float) -> None:
        self._pace_clock, self._pace_t = monotonic(), t

    def _show(self, t: float) -> None:
        if t < self._last_t:  # a second run has started
            self._reset_pace(t)
        self._last_t = t
        if self._bar is None:
            if monotonic() - self._started < SECONDS_WITHOUT_BAR:
                return
            from frictionsim.api.progress import ProgressBar

            self._bar = ProgressBar(self._duration)
        done = t - self._pace_t
        self._bar.show(t, (monotonic() - self._pace_clock) / done if done > 0.0 else None)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.signal:
            if monotonic() - self._signalled > SECONDS_FOR_ONE_SIGNAL:
                os._exit(EXIT_SIGNAL + number)  # a second signal: do not wait for the step
            return
        self.signal = number
        self._signalled = monotonic()

    def _restore_signals(self) -> None:
        for number, handler in self._replaced.items():
            signal.signal(number, handler)
        self._replaced.clear()

    def close(self) -> None:
        """Remove the progress bar; signals have their earlier action again."""
        self._restore_signals()
        if self._bar is not None:
            self._bar.close()


@contextmanager
def monitor_run(
    duration: float, with_progress: bool, quiet: bool = False
) -> Iterator[CommandMonitor]:
    """Monitor a run: a stop signal stops it after the current step, a second ends the process.

    Stop signals are SIGINT, SIGTERM and SIGHUP, unless the process ignores them. Before the first
    step and during the compilation of kernels, the first signal ends the process.

    Parameters
    ----------
    duration : float, s
        Duration of the simulation.
    with_progress : bool
        Show a progress bar if stderr is a terminal.
    quiet : bool
        Do not announce compilation.

    Yields
    ------
    CommandMonitor
        To be called with the time after each step.
    """
    monitor = CommandMonitor(duration, with_progress, quiet)
    try:
        yield monitor
    finally:
        monitor.close()


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
