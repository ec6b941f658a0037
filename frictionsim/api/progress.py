"""Progress bars of runs and sweeps on stderr."""

from contextlib import AbstractContextManager, nullcontext
from time import monotonic
from typing import IO, Self, cast

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, TextColumn
from rich.progress import Progress as Bar

from frictionsim.display import short_text
from frictionsim.io.terminal import Stderr, print_on_stderr
from frictionsim.simulation.monitor import Monitor, Progress, SweepProgress, compilation_text

STEPS_BETWEEN_UPDATES = 256  # reading the clock costs a tenth of a step
SECONDS_WITHOUT_BAR = 1.0  # a short run or sweep shows none


class _AnnouncingMonitor(Monitor[Progress]):
    """A monitor on a terminal, which announces compilations."""

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Announce the compilation of kernels, which takes `expected` seconds."""
        print_on_stderr(compilation_text(expected))
        return nullcontext()


class RunProgress(_AnnouncingMonitor[float]):
    """Shows simulated time, percentage, pace and remaining time of a run of some length.

    Parameters
    ----------
    duration : float, s
    """

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._calls, self._last = 0, 0.0
        self._bar: Bar | None = None

    def __enter__(self) -> Self:
        self._begun = monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, t: float, /) -> None:
        if self._calls == 0 or t < self._last:  # resumed, or a second run to estimate errors
            self._since, self._first = monotonic(), t
        self._calls += 1
        self._last = t
        if self._calls % STEPS_BETWEEN_UPDATES == 0:
            self._show(t)

    def _show(self, t: float) -> None:
        now = monotonic()
        if self._bar is None:
            if now - self._begun < SECONDS_WITHOUT_BAR:
                return
            self._bar = _bar(
                TextColumn("t = {task.completed:.4f} of {task.total:g} s"),
                BarColumn(),
                TextColumn("{task.percentage:.1f} %{task.fields[pace]}"),
            )
            self._task = self._bar.add_task("", total=self._duration, pace="")
            self._bar.start()
        text = ""
        if t > self._first:
            pace = (now - self._since) / (t - self._first)
            left = pace * (self._duration - t)
            text = f", {short_text(pace)} s per simulated second, {left:.0f} s left"
        self._bar.update(self._task, completed=t, pace=text)


class SweepBar(_AnnouncingMonitor[SweepProgress]):
    """The progress of a sweep on a terminal: completed runs, their rate and the remaining time."""

    def __enter__(self) -> Self:
        self._started = monotonic()
        self._first: tuple[float, int] | None = None
        self._bar: Bar | None = None
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, progress: SweepProgress, /) -> None:
        """Update the bar."""
        now = monotonic()
        if self._bar is None:
            if now - self._started < SECONDS_WITHOUT_BAR:
                return
            columns = (
                TextColumn("{task.completed:.0f} of {task.total:.0f}"),
                BarColumn(),
                TextColumn("{task.fields[text]}"),
            )
            # A thread that draws would keep worker processes from being copies of this one.
            self._bar = _bar(*columns, auto_refresh=False)
            self._task = self._bar.add_task("", total=progress.total, text="")
            self._bar.start()
        if progress.checked < progress.total:
            self._bar.update(self._task, completed=progress.checked, text="combinations checked")
        else:
            if self._first is None:  # a resumed sweep does not start at 0
                self._first = now, progress.done
            text = _text_of_sweep(progress, now - self._first[0], self._first[1])
            self._bar.update(self._task, completed=progress.done, text=text)
        self._bar.refresh()


def _text_of_sweep(progress: SweepProgress, seconds: float, first: int) -> str:
    """Return the rate and the remaining time, from the seconds since the first run."""
    text, done = "runs", progress.done - first
    if done and seconds > 0.0:
        rate = done / seconds
        left = (progress.total - progress.done) / rate
        text += f", {short_text(rate)} per second, {left:.0f} s left"
    return f"{text}, {progress.failed} failed" if progress.failed else text


def _bar(*columns: ProgressColumn, auto_refresh: bool = True) -> Bar:
    """Return a bar on stderr, if that is a terminal; it is erased at the end."""
    console = Console(file=cast("IO[str]", Stderr()), stderr=True)
    # In a log, rich would leave an empty line.
    disabled = not (console.is_terminal or console.is_jupyter)
    return Bar(
        *columns, console=console, transient=True, auto_refresh=auto_refresh, disable=disabled
    )
