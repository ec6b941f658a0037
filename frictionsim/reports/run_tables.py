"""The tables of a report of runs: what was solved, quantities, audit, counts."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from frictionsim.reports.page import text
from frictionsim.reports.tables import Html, number, paragraph, section, short, table
from frictionsim.results import Check, Quantity

if TYPE_CHECKING:
    from frictionsim.reports.reported_run import ReportedRun

# By status a sign, so that not only the colour tells it, and what it means.
STATUSES = {
    "done": ("\N{CHECK MARK}", "done"),
    "failed": ("\N{MULTIPLICATION X}", "failed"),
    "interrupted": ("\N{DOUBLE VERTICAL LINE}", "interrupted"),
}
UNSOUND = ("\N{WARNING SIGN}", "done, but its audit failed")
VERSION_1 = (
    "This result is from a file of format version 1, which holds no quantities, audit and counts;"
    " solve its scenario again to have them."
)
NO_SAMPLES = "This result has no samples: there is nothing to draw, only tables."


def overview(runs: "Sequence[ReportedRun]") -> str:
    """Return what was solved and how it ended: lines of one run, a table of several."""
    if len(runs) > 1:
        headings = ["result", "title", "status", "law", "backend", "effects", "file"]
        rows = [
            (
                run.label,
                run.attribute("title"),
                Html(status(run)),
                run.attribute("law"),
                run.attribute("backend"),
                ", ".join(run.effects),
                "" if run.path is None else str(run.path),
            )
            for run in runs
        ]
        found = table("The results of this comparison", headings, rows)
        return found + "".join(_notes(run, f"{run.label}: ") for run in runs)
    run = runs[0]
    facts = [
        ("kind", run.attribute("kind")),
        ("effects", ", ".join(run.effects) or "none"),
        ("friction law", run.attribute("law") or "none"),
        ("backend", run.attribute("backend")),
    ]
    items = "".join(f"<div><dt>{text(n)}</dt><dd>{text(v)}</dd></div>" for n, v in facts)
    return f'<p>{status(run)}</p>\n<dl class="facts">{items}</dl>\n{_notes(run)}'


def status(run: "ReportedRun") -> str:
    """Return the status of a run in words, with a sign and the reason, as HTML."""
    word, reason = run.attribute("status"), run.attribute("reason")
    sign, words = UNSOUND if word == "done" and reason else STATUSES.get(word, ("?", word))
    name = "unsound" if (sign, words) == UNSOUND else word
    why = f": {text(reason)}" if reason else ""
    return (
        f'<span class="status" data-status="{text(name)}"><span aria-hidden="true">{sign}</span>'
        f" {text(words)}</span>{why}"
    )


def _notes(run: "ReportedRun", source: str = "") -> str:
    """Return what is missing in a run, as HTML."""
    notes = []
    if run.attribute("status") in ("failed", "interrupted"):
        time = run.record.channels["time"]
        until = f" up to {time[-1]:.6g} s" if len(time) else ""
        notes.append(f"The run did not come to its end: what follows is what there is{until}.")
    if not len(run.record.channels["time"]):
        notes.append(NO_SAMPLES)
    if run.record.statistics is None:
        notes.append(VERSION_1)
    return "".join(f'<p class="note">{text(source + note)}</p>\n' for note in notes)


def warnings(runs: "Sequence[ReportedRun]") -> str:
    """Return the warnings of runs."""
    found = [(run, warning) for run in runs for warning in run.warnings]
    items = "".join(f"<li>{text(_source(runs, run) + warning)}</li>\n" for run, warning in found)
    return section("warnings", "Warnings", items and f"<ul>\n{items}</ul>")


def _source(runs: "Sequence[ReportedRun]", run: "ReportedRun") -> str:
    return f"{run.label}: " if len(runs) > 1 else ""


def summary(runs: "Sequence[ReportedRun]") -> str:
    """Return quantities, audit and counts of runs, side by side."""
    parts = [_quantities(runs), *(_estimate(runs, run) for run in runs), _audit(runs)]
    return section("summary", "Summary", "".join([*parts, _counts(runs)]))


def _quantities(runs: "Sequence[ReportedRun]") -> str:
    names = _names(run.record.quantities for run in runs)
    if not names:
        return ""
    headings = ["quantity", *(f">{heading}" for heading in _columns(runs)), "unit"]
    rows = [(name, *_values_of(runs, name), _unit_of(runs, name)) for name in names]
    return table("Quantities", headings, rows)


def _columns(runs: "Sequence[ReportedRun]") -> Iterator[str]:
    for run in runs:
        yield run.label if len(runs) > 1 else "value"
        if run.errors:
            yield f"error of {run.label}" if len(runs) > 1 else "error"
    if len(runs) == 2:
        yield f"{runs[1].label} less {runs[0].label}"


def _values_of(runs: "Sequence[ReportedRun]", name: str) -> Iterator[str]:
    """Yield the cells of a quantity, and the difference of two results."""
    found = [run.record.quantities.get(name) for run in runs]
    for run, quantity in zip(runs, found, strict=True):
        yield "" if quantity is None else number(quantity.value)
        if run.errors:
            error = run.errors.get(name)
            yield "" if error is None else f"{error:.1e}"
    if len(runs) == 2:
        yield _difference(*found)


def _difference(a: Quantity | None, b: Quantity | None) -> str:
    """Return the second quantity less the first; empty if one is not defined."""
    if a is None or b is None or a.unit != b.unit or a.value is None or b.value is None:
        return ""
    return short(b.value - a.value)


def _unit_of(runs: "Sequence[ReportedRun]", name: str) -> str:
    """Return the unit of a quantity; files of several versions may have several."""
    units = (run.record.quantities[name].unit for run in runs if name in run.record.quantities)
    return " or ".join(dict.fromkeys(units))


def _names(tables: Iterator[Mapping[str, object]]) -> list[str]:
    """Return the keys of several tables in their order."""
    return list(dict.fromkeys(name for found in tables for name in found))


def _estimate(runs: "Sequence[ReportedRun]", run: "ReportedRun") -> str:
    if not run.errors or not run.error_estimate:
        return ""
    return paragraph(_source(runs, run) + run.error_estimate)


def _audit(runs: "Sequence[ReportedRun]") -> str:
    names = _names(run.record.checks for run in runs)
    if not names:
        return ""
    headings = ["check"]
    for run in runs:
        of = f" of {run.label}" if len(runs) > 1 else ""
        headings += [f">value{of}", f">limit{of}", f"verdict{of}"]
    rows = [
        (name, *(cell for run in runs for cell in _check(run.record.checks.get(name))))
        for name in names
    ]
    return table("Audit: a value above its limit is a reason not to trust the run", headings, rows)


def _check(check: Check | None) -> tuple[str, str, str]:
    if check is None:
        return "", "", ""
    return short(check.value), short(check.limit), "ok" if check.ok else "FAILED"


def _counts(runs: "Sequence[ReportedRun]") -> str:
    found = [run for run in runs if run.record.statistics is not None]
    if not found:
        return ""
    headings = ["result", ">samples", ">events", ">states", ">steps", ">rejected steps"]
    rows = []
    for run in found:
        counts = run.record.statistics
        assert counts is not None, "those without were left out"
        samples, events = (len(of["time"]) for of in (run.record.channels, run.record.events))
        numbers = (samples, events, counts.states, counts.steps, counts.rejected)
        name = run.label if len(runs) > 1 else "run"
        rows.append((name, *map(str, numbers), str(counts.rhs_evaluations)))
    return table("Counts of the run", [*headings, ">evaluations of the right-hand side"], rows)
