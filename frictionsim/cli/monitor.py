"""Watching a command: stop signals, announced compilations, progress on a terminal."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType
from typing import Any, Self

from frictionsim.errors import EXIT_SIGNAL
from frictionsim.io.terminal import is_terminal, print_on_stderr, visible, write_on_stderr
from frictionsim.simulation.monitor import (
    Monitor,
    Monitors,
    StopSignals,
    SweepProgress,
    compilation_text,
)

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

    def __call__(self, t: float, /) -> None:
        """Stop the run after a signal."""
        self.handle(self._before)
        super().__call__(t)

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


class _Compilations(Monitor[Any]):
    """Announces compilations, with a sign of life on a terminal, unless quiet."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        if not self._quiet:
            print_on_stderr(f"frictionsim: {compilation_text(expected)}")
        if self._quiet or not is_terminal(sys.stderr):
            yield
            return
        from rich.console import Console

        with Console(stderr=True).status("compiling"):
            yield


class CommandMonitor(Monitors[float]):
    """Watches the run of a command: stop signals, compilations, a progress bar on a terminal."""

    def __init__(self, duration: float, with_progress: bool, quiet: bool = False) -> None:
        self.signals = CommandSignals()
        bar: list[Monitor[float]] = []
        if with_progress and is_terminal(sys.stderr):
            from frictionsim.api.progress import RunProgress

            bar = [RunProgress(duration)]
        super().__init__(self.signals, _Compilations(quiet), *bar)


class SweepMonitor(Monitors[SweepProgress]):
    """Watches the sweep of a command as `CommandMonitor` does a run.

    Signals are handled when all combinations are checked: before, no run is completed.
    """

    def __init__(self, with_bar: bool, quiet: bool) -> None:
        self.signals = CommandSignals()
        bar: list[Monitor[SweepProgress]] = []
        if with_bar and is_terminal(sys.stderr):
            from frictionsim.api.progress import SweepBar

            bar = [SweepBar()]
        super().__init__(self._watch, _Compilations(quiet), *bar)

    def __exit__(self, *error: object) -> None:
        self.signals.restore()
        super().__exit__(*error)

    def _watch(self, progress: SweepProgress) -> None:
        if progress.checked >= progress.total:
            self.signals(0.0)


class StatusLine:
    """Shows a text in one line of a terminal, after some seconds another; erased at the end."""

    def __init__(self, seconds_between: float = 0.0) -> None:
        self._pause = seconds_between

    def __enter__(self) -> Self:
        self._is_shown, self._last = is_terminal(sys.stderr), 0.0
        return self

    def __call__(self, text: str) -> None:
        if self._is_shown and monotonic() - self._last >= self._pause:
            self._last = monotonic()
            write_on_stderr(f"{CLEAR_LINE}{visible(text)}")

    def __exit__(self, *_: object) -> None:
        if self._is_shown:
            write_on_stderr(CLEAR_LINE)
