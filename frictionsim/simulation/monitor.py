"""Monitors of runs and sweeps: progress, interruption, limit of the wall time."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from time import perf_counter
from types import FrameType
from typing import Any, Generic, NamedTuple, Self, TypeVar

from frictionsim.errors import BudgetExceeded, Interrupted


class SweepProgress(NamedTuple):
    """How far a sweep is, in numbers of runs."""

    done: int  # with an outcome, whatever it is
    total: int
    failed: int  # of those that are done
    checked: int  # whose values were validated; before the runs begin, all are


Progress = TypeVar("Progress", float, int, SweepProgress)


class Monitor(Generic[Progress]):
    """Called with the progress of a run, a sweep or a fit; a context around it.

    `compiling` is entered while kernels are compiled. A call and both contexts may raise
    `Interrupted`, or another error that ends the run.
    """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Stop watching."""

    def __call__(self, progress: Progress, /) -> None:
        """Receive the progress: of a run the simulated time at the end of a step, s."""

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Return the context of a compilation, with its expected duration in s."""
        return nullcontext()


RunMonitor = Monitor[float]


class Monitors(Monitor[Progress]):
    """Several monitors, or functions of the progress, one after the other."""

    def __init__(self, *parts: Callable[[Progress], Any]) -> None:
        self._parts: tuple[Callable[[Progress], Any], ...] = parts
        self._entered = ExitStack()

    def __enter__(self) -> Self:
        for part in self._parts:
            if isinstance(part, Monitor):
                self._entered.enter_context(part)
        return self

    def __exit__(self, *_: object) -> None:
        self._entered.close()

    def __call__(self, progress: Progress, /) -> None:
        for part in self._parts:
            part(progress)

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        with ExitStack() as stack:
            for part in self._parts:
                if isinstance(part, Monitor):
                    stack.enter_context(part.compiling(expected))
            yield


def monitor_of(progress: Callable[[Progress], Any]) -> Monitor[Progress]:
    """Return a function of the progress as a monitor, a monitor as it is."""
    return progress if isinstance(progress, Monitor) else Monitors(progress)


def compilation_text(expected: float) -> str:
    """Return the announcement of a compilation, of its expected duration in s."""
    return f"compiling the kernels for this combination of effects, once (about {expected:.0f} s)"


class WallTimeLimit(RunMonitor):
    """Stops a run at a limit of its wall time, s, that counts from a reading of `perf_counter`.

    Duration of the simulation, s, and advice are for the message.
    """

    def __init__(
        self, seconds: float, duration: float, advice: str, since: float | None = None
    ) -> None:
        self._seconds, self._duration, self._advice = seconds, duration, advice
        self._end = (perf_counter() if since is None else since) + seconds
        import logging  # imported here: commands that only print help do without

        logging.getLogger(__name__).debug("limit: %g s of wall time", seconds)

    def __call__(self, t: float, /) -> None:
        if perf_counter() >= self._end:
            raise self._exceeded(f"at t = {t:.9g} s of {self._duration:.9g} s; {self._advice}")

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        if perf_counter() >= self._end:
            raise self._exceeded(
                "before kernels were compiled; raise the limit, or compile them before: with"
                " 'frictionsim warm-up' those of shipped belts, of others by a short run without"
                " limit"
            )
        return nullcontext()

    def _exceeded(self, where: str) -> BudgetExceeded:
        return BudgetExceeded(f"wall-time limit of {self._seconds:g} s reached {where}")


class StopSignals(RunMonitor):
    """Stops a run after the step in which a signal is received; here Ctrl-C in Python.

    A second one raises KeyboardInterrupt at once. Nothing is changed outside of the main thread, or
    if the program handles SIGINT itself.

    Attributes
    ----------
    received : int
        The first signal; 0 if there was none.
    """

    NUMBERS: tuple[int, ...] = (signal.SIGINT,)

    def __init__(self) -> None:
        self.received = 0
        self._replaced: dict[int, Any] = {}

    def __enter__(self) -> Self:
        self.handle({number: signal.getsignal(number) for number in self.NUMBERS})
        return self

    def __exit__(self, *_: object) -> None:
        self.restore()

    def __call__(self, t: float, /) -> None:
        if self.received:
            raise Interrupted(self.received, t)

    def handle(self, before: dict[int, Any]) -> None:
        """Handle the signals whose earlier handlers may be replaced."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number, handler in before.items():
            if number not in self._replaced and self.replaces(handler):
                signal.signal(number, self._on_signal)
                self._replaced[number] = handler

    def restore(self) -> None:
        """Give the signals their earlier handlers again."""
        for number, handler in self._replaced.items():
            signal.signal(number, handler)
        self._replaced.clear()

    def replaces(self, handler: Any) -> bool:
        """Return whether a handler may be replaced."""
        return handler is signal.default_int_handler

    def on_second(self, number: int) -> None:
        """End the run at once."""
        raise KeyboardInterrupt

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.received:
            self.on_second(number)
        else:
            self.received = number
