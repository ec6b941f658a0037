"""The limit on the wall time of a run."""

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from time import perf_counter
from typing import Any

from frictionsim.errors import BudgetExceeded

LOG = logging.getLogger(__name__)


class WallTimeLimit:
    """Stops a run at a wall-time limit; called with the simulated time after each step.

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
        """Check the clock.

        Raises
        ------
        BudgetExceeded
            If the limit is reached.
        """
        if perf_counter() >= self._end:
            raise self._exceeded(f"at t = {t:.9g} s of {self._duration:.9g} s; {self._advice}")

    def check_before_compilation(self) -> None:
        """Check the clock where kernels are about to be compiled, which takes seconds.

        Raises
        ------
        BudgetExceeded
            If the limit is reached.
        """
        if perf_counter() >= self._end:
            raise self._exceeded(
                "before kernels were compiled; raise the limit, or compile them with 'frictionsim"
                " warm-up'"
            )

    def _exceeded(self, where: str) -> BudgetExceeded:
        return BudgetExceeded(f"wall-time limit --max-wall {self._seconds:g} s reached {where}")


class LimitedSteps:
    """An `on_step` that stops a run at a wall-time limit, after it called another one.

    Parameters
    ----------
    on_step : callable
        Called with the simulated time; its `compiling`, if it has one, is kept.
    seconds, duration, advice, since
        As of `WallTimeLimit`.
    """

    def __init__(
        self,
        on_step: Callable[[float], Any],
        seconds: float,
        duration: float,
        advice: str,
        since: float | None = None,
    ) -> None:
        self._on_step = on_step
        self._limit = WallTimeLimit(seconds, duration, advice, since)

    def __call__(self, t: float) -> None:
        self._on_step(t)
        self._limit(t)

    def compiling(self, expected: float) -> AbstractContextManager[None]:
        """Return the context in which kernels are compiled, see `Simulation.prepare`.

        Raises
        ------
        BudgetExceeded
            If the limit is reached already.
        """
        self._limit.check_before_compilation()
        announce = getattr(self._on_step, "compiling", None)
        return nullcontext() if announce is None else announce(expected)
