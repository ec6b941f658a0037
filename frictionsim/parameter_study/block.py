"""The outcomes of some runs of a sweep."""

from collections.abc import Sequence
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


class Outcome(NamedTuple):
    """The outcome of a run.

    The quantities of a failed run are those of the samples up to its end.
    """

    status: int  # one of STATUSES
    quantities: Quantities
    failure: str = ""  # as in a result file, and the reason; empty if done
    reason: str = ""
    warnings: str = ""  # one per line


class Block(NamedTuple):
    """The outcomes of consecutive runs."""

    first: int  # the number of the first of these runs
    status: "np.ndarray[Any, np.dtype[np.int8]]"
    units: dict[str, str]  # of each quantity that one of them has, by name
    values: "Array"  # (quantities, n); NaN where one is not defined
    texts: dict[str, dict[int, str]]  # those that are not empty, by name and run

    @property
    def runs(self) -> int:
        """The number of runs."""
        return len(self.status)


def block_of(first: int, outcomes: Sequence[Outcome]) -> Block:
    """Return the block of the outcomes of consecutive runs."""
    units: dict[str, str] = {}
    for outcome in outcomes:
        for name, quantity in outcome.quantities.items():
            units.setdefault(name, quantity.unit)
    values = np.full((len(units), len(outcomes)), np.nan)
    rows = {name: row for row, name in enumerate(units)}
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    for column, outcome in enumerate(outcomes):
        for name, quantity in outcome.quantities.items():
            if quantity.value is not None:
                values[rows[name], column] = quantity.value
        for name in TEXTS:
            text = getattr(outcome, name)
            if text:
                texts[name][first + column] = text
    status = np.array([outcome.status for outcome in outcomes], dtype=np.int8)
    return Block(first, status, units, values, texts)
