"""The events of runs as a table, whose rows set the clock of the page to their time."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from frictionsim.reports.page import text
from frictionsim.reports.tables import Cell, Html, paragraph, section, table, with_minus
from frictionsim.results import MODES
from frictionsim.simulation.phases import event_names

if TYPE_CHECKING:
    from frictionsim.reports.reported_run import ReportedRun

MAX_EVENTS = 5000  # more make a page slow
ANGLE_DIGITS = 6  # more make the table wider than its place beside the charts
MODE_WORDS = {value: word.replace("_", " ") for value, word in MODES}


def events(runs: "Sequence[ReportedRun]") -> str:
    """Return the events of runs by time, in a section of its own; empty if there are none."""
    count = sum(len(run.record.events["time"]) for run in runs)
    if not count:
        return section("events", "Events", paragraph("There are no events."))
    rows = sorted((row for run in runs for row in _rows(run)), key=lambda row: row[0])
    placed = any("angle" in run.record.events for run in runs)
    headings = ["time, s", "event", "contact", "from", "to"]
    headings += [">angle, rad"] if placed else []
    headings += ["result"] if len(runs) > 1 else []
    shown = [_cells(row, placed, several=len(runs) > 1) for row in rows[:MAX_EVENTS]]
    more = paragraph(f"The first {MAX_EVENTS} of {count} events.") if count > MAX_EVENTS else ""
    found = table("Events; a button sets the clock to its time", headings, shown)
    wrapped = (
        f'<div class="scrolled" tabindex="0" role="region" aria-label="Events">{found}</div>\n'
    )
    return section("events", f"Events ({count})", wrapped + more)


_Row = tuple[float, str, str, int, int, float | None, str]


def _rows(run: "ReportedRun") -> Iterator[_Row]:
    for e, name in zip(run.record.transitions, event_names(run.record), strict=True):
        yield e.time, name, e.contact, e.mode_from, e.mode_to, e.position, run.label


def _cells(row: _Row, placed: bool, several: bool) -> list[Cell]:
    time, name, contact, before, after, angle, label = row
    button = (
        f'<button type="button" data-time="{time!r}">{text(with_minus(f"{time:.9g}"))}</button>'
    )
    cells: list[Cell] = [Html(button), name, contact, MODE_WORDS[before], MODE_WORDS[after]]
    cells += ["" if angle is None else f"{angle:.{ANGLE_DIGITS}g}"] if placed else []
    return [*cells, label] if several else cells
