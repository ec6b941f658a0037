"""The cheapest setting that is exact enough."""

from collections.abc import Iterable
from typing import NamedTuple

from frictionsim.work_precision.study import Row

TARGET_ERRORS = (1e-2, 1e-3, 1e-4)
# Times as near as this are not told apart; the first of them is taken, the default backend before
# others that do the same.
TIME_TIE_RATIO = 1.1


class Advice(NamedTuple):
    """Of the settings whose error is at most `wanted`, the one that took the least time.

    `row` is None where none is exact enough, or where the references are not.
    """

    wanted: float
    row: Row | None
    floor: float

    @property
    def sentence(self) -> str:
        """What to take, in words."""
        goal = f"for {100 * self.wanted:g} %"
        if self.floor > self.wanted:
            return f"{goal}: cannot be told, the references differ by {self.floor:.1e}"
        if self.row is None:
            return f"{goal}: none reached it"
        row = self.row
        return (
            f"{goal}: {row.setting.line} with {row.setting.label}, {1e3 * row.wall_seconds:.3g}"
            f" ms, error {row.error:.1e}"
        )


def advise(rows: Iterable[Row], floor: float) -> list[Advice]:
    """Return the cheapest setting for each wanted error."""
    judged = [(row, row.error) for row in rows if row.error is not None]
    return [
        Advice(
            wanted,
            _cheapest([row for row, error in judged if error <= wanted and floor <= wanted]),
            floor,
        )
        for wanted in TARGET_ERRORS
    ]


def _cheapest(rows: list[Row]) -> Row | None:
    least = min((row.wall_seconds for row in rows), default=0.0)
    return next((row for row in rows if row.wall_seconds <= least * TIME_TIE_RATIO), None)
