"""A limit on the time that a run may take on the wall."""

from time import perf_counter

from frictionsim.errors import BudgetExceeded


class WallTimeLimit:
    """Called with the time of the simulation: ends a run that takes too long.

    Parameters
    ----------
    seconds : float, s
        From now on.
    duration : float, s
        Of the simulation, for the message.
    """

    def __init__(self, seconds: float, duration: float) -> None:
        self._seconds, self._duration = seconds, duration
        self._end = perf_counter() + seconds

    def __call__(self, t: float) -> None:
        """Look at the clock.

        Raises
        ------
        BudgetExceeded
        """
        if perf_counter() >= self._end:
            raise BudgetExceeded(
                f"{self._seconds:g} s of --max-wall are spent at t = {t:.9g} s of"
                f" {self._duration:.9g} s; resume the run, give it more time, or looser tolerances"
            )
