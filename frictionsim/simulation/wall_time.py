"""The limit on the wall time of a run."""

from time import perf_counter

from frictionsim.errors import BudgetExceeded


class WallTimeLimit:
    """Stops a run at a wall-time limit; called with the simulated time after each step.

    Parameters
    ----------
    seconds : float, s
        The limit, counted from the construction.
    duration : float, s
        Duration of the simulation, for the message.
    """

    def __init__(self, seconds: float, duration: float) -> None:
        self._seconds, self._duration = seconds, duration
        self._end = perf_counter() + seconds

    def __call__(self, t: float) -> None:
        """Check the clock.

        Raises
        ------
        BudgetExceeded
            If the limit is reached.
        """
        if perf_counter() >= self._end:
            raise BudgetExceeded(
                f"wall-time limit --max-wall {self._seconds:g} s reached at t = {t:.9g} s of"
                f" {self._duration:.9g} s; resume the run, raise the limit or loosen the tolerances"
            )
