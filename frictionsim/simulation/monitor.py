"""Monitors of a run: progress, interruption, limit of the wall time."""

import logging
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from time import perf_counter
from types import FrameType
from typing import Any

from frictionsim.errors import BudgetExceeded, Interrupted

LOG = logging.getLogger(__name__)


class RunMonitor:
    """Called with the simulated time, s, after each step; entered while kernels are compiled.

    Either may raise `Interrupted`, or another error that ends the run.
    """

    def __call__(self, t: float) -> None:
        """Receive the end of a step, t in s."""

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Return the context of a compilation, with its expected duration in s."""
        return nullcontext()


class Monitors(RunMonitor):
    """Several monitors, or functions of the time, one after the other."""

    def __init__(self, *parts: Callable[[float], Any]) -> None:
        self._parts = parts

    def __call__(self, t: float) -> None:
        for part in self._parts:
            part(t)

    @contextmanager
    def compiling(self, expected: float) -> Iterator[None]:
        with ExitStack() as stack:
            for part in self._parts:
                stack.enter_context(compilation_of(part, expected))
            yield


def compilation_of(monitor: Any, expected: float) -> AbstractContextManager[None]:
    """Return the context in which a monitor, or a function of the time, has kernels compiled."""
    compiling = getattr(monitor, "compiling", None)
    return nullcontext() if compiling is None else compiling(expected)


class WallTimeLimit(RunMonitor):
    """Stops a run at a wall-time limit.

    Parameters
    ----------
    seconds : float, s
        The limit.
    duration : float, s
        Duration of the simulation, for the message.
    advice : str
        What helps where the limit is reached, for the message.
    since : float, optional, s
        When it begins to count, as of `perf_counter`; by default with the construction.
    """

    def __init__(
        self, seconds: float, duration: float, advice: str, since: float | None = None
    ) -> None:
        self._seconds, self._duration, self._advice = seconds, duration, advice
        self._end = (perf_counter() if since is None else since) + seconds
        LOG.debug("limit: %g s of wall time", seconds)

    def __call__(self, t: float) -> None:
        """Check the clock."""
        if perf_counter() >= self._end:
            raise self._exceeded(f"at t = {t:.9g} s of {self._duration:.9g} s; {self._advice}")

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Check the clock before kernels are compiled, which takes seconds."""
        if perf_counter() >= self._end:
            raise self._exceeded(
                "before kernels were compiled; raise the limit, or compile them with 'frictionsim"
                " warm-up'"
            )
        return nullcontext()

    def _exceeded(self, where: str) -> BudgetExceeded:
        return BudgetExceeded(f"wall-time limit --max-wall {self._seconds:g} s reached {where}")


class StopAfterStep(RunMonitor):
    """A context in which the first SIGINT stops a run after its current step.

    A second one raises KeyboardInterrupt at once. Nothing is changed outside of the main thread, or
    if the program handles SIGINT itself.
    """

    def __init__(self) -> None:
        self.received = False

    def __enter__(self) -> "StopAfterStep":
        self._installed = (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        )
        if self._installed:
            signal.signal(signal.SIGINT, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def __call__(self, t: float) -> None:
        """Stop the run after a signal."""
        if self.received:
            raise Interrupted(signal.SIGINT, t)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.received:
            raise KeyboardInterrupt
        self.received = True
