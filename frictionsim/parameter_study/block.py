"""The outcomes of some runs of a sweep."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_table import TEXTS
from frictionsim.results import Flags, Quantities

if TYPE_CHECKING:
    from frictionsim.results import Array

NOT_RUN, DONE, FAILED, AUDIT_FAILED = 0, 1, 2, 3
STATUSES: Flags = (
    (NOT_RUN, "not_run"),
    (DONE, "done"),
    (FAILED, "failed"),
    (AUDIT_FAILED, "audit_failed"),
)
OUTCOMES = (DONE, FAILED, AUDIT_FAILED)


class RunOutcome(NamedTuple):
    """The outcome of a run, or of several, whose quantities are arrays (runs,).

    The quantities of a failed run are those of the samples up to its end.
    """

    status: int  # one of STATUSES
    quantities: Quantities
    failure: str = ""  # as in a result file, and the reason; empty if done
    reason: str = ""
    warnings: str = ""  # one per line


class RunBlock(NamedTuple):
    """The outcomes of consecutive runs."""

    first: int  # the number of the first of these runs
    status: "np.ndarray[Any, np.dtype[np.int8]]"
    units: dict[str, str]  # of each quantity of any of these runs, by name
    values: "Array"  # (quantities, n); NaN if undefined
    texts: dict[str, dict[int, str]]  # nonempty ones, by name and run

    @property
    def runs(self) -> int:
        """The number of runs."""
        return len(self.status)


def block_of(first: int, outcomes: Iterable[tuple[Any, RunOutcome]]) -> RunBlock:
    """Return the block of the outcomes of consecutive runs, each with the numbers of its runs.

    Runs are counted from the first of the block; those of an outcome are in ascending order.
    """
    parts = [(np.atleast_1d(runs), outcome) for runs, outcome in outcomes]
    parts.sort(key=lambda part: int(part[0][0]))
    units: dict[str, str] = {}
    for _, outcome in parts:
        for name, quantity in outcome.quantities.items():
            units.setdefault(name, quantity.unit)
    count = sum(len(runs) for runs, _ in parts)
    status, values = np.zeros(count, dtype=np.int8), np.full((len(units), count), np.nan)
    rows = {name: row for row, name in enumerate(units)}
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    for runs, outcome in parts:
        status[runs] = outcome.status
        for name, quantity in outcome.quantities.items():
            if quantity.value is not None:
                values[rows[name], runs] = quantity.value
        for name in TEXTS:
            text = getattr(outcome, name)
            if text:
                texts[name] |= dict.fromkeys((first + runs).tolist(), text)
    values[~np.isfinite(values)] = np.nan
    return RunBlock(first, status, units, values, texts)
