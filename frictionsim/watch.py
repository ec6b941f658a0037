"""What looks at a run while it goes: the stop signals, a budget of time, a progress bar."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING

from frictionsim.errors import EXIT_SIGNAL, BudgetSpent, Interrupted

if TYPE_CHECKING:
    from frictionsim.tables import ProgressBar

CALLS_BETWEEN_LOOKS = 256  # at the clock: it costs as much as a tenth of a step
SECONDS_WITHOUT_BAR = 1.0
# `timeout` and shells send a signal to a process and to its group: one wish that comes twice.
SECONDS_FOR_ONE_SIGNAL = 0.2


class Watch:
    """Called with the time of the simulation after every step of it."""

    def __init__(self, duration: float, with_progress: bool, max_wall: float | None) -> None:
        self._duration = duration
        self._with_progress = with_progress and sys.stderr.isatty()
        self._started = monotonic()
        self._max_wall = max_wall
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
        BudgetSpent
            If the run has had its time.
        """
        if self._signal:
            raise Interrupted(self._signal, t)
        if self._max_wall is not None and monotonic() - self._started >= self._max_wall:
            raise BudgetSpent(
                f"{self._max_wall:g} s of --max-wall are spent at t = {t:.9g} s of"
                f" {self._duration:.9g} s; resume the run, give it more time, or looser tolerances"
            )
        self._calls += 1
        if self._with_progress and self._calls % CALLS_BETWEEN_LOOKS == 0:
            self._show(t)

    def say(self, text: str) -> None:
        """Tell whoever sits at the terminal what takes its time."""
        if self._with_progress:
            print(f"frictionsim: {text}", file=sys.stderr)

    def _show(self, t: float) -> None:
        if self._bar is None:
            if monotonic() - self._started < SECONDS_WITHOUT_BAR:
                return
            from frictionsim.tables import ProgressBar

            self._bar = ProgressBar(self._duration)
        self._bar.show(t, monotonic() - self._started)

    def _note_signal(self, number: int, frame: FrameType | None) -> None:
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
def watch(duration: float, with_progress: bool, max_wall: float | None = None) -> Iterator[Watch]:
    """Watch a run: SIGINT and SIGTERM end it after its step, a second one ends the process.

    Parameters
    ----------
    duration : float, s
        Of the simulation.
    with_progress : bool
    max_wall : float, optional, s
        What the run may take.
    """
    watcher = Watch(duration, with_progress, max_wall)
    stops = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, watcher._note_signal) for number in stops]
    try:
        yield watcher
    finally:
        for number, handler in zip(stops, before, strict=True):
            signal.signal(number, handler)
        watcher.close()
