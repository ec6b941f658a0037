"""The progress bar of a run on stderr."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import TracebackType
from typing import IO, TYPE_CHECKING, cast

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from frictionsim.io.terminal import Stderr, print_on_stderr
from frictionsim.simulation.monitor import RunMonitor

if TYPE_CHECKING:
    from frictionsim.api.sweep_run import SweepProgress

STEPS_BETWEEN_UPDATES = 256  # reading the clock costs a tenth of a step
SECONDS_WITHOUT_BAR = 1.0  # of a sweep: a short one shows none


class ProgressBar:
    """Simulated time, percentage, pace and remaining time.

    Parameters
    ----------
    duration : float, s
    """

    def __init__(self, duration: float) -> None:
        console = Console(file=cast("IO[str]", Stderr()), stderr=True)
        self._progress = Progress(
            TextColumn("t = {task.completed:.4f} of {task.total:g} s"),
            BarColumn(),
            TextColumn("{task.percentage:.1f} %{task.fields[pace]}"),
            console=console,
            transient=True,
            # Elsewhere, as in a log, rich would leave an empty line.
            disable=not (console.is_terminal or console.is_jupyter),
        )
        self._task = self._progress.add_task("", total=duration, pace="")
        self._duration = duration
        self._progress.start()

    def show(self, t: float, pace: float | None) -> None:
        """Update the bar.

        Parameters
        ----------
        t : float, s
            Simulated time.
        pace : float or None, s/s
            Wall time per simulated second, if known.
        """
        text = ""
        if pace is not None:
            left = pace * (self._duration - t)
            text = f", {pace:.3g} s per simulated second, {left:.0f} s left"
        self._progress.update(self._task, completed=t, pace=text)

    def close(self) -> None:
        """Remove the bar."""
        self._progress.stop()


class RunProgress(RunMonitor):
    """The `on_step` of a run in Python that shows its progress.

    Parameters
    ----------
    duration : float, s
    """

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._calls = 0

    def __enter__(self) -> "RunProgress":
        self._bar = ProgressBar(self._duration)
        self._started, self._first = monotonic(), 0.0
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.close()

    def __call__(self, t: float) -> None:
        if self._calls == 0:  # a resumed run does not start at 0
            self._started, self._first = monotonic(), t
        self._calls += 1
        if self._calls % STEPS_BETWEEN_UPDATES == 0:
            done = t - self._first
            self._bar.show(t, (monotonic() - self._started) / done if done > 0.0 else None)

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        """Announce the compilation of kernels, which takes `expected` seconds."""
        print_on_stderr(f"compiling the kernels, once (about {expected:.0f} s)")
        yield


class SweepBar:
    """The progress of a sweep on a terminal: runs that are done, their rate and the time left."""

    def __enter__(self) -> "SweepBar":
        self._started = monotonic()
        self._first: tuple[float, int] | None = None
        self._bar: Progress | None = None
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, found: "SweepProgress") -> None:
        """Update the bar."""
        now = monotonic()
        if self._bar is None:
            if now - self._started < SECONDS_WITHOUT_BAR:
                return
            self._bar = _bar_of_runs()
            self._task = self._bar.add_task("", total=found.total, text="")
            self._bar.start()
        if found.checked < found.total:
            self._bar.update(self._task, completed=found.checked, text="combinations checked")
        else:
            if self._first is None:  # a resumed sweep does not start at 0
                self._first = now, found.done
            self._bar.update(self._task, completed=found.done, text=self._text(found, now))
        self._bar.refresh()

    def _text(self, found: "SweepProgress", now: float) -> str:
        assert self._first is not None
        since, first = self._first
        text = "runs"
        done, seconds = found.done - first, now - since
        if done and seconds > 0.0:
            rate = done / seconds
            text += f", {rate:.3g} per second, {(found.total - found.done) / rate:.0f} s left"
        return f"{text}, {found.failed} failed" if found.failed else text


def _bar_of_runs() -> Progress:
    console = Console(file=cast("IO[str]", Stderr()), stderr=True)
    return Progress(
        TextColumn("{task.completed:.0f} of {task.total:.0f}"),
        BarColumn(),
        TextColumn("{task.fields[text]}"),
        console=console,
        transient=True,
        # A thread that draws would keep worker processes from being copies of this one.
        auto_refresh=False,
        disable=not (console.is_terminal or console.is_jupyter),
    )
