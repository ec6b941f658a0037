"""Comparison of results from Python."""

from collections.abc import Iterable
from os import PathLike
from typing import TYPE_CHECKING

from pydantic import Field

from frictionsim.api import result as results
from frictionsim.display import short_text, time_text
from frictionsim.document import Data, Document, Table
from frictionsim.io.comparison import Comparison, Tolerances, compare_records
from frictionsim.results import finite
from frictionsim.scenario.options import Names, Options, as_path

if TYPE_CHECKING:
    from frictionsim.results import Record


RTOL, ATOL, TIME_ATOL = 1e-6, 1e-9, 1e-6


class CompareOptions(Options):
    """The tolerances of a comparison, and the channels to ignore."""

    rtol: float = Field(RTOL, ge=0, allow_inf_nan=True)
    atol: float = Field(ATOL, ge=0, allow_inf_nan=True)
    time_atol: float = Field(TIME_ATOL, ge=0, allow_inf_nan=True)
    ignore: Names = ()


def compare(
    result: results.Result | str | PathLike[str],
    golden: results.Result | str | PathLike[str],
    *,
    rtol: float = RTOL,
    atol: float = ATOL,
    time_atol: float = TIME_ATOL,
    ignore: str | Iterable[str] = (),
) -> Comparison:
    """Compare a result with a golden (reference) result, channel by channel and event by event.

    A channel agrees if |result - golden| <= atol + rtol |golden| at every sample. Samples within
    time_atol of an event of the golden result are skipped, because a channel may jump there. Events
    agree if their number, contacts and modes are equal and their times within time_atol.

    Parameters
    ----------
    result, golden : results.Result or path
    rtol, atol : float
        Tolerances; atol in the unit of each channel.
    time_atol : float, s
        Tolerance of event times.
    ignore : str or iterable of str
        Names or patterns (``energy_*``) of channels to ignore; ``events`` for the events.

    Returns
    -------
    Comparison
        `same` is the verdict, `rows` has the difference of each channel that is largest relative to
        what is allowed.

    Raises
    ------
    ArgumentError
        If a tolerance is negative, or a pattern of `ignore` matches nothing.
    InputError
        If they cannot be compared: a file is unreadable, the kinds differ, or both runs are done
        but sampled at different times.
    """
    options = CompareOptions.among(locals())
    return compare_with(result, golden, options)


def compare_with(
    result: results.Result | str | PathLike[str],
    golden: results.Result | str | PathLike[str],
    options: CompareOptions,
) -> Comparison:
    """Compare a result with a golden result."""
    tolerances = Tolerances(options.rtol, options.atol, options.time_atol)
    records = (
        _named("result", result, "the result"),
        _named("golden", golden, "the golden result"),
    )
    return compare_records(*records, tolerances, options.ignore)


def _named(
    argument: str, source: results.Result | str | PathLike[str], words: str
) -> "tuple[str, Record]":
    """Return a result with its name for messages."""
    if isinstance(source, results.Result):
        return str(source.path or words), source.record
    path = as_path(argument, source)
    return str(path), results.open(path).record


def comparison_parts(comparison: Comparison) -> Document:
    """Yield the differences of two results."""
    rows = [
        (
            row.name,
            short_text(row.difference),
            short_text(row.allowed),
            time_text(row.time),
            "ok" if row.ok else (row.note or "different"),
        )
        for row in comparison.rows
    ]
    data = [
        {
            "channel": row.name,
            "difference": finite(row.difference),
            "allowed": finite(row.allowed),
            "time": finite(row.time),
            "ok": row.ok,
            "note": row.note,
        }
        for row in comparison.rows
    ]
    yield Data({"same": comparison.same, "rows": data, "notes": list(comparison.notes)})
    yield Table(("channel", ">difference", ">allowed", ">time, s", ""), rows)
    yield from comparison.notes
    differing = sum(not row.ok for row in comparison.rows)
    if differing:
        yield "note: each difference is that of the sample that is furthest above what is allowed"
    yield f"{differing} of {len(comparison.rows)} differ" if differing else "the files agree"
