"""The report of one run, or of several of a kind side by side: its page and the data of that."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import set_line, study_text, time_text, with_minus
from frictionsim.document import Block, Cell, Table
from frictionsim.reports.html import Html, escaped, folded, html, listed, region, section, table
from frictionsim.reports.page import page
from frictionsim.reports.run_charts import (
    TimePool,
    chart_data,
    charts_of,
    span_charts,
    thinned,
    undrawn,
)
from frictionsim.reports.run_tables import after_label, differences, event_cells, origins, summary
from frictionsim.simulation.record import event_labels, sticking_phases, sticking_words

if TYPE_CHECKING:
    from frictionsim.reports.run_tables import ReportedRun
    from frictionsim.results import Transition

BELT = "belt_drive"
MAX_MARKS = 60  # events; marks of more would hide the lines
MAX_STEPS = 4000  # of the clock


def run_report(runs: "Sequence[ReportedRun]") -> str:
    """Return the HTML of a report of runs of one kind."""
    title = runs[0].title
    if len(runs) > 1:
        title = f"Comparison: {', '.join(dict.fromkeys(run.title for run in runs))}"
    return page(title, _body(title, runs), data_of(runs))


def _body(title: str, runs: "Sequence[ReportedRun]") -> Html:
    head = f'<header>\n<h1>{escaped(title)}</h1>\n{overview(runs)}<div id="tools"></div></header>\n'
    viewer = (
        '<div id="viewer">\n<div id="stage">\n<div id="clock"></div>\n<div id="drawings"></div>\n'
        f"{events(runs)}</div>\n"
        '<section id="charts" aria-labelledby="charts-heading">\n'
        '<h2 id="charts-heading">Channels over time</h2>\n'
        '<p id="message" role="status"></p>\n'
        f"{_without_charts(runs)}</section>\n</div>\n"
    )
    tables = [section("Summary", *filter(_has_rows, summary(runs)), name="summary")]
    if len(runs) > 1:
        tables.append(section("Differing keys", differences(runs), name="differences"))
    origin = section("How it was made", origins(runs), name="origin")
    about = "Made by frictionsim. This file is self-contained: it makes no network requests."
    foot = f"<footer><p>{about}</p></footer>"
    return Html(
        f"{head}<main>\n{warnings(runs)}{viewer}"
        f'<div id="tables">\n{"".join(tables)}</div>\n{scenarios(runs)}{origin}</main>\n{foot}'
    )


def _has_rows(block: Block) -> bool:
    return not isinstance(block, Table) or bool(block.rows)


def _without_charts(runs: "Sequence[ReportedRun]") -> str:
    """Return the notes on channels without a chart, and for browsers without scripts."""
    notes = (
        "<noscript><p>Charts and drawing need scripts, which this browser does not run;"
        " the tables do not.</p></noscript>\n"
    )
    names = list(dict.fromkeys(name for run in runs for name in undrawn(run)))
    if names:
        words = (
            f"{', '.join(names)}: of each body or joint, so not charted over time;"
            " 'frictionsim show --csv' prints them."
        )
        notes += f'<p class="note" id="undrawn">{escaped(words)}</p>\n'
    return notes


def data_of(runs: "Sequence[ReportedRun]") -> dict[str, Any]:
    """Return the data of a report, for the scripts of its page."""
    times = TimePool()
    more = []
    if runs[0].attribute("kind") == BELT:
        more = span_charts(runs)
    charts = chart_data(charts_of(runs, more), times)
    results = [_result_data(run, times) for run in runs]
    return {"results": results, "charts": charts, "times": times.arrays}


def _result_data(run: "ReportedRun", times: TimePool) -> dict[str, Any]:
    record = run.record
    time = np.asarray(record.channels["time"], dtype=float)
    names = event_labels(record)
    return {
        "label": run.label,
        "kind": run.attribute("kind"),
        "motion": None,
        "no_motion": "",
        # A clock that goes from sample to sample needs no more of them than a line.
        "steps": times.number(time[thinned(time, MAX_STEPS)]),
        "sticking": [list(phase) for phase in sticking_phases(record)] if time.size else [],
        "sticking_words": sticking_words(record),
        "events": {
            "time": np.asarray(record.events["time"], dtype=float),
            "names": names if len(names) <= MAX_MARKS else [],
        },
    }


# By status a sign, so that not only the colour tells it, and what it means.
STATUSES = {
    "done": ("\N{CHECK MARK}", "done"),
    "failed": ("\N{MULTIPLICATION X}", "failed"),
    "interrupted": ("\N{DOUBLE VERTICAL LINE}", "interrupted"),
}
AUDIT_FAILED = ("\N{WARNING SIGN}", "done, but its audit failed")
NO_SAMPLES = "This result has no samples: there is nothing to draw, only tables."


def overview(runs: "Sequence[ReportedRun]") -> Html:
    """Return the scenario and outcome: lines of one run, a table of several."""
    if len(runs) > 1:
        headings = ["result", "title", "status", "law", "backend", "effects", "set", "file"]
        rows = [
            (
                run.label,
                run.attribute("title"),
                status(run),
                run.attribute("law"),
                run.attribute("backend"),
                ", ".join(run.effects),
                _set(run),
                "" if run.path is None else str(run.path),
            )
            for run in runs
        ]
        compared = html(Table(headings, rows, "The results of this comparison"))
        return Html(compared + "".join(_notes(run) for run in runs))
    run = runs[0]
    facts = [
        ("kind", run.attribute("kind")),
        ("effects", ", ".join(run.effects) or "none"),
        ("friction law", run.attribute("law") or "none"),
        ("backend", run.attribute("backend")),
    ]
    if overrides := _set(run):
        facts.append(("set", overrides))
    items = "".join(f"<div><dt>{escaped(n)}</dt><dd>{escaped(v)}</dd></div>" for n, v in facts)
    return Html(f'<p>{status(run)}</p>\n<dl class="facts">{items}</dl>\n{_notes(run)}')


def _set(run: "ReportedRun") -> str:
    """Return the overrides of a run; empty without any."""
    return set_line(run.record.attributes).removeprefix("set: ")


def status(run: "ReportedRun") -> Html:
    """Return the status of a run in words, with a sign and the reason."""
    word, reason = run.attribute("status"), run.attribute("reason")
    sign, words = AUDIT_FAILED if word == "done" and reason else STATUSES.get(word, ("?", word))
    name = "audit-failed" if (sign, words) == AUDIT_FAILED else word
    why = f": {escaped(reason)}" if reason else ""
    return Html(
        f'<span class="status" data-status="{escaped(name)}"><span aria-hidden="true">{sign}</span>'
        f" {escaped(words)}</span>{why}"
    )


def _notes(run: "ReportedRun") -> str:
    """Return the missing parts of a run, as HTML."""
    notes = []
    if run.attribute("status") in ("failed", "interrupted"):
        time = run.record.channels["time"]
        until = f" up to {study_text(time[-1])} s" if len(time) else ""
        notes.append(f"The run did not come to its end: what follows is what there is{until}.")
    if not len(run.record.channels["time"]):
        notes.append(NO_SAMPLES)
    return "".join(f'<p class="note">{escaped(after_label(run, note))}</p>\n' for note in notes)


def warnings(runs: "Sequence[ReportedRun]") -> Html:
    """Return the warnings of runs."""
    texts = (after_label(run, warning) for run in runs for warning in run.warnings)
    return section("Warnings", listed(texts), name="warnings")


MAX_EVENTS = 5000  # more make a page slow
ANGLE_DIGITS = 6  # more make the table wider than its place beside the charts


def events(runs: "Sequence[ReportedRun]") -> Html:
    """Return the section of the events of runs by time."""
    count = sum(len(run.record.events["time"]) for run in runs)
    if not count:
        return section("Events", "There are no events.", name="events")
    rows = [
        (e, name, run.label)
        for run in runs
        for e, name in zip(run.record.transitions, event_labels(run.record), strict=True)
    ]
    rows.sort(key=lambda row: row[0].time)
    placed = any("angle" in run.record.events for run in runs)
    headings = ["time, s", "event", "contact", "from", "to"]
    headings += [">angle, rad"] if placed else []
    headings += ["result"] if len(runs) > 1 else []
    shown = [_cells(*row, len(headings)) for row in rows[:MAX_EVENTS]]
    caption = "Events; a button sets the clock to its time"
    scrolled = region("scrolled", "Events", table(Table(headings, shown, caption)))
    more = [f"The first {MAX_EVENTS} of {count} events."] if count > MAX_EVENTS else []
    return section(f"Events ({count})", scrolled, *more, name="events")


def _cells(e: "Transition", name: str, label: str, columns: int) -> list[Cell]:
    """Return the cells of an event; of one without an angle, that is empty."""
    time = with_minus(time_text(e.time))
    button = f'<button type="button" data-time="{e.time!r}">{escaped(time)}</button>'
    cells: list[Cell] = [Html(button), name, *event_cells(e, ANGLE_DIGITS)]
    ending = [label] if label else []
    return [*cells, *[""] * (columns - len(cells) - len(ending)), *ending]


def scenarios(runs: "Sequence[ReportedRun]") -> Html:
    """Return the scenarios of runs as TOML."""
    parts = []
    for run in runs:
        words = f"Scenario of {run.label}" if run.label else "After overrides, as it was solved"
        parts.append(folded(words, run.attribute("scenario").strip()))
    return section("Scenario", *parts, name="scenario")
