"""The outcomes of some runs of a sweep, and their form as bytes for files and other processes."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import Flags, Quantities
from frictionsim.scenario.toml_data import json_value

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
LENGTH_BYTES, NUMBER_BYTES = 4, 8
MAX_NUMBER = 2**53


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

    def to_bytes(self) -> bytes:
        """Return the block as bytes, which `from_bytes` reads."""
        head = json.dumps(
            {
                "first": self.first,
                "count": self.runs,
                "units": self.units,
                "texts": [
                    [name, number, text]
                    for name, texts in self.texts.items()
                    for number, text in texts.items()
                ],
            }
        ).encode()
        length = len(head).to_bytes(LENGTH_BYTES, "big")
        values = np.ascontiguousarray(self.values, dtype="<f8")
        return length + head + self.status.tobytes() + values.tobytes()

    @classmethod
    def from_bytes(cls, image: bytes) -> "Block":
        """Return the block that bytes hold, which may come from anyone.

        Raises
        ------
        ValueError
            If they hold none.
        """
        try:
            return cls._parsed(image)
        except (KeyError, TypeError, AttributeError, OverflowError) as error:
            raise ValueError(f"not a block of runs: {error}") from None

    @classmethod
    def _parsed(cls, image: bytes) -> "Block":
        end = LENGTH_BYTES + int.from_bytes(image[:LENGTH_BYTES], "big")
        if end > len(image):
            raise ValueError("a block is cut off")
        head = json_value(image[LENGTH_BYTES:end])
        first, count, units = _whole(head["first"]), _whole(head["count"]), head["units"]
        if not (count and isinstance(units, dict) and all(map(_is_text, units.values()))):
            raise ValueError("a block without runs or units")
        if len(image) != end + count * (1 + NUMBER_BYTES * len(units)):
            raise ValueError("a block of another length")
        status = np.frombuffer(image, np.int8, count, end)
        if not np.isin(status, OUTCOMES).all():
            raise ValueError("a status that there is not")
        values = np.frombuffer(image, "<f8", offset=end + count).reshape(len(units), count)
        texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
        for name, number, text in head["texts"]:
            if not (first <= _whole(number) < first + count and _is_text(text)):
                raise ValueError("a text of no run")
            texts[name][number] = text
        return cls(first, status, units, values.astype(np.float64, copy=False), texts)


def _whole(number: Any) -> int:
    if type(number) is not int or not 0 <= number <= MAX_NUMBER:
        raise ValueError("not a number of runs")
    return number


def _is_text(text: Any) -> bool:
    return isinstance(text, str)


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
