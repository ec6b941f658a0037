"""Results as tables, in text and HTML; the only module beside `progress` that imports rich."""

from collections.abc import Iterator, Sequence
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.io.terminal import visible

if TYPE_CHECKING:
    from frictionsim.api.result import Result
    from frictionsim.io.comparison import Comparison
    from frictionsim.results import Check, Quantities, SolverStatistics, Transition

DIGITS = 10
WIDTH = 1000  # characters of a line: numbers are never truncated
MODE_NAMES = {0: "stick", 1: "slip +", -1: "slip -", 2: "open", 3: "taut", 4: "slack"}
# Of more events, the table shows the first ones and the last.
MAX_EVENTS = 20


class Cells(NamedTuple):
    """A table of text; a heading with a leading '>' is that of a column of numbers."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


Parts = Iterator[str | Cells]
"""Lines and tables, from top to bottom."""


def as_text(parts: "Iterator[str | Cells]") -> str:
    """Return lines and tables as text without trailing blanks."""
    return "\n".join(line for part in parts for line in _lines(part))


def _lines(part: str | Cells) -> list[str]:
    if isinstance(part, str):
        return [part]
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style=None)
    for heading in part.headings:
        right = heading.startswith(">")
        table.add_column(heading.lstrip(">"), justify="right" if right else "left", no_wrap=True)
    for row in part.rows:
        table.add_row(*row)
    text = StringIO()
    # No markup: titles and paths may contain brackets.
    Console(
        file=text, highlight=False, markup=False, emoji=False, width=WIDTH, no_color=True
    ).print(table)
    return [line.rstrip() for line in text.getvalue().splitlines()]


def as_html(parts: "Iterator[str | Cells]") -> str:
    """Return lines and tables as HTML, for notebooks."""
    return "<div>" + "".join(map(_html, parts)) + "</div>"


def _html(part: str | Cells) -> str:
    if isinstance(part, str):
        return f"<p>{escape(visible(part))}</p>"
    aligned = ["right" if heading.startswith(">") else "left" for heading in part.headings]
    rows = [
        _row("th", [heading.lstrip(">") for heading in part.headings], aligned),
        *(_row("td", cells, aligned) for cells in part.rows),
    ]
    return f"<table>{''.join(rows)}</table>"


def _row(tag: str, cells: Sequence[str], aligned: Sequence[str]) -> str:
    # A short row, as that of dots, is filled up.
    filled = [*cells, *[""] * (len(aligned) - len(cells))]
    inner = "".join(
        f'<{tag} style="text-align: {side}">{escape(visible(cell))}</{tag}>'
        for cell, side in zip(filled, aligned, strict=True)
    )
    return f"<tr>{inner}</tr>"


def summary(result: "Result") -> Parts:
    """Yield the summary of a result."""
    attributes = result.record.attributes
    effects = ", ".join(result.effects) or "none"
    law = f"law {attributes['law']}, " if attributes.get("law") else ""
    yield f"{result.title or result.kind}: {result.status}"
    yield f"kind {result.kind}, effects {effects}, {law}backend {attributes['backend']}"
    if result.quantities:
        yield quantities_table(result.quantities, result.errors)
    if result.errors:
        yield result.error_estimate
    if transitions := result.record.transitions:
        yield _transitions_table(transitions)
    if result.audit:
        yield _audit_table(result.audit)
    if result.statistics is not None:
        yield _statistics(result.statistics, len(result.record.channels["time"]))
    else:
        yield "from a file of format version 1, which holds no quantities, audit and counts"
    yield f"result: {result.path or 'none'}"


def quantities_table(
    quantities: "Quantities", errors: "dict[str, float | None] | None" = None
) -> Cells:
    """Return quantities with their units, and their errors if there are any."""
    headings = ["quantity", ">value", *((">error",) if errors else ()), "unit"]
    rows = [
        (name, _number(q.value), *((_error(errors.get(name)),) if errors else ()), q.unit)
        for name, q in quantities.items()
    ]
    return Cells(headings, rows)


def comparison(found: "Comparison") -> Parts:
    """Yield the largest differences of two results."""
    rows = [
        (
            row.name,
            _short(row.difference),
            _short(row.allowed),
            "" if row.time is None else f"{row.time:.9g}",
            "ok" if row.ok else (row.note or "different"),
        )
        for row in found.rows
    ]
    yield Cells(("channel", ">largest difference", ">allowed", ">time, s", ""), rows)
    yield from found.notes
    differing = sum(not row.ok for row in found.rows)
    yield f"{differing} of {len(found.rows)} differ" if differing else "the files agree"


def _statistics(statistics: "SolverStatistics", samples: int) -> str:
    compiled, seconds = statistics.compile_seconds, statistics.wall_seconds
    compilation = f" after {compiled:.3g} s of compilation" if compiled else ""
    solved = "" if seconds is None else f"solved in {seconds:.3g} s{compilation}: "
    return (
        f"{solved}{statistics.states} states,"
        f" {statistics.steps} steps, {statistics.rejected} rejected steps,"
        f" {statistics.rhs_evaluations} evaluations of the right-hand side"
        f" (including {samples} samples)"
    )


def _transitions_table(transitions: "list[Transition]") -> Cells:
    placed = any(transition.position is not None for transition in transitions)
    angle = (">angle, rad",) if placed else ()
    numbered = list(enumerate(transitions, start=1))
    if len(numbered) > MAX_EVENTS:
        shown, last = numbered[: MAX_EVENTS - 2], numbered[-1:]
    else:
        shown, last = numbered, []
    dots = [("...",)] if last else []
    rows = [
        *(_transition_cells(number, e) for number, e in shown),
        *dots,
        *(_transition_cells(number, e) for number, e in last),
    ]
    return Cells((">event", ">time, s", "contact", "from", "to", *angle), rows)


def _transition_cells(number: int, e: "Transition") -> tuple[str, ...]:
    modes = MODE_NAMES[e.mode_from], MODE_NAMES[e.mode_to]
    angle = () if e.position is None else (_number(e.position),)
    return (str(number), f"{e.time:.9f}", e.contact, *modes, *angle)


def _audit_table(checks: "dict[str, Check]") -> Cells:
    rows = [
        (name, _short(check.value), _short(check.limit), "ok" if check.ok else "FAILED")
        for name, check in checks.items()
    ]
    return Cells(("audit", ">value", ">limit", ""), rows)


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.{DIGITS}g}"


def _error(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def _short(value: float | None) -> str:
    return "" if value is None else f"{value + 0.0:.3g}"  # no -0
