"""The progress bar of a run on stderr."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import TracebackType
from typing import IO, cast

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from frictionsim.io.terminal import Stderr, print_on_stderr

STEPS_BETWEEN_UPDATES = 256  # reading the clock costs a tenth of a step


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


class RunProgress:
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
