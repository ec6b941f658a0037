"""What looks at a run while it goes: the stop signals, a budget of time, a progress bar."""

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
from frictionsim.simulation.wall_time import WallTimeLimit

if TYPE_CHECKING:
    from frictionsim.cli.tables import ProgressBar

STOPS = (signal.SIGINT, signal.SIGTERM)
NO_SIGNAL = b"\0"
CLEAR_LINE = "\r\x1b[K"  # of a terminal, where a status may stand
STEPS_BETWEEN_UPDATES = 256  # of the bar; to read the clock costs a tenth of a step
SECONDS_WITHOUT_BAR = 1.0
# `timeout` and shells send a signal to a process and to its group: it may be delivered twice.
SECONDS_FOR_ONE_SIGNAL = 0.2


class RunMonitor:
    """Called with the time of the simulation after every step of it."""

    def __init__(
        self, duration: float, with_progress: bool, max_wall: float | None, quiet: bool
    ) -> None:
        self._duration = duration
        self._quiet = quiet
        self._with_progress = with_progress and sys.stderr.isatty()
        self._started = monotonic()
        # When and where in the simulation this process was first; a resumed run is not at 0 then.
        self._begun, self._first = self._started, 0.0
        self._last = 0.0
        self._limit = None if max_wall is None else WallTimeLimit(max_wall, duration)
        self._calls = 0
        self._signal = 0
        self._signalled = 0.0
        self._bar: ProgressBar | None = None

    def __call__(self, t: float) -> None:
        """Show where the run is.

        Raises
        ------
        Interrupted
            If a signal has asked for its end.
        BudgetExceeded
            If the run has had its time.
        """
        if self._signal:
            raise Interrupted(self._signal, t)
        if self._limit is not None:
            self._limit(t)
        if self._calls == 0:
            self._go_from(t)
        self._calls += 1
        if self._with_progress and self._calls % STEPS_BETWEEN_UPDATES == 0:
            self._show(t)

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        """Say that kernels are compiled, and have a signal end the process at once meanwhile.

        Python calls the handler of a signal when the compiler returns, which takes seconds. But
        the number of the signal is in a pipe at once, and a thread waits for it there.

        Parameters
        ----------
        expected : float, s
            How long it should take.
        """
        if not self._quiet:
            clear = CLEAR_LINE if sys.stderr.isatty() else ""
            print(
                f"{clear}frictionsim: compiling the kernels of this combination of effects, once:"
                f" about {expected:.0f} s",
                file=sys.stderr,
                flush=True,
            )
        reader, writer = os.pipe()
        os.set_blocking(writer, False)
        before = signal.set_wakeup_fd(writer)
        guard = Thread(target=self._wait_for_signal, args=(reader,), daemon=True)
        guard.start()
        if self._signal:  # it came before there was a pipe
            self._exit_now(self._signal)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            os.write(writer, NO_SIGNAL)
            guard.join()
            os.close(reader)
            os.close(writer)

    def _wait_for_signal(self, reader: int) -> None:
        while (byte := os.read(reader, 1)) != NO_SIGNAL:
            if byte[0] in STOPS:
                self._exit_now(byte[0])

    def _exit_now(self, number: int) -> None:
        """End the process in the middle of a compilation; there is no run to keep."""
        kept = "what was written before stays" if self._calls else "nothing was computed or written"
        name = signal.Signals(number).name
        message = f"frictionsim: interrupted by {name} while compiling kernels; {kept}\n"
        with suppress(OSError):  # nobody reads it any more
            os.write(2, message.encode())
        os._exit(EXIT_SIGNAL + number)

    def _go_from(self, t: float) -> None:
        self._begun, self._first = monotonic(), t

    def _show(self, t: float) -> None:
        if t < self._last:  # another run has begun
            self._go_from(t)
        self._last = t
        if self._bar is None:
            if monotonic() - self._started < SECONDS_WITHOUT_BAR:
                return
            from frictionsim.cli.tables import ProgressBar

            self._bar = ProgressBar(self._duration)
        done = t - self._first
        self._bar.show(t, (monotonic() - self._begun) / done if done > 0.0 else None)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._signal:
            if monotonic() - self._signalled > SECONDS_FOR_ONE_SIGNAL:
                os._exit(EXIT_SIGNAL + number)  # asked twice: at once
            return
        self._signal = number
        self._signalled = monotonic()

    def close(self) -> None:
        """Take the bar off the terminal."""
        if self._bar is not None:
            self._bar.close()


@contextmanager
def monitor_run(
    duration: float, with_progress: bool, max_wall: float | None = None, quiet: bool = False
) -> Iterator[RunMonitor]:
    """Watch a run: SIGINT and SIGTERM end it after its step, a second one ends the process.

    While kernels are compiled, the first one does.

    Parameters
    ----------
    duration : float, s
        Of the simulation.
    with_progress : bool
    max_wall : float, optional, s
        What the run may take.
    quiet : bool
        Do not say that kernels are compiled, either.
    """
    watcher = RunMonitor(duration, with_progress, max_wall, quiet)
    before = [signal.signal(number, watcher._on_signal) for number in STOPS]
    try:
        yield watcher
    finally:
        for number, handler in zip(STOPS, before, strict=True):
            signal.signal(number, handler)
        watcher.close()
