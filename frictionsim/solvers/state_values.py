"""The valid values of the arrays of a checkpoint.

Checkpoints are untrusted. Each part of a solver describes its arrays by `Values`, and they are
compared before anything is computed from them. The digest of a checkpoint detects corruption, not
tampering.
"""

from math import inf
from typing import Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError

MAX_WHOLE = 2.0**53  # up to there double precision has all whole numbers


class Values(NamedTuple):
    """The valid values of an array; by default any finite number.

    Attributes
    ----------
    low, high : float
        Bounds, which belong to the range.
    whole : bool
        Only whole numbers.
    time : bool
        Times of the run, s: none is after its end.
    ascending : bool
        None is below the one before it.
    finite : bool
        Neither infinite nor NaN.
    """

    low: float = -inf
    high: float = inf
    whole: bool = False
    time: bool = False
    ascending: bool = False
    finite: bool = True

    def fault(self, values: Any, duration: float) -> str:
        """Return the fault of values, after the name of their array; empty without one.

        Parameters
        ----------
        values : array or number
        duration : float, s
            Of the run.
        """
        numbers = np.asarray(values, dtype=np.float64)
        sound = np.isfinite(numbers)
        if not sound.all():
            if self.finite:
                return "is not finite"
            numbers = numbers[sound]
        high = min(self.high, duration) if self.time else self.high
        outside = (numbers < self.low) | (numbers > high)
        if outside.any():
            return f"holds {numbers[outside].flat[0]:g}, which is out of its range"
        if self.whole and np.any((numbers != np.floor(numbers)) | (np.abs(numbers) > MAX_WHOLE)):
            return "holds a number that is not whole"
        if self.ascending and np.any(np.diff(numbers.ravel()) < 0.0):
            return "is not in ascending order"
        return ""


class Rows(NamedTuple):
    """The valid values of rows of an array, by row number; by default any finite number."""

    rows: dict[int, Values]

    def fault(self, values: Any, duration: float) -> str:
        """As `Values.fault`."""
        for row, one in enumerate(np.asarray(values)):
            reason = self.rows.get(row, NUMBER).fault(one, duration)
            if reason:
                return f"{reason} (row {row})"
        return ""


class FixedRows(NamedTuple):
    """The valid values of an array with constant first rows; the others hold any finite number.

    Attributes
    ----------
    rows : (k, n)
        As the scenario has them.
    """

    rows: Any

    def fault(self, values: Any, duration: float) -> str:
        """As `Values.fault`."""
        count = len(self.rows)
        if not np.array_equal(values[:count], self.rows):
            return "is of another scenario"
        return NUMBER.fault(values[count:], duration)


Expected = Values | Rows | FixedRows

NUMBER = Values()
POSITIVE = Values(low=float(np.nextafter(0.0, 1.0)))
NON_NEGATIVE = Values(low=0.0)
COUNT = Values(low=0.0, whole=True)
FLAG = Values(low=0.0, high=1.0, whole=True)
DIRECTION = Values(low=-1.0, high=1.0, whole=True)  # also STICK, 0
TIME = Values(low=0.0, time=True)
# A run is not over because a number of a sample is beyond the range of double precision: the
# samples from there on are left out of its result.
SAMPLE = Values(finite=False)


def unfit(name: str, what: str = "does not fit") -> InputError:
    """Return the error for an array that does not fit the scenario; `what` follows its name."""
    return InputError(
        f"its checkpoint does not belong to this scenario or was changed: '{name}' {what}"
    )
