"""The outcomes of some runs of a sweep."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

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
TEXTS = ("failure", "reason", "warnings")
OUTCOMES = (DONE, FAILED, AUDIT_FAILED)


class Outcome(NamedTuple):
    """The outcome of a run.

    Attributes
    ----------
    status : int
        One of STATUSES.
    quantities : Quantities
        Of a failed run those of the samples up to its end.
    failure, reason : str
        As in a result file; empty if done.
    warnings : str
        One per line.
    """

    status: int
    quantities: Quantities
    failure: str = ""
    reason: str = ""
    warnings: str = ""


class Block(NamedTuple):
    """The outcomes of consecutive runs.

    Attributes
    ----------
    first : int
        The number of the first of these runs.
    status : (n,) of int8
    units : dict of str
        By the name of each quantity that one of them has.
    values : (quantities, n)
        NaN where a quantity is not defined.
    texts : dict of dict of str
        The texts that are not empty, by name (TEXTS) and by the number of the run.
    """

    first: int
    status: "np.ndarray[Any, np.dtype[np.int8]]"
    units: dict[str, str]
    values: "Array"
    texts: dict[str, dict[int, str]]

    @property
    def runs(self) -> int:
        """The number of runs."""
        return len(self.status)


def block_of(first: int, outcomes: Sequence[Outcome]) -> Block:
    """Return the block of the outcomes of consecutive runs.

    Parameters
    ----------
    first : int
        The number of the first run.
    outcomes : sequence of Outcome
    """
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
