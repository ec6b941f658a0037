"""Progress bars of runs and sweeps on stderr."""

from contextlib import AbstractContextManager, nullcontext
from time import monotonic
from typing import IO, Self, cast

from rich.console import Console
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar

from frictionsim.display import short_text
from frictionsim.io.terminal import Stderr, print_on_stderr
from frictionsim.simulation.monitor import Monitor, Progress, SweepProgress, compilation_text

STEPS_BETWEEN_UPDATES = 256  # reading the clock costs a tenth of a step
SECONDS_WITHOUT_BAR = 1.0  # a short run or sweep shows none
SECONDS_BETWEEN_FRAMES = 0.1


class _ProgressBar(Monitor[Progress]):
    """A bar on stderr, if that is a terminal, which is erased at the end."""

    COUNT, TEXT = "{task.completed:.0f} of {task.total:.0f}", "{task.fields[text]}"

    def __enter__(self) -> Self:
        self._begun, self._drawn = monotonic(), 0.0
        self._bar: Bar | None = None
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Print that kernels are compiled."""
        print_on_stderr(compilation_text(expected))
        return nullcontext()

    def _show(self, now: float, completed: float, total: float, text: str) -> None:
        if self._bar is None:
            if now - self._begun < SECONDS_WITHOUT_BAR:
                return
            columns = TextColumn(self.COUNT), BarColumn(), TextColumn(self.TEXT)
            console = Console(file=cast("IO[str]", Stderr()), stderr=True)
            # In a log, rich would leave an empty line. A thread that draws would keep worker
            # processes from being copies of this one.
            shown = console.is_terminal or console.is_jupyter
            self._bar = Bar(
                *columns, console=console, transient=True, auto_refresh=False, disable=not shown
            )
            self._task = self._bar.add_task("", total=total, text="")
            self._bar.start()
        self._bar.update(self._task, completed=completed, text=text)
        if now - self._drawn > SECONDS_BETWEEN_FRAMES:
            self._drawn = now
            self._bar.refresh()


class RunProgress(_ProgressBar[float]):
    """Simulated time, percentage, pace and remaining time of a run of some duration, s."""

    COUNT = "t = {task.completed:.4f} of {task.total:g} s"
    TEXT = "{task.percentage:.1f} %{task.fields[text]}"

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._calls, self._last = 0, 0.0

    def __call__(self, t: float, /) -> None:
        if self._calls == 0 or t < self._last:  # resumed, or a second run to estimate errors
            self._since, self._first = monotonic(), t
        self._calls += 1
        self._last = t
        if self._calls % STEPS_BETWEEN_UPDATES == 0:
            now, text = monotonic(), ""
            if t > self._first:
                pace = (now - self._since) / (t - self._first)
                left = pace * (self._duration - t)
                text = f", {short_text(pace)} s per simulated second, {left:.0f} s left"
            self._show(now, t, self._duration, text)


class SweepBar(_ProgressBar[SweepProgress]):
    """Completed runs of a sweep, their rate and the remaining time."""

    def __enter__(self) -> Self:
        self._first: tuple[float, int] | None = None
        return super().__enter__()

    def __call__(self, progress: SweepProgress, /) -> None:
        now = monotonic()
        if progress.checked < progress.total:
            self._show(now, progress.checked, progress.total, "combinations checked")
            return
        if self._first is None:  # a resumed sweep does not start at 0
            self._first = now, progress.done
        (since, first), text = self._first, "runs"
        if progress.done > first and now > since:
            rate = (progress.done - first) / (now - since)
            left = (progress.total - progress.done) / rate
            text += f", {short_text(rate)} per second, {left:.0f} s left"
        text += f", {progress.failed} failed" if progress.failed else ""
        self._show(now, progress.done, progress.total, text)
