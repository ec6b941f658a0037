"""How many runs go out together: for some tenths of a second, and enough for lockstep."""

from math import ceil

MAX_RUNS_OF_A_BLOCK = 4096
# More runs in lockstep do not fit into the cache of a processor.
MAX_IN_LOCKSTEP = 2000
GROWTH = 4
# Of a run: longer ones go alone, so that a block of the fewest that go together takes seconds only.
MAX_SECONDS_TOGETHER = 0.06


class BlockSizes:
    """The size of the next block, by how long runs took.

    Parameters
    ----------
    seconds : float, s
        Length of a block: long beside what it costs to send, short beside what a sweep takes.
    left : int
        Number of runs.
    together : int
        The fewest runs that are faster together than one after the other; 1 if none are.
    """

    def __init__(self, seconds: float, left: int, together: int = 1) -> None:
        self._block, self._left, self._together = seconds, left, together
        self._runs, self._seconds = 0, 0.0  # of the last block that counts, and of a run in it

    def learn(self, runs: int, seconds: float) -> None:
        """Take note of how long a block took."""
        if self._together > 1 and 2 * runs < self._runs:
            return  # of a few runs each costs more
        self._runs, self._seconds = runs, max(seconds / runs, 1e-7)

    def next(self, workers: int) -> int:
        """Return the size of the next block, which is one for the first ones."""
        if not self._seconds:
            return 1
        wanted = int(self._block / self._seconds)
        if self._together > 1 and self._seconds <= MAX_SECONDS_TOGETHER:
            return self._next_together(wanted, workers)
        return max(1, min(wanted, self._fair(workers), MAX_RUNS_OF_A_BLOCK))

    def _next_together(self, wanted: int, workers: int) -> int:
        # The more go together, the less each costs: four times as many take less than four times
        # as long.
        if self._runs * self._seconds < 2.0 * self._block:
            wanted = max(wanted, GROWTH * self._runs)
        fair = max(self._fair(workers), GROWTH * self._together)  # small ones do not pay
        size = max(self._together, min(wanted, fair, MAX_IN_LOCKSTEP))
        return size if self._left - size >= self._together else max(self._left, 1)

    def _fair(self, workers: int) -> int:
        """Return a size that gets smaller, so that all workers are done at the same time."""
        return ceil(self._left / (2 * workers)) if workers > 1 else self._left

    def took(self, runs: int) -> None:
        """Take note of runs that go out."""
        self._left -= runs

    @property
    def are_short(self) -> bool:
        """Whether blocks run close to the target time, so that one may be queued ahead."""
        return 0.0 < self._seconds < 2.0 * self._block
