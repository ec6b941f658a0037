"""Monitoring of a run in progress: stop signals and progress bar."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Thread
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING

from frictionsim.errors import EXIT_SIGNAL, Interrupted

if TYPE_CHECKING:
    from socket import socket

    from frictionsim.api.progress import ProgressBar

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)
NO_SIGNAL = b"\0"
CLEAR_LINE = "\r\x1b[K"  # erases a status line that may be on the terminal
STEPS_BETWEEN_UPDATES = 256  # of the bar; reading the clock costs a tenth of a step
SECONDS_WITHOUT_BAR = 1.0
# `timeout` and shells signal both the process and its group: a signal may be delivered twice.
SECONDS_FOR_ONE_SIGNAL = 0.2


class RunMonitor:
    """The `on_step` callback of a run: called with the simulated time after each step.

    Parameters
    ----------
    duration : float, s
        Duration of the simulation.
    with_progress : bool
        Show a progress bar if stderr is a terminal.
    quiet : bool
        Do not announce compilation.
    """

    def __init__(self, duration: float, with_progress: bool, quiet: bool) -> None:
        self._duration = duration
        self._quiet = quiet
        self._with_progress = with_progress and sys.stderr.isatty()
        self._started = monotonic()
        # Origin of the pace shown: a resumed run does not start at t = 0.
        self._pace_clock, self._pace_t = self._started, 0.0
        self._last_t = 0.0
        self._calls = 0
        self._signal = 0
        self._signalled = 0.0
        self._bar: ProgressBar | None = None

    def __call__(self, t: float) -> None:
        """Update the progress bar; stop the run on a signal.

        Parameters
        ----------
        t : float, s
            Simulated time.

        Raises
        ------
        Interrupted
            If a stop signal was received.
        """
        if self._signal:
            raise Interrupted(self._signal, t)
        if self._calls == 0:
            self._reset_pace(t)
        self._calls += 1
        if self._with_progress and self._calls % STEPS_BETWEEN_UPDATES == 0:
            self._show(t)

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
            clear = CLEAR_LINE if sys.stderr.isatty() else ""
            print(
                f"{clear}frictionsim: compiling the kernels for this combination of effects, once"
                f" (about {expected:.0f} s)",
                file=sys.stderr,
                flush=True,
            )
        from socket import socketpair  # imported here: compilations are rare

        reader, writer = socketpair()
        writer.setblocking(False)
        previous = signal.set_wakeup_fd(writer.fileno())
        waiting = Thread(target=self._wait_for_signal, args=(reader,), daemon=True)
        waiting.start()
        if self._signal:  # received before the socket was set up
            self._exit_now(self._signal)
        try:
            yield
        finally:
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
        kept = "files already written are kept" if self._calls else "nothing was written"
        name = signal.Signals(number).name
        message = f"frictionsim: interrupted by {name} while compiling kernels; {kept}\n"
        with suppress(OSError):  # stderr may be closed
            os.write(2, message.encode())
        os._exit(EXIT_SIGNAL + number)

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
        if self._signal:
            if monotonic() - self._signalled > SECONDS_FOR_ONE_SIGNAL:
                os._exit(EXIT_SIGNAL + number)  # a second signal: do not wait for the step
            return
        self._signal = number
        self._signalled = monotonic()

    def close(self) -> None:
        """Remove the progress bar."""
        if self._bar is not None:
            self._bar.close()


@contextmanager
def monitor_run(duration: float, with_progress: bool, quiet: bool = False) -> Iterator[RunMonitor]:
    """Monitor a run: SIGINT or SIGTERM stops it after the current step, a second ends the process.

    During the compilation of kernels, the first signal ends the process.

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
    RunMonitor
        To be called with the time after each step.
    """
    monitor = RunMonitor(duration, with_progress, quiet)
    previous = [signal.signal(number, monitor._on_signal) for number in STOP_SIGNALS]
    try:
        yield monitor
    finally:
        for number, handler in zip(STOP_SIGNALS, previous, strict=True):
            signal.signal(number, handler)
        monitor.close()
