"""The tables of a report of runs: what was solved, quantities, audit, solver statistics."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.display import MODE_WORDS, error_text, number_text, short_text, with_minus
from frictionsim.document import Cell, Table
from frictionsim.errors import InputError
from frictionsim.reports.html import Html, escaped, folded, html, listed, region, section, table
from frictionsim.results import Check, Quantity
from frictionsim.scenario.toml_data import differing_keys
from frictionsim.simulation.record import event_names

if TYPE_CHECKING:
    from frictionsim.results import Record


class ReportedRun(NamedTuple):
    """A run as its report shows it.

    Attributes
    ----------
    record : Record
    path : Path or None
        Of its file.
    label : str
        Its name among the runs of a comparison.
    effects : tuple of str
        The effects that were simulated.
    errors : mapping
        The estimated error by quantity; empty if they were not estimated.
    error_estimate : str
        How they were estimated.
    """

    record: "Record"
    path: Path | None = None
    label: str = ""
    effects: tuple[str, ...] = ()
    errors: Mapping[str, float | None] = {}
    error_estimate: str = ""

    def attribute(self, name: str) -> str:
        """Return a root attribute of its file; empty if it has none of that name."""
        return self.record.attributes.get(name, "")

    @property
    def title(self) -> str:
        """The title of the scenario, or the kind."""
        return self.attribute("title") or self.attribute("kind")

    @property
    def warnings(self) -> list[str]:
        """Reasons to doubt the quantities."""
        return list(filter(None, self.attribute("warnings").split("\n")))


def labels_of(paths: Sequence[Path | None]) -> list[str]:
    """Return a name for each result of a comparison: that of its file, and as much more as needed.

    Parameters
    ----------
    paths : sequence of Path or None
        None of a result without a file.
    """
    stems = ["" if path is None else path.stem for path in paths]
    names = [
        f"result {number}" if path is None else stem if stems.count(stem) == 1 else str(path)
        for number, (path, stem) in enumerate(zip(paths, stems, strict=True), start=1)
    ]
    if len(set(names)) == len(names):
        return names
    return [f"{number}: {name}" for number, name in enumerate(names, start=1)]


MAX_EVENTS = 5000  # more make a page slow
ANGLE_DIGITS = 6  # more make the table wider than its place beside the charts


def events(runs: "Sequence[ReportedRun]") -> Html:
    """Return the section of the events of runs by time."""
    count = sum(len(run.record.events["time"]) for run in runs)
    if not count:
        return section("Events", "There are no events.", name="events")
    rows = sorted((row for run in runs for row in _rows(run)), key=lambda row: row[0])
    placed = any("angle" in run.record.events for run in runs)
    headings = ["time, s", "event", "contact", "from", "to"]
    headings += [">angle, rad"] if placed else []
    headings += ["result"] if len(runs) > 1 else []
    shown = [_cells(row, placed, several=len(runs) > 1) for row in rows[:MAX_EVENTS]]
    caption = "Events; a button sets the clock to its time"
    scrolled = region("scrolled", "Events", table(Table(headings, shown, caption)))
    more = [f"The first {MAX_EVENTS} of {count} events."] if count > MAX_EVENTS else []
    return section(f"Events ({count})", scrolled, *more, name="events")


_Row = tuple[float, str, str, int, int, float | None, str]


def _rows(run: "ReportedRun") -> Iterator[_Row]:
    for e, name in zip(run.record.transitions, event_names(run.record), strict=True):
        yield e.time, name, e.contact, e.mode_from, e.mode_to, e.position, run.label


def _cells(row: _Row, placed: bool, several: bool) -> list[Cell]:
    time, name, contact, before, after, angle, label = row
    button = (
        f'<button type="button" data-time="{time!r}">{escaped(with_minus(f"{time:.9g}"))}</button>'
    )
    cells: list[Cell] = [Html(button), name, contact, MODE_WORDS[before], MODE_WORDS[after]]
    cells += ["" if angle is None else f"{angle:.{ANGLE_DIGITS}g}"] if placed else []
    return [*cells, label] if several else cells


ABSENT = "\N{EM DASH}"
MAX_VALUE = 120  # characters of a value in a table


def scenarios(runs: "Sequence[ReportedRun]") -> Html:
    """Return the scenarios of runs as TOML."""
    parts = []
    for run in runs:
        words = f"Scenario of {run.label}" if len(runs) > 1 else "After overrides, as it was solved"
        parts.append(folded(words, run.attribute("scenario").strip()))
    return section("Scenario", *parts, name="scenario")


def differences(runs: "Sequence[ReportedRun]") -> Html:
    """Return the keys in which the scenarios of several runs differ, with their values."""
    if len(runs) < 2:
        return Html()
    try:
        differing = differing_keys([run.record for run in runs])
    except InputError as error:
        return section("Differing keys", str(error), name="differences")
    rows = [(name, *map(_cell, values)) for name, values in differing.items()]
    headings = ["key", *(run.label for run in runs)]
    caption = f"Keys in which the scenarios differ; {ABSENT} where there is none"
    shown = Table(headings, rows, caption) if rows else "The scenarios are the same."
    return section("Differing keys", shown, name="differences")


def _cell(value: Any) -> str:
    text = ABSENT if value is None else _value(value)
    return text if len(text) <= MAX_VALUE else f"{text[: MAX_VALUE - 3]}..."


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def origins(runs: "Sequence[ReportedRun]") -> Html:
    """Return the origin of the results: version, file, command, overrides."""
    names = [run.label if len(runs) > 1 else "value" for run in runs]
    asked = {
        "version of frictionsim": "frictionsim_version",
        "format version": "format_version",
        "scenario file": "source",
        "overrides": "overrides",
        "command": "command",
    }
    rows = [("result file", *("" if run.path is None else str(run.path) for run in runs))]
    for words, attribute in asked.items():
        values = [" ".join(run.attribute(attribute).split("\n")) for run in runs]
        if any(values):
            rows.append((words, *values))
    return section("How it was made", Table(["property", *names], rows, "Origin"), name="origin")


# By status a sign, so that not only the colour tells it, and what it means.
STATUSES = {
    "done": ("\N{CHECK MARK}", "done"),
    "failed": ("\N{MULTIPLICATION X}", "failed"),
    "interrupted": ("\N{DOUBLE VERTICAL LINE}", "interrupted"),
}
AUDIT_FAILED = ("\N{WARNING SIGN}", "done, but its audit failed")
VERSION_1 = (
    "This result is from a file of format version 1, which holds no quantities, audit and counts;"
    " solve its scenario again to have them."
)
NO_SAMPLES = "This result has no samples: there is nothing to draw, only tables."


def overview(runs: "Sequence[ReportedRun]") -> Html:
    """Return the scenario and outcome: lines of one run, a table of several."""
    if len(runs) > 1:
        headings = ["result", "title", "status", "law", "backend", "effects", "file"]
        rows = [
            (
                run.label,
                run.attribute("title"),
                status(run),
                run.attribute("law"),
                run.attribute("backend"),
                ", ".join(run.effects),
                "" if run.path is None else str(run.path),
            )
            for run in runs
        ]
        compared = html(Table(headings, rows, "The results of this comparison"))
        return Html(compared + "".join(_notes(run, f"{run.label}: ") for run in runs))
    run = runs[0]
    facts = [
        ("kind", run.attribute("kind")),
        ("effects", ", ".join(run.effects) or "none"),
        ("friction law", run.attribute("law") or "none"),
        ("backend", run.attribute("backend")),
    ]
    items = "".join(f"<div><dt>{escaped(n)}</dt><dd>{escaped(v)}</dd></div>" for n, v in facts)
    return Html(f'<p>{status(run)}</p>\n<dl class="facts">{items}</dl>\n{_notes(run)}')


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


def _notes(run: "ReportedRun", source: str = "") -> str:
    """Return the missing parts of a run, as HTML."""
    notes = []
    if run.attribute("status") in ("failed", "interrupted"):
        time = run.record.channels["time"]
        until = f" up to {time[-1]:.6g} s" if len(time) else ""
        notes.append(f"The run did not come to its end: what follows is what there is{until}.")
    if not len(run.record.channels["time"]):
        notes.append(NO_SAMPLES)
    if run.record.statistics is None:
        notes.append(VERSION_1)
    return "".join(f'<p class="note">{escaped(source + note)}</p>\n' for note in notes)


def warnings(runs: "Sequence[ReportedRun]") -> Html:
    """Return the warnings of runs."""
    texts = (_source(runs, run) + warning for run in runs for warning in run.warnings)
    return section("Warnings", listed(texts), name="warnings")


def _source(runs: "Sequence[ReportedRun]", run: "ReportedRun") -> str:
    return f"{run.label}: " if len(runs) > 1 else ""


def summary(runs: "Sequence[ReportedRun]") -> Html:
    """Return quantities, audit and solver statistics of runs, side by side."""
    estimates = (
        _source(runs, run) + run.error_estimate for run in runs if run.errors and run.error_estimate
    )
    blocks: list[str | Table] = [_quantities(runs), *estimates, _audit(runs), _counts(runs)]
    shown = (block for block in blocks if isinstance(block, str) or block.rows)
    return section("Summary", *shown, name="summary")


def _quantities(runs: "Sequence[ReportedRun]") -> Table:
    names = _names(run.record.quantities for run in runs)
    headings = ["quantity", *(f">{heading}" for heading in _columns(runs)), "unit"]
    rows = [(name, *_values_of(runs, name), _unit_of(runs, name)) for name in names]
    return Table(headings, rows, "Quantities")


def _columns(runs: "Sequence[ReportedRun]") -> Iterator[str]:
    for run in runs:
        yield run.label if len(runs) > 1 else "value"
        if run.errors:
            yield f"error of {run.label}" if len(runs) > 1 else "error"
    if len(runs) == 2:
        yield f"{runs[1].label} less {runs[0].label}"


def _values_of(runs: "Sequence[ReportedRun]", name: str) -> Iterator[str]:
    """Yield the cells of a quantity, and the difference of two results."""
    quantities = [run.record.quantities.get(name) for run in runs]
    for run, quantity in zip(runs, quantities, strict=True):
        yield "" if quantity is None else number_text(quantity.value)
        if run.errors:
            yield error_text(run.errors.get(name))
    if len(runs) == 2:
        yield _difference(*quantities)


def _difference(a: Quantity | None, b: Quantity | None) -> str:
    """Return the second quantity less the first; empty if one is not defined."""
    if a is None or b is None or a.unit != b.unit or a.value is None or b.value is None:
        return ""
    return short_text(b.value - a.value)


def _unit_of(runs: "Sequence[ReportedRun]", name: str) -> str:
    """Return the unit of a quantity; files of several versions may have several."""
    units = (run.record.quantities[name].unit for run in runs if name in run.record.quantities)
    return " or ".join(dict.fromkeys(units))


def _names(tables: Iterator[Mapping[str, object]]) -> list[str]:
    """Return the keys of several tables in their order."""
    return list(dict.fromkeys(name for table in tables for name in table))


def _audit(runs: "Sequence[ReportedRun]") -> Table:
    names = _names(run.record.checks for run in runs)
    headings = ["check"]
    for run in runs:
        of = f" of {run.label}" if len(runs) > 1 else ""
        headings += [f">value{of}", f">limit{of}", f"verdict{of}"]
    rows = [
        (name, *(cell for run in runs for cell in _check(run.record.checks.get(name))))
        for name in names
    ]
    return Table(headings, rows, "Audit: a value above its limit is a reason not to trust the run")


def _check(check: Check | None) -> tuple[str, str, str]:
    if check is None:
        return "", "", ""
    return short_text(check.value), short_text(check.limit), "ok" if check.ok else "FAILED"


def _counts(runs: "Sequence[ReportedRun]") -> Table:
    headings = ["result", ">samples", ">events", ">states", ">steps", ">rejected steps"]
    rows = []
    for run in runs:
        counts = run.record.statistics
        if counts is None:
            continue
        samples, events = (len(of["time"]) for of in (run.record.channels, run.record.events))
        numbers = (samples, events, counts.states, counts.steps, counts.rejected)
        name = run.label if len(runs) > 1 else "run"
        rows.append((name, *map(str, numbers), str(counts.rhs_evaluations)))
    headings.append(">evaluations of the right-hand side")
    return Table(headings, rows, "Solver statistics")
