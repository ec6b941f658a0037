"""The report of one run, or of several of a kind side by side: its page and the data of that."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import (
    event_colour,
    overrides_of,
    study_text,
    time_text,
    with_minus,
    with_unit,
)
from frictionsim.document import Block, Cell, Table
from frictionsim.errors import InputError
from frictionsim.motion import motion_of, motions_compared
from frictionsim.reports.charts import figure_of, panels_of, thinned, undrawn, wear_figure
from frictionsim.reports.drawing import Drawing
from frictionsim.reports.html import Html, escaped, folded, html, listed, page, section, table
from frictionsim.reports.run_tables import after_label, differences, event_cells, origins, summary
from frictionsim.scenario.kinds import unit_of
from frictionsim.simulation.record import event_labels

if TYPE_CHECKING:
    from frictionsim.motion.parts import Motion
    from frictionsim.reports.run_tables import ReportedRun
    from frictionsim.results import Transition

MAX_STEPS = 4000  # of the clock


def run_report(runs: "Sequence[ReportedRun]") -> str:
    """Return the HTML of a report of runs of one kind."""
    title = runs[0].title
    if len(runs) > 1:
        title = f"Comparison: {', '.join(dict.fromkeys(run.title for run in runs))}"
    stage, data = _stage(runs)
    tables = [section("Summary", *filter(_has_rows, summary(runs)), name="summary")]
    if len(runs) > 1:
        tables.append(section("Differing keys", differences(runs), name="differences"))
    return page(
        title,
        Html(
            f"<header>\n<h1>{escaped(title)}</h1>\n{overview(runs)}</header>\n<main>\n"
            f"{warnings(runs)}{stage}{CLOCK if data else ''}"
            f'<div id="tables">\n{"".join(tables)}</div>\n{scenarios(runs)}'
            f"{section('How it was made', origins(runs), name='origin')}</main>\n"
        ),
        data,
    )


def _has_rows(block: Block) -> bool:
    return not isinstance(block, Table) or bool(block.rows)


CLOCK = Html(
    '<div id="clock"><button type="button" id="back" title="to the event before: shift and left">'
    "&lsaquo; event</button>"
    '<button type="button" id="play" title="play or pause: space">play</button>'
    '<button type="button" id="ahead" title="to the next event: shift and right">'
    "event &rsaquo;</button>"
    '<input type="range" id="time" aria-label="time" step="any">'
    '<output id="shown"></output><label>speed <select id="speed"></select></label></div>\n'
)


def _stage(runs: "Sequence[ReportedRun]") -> tuple[Html, dict[str, Any]]:
    """Return drawings and charts, and the data for the player; nothing without samples."""
    shown = [run for run in runs if len(run.record.channels["time"])]
    if not shown:
        return events(runs), {}
    drawings, frames = _drawings(shown)
    records, labels = [run.record for run in shown], [run.label for run in shown]
    panels = panels_of(records)
    first, more = ([p for p in panels if p.first is seen] for seen in (True, False))
    figures, charts = {"charts": figure_of(first, records, labels)}, '<div id="charts"></div>'
    if more:
        figures["more"] = figure_of(more, records, labels)
        charts += '<details><summary>More channels</summary><div id="more"></div></details>'
    if (wear := wear_figure(records, labels)) is not None:
        figures["wear"] = wear
        charts += '<h2>Wear at the end</h2><div id="wear"></div>'
    names = list(dict.fromkeys(name for run in runs for name in undrawn(run.record)))
    if names:
        words = f"{', '.join(names)}: of each body or joint, so not charted over time;"
        charts += f"<p class=\"note\">{escaped(words)} 'frictionsim show --csv' prints them.</p>"
    steps = [np.asarray(record.channels["time"], dtype=float) for record in records]
    marks = [np.asarray(record.events["time"], dtype=float) for record in records]
    shown_steps = [time[thinned(time, MAX_STEPS)] for time in steps]
    data = {
        "steps": np.unique(np.concatenate(shown_steps)).tolist(),
        "events": np.unique(np.concatenate(marks)).tolist(),
        "drawings": frames,
        "charts": figures,
    }
    return Html(
        f'<div id="viewer">\n<div id="stage">{drawings}{events(runs)}</div>\n'
        f'<section id="channels">{charts}</section>\n</div>\n'
    ), data


def _drawings(runs: "Sequence[ReportedRun]") -> tuple[str, list[dict[str, Any]]]:
    """Return the drawings with the table beside them, and their frames."""
    figures, frames, rows = "", [], dict[str, list[str]]()
    samples: dict[str, Html] = {}
    motions: list[Motion | None] = []
    reasons: list[str] = []
    for run in runs:
        reason = f"There is no drawing of the kind {run.attribute('kind')}."
        try:
            motions.append(motion_of(run.record))
        except InputError as error:
            motions.append(None)
            reason = str(error)
        reasons.append(reason)
    motions = motions_compared([run.record for run in runs], motions)
    for number, (run, motion) in enumerate(zip(runs, motions, strict=True)):
        label = f"<figcaption>{escaped(run.label)}</figcaption>" if run.label else ""
        if motion is None:
            figures += f'<figure>{label}<p class="note">{escaped(reasons[number])}</p></figure>'
            continue
        drawing = Drawing(motion, f"m{number}", f"The mechanism in motion {run.label}".strip())
        look = "wide" if drawing.is_wide else "tall"
        figures += f'<figure class="{look}">{label}{drawing.svg}</figure>'
        tracks = list(map(list, drawing.tracks))
        for row, (sample, name, values) in enumerate(drawing.rows):
            cells = rows.setdefault(name, [""] * len(runs))
            samples[name] = samples.get(name) or sample
            if values:
                own = f"v{number}-{row}"
                cells[number] = f'<output id="{own}">{escaped(values[0])}</output>'
                if len(set(values)) > 1:
                    tracks.append([[own], "text", values])
        frames.append({"time": motion.time.tolist(), "tracks": tracks})
    return f'<div id="drawings">{figures}{_key(runs, rows, samples)}</div>', frames


def _key(
    runs: "Sequence[ReportedRun]", rows: dict[str, list[str]], samples: dict[str, Html]
) -> str:
    """Return the table of what is drawn, with sizes of forces and other numbers."""
    if not rows:
        return ""
    heads = "".join(f'<th scope="col">{escaped(run.label)}</th>' for run in runs)
    head = f"<thead><tr><td></td><td></td>{heads}</tr></thead>" if len(runs) > 1 else ""
    body = "".join(
        f'<tr><td>{samples[name]}</td><th scope="row">{escaped(name)}</th>'
        f"{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>\n"
        for name, cells in rows.items()
    )
    return f'<table id="key" aria-label="Key">{head}<tbody>{body}</tbody></table>'


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
                ", ".join(run.result.effects),
                _overrides(run),
                str(run.result.path or ""),
            )
            for run in runs
        ]
        compared = html(Table(headings, rows, "The results of this comparison"))
        return Html(compared + "".join(_notes(run) for run in runs))
    run = runs[0]
    facts = [
        ("kind", run.attribute("kind")),
        ("effects", ", ".join(run.result.effects) or "none"),
        ("friction law", run.attribute("law") or "none needed"),
        ("backend", run.attribute("backend")),
    ]
    if overrides := _overrides(run):
        facts.append(("set", overrides))
    items = "".join(f"<div><dt>{escaped(n)}</dt><dd>{escaped(v)}</dd></div>" for n, v in facts)
    return Html(f'<p>{status(run)}</p>\n<dl class="facts">{items}</dl>\n{_notes(run)}')


def _overrides(run: "ReportedRun") -> str:
    """Return the overrides of a run; empty without any."""
    attributes = run.record.attributes
    return ", ".join(
        f"{key} = {with_unit(value, unit_of(attributes['kind'], key))}"
        for key, value in overrides_of(attributes).items()
    )


def status(run: "ReportedRun") -> Html:
    """Return the status of a run in words, with a sign and the reason."""
    word, reason = run.attribute("status"), run.attribute("reason")
    sign, words = AUDIT_FAILED if word == "done" and reason else STATUSES[word]
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
    texts = (after_label(run, warning) for run in runs for warning in run.record.warnings)
    return section("Warnings", listed(texts), name="warnings")


MAX_EVENTS = 5000  # more make a page slow
FIRST_EVENTS = 20  # that are seen; the others are folded away
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
    more = [f"The first {MAX_EVENTS} of {count} events."] if count > MAX_EVENTS else []
    listing: str = table(Table(headings, shown[:FIRST_EVENTS], caption))
    if len(shown) > FIRST_EVENTS:
        rest = table(Table(headings, shown[FIRST_EVENTS:], "Events after these"))
        words = f"{len(shown) - FIRST_EVENTS} more events"
        listing += f"<details><summary>{words}</summary>{rest}</details>"
    return section(f"Events ({count})", Html(listing), *more, name="events")


def _cells(e: "Transition", name: str, label: str, columns: int) -> list[Cell]:
    """Return the cells of an event; of one without an angle, that is empty."""
    time = with_minus(time_text(e.time))
    button = f'<button type="button" data-time="{e.time!r}">{escaped(time)}</button>'
    dot = f'<span class="dot" style="background:{event_colour(name)}"></span>'
    cells: list[Cell] = [Html(button), Html(dot + escaped(name)), *event_cells(e, ANGLE_DIGITS)]
    last = [label] if label else []
    return [*cells, *[""] * (columns - len(cells) - len(last)), *last]


def scenarios(runs: "Sequence[ReportedRun]") -> Html:
    """Return the scenarios of runs as TOML."""
    parts = []
    for run in runs:
        words = f"Scenario of {run.label}" if run.label else "After overrides, as it was solved"
        parts.append(folded(words, run.attribute("scenario").strip()))
    return section("Scenario", *parts, name="scenario")
