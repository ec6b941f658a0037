"""The fastest setting for a required error."""

from collections.abc import Iterable
from typing import NamedTuple

from frictionsim.work_precision.outcome import Row

TARGET_ERRORS = (1e-2, 1e-3, 1e-4)
# Wall times within 10 % count as equal; the first wins, so that the default backend is preferred.
TIME_TIE_RATIO = 1.1


class Advice(NamedTuple):
    """The fastest setting with an error of at most `wanted`.

    `row` is None if no setting reaches this error, or if the reference uncertainty exceeds it.
    """

    wanted: float
    row: Row | None
    floor: float

    @property
    def sentence(self) -> str:
        """The recommendation as text."""
        goal = f"for {100 * self.wanted:g} %"
        if self.floor > self.wanted:
            return f"{goal}: unknown, the reference uncertainty is {self.floor:.1e}"
        if self.row is None:
            return f"{goal}: no setting reached it"
        row = self.row
        return (
            f"{goal}: {row.setting.line} with {row.setting.label}, {1e3 * row.wall_seconds:.3g}"
            f" ms, error {row.error:.1e}"
        )


def advise(rows: Iterable[Row], floor: float) -> list[Advice]:
    """Return the fastest setting for each of TARGET_ERRORS.

    Parameters
    ----------
    rows : iterable of Row
    floor : float
        Reference uncertainty.

    Returns
    -------
    list of Advice
    """
    done = [(row, row.error) for row in rows if row.error is not None]
    return [
        Advice(
            wanted,
            _fastest([row for row, error in done if error <= wanted and floor <= wanted]),
            floor,
        )
        for wanted in TARGET_ERRORS
    ]


def _fastest(rows: list[Row]) -> Row | None:
    shortest = min((row.wall_seconds for row in rows), default=0.0)
    return next((row for row in rows if row.wall_seconds <= shortest * TIME_TIE_RATIO), None)
