"""Comparison of results from Python."""

from collections.abc import Iterable
from math import ceil, inf, log10
from os import PathLike
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from frictionsim.api.result import Result
from frictionsim.api.result import open as open_result
from frictionsim.display import STUDY_DIGITS, number_text, short_text, study_text
from frictionsim.document import Data, Document, Table
from frictionsim.io.comparison import (
    ComparedChannel,
    Comparison,
    Tolerances,
    compare_records,
)
from frictionsim.results import finite
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.options import Names, Options

if TYPE_CHECKING:
    from frictionsim.results import Record


Tolerance = Annotated[float, Field(ge=0, allow_inf_nan=True)]
RTOL, ATOL, TIME_ATOL = 1e-6, 1e-9, 1e-6
MAX_DIGITS = 17  # tell any two floats apart
MAX_VERDICT = 14  # characters, such as "pulley driven"; longer ones are below the table
HEADINGS = (
    *("channel or quantity", "", ">value", ">expected", "unit"),
    *(">off by", ">allowed"),
)


class CompareOptions(Options):
    """The arguments of `compare` beside the results; an infinite tolerance is none."""

    rtol: Tolerance = RTOL
    atol: Tolerance = ATOL
    time_atol: Tolerance = TIME_ATOL
    ignore: Names = ()


def compare(
    result: Result | str | PathLike[str],
    golden: Result | str | PathLike[str],
    *,
    rtol: float = RTOL,
    atol: float = ATOL,
    time_atol: float = TIME_ATOL,
    ignore: str | Iterable[str] = (),
) -> Comparison:
    """Compare a result with a golden (reference) result: channels, events, quantities and status.

    A channel agrees if |result - golden| <= atol + rtol |golden| at every sample. Samples within
    time_atol of an event of the golden result are skipped, because a channel may jump there. Events
    agree if their number, contacts and modes are equal and their times within time_atol.

    A quantity agrees if |result - golden| <= atol + rtol * scale, a time if it is within time_atol.
    The scale is the largest energy of the golden run for an energy, 1 for a share (100 for one in
    %), and otherwise the largest value of the channel that the quantity is named after, or of all
    channels of its unit, for an arc at most a turn; it is at least the size of the quantity. None
    equals none. Quantities are compared where both runs ended at the same time; else `status`
    differs, and says so.

    Parameters
    ----------
    result, golden : Result or path
    rtol, atol : float
        Tolerances; atol in the unit of each channel or quantity.
    time_atol : float, s
        Tolerance of the times of events, and of quantities that are times.
    ignore : str or iterable of str
        Names or patterns (``energy_*``) of channels and quantities to ignore, of quantities alone
        ``quantities/NAME``; ``events`` for the events.

    Returns
    -------
    Comparison
        `same` is the verdict. `rows` has the difference of each quantity, and that of each channel
        which is largest relative to what is allowed; `value` and `expected` are those of result and
        golden. What differs stands first, the worst first, quantities before channels.

    Raises
    ------
    ArgumentError
        If a tolerance is negative, a pattern of `ignore` matches nothing, or nothing is left.
    InputError
        If they cannot be compared: a file is unreadable, the kinds differ, or both runs are done
        but sampled at different times.
    """
    given = CompareOptions.among(locals())
    named = _named("result", result, "the result"), _named("golden", golden, "the golden result")
    limits = Tolerances(given.rtol, given.atol, given.time_atol)
    return compare_records(*named, limits, given.ignore)


def _named(argument: str, source: Any, words: str) -> "tuple[str, Record]":
    """Return a result with its file for messages, or what it is called if it is in none."""
    is_open = isinstance(source, Result)
    result: Result = source if is_open else open_result(as_path(argument, source))
    return str(result.path or words), result.record


def comparison_parts(comparison: Comparison) -> Document:
    """Yield the differences of two results."""
    rows, notes = [], []
    for row in comparison.rows:
        verdict = "ok" if row.ok else (row.note or "different")
        if len(verdict) > MAX_VERDICT:
            notes.append(f"{row.name}: {verdict}")
            verdict = "different"
        cells = (*_both_values(row), row.unit, short_text(row.difference), short_text(row.allowed))
        at = "" if row.time is None else f" at {study_text(row.time)} s"
        rows.append((f"{row.name}{at}", verdict, *cells))
    data = []
    for row in comparison.rows:
        numbers = ("value", "expected", "difference", "allowed", "time")
        shown = {name: finite(getattr(row, name)) for name in numbers}
        data.append(
            {"channel": row.name, **shown, "unit": row.unit, "ok": row.ok, "note": row.note}
        )
    yield Data({"same": comparison.same, "rows": data, "notes": list(comparison.notes)})
    yield Table(HEADINGS, rows)
    yield from notes
    yield from comparison.notes
    if not comparison.same:
        yield "note: of a channel, that sample is shown which is furthest above what is allowed"
    yield comparison.verdict


def _both_values(row: ComparedChannel) -> tuple[str, str]:
    """Return the values of result and golden, in as many digits as show what differs."""
    if not row.unit:
        return "", ""
    digits = STUDY_DIGITS
    size = max(abs(row.value or 0.0), abs(row.expected or 0.0))
    if not row.ok and row.difference and 0.0 < size / row.difference < inf:
        digits = min(max(digits, ceil(log10(size / row.difference)) + 2), MAX_DIGITS)
    return number_text(row.value, digits), number_text(row.expected, digits)
